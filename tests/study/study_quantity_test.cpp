// SPDX-License-Identifier: Apache-2.0
#include "study/study_quantity.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "core/error.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::study::study_quantity_test {
namespace {

StudyCase simulated() {
  StudyCase subject;
  subject.scenario = testing_support::noisy_drive(3);
  subject.robot = subject.scenario->robot;
  return subject;
}

TEST(StudyQuantity, FamiliesStandForAllTheirMembers) {
  const StudyCase subject = simulated();
  const auto usual = study_quantities({}, subject.robot);
  ASSERT_EQ(usual.size(), 4U + 2U + 3U);
  EXPECT_EQ(usual.front().name, "width.r_mass");
  EXPECT_EQ(usual.front().unit, "kg·m");
  const auto one = study_quantities({"upper.mass", "threshold.peak.sum", "delay.wheel_radius=0.01"}, subject.robot);
  ASSERT_EQ(one.size(), 3U);
  EXPECT_EQ(one[0].name, "upper.r_mass");
  EXPECT_EQ(one[1].unit, "N·m");
  EXPECT_EQ(one[2].size, 0.01);
  EXPECT_EQ(one[2].unit, "s");
}

TEST(StudyQuantity, SaysWhatItExpected) {
  const StudyCase subject = simulated();
  for (const std::string wrong :
       {"widths", "width.colour", "threshold", "smallest_fault.leg", "delay.wheel_radius", "delay.wheel_radius=0",
        "delay.wheel_radius=1x", "gap", "gap.maybe", "commissioned.x", "smallest_fault.wheel_radius=2"}) {
    EXPECT_THROW(static_cast<void>(study_quantities({wrong}, subject.robot)), InvalidArgument) << wrong;
  }
}

// The numbers are those of the pipeline.
TEST(StudyQuantity, ReadsTheCommissioning) {
  const StudyCase subject = simulated();
  const auto quantities = study_quantities(
      {"lower", "upper", "width", "estimate", "standard_error", "false_alarms", "commissioned", "polytope_over_box",
       "threshold"
       ".mean",
       "threshold.peak"},
      subject.robot);
  const CaseResult result = evaluate_case(subject, quantities);
  ASSERT_EQ(result.values.size(), quantities.size());
  EXPECT_EQ(result.finding, "");
  const LogTable table = drive_of_case(subject);
  TableSource log(table);
  const Commissioning c = commission_robot(log, subject.robot);
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_EQ(result.values[j], c.parameters[j].lower);
    EXPECT_EQ(result.values[4 + j], c.parameters[j].upper);
    EXPECT_EQ(result.values[8 + j], c.parameters[j].upper - c.parameters[j].lower);
    EXPECT_EQ(result.values[12 + j], *c.parameters[j].estimate);
    EXPECT_EQ(result.values[16 + j], *c.parameters[j].standard_error);
  }
  EXPECT_EQ(result.values[20], 0.0);  // declared noise holds: no false alarm
  EXPECT_EQ(result.values[21], 1.0);
  EXPECT_EQ(result.values[22], c.polytope_over_box);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_GT(result.values[23 + i], 0.0);
    EXPECT_GE(result.values[25 + i], result.values[23 + i]);
  }
}

// A better effort sensor narrows the bounds and the thresholds, and shows smaller faults.
TEST(StudyQuantity, ABetterSensorBuysSomething) {
  const StudyCase subject = simulated();
  const auto quantities =
      study_quantities({"width.mass", "threshold.mean.sum", "smallest_fault.wheel_radius"}, subject.robot);
  StudyCase better = subject;
  set_input(better, "noise.effort", 0.002);
  const CaseResult now = evaluate_case(subject, quantities), then = evaluate_case(better, quantities);
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    EXPECT_LT(then.values[i], now.values[i]) << quantities[i].name;
  }
}

TEST(StudyQuantity, ALargerFaultIsSeenSooner) {
  const StudyCase subject = simulated();
  const auto quantities = study_quantities({"delay.wheel_radius=0.25", "delay.wheel_radius=0.45"}, subject.robot);
  const CaseResult result = evaluate_case(subject, quantities);
  EXPECT_GE(result.values[0], result.values[1]);
  EXPECT_TRUE(std::isfinite(result.values[1]));
}

// What cannot be is said, not thrown: noise that is declared far too small, a filter that is faster than the sampling.
TEST(StudyQuantity, WithoutAModelThereIsAFinding) {
  const auto quantities = study_quantities({"width.mass", "commissioned"}, simulated().robot);
  StudyCase subject = simulated();
  set_input(subject, "noise.effort", 2.0);
  set_input(subject, "declared.effort", 0.001);
  CaseResult result = evaluate_case(subject, quantities);
  EXPECT_TRUE(std::isnan(result.values[0]));
  EXPECT_EQ(result.values[1], 0.0);
  EXPECT_NE(result.finding, "");
  subject = simulated();
  set_input(subject, "duration", 0.02);
  result = evaluate_case(subject, quantities);
  EXPECT_TRUE(std::isnan(result.values[0]));
  EXPECT_EQ(result.values[1], 0.0);
  EXPECT_NE(result.finding, "");
}

}  // namespace
}  // namespace wheelwright::study::study_quantity_test
