// SPDX-License-Identifier: Apache-2.0
// Promises at a stated risk: what a plan promises against what commissioning and the detector over scales make of a log
// that was driven along it.
#include "commission/design/risk_promise.hpp"
#include "commission/commission.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "commission/design/stages.hpp"
#include "commission/design/subject.hpp"
#include "core/limits.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/multiscale/sum_margins.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "model/filter/regressor_filter.hpp"
#include "model/sim/simulation.hpp"
#include "tests/design/robots.hpp"

namespace wheelwright::design::risk_promise_test {
namespace {

Robot averaging_robot() {
  Robot robot = testing_support::small_robot();
  robot.noise.effort.bias = 0.0001;
  robot.effort_changes = model::EffortChanges::at_samples;
  return robot;
}

// Straight and turning by turns: nothing of it is optimal, so that a search has something to do.
Plan ordinary_plan(const DesignSubject& subject, double duration) {
  MotionLimits limits = limits_of(subject.robot);
  limits.duration = duration;
  const StageFamily family(subject, limits, 3);
  return family.plan(std::vector<double>{1.0, 1.0, 0.5, 0.8, 0.1, 0.5, 0.2, 0.9, 0.5}, subject.step);
}

// The believed robot drives `plan`.
Scenario driven(const Robot& robot, const Plan& plan, std::uint64_t seed) {
  Scenario s = testing_support::drive_of(plan, robot, seed);
  s.parameters = {.mass = robot.nominal.at("mass"),
                  .yaw_inertia = robot.nominal.at("yaw_inertia"),
                  .viscous_x = robot.nominal.at("viscous_linear"),
                  .viscous_y = robot.nominal.at("viscous_linear"),
                  .viscous_yaw = robot.nominal.at("viscous_yaw")};
  return s;
}

Commissioning commissioned(const Robot& robot, const Plan& plan, std::uint64_t seed) {
  Simulation log(driven(robot, plan, seed));
  return commission_robot(log, robot);
}

double width(const Box& box, std::size_t j) { return box.sides[j].upper - box.sides[j].lower; }

TEST(RiskPromise, BoundsAreWhatCommissioningGets) {
  const Robot robot = averaging_robot();
  const DesignSubject subject = subject_of(robot, 0.01);
  ASSERT_TRUE(subject.averaging);
  const Plan plan = ordinary_plan(subject, 40.0);
  const Box promised = promised_bounds_at_risk(plan, subject);
  const Box guaranteed = promised_bounds(planned_rows(plan, subject), subject);
  for (const std::uint64_t seed : {1U, 2U}) {
    const Commissioning got = commissioned(robot, plan, seed);
    ASSERT_TRUE(got.at_risk && got.at_risk->set) << got.message;
    const Box hull = got.at_risk->set->hull();
    for (std::size_t j = 0; j < promised.dimension(); ++j) {
      EXPECT_LE(width(promised, j), width(guaranteed, j) * (1.0 + 1e-9));
      // Wheels follow commands with a little lag, and regressors are read with errors.
      EXPECT_LE(width(hull, j), 1.1 * width(promised, j)) << j << ", seed " << seed;
      EXPECT_GE(width(hull, j), 0.7 * width(promised, j)) << j << ", seed " << seed;
    }
  }
}

TEST(RiskPromise, ALongerDriveIsWorthMoreAtTheRiskThanForEveryNoise) {
  const DesignSubject subject = subject_of(averaging_robot(), 0.01);
  double ratio = 1.0;
  for (const double duration : {20.0, 80.0}) {
    const Plan plan = ordinary_plan(subject, duration);
    const Eigen::VectorXd narrow = relative_widths(promised_bounds_at_risk(plan, subject), subject);
    const Eigen::VectorXd wide = relative_widths(promised_bounds(planned_rows(plan, subject), subject), subject);
    const double now =
        combined(narrow, WidthCriterion::geometric_mean) / combined(wide, WidthCriterion::geometric_mean);
    EXPECT_LT(now, 0.8 * ratio) << duration;
    ratio = now;
  }
}

TEST(RiskPromise, NeedsErrorsThatAverageOut) {
  const DesignSubject subject = subject_of(testing_support::small_robot(), 0.01);
  EXPECT_FALSE(subject.averaging);
  const Plan plan = ordinary_plan(subject, 10.0);
  EXPECT_THROW(static_cast<void>(promised_bounds_at_risk(plan, subject)), InvalidArgument);
  MotionLimits limits = limits_of(subject.robot);
  EXPECT_THROW(static_cast<void>(design_for_bounds(subject, limits, WidthCriterion::mean,
                                                   {.guarantee = Promise::at_risk, .stages = 2, .samples = 1})),
               InvalidArgument);
}

// Time of the first alarm of the detector over scales.
double first_alarm(const Robot& robot, const OnlineModel& model, const Plan& plan,
                   const std::vector<model::Fault>& faults) {
  Scenario s = driven(robot, plan, 7);
  s.faults = faults;
  Simulation log(s);
  detector::ScaleDetector detector(model);
  double first = core::kInfinity;
  core::for_each_sample(log, model.measurement.columns(), [&](const core::LogSample& sample) {
    if (detector.step(sample.t, sample.values) && detector.alarm()) {
      first = std::min(first, sample.t);
    }
  });
  return first;
}

TEST(RiskPromise, FaultsAreSeenAndMarginsOnTheDriveAgree) {
  const Robot robot = averaging_robot();
  const Commissioning learnt = commissioned(robot, ordinary_plan(subject_of(robot, 0.01), 60.0), 3);
  ASSERT_TRUE(learnt.model.at_risk);
  DesignSubject subject = subject_of(learnt.model);
  subject.errors = learnt.model.errors;
  const Plan plan = ordinary_plan(subject, 15.0);
  const auto catalogue = model::fault_catalogue(learnt.model.model, learnt.model.estimate, robot.effort);
  const std::vector<InspectedFault> faults = {{model::find_fault(catalogue, "wheel_radius"), 0.05},
                                              {model::find_fault(catalogue, "effort_loss_right"), 0.2}};
  const RiskPromises promised = promised_faults_at_risk(plan, subject, learnt.model, faults);
  ASSERT_EQ(promised.faults.size(), 3U);  // a loss has one side
  EXPECT_GT(promised.miss, 0.0);
  EXPECT_LT(promised.miss, 1e-8);
  EXPECT_EQ(first_alarm(robot, learnt.model, plan, {}), core::kInfinity);

  // The margins of a log driven along the plan, of a fault that sets in while the robot still stands. They allow for
  // the errors of the log that was read, which a plan has none of.
  Simulation healthy(driven(robot, plan, 5));
  const LogTable table = read_all(healthy);
  TableSource log(table);
  const OnlineModel& m = learnt.model;
  const detector::ReferenceMotion motion =
      detector::read_reference(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  const auto drive = detector::read_sum_drive(log, m, motion);
  ASSERT_TRUE(drive);
  const double end = motion.t.back() - motion.instant[0];
  const std::vector<detector::FaultMargins> margins =
      detector::margins_at_risk(*drive, m, motion, std::vector<FaultType>{faults[0].fault, faults[1].fault},
                                std::vector<std::size_t>{0}, {.windows = {0.25 * end, 0.5 * end, 0.75 * end, end}});
  ASSERT_EQ(margins.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const PromisedFault& p = promised.faults[k];
    ASSERT_LT(p.smallest, 0.5) << p.fault.name;
    EXPECT_LE(p.t, plan.t(plan.samples() - 1));
    const double read = margins[k].onsets[0].certain.back();
    EXPECT_GE(read, 0.9 * p.smallest) << p.fault.name;
    EXPECT_LE(read, 1.4 * p.smallest) << p.fault.name;
    if (p.fault.name == "wheel_radius") {
      // A robot follows its commands with a little lag: a tenth more than what is promised for exact following.
      const model::Fault fault{.kind = model::Fault::Kind::wheel_radius,
                               .magnitude = p.side * 1.1 * p.smallest * robot.wheel_radius,
                               .profile = {.onset = -1.0}};
      EXPECT_LT(first_alarm(robot, m, plan, {fault}), plan.t(plan.samples() - 1)) << p.side * p.smallest;
    }
  }
}

// Planned for the risk, a drive is worth more at the risk than one planned for every noise; both are told.
TEST(RiskPromise, TheDesignIsForTheGuaranteeThatWasAskedFor) {
  const DesignSubject subject = subject_of(averaging_robot(), 0.02);
  MotionLimits limits = limits_of(subject.robot);
  limits.duration = 20.0;
  limits.radius = 1.0;
  DesignOptions options{.stages = 2, .samples = 16, .descents = 1, .steps = 40};
  const BoundsDesign every_noise = design_for_bounds(subject, limits, WidthCriterion::geometric_mean, options);
  options.guarantee = Promise::at_risk;
  const BoundsDesign at_risk = design_for_bounds(subject, limits, WidthCriterion::geometric_mean, options);
  ASSERT_TRUE(every_noise.at_risk && at_risk.at_risk);
  const auto value = [&](const Box& box) {
    return combined(relative_widths(box, subject), WidthCriterion::geometric_mean);
  };
  EXPECT_LE(value(*at_risk.at_risk), value(*every_noise.at_risk));
  EXPECT_NEAR(at_risk.manoeuvre.objective, value(*at_risk.at_risk), 1e-9);
  EXPECT_NEAR(every_noise.manoeuvre.objective, value(every_noise.promised), 1e-9);
  EXPECT_LT(value(*at_risk.at_risk), value(at_risk.promised));
}

}  // namespace
}  // namespace wheelwright::design::risk_promise_test
