// SPDX-License-Identifier: Apache-2.0
#include "model/filter/predictable_regressor.hpp"

#include <cmath>

#include "core/check.hpp"
#include "model/filter/kernel.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::filter {

PredictableRegressor::PredictableRegressor(const ElementFilter& elements, double delay, double correlation)
    : beta_(static_cast<double>(kOrder) / check::positive(delay, "delay")), correlation_(correlation) {
  check::that(correlation >= 0.0, "correlation time", ">= 0");
  const double nominal = elements.measurement().nominal_step;
  const auto correlated = nominal > 0.0 ? static_cast<std::size_t>(std::ceil(2.0 * correlation / nominal)) : 0;
  lead_ = delay + static_cast<double>(kLag) * nominal + correlation;
  value_ = core::RowMatrix::Zero(static_cast<Eigen::Index>(elements.model().n()),
                                 static_cast<Eigen::Index>(elements.model().p()));
  z_.fill(value_);
  ring_.assign(kLag + 2 + correlated, Waiting{0.0, 0.0, value_});
}

void PredictableRegressor::begin() {
  oldest_ = count_ = 0;
  for (core::RowMatrix& z : z_) {
    z.setZero();
  }
  value_.setZero();
}

void PredictableRegressor::release(const Waiting& element) {
  const double forgotten = -std::expm1(-beta_ * element.length);
  z_[0] += forgotten * (element.Y / element.length - z_[0]);
  for (std::size_t i = 1; i < kOrder; ++i) {
    z_[i] += forgotten * (z_[i - 1] - z_[i]);
  }
}

void PredictableRegressor::fade() {
  for (core::RowMatrix& z : z_) {
    z = z.unaryExpr(&faded);
  }
}

void PredictableRegressor::take(const ElementFilter& elements) {
  const WeakElement& e = elements.element();
  // Those that are old enough: kLag elements back, and as long before that one as errors are correlated.
  while (count_ >= kLag) {
    const Waiting& first = ring_[oldest_];
    const Waiting& lag = ring_[(oldest_ + count_ - kLag) % ring_.size()];
    if (first.t > lag.t - correlation_) {
      break;
    }
    release(first);
    oldest_ = (oldest_ + 1) % ring_.size();
    --count_;
  }
  value_ = z_[kOrder - 1] + (lead_ * beta_) * (z_[kOrder - 2] - z_[kOrder - 1]);
  // Steps are shorter than they were said to be, or nothing is known of it: this one is not looked at.
  if (count_ == ring_.size() || !e.known) {
    return;
  }
  Waiting& next = ring_[(oldest_ + count_) % ring_.size()];
  next.t = e.t;
  next.length = e.length;
  element_regressor(elements, e, next.Y);
  ++count_;
}

}  // namespace wheelwright::filter
