// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a study varies: a quantity with a range.
#pragma once

#include <string>

namespace wheelwright {

/// One input of a study. Designs live in the unit cube; value() says what a coordinate stands for.
struct StudyInput {
  std::string name;          ///< as the study file has it, e.g. "noise.wheel_speed"
  std::string unit;          ///< empty for pure numbers
  double lower = 0.0;        ///< value at 0
  double upper = 1.0;        ///< value at 1
  double nominal = 0.5;      ///< the value that it has where it is not varied, in [lower, upper]
  bool logarithmic = false;  ///< equal ratios, instead of equal differences, are equally likely
};

/// Throws InvalidArgument, naming the input and the field, unless numbers are finite, lower < upper,
/// lower <= nominal <= upper and, where logarithmic, lower > 0.
void validate(const StudyInput& input);

/// The value at `u` in [0, 1]; exactly `lower` at 0 and `upper` at 1.
[[nodiscard]] double value(const StudyInput& input, double u);

/// The coordinate of `x` in [lower, upper]: the inverse of value() to rounding.
[[nodiscard]] double coordinate(const StudyInput& input, double x);

}  // namespace wheelwright
