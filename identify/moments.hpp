// SPDX-License-Identifier: Apache-2.0
/// \file
/// Second moments of a regression from one pass, summed over blocks of time, and their long-run covariance.
///
/// Least squares, instrumental variables, their corrections for noise, their covariances under autocorrelation,
/// bootstrap and sign-perturbed sums are all functions of these moments.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"

namespace wheelwright::identify::gram_kernels {
struct Matrix;
}  // namespace wheelwright::identify::gram_kernels

namespace wheelwright::identify {

/// At most 2·`kept` block sums: whenever they are full, neighbours are added up and blocks become twice as long.
class BlockSums {
 public:
  /// `dimension` of the series; `kept` >= 8 blocks are held at least once that many values have come.
  explicit BlockSums(std::size_t dimension, std::size_t kept = 1024);
  /// The next value of the series.
  void add(const Eigen::Ref<const Eigen::VectorXd>& value);
  /// Number of values seen.
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Sums of the full blocks, one a column.
  [[nodiscard]] Eigen::MatrixXd blocks() const { return sums_.leftCols(static_cast<Eigen::Index>(full_)); }
  /// Values in each full block.
  [[nodiscard]] std::size_t block_length() const { return length_; }

 private:
  std::size_t capacity_;
  std::size_t length_ = 1;
  std::size_t full_ = 0;
  std::size_t in_current_ = 0;
  std::size_t count_ = 0;
  Eigen::MatrixXd sums_;
  Eigen::VectorXd current_;
};

/// A covariance that allows for autocorrelation.
struct LongRunCovariance {
  Eigen::MatrixXd matrix;  ///< covariance of the *sum* of the series
  double freedom = 0.0;    ///< degrees of freedom for Student's t
};

/// Covariance of the sum of a mean-zero series by the equal-weighted cosine estimator: the average over B cosine
/// frequencies of the squared projections, with t_B critical values (Lazarus, Lewis, Stock and Watson 2018).
/// B = 0.4·(blocks)^{2/3}, at least 4 and at most `most_frequencies`; fewer cosines stay valid under slower noise, at
/// the price of heavier t tails.
[[nodiscard]] LongRunCovariance long_run_covariance(const BlockSums& series, std::size_t most_frequencies = 24);

/// The same from the sums of a mean-zero series over all its blocks of time, one a column; the series is taken whole.
[[nodiscard]] LongRunCovariance long_run_covariance(const Eigen::MatrixXd& block_sums,
                                                    std::size_t most_frequencies = 24);

/// Degrees of freedom that long_run_covariance() by so many `frequencies` has for a series whose squares are expected
/// in proportion to `squares`, summed over its blocks of time: those of a series that is as large everywhere, and about
/// one where nearly all of it lies in one stretch (Satterthwaite: (tr M)²/tr M², M the covariance of the cosines'
/// projections). Blocks may be longer than those of the covariance, but more than the frequencies; else these are as
/// many as can be told.
[[nodiscard]] double effective_freedom(const Eigen::RowVectorXd& squares, std::size_t frequencies);

/// Sums over instants, of one output or of several with weights.
struct MomentSums {
  Eigen::MatrixXd YY;  ///< p × p, Σ YᵀY
  Eigen::VectorXd Yy;  ///< p, Σ Yᵀy
  double yy = 0.0;     ///< Σ y²
  Eigen::MatrixXd ZY;  ///< p × p, Σ ZᵀY with the instruments Z; empty without
  Eigen::VectorXd Zy;  ///< p, Σ Zᵀy
  Eigen::MatrixXd ZZ;  ///< p × p, Σ ZᵀZ
};

/// A stretch of time over which moments were summed.
struct MomentBlock {
  double first = 0.0;  ///< time of its first instant, s
  double last = 0.0;   ///< time of its last instant, s
  std::size_t instants = 0;
};

/// Moments of a regression by output and block of time. At most 2·`kept` blocks: whenever they are full, neighbours are
/// added up and blocks become twice as long.
class RegressionMoments {
 public:
  /// For `outputs` n and `parameters` p; with `instruments`, rows have 2p columns, those of Y and then those of Z
  /// (instruments.hpp makes such rows). `kept` >= 8.
  RegressionMoments(std::size_t outputs, std::size_t parameters, bool instruments = false, std::size_t kept = 1024);

  /// Adds all instants of `rows`. Throws InvalidArgument when the shape is not the announced one.
  void add(const RegressionBlock& rows);

  [[nodiscard]] std::size_t outputs() const { return n_; }
  [[nodiscard]] std::size_t parameters() const { return p_; }
  [[nodiscard]] bool has_instruments() const { return instruments_; }
  /// Number of instants seen.
  [[nodiscard]] std::size_t instants() const { return instants_; }
  /// The blocks in the order of the log; the last may be shorter than the others.
  [[nodiscard]] const std::vector<MomentBlock>& blocks() const { return blocks_; }

  /// Sums Σ_i w_i² (…) over the outputs of block `b`, with a weight w_i for each output.
  [[nodiscard]] MomentSums block(std::size_t b, const Eigen::VectorXd& weights) const;
  /// The same over all blocks.
  [[nodiscard]] MomentSums total(const Eigen::VectorXd& weights) const;
  /// The sums of output `i` alone, over all blocks.
  [[nodiscard]] MomentSums of_output(std::size_t i) const;

 private:
  // Columns [column, column + p) of `count` instants of one output from row `first` on; where they lie, or in `tile`.
  gram_kernels::Matrix packed(const core::RowMatrix& from, std::size_t column, std::size_t first, std::size_t count,
                              std::vector<double>& tile) const;
  void open_block(double t);
  [[nodiscard]] const double* sums(std::size_t b, std::size_t output) const {
    return data_.data() + (b * n_ + output) * size_;
  }
  double* sums(std::size_t b, std::size_t output) { return data_.data() + (b * n_ + output) * size_; }
  void add_to(MomentSums& into, const double* sums, double factor) const;
  [[nodiscard]] MomentSums nothing() const;

  std::size_t n_, p_, columns_;  // columns_: p_ padded to whole groups
  bool instruments_;
  std::size_t capacity_, size_;  // size_: numbers for one block and output
  std::size_t length_ = 4;       // instants of a full block
  std::size_t instants_ = 0;
  std::vector<MomentBlock> blocks_;
  std::vector<double> data_;
  std::vector<double> Y_, Z_;  // tiles of packed rows
};

/// The moments of all of `rows`, one walk.
[[nodiscard]] RegressionMoments moments(core::RegressionSource& rows);
/// The same for rows with columns Y and, as many again, Z.
[[nodiscard]] RegressionMoments moments_with_instruments(core::RegressionSource& rows);

/// One over each output's own residual standard deviation by ordinary least squares: weights that are efficient for
/// errors that are independent between outputs. 1 for an output that is zero throughout.
[[nodiscard]] Eigen::VectorXd efficient_weights(const RegressionMoments& moments);

}  // namespace wheelwright::identify
