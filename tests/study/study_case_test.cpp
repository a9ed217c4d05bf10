// SPDX-License-Identifier: Apache-2.0
#include "study/study_case.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/sim/simulation.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::study::study_case_test {
namespace {

using testing_support::noisy_drive;

StudyCase simulated() {
  StudyCase subject;
  subject.scenario = noisy_drive(3);
  subject.robot = subject.scenario->robot;
  subject.robot.prior["mass"] = {5.0, 80.0};
  return subject;
}

StudyCase recorded() {
  StudyCase subject = simulated();
  subject.log = std::make_shared<LogTable>(sim::simulate(*subject.scenario));
  subject.scenario.reset();
  return subject;
}

bool same(const LogTable& a, const LogTable& b) { return a.names == b.names && a.t == b.t && a.columns == b.columns; }

// Every input set to what it is anyway leaves the drive as it is.
TEST(StudyCase, NominalValuesChangeNothing) {
  for (const StudyCase& subject : {simulated(), recorded()}) {
    const LogTable before = drive_of_case(subject);
    for (const std::string name :
         {"noise.effort", "declared.effort", "filter.alpha", "filter.beta", "wheel_radius", "track_width",
          "encoder_counts_per_turn", "prior.mass", "rate", "duration", "outliers", "outliers_allowed", "excitation",
          "truth.mass", "truth.viscous_linear", "seed"}) {
      StudyCase copy = subject;
      if (!subject.scenario && (name == "excitation" || name.starts_with("truth") || name == "seed")) {
        EXPECT_THROW(static_cast<void>(nominal_of_input(subject, name)), InvalidArgument) << name;
        continue;
      }
      const auto nominal = nominal_of_input(subject, name);
      ASSERT_TRUE(nominal) << name;
      set_input(copy, name, *nominal);
      EXPECT_TRUE(same(before, drive_of_case(copy))) << name;
      EXPECT_NEAR(copy.robot.prior["mass"].lower, 5.0, 1e-12);
      EXPECT_NO_THROW(static_cast<void>(unit_of_input(name))) << name;
    }
  }
}

TEST(StudyCase, ABetterSensorIsBetterInTheWorldAndInTheFile) {
  StudyCase subject = simulated();
  set_input(subject, "noise.effort", 0.004);
  EXPECT_EQ(subject.scenario->sensors.effort, 0.004);
  EXPECT_EQ(subject.robot.noise.effort.value, 0.004);
  set_input(subject, "declared.effort", 0.1);
  EXPECT_EQ(subject.scenario->sensors.effort, 0.004);
  EXPECT_EQ(subject.robot.noise.effort.value, 0.1);
}

// The file's geometry is a belief: the world keeps its own.
TEST(StudyCase, AWrongRadiusIsWrongInTheFileOnly) {
  StudyCase subject = simulated();
  set_input(subject, "wheel_radius", 0.1);
  EXPECT_EQ(subject.robot.wheel_radius, 0.1);
  EXPECT_EQ(subject.scenario->robot.wheel_radius, 0.0975);
}

TEST(StudyCase, APriorIsWidenedInRatio) {
  StudyCase subject = simulated();
  set_input(subject, "prior.mass", 0.5);
  EXPECT_NEAR(subject.robot.prior["mass"].lower, 10.0, 1e-12);
  EXPECT_NEAR(subject.robot.prior["mass"].upper, 40.0, 1e-12);
  EXPECT_THROW(set_input(subject, "prior.yaw_inertia", 0.5), InvalidArgument);
}

TEST(StudyCase, ARecordedLogIsCutAndThinned) {
  StudyCase subject = recorded();
  set_input(subject, "duration", 5.0);
  set_input(subject, "rate", 34.0);  // every third row comes nearest
  const LogTable log = drive_of_case(subject);
  ASSERT_GT(log.rows(), 2U);
  EXPECT_NEAR(log.t.back(), 5.0, 0.03);
  for (std::size_t k = 0; k < log.rows(); ++k) {
    EXPECT_EQ(log.t[k], subject.log->t[3 * k]);
    EXPECT_EQ(log.columns[0][k], subject.log->columns[0][3 * k]);
  }
}

TEST(StudyCase, MeansOverAStepAreNotThinned) {
  StudyCase subject = recorded();
  LogTable bare = *subject.log;
  for (std::size_t c = bare.names.size(); c-- > 0;) {
    if (bare.names[c].starts_with("phi")) {
      bare.names.erase(bare.names.begin() + static_cast<std::ptrdiff_t>(c));
      bare.columns.erase(bare.columns.begin() + static_cast<std::ptrdiff_t>(c));
    }
  }
  subject.log = std::make_shared<LogTable>(bare);
  set_input(subject, "rate", 25.0);
  EXPECT_THROW(drive_of_case(subject), InvalidArgument);
}

TEST(StudyCase, OutliersAreAsManyAsAsked) {
  StudyCase subject = recorded();
  const LogTable clean = drive_of_case(subject);
  subject.outliers = 7;
  const LogTable dirty = drive_of_case(subject);
  std::size_t changed = 0;
  for (std::size_t k = 0; k < clean.rows(); ++k) {
    bool differs = false;
    for (std::size_t c = 0; c < clean.columns.size(); ++c) {
      differs = differs || clean.columns[c][k] != dirty.columns[c][k];
    }
    changed += differs ? 1 : 0;
  }
  EXPECT_EQ(changed, 7U);
  EXPECT_TRUE(same(dirty, drive_of_case(subject)));
  subject.seed = 99;
  EXPECT_FALSE(same(dirty, drive_of_case(subject)));
}

TEST(StudyCase, SaysWhatItExpected) {
  StudyCase subject = simulated();
  const auto message = [&](const std::string& name, double x) {
    try {
      set_input(subject, name, x);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message("noise.efort", 1.0).find("wheel_speed"), std::string::npos);
  EXPECT_NE(message("alpha", 1.0).find("filter.alpha"), std::string::npos);
  EXPECT_NE(message("truth.length", 1.0).find("yaw_inertia"), std::string::npos);
  EXPECT_NE(message("filter.beta", -1.0).find("filter.beta"), std::string::npos);
  EXPECT_NE(message("rate", std::nan("")).find("rate"), std::string::npos);
}

}  // namespace
}  // namespace wheelwright::study::study_case_test
