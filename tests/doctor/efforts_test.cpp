// SPDX-License-Identifier: Apache-2.0
// Efforts that stand still, are copied, scaled or smoothed are named, over rates, lengths and kinds of driving; honest
// constant efforts are not. The robot that makes the logs is written here anew: two masses, Euler steps.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/doctor/log_health.hpp"
#include "tests/doctor/as_found.hpp"

namespace wheelwright::doctor::efforts_test {
namespace {

constexpr double kRadius = 0.085, kTrack = 0.4;

// A robot of 24 kg with a controller of its speeds that holds its torques from row to row.
struct Drive {
  double rate = 100.0, seconds = 60.0;
  double mass = 24.0, inertia = 1.3, viscous = 6.0, viscous_yaw = 0.7, coulomb = 0.0;
  double limit = 1e9;          // N·m, of each wheel
  double resolution = 0.0;     // N·m, of the torques that are commanded
  double speed_noise = 0.005;  // rad/s, uniform
  double effort_noise = 0.02;  // N·m, uniform; 0: the command itself is logged
  unsigned seed = 1;
  std::function<bool(double)> coasts = [](double) { return false; };
  std::function<std::pair<double, double>(double)> open_loop = nullptr;  // torques; empty: the controller's
};

LogTable drive(const Drive& d) {
  std::mt19937 random(d.seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double phase[8];
  for (double& p : phase) {
    p = std::numbers::pi * uniform(random);
  }
  const auto wish = [&](double t) {
    double v = 0.0, w = 0.0;
    for (int k = 0; k < 4; ++k) {
      v += 0.25 * std::sin(2.0 * std::numbers::pi * (0.07 + 0.11 * k) * t + phase[k]);
      w += 0.5 * std::sin(2.0 * std::numbers::pi * (0.09 + 0.13 * k) * t + phase[4 + k]);
    }
    return std::pair(v, w);
  };
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l"};
  log.columns.resize(4);
  double v = 0.0, w = 0.0, sum_r = 0.0, sum_l = 0.0;
  const int fine = static_cast<int>(std::ceil(2000.0 / d.rate));
  const double h = 1.0 / (d.rate * fine);
  for (int k = 0; k < static_cast<int>(d.seconds * d.rate); ++k) {
    const double t = k / d.rate;
    const auto [v_wish, w_wish] = wish(t);
    const double right = (v + 0.5 * kTrack * w) / kRadius, left = (v - 0.5 * kTrack * w) / kRadius;
    const double er = (v_wish + 0.5 * kTrack * w_wish) / kRadius - right;
    const double el = (v_wish - 0.5 * kTrack * w_wish) / kRadius - left;
    sum_r += er / d.rate;
    sum_l += el / d.rate;
    double tr = std::clamp(0.6 * er + 1.5 * sum_r, -d.limit, d.limit);
    double tl = std::clamp(0.6 * el + 1.5 * sum_l, -d.limit, d.limit);
    if (d.open_loop) {
      std::tie(tr, tl) = d.open_loop(t);
    }
    if (d.coasts(t)) {
      tr = tl = sum_r = sum_l = 0.0;
    }
    if (d.resolution > 0.0) {
      tr = d.resolution * std::round(tr / d.resolution);
      tl = d.resolution * std::round(tl / d.resolution);
    }
    log.t.push_back(t);
    log.columns[0].push_back(right + d.speed_noise * uniform(random));
    log.columns[1].push_back(left + d.speed_noise * uniform(random));
    log.columns[2].push_back(tr + d.effort_noise * uniform(random));
    log.columns[3].push_back(tl + d.effort_noise * uniform(random));
    for (int i = 0; i < fine; ++i) {
      const double wr = (v + 0.5 * kTrack * w) / kRadius, wl = (v - 0.5 * kTrack * w) / kRadius;
      const double fr = (tr - d.coulomb * std::tanh(wr / 0.02)) / kRadius;
      const double fl = (tl - d.coulomb * std::tanh(wl / 0.02)) / kRadius;
      v += h * (fr + fl - d.viscous * v) / d.mass;
      w += h * (0.5 * kTrack * (fr - fl) - d.viscous_yaw * w) / d.inertia;
    }
  }
  return log;
}

Robot robot_of(bool held = true) {
  Robot robot;
  robot.wheel_radius = kRadius;
  robot.track_width = kTrack;
  robot.hold = held ? Hold::zero_order : Hold::first_order;
  robot.effort_changes = model::EffortChanges::at_samples;
  return robot;
}

std::string refusals(const LogHealth& health) {
  std::string text;
  for (const LogFinding& f : health.findings) {
    text += f.is_refusal() ? f.id + ": " + f.sentence + "\n" : "";
  }
  return text;
}

std::string fatal(const LogHealth& health) {
  std::string text;
  for (const LogFinding& f : health.findings) {
    text += f.severity == FindingSeverity::fatal ? f.id + ": " + f.sentence + "\n" : "";
  }
  return text;
}

enum class Stands { last_value, at_zero, clamped };

void stand(LogTable& log, double rate, double from, double seconds, Stands how, bool both) {
  const auto first = static_cast<std::size_t>(from * rate);
  const std::size_t last = std::min(log.rows(), first + static_cast<std::size_t>(seconds * rate));
  for (const std::size_t c : {2U, 3U}) {
    std::vector<double>& effort = log.columns[c];
    const double value = how == Stands::at_zero ? 0.0 : how == Stands::clamped ? 0.1 : effort[first];
    for (std::size_t k = first; k < last && (both || c == 2U); ++k) {
      effort[k] = value;
    }
  }
}

TEST(Efforts, ThatStandStillInMotionAreNamedWithTheirPlace) {
  unsigned seed = 1;
  for (const double rate : {20.0, 100.0, 250.0}) {
    for (const double seconds : {1.0, 5.0, 1e9}) {
      for (const Stands how : {Stands::last_value, Stands::at_zero, Stands::clamped}) {
        for (const bool both : {true, false}) {
          Drive d{.rate = rate, .seconds = rate > 200.0 ? 40.0 : 60.0, .seed = ++seed};
          d.effort_noise = seed % 2 == 0 ? 0.02 : 0.0;
          LogTable log = drive(d);
          if (rate < 50.0 && seconds < 2.0 && !both) {
            continue;  // 20 rows of one wheel may leave no more than the worst stretch elsewhere does
          }
          const double from = 20.0 + 0.1 * (seed % 40);
          stand(log, rate, from, seconds, how, both);
          const LogHealth health = examine(log, robot_of(seed % 3 != 0));
          const LogFinding* found = health.find("signals.effort_frozen");
          const std::string of = testing::PrintToString(rate) + " Hz, " + testing::PrintToString(seconds) +
                                 " s, kind " + testing::PrintToString(static_cast<int>(how)) +
                                 (both ? ", both" : ", right");
          if (found == nullptr) {
            ADD_FAILURE() << of;
            continue;
          }
          EXPECT_TRUE(found->is_refusal()) << of;
          EXPECT_EQ(found->columns.size(), both ? 2U : 1U) << of;
          EXPECT_NEAR(found->when.front().lower, from, 1.5 / rate) << of << found->sentence;
          EXPECT_NEAR(found->when.back().upper, std::min(from + seconds, log.t.back()), 1.5 / rate) << of;
          EXPECT_THAT(found->next, testing::HasSubstr("--without")) << of;
          EXPECT_EQ(refusals(health).find("units."), std::string::npos) << of << refusals(health);
        }
      }
    }
  }
}

// Of less than half a second, where much of the torque is missing.
TEST(Efforts, ThatStandStillForAMomentAreNamed) {
  for (const double rate : {100.0, 250.0}) {
    for (const Stands how : {Stands::at_zero, Stands::clamped}) {
      LogTable log = drive({.rate = rate, .seconds = 40.0, .seed = 7});
      const auto rows = static_cast<std::size_t>(0.4 * rate);
      std::size_t best = 0;
      double most = 0.0;
      for (std::size_t k = rows; k + 2 * rows < log.rows(); ++k) {
        double least = 1e9;
        for (std::size_t i = k; i < k + rows; ++i) {
          least = std::min({least, std::abs(log.columns[2][i]), std::abs(log.columns[0][i])});
        }
        best = least > most ? k : best;
        most = std::max(most, least);
      }
      const double sign = log.columns[2][best] > 0.0 ? 1.0 : -1.0;
      for (std::size_t i = best; i < best + rows; ++i) {
        log.columns[2][i] = how == Stands::at_zero ? 0.0 : 0.2 * most * sign;
      }
      const LogHealth health = examine(log, robot_of());
      const LogFinding* found = health.find("signals.effort_frozen");
      ASSERT_NE(found, nullptr) << rate;
      EXPECT_NEAR(found->when.front().lower, log.t[best], 1.5 / rate);
      EXPECT_THAT(found->next, testing::HasSubstr("--without"));
    }
  }
}

TEST(Efforts, ThatAreConstantForAReasonAreSound) {
  const auto coasting = [](double t) { return std::fmod(t, 15.0) > 12.0; };
  for (const double rate : {20.0, 100.0, 250.0}) {
    for (const double coulomb : {0.0, 0.2}) {
      std::vector<std::pair<std::string, Drive>> drives;
      drives.push_back({"coasting", {.coasts = coasting}});
      drives.push_back({"limit", {.limit = 0.35}});
      drives.push_back({"coarse command", {.resolution = 0.1, .effort_noise = 0.0}});
      drives.push_back({"rest of the log coasting", {.coasts = [](double t) { return t > 45.0; }}});
      drives.push_back({"steps", {.effort_noise = 0.0, .open_loop = [](double t) {
                                    const int k = static_cast<int>(t / 1.7);
                                    return std::pair(0.4 + 0.5 * ((k * 7) % 5 - 2), 0.4 + 0.5 * ((k * 3) % 5 - 2));
                                  }}});
      drives.push_back({"steps between ramps", {.effort_noise = 0.0, .open_loop = [](double t) {
                                                  const double u = std::fmod(t, 6.0) < 3.0
                                                                       ? std::sin(std::floor(t / 3.0))
                                                                       : std::sin(t) * std::cos(0.3 * t);
                                                  return std::pair(0.5 + u, 0.5 + u * std::cos(0.2 * t));
                                                }}});
      for (auto& [name, d] : drives) {
        d.rate = rate;
        d.coulomb = coulomb;
        const LogHealth health = examine(drive(d), robot_of());
        EXPECT_EQ(health.find("signals.effort_frozen"), nullptr)
            << name << " at " << rate << " Hz: " << health.find("signals.effort_frozen")->sentence;
      }
    }
  }
}

TEST(Efforts, ThatAreCopiedAreNamed) {
  for (const double rate : {20.0, 100.0}) {
    for (const double factor : {1.0, -1.0, 0.5, 2.5}) {
      LogTable log = drive({.rate = rate, .seed = 3});
      std::ranges::transform(log.columns[2], log.columns[3].begin(), [&](double e) { return factor * e; });
      const LogHealth health = examine(log, robot_of());
      ASSERT_NE(health.find("signals.effort_copied"), nullptr) << factor;
      EXPECT_TRUE(health.find("signals.effort_copied")->is_refusal());
      EXPECT_NEAR(health.find("signals.effort_copied")->value, factor, 1e-9);
    }
    LogTable mean = drive({.rate = rate, .seed = 4});
    for (std::size_t k = 0; k < mean.rows(); ++k) {
      mean.columns[2][k] = mean.columns[3][k] = 0.5 * (mean.columns[2][k] + mean.columns[3][k]);
    }
    EXPECT_NE(examine(mean, robot_of()).find("signals.effort_copied"), nullptr);
    // One command for both wheels, which drives straight on.
    const LogTable straight = drive(
        {.rate = rate, .effort_noise = 0.0, .open_loop = [](double t) { return std::pair(std::sin(t), std::sin(t)); }});
    EXPECT_EQ(examine(straight, robot_of()).find("signals.effort_copied"), nullptr);
    EXPECT_EQ(examine(drive({.rate = rate}), robot_of()).find("signals.effort_copied"), nullptr);
  }
}

TEST(Efforts, InAnotherUnitAreRefusedAndALoadIsNot) {
  const auto with = [](double factor, bool frictions, double mass = 24.0) {
    LogTable log = drive({.mass = mass, .seed = 5});
    for (const std::size_t c : {2U, 3U}) {
      std::ranges::transform(log.columns[c], log.columns[c].begin(), [&](double e) { return factor * e; });
    }
    Robot robot = robot_of();
    robot.nominal = {{"mass", 24.0}, {"yaw_inertia", 1.3}};
    if (frictions) {
      robot.nominal["viscous_linear"] = 6.0;
      robot.nominal["viscous_yaw"] = 0.7;
    }
    const LogHealth health = examine(log, robot);
    const LogFinding* found = health.find("units.effort");
    return found == nullptr ? LogFinding{} : *found;
  };
  for (const bool frictions : {true, false}) {
    EXPECT_EQ(with(1.0, frictions).id, "");
    const LogFinding percent = with(12.5, frictions);
    EXPECT_TRUE(percent.is_refusal());
    EXPECT_THAT(percent.sentence, testing::HasSubstr("per cent of 8 N·m"));
    EXPECT_THAT(percent.next, testing::HasSubstr("--map tau_r=\"*0.0"));
    const LogFinding thousandths = with(100.0 / 0.6, frictions);
    EXPECT_TRUE(thousandths.is_refusal());
    EXPECT_THAT(thousandths.sentence, testing::HasSubstr("thousandths of 6 N·m"));
    const LogFinding geared = with(1.0 / 25.0, frictions);
    EXPECT_TRUE(geared.is_refusal());
    EXPECT_THAT(geared.sentence, testing::HasSubstr("25"));
    EXPECT_THAT(with(1000.0, frictions).sentence, testing::HasSubstr("mN·m"));
    // Four times its own mass is a load: a word, no refusal.
    const LogFinding loaded = with(1.0, frictions, 96.0);
    EXPECT_EQ(loaded.severity, FindingSeverity::warning);
    EXPECT_FALSE(loaded.is_refusal());
  }
  EXPECT_TRUE(with(5.0, true).is_refusal());  // per cent of 20 N·m, frictions and all
  EXPECT_EQ(with(5.0, false).severity, FindingSeverity::warning);
}

// Without a nominal mass a body that is denser than steel tells another unit; a robot of any size does not.
TEST(Efforts, ThatMakeABodyDenserThanSteelAreRefused) {
  for (const double size : {0.5, 1.0, 12.0}) {  // of mass and inertia, of one shape
    const double stretch = std::cbrt(size);
    for (const double factor : {1.0, 2.0, 100.0, 1000.0}) {
      LogTable log = drive({.mass = 24.0 * size,
                            .inertia = 1.3 * size * stretch * stretch,
                            .viscous = 6.0 * size,
                            .viscous_yaw = 0.7 * size,
                            .effort_noise = 0.02 * size,
                            .seed = 5});
      for (const std::size_t c : {2U, 3U}) {
        std::ranges::transform(log.columns[c], log.columns[c].begin(), [&](double e) { return factor * e; });
      }
      const LogHealth health = examine(log, robot_of());
      const LogFinding* found = health.find("units.effort");
      EXPECT_EQ(found != nullptr && found->is_refusal(), factor >= 100.0) << size << ' ' << factor;
      if (found != nullptr) {
        EXPECT_THAT(found->next, testing::HasSubstr("--map tau_r=\"*0.001\" --map tau_l=\"*0.001\""));
      }
    }
  }
}

TEST(Efforts, OfOneFactorBelowALoadAreAWord) {
  for (const double factor : {1.0, 1.5, 0.5}) {
    LogTable log = drive({.seed = 5});
    for (const std::size_t c : {2U, 3U}) {
      std::ranges::transform(log.columns[c], log.columns[c].begin(), [&](double e) { return factor * e; });
    }
    Robot robot = robot_of();
    robot.nominal = {{"mass", 24.0}, {"yaw_inertia", 1.3}, {"viscous_linear", 6.0}, {"viscous_yaw", 0.7}};
    const LogHealth health = examine(log, robot);
    const LogFinding* found = health.find("units.effort");
    EXPECT_EQ(found != nullptr, factor != 1.0) << factor;
    EXPECT_TRUE(found == nullptr || found->severity == FindingSeverity::warning);
  }
}

// A command of 8 bits whose zero is in the middle of its range is not one without a sign.
TEST(Efforts, AboutTheMiddleOfTheirRangeAreToldFromThoseWithoutASign) {
  for (const bool offset : {true, false}) {
    LogTable log = drive({.seed = 5});
    for (const std::size_t c : {2U, 3U}) {
      std::ranges::transform(log.columns[c], log.columns[c].begin(),
                             [&](double e) { return offset ? std::round(127.5 + 50.0 * e) : std::abs(50.0 * e); });
    }
    const LogHealth health = examine(log, robot_of());
    EXPECT_EQ(health.find("units.effort_offset") != nullptr, offset) << refusals(health);
    EXPECT_EQ(health.find("units.effort_unsigned") != nullptr, !offset) << refusals(health);
    if (offset) {
      EXPECT_NEAR(health.find("units.effort_offset")->value, 127.5, 1.0);
    }
  }
}

TEST(Efforts, ThatAreSmoothedAreToldWithTheTimeConstant) {
  for (const double rate : {50.0, 100.0, 250.0}) {
    const LogTable sound = drive({.rate = rate, .seed = 6});
    for (const double tau : {0.03, 0.06, 0.1}) {
      LogTable smoothed = sound;
      const double a = 1.0 - std::exp(-1.0 / (rate * tau));
      for (const std::size_t c : {2U, 3U}) {
        double y = 0.0;
        for (std::size_t k = 0; k < sound.rows(); ++k) {
          smoothed.columns[c][k] = y += a * (sound.columns[c][k] - y);
        }
      }
      const LogHealth health = examine(smoothed, robot_of());
      const LogFinding* found = health.find("time.effort_delay");
      ASSERT_NE(found, nullptr);
      EXPECT_THAT(found->sentence, testing::HasSubstr("low-pass filter of")) << rate << " Hz, " << tau;
      EXPECT_GT(found->value, 0.5 * tau) << found->sentence;
      EXPECT_LT(found->value, 1.2 * tau) << found->sentence;
    }
  }
}

// Speeds by the angles in counts, from row to row.
void difference(LogTable& log, double count) {
  for (const std::size_t c : {0U, 1U}) {
    std::vector<double>& speed = log.columns[c];
    double angle = 0.0, before = 0.0, last = speed.front();
    for (std::size_t k = 1; k < log.rows(); ++k) {
      const double h = log.t[k] - log.t[k - 1];
      angle += 0.5 * h * (last + speed[k]);
      last = speed[k];
      const double counted = count * std::floor(angle / count);
      speed[k] = (counted - before) / h;
      before = counted;
    }
    speed.front() = speed[1];
  }
}

// Commands that are held, logged as if measured, are half a step early; more where they are logged earlier.
TEST(Efforts, ThatComeBeforeTheMotionAreTakenInByDoctorWhereCommissionMakesAModelOfThem) {
  std::size_t taken = 0;
  for (const double rate : {100.0, 400.0}) {
    for (const int early : {0, 1, 4}) {          // rows
      for (const int counts : {0, 256, 1024}) {  // a turn, of angles that are differenced
        LogTable log = drive({.rate = rate, .seconds = 40.0, .effort_noise = 0.1, .seed = 8});
        if (counts > 0) {
          difference(log, 2.0 * std::numbers::pi / counts);
        }
        for (const std::size_t c : {2U, 3U}) {
          std::rotate(log.columns[c].begin(), log.columns[c].begin() + early, log.columns[c].end());
        }
        const Robot robot = robot_of(false);
        const LogHealth health = examine(log, robot);
        const commission::Commissioning result = testing_support::commissioned_as_found(log, robot, health);
        const LogFinding* found = health.find("time.effort_delay");
        EXPECT_EQ(result.has_model(), health.verdict == LogVerdict::commission)
            << rate << " Hz, " << early << ", " << counts << ": " << result.message << '\n'
            << (found != nullptr ? found->sentence : "") << fatal(health);
        if (found == nullptr) {
          continue;
        }
        if (found->taken && found->taken->lower < 0.0) {
          ++taken;
          EXPECT_LE(found->taken->lower, -(early + 0.5) / rate + 0.2 / rate) << found->sentence;
        }
      }
    }
  }
  EXPECT_GT(taken, 0U);
}

// Held commands that act from stamp to stamp are late by less than a step only where they are smoothed.
TEST(Efforts, ThatAreSmoothedALittleAreReadWithTheFilterTheyAreOf) {
  for (const double rate : {50.0, 100.0, 250.0}) {
    const LogTable sound = drive({.rate = rate, .seed = 7});
    EXPECT_EQ(examine(sound, robot_of()).find("signals.effort_filter"), nullptr);
    for (const double steps : {0.6, 0.9}) {
      LogTable smoothed = sound;
      const double a = 1.0 - std::exp(-1.0 / steps), tau = steps / rate;
      for (const std::size_t c : {2U, 3U}) {
        double y = 0.0;
        for (double& u : smoothed.columns[c]) {
          u = y += a * (u - y);
        }
      }
      const LogHealth health = examine(smoothed, robot_of());
      const LogFinding* found = health.find("signals.effort_filter");
      ASSERT_NE(found, nullptr) << rate << " Hz, " << steps << " steps";
      ASSERT_TRUE(found->effort_smoothing);
      EXPECT_LE(found->effort_smoothing->lower, tau) << found->sentence;
      EXPECT_GE(found->effort_smoothing->upper, tau) << found->sentence;
      EXPECT_LT(found->effort_smoothing->width(), tau) << found->sentence;
      EXPECT_EQ(refusals(health), "");
    }
  }
}

}  // namespace
}  // namespace wheelwright::doctor::efforts_test
