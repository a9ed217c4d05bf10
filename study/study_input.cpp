// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/study_input.hpp>

#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

void validate(const StudyInput& input) {
  const std::string of = "input " + input.name + ": ";
  check::that(std::isfinite(input.lower) && std::isfinite(input.upper) && input.lower < input.upper, of + "range",
              "finite, the lower end below the upper");
  check::that(input.lower <= input.nominal && input.nominal <= input.upper, of + "nominal", "inside the range");
  check::that(!input.logarithmic || input.lower > 0.0, of + "range", "above 0 on a logarithmic scale");
}

double value(const StudyInput& input, double u) {
  if (u <= 0.0) {
    return input.lower;
  }
  if (u >= 1.0) {
    return input.upper;
  }
  return input.logarithmic ? input.lower * std::pow(input.upper / input.lower, u)
                           : input.lower + u * (input.upper - input.lower);
}

double coordinate(const StudyInput& input, double x) {
  return input.logarithmic ? std::log(x / input.lower) / std::log(input.upper / input.lower)
                           : (x - input.lower) / (input.upper - input.lower);
}

}  // namespace wheelwright
