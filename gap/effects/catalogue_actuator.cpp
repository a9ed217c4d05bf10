// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "gap/effects/effect.hpp"

namespace wheelwright::gap {
namespace {

using namespace catalogue;
using Signal = Eigen::VectorXd;
using Shape = std::span<const double>;

// u(t − delay), linear between instants, held at a segment's ends.
Signal shifted(const Drive& drive, const Signal& u, double delay) {
  Signal y(u.size());
  const double steps = delay / drive.step;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first; k < last; ++k) {
      const double at = std::clamp(static_cast<double>(k - first) - steps, 0.0, static_cast<double>(last - 1 - first));
      const auto before = std::min(first + static_cast<Eigen::Index>(at), last - 2);
      const double share = at - static_cast<double>(before - first);
      y[k] = u[before] + share * (u[before + 1] - u[before]);
    }
  }
  return y;
}

ShapeParameter duration(const char* name) {
  return {.name = name, .unit = "s", .lower = 0.004, .upper = 0.25, .scan = 40, .logarithmic = true, .resolution = 0.1};
}

std::vector<PhysicalValue> gain_of_excess(std::span<const double> c, Shape) {
  return {{"gain", "1", 1.0 / (1.0 + c[0])}};
}

Effect actuator_lag() {
  return {.name = "actuator_lag",
          .sentence = "The actuator follows its command with a first-order lag.",
          .family = "late_torque",
          .shapes = {duration("T")},
          .unit_coefficient = true,
          .excite = "change the torque fast: steps and high frequencies",
          .measured_by = DirectMeasurement::timing,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const Signal& u = drive.joints[j].effort;
                                           return u - lagged(drive, u, shape[0]);
                                         }))};
          }};
}

// What is taken of an effort is taken at its peaks or edges only: more would be none of the robot's but a way to be rid
// of the signal.
bool leaves_most(const Signal& taken, const Signal& effort) {
  constexpr double kMostSquare = 0.4;
  return taken.squaredNorm() <= kMostSquare * effort.squaredNorm();
}

Effect limited_rate() {
  return {.name = "actuator_lag",
          .sentence = "The actuator's torque follows its command no faster than at a largest rate.",
          .family = "late_torque",
          .shapes = {{.name = "largest_rate",
                      .unit = "N·m/s",
                      .lower = 1.5,
                      .upper = 40.0,
                      .scan = 10,
                      .logarithmic = true,
                      .scale = typical_effort}},
          .unit_coefficient = true,
          .free_form = true,
          .excite = "change the torque fast: steps and high frequencies",
          .measured_by = DirectMeasurement::timing,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const Signal& u = drive.joints[j].effort;
                                           const Signal taken = u - followed(drive, u, shape[0]);
                                           return leaves_most(taken, u) ? taken : Signal::Zero(u.size());
                                         }))};
          }};
}

Effect delay() {
  return {.name = "delay",
          .sentence = "The torque arrives later than it was commanded.",
          .family = "late_torque",
          .shapes = {duration("T_d")},
          .unit_coefficient = true,
          .excite = "change the torque fast: steps and high frequencies",
          .measured_by = DirectMeasurement::timing,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const Signal& u = drive.joints[j].effort;
                                           return u - shifted(drive, u, shape[0]);
                                         }))};
          }};
}

Effect sensor_time_offset() {
  ShapeParameter late = duration("dt");
  late.both_signs = true;
  return {.name = "sensor_time_offset",
          .sentence = "The speeds' time stamps are late (or early) against torque and pose.",
          .family = "late_torque",
          .shapes = {late},
          .unit_coefficient = true,
          .excite = "change speed and torque fast, with the pose logged",
          .measured_by = DirectMeasurement::timing,
          .columns = [](const Drive& drive, Shape shape) {
            Column column = at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                        const Signal& u = drive.joints[j].effort;
                                        return u - shifted(drive, u, shape[0]);
                                      }));
            if (drive.two_wheels()) {
              const Signal& v1 = drive.coordinates[0].smooth_speed;
              const Signal& v2 = drive.coordinates[1].smooth_speed;
              column.forward = shifted(drive, v1, -shape[0]) - v1;
              column.yaw = shifted(drive, v2, -shape[0]) - v2;
            }
            return std::vector{column};
          }};
}

Effect torque_gain() {
  return {.name = "torque_gain",
          .noun = "a torque constant other than designed",
          .sentence = "The actuators' torque constant is not as designed: all of the commands are too large or small.",
          .parametric = true,
          .parameters = {{"command_excess", "1", 0}},
          .excite = "drive a known load",
          .measured_by = DirectMeasurement::pull,
          .columns =
              [](const Drive& drive, Shape) {
                return std::vector{at_joints(
                    drive, each_joint(drive, [&](std::size_t j) { return drive.joints[j].predicted_effort; }))};
              },
          .physical = gain_of_excess};
}

Effect torque_gain_asymmetric() {
  return {.name = "torque_gain_asymmetric",
          .sentence = "One actuator gives more or less torque than it is told.",
          .common = "torque_gain",
          .parameters = {{"command_excess", "1", 0}},
          .shapes = {side_or_opposite()},
          .excite = "accelerate and brake on a straight line, with the pose logged",
          .measured_by = DirectMeasurement::pull,
          .applies = needs_two_wheels,
          .columns =
              [](const Drive& drive, Shape shape) {
                return std::vector{at_joints(
                    drive, on_side(shape[0], drive.joints[0].predicted_effort, drive.joints[1].predicted_effort))};
              },
          .physical =
              [](std::span<const double> c, Shape shape) {
                return std::vector<PhysicalValue>{
                    {"g", "1", shape[0] > 1.5 ? -c[0] : (shape[0] < 0.5 ? -1.0 : 1.0) * c[0] / (2.0 + c[0])},
                    {"gain", "1", 1.0 / (1.0 + c[0])}};
              }};
}

Effect torque_bias(std::size_t joints) {
  Effect effect{.name = "torque_bias",
                .sentence = "A constant torque: the offset of a sensor or an amplifier.",
                .parameters = {{"b", "N·m", 0}},
                .excite = "drive in all directions, forwards and backwards",
                .measured_by = DirectMeasurement::turned_round,
                .applies = [](const Drive& drive) { return needs_no(drive, "offset"); }};
  if (joints == 2) {
    effect.parameters = {{"b_R", "N·m", 0}, {"b_L", "N·m", 0}};
  }
  effect.columns = [](const Drive& drive, Shape) {
    std::vector<Column> columns;
    for (std::size_t j = 0; j < drive.joints.size(); ++j) {
      columns.push_back(at_joints(drive, only(drive, j, Signal::Ones(drive.rows()))));
    }
    return columns;
  };
  return effect;
}

// τ less what passes, b clip(τ/b), as b tanh(τ/edge): linear in b. With a wide edge the column would be the commanded
// effort itself, which explains anything; so would a low limit of saturation() beside it.
Effect torque_deadzone() {
  return {.name = "torque_deadzone",
          .sentence = "The actuator answers only to what exceeds a dead zone.",
          .parameters = {{"b", "N·m", 1}},
          .shapes = {{.name = "edge",
                      .unit = "N·m",
                      .lower = 0.015,
                      .upper = 0.25,
                      .scan = 3,
                      .logarithmic = true,
                      .scale = typical_effort}},
          .after_reversals = true,
          .excite = "brake with the motors: torque against the motion",
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) {
                                           return soft_sign(drive.joints[j].smooth_effort, shape[0]);
                                         }))};
          }};
}

// What a limit takes from an effort. A limit shows at peaks: one that most of the drive lies above, or that takes most
// of the effort away, is none of the robot's but a way to be rid of the signal, and its column is nothing.
Signal beyond_limit(const Signal& effort, double limit) {
  constexpr double kMostSamples = 0.25;
  const Signal beyond = effort - effort.cwiseMax(-limit).cwiseMin(limit);
  const double samples = static_cast<double>((beyond.array() != 0.0).count());
  const bool peaks = samples <= kMostSamples * static_cast<double>(effort.size()) && leaves_most(beyond, effort);
  return peaks ? beyond : Signal::Zero(effort.size());
}

Applicability needs_commands(const Drive& drive) {
  return drive.efforts_flowed ? Applicability{false, "the efforts are currents that flowed, which no limit cut off"}
                              : Applicability{};
}

Effect saturation() {
  return {.name = "saturation",
          .sentence = "The actuator's torque is limited below what is commanded.",
          .shapes = {{.name = "tau_max",
                      .unit = "N·m",
                      .lower = 1.0,
                      .upper = 8.0,
                      .scan = 24,
                      .logarithmic = true,
                      .scale = typical_effort}},
          .unit_coefficient = true,
          .excite = "accelerate as hard as it goes",
          .applies = needs_commands,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           return beyond_limit(drive.joints[j].effort, shape[0]);
                                         }))};
          }};
}

// A limit that is neared little by little: τ of a command u is u/(1 + |u/τ_max|^p)^(1/p).
Effect soft_saturation() {
  return {.name = "saturation",
          .sentence = "The actuator's torque falls short of what is commanded, the more the larger it is.",
          .shapes = {{.name = "tau_max",
                      .unit = "N·m",
                      .lower = 1.5,
                      .upper = 12.0,
                      .scan = 8,
                      .logarithmic = true,
                      .scale = typical_effort},
                     {.name = "sharpness", .unit = "1", .lower = 1.5, .upper = 6.0, .scan = 3, .logarithmic = true}},
          .unit_coefficient = true,
          .free_form = true,
          .excite = "accelerate as hard as it goes",
          .applies = needs_commands,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const Signal& u = drive.joints[j].effort;
                                           const Eigen::ArrayXd part =
                                               (1.0 + (u.array().abs() / shape[0]).pow(shape[1])).pow(-1.0 / shape[1]);
                                           const Signal taken = u.array() * (1.0 - part);
                                           return leaves_most(taken, u) ? taken : Signal::Zero(u.size());
                                         }))};
          }};
}

// The inertia of a joint whose torque is all for acceleration.
double typical_inertia(const Drive& drive) {
  double effort = 0.0, acceleration = 1e-300;
  for (const JointSignals& joint : drive.joints) {
    effort += joint.smooth_effort.squaredNorm();
    acceleration += joint.smooth_acceleration.squaredNorm();
  }
  return std::max(std::sqrt(effort / acceleration), 1e-12);
}

// A rotor with play against its wheel: inertia J, play `gap`, and where they touch a spring and a damper that only
// push, of the rotor's own frequency ω and damping ratio ζ.
struct Play {
  double width = 0.0;  // J·gap
  double inertia = 0.0;
  double frequency = 0.0;
  double damping = 0.0;
};

// Momentum p = Jẋ that the rotor has against its wheel, Jx = q the angle it is ahead by:
//
//     ṗ = τ − Jω̇ − c,    q̇ = p,    c = ω²(q ∓ width/2) + 2ζω p beyond the play, where that pushes; else 0.
//
// c is what the wheel gets of τ less what the rotor's own inertia takes, so that ṗ is what it misses.
Signal rotor_momentum(const Drive& drive, const JointSignals& joint, const Play& play) {
  constexpr double kStepsToARadian = 3.0;
  constexpr int kFewest = 4;
  const int steps = std::max(kFewest, static_cast<int>(std::ceil(kStepsToARadian * play.frequency * drive.step)));
  const double h = drive.step / steps, half = 0.5 * play.width;
  const double stiffness = play.frequency * play.frequency, damping = 2.0 * play.damping * play.frequency;
  Signal momentum = Signal::Zero(joint.effort.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    double q = joint.effort[first] < 0.0 ? -half : half, p = 0.0;
    for (Eigen::Index k = first; k + 1 < last; ++k) {
      const double own = play.inertia * (joint.smooth_speed[k + 1] - joint.smooth_speed[k]) / drive.step;
      const double slope = (joint.effort[k + 1] - joint.effort[k]) / steps;
      for (int i = 0; i < steps; ++i) {
        const double beyond = q - std::clamp(q, -half, half);
        const double contact = beyond == 0.0 ? 0.0 : stiffness * beyond + damping * p;
        p += h * (joint.effort[k] + slope * (i + 0.5) - own - (contact * beyond > 0.0 ? contact : 0.0));
        q += h * p;
      }
      momentum[k + 1] = p;
    }
  }
  return momentum;
}

// The torque that the wheel misses is the rotor's own ṗ: none in the mean, a loss and then an impact.
Effect backlash() {
  return {
      .name = "backlash",
      .sentence = "Play in the gears: after a torque reversal the gap is crossed first.",
      .shapes = {{.name = "inertia_gap",
                  .unit = "kg·m²·rad",
                  .lower = 1e-5,
                  .upper = 2e-2,
                  .scan = 14,
                  .logarithmic = true,
                  .scale = typical_effort},
                 {.name = "inertia",
                  .unit = "kg·m²",
                  .lower = 0.003,
                  .upper = 0.5,
                  .scan = 3,
                  .logarithmic = true,
                  .scale = typical_inertia},
                 {.name = "contact_frequency",
                  .unit = "rad/s",
                  .lower = 60.0,
                  .upper = 500.0,
                  .scan = 2,
                  .logarithmic = true},
                 {.name = "contact_damping", .unit = "1", .lower = 0.15, .upper = 1.0, .scan = 2, .logarithmic = true}},
      .unit_coefficient = true,
      .inexact = 0.1,
      .after_reversals = true,
      .above_band = true,
      .excite = "reverse the torque often, gently and hard",
      .columns = [](const Drive& drive, Shape shape) {
        const Play play{shape[0], shape[1], shape[2], shape[3]};
        return std::vector{rate_at_joints(
            drive, each_joint(drive, [&](std::size_t j) { return rotor_momentum(drive, drive.joints[j], play); }))};
      }};
}

Effect battery_sag() {
  return {.name = "battery_sag",
          .sentence = "The torque falls short as the battery empties, and under load.",
          .parameters = {{"k", "1/s", 1}, {"R_b", "1/(N·m)", 1}},
          .excite = "drive for long, and with heavy loads now and then",
          .columns = [](const Drive& drive, Shape) {
            Signal load = Signal::Zero(drive.rows());
            for (const JointSignals& joint : drive.joints) {
              load += joint.smooth_effort.cwiseAbs();
            }
            const Signal time = drive.t.array() - drive.t[0];
            const auto times = [&drive](const Signal& factor) {
              return at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                 return factor.cwiseProduct(drive.joints[j].expected_effort);
                               }));
            };
            return std::vector{times(time), times(load)};
          }};
}

// Sag by what is drawn: at once, with a lag of some seconds (a second resistance beside a capacity), and by power.
Effect battery_sag_by_load() {
  return {.name = "battery_sag",
          .sentence = "The torque falls short as the battery empties, and by what was drawn just now.",
          .parameters = {{"k", "1/s", 1}, {"R_b", "1/(N·m)", 1}, {"R_slow", "1/(N·m)", 1}, {"by_power", "1/W", 1}},
          .free_form = true,
          .excite = "drive for long, and with heavy loads now and then",
          .columns = [](const Drive& drive, Shape) {
            constexpr double kSlow = 3.0;  // s
            Signal load = Signal::Zero(drive.rows()), power = load;
            for (const JointSignals& joint : drive.joints) {
              load += joint.smooth_effort.cwiseAbs();
              power += joint.smooth_effort.cwiseProduct(joint.smooth_speed);
            }
            std::vector<Column> columns;
            for (const Signal& drawn : {Signal(drive.t.array() - drive.t[0]), load, lagged(drive, load, kSlow),
                                        Signal(power.cwiseMax(0.0))}) {
              columns.push_back(at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                            return drawn.cwiseProduct(drive.joints[j].expected_effort);
                                          })));
            }
            return columns;
          }};
}

}  // namespace

std::vector<Effect> actuator_effects(std::size_t joints) {
  std::vector<Effect> effects{torque_bias(joints)};
  for (auto* make : {&actuator_lag, &delay, &sensor_time_offset, &torque_gain, &torque_deadzone, &saturation, &backlash,
                     &battery_sag, &limited_rate, &soft_saturation, &battery_sag_by_load}) {
    effects.push_back(make());
  }
  if (joints == 2) {
    effects.push_back(torque_gain_asymmetric());
  }
  return effects;
}

}  // namespace wheelwright::gap
