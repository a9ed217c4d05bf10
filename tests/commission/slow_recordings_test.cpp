// SPDX-License-Identifier: Apache-2.0
// Recordings of other worlds and of real machines, read where they lie beside the project.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/contradictions.hpp"
#include "commission/identification.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/error.hpp"
#include "detector/online_model.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::commission::slow_recordings_test {
namespace {

namespace fs = std::filesystem;

class SlowRecordings : public ::testing::Test {
 protected:
  void SetUp() override {
    (void)(testing_support::skip_without_recordings(root / "data") ||
           testing_support::skip_without_recordings(root / "withheld-dev"));
  }
  const fs::path root = WHEELWRIGHT_SHARED_DIR;
};

const ParameterResult& parameter(const Commissioning& result, const std::string& physical) {
  const auto found = std::ranges::find_if(result.parameters,
                                          [&](const ParameterResult& p) { return p.parameter.physical == physical; });
  if (found == result.parameters.end()) {
    throw InvalidArgument("no parameter " + physical);
  }
  return *found;
}

// A healthy robot in another physics engine: commissioned on the first half, watched on the second.
TEST_F(SlowRecordings, HealthyBaselinesRaiseNoEventInTheirSecondHalf) {
  int cases = 0;
  for (const auto& entry : fs::directory_iterator(root / "withheld-dev")) {
    if (!fs::exists(entry.path() / "baseline.csv.gz")) {
      continue;
    }
    ++cases;
    const std::string name = entry.path().filename();
    const Robot robot = read_robot(entry.path() / "robot.yaml");
    CsvLog file({entry.path() / "baseline.csv.gz"});
    const LogTable table = read_all(file);
    const LogTable first = core::slice(table, 0, table.rows() / 2),
                   second = core::slice(table, table.rows() / 2, table.rows());
    TableSource learning(first), watching(second);
    const Commissioning result = commission_robot(learning, robot);
    ASSERT_EQ(result.status, Commissioning::Status::done) << name << ": " << result.message;
    const Detection detection = detect(watching, make_detector(result.model));
    EXPECT_GT(detection.instants, second.rows() / 2) << name;
    EXPECT_TRUE(detection.events.empty())
        << name << ": " << detection.events.size() << " events, the first at " << detection.events[0].start << " s";
  }
  EXPECT_EQ(cases, 24);
}

TEST_F(SlowRecordings, LumpedMassAndInertiaOfTheBaselinesAreThoseOfTheRobotFile) {
  for (const auto& entry : fs::directory_iterator(root / "withheld-dev")) {
    if (!fs::exists(entry.path() / "baseline.csv.gz")) {
      continue;
    }
    const std::string name = entry.path().filename();
    const Robot robot = read_robot(entry.path() / "robot.yaml");
    CsvLog log({entry.path() / "baseline.csv.gz"});
    const Commissioning result = commission_robot(log, robot);
    ASSERT_EQ(result.status, Commissioning::Status::done) << name << ": " << result.message;
    for (const char* physical : {"mass", "yaw_inertia"}) {
      const ParameterResult& p = parameter(result, physical);
      const double expected = p.parameter.per_physical * robot.nominal.at(physical);
      EXPECT_NEAR(*p.estimate, expected, 0.01 * expected) << name << ", " << physical;
      EXPECT_LE(p.lower, expected) << name << ", " << physical;
      EXPECT_GE(p.upper, expected) << name << ", " << physical;
    }
  }
}

// Janot, Gautier and Brunot (2019) publish these values for the linear axis.
TEST_F(SlowRecordings, TheElectroMechanicalAxisIsIdentifiedFromPositionsAlone) {
  CsvLog log({root / "data/emps/emps.csv"});
  const Commissioning result = commission_robot(log, read_robot(root / "data/emps.yaml"));
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  struct Published {
    const char* name;
    double value, tolerance;
  };
  for (const auto& [name, value, tolerance] :
       {Published{"inertia", 95.1089, 0.01}, Published{"viscous", 203.5034, 0.03}, Published{"coulomb", 20.3935, 0.03},
        Published{"offset", -3.1648, 1.0}}) {
    const ParameterResult& p = parameter(result, name);
    EXPECT_NEAR(*p.estimate, value, tolerance * std::abs(value)) << name;
    EXPECT_LE(p.lower, value) << name;
    EXPECT_GE(p.upper, value) << name;
  }
}

// From efforts and positions only: 95 % intervals of every method, and what is left on held-out driving. The same
// authors report that the model explains 99.8 % of the force's variation, a relative error of 0.045.
TEST_F(SlowRecordings, IntervalsOfTheAxisHoldAllPublishedValues) {
  const Robot robot = read_robot(root / "data/emps.yaml");
  logs::CsvOptions reader;
  reader.only = {"t", "position", "effort"};
  CsvLog log({root / "data/emps/emps.csv"}, reader);
  commission::IdentificationOptions options;
  options.shapes = false;
  const commission::Identification result = commission::identify(log, robot, options);
  const std::map<std::string, double> published = {
      {"inertia", 95.1089}, {"viscous", 203.5034}, {"coulomb", 20.3935}, {"offset", -3.1648}};
  ASSERT_EQ(result.setting.model.p(), published.size());
  for (const inference::RegionRow& row : result.regions.rows) {
    ASSERT_TRUE(row.available) << row.remark;
    for (std::size_t j = 0; j < published.size(); ++j) {
      const std::string& name = result.setting.model.parameters[j].physical;
      EXPECT_LE(row.lower[static_cast<Eigen::Index>(j)], published.at(name))
          << name << ", " << inference::to_string(row.method);
      EXPECT_GE(row.upper[static_cast<Eigen::Index>(j)], published.at(name))
          << name << ", " << inference::to_string(row.method);
    }
  }
  const Commissioning commissioned = commission_robot(log, robot);
  ASSERT_EQ(commissioned.validation.size(), 1U);
  EXPECT_GT(commissioned.validation[0].instants, 1000U);
  EXPECT_LT(commissioned.validation[0].nrmse, 0.05);
}

// Not every one of these robots is healthy; the current of one side of run 16 is zero throughout.
TEST_F(SlowRecordings, EveryRobotOfTheFleetGivesAModelOrSaysWhatContradictsIt) {
  const Robot robot = read_robot(root / "data/regbot.yaml");
  int runs = 0, contradicted = 0;
  for (const auto& entry : fs::directory_iterator(root / "data/regbot_fleet")) {
    if (entry.path().extension() != ".csv") {
      continue;
    }
    ++runs;
    const std::string name = entry.path().filename();
    CsvLog log({entry.path()});
    const Commissioning result = commission_robot(log, robot);
    const bool withdrawn = std::ranges::any_of(result.contradictions, &LogContradiction::withdraws);
    EXPECT_EQ(result.status == Commissioning::Status::contradicted, withdrawn) << name << ": " << result.message;
    if (withdrawn) {
      ++contradicted;
      EXPECT_TRUE(result.model.facets.empty()) << name;
    } else {
      EXPECT_TRUE(result.status == Commissioning::Status::done || result.status == Commissioning::Status::partial)
          << name << ": " << result.message;
      EXPECT_NO_THROW(static_cast<void>(make_detector(result.model))) << name;
    }
    if (name == "run_16.csv") {
      ASSERT_FALSE(result.contradictions.empty());
      EXPECT_EQ(result.contradictions.front().kind, LogContradiction::Kind::effort_constant);
      EXPECT_EQ(result.contradictions.front().subject, "current_r");
    }
  }
  EXPECT_GT(runs, 0);
  EXPECT_LE(5 * contradicted, runs);
}

// Healthy robots of another physics engine: nothing is said against any of them, and every one late by a sample is
// told.
TEST_F(SlowRecordings, NoHealthyBaselineIsContradictedAndEveryLateOneIs) {
  int cases = 0, drawn = 0, beyond = 0;
  for (const char* world : {"withheld-dev", "withheld-train"}) {
    for (const auto& entry : fs::directory_iterator(root / world)) {
      if (!fs::exists(entry.path() / "baseline.csv.gz")) {
        continue;
      }
      ++cases;
      const std::string name = entry.path().filename();
      const Robot robot = read_robot(entry.path() / "robot.yaml");
      CsvLog file({entry.path() / "baseline.csv.gz"});
      LogTable table = read_all(file);
      TableSource log(table);
      const Setting setting = settle(log, robot);
      const Fit fit = fit_log(log, setting, Part::everything, 1e-3);
      const SignalFindings healthy = contradictions_in_log(log, setting, fit);
      EXPECT_TRUE(healthy.contradictions.empty()) << name << ": " << healthy.contradictions.front().sentence;
      ASSERT_TRUE(healthy.timing.has_value()) << name;
      for (const char* effort : {"tau_r", "tau_l"}) {
        std::vector<double>& tau = table.column(effort);
        std::rotate(tau.begin(), tau.end() - 1, tau.end());
      }
      const auto timing = effort_timing(log, setting, fit_log(log, setting, Part::everything, 1e-3));
      ASSERT_TRUE(timing.has_value()) << name;
      EXPECT_TRUE(is_latency(*timing, setting.survey.median_step)) << name;
      // Of noisy rows the ones between samples leave less, which draws both shifts away from whole steps: no more often
      // beyond what they are told with than 95 % intervals may be, and hardly ever by a twentieth of a step.
      const double step = setting.survey.median_step;
      const double off = std::abs(timing->delay - healthy.timing->delay - step);
      EXPECT_LE(off, 0.1 * step) << name;
      beyond += off > 2.0 * std::hypot(timing->standard_error, healthy.timing->standard_error) ? 1 : 0;
      drawn += off > 0.05 * step ? 1 : 0;
    }
  }
  EXPECT_GE(cases, 24);
  EXPECT_LE(20 * beyond, cases);
  EXPECT_LE(20 * drawn, cases);
}

}  // namespace
}  // namespace wheelwright::commission::slow_recordings_test
