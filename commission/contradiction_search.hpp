// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the searches for contradictions have in common: when a difference is real, and what is found in raw signals.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "commission/contradictions.hpp"
#include "commission/setting.hpp"
#include "core/log.hpp"
#include "core/statistics.hpp"

namespace wheelwright::commission {

/// Of a step: a shift in time below it is none, since interpolation between samples leaves up to a tenth of one.
inline constexpr double kLeastShift = 0.25;

/// Instants from which on a fit of a half, a joint or a shift is looked at.
inline constexpr std::size_t kFewestInstants = 200;

/// Standard errors beyond which a difference is taken for real at `risk`: two-sided, of Student's t with `freedom`
/// degrees of freedom.
[[nodiscard]] inline double errors_at(double risk, double freedom) {
  return core::student_quantile(1.0 - risk, std::max(freedom, 1.0));
}

/// Risk at which a shift takes the word guaranteed away in error.
inline constexpr double kRiskOfDoubt = 0.01;

/// errors_at() a risk of 1e-8: a model is withdrawn in error once in 10⁸ looks.
[[nodiscard]] inline double certain(double freedom) {
  constexpr double kRiskOfWithdrawal = 1e-8;
  return errors_at(kRiskOfWithdrawal, freedom);
}

/// A parameter as people know it.
struct InWords {
  std::string name, unit;
  double scale = 1.0, offset = 0.0;
  /// The quantity behind the entry `theta` of the parameter vector, in `unit`.
  [[nodiscard]] double value(double theta) const { return scale * theta - offset; }
};

/// Parameter `j` of the setting's model: the physical quantity where the effort's unit is known, else the entry itself.
[[nodiscard]] InWords in_words(const Setting& setting, std::size_t j);

/// Appends wrapped angles, scattered stamps and constant efforts, read from the columns as they are.
void find_raw_contradictions(LogSource& log, const Setting& setting, std::vector<LogContradiction>& out);

/// What each joint's effort says by itself against the motion of all: Kind::effort_unrelated and Kind::wheels_disagree,
/// not yet weighed against declared errors. Walks `log` twice.
[[nodiscard]] std::vector<LogContradiction> contradictions_of_efforts(LogSource& log, const Setting& setting);

}  // namespace wheelwright::commission
