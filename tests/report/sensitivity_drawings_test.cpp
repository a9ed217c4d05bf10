// SPDX-License-Identifier: Apache-2.0
/// \file
/// Drawings of sensitivity studies: well formed, escaped, in order, and none where there is nothing to show.
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "results/report/sensitivity_report.hpp"

namespace wheelwright::report::sensitivity_drawings_test {

using core::kNan;

namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const report::AxisLabel kQuantity{"width of <mass> & \"rest\"", "kg"};
const std::vector<std::string> kInputs = {"noise <1>", "α & β"};
const std::string kSafe = "noise &lt;1&gt;";

// Elements closed in the order of their opening, attributes quoted, no bare ampersand, no number that is none.
void expect_well_formed(const std::string& svg) {
  ASSERT_EQ(svg.substr(0, 5), "<svg ");
  std::vector<std::string> open;
  std::string rest = svg;
  const std::regex tag("^<(/?)([a-z]+)((?: [A-Za-z0-9-]+=\"[^\"<]*\")*)(/?)>");
  while (!rest.empty()) {
    if (rest[0] != '<') {
      rest.erase(0, rest.find('<'));
      continue;
    }
    std::smatch found;
    const std::string head = rest.substr(0, rest.find('>') + 1);
    ASSERT_TRUE(std::regex_search(head, found, tag)) << head;
    if (found[1].length() > 0) {
      ASSERT_FALSE(open.empty());
      ASSERT_EQ(open.back(), found[2]);
      open.pop_back();
    } else if (found[4].length() == 0) {
      open.push_back(found[2]);
    }
    rest.erase(0, head.size());
  }
  EXPECT_TRUE(open.empty());
  EXPECT_FALSE(std::regex_search(svg, std::regex("&(?!(amp|lt|gt|quot|#39|#x27|apos);)"))) << svg;
  EXPECT_FALSE(std::regex_search(svg, std::regex("[\" ,ML]-?(nan|inf)"))) << svg;
}

study::OneAtATime study() {
  Eigen::MatrixXd values(7, 1);
  values << 5.0, 4.0, 5.0, 6.0, 9.0, kNan, 1.0;
  return study::one_at_a_time(values, 2, 3).at(0);
}

TEST(Tornado, HasTheLargestSwingOnTop) {
  const std::string svg = report::tornado(study(), kInputs, kQuantity);
  expect_well_formed(svg);
  EXPECT_LT(svg.find("α &amp; β"), svg.find(kSafe));
  EXPECT_THAT(report::tornado(study(), kInputs, kQuantity, 1), Not(HasSubstr(kSafe)));
}

TEST(Tornado, IsNoneWithoutValues) {
  EXPECT_EQ(report::tornado({}, {}, kQuantity), "");
  EXPECT_EQ(
      report::tornado(study::one_at_a_time(Eigen::MatrixXd::Constant(7, 1, kNan), 2, 3).at(0), kInputs, kQuantity), "");
  EXPECT_THROW((void)report::tornado(study(), {"one"}, kQuantity), InvalidArgument);
}

TEST(Tornado, ShowsAConstantQuantity) {
  expect_well_formed(
      report::tornado(study::one_at_a_time(Eigen::MatrixXd::Zero(7, 1), 2, 3).at(0), kInputs, kQuantity));
}

TEST(SensitivityCurve, BreaksWhereValuesAreMissing) {
  const Eigen::Vector<double, 5> x(0.01, 0.1, 1.0, 10.0, 100.0), y(1.0, 2.0, kNan, 3.0, 2.0);
  for (const bool logarithmic : {false, true}) {
    const std::string svg = report::sensitivity_curve(x, y, 1.0, 2.5, logarithmic, {"β", "1/s"}, kQuantity);
    expect_well_formed(svg);
    std::smatch path;
    ASSERT_TRUE(std::regex_search(svg, path, std::regex(" d=\"(M[0-9. ]+L[0-9. ]+M[0-9. ]+L[0-9. ]+)\"")));
    EXPECT_THAT(svg, HasSubstr("class=\"centre\""));
  }
  EXPECT_THAT(report::sensitivity_curve(x, y, 1.0, kNan, true, {"β", "1/s"}, kQuantity),
              Not(HasSubstr("class=\"centre\"")));
}

TEST(SensitivityCurve, IsNoneWithoutValues) {
  const Eigen::Vector2d x(0.0, 1.0), none(kNan, kNan), one(1.0, 1.0);
  EXPECT_EQ(report::sensitivity_curve({}, {}, 0.0, 0.0, false, {}, kQuantity), "");
  EXPECT_EQ(report::sensitivity_curve(x, none, 0.0, kNan, false, {}, kQuantity), "");
  EXPECT_THROW((void)report::sensitivity_curve(x, one.head(1), 0.0, 1.0, false, {}, kQuantity), InvalidArgument);
  EXPECT_THROW((void)report::sensitivity_curve(x, one, 0.5, 1.0, true, {}, kQuantity), InvalidArgument);
  expect_well_formed(report::sensitivity_curve(x, one, 0.5, 1.0, false, {}, kQuantity));
}

study::SobolIndices indices() {
  study::SobolIndices out{.status = study::SobolStatus::estimated};
  out.first = {{0.2, 0.05, 0.1, 0.3}, {0.5, 0.1, 0.3, 0.7}};
  out.total = {{0.3, 0.05, 0.2, 0.4}, {0.8, 5.0, -9.2, 10.8}};
  return out;
}

TEST(SobolBars, HaveWhiskersAndOrder) {
  const std::string svg = report::sobol_bars(indices(), kInputs);
  expect_well_formed(svg);
  EXPECT_LT(svg.find("α &amp; β"), svg.find(kSafe));
  std::size_t whiskers = 0;
  for (std::size_t at = svg.find("whisker"); at != std::string::npos; at = svg.find("whisker", at + 1)) {
    ++whiskers;
  }
  EXPECT_EQ(whiskers, 4U);
}

TEST(SobolBars, AreNoneUnlessEstimated) {
  study::SobolIndices constant = indices();
  constant.status = study::SobolStatus::constant;
  EXPECT_EQ(report::sobol_bars(constant, kInputs), "");
  EXPECT_EQ(report::sobol_bars({}, {}), "");
  EXPECT_THROW((void)report::sobol_bars(indices(), {"one"}), InvalidArgument);
}

TEST(MorrisScatter, NumbersInputsBySize) {
  const std::vector<study::ElementaryEffects> effects = {{0.1, 0.5, 0.2, 0.1, 0.3, 0.7, 20},
                                                         {2.0, 2.0, 0.0, 0.0, 2.0, 2.0, 20}};
  const std::string svg = report::morris_scatter(effects, kInputs, kQuantity);
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr(">1 α &amp; β<"));
  EXPECT_THAT(svg, HasSubstr(">2 " + kSafe + "<"));
}

TEST(MorrisScatter, IsNoneWithoutEffects) {
  const study::ElementaryEffects none{kNan, kNan, kNan, kNan, kNan, kNan, 0};
  EXPECT_EQ(report::morris_scatter({none, none}, kInputs, kQuantity), "");
  EXPECT_EQ(report::morris_scatter({}, {}, kQuantity), "");
  expect_well_formed(report::morris_scatter({none, {}}, kInputs, kQuantity));
}

TEST(SensitivityMap, CrossesCellsWithoutAValue) {
  const study::GridMap map{Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(0.0, 1.0),
                           (Eigen::Matrix2d() << 1.0, 2.0, kNan, 4.0).finished()};
  const std::string svg = report::sensitivity_map(map, map.x, map.y, {"a < b", "s"}, {"c", ""}, kQuantity);
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr("no value"));
  EXPECT_THAT(svg, HasSubstr("dark 4.00\u00a0kg, pale 1.00\u00a0kg"));
  EXPECT_THAT(svg, HasSubstr("a &lt; b, s"));
}

TEST(SensitivityMap, IsNoneWithoutValues) {
  const study::GridMap map{Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(0.0, 1.0), Eigen::Matrix2d::Constant(kNan)};
  EXPECT_EQ(report::sensitivity_map(map, map.x, map.y, {}, {}, kQuantity), "");
  EXPECT_EQ(report::sensitivity_map({}, {}, {}, {}, {}, kQuantity), "");
  EXPECT_THROW((void)report::sensitivity_map(map, map.x.head(1), map.y, {}, {}, kQuantity), InvalidArgument);
  study::GridMap flat = map;
  flat.values.setConstant(3.0);
  expect_well_formed(report::sensitivity_map(flat, map.x, map.y, {}, {}, kQuantity));
}

}  // namespace
}  // namespace wheelwright::report::sensitivity_drawings_test
