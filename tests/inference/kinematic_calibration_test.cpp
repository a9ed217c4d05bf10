// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/csv.hpp"
#include "identify/inference/kinematic_calibration.hpp"
#include "tests/support/random.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::inference::kinematic_calibration_test {
namespace {

using testing_support::Random;

constexpr double kRight = 0.101, kLeft = 0.097, kTrack = 0.42, kAhead = 0.15;

struct Drive {
  double turning = 1.0;  // of the yaw rate: 0 drives straight
  double forward = 1.0;
  double heading_noise = 0.0, position_noise = 0.0;
  double delay = 0.0;
  std::size_t windows = 40;
  std::uint64_t seed = 1;
};

// Windows of 2 s at 20 Hz, 100 s apart, each from an arbitrary pose, with wheel speeds that grow linearly (the model's
// own assumption between samples). The pose is integrated with a hundred times finer steps.
LogTable drive(const Drive& d) {
  Random random(d.seed);
  LogTable log;
  log.names = {"omega_r", "omega_l", "x", "y", "theta"};
  log.columns.resize(5);
  for (std::size_t w = 0; w < d.windows; ++w) {
    log.segment_starts.push_back(log.rows());
    const double forward = 8.0 * d.forward * random.symmetric();
    const double turn = 5.0 * d.turning * random.symmetric();
    const double faster = 1.0 * d.turning * random.symmetric();
    // Straight driving is straight on the ground: the smaller wheel turns faster.
    const auto right = [&](double t) {
      return (forward + turn + faster * t) / (d.turning == 0.0 ? kRight / kLeft : 1.0);
    };
    const auto left = [&](double t) { return forward - turn - faster * t; };
    double theta = std::numbers::pi * random.symmetric();
    double x = 10.0 * random.symmetric();
    double y = 10.0 * random.symmetric();
    constexpr int kFine = 100;
    constexpr double kStep = 0.05;
    const int late = static_cast<int>(std::lround(d.delay / kStep * kFine));
    for (int k = -late; k <= 40 * kFine - late; ++k) {
      if ((k + late) % kFine == 0) {
        log.t.push_back(100.0 * static_cast<double>(w) + kStep * ((k + late) / kFine));
        const double now = kStep * static_cast<double>((k + late) / kFine);
        log.columns[0].push_back(right(now));
        log.columns[1].push_back(left(now));
        log.columns[2].push_back(x + kAhead * std::cos(theta) + d.position_noise * random.normal());
        log.columns[3].push_back(y + kAhead * std::sin(theta) + d.position_noise * random.normal());
        log.columns[4].push_back(std::remainder(theta + d.heading_noise * random.normal(), 2.0 * std::numbers::pi));
      }
      const double h = kStep / kFine;
      const double t = h * (k + 0.5);
      const double turned = h * (kRight * right(t) - kLeft * left(t)) / kTrack;
      const double way = h * 0.5 * (kRight * right(t) + kLeft * left(t));
      x += way * std::cos(theta + 0.5 * turned);
      y += way * std::sin(theta + 0.5 * turned);
      theta += turned;
    }
  }
  return log;
}

KinematicOptions nominal() { return {.wheel_radius = 0.1, .track_width = 0.4}; }

TEST(KinematicCalibration, FindsTheRobotThatDroveExactly) {
  const KinematicCalibration found = calibrate_kinematics(drive({}), nominal());
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.windows, 40U);
  // The midpoint rule over 50 ms steps of up to 0.1 rad is right to some 1e-4 of the way.
  EXPECT_NEAR(found.radius_right.estimate, kRight, 3e-4 * kRight);
  EXPECT_NEAR(found.radius_left.estimate, kLeft, 3e-4 * kLeft);
  EXPECT_NEAR(found.track_width.estimate, kTrack, 3e-4 * kTrack);
  EXPECT_NEAR(found.axle_offset.estimate, kAhead, 3e-4);
  EXPECT_NEAR(found.track_at_nominal_radius.estimate, kTrack * 0.1 / (0.5 * (kRight + kLeft)), 3e-4 * kTrack);
  for (const auto* q : {&found.radius_right, &found.radius_left, &found.track_width, &found.axle_offset}) {
    EXPECT_EQ(q->state, KinematicState::identified);
  }
  EXPECT_EQ(found.delay.state, KinematicState::fixed);
}

TEST(KinematicCalibration, IntervalsCoverAndShrinkWithTheWindows) {
  int covered = 0;
  constexpr int kRuns = 60;
  for (int k = 0; k < kRuns; ++k) {
    const LogTable log = drive(
        {.heading_noise = 0.01, .position_noise = 0.01, .windows = 24, .seed = static_cast<std::uint64_t>(100 + k)});
    const KinematicCalibration found = calibrate_kinematics(log, nominal());
    covered += found.track_width.lower <= kTrack && kTrack <= found.track_width.upper ? 1 : 0;
    EXPECT_LT(found.track_width.standard_error, 0.01 * kTrack);
  }
  EXPECT_GE(covered, 52);  // of 60 at 95 %: fewer than 52 has the probability 0.9 %
}

TEST(KinematicCalibration, StraightDrivingShowsNoTrackWidth) {
  const LogTable log = drive({.turning = 0.0, .heading_noise = 0.002, .position_noise = 0.005});
  const KinematicCalibration found = calibrate_kinematics(log, nominal());
  EXPECT_EQ(found.radius_scale.state, KinematicState::identified);
  EXPECT_EQ(found.track_width.state, KinematicState::not_identified);
  EXPECT_FALSE(found.track_width.reason.empty());
  EXPECT_EQ(found.axle_offset.state, KinematicState::not_identified);
}

TEST(KinematicCalibration, HeadingAloneTellsTheTrackAtTheNominalRadiusOnly) {
  LogTable log = drive({.heading_noise = 0.002});
  log.names = {"omega_r", "omega_l", "a", "b", "theta"};
  const KinematicCalibration found = calibrate_kinematics(log, nominal());
  EXPECT_EQ(found.radius_scale.state, KinematicState::fixed);
  EXPECT_EQ(found.axle_offset.state, KinematicState::fixed);
  EXPECT_EQ(found.track_at_nominal_radius.state, KinematicState::identified);
  EXPECT_NEAR(found.track_at_nominal_radius.estimate, kTrack * 0.1 / (0.5 * (kRight + kLeft)), 0.002);
}

TEST(KinematicCalibration, SurvivesWrongPoses) {
  LogTable log = drive({.heading_noise = 0.005, .position_noise = 0.005});
  Random random(7);
  for (std::size_t k = 0; k < log.rows(); ++k) {
    if (random.unit() < 0.05) {
      log.columns[2][k] += 3.0 * random.symmetric();
      log.columns[4][k] += 1.0 * random.symmetric();
    }
  }
  const KinematicCalibration found = calibrate_kinematics(log, nominal());
  EXPECT_GT(found.outlying_poses, 40U);
  EXPECT_NEAR(found.track_width.estimate, kTrack, 0.01 * kTrack);
  EXPECT_LE(found.track_width.lower, kTrack);
  EXPECT_GE(found.track_width.upper, kTrack);
}

TEST(KinematicCalibration, FindsTheDelayOfThePose) {
  KinematicOptions options = nominal();
  options.largest_delay = 0.4;
  const LogTable log = drive({.heading_noise = 0.002, .position_noise = 0.002, .delay = 0.13});
  const KinematicCalibration found = calibrate_kinematics(log, options);
  EXPECT_EQ(found.delay.state, KinematicState::identified);
  EXPECT_NEAR(found.delay.estimate, 0.13, 0.01);
  EXPECT_NEAR(found.track_width.estimate, kTrack, 0.01 * kTrack);
}

TEST(KinematicCalibration, RefusesMisuse) {
  const LogTable log = drive({.windows = 8});
  EXPECT_THROW(static_cast<void>(calibrate_kinematics(log, {})), InvalidArgument);
  KinematicOptions options = nominal();
  options.largest_delay = 1.5;
  EXPECT_THROW(static_cast<void>(calibrate_kinematics(log, options)), InvalidArgument);
  LogTable lacking = log;
  lacking.names[4] = "heading";
  EXPECT_THROW(static_cast<void>(calibrate_kinematics(lacking, nominal())), InvalidArgument);
  EXPECT_THROW(static_cast<void>(calibrate_kinematics(drive({.windows = 5}), nominal())), InvalidArgument);
}

// Segments of `log` for which `take` is true.
template <typename Take>
LogTable segments(const LogTable& log, Take take) {
  LogTable part;
  part.names = log.names;
  part.columns.resize(log.columns.size());
  for (std::size_t s = 0; s < log.segment_starts.size(); ++s) {
    if (!take(s)) {
      continue;
    }
    const std::size_t end = s + 1 < log.segment_starts.size() ? log.segment_starts[s + 1] : log.rows();
    part.segment_starts.push_back(part.rows());
    for (std::size_t k = log.segment_starts[s]; k < end; ++k) {
      part.t.push_back(log.t[k]);
      for (std::size_t c = 0; c < log.columns.size(); ++c) {
        part.columns[c].push_back(log.columns[c][k]);
      }
    }
  }
  return part;
}

struct Recording {
  const char* file;
  double radius, nominal_track, effective_track;
};

class SlowSkidSteer : public ::testing::TestWithParam<Recording> {};

// Real skid-steer robots answer like a robot with a wider track (README of the recordings); halves of the data agree.
TEST_P(SlowSkidSteer, EffectiveTrackIsThatOfTheRecordingAndOfItsHalves) {
  const std::filesystem::path path = std::filesystem::path(WHEELWRIGHT_SHARED_DIR) / "data/warthog" / GetParam().file;
  if (testing_support::skip_without_recordings(path)) {
    return;
  }
  CsvLog file({path});
  const LogTable log = read_all(file);
  const KinematicOptions options{.wheel_radius = GetParam().radius, .track_width = GetParam().nominal_track};
  const auto track = [&](const LogTable& part) {
    const KinematicCalibration found = calibrate_kinematics(part, options);
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.track_at_nominal_radius.state, KinematicState::identified);
    return found.track_at_nominal_radius;
  };
  const KinematicQuantity whole = track(log);
  EXPECT_NEAR(whole.estimate, GetParam().effective_track, 0.03 * GetParam().effective_track);
  EXPECT_LT(whole.upper - whole.lower, 0.12 * whole.estimate);
  Random random(20);
  std::vector<bool> drawn(log.segment_starts.size());
  for (std::size_t s = 0; s < drawn.size(); ++s) {
    drawn[s] = random.unit() < 0.5;
  }
  const auto agree = [&](const KinematicQuantity& a, const KinematicQuantity& b) {
    EXPECT_LE(a.lower, b.upper);
    EXPECT_LE(b.lower, a.upper);
    // With some 16 degrees of freedom halves differ by more than 2.9 standard errors once in a hundred.
    EXPECT_LT(std::abs(a.estimate - b.estimate), 2.9 * std::hypot(a.standard_error, b.standard_error));
  };
  agree(track(segments(log, [](std::size_t s) { return s % 2 == 0; })),
        track(segments(log, [](std::size_t s) { return s % 2 == 1; })));
  agree(track(segments(log, [&](std::size_t s) { return drawn[s]; })),
        track(segments(log, [&](std::size_t s) { return !drawn[s]; })));
}

INSTANTIATE_TEST_SUITE_P(Recordings, SlowSkidSteer,
                         ::testing::Values(Recording{"warthog_pose.csv", 0.30, 1.08, 1.86},
                                           Recording{"husky_pose.csv", 0.1651, 0.57, 1.42}),
                         [](const auto& recording) { return std::string(recording.index == 0 ? "Warthog" : "Husky"); });

}  // namespace
}  // namespace wheelwright::inference::kinematic_calibration_test
