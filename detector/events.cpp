// SPDX-License-Identifier: Apache-2.0
#include "detector/events.hpp"

#include <bit>
#include <cmath>

#include "core/check.hpp"

namespace wheelwright::detector {

PersistenceCounter::PersistenceCounter(Persistence rule) : rule_(rule) {
  check::that(rule.k >= 1 && rule.k <= rule.n && rule.n <= 64, "persistence", "1 <= k <= n <= 64");
}

bool PersistenceCounter::step(bool outside) noexcept {
  window_ = (window_ << 1U) | static_cast<unsigned long long>(outside);
  const auto mask = rule_.n == 64 ? ~0ULL : (1ULL << rule_.n) - 1;
  return static_cast<std::size_t>(std::popcount(window_ & mask)) >= rule_.k;
}

EventRecorder::EventRecorder(std::size_t outputs, double merge)
    : merge_(check::non_negative(merge, "merge")), channels_(outputs) {}

bool EventRecorder::add(std::size_t output, std::size_t sample, double t, double residual, double lower, double upper,
                        bool outside, bool alarm) {
  Channel& c = channels_[output];
  if (outside) {
    if (!c.any || t - c.candidate.end > merge_ || t < c.candidate.end) {
      c = Channel{};
      c.any = true;
      c.candidate.output = output;
      c.candidate.start = t;
      c.candidate.start_sample = sample;
    }
    Event& e = c.candidate;
    e.end = t;
    ++e.instants;
    const double half = 0.5 * (upper - lower);
    const double ratio = half > 0.0 ? std::abs(residual - 0.5 * (upper + lower)) / half : 0.0;
    if (ratio >= e.peak_ratio) {
      e.peak_ratio = ratio;
      e.peak_residual = residual;
      e.peak_time = t;
    }
  }
  const bool opens = alarm && c.any && !c.raised;
  if (opens) {
    c.candidate.alarm = t;
    c.raised = true;
    c.index = events_.size();
    events_.push_back(c.candidate);
  } else if (outside && c.raised) {
    events_[c.index] = c.candidate;
  }
  return opens;
}

}  // namespace wheelwright::detector
