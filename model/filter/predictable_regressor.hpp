// SPDX-License-Identifier: Apache-2.0
/// \file
/// The regressor as it was foreseen: weights that no error of the samples they weigh has touched.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/regression.hpp"
#include "model/filter/element_filter.hpp"

namespace wheelwright::filter {

/// Foresees the regressor of the next element from old ones: a low-pass filter of order kOrder, led by its own delay,
/// of all elements but the newest. The order makes weights smooth: errors of angles stand in a sum with the second
/// difference of its weights, which of a low order's would be mostly these errors themselves.
///
/// A sum Σ g_k (torque_k − Y_k θ) is a martingale in the sensors' errors only where g_k is known before any error that
/// it multiplies: weights taken from the element itself, or its neighbours, are correlated with its errors. value()
/// depends on samples that are older than all samples that the newest element and the one before it hold, by at least
/// the errors' correlation time.
class PredictableRegressor {
 public:
  PredictableRegressor() = default;
  /// For elements of `elements`, a filter that delays by `delay` (s), `correlation` >= 0 (s).
  PredictableRegressor(const ElementFilter& elements, double delay, double correlation);

  /// The next element is the first of a segment.
  void begin();
  /// Takes the newest element; value() is its weight then.
  void take(const ElementFilter& elements);
  /// Forgets traces (kTrace).
  void fade();
  /// n × p.
  [[nodiscard]] const core::RowMatrix& value() const { return value_; }

  /// Of each of its stages, 1/s; by how much it leads, and the errors' correlation time, s.
  [[nodiscard]] double beta() const { return beta_; }
  [[nodiscard]] double lead() const { return lead_; }
  [[nodiscard]] double correlation() const { return correlation_; }
  /// Elements that it has room for until they are old enough.
  [[nodiscard]] std::size_t room() const { return ring_.size(); }

  /// Elements that stand between the newest and the newest that value() depends on.
  static constexpr std::size_t kLag = 4;
  /// Order of the filter.
  static constexpr std::size_t kOrder = 6;

 private:
  struct Waiting {
    double t = 0.0, length = 0.0;
    core::RowMatrix Y;
  };
  void release(const Waiting& element);

  double beta_ = 1.0, correlation_ = 0.0, lead_ = 0.0;
  std::vector<Waiting> ring_;
  std::size_t oldest_ = 0, count_ = 0;
  std::array<core::RowMatrix, kOrder> z_;
  core::RowMatrix value_;
};

}  // namespace wheelwright::filter
