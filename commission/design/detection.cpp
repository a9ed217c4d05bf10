// SPDX-License-Identifier: Apache-2.0
#include "commission/design/detection.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "commission/design/risk_promise.hpp"
#include "commission/design/subject.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "detector/events.hpp"
#include "detector/faults/fault_margin.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::design {

using core::kInfinity;

namespace {

constexpr double kNever = 1e6;  // objective where a fault is never certain, times how far it is from it

std::vector<JudgedFault> judge(const Plan& plan, const DesignSubject& subject, const detector::ThresholdRule& rule,
                               const std::vector<InspectedFault>& faults, detector::Persistence persistence) {
  check_inspected(faults);
  const detector::ReferenceMotion motion = planned_motion(plan, subject);
  detector::FaultMargin margin(rule);
  std::vector<JudgedFault> all;
  for (const InspectedFault& inspected : faults) {
    const FaultType& fault = inspected.fault;
    const std::size_t first = all.size();
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        all.push_back({{fault, side, check::positive(inspected.asked, "asked"), kInfinity, 0.0, 0}, kInfinity});
      }
    }
    detector::FaultFilter rows(fault, subject.model, subject.filter, motion);
    std::vector<detector::Lasting> lasting((all.size() - first) * rows.outputs(), detector::Lasting(persistence));
    rows.begin_broken(0);
    while (rows.next()) {
      if (!motion.settled[rows.instant()]) {
        continue;
      }
      for (std::size_t i = 0; i < rows.outputs(); ++i) {
        const detector::FaultRow row = rows.row(i);
        for (std::size_t k = first; k < all.size(); ++k) {
          PromisedFault& p = all[k].promise;
          const double most = std::abs(fault.kappa(p.side > 0.0 ? fault.range.upper : fault.range.lower));
          // One instant is enough where persistence is 1 of 1: then only smaller sizes are worth a search.
          const bool once = persistence.n == 1;
          const double limit =
              once && p.smallest < kInfinity ? std::abs(fault.kappa(p.side * p.smallest)) * (1.0 - 1e-6) : most;
          std::optional<double> kappa;
          if (fault.whole) {
            kappa = (!once || p.smallest == kInfinity) && margin.certain(row, most, p.side, i) ? std::optional(most)
                                                                                               : std::nullopt;
          } else {
            kappa = margin.smallest_certain(row, limit, p.side, i);
          }
          if (!once) {
            const double size = lasting[(k - first) * rows.outputs() + i].add(kappa.value_or(kInfinity));
            const bool smaller = size < kInfinity && std::abs(fault.magnitude(p.side * size)) < p.smallest;
            kappa = smaller ? std::optional(size) : std::nullopt;
          }
          if (kappa) {
            p.smallest = std::abs(fault.magnitude(p.side * *kappa));
            p.t = motion.t[rows.instant()] - motion.t.front();
            p.output = i;
          } else if (p.smallest == kInfinity) {
            all[k].missing = std::min(all[k].missing, margin.missing(row, most, p.side, i));
          }
        }
      }
    }
  }
  return all;
}

}  // namespace

void check_inspected(const std::vector<InspectedFault>& faults) {
  check::that(!faults.empty(), "faults", "one or more");
  for (const InspectedFault& each : faults) {
    const FaultType& fault = each.fault;
    check::that(fault.profile.kind == FaultProfile::Kind::step && !fault.held_effort, "fault '" + fault.name + "'",
                "one that is there in full from the beginning on (a step, no reading that stays at its value)");
  }
}

double worst_ratio(const std::vector<JudgedFault>& faults) {
  double worst = 0.0;
  for (const JudgedFault& judged : faults) {
    const PromisedFault& p = judged.promise;
    worst =
        std::max(worst, p.smallest < kInfinity ? p.smallest / p.asked : kNever * (1.0 + std::min(judged.missing, 1e6)));
  }
  return worst;
}

std::vector<PromisedFault> promised_faults(const Plan& plan, const DesignSubject& subject,
                                           const detector::ThresholdRule& rule,
                                           const std::vector<InspectedFault>& faults,
                                           detector::Persistence persistence) {
  std::vector<PromisedFault> promises;
  for (JudgedFault& judged : judge(plan, subject, rule, faults, persistence)) {
    promises.push_back(std::move(judged.promise));
  }
  return promises;
}

PlanObjective certain_detection(const DesignSubject& subject, const detector::ThresholdRule& rule,
                                const std::vector<InspectedFault>& faults, detector::Persistence persistence) {
  return [&subject, rule, faults, persistence](const Plan& plan) {
    return worst_ratio(judge(plan, subject, rule, faults, persistence));
  };
}

DetectionDesign design_for_detection(const OnlineModel& model, const DesignSubject& subject, const MotionLimits& limits,
                                     const std::vector<InspectedFault>& faults, const DesignOptions& options) {
  check_inspected(faults);
  const detector::ThresholdRule rule(Polytope(model.facets, model.box), model.estimate);
  // What decides is the detector as it was commissioned: its thresholds allow for the errors of the model.
  DesignSubject watched = subject;
  watched.errors = model.errors;
  const PlanObjective objective = options.guarantee == Promise::at_risk
                                      ? certain_detection_at_risk(watched, model, faults)
                                      : certain_detection(watched, rule, faults, model.persistence);
  const auto promises = [&](const Plan& plan) {
    return promised_faults(plan, watched, rule, faults, model.persistence);
  };
  DetectionDesign design;
  design.guarantee = options.guarantee;
  design.manoeuvre = design_manoeuvre(watched, limits, objective, options);
  design.promised = promises(design.manoeuvre.plan);
  if (model.at_risk) {
    RiskPromises sums = promised_faults_at_risk(design.manoeuvre.plan, watched, model, faults);
    design.miss = sums.miss;
    design.at_risk_warrant = model.at_risk->warrant;
    design.at_risk = std::move(sums.faults);
  }
  if (watched.model.on_two_wheels) {
    design.figure_eight = find_figure_eight(watched, limits, objective);
  }
  if (design.figure_eight) {
    design.figure_eight_plan = plan_of(*design.figure_eight, watched, limits.duration, watched.step);
    design.promised_eight = promises(*design.figure_eight_plan);
    if (model.at_risk) {
      design.at_risk_eight = promised_faults_at_risk(*design.figure_eight_plan, watched, model, faults).faults;
    }
  }
  return design;
}

std::vector<InspectedFault> usual_inspection(const OnlineModel& model) {
  std::vector<InspectedFault> faults;
  for (const FaultType& fault : model::fault_catalogue(model.model, model.estimate, model.robot.effort)) {
    if (fault.inspected > 0.0) {
      faults.push_back({fault, fault.inspected});
    }
  }
  return faults;
}

}  // namespace wheelwright::design
