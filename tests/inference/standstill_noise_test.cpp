// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/noise_levels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/robot.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::inference::standstill_noise_test {
namespace {

using testing_support::Autoregression;
using testing_support::Random;
using Kind = StandstillNoise::Kind;

constexpr double kStep = 0.01;
constexpr double kCount = 2.0 * std::numbers::pi / 1024.0;

// Drives from 5 s to 15 s and from 25 s to 35 s, 40 s in all. The effort is 0.3 off and noisy; it rises 0.2 s before
// the wheel turns. The wheel coasts for 0.3 s after its command is zero.
double speed_at(double t) {
  const double phase = std::fmod(t, 20.0) - 5.0;
  if (phase <= 0.0 || phase >= 10.0) {
    return 0.0;
  }
  return 8.0 * std::sin(std::numbers::pi * phase / 10.0);
}

LogTable drive(std::uint64_t seed, double phi = 0.0, double speed_noise = 0.01) {
  Random random(seed);
  Autoregression effort(seed + 1000, phi);
  LogTable log;
  log.names = {"omega_r", "phi_r", "command_r", "tau_r"};
  log.columns.resize(4);
  double angle = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double t = kStep * k;
    log.t.push_back(t);
    angle += kStep * speed_at(t);
    log.columns[0].push_back(speed_at(t) + speed_noise * random.normal());
    log.columns[1].push_back(kCount * std::round(angle / kCount));
    log.columns[2].push_back(speed_at(t + 0.3));
    log.columns[3].push_back(0.3 + 0.5 * speed_at(t + 0.2) + 0.05 * effort.next());
  }
  return log;
}

Standstill standstill_of(const LogTable& log, const StandstillSigns& signs, const StandstillOptions& options = {}) {
  TableSource source(log, 300);
  return standstill_noise(source, signs, {"tau_r", "phi_r", "omega_r"}, options);
}

// 5 s + 10 s + 5 s at rest, less 0.5 s at each of the six ends (and what coasting and early effort take).
TEST(StandstillNoise, FindsWhatWasPutIn) {
  const LogTable log = drive(1);
  for (const StandstillSigns& signs : {StandstillSigns{.commands = {"command_r"}, .speeds = {"omega_r"}, .angles = {}},
                                       StandstillSigns{.commands = {}, .speeds = {"omega_r"}, .angles = {}},
                                       StandstillSigns{.commands = {"command_r"}, .speeds = {}, .angles = {}},
                                       StandstillSigns{.commands = {}, .speeds = {}, .angles = {"phi_r"}}}) {
    const Standstill s = standstill_of(log, signs);
    EXPECT_EQ(s.stretches, 3U) << s.recognised;
    EXPECT_NEAR(s.seconds, 17.0, 0.8) << s.recognised;
    const StandstillNoise& effort = s.columns[0];
    EXPECT_EQ(effort.kind, Kind::noisy);
    EXPECT_NEAR(effort.sd * effort.sd / 0.0025, 1.0, 4.0 * std::sqrt(2.0 / static_cast<double>(s.samples)));
    EXPECT_NEAR(effort.offset, 0.3, 4.0 * 0.05 / std::sqrt(static_cast<double>(s.samples)));
    EXPECT_NEAR(effort.correlation, 0.0, 4.0 / std::sqrt(static_cast<double>(s.samples)));
    EXPECT_GE(effort.bound.bound, effort.largest);
    EXPECT_EQ(s.columns[1].kind, Kind::constant);
    EXPECT_EQ(s.columns[1].sd, 0.0);
    EXPECT_NEAR(s.columns[2].sd, 0.01, 0.001);
  }
}

// The stated error of sd² against its scatter over logs, of white and of correlated noise. The scatter of 200 values is
// known to 5 %, and the stated one, from few long-run frequencies, to some 15 % on the mean.
TEST(StandstillNoise, StatesItsError) {
  for (const double phi : {0.0, 0.8}) {
    constexpr int runs = 200;
    double sum = 0.0, squares = 0.0, stated = 0.0;
    for (int run = 0; run < runs; ++run) {
      const Standstill s = standstill_of(drive(50 + static_cast<std::uint64_t>(run), phi),
                                         {.commands = {"command_r"}, .speeds = {"omega_r"}, .angles = {}});
      const double relative = s.columns[0].sd * s.columns[0].sd / 0.0025;
      sum += relative;
      squares += relative * relative;
      stated += s.columns[0].relative_sd * s.columns[0].relative_sd;
      EXPECT_NEAR(s.columns[0].correlation, phi, 0.15);
    }
    const double scatter = std::sqrt(squares / runs - std::pow(sum / runs, 2.0));
    EXPECT_NEAR(std::sqrt(stated / runs) / scatter, 1.0, 0.3) << phi;
    EXPECT_NEAR(sum / runs, 1.0, 0.02) << phi;
  }
}

TEST(StandstillNoise, IsNotFoundInSlowMotionNorWhileCoasting) {
  LogTable log = drive(2);
  // A slow sine passes zero for seconds on end.
  for (std::size_t k = 0; k < log.rows(); ++k) {
    log.columns[0][k] = 8.0 * std::sin(2.0 * std::numbers::pi * log.t[k] / 400.0);
  }
  const Standstill slow = standstill_of(log, {.commands = {}, .speeds = {"omega_r"}, .angles = {}});
  EXPECT_EQ(slow.stretches, 0U);
  EXPECT_EQ(slow.columns[0].kind, Kind::not_seen);
  EXPECT_NE(slow.recognised.find("no stretch"), std::string::npos);
  // Pushed while the command is zero.
  LogTable pushed = drive(3);
  for (std::size_t k = 0; k < pushed.rows(); ++k) {
    pushed.columns[2][k] = 0.0;
  }
  const Standstill s = standstill_of(pushed, {.commands = {"command_r"}, .speeds = {"omega_r"}, .angles = {}});
  EXPECT_EQ(s.stretches, 3U);
  EXPECT_NEAR(s.columns[0].sd, 0.05, 0.005);
}

TEST(StandstillNoise, CutsLongStretchesSoThatDriftIsNoNoise) {
  LogTable log;
  log.names = {"omega_r", "phi_r", "command_r", "tau_r"};
  log.columns.resize(4);
  Random random(5);
  for (int k = 0; k < 60000; ++k) {
    log.t.push_back(kStep * k);
    log.columns[0].push_back(0.0);
    log.columns[1].push_back(0.0);
    log.columns[2].push_back(0.0);
    log.columns[3].push_back(0.001 * log.t.back() + 0.01 * random.normal());
  }
  const StandstillSigns signs{.commands = {"command_r"}, .speeds = {}, .angles = {}};
  StandstillOptions options;
  options.piece = 10.0;
  const StandstillNoise cut = standstill_of(log, signs, options).columns[0];
  EXPECT_NEAR(cut.sd, std::hypot(0.01, 0.009 / std::sqrt(12.0)), 0.0005);
  EXPECT_NEAR(cut.offset_spread, 0.6 / std::sqrt(12.0), 0.01);
}

TEST(StandstillSigns, AreThoseThatAllJointsHave) {
  LogTable log = drive(6);
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  const Model model = model::make_model(robot);
  TableSource one(log);
  EXPECT_TRUE(standstill_signs(one, model).speeds.empty());
  log.names.push_back("omega_l");
  log.columns.push_back(log.columns[0]);
  TableSource both(log);
  const StandstillSigns signs = standstill_signs(both, model);
  EXPECT_EQ(signs.speeds, (std::vector<std::string>{"omega_r", "omega_l"}));
  EXPECT_TRUE(signs.commands.empty());
  EXPECT_THROW(static_cast<void>(standstill_noise(both, {}, {"tau_r"})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(standstill_noise(both, signs, {"tau"})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::inference::standstill_noise_test
