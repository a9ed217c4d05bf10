// SPDX-License-Identifier: Apache-2.0
/// \file
/// The filter constants, chosen from the data: the fastest filter that is nearly as quiet as the quietest.
#pragma once

#include <vector>

#include <wheelwright/commission/survey.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/filter/design.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/model/model.hpp>

namespace wheelwright {

/// How the choice is made.
struct FilterChoiceOptions {
  double longest_delay = 0.4;  ///< s: order/β is at most this
  double tolerance = 1.15;     ///< the chosen filter's criterion is at most this times the best one's
};

/// One candidate.
struct FilterCandidate {
  FilterDesign design;
  double criterion = 0.0;  ///< geometric mean of residual rms / torque rms over the outputs that the model explains
};

/// The choice and the curve behind it.
struct FilterChoice {
  FilterDesign design;
  std::vector<FilterCandidate> curve;
};

/// Candidates β (α = β) from 2 to 200 1/s in steps of a factor of about 1.4 as far as the delay, the sampling (βh <= 0.5)
/// and the length of the log (settling, or three time constants for measured speeds, within a fifth of the longest
/// segment) allow, all fitted in one walk.
/// The criterion stands for the smallest certain fault: noise of the residual against torque. The largest β within
/// `tolerance` of the best is taken, for the shortest delay.
[[nodiscard]] FilterChoice choose_filter(LogSource& log, const Model& model, const Measurement& measurement, int order,
                                         const Survey& survey, const FilterChoiceOptions& options = {});

}  // namespace wheelwright
