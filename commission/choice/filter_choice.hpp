// SPDX-License-Identifier: Apache-2.0
/// \file
/// Choice of the filter constants from the data by a stated criterion; without one, the fastest filter whose noise is
/// nearly the least.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "commission/choice/filter_criterion.hpp"
#include "commission/survey.hpp"
#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/model.hpp"

namespace wheelwright::commission {

/// Options of the choice.
struct FilterChoiceOptions {
  double longest_delay = 0.4;  ///< s: order/β is at most this
  double tolerance = 1.15;     ///< residual_over_torque: the chosen filter's value is at most this times the best one's
  FilterCriterion criterion = FilterCriterion::residual_over_torque;
  FilterCriterionOptions for_criterion;  ///< of the two other criteria; a step of 0 is the survey's median
  std::vector<int> orders;               ///< the other criteria: orders to compare; empty: the one that is given
  std::size_t most_refinements = 12;     ///< the other criteria: evaluations between the best candidate's neighbours
};

/// One candidate.
struct FilterCandidate {
  FilterDesign design;
  double criterion = 0.0;   ///< value of the criterion, less is better. residual_over_torque: geometric mean over the
                            ///< outputs that the model explains; the others as FilterEvaluation says
  Eigen::VectorXd parts{};  ///< FilterValue::parts; empty for residual_over_torque
};

/// The choice and the curve behind it.
struct FilterChoice {
  FilterDesign design;
  std::vector<FilterCandidate> curve;  ///< by order and β; empty where the log allows no choice
  FilterCriterion criterion = FilterCriterion::residual_over_torque;
  std::string reason;     ///< one sentence
  std::size_t walks = 0;  ///< over the log
};

/// Candidates β (α = β) from 2 to 200 1/s in steps of a factor of about 1.4 as far as the delay, the sampling (βh <=
/// 0.5) and the length of the log (settling, or three time constants for measured speeds, within a fifth of the longest
/// segment) allow, all fitted in one walk (two for threshold_width).
///
/// residual_over_torque stands for the smallest certain fault: noise of the residual against torque. The largest β
/// within `tolerance` of the best is taken, for the shortest delay.
///
/// The others take the least value: from the best candidate, log β is refined between its neighbours by minimise_scalar
/// to a hundredth, where every evaluation walks over the log (twice for threshold_width), `most_refinements` times at
/// most. Delay counts only by `longest_delay`. Where no candidate has a finite value, residual_over_torque decides, and
/// `reason` says so. Throws InvalidArgument for an order other than 1 or 2, or order 1 where the motion is not measured
/// as speeds.
[[nodiscard]] FilterChoice choose_filter(LogSource& log, const Model& model, const Measurement& measurement, int order,
                                         const Survey& survey, const FilterChoiceOptions& options = {});

}  // namespace wheelwright::commission
