// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/design.hpp>

#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

double FilterDesign::static_gain() const { return std::pow(alpha / beta, order); }

double FilterDesign::delay() const { return order / beta; }

void validate(const FilterDesign& design) {
  check::that(design.order == 1 || design.order == 2, "filter order", "1 or 2");
  check::positive(design.alpha, "filter alpha");
  check::positive(design.beta, "filter beta");
  check::non_negative(design.settle, "filter settle");
}

}  // namespace wheelwright
