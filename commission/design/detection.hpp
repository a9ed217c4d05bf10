// SPDX-License-Identifier: Apache-2.0
/// \file
/// Inspection drives: after one of them a robot has either raised an alarm or has no fault larger than promised.
///
/// The fault is there from the first instant on (the robot broke before the inspection), the motion is planned, so the
/// smallest size that is certainly seen at some instant follows exactly for every fault (fault_margin.hpp), whatever θ
/// in the feasible set and whatever the noise. The plan is chosen to make the largest of these sizes small, each
/// relative to a size that is asked for.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "commission/design/manoeuvre.hpp"
#include "core/warrant.hpp"
#include "detector/events.hpp"
#include "model/fault_type.hpp"

namespace wheelwright::detector {
struct OnlineModel;
class ThresholdRule;
}  // namespace wheelwright::detector

namespace wheelwright::design {

/// A fault that an inspection is to find, with the size that would be good.
struct InspectedFault {
  FaultType fault;
  double asked = 0.05;  ///< magnitude, > 0; both sides where the fault's range has two
};

/// A fault that a plan is certain to detect.
struct PromisedFault {
  FaultType fault;
  double side = 1.0;
  double asked = 0.0;
  double smallest = 0.0;   ///< every size from here up to the range's end is seen for certain; infinite where none is
  double t = 0.0;          ///< time from the plan's start at which it is, s
  std::size_t output = 0;  ///< and the channel; at a stated risk the sum's weight (sum_weights())
  double scale = 0.0;      ///< at a stated risk: of the sum, s
};

/// Promises of `plan`, fault by fault, side by side, for a detector with this persistence. Throws InvalidArgument where
/// `faults` is empty, or one is not there in full from the beginning on: it drifts, pulses, comes once a turn (its
/// phase is not known), or holds a reading (its value is not known).
[[nodiscard]] std::vector<PromisedFault> promised_faults(const Plan& plan, const DesignSubject& subject,
                                                         const detector::ThresholdRule& rule,
                                                         const std::vector<InspectedFault>& faults,
                                                         detector::Persistence persistence = {});

/// The largest of smallest/asked; where a fault is never certain, a number above every such ratio that falls as the
/// fault comes nearer to being certain at its largest size, so that a search has a slope to follow.
[[nodiscard]] PlanObjective certain_detection(const DesignSubject& subject, const detector::ThresholdRule& rule,
                                              const std::vector<InspectedFault>& faults,
                                              detector::Persistence persistence = {});

/// Throws InvalidArgument unless each of `faults`, of which there is one, is there in full from the beginning on.
void check_inspected(const std::vector<InspectedFault>& faults);

/// A promise, and where there is none by how much the largest size misses what it takes, as a share of that.
struct JudgedFault {
  PromisedFault promise;
  double missing = std::numeric_limits<double>::infinity();
};

/// The objective of certain_detection() for promises of either kind.
[[nodiscard]] double worst_ratio(const std::vector<JudgedFault>& faults);

/// A manoeuvre for certain detection, and what it promises.
struct DetectionDesign {
  Manoeuvre manoeuvre;
  std::vector<PromisedFault> promised;
  std::optional<FigureEight> figure_eight;  ///< the best one within the same limits (differential drive)
  std::optional<Plan> figure_eight_plan;
  std::vector<PromisedFault> promised_eight;
  Promise guarantee = Promise::every_noise;  ///< the one that was planned for
  double miss = 0.0;  ///< a fault promised `at_risk` is missed with no more probability (SumDrive::miss)
  std::vector<PromisedFault>
      at_risk;  ///< promised by sums, as `promised`; empty where the model says nothing at a risk
  std::vector<PromisedFault> at_risk_eight;
  core::Warrant at_risk_warrant = core::Warrant::guaranteed;
};

/// design_manoeuvre() for certain detection of `faults` with the detector of `model` (its errors and its persistence)
/// under DesignOptions::guarantee, and the best figure eight beside it. Throws InvalidArgument where that is at_risk
/// and the model says nothing at a risk.
[[nodiscard]] DetectionDesign design_for_detection(const detector::OnlineModel& model, const DesignSubject& subject,
                                                   const MotionLimits& limits,
                                                   const std::vector<InspectedFault>& faults,
                                                   const DesignOptions& options = {});

/// Faults that are inspected where none is named: wheel radii by 5 %, efforts lost by 20 %, encoders' scale by 5 %; for
/// other models what there is of these.
[[nodiscard]] std::vector<InspectedFault> usual_inspection(const detector::OnlineModel& model);

}  // namespace wheelwright::design
