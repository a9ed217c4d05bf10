// SPDX-License-Identifier: Apache-2.0
// What pages say at a stated risk, and where a log contradicts the assumption behind it.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "results/words/commission_summary.hpp"
#include "results/words/commission_words.hpp"
#include "tests/support/exact_axis.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::words::at_risk_words_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string page_of(const testing_support::ExactAxis& axis, double declared_correlation) {
  const LogTable log = drive(axis, 3);
  Robot robot = robot_of(axis);
  robot.noise.effort.correlation = declared_correlation;
  TableSource source(log);
  std::string text;
  for (const std::string& sentence : commission_words(commission_robot(source, robot))) {
    text += sentence + "\n";
  }
  return text;
}

TEST(AtRiskWords, TellIntervalsAndWhatIsSeen) {
  testing_support::ExactAxis axis;
  const std::string page = page_of(axis, 0.0);
  EXPECT_THAT(page, HasSubstr("At a risk of 1e-09: inertia "));
  EXPECT_THAT(page, HasSubstr("at most one false alarm in ten years"));
  EXPECT_THAT(page, HasSubstr("certain to be seen within 5\u00A0s"));
}

// The guaranteed bounds do not stand on the assumption: it may fail without a word against them.
// Errors that do not average out look like other friction, or like parameters that change.
TEST(AtRiskWords, AContradictedBiasTakesTheGuaranteeWithIt) {
  testing_support::ExactAxis axis;
  axis.law = testing_support::ErrorLaw::together;
  axis.correlation = 0.5;
  const std::string page = page_of(axis, 0.0);
  EXPECT_THAT(page, HasSubstr("Nothing is said at a stated risk, the extrapolated answer stands alone: over "));
  EXPECT_THAT(page, Not(HasSubstr("The guarantee stands on the sensors’ declared noise bounds")));
  EXPECT_THAT(page, HasSubstr("of which the log contradicts"));
}

TEST(AtRiskWords, TellWhatIsSaidOfThePose) {
  Scenario s = testing_support::posed_drive(3, 40.0);
  s.robot.noise.position.bias = s.robot.noise.heading.bias = 1e-4;
  const auto page = [&] {
    Simulation log(s);
    std::string text;
    for (const std::string& sentence : commission_words(commission_robot(log, s.robot))) {
      text += sentence + "\n";
    }
    return text;
  };
  EXPECT_THAT(page(), HasSubstr("Of the pose, at a risk of 1e-09: radius right "));
  s.robot.noise.heading.bias.reset();
  s.robot.noise.position.bias.reset();
  EXPECT_THAT(page(), Not(HasSubstr("at a risk of")));
}

}  // namespace
}  // namespace wheelwright::words::at_risk_words_test
