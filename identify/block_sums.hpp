// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sums of a vector-valued series over equal blocks of time, in bounded memory, and the long-run covariance they give.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// At most 2·`kept` block sums: whenever they are full, neighbours are added up and blocks become twice as long.
class BlockSums {
 public:
  /// `dimension` of the series; `kept` >= 8 blocks are held at least once that many values have come.
  explicit BlockSums(std::size_t dimension, std::size_t kept = 1024);
  /// The next value of the series.
  void add(const Eigen::Ref<const Eigen::VectorXd>& value);
  /// Number of values seen.
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Sum of all values.
  [[nodiscard]] Eigen::VectorXd total() const;
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
/// B = 0.4·(blocks)^{2/3}, at least 4 and at most `most_frequencies`; fewer cosines stay honest under slower noise, at
/// the price of heavier t tails.
[[nodiscard]] LongRunCovariance long_run_covariance(const BlockSums& series, std::size_t most_frequencies = 24);

/// The same from the sums of a mean-zero series over all its blocks of time, one a column; the series is taken whole.
[[nodiscard]] LongRunCovariance long_run_covariance(const Eigen::MatrixXd& block_sums,
                                                    std::size_t most_frequencies = 24);

}  // namespace wheelwright
