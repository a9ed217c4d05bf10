// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/detection.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/detector/fault_margin.hpp>

namespace wheelwright {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kNever = 1e6;  // objective where a fault is never certain, times how far it is from it

// A promise, and where there is none by how much the largest size misses the threshold, as a share of its width.
struct Judged {
  PromisedFault promise;
  double missing = kNone;
};

std::vector<Judged> judge(const Plan& plan, const DesignSubject& subject, const ThresholdRule& rule,
                          const std::vector<InspectedFault>& faults) {
  check::that(!faults.empty(), "faults", "one or more");
  const ReferenceMotion motion = planned_motion(plan, subject);
  FaultMargin margin(rule);
  std::vector<Judged> all;
  for (const InspectedFault& inspected : faults) {
    const FaultType& fault = inspected.fault;
    const std::size_t first = all.size();
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        all.push_back({{fault, side, check::positive(inspected.asked, "asked"), kNone, 0.0, 0}, kNone});
      }
    }
    FaultFilter rows(fault, subject.model, subject.filter, motion);
    rows.begin(0);
    while (rows.next()) {
      if (!motion.settled[rows.instant()]) {
        continue;
      }
      for (std::size_t i = 0; i < rows.outputs(); ++i) {
        const FaultRow row = rows.row(i);
        for (std::size_t k = first; k < all.size(); ++k) {
          PromisedFault& p = all[k].promise;
          const double most = std::abs(fault.kappa(p.side > 0.0 ? fault.range.upper : fault.range.lower));
          const double limit = p.smallest < kNone ? std::abs(fault.kappa(p.side * p.smallest)) * (1.0 - 1e-6) : most;
          std::optional<double> kappa;
          if (fault.whole) {
            kappa = p.smallest == kNone && margin.certain(row, most, p.side, i) ? std::optional(most) : std::nullopt;
          } else {
            kappa = margin.smallest_certain(row, limit, p.side, i);
          }
          if (kappa) {
            p.smallest = std::abs(fault.magnitude(p.side * *kappa));
            p.t = motion.t[rows.instant()] - motion.t.front();
            p.output = i;
          } else if (p.smallest == kNone) {
            all[k].missing = std::min(all[k].missing, margin.missing(row, most, p.side, i));
          }
        }
      }
    }
  }
  return all;
}

}  // namespace

std::vector<PromisedFault> promised_faults(const Plan& plan, const DesignSubject& subject, const ThresholdRule& rule,
                                           const std::vector<InspectedFault>& faults) {
  std::vector<PromisedFault> promises;
  for (Judged& judged : judge(plan, subject, rule, faults)) {
    promises.push_back(std::move(judged.promise));
  }
  return promises;
}

PlanObjective certain_detection(const DesignSubject& subject, const ThresholdRule& rule,
                                const std::vector<InspectedFault>& faults) {
  return [&subject, rule, faults](const Plan& plan) {
    double worst = 0.0;
    for (const Judged& judged : judge(plan, subject, rule, faults)) {
      const PromisedFault& p = judged.promise;
      worst =
          std::max(worst, p.smallest < kNone ? p.smallest / p.asked : kNever * (1.0 + std::min(judged.missing, 1e6)));
    }
    return worst;
  };
}

DetectionDesign design_for_detection(const CommissionedModel& model, const DesignSubject& subject,
                                     const MotionLimits& limits, const std::vector<InspectedFault>& faults,
                                     const DesignOptions& options) {
  const ThresholdRule rule(Polytope(model.facets, model.box), model.estimate);
  const PlanObjective objective = certain_detection(subject, rule, faults);
  DetectionDesign design;
  design.manoeuvre = design_manoeuvre(subject, limits, objective, options);
  design.promised = promised_faults(design.manoeuvre.plan, subject, rule, faults);
  if (subject.model.name == "differential_drive") {
    design.figure_eight = best_figure_eight(subject, limits, objective);
    design.figure_eight_plan = plan_of(*design.figure_eight, subject, limits.duration, subject.step);
    design.promised_eight = promised_faults(*design.figure_eight_plan, subject, rule, faults);
  }
  return design;
}

std::vector<InspectedFault> usual_inspection(const CommissionedModel& model) {
  std::vector<InspectedFault> faults;
  for (const FaultType& fault : fault_catalogue(model.model, model.estimate, model.robot.effort)) {
    const bool radius =
        fault.name == "wheel_radius" || fault.name == "wheel_radius_right" || fault.name == "wheel_radius_left";
    if (radius || fault.name.starts_with("encoder_scale")) {
      faults.push_back({fault, 0.05});
    } else if (fault.name.starts_with("effort_loss")) {
      faults.push_back({fault, 0.2});
    }
  }
  return faults;
}

}  // namespace wheelwright
