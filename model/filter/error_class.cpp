// SPDX-License-Identifier: Apache-2.0
#include "model/filter/error_class.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::filter {

void validate(const ErrorClasses& classes) {
  for (const ErrorClass* c : {&classes.motion, &classes.effort}) {
    check::that(c->bound >= 0.0 && std::isfinite(c->bound), "noise bound", ">= 0");
    check::that(c->bias >= 0.0 && c->bias <= c->bound, "noise bias", "from 0 to the bound");
    check::that(c->deviation > 0.0, "noise deviation", "> 0");
    check::that(c->correlation >= 0.0 && std::isfinite(c->correlation), "correlation time of the noise", ">= 0");
    check::that(c->correlation == 0.0 || classes.shortest_step > 0.0, "correlation time of the noise",
                "a log with a shortest step");
  }
}

SampleClass sample_class(const ErrorClasses& classes, const SampleWeight& sample) {
  const bool motion = sample.sensor == SampleWeight::Sensor::motion;
  SampleClass result = sample_class(motion ? classes.motion : classes.effort, classes.shortest_step);
  result.averages = result.averages && sample.exact && (!motion || sample.moved >= kCountsThatAverage * classes.count);
  return result;
}

SampleClass sample_class(const ErrorClass& c, double shortest_step) {
  SampleClass result;
  result.bound = c.bound;
  result.bias = c.bias;
  result.deviation = std::min(c.deviation, c.bound);
  result.averages = c.bias < c.bound;
  result.multiplicity = c.correlation > 0.0 ? std::floor(c.correlation / shortest_step) + 1.0 : 1.0;
  return result;
}

}  // namespace wheelwright::filter
