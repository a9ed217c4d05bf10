// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible set of a log, refined by the bounds on the motion between samples that follow from a set before it.
#pragma once

#include <cstddef>
#include <vector>

#include "bounds/feasible_set.hpp"
#include "commission/commission.hpp"
#include "commission/setting.hpp"
#include "commission/survey.hpp"
#include "core/log.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/filter/noise.hpp"

namespace wheelwright::commission {

/// A feasible set with what bounds the motion between samples: a first set stands on the limit of the accelerations,
/// the next ones on the dynamics with the parameters of the set before, as long as that brings something.
struct RefinedSet {
  bounds::OutlierResult result;
  std::vector<EarlierSet> earlier;
  filter::MotionBound learning;  ///< of the rows that the set is made of
  filter::MotionBound driving;   ///< for driving to come: what was seen in this log is no limit of that
  double raised = 1.0;           ///< factor on an estimated noise bound without which the prior box explains nothing
};

/// The set of `part` of `log` by rows with `errors`, which may leave out `outliers` instants. Walks the log up to five
/// times.
[[nodiscard]] RefinedSet refined_set(LogSource& log, const Setting& setting, Part part, filter::SignalErrors errors,
                                     std::size_t outliers);

}  // namespace wheelwright::commission
