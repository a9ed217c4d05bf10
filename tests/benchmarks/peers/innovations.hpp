// SPDX-License-Identifier: Apache-2.0
/// \file
/// A Kalman filter on the robot's model, and the χ² test on its innovations (Mehra and Peschon 1971).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "model/robot.hpp"
#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// One coordinate of the robot: m v̇ + f v = u, its position measured.
struct AxisModel {
  double inertia = 1.0;            ///< θ_L of v̇, > 0
  double friction = 0.0;           ///< θ_L of v, >= 0
  double effort_variance = 0.0;    ///< of u: process noise
  double position_variance = 0.0;  ///< of the measured position, > 0
};

/// Kalman filter of position and speed, driven by the measured effort: exact discretisation, covariance propagated at
/// every step (Anderson and Moore 1979). Angles, not their differences, are the measurement: their errors are nearly
/// white, those of differences are not.
class AxisFilter {
 public:
  AxisFilter(const AxisModel& model, Hold hold) : model_(model), hold_(hold) {}

  void restart() { seen_ = 0; }

  /// Takes the next row; the normalised innovation ν²/S and its variance S. Both are 0 for the first row.
  struct Innovation {
    double normalised = 0.0, variance = 0.0;
  };
  Innovation step(double t, double position, double effort) {
    if (seen_++ == 0) {
      state_ = {position, 0.0};
      P_ << model_.position_variance, 0.0, 0.0, 1.0;
      t_ = t;
      effort_ = effort;
      return {};
    }
    const double h = t - t_;
    if (h != h_) {
      discretise(h);
    }
    const double slope = hold_ == Hold::zero_order ? 0.0 : effort - effort_;
    state_ = (A_ * state_ + B_ * effort_ + C_ * slope).eval();
    P_ = (A_ * P_ * A_.transpose() + model_.effort_variance * B_ * B_.transpose()).eval();
    const double S = P_(0, 0) + model_.position_variance;
    const double innovation = position - state_[0];
    const Eigen::Vector2d gain = P_.col(0) / S;
    state_ += gain * innovation;
    P_ = (P_ - gain * P_.row(0)).eval();
    P_(0, 1) = P_(1, 0) = 0.5 * (P_(0, 1) + P_(1, 0));
    t_ = t;
    effort_ = effort;
    return {innovation * innovation / S, S};
  }

 private:
  void discretise(double h) {
    h_ = h;
    const double z = -h * model_.friction / model_.inertia, b = 1.0 / model_.inertia;
    // φ_k(z) = Σ zⁿ/(n+k)!.
    const auto phi = [z](int k) {
      double term = 1.0, sum = 0.0;
      for (int n = 2; n <= k; ++n) {
        term /= n;
      }
      for (int n = 0; n < 24; ++n) {
        sum += term;
        term *= z / (n + k + 1);
      }
      return sum;
    };
    A_ << 1.0, h * phi(1), 0.0, std::exp(z);
    B_ = b * Eigen::Vector2d(h * h * phi(2), h * phi(1));
    C_ = b * Eigen::Vector2d(h * h * phi(3), h * phi(2));
  }

  AxisModel model_;
  Hold hold_;
  std::size_t seen_ = 0;
  double t_ = 0.0, effort_ = 0.0, h_ = -1.0;
  Eigen::Vector2d state_, B_, C_;
  Eigen::Matrix2d A_, P_;
};

/// χ² of the innovations of both coordinates, summed over the last `window` samples (two degrees of freedom each). Says
/// nothing until the residuals are valid, as they do.
class Innovations final : public Statistic {
 public:
  Innovations(const std::array<AxisModel, kOutputs>& axes, Hold hold, std::size_t window)
      : axes_{AxisFilter(axes[0], hold), AxisFilter(axes[1], hold)}, last_(window, 0.0) {}
  [[nodiscard]] std::size_t size() const override { return 1; }
  void restart() override {
    for (AxisFilter& axis : axes_) {
      axis.restart();
    }
    std::fill(last_.begin(), last_.end(), 0.0);
    at_ = 0;
    sum_ = 0.0;
  }
  void step(const Observation& now, std::span<double> values) override {
    double square = 0.0;
    for (std::size_t i = 0; i < kOutputs; ++i) {
      square += axes_[i].step(now.t, now.position[i], now.effort[i]).normalised;
    }
    values[0] = 0.0;
    if (!now.valid) {
      return;
    }
    sum_ += square - last_[at_];
    last_[at_] = square;
    if (++at_ == last_.size()) {
      at_ = 0;
      sum_ = 0.0;
      for (const double each : last_) {
        sum_ += each;
      }
    }
    values[0] = sum_;
  }
  /// √(χ²) is nearly Gaussian about the root of its mean.
  [[nodiscard]] double with_margin(double largest, double margin) const override {
    const double mean = std::sqrt(static_cast<double>(kOutputs * last_.size())), root = std::sqrt(largest);
    return root > mean ? std::pow(mean + margin * (root - mean), 2) : margin * largest;
  }

 private:
  std::array<AxisFilter, kOutputs> axes_;
  std::vector<double> last_;
  std::size_t at_ = 0;
  double sum_ = 0.0;
};

/// −2 log likelihood of a log under a model, up to a constant: Σ log S + ν²/S, without the first `skip` rows.
class Likelihood {
 public:
  Likelihood(const AxisModel& model, Hold hold, std::size_t skip) : filter_(model, hold), skip_(skip) {}
  void add(double t, double position, double effort) {
    const AxisFilter::Innovation now = filter_.step(t, position, effort);
    if (rows_++ >= skip_ && now.variance > 0.0) {
      deviance_ += std::log(now.variance) + now.normalised;
    }
  }
  void restart() {
    filter_.restart();
    rows_ = 0;
  }
  [[nodiscard]] double deviance() const { return deviance_; }

 private:
  AxisFilter filter_;
  std::size_t skip_, rows_ = 0;
  double deviance_ = 0.0;
};

}  // namespace wheelwright::peers
