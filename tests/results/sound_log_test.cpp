// SPDX-License-Identifier: Apache-2.0
// What a log shows of its clocks is taken in before a model is made of it: motion and torques are known in closed form,
// at any time, so that nothing here is integrated.
#include "results/sound_log.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/physical.hpp"
#include "detector/detector_options.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::results::sound_log_test {
namespace {

constexpr double kMass = 24.0, kInertia = 1.3, kViscous = 6.0, kYawViscous = 0.7, kRadius = 0.085, kTrack = 0.4;
constexpr double kCount = 2.0 * std::numbers::pi / 4096.0;
constexpr double kSpeedNoise = 0.01, kEffortNoise = 0.05;

// Forward (0) or yaw (1) motion at time t: the way, its speed or its acceleration.
double motion(int which, double t, int order) {
  constexpr std::array<std::array<double, 3>, 2> kForward = {{{0.4, 0.9, 0.2}, {0.3, 2.1, 1.3}}};
  constexpr std::array<std::array<double, 3>, 2> kYaw = {{{0.8, 1.3, 0.9}, {0.6, 2.7, 0.1}}};
  double value = 0.0;
  for (const auto& [size, rate, phase] : which == 0 ? kForward : kYaw) {
    const double angle = rate * t + phase;
    value += size * (order == 0 ? -std::cos(angle) / rate : order == 1 ? std::sin(angle) : rate * std::cos(angle));
  }
  return value;
}

double wheel(double side, double t, int order) {
  return (motion(0, t, order) + side * 0.5 * kTrack * motion(1, t, order)) / kRadius;
}

double torque(double side, double t) {
  const double force = kMass * motion(0, t, 2) + kViscous * motion(0, t, 1);
  const double moment = kInertia * motion(1, t, 2) + kYawViscous * motion(1, t, 1);
  return 0.5 * kRadius * (force + side * moment / (0.5 * kTrack));
}

struct Drive {
  double step = 0.01, seconds = 40.0;
  double effort_delay = 0.0;
  std::function<double(std::mt19937_64&)> late = [](std::mt19937_64&) { return 0.0; };  // s, of a stamp
  double lost = 0.0;
};

std::string csv(const Drive& drive) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), chance(0.0, 1.0);
  std::string text = "t,phi_r,phi_l,tau_r,tau_l\n";
  double before = -1.0;
  for (int k = 0; k * drive.step < drive.seconds; ++k) {
    const double t = k * drive.step;
    before = std::max(before + 1e-6, t + drive.late(rng));
    const double a = unit(rng), b = unit(rng);
    if (chance(rng) < drive.lost) {
      continue;
    }
    const double then = t - drive.effort_delay;
    text += fmt::format("{:.7f},{:.9g},{:.9g},{:.9g},{:.9g}\n", before, std::round(wheel(1.0, t, 0) / kCount) * kCount,
                        std::round(wheel(-1.0, t, 0) / kCount) * kCount, torque(1.0, then) + kEffortNoise * a,
                        torque(-1.0, then) + kEffortNoise * b);
  }
  return text;
}

Robot a_robot(bool declared) {
  Robot robot;
  robot.wheel_radius = kRadius;
  robot.track_width = kTrack;
  robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  if (declared) {
    robot.encoder_counts_per_turn = 4096.0;
    robot.noise.wheel_speed.value = kSpeedNoise;
    robot.noise.effort.value = kEffortNoise;
  }
  return robot;
}

class SoundLogTest : public ::wheelwright::testing::ScratchTest {
 protected:
  struct Outcome {
    commission::Commissioning made;
    Robot robot;
    std::vector<std::string> remarks;
    bool truth_inside = true;
    double width = 0.0;  // of the mass, relative, half
  };

  Outcome commissioned(const Drive& drive, bool declared) const {
    const auto file = put("log.csv", csv(drive));
    SoundLog opened = open_sound_log({file}, a_robot(declared), {}, {}, WheelPose::judged);
    Outcome out{commission_robot(*opened.log, opened.robot), opened.robot, opened.remarks};
    const auto scales = commission::physical_scales(out.robot, out.made.model.model);
    const std::array<double, 4> truth = {kMass, kInertia, kViscous, kYawViscous};
    for (std::size_t j = 0; scales && j < out.made.parameters.size(); ++j) {
      const commission::ParameterResult& p = out.made.parameters[j];
      const commission::PhysicalScale& s = (*scales)[j];
      const double lower = s.scale * p.lower - s.offset, upper = s.scale * p.upper - s.offset;
      out.truth_inside = out.truth_inside && lower <= truth[j] && truth[j] <= upper;
      out.width = j == 0 ? 0.5 * (upper - lower) / truth[0] : out.width;
    }
    return out;
  }
};

bool has_model(const commission::Commissioning& made) { return made.status == commission::Commissioning::Status::done; }

TEST_F(SoundLogTest, ScatteredStampsCostNextToNothing) {
  for (const bool declared : {true, false}) {
    const Outcome even = commissioned({}, declared);
    ASSERT_TRUE(has_model(even.made)) << even.made.message;
    EXPECT_FALSE(even.robot.clock);
    for (const double scatter : {50e-6, 200e-6, 1e-3}) {
      const Outcome scattered = commissioned(
          {.late = [&](std::mt19937_64& rng) { return std::normal_distribution<double>(0.0, scatter)(rng); },
           .lost = scatter == 200e-6 ? 0.01 : 0.0},
          declared);
      ASSERT_TRUE(has_model(scattered.made)) << scatter << ": " << scattered.made.message;
      ASSERT_TRUE(scattered.robot.clock) << scatter;
      EXPECT_LE(std::abs(scattered.robot.clock->step / 0.01 - 1.0), scattered.robot.clock->drift) << scatter;
      EXPECT_TRUE(scattered.truth_inside) << scatter;
      EXPECT_LE(scattered.width, 1.5 * even.width) << scatter;
      EXPECT_EQ(scattered.remarks.size(), 1U);
      EXPECT_EQ(scattered.made.model.warrant, even.made.model.warrant);
    }
  }
}

// Whatever the delay up to the stated size, there is a model, and the truth in it.
TEST_F(SoundLogTest, ADelayOfEffortsIsNoMatterOfChance) {
  for (const bool declared : {true, false}) {
    for (int ms = 0; ms <= 20; ms += 2) {
      const Outcome out = commissioned({.effort_delay = 1e-3 * ms}, declared);
      ASSERT_TRUE(has_model(out.made)) << ms << " ms: " << out.made.message;
      EXPECT_TRUE(out.truth_inside) << ms << " ms";
      EXPECT_EQ(out.robot.effort_delay_found, !out.remarks.empty()) << ms << " ms";
      if (out.robot.effort_delay_found) {
        EXPECT_TRUE(out.robot.effort_delay.contains(1e-3 * ms)) << ms << " ms";
        EXPECT_EQ(out.made.model.warrant, core::Warrant::extrapolated) << ms << " ms";
      }
      EXPECT_TRUE(out.robot.effort_delay_found || ms < 4) << ms << " ms";
    }
  }
}

}  // namespace
}  // namespace wheelwright::results::sound_log_test
