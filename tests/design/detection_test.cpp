// SPDX-License-Identifier: Apache-2.0
// An inspection drive: better than the figure eight, and its promise is kept when a broken robot drives it.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "commission/design/detection.hpp"
#include "commission/design/subject.hpp"
#include "core/limits.hpp"
#include "detector/detector.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/online_model.hpp"
#include "detector/threshold.hpp"
#include "model/sim/simulation.hpp"
#include "tests/design/robots.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::design::detection_test {
namespace {

using testing_support::noisy_drive;

struct Prepared {
  Scenario scenario;
  OnlineModel model;
};

Prepared prepared() {
  Scenario s = noisy_drive(4, 20.0);
  s.robot.limits = {{"speed", 8.0}, {"acceleration", 20.0}, {"effort", 6.0}};
  Simulation log(s);
  return {s, commission_robot(log, s.robot).model};
}

MotionLimits limits(const Robot& robot) {
  MotionLimits limits = limits_of(robot);
  limits.duration = 6.0;
  limits.radius = 1.0;
  return limits;
}

// Of the model's detector for `plan`.
double promised(const Prepared& p, const Plan& plan, detector::Persistence persistence, const InspectedFault& fault) {
  DesignSubject subject = subject_of(p.model);
  subject.errors = p.model.errors;
  const detector::ThresholdRule rule(Polytope(p.model.facets, p.model.box), p.model.estimate);
  return promised_faults(plan, subject, rule, {fault}, persistence).front().smallest;
}

// The robot drives `plan`, broken from the beginning on; time of the first alarm.
double first_alarm(const Prepared& p, const Plan& plan, const PromisedFault& fault, double size) {
  Scenario s = p.scenario;
  s.trajectory = {};
  s.trajectory.kind = sim::Trajectory::Kind::table;
  for (Eigen::Index k = 0; k < plan.samples(); ++k) {
    s.trajectory.table.t.push_back(plan.t(k));
    s.trajectory.table.speed.push_back(plan.speed.col(k));
  }
  s.duration = plan.t(plan.samples() - 1);
  s.seed = 91;
  const model::Fault::Kind kind =
      fault.fault.name == "wheel_radius" ? model::Fault::Kind::wheel_radius : model::Fault::Kind::wheel_radius_right;
  if (size > 0.0) {
    s.faults = {{.kind = kind, .magnitude = fault.side * size * s.robot.wheel_radius, .profile = {.onset = -1.0}}};
  }
  Simulation log(s);
  Detector detector = make_detector(p.model);
  double first = core::kInfinity;
  core::for_each_sample(log, p.model.measurement.columns(), [&](const core::LogSample& sample) {
    first = detector.step(sample.t, sample.values).fault ? std::min(first, sample.t) : first;
  });
  return first;
}

std::vector<InspectedFault> radii(const OnlineModel& model) {
  std::vector<InspectedFault> faults;
  for (const InspectedFault& each : usual_inspection(model)) {
    if (each.fault.name == "wheel_radius" || each.fault.name == "wheel_radius_right") {
      faults.push_back(each);
    }
  }
  return faults;
}

TEST(Detection, AnInspectionBeatsTheFigureEightAndKeepsItsPromise) {
  const Prepared p = prepared();
  const DesignSubject subject = subject_of(p.model);
  const std::vector<InspectedFault> faults = radii(p.model);
  ASSERT_EQ(faults.size(), 2u);
  const DetectionDesign design = design_for_detection(p.model, subject, limits(p.scenario.robot), faults,
                                                      {.stages = 2, .samples = 24, .descents = 1, .steps = 60});
  EXPECT_LE(design.manoeuvre.use.largest(), 1.0);
  ASSERT_EQ(design.promised.size(), 4u);
  ASSERT_EQ(design.promised_eight.size(), 4u);
  double mine = 0.0, eight = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    mine = std::max(mine, design.promised[k].smallest);
    eight = std::max(eight, design.promised_eight[k].smallest);
  }
  EXPECT_LT(mine, 0.9 * eight);
  EXPECT_NEAR(design.manoeuvre.objective, mine / 0.05, 1e-6 * mine / 0.05);
  for (const PromisedFault& fault : design.promised) {
    ASSERT_LT(fault.smallest, 0.3) << fault.fault.name;
    // A robot follows its commands with a little lag: a tenth more than what is promised for exact following.
    EXPECT_LT(first_alarm(p, design.manoeuvre.plan, fault, 1.1 * fault.smallest),
              design.manoeuvre.plan.t(design.manoeuvre.plan.samples() - 1))
        << fault.fault.name << " " << fault.side * fault.smallest;
  }
  EXPECT_EQ(first_alarm(p, design.manoeuvre.plan, design.promised[0], 0.0), core::kInfinity);
}

TEST(Detection, WhatCannotBeCertainHasASlope) {
  const Prepared p = prepared();
  const DesignSubject subject = subject_of(p.model);
  std::vector<InspectedFault> faults = radii(p.model);
  faults.resize(1);
  // Too slow, ahead and in turning, for any radius of this range to be certain: the faster plan is nearer to it.
  faults[0].fault.range = {0.0, 0.02};
  const detector::ThresholdRule rule(Polytope(p.model.facets, p.model.box), p.model.estimate);
  const PlanObjective objective = certain_detection(subject, rule, faults);
  const Plan slow = plan_of(FigureEight{0.05, 12.0}, subject, 6.0, 0.02),
             fast = plan_of(FigureEight{0.2, 6.0}, subject, 6.0, 0.02);
  EXPECT_EQ(promised_faults(slow, subject, rule, faults)[0].smallest, core::kInfinity);
  EXPECT_GT(objective(slow), 1e6);
  EXPECT_LT(objective(fast), objective(slow));
  EXPECT_THROW(static_cast<void>(promised_faults(slow, subject, rule, {})), InvalidArgument);
}

// More instants of a larger window never show smaller sizes, and a rule that one instant cannot satisfy promises less.
TEST(Detection, PersistenceCosts) {
  const Prepared p = prepared();
  const InspectedFault fault = radii(p.model).front();
  const Plan plan = plan_of(FigureEight{0.2, 4.0}, subject_of(p.model), 6.0, 0.02);
  const double once = promised(p, plan, {1, 1}, fault), some = promised(p, plan, {3, 5}, fault),
               many = promised(p, plan, {60, 64}, fault);
  ASSERT_LT(many, core::kInfinity);
  EXPECT_NEAR(promised(p, plan, {1, 5}, fault), once, 1e-5 * once);
  EXPECT_GT(some, once);
  EXPECT_GT(many, 1.01 * some);

  // The design asks for the persistence and the errors that the model's detector has.
  Prepared strict = p;
  strict.model.persistence = {60, 64};
  strict.model.errors.acceleration *= 2.0;
  const DetectionDesign design = design_for_detection(strict.model, subject_of(strict.model), limits(p.scenario.robot),
                                                      {fault}, {.stages = 1, .samples = 4, .descents = 1, .steps = 4});
  EXPECT_DOUBLE_EQ(design.promised.front().smallest,
                   promised(strict, design.manoeuvre.plan, strict.model.persistence, fault));
}

TEST(Detection, OnlyFaultsThatAreThereInFullAreInspected) {
  const Prepared p = prepared();
  const Plan plan = plan_of(FigureEight{0.2, 4.0}, subject_of(p.model), 6.0, 0.02);
  const auto catalogue = model::fault_catalogue(p.model.model, p.model.estimate);
  for (const char* name :
       {"wheel_radius_bump_right", "wheel_radius_drift", "encoder_dropout_left", "effort_stuck_left"}) {
    EXPECT_THROW(promised(p, plan, {}, {model::find_fault(catalogue, name), 0.05}), InvalidArgument) << name;
  }
  EXPECT_LT(promised(p, plan, {}, {model::find_fault(catalogue, "encoder_frozen_left"), 1.0}), core::kInfinity);
}

// Slip that was there before the drive adds its friction, and no impulse of the mass: the sum over the samples of the
// smoothed f₂ (kernel.hpp), f₂ * γe^{−γx} = α²γ/(γ − β)·(x e^{−βx} − (e^{−βx} − e^{−γx})/(γ − β)).
TEST(Detection, AFaultThatWasThereBeforeDoesNotJump) {
  const Prepared p = prepared();
  const DesignSubject subject = subject_of(p.model);
  const FilterDesign& f = subject.filter;
  const detector::ReferenceMotion motion = planned_motion(plan_of(FigureEight{0.2, 4.0}, subject, 6.0, 0.02), subject);
  detector::FaultFilter rows(model::find_fault(model::fault_catalogue(p.model.model, p.model.estimate), "matched"),
                             subject.model, f, motion);
  rows.begin_broken(0);
  ASSERT_EQ(f.order, 2);
  ASSERT_NE(motion.kind, MotionKind::speed);
  const double h = 0.02, gamma = 2.0 / h, apart = gamma - f.beta;
  double sum = 0.0;
  while (rows.next()) {
    const double x = motion.instant[rows.instant()] - motion.instant.front();
    sum += h * f.alpha * f.alpha * gamma / apart *
           (x * std::exp(-f.beta * x) - (std::exp(-f.beta * x) - std::exp(-gamma * x)) / apart);
    const detector::FaultRow row = rows.row(0);
    EXPECT_EQ(row.g1[0], 0.0);
    EXPECT_NEAR(row.g1[2], sum, 1e-9);
  }
  EXPECT_NEAR(sum, f.static_gain(), 1e-3);
}

TEST(Detection, SaysWhichFaultCannotBeInspected) {
  const Prepared p = prepared();
  const FaultType stuck =
      model::find_fault(model::fault_catalogue(p.model.model, p.model.estimate), "effort_stuck_left");
  try {
    static_cast<void>(design_for_detection(p.model, subject_of(p.model), limits(p.scenario.robot), {{stuck, 1.0}}));
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("effort_stuck_left"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace wheelwright::design::detection_test
