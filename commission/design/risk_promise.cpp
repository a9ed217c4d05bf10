// SPDX-License-Identifier: Apache-2.0
#include "commission/design/risk_promise.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bounds/feasible_set.hpp"
#include "commission/at_risk/risk_set.hpp"
#include "commission/design/subject.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "detector/faults/fault_margin.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::design {

using core::kInfinity;

namespace {

// The look of one scale that shows most of a fault, and by how much: its response over what it takes.
struct Showing {
  double share = 0.0;
  std::size_t weight = 0;
  double t = 0.0;
  detector::SumRow row;
};

struct Judgement {
  std::vector<JudgedFault> faults;
  double miss = 0.0;
};

JudgedFault promise_of(const std::vector<Showing>& best, const std::vector<double>& scales,
                       detector::FaultMargin& margin, PromisedFault promise) {
  JudgedFault judged{std::move(promise), kInfinity};
  PromisedFault& p = judged.promise;
  const double most = std::abs(p.fault.kappa(p.side > 0.0 ? p.fault.range.upper : p.fault.range.lower));
  double smallest = kInfinity;
  for (std::size_t s = 0; s < best.size(); ++s) {
    const Showing& look = best[s];
    if (!(look.share > 0.0) || (p.fault.whole && smallest < kInfinity)) {
      continue;
    }
    const detector::FaultRow row = look.row.row();
    const double limit = std::min(most, smallest * (1.0 - 1e-9));
    const std::optional<double> kappa =
        p.fault.whole ? (margin.certain(row, most, p.side, look.weight) ? std::optional(most) : std::nullopt)
                      : margin.smallest_certain(row, limit, p.side, look.weight);
    if (kappa) {
      smallest = *kappa;
      p.smallest = std::abs(p.fault.magnitude(p.side * smallest));
      p.t = look.t;
      p.output = look.weight;
      p.scale = scales[s];
    } else if (smallest == kInfinity) {
      judged.missing = std::min(judged.missing, margin.missing(row, most, p.side, look.weight));
    }
  }
  return judged;
}

Judgement judge_by_sums(const Plan& plan, const DesignSubject& subject, const OnlineModel& model,
                        const std::vector<InspectedFault>& inspected) {
  check_inspected(inspected);
  check::that(model.at_risk.has_value(), "model", "one that says something at a stated risk (docs/methods/risk.md)");
  const LogTable log = planned_log(plan, subject);
  TableSource source(log);
  const RegressorFilter filter = planned_filter(source, plan, subject);
  detector::ReferenceMotion motion = detector::read_reference(source, filter);
  motion.measured = false;
  OnlineModel planned = model;
  planned.measurement = filter.measurement();
  planned.errors = filter.errors();
  planned.at_risk->errors = planned_classes(plan, subject);
  const std::optional<detector::SumDrive> drive = detector::read_sum_drive(source, planned, motion);
  detector::FaultMargin margin(
      detector::ThresholdRule(Polytope(planned.at_risk->facets, planned.at_risk->box), planned.estimate));
  Judgement result;
  result.miss = drive ? drive->miss : 0.0;
  for (const InspectedFault& each : inspected) {
    const FaultType& fault = each.fault;
    std::vector<double> sides;
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        sides.push_back(side);
      }
    }
    const std::size_t scales = planned.at_risk->scales.size();
    std::vector<std::vector<Showing>> best(sides.size(), std::vector<Showing>(scales));
    if (drive) {
      detector::SumResponse response(fault, planned, motion, *drive);
      response.walk_broken([&](const detector::SumResponse::At& at) {
        const detector::SumLook& look = drive->looks[at.look];
        const double takes = look.width + 2.0 * look.radius;
        for (std::size_t s = 0; s < sides.size(); ++s) {
          const double kappa = std::abs(fault.kappa(sides[s] > 0.0 ? fault.range.upper : fault.range.lower));
          const double share = std::abs(sides[s] * at.once + kappa * at.twice) / takes;
          Showing& own = best[s][look.scale];
          if (share > own.share) {
            own = {share, look.weight, look.t - motion.t.front(), at.row()};
          }
        }
      });
    }
    for (std::size_t s = 0; s < sides.size(); ++s) {
      result.faults.push_back(
          promise_of(best[s], planned.at_risk->scales, margin,
                     {fault, sides[s], check::positive(each.asked, "asked"), kInfinity, 0.0, 0, 0.0}));
    }
  }
  return result;
}

}  // namespace

Box promised_bounds_at_risk(const Plan& plan, const DesignSubject& subject) {
  const filter::ErrorClasses classes = planned_classes(plan, subject);
  const LogTable log = planned_log(plan, subject);
  TableSource source(log);
  const RegressorFilter filter = planned_filter(source, plan, subject);
  TorqueRows stream(source, filter);
  RegressionBlock rows = read_all(stream);
  rows.y = rows.Y * subject.theta;
  core::RegressionTable table(std::move(rows));
  const FeasibleSet guaranteed = feasible_set(table, subject.prior);
  if (!guaranteed.polytope) {
    return guaranteed.hull;
  }
  // As commissioning does: the set bounds the motion between samples.
  filter::SignalErrors errors = filter.errors();
  filter::MotionBound bound = filter::motion_bound(subject.model, guaranteed.hull.sides);
  if (errors.between_samples && bound.mobility.size() > 0) {
    bound.effort = errors.motion.effort;
    bound.limit = errors.motion.limit;
    errors.motion = std::move(bound);
  }
  const commission::RiskSet set =
      commission::risk_set(source, subject.model, filter.measurement(), errors, classes, *guaranteed.polytope);
  return set.set ? set.set->hull() : guaranteed.hull;
}

PlanObjective narrow_bounds_at_risk(const DesignSubject& subject, WidthCriterion criterion) {
  return [&subject, criterion](const Plan& plan) {
    return combined(relative_widths(promised_bounds_at_risk(plan, subject), subject), criterion);
  };
}

RiskPromises promised_faults_at_risk(const Plan& plan, const DesignSubject& subject, const OnlineModel& model,
                                     const std::vector<InspectedFault>& faults) {
  RiskPromises promises;
  Judgement judgement = judge_by_sums(plan, subject, model, faults);
  promises.miss = judgement.miss;
  for (JudgedFault& judged : judgement.faults) {
    promises.faults.push_back(std::move(judged.promise));
  }
  return promises;
}

PlanObjective certain_detection_at_risk(const DesignSubject& subject, const OnlineModel& model,
                                        const std::vector<InspectedFault>& faults) {
  check::that(model.at_risk.has_value(), "promises at a stated risk: model",
              "one that says something at a risk (docs/methods/risk.md)");
  return [&subject, &model, faults](const Plan& plan) {
    return worst_ratio(judge_by_sums(plan, subject, model, faults).faults);
  };
}

}  // namespace wheelwright::design
