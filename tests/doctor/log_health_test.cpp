// SPDX-License-Identifier: Apache-2.0
// Each defect, put alone into a sound simulated log, is named; the sound log has nothing to warn of.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/doctor/log_health.hpp"
#include "detector/detector_options.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/sim/simulation.hpp"
#include "results/health_json.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/kinematic_drives.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::doctor::log_health_test {
namespace {

using testing_support::posed_drive;

std::string told(const LogHealth& health, FindingSeverity least) {
  std::string text;
  for (const LogFinding& f : health.findings) {
    if (f.severity >= least) {
      text += std::string(to_string(f.severity)) + " " + f.id + ": " + f.sentence + "\n";
    }
  }
  return text;
}

// A drive of 24 s with angles, speeds, torques, pose and gyro.
Scenario sound_scenario() {
  Scenario s = posed_drive(3, 24.0);
  s.sensors.speeds = true;
  s.sensors.wheel_speed = 0.02;
  s.robot.noise.wheel_speed.value = 0.02;
  s.robot.nominal = {{"mass", 20.0}, {"yaw_inertia", 1.0}, {"viscous_linear", 4.0}, {"viscous_yaw", 0.5}};
  return s;
}

LogTable with_gyro(LogTable log, const Robot& robot) {
  std::vector<double> gyro;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    gyro.push_back(robot.wheel_radius / robot.track_width * (log.column("omega_r")[k] - log.column("omega_l")[k]));
  }
  log.names.emplace_back("gyro_z");
  log.columns.push_back(gyro);
  return log;
}

class LogHealthTest : public ::testing::Test {
 protected:
  const Scenario scenario = sound_scenario();
  const Robot robot = scenario.robot;
  LogTable log = with_gyro(sim::simulate(scenario), robot);

  void scale(const std::vector<std::string>& columns, double factor) {
    for (const std::string& name : columns) {
      std::ranges::transform(log.column(name), log.column(name).begin(), [&](double v) { return factor * v; });
    }
  }
  // Only every `nth` value is new.
  void hold(const std::string& column, std::size_t nth) {
    std::vector<double>& values = log.column(column);
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = values[k - k % nth];
    }
  }
  void drop(const std::function<bool(std::size_t)>& row) {
    LogTable kept;
    kept.names = log.names;
    kept.columns.resize(log.columns.size());
    for (std::size_t k = 0; k < log.rows(); ++k) {
      if (!row(k)) {
        kept.t.push_back(log.t[k]);
        for (std::size_t c = 0; c < log.columns.size(); ++c) {
          kept.columns[c].push_back(log.columns[c][k]);
        }
      }
    }
    log = kept;
  }
  void remove(const std::vector<std::string>& columns) {
    for (const std::string& name : columns) {
      const auto at = std::ranges::find(log.names, name) - log.names.begin();
      log.names.erase(log.names.begin() + at);
      log.columns.erase(log.columns.begin() + at);
    }
  }
  // The finding `id` is there with at least this severity.
  LogFinding expect(const std::string& id, FindingSeverity severity, bool with_robot = true) {
    const LogHealth health = examine(log, with_robot ? std::optional(robot) : std::nullopt);
    const LogFinding* found = health.find(id);
    if (found == nullptr) {
      ADD_FAILURE() << "no " << id << " in\n" << told(health, FindingSeverity::fine);
      return {};
    }
    EXPECT_GE(found->severity, severity) << found->sentence;
    EXPECT_FALSE(found->next.empty()) << found->sentence;
    EXPECT_EQ(health.verdict == LogVerdict::unusable, health.count(FindingSeverity::fatal) > 0)
        << told(health, FindingSeverity::warning);
    return *found;
  }
};

constexpr auto kNotice = FindingSeverity::notice;
constexpr auto kWarning = FindingSeverity::warning;
constexpr auto kFatal = FindingSeverity::fatal;

TEST_F(LogHealthTest, ASoundLogHasNoWarning) {
  for (const bool with_robot : {true, false}) {
    const LogHealth health = examine(log, with_robot ? std::optional(robot) : std::nullopt);
    EXPECT_EQ(health.verdict, LogVerdict::commission);
    EXPECT_EQ(told(health, kWarning), "");
    EXPECT_EQ(health.assumed.empty(), with_robot);
  }
}

TEST_F(LogHealthTest, JitterIsMeasured) {
  Scenario shaken = sound_scenario();
  shaken.time_jitter = 0.4;  // uniform shifts u of a period: steps 1 + u' − u scatter by 0.4·√(2/3)
  log = sim::simulate(shaken);
  const LogFinding found = expect("time.jitter", kWarning);
  EXPECT_NEAR(found.value, 0.4 * std::sqrt(2.0 / 3.0), 0.05);
}

TEST_F(LogHealthTest, MissingSamplesAreCountedAndPlaced) {
  drop([](std::size_t k) { return k > 1000 && k < 2000 && k % 10 == 0; });
  const LogFinding found = expect("time.missing_samples", kWarning);
  EXPECT_NEAR(found.value, 99.0 / 2401.0, 1e-3);
  ASSERT_FALSE(found.when.empty());
  EXPECT_GE(found.when.front().lower, 10.0);
  EXPECT_LE(found.when.back().upper, 20.0);
}

// Starts of segments that are no rows, or stand there twice, were looked up in front of the first row and behind the
// last.
TEST_F(LogHealthTest, SegmentsOfATableBeginAtItsRows) {
  const std::size_t rows = log.rows();
  for (const std::vector<std::size_t>& starts :
       {std::vector<std::size_t>{0, 0, 1000}, {1000, 500}, {0, rows}, {rows + 7}}) {
    log.segment_starts = starts;
    EXPECT_THROW(examine(log, robot), InvalidArgument) << ::testing::PrintToString(starts);
  }
  log.segment_starts = {rows - 1};
  EXPECT_NO_THROW(examine(log, robot));
}

TEST_F(LogHealthTest, GapsResetsAndDroppedRowsAreTold) {
  log.segment_starts = {0, 1000, 2000};
  for (std::size_t k = 1000; k < log.rows(); ++k) {
    log.t[k] += k < 2000 ? 8.0 : -15.0;
  }
  const LogFinding gap = expect("time.gaps", kWarning);
  EXPECT_EQ(gap.stretches, 1U);
  EXPECT_NEAR(gap.value, 8.01, 1e-6);
  expect("time.resets", kNotice);
  const LogHealth counted =
      examine(log, robot, {.rows_read = 4500, .incomplete = 200, .duplicates = 299, .truncated = 0});
  ASSERT_NE(counted.find("time.duplicates"), nullptr);
  EXPECT_NEAR(counted.find("time.duplicates")->value, 299.0 / 4500.0, 1e-12);
  EXPECT_NE(counted.find("time.incomplete_rows"), nullptr);
}

TEST_F(LogHealthTest, CoarseTimeStampsOfEvenSamplesAreNotJitter) {
  Scenario odd = sound_scenario();
  odd.rate = 300.0;  // steps of 3 1/3 ms, stamped in ms
  odd.duration = 10.0;
  log = sim::simulate(odd);
  std::ranges::transform(log.t, log.t.begin(), [](double t) { return std::round(1000.0 * t) / 1000.0; });
  expect("time.even_clock", kNotice);
  EXPECT_EQ(told(examine(log, robot), kWarning).find("time.jitter"), std::string::npos);
}

TEST_F(LogHealthTest, TimeInMilliseconds) {
  std::ranges::transform(log.t, log.t.begin(), [](double t) { return 1000.0 * t; });
  expect("units.time", kFatal);
}

// Robots are logged at 10 to 500 Hz: no unit but s makes such a log of them, and the right one is among those named.
TEST_F(LogHealthTest, TimesInOtherUnitsAreRefusedAtEveryRate) {
  struct Unit {
    const char* name;
    double seconds, slowest;
  };
  for (const Unit& unit : {Unit{"days", 86400.0, 10.0}, Unit{"h", 3600.0, 10.0}, Unit{"min", 60.0, 100.0}}) {
    for (const double rate : {10.0, 25.0, 50.0, 100.0, 200.0, 500.0}) {
      for (std::size_t k = 0; k < log.rows(); ++k) {
        log.t[k] = static_cast<double>(k) / rate / unit.seconds;
      }
      const LogHealth health = examine(log, robot);
      const LogFinding* found = health.find("units.time");
      EXPECT_EQ(found != nullptr, rate >= unit.slowest) << unit.name << " at " << rate;
      if (found != nullptr) {
        EXPECT_TRUE(found->is_refusal());
        EXPECT_THAT(found->sentence, ::testing::HasSubstr(unit.name)) << rate;
      }
    }
  }
  for (const double rate : {10.0, 100.0, 500.0, 2000.0}) {
    for (std::size_t k = 0; k < log.rows(); ++k) {
      log.t[k] = 1.7e4 + static_cast<double>(k) / rate;
    }
    EXPECT_EQ(examine(log, robot).find("units.time"), nullptr) << rate;
  }
}

TEST_F(LogHealthTest, WhatMakesSecondsOfTheTimesIsPasted) {
  for (std::size_t k = 0; k < log.rows(); ++k) {
    log.t[k] = 46110.0 + 0.01 * static_cast<double>(k) / 86400.0;
  }
  const LogHealth health = examine(log, robot, {.time_remedy = "--map t=\"t*86400\""});
  ASSERT_NE(health.find("units.time"), nullptr);
  EXPECT_THAT(health.find("units.time")->sentence, ::testing::HasSubstr("look like days"));
  EXPECT_THAT(health.find("units.time")->next, ::testing::HasSubstr("--map t=\"t*86400\""));
}

TEST_F(LogHealthTest, AShortLogIsShort) {
  log = core::slice(log, 0, 700);
  expect("time.length", kWarning);
  log = core::slice(log, 0, 30);
  expect("time.length", kFatal);
}

TEST_F(LogHealthTest, LateEffortsAreTimed) {
  const auto late_by = [&](std::ptrdiff_t rows) {
    for (const char* name : {"tau_r", "tau_l"}) {
      std::vector<double>& tau = log.column(name);
      std::rotate(tau.begin(), tau.end() - rows, tau.end());
    }
  };
  late_by(5);
  const LogFinding found = expect("time.effort_delay", kWarning);
  EXPECT_NEAR(found.value, 0.05, 0.005);
  ASSERT_TRUE(found.taken);
  EXPECT_TRUE(found.taken->contains(0.05));
  late_by(10);
  EXPECT_NEAR(expect("time.effort_delay", kFatal).value, 0.15, 0.015);
}

TEST_F(LogHealthTest, AWrappedWheelAngleIsFatal) {
  for (const char* name : {"phi_r", "phi_l"}) {
    for (double& angle : log.column(name)) {
      angle = std::remainder(angle, 2.0 * std::numbers::pi);
    }
  }
  expect("signals.wrapped", kFatal);
}

TEST_F(LogHealthTest, AnglesThatWereUnwrappedOnReadingAreTold) {
  const LogHealth read = examine(log, std::nullopt, {.rows_read = log.rows(), .unwrapped = 93});
  ASSERT_NE(read.find("signals.wrapped"), nullptr);
  EXPECT_EQ(read.find("signals.wrapped")->severity, FindingSeverity::notice);
  EXPECT_THAT(read.find("signals.wrapped")->sentence, ::testing::HasSubstr("93 times"));
}

TEST_F(LogHealthTest, APoseFromTheWheelsIsTold) {
  const double r = 0.0975, c = r / 0.381;
  const std::vector<double>&right = log.column("phi_r"), &left = log.column("phi_l");
  std::vector<double>&x = log.column("x"), &y = log.column("y"), &theta = log.column("theta");
  for (std::size_t k = 1; k < log.rows(); ++k) {
    const double a = right[k] - right[k - 1], b = left[k] - left[k - 1];
    theta[k] = theta[k - 1] + c * (a - b);
    x[k] = x[k - 1] + 0.5 * r * (a + b) * std::cos(theta[k - 1]);
    y[k] = y[k - 1] + 0.5 * r * (a + b) * std::sin(theta[k - 1]);
  }
  expect("signals.pose_repeats_wheels", kWarning);
}

// Wheel odometry that a driver publishes at moments of its own, and a reader brings to the rows.
TEST_F(LogHealthTest, APoseOfItsOwnStampsThatRepeatsTheWheels) {
  const double c = 0.0975 / 0.381;
  const std::vector<double>&right = log.column("phi_r"), &left = log.column("phi_l");
  const auto heading = [&](double row) {
    const auto k = std::min(static_cast<std::size_t>(row), log.rows() - 2);
    const double part = row - static_cast<double>(k);
    return c * ((1.0 - part) * (right[k] - left[k]) + part * (right[k + 1] - left[k + 1]));
  };
  std::vector<double>& theta = log.column("theta");
  const std::vector<double> measured = theta;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const double before = 0.4 + 3.3 * std::floor((static_cast<double>(k) - 0.4) / 3.3);
    const double part = (static_cast<double>(k) - before) / 3.3;
    theta[k] = (1.0 - part) * heading(std::max(before, 0.0)) + part * heading(before + 3.3);
  }
  expect("signals.pose_repeats_wheels", kWarning);
  theta = measured;
  EXPECT_EQ(examine(log, robot).find("signals.pose_repeats_wheels"), nullptr);
}

TEST_F(LogHealthTest, DegreesAndRpmAreKnownWithoutAPose) {
  remove({"x", "y", "theta", "gyro_z", "phi_r", "phi_l"});
  scale({"omega_r", "omega_l"}, 30.0 / std::numbers::pi);
  EXPECT_THAT(expect("units.effort", kFatal).sentence, ::testing::HasSubstr("rpm"));
  scale({"omega_r", "omega_l"}, 6.0);
  EXPECT_THAT(expect("units.effort", kFatal).sentence, ::testing::HasSubstr("deg/s"));
}

// Its speed, angle and effort alike: without a gyro, driving and turning change places.
TEST_F(LogHealthTest, AMirroredMotorIsToldFromTheNominalValues) {
  remove({"x", "y", "theta", "gyro_z"});
  EXPECT_EQ(examine(log, robot).find("units.wheel_mirrored"), nullptr);
  scale({"omega_l", "phi_l", "tau_l"}, -1.0);
  expect("units.wheel_mirrored", kFatal);
}

TEST_F(LogHealthTest, ALatePoseIsTimed) {
  constexpr std::size_t kLate = 10;
  for (const char* name : {"x", "y", "theta"}) {
    std::vector<double>& column = log.column(name);
    std::copy_backward(column.begin(), column.end() - kLate, column.end());
  }
  EXPECT_NEAR(expect("time.pose_delay", kWarning).value, 0.1, 0.02);
}

// Of a log longer than 20 min stretches are looked at, spread over it: here the pose is late in its second half alone.
TEST_F(LogHealthTest, ALatePoseIsTimedInALongLogToo) {
  const LogTable once = log;
  LogTable late = once;
  constexpr std::size_t kLate = 10;
  for (const char* name : {"x", "y", "theta"}) {
    std::vector<double>& column = late.column(name);
    std::copy_backward(column.begin(), column.end() - kLate, column.end());
  }
  const double length = once.t.back() - once.t.front() + 1.0;
  log.segment_starts = {0};
  const auto times = static_cast<std::size_t>(std::ceil(1500.0 / length));
  for (std::size_t k = 1; k < times; ++k) {
    const LogTable& next = 2 * k < times ? once : late;
    log.segment_starts.push_back(log.rows());
    for (const double t : once.t) {
      log.t.push_back(t + length * static_cast<double>(k));
    }
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      log.columns[c].insert(log.columns[c].end(), next.columns[c].begin(), next.columns[c].end());
    }
  }
  const LogHealth health = examine(log, robot);
  const LogFinding* const found = health.find("time.pose_delay");
  ASSERT_NE(found, nullptr);
  EXPECT_GT(found->value, 0.02) << found->sentence;
  EXPECT_LT(found->value, 0.08) << found->sentence;
}

TEST_F(LogHealthTest, ADeadColumnIsFatalAndAStuckStretchIsPlaced) {
  std::vector<double>& speed = log.column("omega_l");
  std::fill(speed.begin() + 1500, speed.begin() + 1700, speed[1500]);
  const LogFinding found = expect("signals.stuck", kWarning);
  EXPECT_THAT(found.columns, ::testing::ElementsAre("omega_l"));
  ASSERT_EQ(found.stretches, 1U);
  EXPECT_NEAR(found.when[0].lower, 15.0, 1e-9);
  EXPECT_NEAR(found.when[0].upper, 16.99, 1e-9);
  std::ranges::fill(log.column("tau_l"), 0.0);
  expect("signals.constant", kFatal);
}

TEST_F(LogHealthTest, RepeatedSamplesGiveTheRateOfTheSensor) {
  hold("omega_r", 4);
  hold("omega_l", 4);
  EXPECT_NEAR(expect("signals.stale", kWarning).value, 4.0, 0.2);
}

TEST_F(LogHealthTest, SaturationIsFoundWithAndWithoutADeclaredLimit) {
  double most = 0.0;
  for (const double tau : log.column("tau_r")) {
    most = std::max(most, std::abs(tau));
  }
  for (double& tau : log.column("tau_r")) {
    tau = std::clamp(tau, -0.4 * most, 0.4 * most);
  }
  const LogFinding found = expect("signals.saturation", kWarning);
  EXPECT_GT(found.stretches, 0U);
  Robot limited = robot;
  limited.limits["effort"] = 0.4 * most;
  const LogHealth health = examine(log, limited);
  ASSERT_NE(health.find("signals.saturation"), nullptr);
  EXPECT_THAT(health.find("signals.saturation")->columns, ::testing::ElementsAre("tau_r"));
}

TEST_F(LogHealthTest, TheEncoderIsFound) {
  const LogHealth health = examine(log);
  ASSERT_NE(health.find("signals.encoder"), nullptr);
  EXPECT_DOUBLE_EQ(health.find("signals.encoder")->value, 4096.0);
  Robot wrong = robot;
  wrong.encoder_counts_per_turn = 1000.0;
  const LogHealth contradicted = examine(log, wrong);
  EXPECT_EQ(contradicted.find("signals.encoder")->severity, kWarning);
}

TEST_F(LogHealthTest, CoarseAndNoisyEfforts) {
  for (const char* name : {"tau_r", "tau_l"}) {
    for (double& tau : log.column(name)) {
      tau = 0.5 * std::round(tau / 0.5);
    }
  }
  expect("signals.coarse", kWarning);
  Scenario noisy = sound_scenario();
  noisy.sensors.effort = 1.5;
  noisy.robot.noise.effort.value = 1.5;
  log = sim::simulate(noisy);
  expect("signals.noise", kWarning);
}

TEST_F(LogHealthTest, MissingManoeuvresAreNamed) {
  Scenario straight = sound_scenario();
  straight.trajectory = {.kind = sim::Trajectory::Kind::straight, .speed = 0.6, .yaw_rate = 0.0, .period = 8.0};
  log = sim::simulate(straight);
  expect("motion.turning", kWarning);
  const LogFinding missing = expect("motion.excitation", kWarning);
  EXPECT_THAT(missing.sentence, ::testing::HasSubstr("yaw"));
  expect("signals.standstill", kNotice);
  Scenario circle = sound_scenario();
  circle.trajectory = {.kind = sim::Trajectory::Kind::circle, .speed = 0.6, .yaw_rate = 0.8, .period = 8.0};
  log = sim::simulate(circle);
  EXPECT_THAT(expect("motion.turning", kWarning).next, ::testing::HasSubstr("right"));
  expect("motion.speeds", kNotice);
}

TEST_F(LogHealthTest, WheelSpeedsInOtherUnits) {
  remove({"phi_r", "phi_l"});
  const LogTable sound = log;
  struct Unit {
    double factor;
    const char* name;
  };
  for (const Unit& unit : {Unit{180.0 / std::numbers::pi, "deg/s"}, Unit{30.0 / std::numbers::pi, "rpm"}}) {
    log = sound;
    scale({"omega_r", "omega_l"}, unit.factor);
    const LogFinding found = expect("units.wheel_speed", kFatal);
    EXPECT_THAT(found.sentence, ::testing::HasSubstr(unit.name));
    EXPECT_NEAR(found.value / unit.factor, 1.0, 0.02);
  }
}

TEST_F(LogHealthTest, AGyroInOtherUnitsIsNotTakenForTheWheels) {
  remove({"x", "y", "theta"});
  scale({"gyro_z"}, 180.0 / std::numbers::pi);
  EXPECT_THAT(expect("units.gyro", kFatal).next, ::testing::HasSubstr("--map gyro_z=\"*0.0174533\""));
  EXPECT_EQ(examine(log, robot).find("units.wheel_speed"), nullptr);
}

TEST_F(LogHealthTest, SpeedsOfTheRimAreNamed) {
  remove({"phi_r", "phi_l"});
  scale({"omega_r", "omega_l"}, robot.wheel_radius);
  EXPECT_THAT(expect("units.wheel_speed", kFatal).sentence, ::testing::HasSubstr("m/s at the rim"));
}

TEST_F(LogHealthTest, CountsBesideSpeedsAreNamedWithTheirNumber) {
  scale({"phi_r"}, 1000.0 / (2.0 * std::numbers::pi));
  const LogFinding found = expect("units.angle_and_speed", kFatal);
  EXPECT_THAT(found.sentence, ::testing::HasSubstr("counts, 1000 a turn"));
  EXPECT_THAT(found.next, ::testing::HasSubstr("--map phi_r=\"*0.00628319\""));
}

TEST_F(LogHealthTest, WheelsOfAnotherRadiusAreNamedOneByOne) {
  EXPECT_EQ(examine(log, robot).find("units.wheel_radius"), nullptr);
  const LogTable sound = log;
  for (const bool angles : {true, false}) {
    for (const double off : {0.97, 1.03}) {
      log = sound;
      remove({"gyro_z"});
      if (angles) {
        remove({"omega_r", "omega_l"});
      } else {
        remove({"phi_r", "phi_l"});
      }
      scale({angles ? "phi_l" : "omega_l"}, 1.0 / off);
      const LogFinding found = expect("units.wheel_radius", FindingSeverity::warning);
      EXPECT_THAT(found.sentence, ::testing::HasSubstr("the left wheel"));
      EXPECT_THAT(found.sentence, ::testing::Not(::testing::HasSubstr("the right wheel")));
      EXPECT_NEAR(found.value, off, 0.005);
    }
  }
}

TEST_F(LogHealthTest, AMirroredAxisIsNotAMirroredHeading) {
  scale({"y"}, -1.0);
  EXPECT_THAT(expect("units.position_mirrored", kFatal).next, ::testing::HasSubstr("--map y=\"*-1\""));
  EXPECT_EQ(examine(log, robot).find("units.heading_sign"), nullptr);
}

// What is wrong with the wheels' columns is said, and not that the robot is another.
TEST_F(LogHealthTest, DeadAndUnsignedWheelsAreNoOtherKindOfRobot) {
  const LogTable sound = log;
  remove({"x", "y", "theta", "omega_r", "omega_l"});
  std::ranges::fill(log.column("phi_r"), 0.0);
  EXPECT_TRUE(expect("signals.constant", kFatal).is_refusal());
  EXPECT_EQ(examine(log, robot).find("motion.not_differential_drive"), nullptr);
  log = sound;
  scale({"theta"}, 180.0 / std::numbers::pi);
  EXPECT_EQ(examine(log, robot).find("motion.not_differential_drive"), nullptr);
}

TEST_F(LogHealthTest, ManyJumpsOfAnglesAreRowsOfSeveralSources) {
  EXPECT_EQ(examine(log, robot, {.rows_read = log.rows(), .jumps = 3}).find("signals.two_sources"), nullptr);
  const LogHealth health = examine(log, robot, {.rows_read = log.rows(), .jumps = log.rows() / 20});
  ASSERT_NE(health.find("signals.two_sources"), nullptr);
  EXPECT_TRUE(health.find("signals.two_sources")->is_refusal());
}

TEST_F(LogHealthTest, AnglesAndSpeedsThatDisagree) {
  scale({"omega_l"}, 180.0 / std::numbers::pi);
  EXPECT_THAT(expect("units.angle_and_speed", kFatal, false).sentence, ::testing::HasSubstr("deg/s"));
}

TEST_F(LogHealthTest, PoseInOtherUnits) {
  const LogTable sound = log;
  scale({"x", "y"}, 1000.0);
  EXPECT_THAT(expect("units.position", kFatal).sentence, ::testing::HasSubstr("mm"));
  log = sound;
  scale({"theta"}, 180.0 / std::numbers::pi);
  expect("units.heading", kFatal);
  expect("units.heading", kFatal, false);
  log = sound;
  scale({"gyro_z"}, 180.0 / std::numbers::pi);
  expect("units.gyro", kFatal);
}

TEST_F(LogHealthTest, AHeadingOfABodyThatIsTurnedAgainstTheWheels) {
  EXPECT_EQ(examine(log, robot).find("units.heading_offset"), nullptr);
  const LogTable straight = log;
  for (const double offset : {-3.0, -1.6, -0.7, -0.05, 0.05, 0.3, 0.7, 1.6, 3.14}) {
    for (const bool with_robot : {true, false}) {
      SCOPED_TRACE(offset);
      log = straight;
      std::ranges::for_each(log.column("theta"), [&](double& heading) { heading -= offset; });
      const LogFinding found = expect("units.heading_offset", kNotice, with_robot);
      ASSERT_TRUE(found.taken);
      const double margin = 0.5 * (found.taken->upper - found.taken->lower);
      EXPECT_LE(std::abs(std::remainder(found.value - offset, 2.0 * std::numbers::pi)), margin + 0.002);
      EXPECT_LT(margin, 0.02);
      EXPECT_EQ(told(examine(log, robot), kFatal), "");
    }
  }
}

TEST_F(LogHealthTest, GeometryThatDoesNotFit) {
  Robot diameter = robot;
  diameter.wheel_radius *= 2.0;
  diameter.track_width *= 2.0;
  EXPECT_THAT(examine(log, diameter).find("units.wheel_radius")->next, ::testing::HasSubstr("diameter"));
  Robot narrow = robot;
  narrow.track_width *= 0.6;
  EXPECT_EQ(examine(log, narrow).find("units.track_width")->severity, kWarning);
}

// On a circle the heading follows the wheels' sum as well as their difference: nothing can be said of a sign.
TEST_F(LogHealthTest, ACircleTellsNoSign) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Scenario circle = testing_support::noisy_drive(seed, 120.0);
    circle.trajectory = {.kind = sim::Trajectory::Kind::circle, .speed = 0.6, .yaw_rate = 0.8};
    circle.sensors.wheel_speed = 0.02;
    circle.sensors.position = 0.002;
    circle.sensors.heading = 0.003;
    circle.sensors.speeds = true;
    const LogHealth found = examine(sim::simulate(circle), circle.robot);
    EXPECT_EQ(found.find("units.wheel_sign"), nullptr) << seed;
    EXPECT_EQ(found.find("units.sides"), nullptr) << seed;
  }
}

TEST_F(LogHealthTest, SignsAndSides) {
  const LogTable sound = log;
  for (const char* side : {"r", "l"}) {
    log = sound;
    scale({std::string("omega_") + side, std::string("phi_") + side}, -1.0);
    EXPECT_THAT(expect("units.wheel_sign", kFatal, false).columns, ::testing::Contains(std::string("omega_") + side));
  }
  log = sound;
  std::swap(log.column("omega_r"), log.column("omega_l"));
  std::swap(log.column("phi_r"), log.column("phi_l"));
  EXPECT_THAT(expect("units.sides", kFatal).sentence, ::testing::HasSubstr("turns the other way"));
  log = sound;
  scale({"omega_r", "phi_r", "omega_l", "phi_l"}, -1.0);
  EXPECT_THAT(expect("units.sides", kFatal).sentence, ::testing::HasSubstr("Both wheels"));
  log = sound;
  scale({"gyro_z"}, -1.0);
  EXPECT_THAT(expect("units.sides", kFatal).columns, ::testing::ElementsAre("gyro_z"));
  log = sound;
  scale({"theta"}, -1.0);
  expect("units.heading_sign", kFatal);
}

TEST_F(LogHealthTest, AWheelThatIsDraggedThroughACurveHasNoWrongSign) {
  // A creeping circle to the left: friction against turning is more than that against driving, so that the left wheel
  // brakes while it rolls forwards.
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const double noise = k % 2 == 0 ? 1e-3 : -1e-3;
    log.column("omega_r")[k] = 0.7 + noise;
    log.column("omega_l")[k] = 0.3 + noise;
    log.column("phi_r")[k] = 0.7 * log.t[k];
    log.column("phi_l")[k] = 0.3 * log.t[k];
    log.column("tau_r")[k] = 0.05 + noise;
    log.column("tau_l")[k] = -0.01 + noise;
  }
  EXPECT_EQ(examine(log, robot).find("units.effort_sign"), nullptr);
}

TEST_F(LogHealthTest, EffortsInOtherUnitsSignsAndSides) {
  const LogTable sound = log;
  scale({"tau_r", "tau_l"}, 1000.0);
  EXPECT_THAT(expect("units.effort", kFatal).sentence, ::testing::HasSubstr("mN·m"));
  log = sound;
  scale({"tau_l"}, -1.0);
  EXPECT_THAT(expect("units.effort_sign", kFatal).columns, ::testing::Contains("tau_l"));
  log = sound;
  std::swap(log.column("tau_r"), log.column("tau_l"));
  expect("units.effort_sides", kFatal);
  log = sound;
  Scenario light = scenario;  // its inertia is lost in the noise, the friction of turning is not
  light.parameters.yaw_inertia = 0.05;
  light.sensors.effort = 0.8;
  log = with_gyro(sim::simulate(light), robot);
  std::swap(log.column("tau_r"), log.column("tau_l"));
  EXPECT_THAT(expect("units.effort_sides", kFatal).sentence, ::testing::HasSubstr("friction of turning"));
  log = sound;
  for (const char* name : {"tau_r", "tau_l"}) {
    std::ranges::transform(log.column(name), log.column(name).begin(), [](double v) { return std::abs(v); });
  }
  expect("units.effort_unsigned", kFatal);
}

TEST_F(LogHealthTest, WithoutEffortsOnlyKinematicsAreLeft) {
  remove({"tau_r", "tau_l"});
  EXPECT_EQ(examine(log, robot).verdict, LogVerdict::identify_only);
  remove({"x", "y", "theta", "gyro_z"});
  EXPECT_EQ(examine(log, robot).verdict, LogVerdict::unusable);
}

TEST_F(LogHealthTest, AnEmptyLogIsNoAccident) {
  const LogHealth health = examine(LogTable{});
  EXPECT_EQ(health.verdict, LogVerdict::unusable);
  EXPECT_GT(health.count(kFatal), 0U);
}

// Recordings of real machines, where they lie beside the project.
TEST(LogHealthRecordings, NoneIsFatal) {
  const std::filesystem::path data = std::filesystem::path(WHEELWRIGHT_SHARED_DIR) / "data";
  if (testing_support::skip_without_recordings(data)) {
    return;
  }
  for (const auto& [robot, log] :
       {std::pair{"emps.yaml", "emps/emps.csv"}, std::pair{"warthog.yaml", "warthog/current.csv"},
        std::pair{"warthog.yaml", "warthog/warthog_pose.csv"}, std::pair{"husky.yaml", "warthog/husky_pose.csv"},
        std::pair{"regbot.yaml", "regbot_fleet/run_00.csv"}}) {
    CsvLog file({data / log});
    const LogHealth health = examine(read_all(file), read_robot(data / robot), results::reader_counts(file.report()));
    EXPECT_EQ(told(health, kFatal), "") << log;
    EXPECT_NE(health.verdict, LogVerdict::unusable) << log;
  }
}

}  // namespace
}  // namespace wheelwright::doctor::log_health_test
