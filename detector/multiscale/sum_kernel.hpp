// SPDX-License-Identifier: Apache-2.0
/// \file
/// The kernel of weighted sums over scales (scale_detector.hpp), and sums with it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

namespace wheelwright::detector {

/// K(x) = Σ_i kShape_i x^i/i! e^{−x}, x = age/scale: x e^{−x}.
struct SumKernel {
  static constexpr std::size_t kStates = 2;
  using Shape = std::array<double, kStates>;
  static constexpr Shape kShape{0.0, 1.0};
  static constexpr double kLargest = 0.36787944117144233;  ///< 1/e, at x = 1

  /// |K'| is at most the kernel of this shape, and |K''| at most that of curvature().
  [[nodiscard]] static constexpr Shape slope() {
    Shape out{};
    for (std::size_t i = 0; i < kStates; ++i) {
      out[i] = size(i) + size(i + 1);
    }
    return out;
  }
  [[nodiscard]] static constexpr Shape curvature() {
    Shape out{};
    for (std::size_t i = 0; i < kStates; ++i) {
      out[i] = size(i) + 2.0 * size(i + 1) + size(i + 2);
    }
    return out;
  }
  /// The kernel of a shape at x, e^{−x} = `decay`.
  [[nodiscard]] static constexpr double at(const Shape& shape, double x, double decay) {
    double sum = 0.0, power = decay;
    for (std::size_t i = 0; i < kStates; ++i) {
      sum += shape[i] * power;
      power *= x / static_cast<double>(i + 1);
    }
    return sum;
  }

 private:
  [[nodiscard]] static constexpr double size(std::size_t i) {
    return i >= kStates ? 0.0 : kShape[i] < 0.0 ? -kShape[i] : kShape[i];
  }
};

/// Sums of a table of signals with kernels of any SumKernel::Shape, at the same scale.
class KernelSums {
 public:
  KernelSums() = default;
  KernelSums(Eigen::Index rows, Eigen::Index columns) { states_.fill(Eigen::ArrayXXd::Zero(rows, columns)); }

  void reset() {
    for (Eigen::ArrayXXd& state : states_) {
      state.setZero();
    }
  }
  /// All ages grow by x scales, e^{−x} = `decay`.
  void advance(double x, double decay) {
    for (std::size_t i = SumKernel::kStates; i-- > 0;) {
      double power = x;
      for (std::size_t j = i; j-- > 0;) {
        states_[i] += power * states_[j];
        power *= x / static_cast<double>(i - j + 1);
      }
      states_[i] *= decay;
    }
  }
  /// Adds signals of the age 0.
  template <typename Signals>
  void add(const Signals& q) {
    states_[0] += q;
  }
  /// Adds signals of the age x, e^{−x} = `decay`, to `columns` columns from the first on.
  template <typename Signals>
  void add(const Signals& q, double x, double decay, Eigen::Index columns) {
    double power = decay;
    for (std::size_t i = 0; i < SumKernel::kStates; ++i) {
      states_[i].leftCols(columns) += power * q;
      power *= x / static_cast<double>(i + 1);
    }
  }
  [[nodiscard]] double value(Eigen::Index row, Eigen::Index column, const SumKernel::Shape& shape) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < SumKernel::kStates; ++i) {
      sum += shape[i] * states_[i](row, column);
    }
    return sum;
  }
  /// The kernel's sum of what was added after `then`, x scales ago, e^{−x} = `decay`.
  [[nodiscard]] double since(Eigen::Index row, Eigen::Index column, const KernelSums& then, double x,
                             double decay) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < SumKernel::kStates; ++i) {
      double before = then.states_[i](row, column), power = x;
      for (std::size_t j = i; j-- > 0;) {
        before += power * then.states_[j](row, column);
        power *= x / static_cast<double>(i - j + 1);
      }
      sum += SumKernel::kShape[i] * (states_[i](row, column) - decay * before);
    }
    return sum;
  }

 private:
  std::array<Eigen::ArrayXXd, SumKernel::kStates> states_;
};

}  // namespace wheelwright::detector
