// SPDX-License-Identifier: Apache-2.0
/// \file
/// What must hold of every page, whatever it says.
#include <algorithm>
#include <cmath>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "commission/design/subject.hpp"
#include "results/report/commission_report.hpp"
#include "results/report/design_report.hpp"
#include "results/report/detect_report.hpp"
#include "results/report/failure_report.hpp"
#include "results/report/gap_report.hpp"
#include "results/report/identify_report.hpp"
#include "results/report/page.hpp"
#include "results/report/signals.hpp"
#include "results/words/identification_words.hpp"
#include "tests/report/example.hpp"
#include "tests/report/gap_example.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::report::page_test {
using namespace words;
namespace {

namespace example = report_example;

// A drive with a pose, whose efforts are late by two samples; without turning where `straight`.
commission::Identification identified(bool straight) {
  Scenario s = testing_support::exact_drive(testing_support::Shown::speeds, Hold::first_order);
  s.sensors.pose = true;
  s.sensors.effort = 0.02;
  s.robot.noise.wheel_speed.value = 1e-4;
  s.trajectory.kind = straight ? sim::Trajectory::Kind::straight : s.trajectory.kind;
  LogTable table = sim::simulate(s);
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    if (table.names[c].starts_with("tau")) {
      std::rotate(table.columns[c].begin(), table.columns[c].end() - 2, table.columns[c].end());
    }
  }
  TableSource log(table);
  return commission::identify(log, s.robot);
}

struct Designed {
  design::DesignSubject subject;
  design::MotionLimits limits;
  design::BoundsDesign design;
};

Designed designed() {
  Robot robot = example::robot();
  robot.parameters = testing_support::kFour;
  robot.nominal = {{"mass", 19.0}, {"yaw_inertia", 1.0}, {"viscous_linear", 3.0}, {"viscous_yaw", 0.4}};
  robot.noise.wheel_speed.value = robot.noise.effort.value = 0.02;
  robot.filter.beta = 10.0;
  robot.limits = {{"speed", 8.0}, {"acceleration", 20.0}, {"effort", 6.0}};
  Designed d{design::subject_of(robot, 0.02), design::limits_of(robot), {}};
  d.limits.duration = 6.0;
  d.limits.radius = 1.0;
  d.design = design::design_for_bounds(d.subject, d.limits, design::WidthCriterion::geometric_mean,
                                       {.stages = 1, .samples = 8, .descents = 1, .steps = 10});
  return d;
}

std::vector<std::pair<std::string, std::string>> all_pages() {
  static const commission::Identification whole = identified(false), straight = identified(true);
  static const Designed plan = designed();
  const CommissionContext context = example::context(900);
  return {{"done", commission_report(example::done(), context)},
          {"partial", commission_report(example::partial(), context)},
          {"nothing", commission_report(example::nothing(), context)},
          {"empty", commission_report(example::empty(), context)},
          {"failure", failure_report("no column tau_r", context)},
          {"fault", detect_report(example::detection(900, true), example::done().model, context)},
          {"healthy", detect_report(example::detection(900, false), example::done().model, context)},
          {"identified", identify_report(whole, context)},
          {"identified in part", identify_report(straight, context)},
          {"designed", design_report(plan.design, plan.subject, plan.limits, context)},
          {"gap explained", gap_report(gap_example::explained(), "example robot", context)},
          {"gap ambiguous", gap_report(gap_example::ambiguous(), "example robot", context, "Turn on the spot.")},
          {"gap unexplained", gap_report(gap_example::unexplained(), "example robot", context)},
          {"no gap", gap_report(gap_example::no_gap(), "example robot", context)},
          {"default gap", gap_report({}, {}, {})},
          {"default identification", identify_report({}, {})},
          {"default result", commission_report({}, {})},
          {"default detection", detect_report({}, {}, {})}};
}

// The JSON blocks of a page.
std::vector<nlohmann::json> blocks(const std::string& page) {
  std::vector<nlohmann::json> found;
  const std::string open = "<script type=\"application/json\">";
  for (std::size_t at = page.find(open); at != std::string::npos; at = page.find(open, at)) {
    at += open.size();
    found.push_back(nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at)));
  }
  return found;
}

// The page without scripts and styles: what a reader sees.
std::string visible(const std::string& page) {
  static const std::string ends[][2] = {{"<script", "</script>"}, {"<style", "</style>"}};
  std::string text = page;
  for (const auto& [open, close] : ends) {
    for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at)) {
      text.erase(at, text.find(close, at) + close.size() - at);
    }
  }
  return text;
}

TEST(EveryPage, LoadsNothing) {
  for (const auto& [name, page] : all_pages()) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(example::holds(page, {"Content-Security-Policy\" content=\"default-src 'none'"}));
    const std::string text = visible(page);
    EXPECT_TRUE(example::lacks(text, {"http:"}));
    EXPECT_TRUE(example::lacks(text, {"https:"}));
    for (const char* loads : {" src=", "<link", "<img", "<iframe", "<object", "@import", "url("}) {
      EXPECT_TRUE(example::lacks(page, {loads})) << loads;
    }
  }
}

TEST(EveryPage, HoldsFiniteNumbersOnly) {
  for (const auto& [name, page] : all_pages()) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(std::regex_search(visible(page), std::regex("\\b(nan|inf|NaN|Infinity)\\b")));
    EXPECT_NO_THROW(blocks(page));  // JSON knows no NaN
  }
}

TEST(EveryPage, EscapesEveryName) {
  const std::string evil = "</script><script>alert(1)</script><b onclick=\"x\">&";
  CommissionContext context = example::context(300);
  context.title = context.software = context.command_line = evil;
  context.log_files = context.warnings = {evil};
  context.seeds = {{evil, 1}};
  context.signals->names[0] = evil;
  Commissioning result = example::partial();
  result.message = evil;
  result.notes = {evil};
  result.model.robot.name = evil;
  for (std::string* text : {&result.model.model.outputs[0], &result.model.model.output_units[0],
                            &result.parameters[0].parameter.name, &result.parameters[0].parameter.physical,
                            &result.parameters[0].parameter.unit, &result.parameters[0].parameter.physical_unit,
                            &result.parameters[1].reason, &result.parameters[1].parameter.excite}) {
    *text = evil;
  }
  Commissioning contradicted = example::empty();
  contradicted.model.model.outputs[0] = contradicted.parameters[0].parameter.name = evil;
  const Detection fault = example::detection(300, true);
  commission::Identification identification = identified(true);
  for (std::string* text :
       {&identification.setting.robot.name, &identification.setting.model.outputs[0],
        &identification.setting.model.parameters[0].physical, &identification.setting.model.parameters[0].physical_unit,
        &identification.noise[0].column, &identification.noise[0].choice.reason, &identification.shapes[0].unit,
        &identification.fit.choice.reason, &identification.regions.rows[0].promise,
        &identification.identifiability.unseen[0].words}) {
    *text = evil;
  }
  identification.notes = {evil};
  Designed plan = designed();
  plan.subject.robot.name = plan.subject.model.parameters[0].physical = evil;
  for (const std::string& page :
       {commission_report(result, context), commission_report(contradicted, context),
        identify_report(identification, context), design_report(plan.design, plan.subject, plan.limits, context),
        detect_report(fault, result.model, context), failure_report(evil, context)}) {
    EXPECT_TRUE(example::lacks(page, {"<script>alert"}));
    EXPECT_TRUE(example::lacks(page, {"<b onclick"}));
    EXPECT_TRUE(example::holds(page, {"&lt;script&gt;alert"}));
  }
}

TEST(EveryPage, ClosesWhatItOpens) {
  for (const auto& [name, page] : all_pages()) {
    const std::string text = visible(page);
    for (const std::string tag :
         {"table", "tr", "td", "section", "figure", "svg", "p", "ul", "li", "dl", "button", "span"}) {
      const auto times = [&](const std::string& pattern) {
        const std::regex r(pattern);
        return std::distance(std::sregex_iterator(text.begin(), text.end(), r), std::sregex_iterator());
      };
      EXPECT_EQ(times("<" + tag + "[ >]"), times("</" + tag + ">")) << name << ": " << tag;
    }
  }
}

TEST(IdentifyPage, SaysWhatWasFoundAndDrawsIt) {
  const std::string page = identify_report(identified(false), example::context(900));
  for (const char* heading :
       {"What to do next", "Estimates and intervals", "What the log can tell", "Which seconds tell it",
        "Beside the model", "Kinematics", "Outliers and physical sense", "Noise", "Raw signals"}) {
    EXPECT_TRUE(example::holds(page, {heading}));
  }
  EXPECT_TRUE(example::holds(page, {"aria-label=\"information over time\"", "aria-label=\"residual over delay\""}));
  EXPECT_TRUE(example::holds(page, {"late"}));
  EXPECT_TRUE(example::lacks(identify_report({}, {}), {"aria-label=\"information over time\""}));
}

TEST(Page, OfSixThousandBinsIsBelowTwoMegabytes) {
  const CommissionContext context = example::context(6000);
  EXPECT_LT(commission_report(example::done(), context).size(), 2'000'000U);
  EXPECT_LT(detect_report(example::detection(6000, true), example::done().model, context).size(), 2'000'000U);
}

TEST(EveryPage, HasTheTimesOfEveryChartOnce) {
  for (const auto& [name, page] : all_pages()) {
    SCOPED_TRACE(name);
    for (const nlohmann::json& block : blocks(page)) {
      if (block.contains("clock")) {
        const std::string id = "id=\"" + block["clock"].get<std::string>() + "\"";
        const std::size_t at = page.find(id);
        EXPECT_NE(at, std::string::npos) << id;
        EXPECT_EQ(page.find(id, at + 1), std::string::npos) << id;
      }
    }
  }
}

TEST(Page, SaysThatALongLogWasThinned) {
  CommissionContext context = example::context(60);
  EXPECT_TRUE(example::lacks(failure_report("", context), {"peaks are kept"}));
  context.rows = 5'000'000;
  EXPECT_TRUE(
      example::holds(failure_report("", context), {"5\u202f000\u202f000 rows of the log are drawn as 60 points"}));
}

TEST(Packed, IsSmall) {
  std::vector<double> t, constant, noise;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 100'000; ++i) {
    t.push_back(0.01 * i);
    constant.push_back(3.0);
    noise.push_back(100.0 * std::sin(1e-4 * i) + uniform(generator));  // 200 of 20 000 steps: 7.6 bits
  }
  EXPECT_LT(report::pack_times(t, {}).text.size(), 5000U);
  EXPECT_LT(report::pack(constant).text.size(), 5000U);
  EXPECT_LT(report::pack(noise).text.size(), 100'000U * 5 / 3);
}

TEST(Thinned, KeepsEveryPeakAndEverySegment) {
  LogTable table = example::signals(100'000);
  table.columns[0][77'777] = 123.0;
  table.columns[0][33'333] = -45.0;
  const LogTable thin = report::thinned(table, 6000);
  EXPECT_LE(thin.rows(), 6004U);
  EXPECT_EQ(thin.segment_starts.size(), table.segment_starts.size());
  EXPECT_EQ(thin.t[thin.segment_starts[1]], table.t[table.segment_starts[1]]);
  EXPECT_EQ(*std::max_element(thin.columns[0].begin(), thin.columns[0].end()), 123.0);
  EXPECT_EQ(*std::min_element(thin.columns[0].begin(), thin.columns[0].end()), -45.0);
  for (std::size_t c = 0; c < thin.columns.size(); ++c) {
    EXPECT_EQ(thin.columns[c].size(), thin.rows());
  }
}

}  // namespace
}  // namespace wheelwright::report::page_test
