// SPDX-License-Identifier: Apache-2.0
#include "study/study.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::study::study_test {
namespace {

Study small() {
  Study study;
  study.subject.scenario = testing_support::noisy_drive(3);
  study.subject.robot = study.subject.scenario->robot;
  study.inputs = {{"noise.effort", "", 0.01, 0.05, 0.02, false}, {"filter.beta", "1/s", 5.0, 20.0, 8.0, true}};
  study.quantities = study_quantities({"width.mass", "commissioned"}, study.subject.robot);
  study.methods.one_at_a_time = 3;
  study.methods.grid = Grid{{2, 2}, nominal_point(study.inputs), 100};
  return study;
}

TEST(Study, SharedPointsAreEvaluatedOnce) {
  Study study = small();
  study.methods.grid->levels = {3, 1};
  const StudyDesign design = design_of(study);
  ASSERT_EQ(design.points.rows(), 1 + 2 * 3 + 3);
  // The grid's three points are those of the first input's curve.
  EXPECT_EQ(design.rows.size(), 7U);
  for (std::size_t row = 0; row < design.items.size(); ++row) {
    const std::size_t first = design.rows[design.items[row]];
    EXPECT_EQ(design.points.row(static_cast<Eigen::Index>(row)), design.points.row(static_cast<Eigen::Index>(first)));
  }
}

// At the nominal point nothing is changed, to the last digit.
TEST(Study, TheNominalPointIsTheSubject) {
  const Study study = small();
  const StudyCase subject = case_at(study, nominal_point(study.inputs));
  EXPECT_EQ(subject.robot.noise.effort.value, 0.02);
  EXPECT_EQ(subject.robot.filter.beta, 8.0);
  EXPECT_EQ(name_of_point(study, nominal_point(study.inputs)), "noise.effort = 0.02, filter.beta = 8");
}

TEST(Study, ResultsReadBackExactly) {
  const CaseResult result{
      {0.1, -1.0 / 3.0, std::numeric_limits<double>::infinity(), 1e-300, std::numeric_limits<double>::quiet_NaN()},
      "no model:\nit says why"};
  const CaseResult back = case_result(text_of(result));
  ASSERT_EQ(back.values.size(), result.values.size());
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(back.values[k], result.values[k]);
  }
  EXPECT_TRUE(std::isnan(back.values[4]));
  EXPECT_EQ(back.finding, result.finding);
  EXPECT_THROW(static_cast<void>(case_result("1 x\n")), InvalidArgument);
  EXPECT_TRUE(case_result("\n").values.empty());
}

// What each method is told is the value at its own points.
TEST(Study, ValuesReachTheirMethods) {
  const Study study = small();
  const StudyDesign design = design_of(study);
  StudyValues values(study, design);
  for (std::size_t item = 0; item < design.rows.size(); ++item) {
    const Eigen::VectorXd u = design.points.row(static_cast<Eigen::Index>(design.rows[item]));
    values.put(item, {{10.0 * u[0] + u[1], 1.0}, item == 1 ? "a reason" : ""});
  }
  const StudyResult result = values.result();
  const Eigen::VectorXd nominal = nominal_point(study.inputs);
  EXPECT_DOUBLE_EQ(result.one_at_a_time[0].nominal, 10.0 * nominal[0] + nominal[1]);
  EXPECT_NEAR(result.one_at_a_time[0].inputs[0].swing, 10.0, 1e-12);
  EXPECT_NEAR(result.one_at_a_time[0].inputs[1].swing, 1.0, 1e-12);
  EXPECT_EQ(result.one_at_a_time[0].order.front(), 0U);
  for (Eigen::Index row = 0; row < result.grid.rows(); ++row) {
    const Eigen::VectorXd u = design.points.row(design.grid.first + row);
    EXPECT_DOUBLE_EQ(result.grid(row, 0), 10.0 * u[0] + u[1]);
  }
  ASSERT_EQ(result.findings.size(), 1U);
  EXPECT_EQ(result.findings[0].points, 1U);
  EXPECT_THROW(values.put(0, {{1.0}, ""}), InvalidArgument);
}

TEST(Study, AStudyWithoutMethodsOrInputsIsRefused) {
  Study study = small();
  study.methods = {};
  EXPECT_THROW(static_cast<void>(design_of(study)), InvalidArgument);
  study.methods.local = true;
  EXPECT_EQ(design_of(study).points.rows(), 0);
  study.inputs.clear();
  EXPECT_THROW(static_cast<void>(design_of(study)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::study_test
