// SPDX-License-Identifier: Apache-2.0
// Pages say guaranteed of what stands on declared bounds, and of nothing else.
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/report/commission_report.hpp"
#include "results/report/detect_report.hpp"
#include "results/report/sections.hpp"
#include "tests/report/example.hpp"

namespace wheelwright::report::warrant_test {
namespace {

namespace example = report_example;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Commissioning settled(core::NoiseOrigin origin, filter::NoiseMode mode = filter::NoiseMode::worst_case) {
  Commissioning c = example::done();
  for (commission::OutputNoise& noise : c.noise) {
    noise.origin = origin;
  }
  c.noise_mode = mode;
  commission::settle_warrants(c);
  return c;
}

commission::MarginSurvey survey_of(const Commissioning& c) {
  commission::MarginSurvey survey;
  survey.windows = {1.0};
  survey.seconds = 10.0;
  survey.manoeuvres = {{detector::ManoeuvreKind::cruising, 1}};
  survey.assumptions = c.assumptions;
  detector::FaultMargins margins;
  margins.fault = {.name = "wheel_radius", .sentence = "Both wheels.", .unit = "1", .range = {-0.5, 0.5}};
  survey.residuals.push_back({.name = "torque",
                              .outputs = c.model.model.outputs,
                              .margins = {margins},
                              .blind = {},
                              .maps = {},
                              .warrant = c.model.warrant});
  return survey;
}

std::vector<std::pair<std::string, std::string>> pages(const Commissioning& c) {
  const CommissionContext context = example::context(300);
  return {{"commissioning", commission_report(c, context)},
          {"fault", detect_report(example::detection(300, true), c.model, context)},
          {"healthy", detect_report(example::detection(300, false), c.model, context)},
          {"margins", margins_report(survey_of(c), c.model, context)}};
}

TEST(WarrantPages, OfDeclaredBoundsSayGuaranteed) {
  for (const auto& [name, page] : pages(settled(core::NoiseOrigin::declared))) {
    EXPECT_THAT(page, AllOf(HasSubstr(report::warrant_badge(core::Warrant::guaranteed)), HasSubstr("declared bounds"),
                            HasSubstr("id=\"assumptions\"")))
        << name;
  }
}

// Neither in words nor in styles and scripts: the search is for the stem, in the whole file.
TEST(WarrantPages, OfBoundsThatWereLearntNowhereSayGuaranteed) {
  for (const filter::NoiseMode mode : {filter::NoiseMode::worst_case, filter::NoiseMode::statistical}) {
    for (const auto& [name, page] : pages(settled(core::NoiseOrigin::estimated, mode))) {
      EXPECT_EQ(page.find("uarantee"), std::string::npos) << name;
      EXPECT_THAT(page, HasSubstr(report::warrant_badge(core::Warrant::extrapolated))) << name;
    }
  }
}

TEST(WarrantPages, OfStatisticalBoundsNowhereSayGuaranteed) {
  for (const auto& [name, page] : pages(settled(core::NoiseOrigin::declared, filter::NoiseMode::statistical))) {
    EXPECT_EQ(page.find("uarantee"), std::string::npos) << name;
    EXPECT_THAT(page, HasSubstr(report::warrant_badge(core::Warrant::statistical))) << name;
  }
}

TEST(WarrantPages, BadgesDifferInLook) {
  const std::string a = report::warrant_badge(core::Warrant::guaranteed),
                    b = report::warrant_badge(core::Warrant::extrapolated),
                    c = report::warrant_badge(core::Warrant::statistical);
  const auto look = [](const std::string& badge) { return badge.substr(0, badge.find('>')); };
  EXPECT_NE(look(a), look(b));
  EXPECT_NE(look(b), look(c));
  EXPECT_NE(look(a), look(c));
}

TEST(AssumptionTable, PutsWhatFailsFirstAndEscapesEveryText) {
  const std::string html = report::assumptions_section(
      {{.id = "a", .statement = "First.", .test = "a <test>", .verdict = core::AssumptionVerdict::holds},
       {.id = "b",
        .statement = "<b>Second</b>.",
        .declared_by = "noise.<x>",
        .verdict = core::AssumptionVerdict::fails}});
  EXPECT_LT(html.find("Second"), html.find("First"));
  EXPECT_THAT(html, AllOf(Not(HasSubstr("<b>")), Not(HasSubstr("<x>")), Not(HasSubstr("<test>")), HasSubstr("fails")));
  EXPECT_TRUE(report::assumptions_section({}).empty());
}

TEST(ParameterTable, SaysWhatAStatisticalIntervalLeavesOut) {
  EXPECT_THAT(commission_report(settled(core::NoiseOrigin::declared), example::context(300)),
              HasSubstr("errors that do not average out"));
}

}  // namespace
}  // namespace wheelwright::report::warrant_test
