// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of regressions for tests, and a small seeded generator.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "bounds/box.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds::testing_rows {

/// Uniform numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// In [0, 1).
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  /// In [−1, 1).
  double symmetric() { return 2.0 * unit() - 1.0; }
  /// p numbers in [−1, 1).
  std::vector<double> vector(std::size_t p) {
    std::vector<double> x(p);
    for (double& value : x) {
      value = symmetric();
    }
    return x;
  }

 private:
  std::mt19937_64 engine_;
};

/// { |θ_j| <= half }.
inline Box cube(std::size_t p, double half) {
  Box box;
  box.sides.assign(p, {-half, half});
  return box;
}

/// Collects rows; n outputs make an instant, in the order in which they are added.
class Rows {
 public:
  explicit Rows(std::size_t p, std::size_t outputs = 1) : p_(p), outputs_(outputs) {}

  Rows& add(const std::vector<double>& Y, double y, double dy, const std::vector<double>& dY = {}) {
    Y_.push_back(Y);
    dY_.push_back(dY.empty() ? std::vector<double>(p_, 0.0) : dY);
    y_.push_back(y);
    dy_.push_back(dy);
    return *this;
  }

  [[nodiscard]] std::size_t size() const { return y_.size(); }

  /// Instants [first, last).
  [[nodiscard]] RegressionBlock block(std::size_t first, std::size_t last) const {
    RegressionBlock block;
    block.resize(last - first, outputs_, p_);
    for (std::size_t k = first; k < last; ++k) {
      block.sample[k - first] = k;
      block.t[k - first] = 0.01 * static_cast<double>(k);
    }
    for (std::size_t r = first * outputs_; r < last * outputs_; ++r) {
      const auto i = static_cast<Eigen::Index>(r - first * outputs_);
      for (std::size_t j = 0; j < p_; ++j) {
        block.Y(i, static_cast<Eigen::Index>(j)) = Y_[r][j];
        block.dY(i, static_cast<Eigen::Index>(j)) = dY_[r][j];
      }
      block.y[i] = y_[r];
      block.dy[i] = dy_[r];
    }
    return block;
  }
  [[nodiscard]] std::size_t instants() const { return y_.size() / outputs_; }
  [[nodiscard]] core::RegressionTable table() const { return core::RegressionTable(block(0, instants())); }
  [[nodiscard]] std::size_t outputs() const { return outputs_; }
  [[nodiscard]] std::size_t parameters() const { return p_; }

 private:
  std::size_t p_, outputs_;
  std::vector<std::vector<double>> Y_, dY_;
  std::vector<double> y_, dy_;
};

/// Hands rows out in blocks of a given number of instants.
class BlockSource final : public core::RegressionSource {
 public:
  BlockSource(const Rows& rows, std::size_t instants) : rows_(rows), instants_(instants) {}
  [[nodiscard]] std::size_t outputs() const override { return rows_.outputs(); }
  [[nodiscard]] std::size_t parameters() const override { return rows_.parameters(); }
  bool next(RegressionBlock& block) override {
    if (position_ >= rows_.instants()) {
      return false;
    }
    const std::size_t last = std::min(rows_.instants(), position_ + instants_);
    block = rows_.block(position_, last);
    position_ = last;
    return true;
  }
  void rewind() override { position_ = 0; }

 private:
  const Rows& rows_;
  std::size_t instants_, position_ = 0;
};

}  // namespace wheelwright::bounds::testing_rows
