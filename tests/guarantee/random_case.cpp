// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/guarantee/dice.hpp"
#include "tests/guarantee/scene.hpp"

namespace wheelwright::guarantee {
namespace {

constexpr double kDefaultPrior = 1e5;  // upper end of the widest default priors
constexpr double kDefaultMass = 1e4;
constexpr double kShareBroken = 0.2;

template <typename T, std::size_t n>
T pick(Dice& dice, const T (&choices)[n]) {
  return choices[dice.below(n)];
}

void choose_robot(Case& c, Dice& dice) {
  Truth& t = c.truth;
  const double h = 1.0 / c.rate;
  t.axis = dice.chance(0.4);
  t.mass = dice.decade(1e-3, 1e5);
  const double constant = h * std::exp(std::log(0.5) + dice.share() * std::log(std::max(60.0 / h, 10.0) / 0.5));
  t.viscous_linear = t.mass / constant;
  if (!t.axis) {
    const double size = 0.5 * std::cbrt(t.mass / 50.0) * dice.uniform(0.6, 1.6);
    t.track = size * dice.uniform(0.5, 1.2);
    t.radius = size * dice.uniform(0.1, 0.4);
    t.yaw_inertia = t.mass * t.track * t.track * dice.uniform(0.1, 0.4);
    t.viscous_yaw = t.yaw_inertia / std::max(0.5 * h, constant * dice.uniform(0.3, 3.0));
  }
}

void choose_order(const Case& c, Dice& dice, double angle, Order& o) {
  o.motion = pick(dice, {Motion::multisine, Motion::multisine, Motion::chirp, Motion::staircase, Motion::random_steps,
                         Motion::speed_loop, Motion::saturated});
  const bool continuous = c.changes == Changes::linear || c.changes == Changes::smooth;
  if (continuous && (o.motion == Motion::speed_loop || o.motion == Motion::staircase ||
                     o.motion == Motion::random_steps || o.motion == Motion::saturated)) {
    o.motion = Motion::multisine;
  }
  o.seed = dice.bits();
  reach_for(c.truth, angle, o);
  const double tick_rate = c.controller_rate > 0.0 ? c.controller_rate : c.rate;
  const Truth& t = c.truth;
  const double r2 = 0.5 * t.radius * t.radius;
  const double lightest = t.axis ? t.mass : r2 * std::min(t.mass, 4.0 * t.yaw_inertia / (t.track * t.track));
  o.gain = dice.uniform(0.05, 0.5) * lightest * tick_rate;
}

void choose_sensors(Case& c, Dice& dice) {
  c.stamps = pick(dice, {Stamps::even, Stamps::even, Stamps::even, Stamps::jittered, Stamps::jittered,
                         Stamps::two_three, Stamps::tenth_twice});
  c.jitter = c.stamps == Stamps::jittered ? dice.decade(0.02, 0.3) : 0.0;
  c.lost = dice.chance(0.2) ? dice.decade(0.001, 0.02) : 0.0;
  c.sense = pick(dice, {Sense::angle, Sense::angle, Sense::angle, Sense::encoder, Sense::encoder, Sense::speed,
                        Sense::speed, Sense::mean_speed, Sense::whole_rpm});
  if (c.sense == Sense::mean_speed) {
    c.stamps = Stamps::even;
    c.jitter = 0.0;
  }
  if (c.stamps == Stamps::tenth_twice) {
    c.lost = 0.0;  // nobody could tell a lost row from a long step
  }
  const Noise all[] = {Noise::uniform, Noise::uniform,      Noise::two_point,     Noise::plus,
                       Noise::minus,   Noise::clipped_bell, Noise::against_heavy, Noise::against_light};
  c.noise = pick(dice, all);
  c.noise_watch = pick(dice, all);
  c.changes =
      pick(dice, {Changes::at_samples, Changes::at_samples, Changes::between, Changes::linear, Changes::smooth});
}

void choose_broken(Case& c, Dice& dice) {
  if (!dice.chance(kShareBroken)) {
    return;
  }
  const double h = 1.0 / c.rate;
  const bool held = c.changes == Changes::at_samples || c.changes == Changes::between;
  c.broken = pick(dice, {Broken::late_efforts, Broken::backward_speeds, Broken::stamps_off, Broken::hold_wrong,
                         Broken::torque_late, Broken::clipped_effort, Broken::hidden_friction,
                         Broken::unlogged_commands, Broken::wrapped_angles, Broken::beyond_prior});
  switch (c.broken) {
    case Broken::late_efforts: c.delay = std::min(dice.decade(0.002, 0.02), 5.0 * h); break;
    case Broken::stamps_off: c.delay = h * dice.uniform(0.05, 0.4); break;
    case Broken::backward_speeds:
      c.sense = Sense::mean_speed;
      c.stamps = Stamps::even;
      c.jitter = 0.0;
      break;
    case Broken::hidden_friction: c.truth.coulomb = 1.0; break;
    case Broken::unlogged_commands:
      c.changes = held ? c.changes : Changes::at_samples;
      c.controller_rate = 2.5 * c.rate;
      break;
    case Broken::wrapped_angles: c.sense = dice.chance(0.5) ? Sense::angle : Sense::encoder; break;
    case Broken::beyond_prior: c.truth.mass = dice.decade(3e4, 3e5); break;
    default: break;
  }
}

bool default_prior_holds(const Truth& t) {
  return t.mass < kDefaultMass && t.coulomb < kDefaultMass && t.viscous_linear < kDefaultPrior &&
         (t.axis || (t.yaw_inertia < kDefaultPrior && t.viscous_yaw < kDefaultPrior));
}

}  // namespace

Case random_case(std::uint64_t seed, std::uint64_t number) {
  Dice dice(seed * 0x9e3779b97f4a7c15u ^ (number + 1) * 0xd1342543de82ef95u);
  dice.bits();
  Case c;
  c.seed = dice.bits();
  c.rate = dice.decade(5.0, 1000.0);
  choose_robot(c, dice);
  choose_sensors(c, dice);
  choose_broken(c, dice);

  const double ratio = dice.decade(1.0 / 200.0, 0.5);
  c.learn.bandwidth = ratio * c.rate;
  c.watch.bandwidth = std::min(0.5, ratio * dice.decade(1.0, 4.0)) * c.rate;
  c.rows = std::max(static_cast<std::size_t>(dice.decade(800.0, 3000.0)), static_cast<std::size_t>(6.0 / ratio));
  const double omega = kTurn * c.learn.bandwidth;

  // How far the wheels swing, in errors of the sensor.
  const double swing = dice.decade(10.0, 1e4);
  double angle = 0.0;
  switch (c.sense) {
    case Sense::angle: {
      c.motion_bound = dice.decade(1e-5, 1e-2);
      angle = swing * c.motion_bound;
      break;
    }
    case Sense::encoder:
    case Sense::mean_speed:
      c.counts = std::round(dice.decade(64.0, 65536.0));
      c.motion_bound = std::numbers::pi / *c.counts;
      angle = swing * c.motion_bound;
      c.speed_source = dice.chance(0.5) ? model::SpeedSource::automatic : model::SpeedSource::encoder_difference;
      break;
    case Sense::speed:
      c.motion_bound = dice.decade(1e-4, 1e-1);
      angle = swing * c.motion_bound / omega;
      c.speed_source = dice.chance(0.5) ? model::SpeedSource::automatic : model::SpeedSource::measured;
      break;
    case Sense::whole_rpm:
      c.motion_bound = kTurn / 120.0 * (1.0 + 1e-12);
      angle = swing * c.motion_bound / omega;
      break;
  }
  reach_for(c.truth, angle, c.learn);
  if (c.truth.coulomb > 0.0 || dice.chance(0.25)) {
    c.truth.coulomb = dice.decade(0.02, 0.5) * c.learn.reach[0];
  }
  if (c.changes == Changes::between && c.broken != Broken::unlogged_commands) {
    // At most one change between two stamps, wherever they lie.
    const double longest = c.stamps == Stamps::jittered      ? 1.0 + c.jitter
                           : c.stamps == Stamps::two_three   ? 1.2
                           : c.stamps == Stamps::tenth_twice ? 2.0 / 1.1
                                                             : 1.0;
    c.controller_rate = c.rate / longest / dice.decade(1.01, 6.0);
  }
  choose_order(c, dice, angle, c.learn);
  choose_order(c, dice, angle * dice.uniform(1.0, 3.0) * c.learn.bandwidth / c.watch.bandwidth, c.watch);
  c.effort_bound = dice.decade(1e-3, 0.1) * c.learn.reach[0];
  const auto turns = [](Noise n) { return n == Noise::against_heavy || n == Noise::against_light; };
  if (turns(c.noise) || turns(c.noise_watch) || dice.chance(0.3)) {
    c.beta = std::min(omega * dice.uniform(0.3, 2.0), 0.5 * c.rate);
  }
  // Late logs keep to what is said of efforts only where every command is in force at the (shifted) time of some row,
  // and no kink lies between two of them.
  const bool shown = c.changes == Changes::at_samples ? c.stamps == Stamps::even : c.changes != Changes::linear;
  if (c.broken == Broken::none && dice.chance(0.1) && shown) {
    c.delay = std::min(dice.decade(0.001, 0.02), 2.9 / c.rate);
    c.delay_declared = true;
  }
  c.declare_parameters = c.truth.coulomb > 0.0 || dice.chance(0.5);
  if (c.broken != Broken::beyond_prior && (!default_prior_holds(c.truth) || dice.chance(0.3))) {
    c.prior = dice.decade(3.0, 30.0);
  }
  return c;
}

const char* name(Breakdown::Kind x) {
  static constexpr const char* kNames[] = {"effort_loss", "effort_bias", "encoder_scale"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Stamps x) {
  static constexpr const char* kNames[] = {"even", "jittered", "two_three", "tenth_twice"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Sense x) {
  static constexpr const char* kNames[] = {"angle", "encoder", "mean_speed", "speed", "whole_rpm"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Noise x) {
  static constexpr const char* kNames[] = {"uniform", "two_point",     "plus",         "minus",
                                           "clipped", "against_heavy", "against_light"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Changes x) {
  static constexpr const char* kNames[] = {"at_samples", "between", "linear", "smooth"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Broken x) {
  static constexpr const char* kNames[] = {
      "none",           "late_efforts",    "backward_speeds",   "stamps_off",     "hold_wrong",  "torque_late",
      "clipped_effort", "hidden_friction", "unlogged_commands", "wrapped_angles", "beyond_prior"};
  return kNames[static_cast<std::size_t>(x)];
}
const char* name(Motion x) {
  static constexpr const char* kNames[] = {"multisine",    "chirp",      "staircase",
                                           "random_steps", "speed_loop", "saturated"};
  return kNames[static_cast<std::size_t>(x)];
}

}  // namespace wheelwright::guarantee
