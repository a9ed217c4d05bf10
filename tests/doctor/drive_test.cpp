// SPDX-License-Identifier: Apache-2.0
// Whether a log is that of a differential drive, over rates and drives, by a simulator of its own: cars and mecanum
// robots are refused with their evidence, honest robots that slip, lag or turn little are not.
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/doctor/log_health.hpp"

namespace wheelwright::doctor::drive_test {
namespace {

using ::testing::HasSubstr;

constexpr double kRadius = 0.085, kTrack = 0.4, kMass = 24.0, kInertia = 1.3;

struct Drive {
  double rate = 100.0, seconds = 90.0;
  double wheel_noise = 0.01, effort_noise = 0.05, gyro_noise = 0.002, pose_noise = 1e-3;
  double slip = 0.0;            // of the turning, varying
  double lag = 0.0;             // s, of gyro and pose
  double turning = 1.0;         // of the yaw rate
  double sideways = 0.0;        // m/s
  double heading_offset = 0.0;  // rad, of the pose's body
  bool steered = false;         // both wheels have one torque
  bool front_wheels = false;    // wheel columns of wheels that do not show the turning
  bool pose = true, gyro = true, efforts = true;
  double inertia = kInertia;
  double counts = 0.0;  // a turn of the encoders, whose angles stand in place of speeds
};

Robot robot() {
  Robot r;
  r.name = "amr";
  r.model = "differential_drive";
  r.wheel_radius = kRadius;
  r.track_width = kTrack;
  return r;
}

LogTable log_of(const Drive& d, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 6.28);
  double p[6];
  for (double& each : p) {
    each = phase(random);
  }
  const auto v_at = [&](double t) { return 0.3 * std::sin(0.7 * t + p[0]) + 0.25 * std::sin(1.9 * t + p[1]); };
  const auto w_at = [&](double t) {
    return d.turning * (0.5 * std::sin(0.9 * t + p[2]) + 0.4 * std::sin(2.3 * t + p[3]));
  };
  const auto u_at = [&](double t) { return d.sideways * std::sin(0.5 * t + p[4]); };
  LogTable log;
  log.names =
      d.counts > 0.0 ? std::vector<std::string>{"phi_r", "phi_l"} : std::vector<std::string>{"omega_r", "omega_l"};
  for (const auto& [has, names] : {std::pair(d.efforts, std::vector<std::string>{"tau_r", "tau_l"}),
                                   {d.gyro, {"gyro_z"}},
                                   {d.pose, {"x", "y", "theta"}}}) {
    if (has) {
      log.names.insert(log.names.end(), names.begin(), names.end());
    }
  }
  log.columns.resize(log.names.size());
  const auto put = [&](const char* name, double value) {
    if (log.find(name) != nullptr) {
      log.column(name).push_back(value);
    }
  };
  double x = 0.0, y = 0.0, theta = 0.0, at = -d.lag, right = 0.0, left = 0.0;
  const double fine = 1e-3, e = 1e-4;
  for (std::size_t k = 0; static_cast<double>(k) < d.seconds * d.rate; ++k) {
    const double t = static_cast<double>(k) / d.rate;
    for (; at < t - d.lag - 0.5 * fine; at += fine) {
      const double v = v_at(at), u = u_at(at);
      x += fine * (v * std::cos(theta) - u * std::sin(theta));
      y += fine * (v * std::sin(theta) + u * std::cos(theta));
      theta += fine * w_at(at);
    }
    const double v = v_at(t), w = w_at(t) / (1.0 - d.slip * (0.6 + 0.4 * std::sin(0.37 * t + p[5])));
    const double shown = d.front_wheels ? 0.0 : w;
    log.t.push_back(t);
    put("omega_r", (v + 0.5 * kTrack * shown - u_at(t)) / kRadius + d.wheel_noise * normal(random));
    put("omega_l", (v - 0.5 * kTrack * shown + u_at(t)) / kRadius + d.wheel_noise * normal(random));
    if (d.counts > 0.0) {
      const double c = 6.283185307179586 / d.counts;
      right += (v + 0.5 * kTrack * shown - u_at(t)) / kRadius / d.rate;
      left += (v - 0.5 * kTrack * shown + u_at(t)) / kRadius / d.rate;
      put("phi_r", std::floor(right / c) * c);
      put("phi_l", std::floor(left / c) * c);
    }
    const double force = kMass * (v_at(t + e) - v_at(t - e)) / (2.0 * e) + 6.0 * v;
    const double moment = d.steered ? 0.0 : d.inertia * (w_at(t + e) - w_at(t - e)) / (2.0 * e) + 0.7 * w;
    put("tau_r", kRadius * (0.5 * force + moment / kTrack) + d.effort_noise * normal(random));
    put("tau_l", kRadius * (0.5 * force - moment / kTrack) + d.effort_noise * normal(random));
    put("gyro_z", w_at(t - d.lag) + d.gyro_noise * normal(random));
    put("x", x + d.pose_noise * normal(random));
    put("y", y + d.pose_noise * normal(random));
    put("theta", theta + d.heading_offset + d.pose_noise * normal(random));
  }
  return log;
}

std::string evidence(const Drive& d, unsigned seed = 1) {
  const LogHealth health = examine(log_of(d, seed), robot());
  const LogFinding* found = health.find("motion.not_differential_drive");
  if (found != nullptr) {
    EXPECT_TRUE(found->is_refusal());
    EXPECT_FALSE(found->next.empty());
  }
  return found == nullptr ? "" : found->sentence;
}

TEST(DriveHealth, HonestDrivesPass) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    for (const double rate : {10.0, 50.0, 200.0}) {
      for (const Drive& d :
           {Drive{}, Drive{.slip = 0.3}, Drive{.lag = 0.15}, Drive{.turning = 0.1}, Drive{.turning = 0.0},
            Drive{.pose_noise = 0.03}, Drive{.heading_offset = 0.7}, Drive{.effort_noise = 0.5},
            Drive{.wheel_noise = 0.3}, Drive{.pose = false}, Drive{.gyro = false},
            Drive{.turning = 0.15, .counts = 20.0}, Drive{.counts = 400.0}, Drive{.turning = 0.02, .inertia = 0.3}}) {
        Drive now = d;
        now.rate = rate;
        EXPECT_EQ(evidence(now, seed), "") << "rate " << rate << ", slip " << d.slip << ", lag " << d.lag
                                           << ", turning " << d.turning << ", noise " << d.pose_noise;
      }
    }
  }
}

TEST(DriveHealth, CarsAndMecanumAreRefusedWithTheirEvidence) {
  for (const double rate : {20.0, 100.0}) {
    for (unsigned seed = 1; seed <= 2; ++seed) {
      EXPECT_THAT(evidence({.rate = rate, .sideways = 0.3}, seed), HasSubstr("moves sideways"));
      EXPECT_THAT(evidence({.rate = rate, .front_wheels = true, .pose = false}, seed),
                  HasSubstr("does not turn as (omega_r - omega_l) r/D says"));
      if (rate > 50.0) {  // at 20 Hz turning is not told from noise of the speeds by its change over ten rows
        EXPECT_THAT(evidence({.rate = rate, .steered = true}, seed),
                    HasSubstr("turns without a difference of the wheels' efforts"));
      }
    }
  }
}

TEST(DriveHealth, JointsThatContradictAreRefusedAsTheReaderSaysIt) {
  ReaderCounts reader;
  reader.contradictions = {"steering joints move: front_steer by 0.5 rad"};
  const LogHealth health = examine(log_of({}, 1), robot(), reader);
  const LogFinding* found = health.find("motion.not_differential_drive");
  ASSERT_NE(found, nullptr);
  EXPECT_THAT(found->sentence, HasSubstr("front_steer by 0.5 rad"));
  EXPECT_TRUE(found->is_refusal());
}

TEST(DriveHealth, RowsOfASecondSourceAreRefused) {
  for (const std::size_t every : {1U, 10U}) {
    LogTable own = log_of({}, 3), log;
    log.names = own.names;
    log.columns.resize(own.columns.size());
    for (std::size_t k = 0; k < own.rows(); ++k) {
      for (const bool zeros : {false, true}) {
        if (!zeros || k % every == 0) {
          log.t.push_back(own.t[k] + (zeros ? 0.003 : 0.0));
          for (std::size_t c = 0; c < own.columns.size(); ++c) {
            log.columns[c].push_back(zeros && c < 4 ? 0.0 : own.columns[c][k]);
          }
        }
      }
    }
    const LogHealth health = examine(log, robot());
    const LogFinding* found = health.find("signals.two_sources");
    ASSERT_NE(found, nullptr) << every;
    EXPECT_TRUE(found->is_refusal());
  }
}

}  // namespace
}  // namespace wheelwright::doctor::drive_test
