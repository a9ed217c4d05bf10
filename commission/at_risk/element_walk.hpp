// SPDX-License-Identifier: Apache-2.0
/// \file
/// Walking the elements of a log.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "core/limits.hpp"
#include "core/log.hpp"
#include "model/filter/element_filter.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::commission {

/// Elements of `log` by `filter`: begin() where a segment does, each() for each element (ElementFilter::element()),
/// end() where a segment's last element was.
template <typename Begin, typename Each, typename End>
void walk_elements(LogSource& log, filter::ElementFilter& filter, Begin&& begin, Each&& each, End&& end) {
  bool open = false;
  filter.restart();
  core::for_each_sample(log, filter.measurement().columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      filter.restart();
    }
    const bool element = filter.step(sample.t, sample.values);
    if (filter.began()) {
      if (open) {
        end();
      }
      begin();
      open = true;
    }
    if (element) {
      each();
    }
  });
  if (open) {
    end();
  }
}

/// `box` as SampleWeights takes it, its radius rounded up.
[[nodiscard]] inline filter::ParameterBox middle_and_radius(const Box& box) {
  const auto p = static_cast<Eigen::Index>(box.dimension());
  filter::ParameterBox result{Eigen::VectorXd(p), Eigen::VectorXd(p)};
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& side = box.sides[static_cast<std::size_t>(j)];
    const double middle = 0.5 * (side.lower + side.upper);
    result.middle[j] = middle;
    result.radius[j] = std::nextafter(std::max(side.upper - middle, middle - side.lower), core::kInfinity);
  }
  return result;
}

}  // namespace wheelwright::commission
