// SPDX-License-Identifier: Apache-2.0
// What pages say at a stated risk, and where a log contradicts the assumption behind it.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/words/commission_words.hpp>
#include <wheelwright/words/summary.hpp>

#include "support/exact_axis.hpp"

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
TEST(AtRiskWords, AContradictedBiasLeavesTheGuaranteeAlone) {
  testing_support::ExactAxis axis;
  axis.law = testing_support::ErrorLaw::together;
  axis.correlation = 0.5;
  const std::string page = page_of(axis, 0.0);
  EXPECT_THAT(page, HasSubstr("Nothing is said at a stated risk, the guaranteed answer stands alone: over "));
  EXPECT_THAT(page, HasSubstr("The guarantee stands on the sensors’ declared noise bounds"));
  EXPECT_THAT(page, Not(HasSubstr("of which the log contradicts")));
}

}  // namespace
}  // namespace wheelwright::words::at_risk_words_test
