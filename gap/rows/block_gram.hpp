// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares from Gram matrices alone: small ones with coefficients of a given sign, and cross-validated ones on
/// any subset of many columns, over blocks of time.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::gap {

/// The minimiser of ½ xᵀA x − bᵀx.
struct SignedSolution {
  Eigen::VectorXd x;
  std::vector<bool> zero;  ///< held at 0: by its sign, or since A does not determine it
};

/// argmin ½ xᵀA x − bᵀx over sign_i x_i >= 0 (sign 0: free; `sign` may be empty), A symmetric positive semidefinite, by
/// active sets (Lawson and Hanson 1974, chapter 23). Unknowns that A determines to fewer than ten digits, given those
/// before them, are held at 0.
[[nodiscard]] SignedSolution signed_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                  const std::vector<int>& sign);

/// (A restricted to the unknowns that are not `zero`)⁻¹ in its place, zeros elsewhere.
[[nodiscard]] Eigen::MatrixXd restricted_inverse(const Eigen::MatrixXd& A, const std::vector<bool>& zero);

/// The rows of one output of one residual space, over all candidate columns.
struct RowSpace {
  std::string name;                      ///< e.g. "sum", "yaw"
  Eigen::VectorXd t;                     ///< time of each row, s, ascending
  Eigen::VectorXd response;              ///< what is to be explained
  std::vector<Eigen::VectorXd> columns;  ///< the same columns in every space; an empty one stands for zeros
  double floor = 1.0;                    ///< standard deviation of the noise: all is divided by it
  Eigen::VectorXd noise{};  ///< noise as large as that of the efforts, as the response would have it; empty:
                            ///< none is known
  std::vector<Eigen::VectorXd> noise_columns{};  ///< what it would be in each column, for those that are made of
                                                 ///< measured efforts; missing or empty ones stand for zeros
};

/// Division of rows into blocks.
struct BlockOptions {
  std::size_t blocks = 24;  ///< at most, of equal duration, from the first time of all spaces to the last
  double purge = 0.5;       ///< s: rows nearer than this to a border between two blocks are in no held-out block and
                            ///< train none
  double shortest = 2.0;    ///< s, length of a block below which a log has fewer blocks than `blocks`, so that rows
                            ///< remain to be held out between two purges
  std::size_t fewest = 12;  ///< blocks, or `blocks` where these are fewer, that a short log has at least: a signed-rank
                            ///< test over fewer of them cannot be significant for one of thirty effects
  std::size_t threads = 1;  ///< results do not depend on it
};

/// A least-squares problem on some of the columns.
struct Subset {
  std::vector<std::size_t> columns{};  ///< whose coefficients are estimated
  std::vector<std::size_t> fixed{};    ///< whose coefficient is 1: subtracted from the response
  std::vector<int> sign{};          ///< of each estimated coefficient: +1 for >= 0, −1 for <= 0, 0 for either; may be
                                    ///< empty (all either)
  std::vector<double> precision{};  ///< of each one's Gaussian prior about 0: its inverse variance; may be empty (none)
};

/// Residual of the response of `space` under `subset` with the first of its coefficients; without any, the response
/// less the fixed columns.
[[nodiscard]] Eigen::VectorXd residual(const RowSpace& space, const Subset& subset,
                                       const Eigen::VectorXd& coefficients);

/// The same of `count` rows from `first` on.
[[nodiscard]] Eigen::VectorXd residual(const RowSpace& space, const Subset& subset, const Eigen::VectorXd& coefficients,
                                       Eigen::Index first, Eigen::Index count);

/// A subset fitted to all rows.
struct BlockFit {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;     ///< zero for coefficients that are held at 0 by their sign
  std::vector<bool> at_bound;     ///< held at 0 by its sign, or not determined by the rows
  double mean_square = 0.0;       ///< of the residual over all rows
  double held_out_error = 0.0;    ///< as BlockGram::held_out_error
  Eigen::VectorXd held_out_loss;  ///< of each block: sum of squares of its held-out rows
};

/// Wilcoxon's signed-rank statistic of `differences` (of losses over blocks), in standard deviations: large where most
/// are > 0; zeros do not count. An effect may show in a few blocks only, by amounts that differ a thousandfold: the
/// mean's t would be blind to it.
[[nodiscard]] double signed_rank(const Eigen::VectorXd& differences);

/// Half-open rows of one space.
struct SpaceRange {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
};

/// Gram matrices of columns and response over the inner rows of each block, and over the rows near borders.
///
/// Everything is in units of the floors: a residual that is nothing but noise has the mean square 1.
///
/// A column that is made of the measured efforts has their noise ε (RowSpace::noise) as δ in it (noise_columns), and a
/// fit with such columns takes ε − δ for what noise leaves. Held-out losses have |ε|² − |ε − δ|² added, where that is
/// > 0 in all: they are what the same coefficients would leave of efforts without noise, and the noise.
class BlockGram {
 public:
  /// One pass over the rows. Throws InvalidArgument when sizes disagree, times descend, a floor is not > 0, a value is
  /// not finite, there are fewer than two blocks, or no row lies inside a block.
  explicit BlockGram(const std::vector<RowSpace>& spaces, const BlockOptions& options = {});

  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] std::size_t blocks() const { return blocks_; }
  /// Number of held-out rows of each block.
  [[nodiscard]] const Eigen::VectorXd& rows() const { return rows_; }
  /// Number of all rows, those near borders included.
  [[nodiscard]] double all_rows() const { return all_rows_; }
  /// Sum of squares of the whitened column over all rows; the response has the index columns().
  [[nodiscard]] double square(std::size_t column) const { return at(column, column)[all()]; }
  /// Σ a b over all rows, a and b whitened columns or (index columns()) the response.
  [[nodiscard]] double product(std::size_t a, std::size_t b) const { return at(a, b)[all()]; }

  /// Mean over all held-out rows of the squared error, each block predicted by the fit to the inner rows of all others.
  /// Coefficients that the other blocks do not determine are 0. Throws InvalidArgument for an index out of range or
  /// sizes that disagree.
  [[nodiscard]] double held_out_error(const Subset& subset) const;

  /// Its sums over each block, for paired comparisons.
  [[nodiscard]] Eigen::VectorXd held_out_loss(const Subset& subset) const;

  /// Coefficients (one row for each column of the subset) that each block (one column each) is predicted with.
  [[nodiscard]] Eigen::MatrixXd held_out_coefficients(const Subset& subset) const;

  /// First time of the inner rows of each block, and the one that they end before, s.
  [[nodiscard]] const std::vector<std::pair<double, double>>& interiors() const { return interiors_; }

  /// Fit to all rows. The covariance is the sandwich of the blocks' scores s_b, each freed of its block's leverage,
  /// (B−1)/B Σ d_b d_bᵀ with d_b = (XᵀX + Λ − X_bᵀX_b)⁻¹ s_b, which is the jackknife over blocks (Bell and McCaffrey
  /// 2002), plus what the prior of precision Λ leaves, H⁻¹ΛH⁻¹ with H = XᵀX + Λ. It holds for residuals that are
  /// correlated within blocks and of unequal variance.
  [[nodiscard]] BlockFit fit(const Subset& subset) const;

 private:
  struct Problem;

  // Per pair of columns (the response is the last one): inner rows of each block, border rows of each block, all inner
  // rows, all rows.
  [[nodiscard]] const double* at(std::size_t i, std::size_t j) const {
    return gram_.data() + (i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i) * lanes();
  }
  [[nodiscard]] std::size_t lanes() const { return 2 * blocks_ + 2; }
  [[nodiscard]] std::size_t inner() const { return 2 * blocks_; }
  [[nodiscard]] std::size_t all() const { return 2 * blocks_ + 1; }

  void accumulate_noise(const std::vector<RowSpace>& spaces, const std::vector<std::vector<SpaceRange>>& cores,
                        std::size_t threads);
  // Products over the inner rows of each block of two columns' noise, by noise_index_.
  [[nodiscard]] const double* noise_products(std::size_t i, std::size_t j) const {
    return noise_gram_.data() + (i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i) * blocks_;
  }
  void set_taken(const Subset& subset, Problem& problem) const;
  void check_subset(const Subset& subset) const;
  [[nodiscard]] Problem gather(const Subset& subset) const;
  [[nodiscard]] Problem held_out(const Subset& subset) const;

  std::size_t columns_ = 0;
  std::size_t blocks_ = 0;
  std::vector<double> gram_;
  std::vector<std::size_t> noise_index_;  // of each column in noise_gram_; its size there: none. Empty: no noise
  std::size_t noise_columns_ = 0;         // in noise_gram_; the noise of the response has this index
  std::vector<double> noise_gram_;
  Eigen::VectorXd rows_;
  std::vector<std::pair<double, double>> interiors_;
  double all_rows_ = 0.0;
};

/// Held-out losses as BlockGram::held_out_loss has them, of equal parts of the inner time of each block with rows, no
/// shorter than `length` (s, > 0): neighbours of one block share their coefficients, not their rows. Of a block with
/// more parts than rows, as where the clock jumps, those without rows are left out. `spaces` are those of `gram`.
[[nodiscard]] Eigen::VectorXd held_out_pieces(const BlockGram& gram, const std::vector<RowSpace>& spaces,
                                              const Subset& subset, double length);

/// Schur complement of the Gram matrix: Σ rᵢ rⱼ over all rows, r the columns `of` less their least-squares fit by the
/// columns `on` (indices of `gram`, the response has the index columns()). Columns of `on` that depend linearly on the
/// others, to ten digits, count once.
[[nodiscard]] Eigen::MatrixXd remainder(const BlockGram& gram, const std::vector<std::size_t>& of,
                                        const std::vector<std::size_t>& on);

}  // namespace wheelwright::gap
