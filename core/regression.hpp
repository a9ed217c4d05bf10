// SPDX-License-Identifier: Apache-2.0
/// \file
/// Linear regression rows of a filtered log, y = Y θ + e, with bounds on the errors of Y and y.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::core {

/// Rows of Y are stored one after the other.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A block of K instants with n outputs each: K·n rows, instant-major (row k·n + i is output i of instant k).
///
/// Where the assumptions on the sensors hold, there is for every instant an exact regressor Y° with |Y° − Y| <= dY
/// entry by entry, and |y − Y° θ| <= dy. With all bounds zero this is the ordinary regression.
struct RegressionBlock {
  std::size_t outputs = 0;          ///< n
  std::size_t parameters = 0;       ///< p
  std::vector<std::size_t> sample;  ///< K row numbers in the log
  std::vector<double> t;            ///< K times, s
  RowMatrix Y;                      ///< (K·n) × p, filtered regressor Y_f of (25)
  RowMatrix dY;                     ///< (K·n) × p, entry-wise bound Δ >= 0 on the error of Y
  Eigen::VectorXd y;                ///< K·n, filtered torque τ_f of (28)
  Eigen::VectorXd dy;               ///< K·n, bound n̄ >= 0 on the error of y

  /// Number of instants K.
  [[nodiscard]] std::size_t instants() const { return t.size(); }
  /// Number of rows K·n.
  [[nodiscard]] Eigen::Index rows() const { return static_cast<Eigen::Index>(t.size() * outputs); }
  /// Makes room for `instants` instants; contents are unspecified, storage is reused where it suffices.
  void resize(std::size_t instants, std::size_t n, std::size_t p);
  /// Leaves the first `instants` instants.
  void shorten(std::size_t instants);
};

/// A regression that can be walked from beginning to end any number of times, block by block.
class RegressionSource {
 public:
  virtual ~RegressionSource() = default;
  /// n, the number of outputs of an instant.
  [[nodiscard]] virtual std::size_t outputs() const = 0;
  /// p, the number of parameters.
  [[nodiscard]] virtual std::size_t parameters() const = 0;
  /// Fills `block` with the next instants and returns true; false at the end. A block may be empty.
  virtual bool next(RegressionBlock& block) = 0;
  /// Goes back to the first instant.
  virtual void rewind() = 0;
};

/// All rows of a regression in memory, as one block.
class RegressionTable final : public RegressionSource {
 public:
  /// Takes `block` over. Throws InvalidArgument when its shapes disagree, a bound is negative or a value is not finite.
  explicit RegressionTable(RegressionBlock block);
  [[nodiscard]] std::size_t outputs() const override { return block_.outputs; }
  [[nodiscard]] std::size_t parameters() const override { return block_.parameters; }
  bool next(RegressionBlock& block) override;
  void rewind() override { done_ = false; }
  /// The rows.
  [[nodiscard]] const RegressionBlock& block() const { return block_; }

 private:
  RegressionBlock block_;
  bool done_ = false;
};

/// visit(block) for every block of `source`, from its beginning; visits may change the block.
template <typename Visit>
void for_each_block(RegressionSource& source, Visit&& visit) {
  RegressionBlock block;
  source.rewind();
  while (source.next(block)) {
    visit(block);
  }
}

/// Reads all of `source` (from its beginning) into one block.
[[nodiscard]] RegressionBlock read_all(RegressionSource& source);

}  // namespace wheelwright::core

namespace wheelwright {
using core::read_all;
using core::RegressionBlock;
}  // namespace wheelwright
