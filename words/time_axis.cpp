// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/words/time_axis.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/words/text.hpp>

namespace wheelwright::words {

TimeAxis::TimeAxis(const std::vector<double>& t) : offsets_{0.0} {
  if (t.empty()) {
    return;
  }
  if (std::isfinite(t[0]) && std::abs(t[0]) > 1e6) {
    origin_ = std::floor(t[0]);
  }
  double run_start = t[0];
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] < t[i - 1]) {
      const double gap = 0.02 * (t[i - 1] - run_start);
      offsets_.push_back(offsets_.back() + (t[i - 1] - t[i]) + gap);
      run_start = t[i];
    }
  }
}

std::string TimeAxis::text(double t) const { return with_unit(decimal(shown(t), 3), "s"); }

std::vector<double> TimeAxis::lay(const std::vector<double>& t) const {
  std::vector<double> laid(t.size());
  std::size_t run = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && t[i] < t[i - 1]) {
      run = std::min(run + 1, offsets_.size() - 1);
    }
    laid[i] = shown(t[i]) + offsets_[run];
    if (i > 0) {
      laid[i] = std::max(laid[i], laid[i - 1]);
    }
  }
  return laid;
}

}  // namespace wheelwright::words
