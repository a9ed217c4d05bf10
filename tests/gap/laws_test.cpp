// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects that follow laws which no column of the catalogue has: play with any contact, slip by a contact's own
/// friction. The worlds here integrate two masses on each wheel and know nothing of the columns.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/words.hpp"
#include "gap/diagnose.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::laws_test {
namespace {

constexpr double kRadius = 0.1, kTrack = 0.4, kMass = 20.0, kFriction = 4.0;
constexpr double kLoad = 0.5 * kMass * kRadius * kRadius;         // kg·m² that a wheel moves in all
constexpr double kDamping = 0.5 * kFriction * kRadius * kRadius;  // N·m·s/rad of one wheel
constexpr double kRotor = 0.02;                                   // kg·m² of it that turns with the motor
constexpr double kStep = 0.01;                                    // s, of the log
constexpr double kFine = 2e-5;                                    // s, of the integration

/// With the yaw inertia m D²/4 the wheels do not know of each other.
Robot robot_of_two_wheels() {
  Robot robot;
  robot.wheel_radius = kRadius;
  robot.track_width = kTrack;
  robot.encoder_counts_per_turn = 8192.0;
  robot.nominal = {{"mass", kMass},
                   {"yaw_inertia", 0.25 * kMass * kTrack * kTrack},
                   {"viscous_linear", kFriction},
                   {"viscous_yaw", 0.25 * kFriction * kTrack * kTrack}};
  return robot;
}

/// Motor and what it drives: at each instant their speeds, the angle of the wheel that the encoder shows, and the speed
/// of the rim over ground.
struct Side {
  double motor = 0.0;   // rad/s
  double wheel = 0.0;   // rad/s, seen by the encoder
  double ground = 0.0;  // m/s
  double ahead = 0.0;   // rad, of the motor, from the middle of the play
  double angle = 0.0;   // rad, of the wheel
  bool is_left = false;
};

/// Play of ±half between rotor and wheel. Where they touch they hold together for as long as they push, and part with
/// `bounce` times the speed at which they met.
struct Play {
  double half = 0.0;
  double bounce = 0.0;

  void advance(Side& s, double torque) const {
    const bool touching = std::abs(s.ahead) >= half && s.motor == s.wheel;
    const double together = (torque - kDamping * s.wheel) / kLoad;
    const double passed = torque - kRotor * together;  // to the wheel
    if (half == 0.0 || (touching && passed * s.ahead >= 0.0)) {
      s.motor = s.wheel = s.wheel + kFine * together;
    } else {
      s.motor += kFine * torque / kRotor;
      s.wheel -= kFine * kDamping * s.wheel / (kLoad - kRotor);
      s.ahead += kFine * (s.motor - s.wheel);
      if (std::abs(s.ahead) >= half && (s.motor - s.wheel) * s.ahead > 0.0) {
        const double met = s.motor - s.wheel;
        const double mean = (kRotor * s.motor + (kLoad - kRotor) * s.wheel) / kLoad;
        const double parting = std::abs(met) > 0.02 ? -bounce * met : 0.0;
        s.wheel = mean - kRotor / kLoad * parting;
        s.motor = s.wheel + parting;
        s.ahead = std::copysign(half, s.ahead);
      }
    }
    s.ground = kRadius * s.wheel;
  }
};

/// A contact that passes on `most` tanh(slip/at) newtons.
struct Sliding {
  double most = 0.0, at = 0.0;

  void advance(Side& s, double torque) const {
    const double force = most * std::tanh((kRadius * s.wheel - s.ground) / at);
    s.wheel += kFine * (torque - kRadius * force) / kRotor;
    const double mass = (kLoad - kRotor) / (kRadius * kRadius);
    s.ground += kFine * (force - kDamping / (kRadius * kRadius) * s.ground) / mass;
    s.motor = s.wheel;
  }
};

/// Wheel and motor in one, which a further torque `lost(side, torque)` works against.
template <typename Lost>
struct Resisted {
  Lost lost;

  void advance(Side& s, double torque) const {
    s.wheel += kFine * (torque - kDamping * s.wheel - lost(s, torque)) / kLoad;
    s.angle += kFine * s.wheel;
    s.motor = s.wheel;
    s.ground = kRadius * s.wheel;
  }
};

/// 80 s under a speed controller, as a log: encoder counts, noise of torque and pose, `t` at the middle of each
/// interval.
template <typename Law>
LogTable log_of(const Law& law, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 6.28);
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.resize(log.names.size());
  log.segment_starts = {0};
  const double phases[6] = {phase(generator), phase(generator), phase(generator),
                            phase(generator), phase(generator), phase(generator)};
  Side sides[2];
  sides[1].is_left = true;
  double angle[2] = {0.0, 0.0}, sum[2] = {0.0, 0.0}, x = 0.0, y = 0.0, heading = 0.0;
  double counted[2] = {0.0, 0.0};
  const double count = 2.0 * 3.141592653589793 / 8192.0;
  const int fine = static_cast<int>(std::lround(kStep / kFine));
  for (int k = 0; k < 8000; ++k) {
    const double t = k * kStep;
    double torque[2];
    for (int j = 0; j < 2; ++j) {
      const double* const p = phases + 3 * j;
      const double wanted =
          4.0 * std::sin(0.9 * t + p[0]) + 2.5 * std::sin(2.3 * t + p[1]) + 1.2 * std::sin(5.1 * t + p[2]);
      const double rate =
          3.6 * std::cos(0.9 * t + p[0]) + 5.75 * std::cos(2.3 * t + p[1]) + 6.12 * std::cos(5.1 * t + p[2]);
      const double error = wanted - sides[j].wheel;
      sum[j] += error * kStep;
      torque[j] = kLoad * rate + kDamping * wanted + 0.5 * error + 0.5 * sum[j];
    }
    for (int i = 0; i < fine; ++i) {
      for (int j = 0; j < 2; ++j) {
        law.advance(sides[j], torque[j]);
        angle[j] += kFine * sides[j].wheel;
      }
      const double v = 0.5 * (sides[0].ground + sides[1].ground);
      heading += kFine * (sides[0].ground - sides[1].ground) / kTrack;
      x += kFine * v * std::cos(heading);
      y += kFine * v * std::sin(heading);
      if (i == fine / 2) {
        log.columns[4].push_back(x + 5e-4 * normal(generator));
        log.columns[5].push_back(y + 5e-4 * normal(generator));
        log.columns[6].push_back(heading + 1e-3 * normal(generator));
      }
    }
    log.t.push_back(t + 0.5 * kStep);
    for (int j = 0; j < 2; ++j) {
      const double seen = std::floor(angle[j] / count) * count;
      log.columns[static_cast<std::size_t>(j)].push_back((seen - counted[j]) / kStep);
      counted[j] = seen;
      log.columns[static_cast<std::size_t>(2 + j)].push_back(torque[j] + 0.01 * normal(generator));
    }
  }
  return log;
}

template <typename Law>
Diagnosis diagnosis_of(const Law& law) {
  LogTable log = log_of(law, 2);
  LogTable healthy = log_of(Play{}, 3);
  TableSource source(log), baseline(healthy);
  DiagnoseOptions options;
  options.shrink = false;
  return diagnose(source, &baseline, robot_of_two_wheels(), options);
}

std::set<std::string> names_of(const Diagnosis& found) {
  std::set<std::string> names;
  for (const GapCause& cause : found.causes) {
    names.insert(cause.effect);
  }
  return names;
}

bool is_kept(const Diagnosis& found, const std::string& effect) {
  return std::ranges::any_of(found.credible, [&](const CredibleCauses& set) {
    return std::ranges::find(set.effects, effect) != set.effects.end();
  });
}

std::string kept(const Diagnosis& found) {
  std::string all;
  for (const CredibleCauses& set : found.credible) {
    all += (all.empty() ? "" : " or ") + core::enumerated(set.effects);
  }
  return all;
}

bool says(const Diagnosis& found, const std::string& words) {
  return std::ranges::any_of(found.notes,
                             [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

TEST(Laws, AHealthyRobotHasNoGapAndNoNoteAgainstIt) {
  const Diagnosis found = diagnosis_of(Play{});
  EXPECT_EQ(found.verdict, GapVerdict::no_gap);
  EXPECT_TRUE(found.contradictions.empty());
  EXPECT_FALSE(says(found, "contradict"));
}

TEST(Laws, PlayIsFoundWhateverItsContact) {
  for (const double bounce : {0.0, 0.5}) {
    const Diagnosis found = diagnosis_of(Play{0.005, bounce});
    EXPECT_EQ(names_of(found), std::set<std::string>{"backlash"}) << bounce;
    EXPECT_EQ(found.verdict, GapVerdict::explained) << bounce;
  }
}

// A torque reverses while it changes fast, when a motor that holds its command for a while is furthest from it.
TEST(Laws, ATorqueThatFollowsInStepsHasNoPlay) {
  struct Held {
    double value = 0.0;
    int left = 0;
  };
  const auto in_steps = [of = std::make_shared<std::array<Held, 2>>()](const Side& s, double t) {
    Held& held = (*of)[s.is_left ? 1 : 0];
    if (held.left-- == 0) {
      held = {t, static_cast<int>(std::lround(0.12 / kFine)) - 1};
    }
    return t - held.value;
  };
  const std::set<std::string> names = names_of(diagnosis_of(Resisted{in_steps}));
  EXPECT_FALSE(names.contains("backlash"));
  EXPECT_TRUE(names.contains("delay") || names.contains("actuator_lag"))
      << core::enumerated({names.begin(), names.end()});
}

// Where these contacts slide. One that only creeps makes the ground's speed lag behind the rim's, as by clocks that
// differ, and nothing here could tell.
TEST(Laws, SlipIsFoundByTheFrictionOfItsContact) {
  for (const Sliding law : {Sliding{12.0, 0.02}, Sliding{9.0, 0.05}}) {
    const Diagnosis found = diagnosis_of(law);
    EXPECT_TRUE(is_kept(found, "longitudinal_slip")) << law.most << " N: " << kept(found);
    EXPECT_NE(found.verdict, GapVerdict::no_gap);
  }
}

template <typename Lost>
std::string causes_against(const Lost& lost) {
  const Diagnosis found = diagnosis_of(Resisted<Lost>{lost});
  const std::set<std::string> names = names_of(found);
  return core::enumerated({names.begin(), names.end()}) +
         (found.verdict == GapVerdict::unexplained ? ", unexplained" : "");
}

constexpr double kTop = 6.0;  // rad/s, that these drives come to

TEST(Laws, SlowViscousFrictionMayBendInAnyWay) {
  const auto palmgren = [](const Side& s, double) {
    return std::copysign(std::pow(std::abs(s.wheel), 2.0 / 3.0), s.wheel);
  };
  const auto sheared = [](const Side& s, double) { return std::asinh(s.wheel / (0.15 * kTop)); };
  const auto carreau = [](const Side& s, double) { return s.wheel / std::pow(1.0 + s.wheel * s.wheel, 0.35); };
  const auto thickening = [](const Side& s, double) { return s.wheel * std::exp(std::abs(s.wheel) / kTop); };
  const auto on_both = [](const auto& law, double size) {
    return causes_against([=](const Side& s, double t) { return size * law(s, t); });
  };
  const auto on_left = [](const auto& law, double size) {
    return causes_against([=](const Side& s, double t) { return s.is_left ? size * law(s, t) : 0.0; });
  };
  EXPECT_EQ(on_both(palmgren, 0.1), "viscous");
  EXPECT_EQ(on_both(sheared, 0.12), "viscous");
  EXPECT_EQ(on_both(thickening, 0.04), "viscous");
  EXPECT_EQ(on_left(palmgren, 0.12), "viscous_asymmetric");
  EXPECT_EQ(on_left(carreau, 0.2), "viscous_asymmetric");
}

TEST(Laws, DryFrictionIsNoBentViscousOne) {
  EXPECT_EQ(causes_against([](const Side& s, double) { return 0.2 * std::tanh(s.wheel / 0.1); }), "coulomb");
  const auto bristles = [z = std::make_shared<std::array<double, 2>>()](const Side& s, double) {
    double& bent = (*z)[s.is_left ? 1 : 0];
    bent += kFine * s.wheel * (1.0 - bent * std::copysign(1.0, s.wheel)) / 0.03;
    return (s.is_left ? 0.1 : 0.25) * bent;
  };
  EXPECT_EQ(causes_against(bristles), "coulomb_asymmetric");
}

TEST(Laws, TorqueMayFallShortOfItsCommandInAnyWay) {
  const auto soft = [](const Side&, double t) { return t - 1.5 * std::tanh(t / 1.5); };
  const auto slow = [y = std::make_shared<std::array<double, 2>>()](const Side& s, double t) {
    double& torque = (*y)[s.is_left ? 1 : 0];
    torque += std::clamp(t - torque, -3.0 * kFine, 3.0 * kFine);
    return t - torque;
  };
  EXPECT_EQ(causes_against(soft), "saturation");
  EXPECT_EQ(causes_against(slow), "actuator_lag");
}

TEST(Laws, TheSameCausesByOtherLawsAreOneAnswer) {
  const auto growing = [t = std::make_shared<double>(0.0)](const Side& s, double) {
    *t += 0.5 * kFine;
    return 0.03 * (1.0 + 0.4 * *t / 80.0) * std::tanh(s.wheel / 0.02);
  };
  const Diagnosis found = diagnosis_of(Resisted{growing});
  EXPECT_EQ(names_of(found), (std::set<std::string>{"coulomb", "friction_drift"}));
  EXPECT_EQ(found.verdict, GapVerdict::explained) << kept(found);
}

TEST(Laws, FrictionMayGrowWithTheLoadInAnyWay) {
  const auto against = [](const auto& by_load) {
    return causes_against([=](const Side& s, double t) { return by_load(std::abs(t)) * std::tanh(s.wheel / 0.02); });
  };
  EXPECT_EQ(against([](double load) { return 0.15 * std::pow(load, 0.6); }), "load_friction");
  EXPECT_EQ(against([](double load) { return 0.4 * std::max(load - 0.3, 0.0); }), "load_friction");
}

TEST(Laws, DragMayBeThatOfTheWheels) {
  EXPECT_EQ(causes_against([](const Side& s, double) { return 0.02 * s.wheel * std::abs(s.wheel); }), "quadratic_drag");
}

// A flat, as a bump of the axle's height once a turn, and an oval; magnets that pull a motor into places are no wheel.
TEST(Laws, WheelsMayBeOfAnyForm) {
  const auto bump = [](const Side& s, double) {
    return 0.4 * std::sin(s.angle) * std::exp(2.0 * (std::cos(s.angle) - 1.0));
  };
  const auto oval = [](const Side& s, double) {
    return s.is_left ? 0.2 * std::cos(2.0 * s.angle) + 0.08 * std::sin(3.0 * s.angle) : 0.0;
  };
  EXPECT_EQ(causes_against(bump), "wheel_out_of_round");
  EXPECT_EQ(causes_against(oval), "wheel_out_of_round");
  const Diagnosis cogged = diagnosis_of(Resisted{[](const Side& s, double) { return 0.2 * std::sin(9.0 * s.angle); }});
  EXPECT_EQ(cogged.verdict, GapVerdict::unexplained);
  EXPECT_FALSE(names_of(cogged).contains("wheel_out_of_round"));
}

TEST(Laws, ALoadOffTheMiddleIsOneCause) {
  Scenario real = gap_example::noisy_scenario(gap_example::robot_with("com_longitudinal", {{"a", 0.04}}), 4);
  real.parameters.mass = 26.0;
  real.parameters.yaw_inertia = 1.2;
  Simulation log(real), healthy(gap_example::healthy_scenario(real));
  DiagnoseOptions options;
  options.shrink = false;
  const Diagnosis found = diagnose(log, &healthy, gap_example::counted_robot(), options);
  EXPECT_EQ(names_of(found), std::set<std::string>{"payload_offset"});
  ASSERT_TRUE(found.improved.has_value());
  EXPECT_NEAR(found.improved->nominal.at("mass"), 26.0, 1.0);
}

// A limit is seen at the peaks; one below most of the efforts would be rid of the signal.
TEST(Laws, ALimitBelowMostEffortsIsNone) {
  Drive drive = gap_example::drive_of_log(log_of(Play{}, 5), robot_of_two_wheels());
  const Effect limit = gap_example::effect_called("saturation");
  const auto taken = [&](double most) {
    double square = 0.0;
    const std::vector<Column> columns = limit.columns(drive, std::vector{most});
    for (const Eigen::VectorXd& effort : columns.front().effort) {
      square += effort.squaredNorm();
    }
    return square;
  };
  std::vector<double> sizes;
  for (const JointSignals& joint : drive.joints) {
    for (const double effort : joint.effort) {
      sizes.push_back(std::abs(effort));
    }
  }
  std::ranges::sort(sizes);
  EXPECT_GT(taken(sizes[sizes.size() * 95 / 100]), 0.0);
  EXPECT_EQ(taken(sizes[sizes.size() / 2]), 0.0);
  EXPECT_TRUE(applicability(limit, drive).applies);
  drive.efforts_flowed = true;
  EXPECT_FALSE(applicability(limit, drive).applies) << "currents that flowed passed every limit";
}

}  // namespace
}  // namespace wheelwright::gap::laws_test
