// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/block_sums.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

BlockSums::BlockSums(std::size_t dimension, std::size_t kept) : capacity_(2 * kept) {
  check::that(dimension > 0, "BlockSums dimension", "at least 1");
  check::that(kept >= 8, "BlockSums kept", "at least 8");
  sums_ = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(dimension), static_cast<Eigen::Index>(capacity_));
  current_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(dimension));
}

void BlockSums::add(const Eigen::Ref<const Eigen::VectorXd>& value) {
  current_ += value;
  ++count_;
  if (++in_current_ < length_) {
    return;
  }
  sums_.col(static_cast<Eigen::Index>(full_++)) = current_;
  current_.setZero();
  in_current_ = 0;
  if (full_ == capacity_) {
    for (std::size_t k = 0; k < capacity_ / 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      sums_.col(at) = (sums_.col(2 * at) + sums_.col(2 * at + 1)).eval();
    }
    full_ = capacity_ / 2;
    length_ *= 2;
  }
}

Eigen::VectorXd BlockSums::total() const { return blocks().rowwise().sum() + current_; }

LongRunCovariance long_run_covariance(const Eigen::MatrixXd& block_sums, std::size_t most_frequencies) {
  const auto blocks = block_sums.cols();
  LongRunCovariance result;
  result.matrix = Eigen::MatrixXd::Zero(block_sums.rows(), block_sums.rows());
  if (blocks < 2) {
    return result;
  }
  const auto rule = static_cast<std::size_t>(0.4 * std::pow(static_cast<double>(blocks), 2.0 / 3.0));
  const auto frequencies =
      std::min<std::size_t>(std::clamp<std::size_t>(rule, 4, std::max<std::size_t>(most_frequencies, 4)),
                            static_cast<std::size_t>(blocks - 1));
  for (std::size_t f = 1; f <= frequencies; ++f) {
    Eigen::VectorXd projection = Eigen::VectorXd::Zero(block_sums.rows());
    for (Eigen::Index k = 0; k < blocks; ++k) {
      const double phase =
          std::numbers::pi * static_cast<double>(f) * (static_cast<double>(k) + 0.5) / static_cast<double>(blocks);
      projection += std::numbers::sqrt2 * std::cos(phase) * block_sums.col(k);
    }
    result.matrix += projection * projection.transpose();
  }
  result.matrix /= static_cast<double>(frequencies);
  result.freedom = static_cast<double>(frequencies);
  return result;
}

LongRunCovariance long_run_covariance(const BlockSums& series, std::size_t most_frequencies) {
  const Eigen::MatrixXd sums = series.blocks();
  LongRunCovariance result = long_run_covariance(sums, most_frequencies);
  if (sums.cols() >= 2) {
    // The full blocks' share of the series; the values after them are allowed for in ratio.
    const double covered = static_cast<double>(sums.cols()) * static_cast<double>(series.block_length());
    result.matrix *= static_cast<double>(series.count()) / covered;
  }
  return result;
}

}  // namespace wheelwright
