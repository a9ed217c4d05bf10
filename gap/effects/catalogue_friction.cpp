// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "gap/effects/effect.hpp"

namespace wheelwright::gap {
namespace {

using namespace catalogue;
using Signal = Eigen::VectorXd;
using Shape = std::span<const double>;

constexpr double kSecond = 1.0;  // s, of typical speed: an angle

std::vector<Signal> speed_signs(const Drive& drive) {
  return each_joint(drive, [&drive](std::size_t j) { return speed_sign(drive, j); });
}

Effect coulomb() {
  return {.name = "coulomb",
          .sentence = "Dry friction at every joint: a torque of constant size against the motion.",
          .family = "dry_friction",
          .parameters = {{"c", "N·m", 1}},
          .excite = "reverse often, turn on the spot, drive at several speeds",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = [](const Drive& drive) { return needs_no(drive, "coulomb"); },
          .columns = [](const Drive& drive, Shape) { return std::vector{at_joints(drive, speed_signs(drive))}; }};
}

// Bristles that bend before they slide, over an angle δ: ż = ω (1 − z sgn ω), z of δ (Dahl 1968; LuGre without its
// fading). What the sign does at once takes them a turn of 2δ.
Signal bent_bristles(const Drive& drive, const Signal& speed, double bending) {
  Signal z = Signal::Zero(speed.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 1; k < last; ++k) {
      const double turn = 0.5 * (speed[k - 1] + speed[k]) * drive.step / bending;
      const double towards = turn > 0.0 ? 1.0 : -1.0;
      z[k] = towards + (z[k - 1] - towards) * std::exp(-std::abs(turn));
    }
  }
  return z;
}

ShapeParameter bending() {
  return {.name = "bending",
          .unit = "rad",
          .lower = 0.002,
          .upper = 0.3,
          .scan = 6,
          .logarithmic = true,
          .scale = [](const Drive& drive) { return typical_speed(drive) * kSecond; }};
}

Effect coulomb_of_bristles() {
  return {.name = "coulomb",
          .sentence = "Dry friction at every joint, whose contacts bend a little before they slide.",
          .family = "dry_friction",
          .parameters = {{"c", "N·m", 1}},
          .shapes = {bending()},
          .excite = "reverse often, turn on the spot, drive at several speeds",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = [](const Drive& drive) { return needs_no(drive, "coulomb"); },
          .columns =
              [](const Drive& drive, Shape shape) {
                return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) {
                                               return bent_bristles(drive, drive.joints[j].smooth_speed, shape[0]);
                                             }))};
              }};
}

// A smoothed sign, wider than that of coulomb().
Effect coulomb_smoothed() {
  return {.name = "coulomb",
          .sentence = "Dry friction at every joint that grows to its full size within a small speed.",
          .family = "dry_friction",
          .parameters = {{"c", "N·m", 1}},
          .shapes = {{.name = "width",
                      .unit = "rad/s",
                      .lower = 0.03,
                      .upper = 0.3,
                      .scan = 3,
                      .logarithmic = true,
                      .scale = typical_speed}},
          .excite = "reverse often, turn on the spot, drive at several speeds",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = [](const Drive& drive) { return needs_no(drive, "coulomb"); },
          .columns =
              [](const Drive& drive, Shape shape) {
                return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) {
                                               return soft_sign(drive.joints[j].smooth_speed, shape[0]);
                                             }))};
              }};
}

Effect coulomb_asymmetric() {
  return {.name = "coulomb_asymmetric",
          .sentence = "Dry friction that differs between the wheels.",
          .parameters = {{"c_R", "N·m", 1}, {"c_L", "N·m", 1}},
          .excite = "reverse each wheel often",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            return std::vector{at_joints(drive, only(drive, 0, speed_sign(drive, 0))),
                               at_joints(drive, only(drive, 1, speed_sign(drive, 1)))};
          }};
}

Effect coulomb_asymmetric_of_bristles() {
  Effect effect = coulomb_asymmetric();
  effect.sentence = "Dry friction that differs between the wheels, whose contacts bend a little before they slide.";
  effect.shapes = {bending()};
  effect.columns = [](const Drive& drive, Shape shape) {
    std::vector<Column> columns;
    for (std::size_t j = 0; j < 2; ++j) {
      columns.push_back(at_joints(drive, only(drive, j, bent_bristles(drive, drive.joints[j].smooth_speed, shape[0]))));
    }
    return columns;
  };
  return effect;
}

Effect stribeck() {
  return {.name = "stribeck",
          .sentence = "Dry friction that fades as the joint gets faster (Stribeck).",
          .parameters = {{"c_s", "N·m", 1}},
          .shapes = {{.name = "omega_s",
                      .unit = "rad/s",
                      .lower = 0.05,
                      .upper = 1.0,
                      .scan = 6,
                      .logarithmic = true,
                      .scale = typical_speed}},
          .excite = "creep, and reverse slowly",
          .measured_by = DirectMeasurement::lifted_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const auto w = drive.joints[j].smooth_speed.array() / shape[0];
                                           return (-w.square()).exp() * speed_sign(drive, j).array();
                                         }))};
          }};
}

Effect viscous(std::size_t joints) {
  Effect effect{.name = "viscous",
                .noun = "viscous friction other than designed",
                .sentence = "Viscous friction other than in the base model.",
                .parametric = true,
                .parameters = {{"viscous_linear", "N·s/m", 0}, {"viscous_yaw", "N·m·s/rad", 0}},
                .excite = "drive at different steady speeds, straight and turning",
                .measured_by = DirectMeasurement::lifted_wheels};
  if (joints == 1) {
    effect.parameters = {{"viscous", "N·s/m or N·m·s/rad", 0}};
    effect.columns = [](const Drive& drive, Shape) { return std::vector{base_column(drive, "viscous")}; };
    return effect;
  }
  effect.applies = needs_two_wheels;
  effect.columns = [](const Drive& drive, Shape) {
    return std::vector{base_column(drive, "viscous_linear"), base_column(drive, "viscous_yaw")};
  };
  return effect;
}

Effect viscous_asymmetric() {
  return {.name = "viscous_asymmetric",
          .sentence = "More viscous friction at one wheel than at the other.",
          .common = "viscous",
          .as_built = true,
          .parameters = {{"damping", "N·m·s/rad", 0}},
          .shapes = {side_or_opposite()},
          .excite = "drive straight at different steady speeds, with the pose logged",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns =
              [](const Drive& drive, Shape shape) {
                return std::vector{
                    at_joints(drive, on_side(shape[0], drive.joints[0].smooth_speed, drive.joints[1].smooth_speed))};
              },
          .physical =
              [](std::span<const double> c, Shape shape) {
                return std::vector<PhysicalValue>{{"b", "N·m·s/rad",
                                                   shape[0] > 1.5   ? 2.0 * c[0]
                                                   : shape[0] < 0.5 ? c[0]
                                                                    : -c[0]}};
              }};
}

// Viscous friction of any bend: Σ b_k g_k(ω) with b_k >= 0 and increasing g_k, ω; ω/(1 + |ω|/ω_k) at two speeds, of
// which mixtures make every friction whose slope falls with the speed as a power does, or slower (Stieltjes functions);
// ω|ω| and ω³ for a slope that grows. None of them is as steep about 0 as dry friction. The speeds are given, not
// looked for: those of the drive on which the shape was chosen. The linear ω is the measured one, as in the base model,
// so that θ fitted again takes it all.
std::vector<Signal> bent_signals(const Drive& drive, std::size_t joint, double bend) {
  constexpr std::array kSpeeds{0.4, 1.5};  // of the bend
  const Eigen::ArrayXd w = drive.joints[joint].smooth_speed.array() / bend;
  std::vector<Signal> signals{drive.joints[joint].speed / bend};
  for (const double speed : kSpeeds) {
    signals.emplace_back(w / (1.0 + w.abs() / speed));
  }
  signals.emplace_back(w * w.abs());
  signals.emplace_back(w.cube());
  return signals;
}

ShapeParameter bend() {
  return {
      .name = "bend", .unit = "rad/s", .lower = 1.0, .upper = 1.0, .scan = 1, .discrete = true, .scale = typical_speed};
}

std::vector<EffectParameter> bent_parameters() {
  return {{"linear", "N·m", 1},
          {"early_bend", "N·m", 1},
          {"late_bend", "N·m", 1},
          {"square", "N·m", 1},
          {"cubic", "N·m", 1}};
}

Effect viscous_bent() {
  return {.name = "viscous",
          .sentence = "Viscous friction whose slope changes with the speed.",
          .parameters = bent_parameters(),
          .shapes = {bend()},
          .free_form = true,
          .excite = "drive at different steady speeds, straight and turning",
          .measured_by = DirectMeasurement::lifted_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            std::vector<Column> columns(bent_parameters().size());
            for (std::size_t j = 0; j < drive.joints.size(); ++j) {
              const std::vector<Signal> signals = bent_signals(drive, j, shape[0]);
              for (std::size_t k = 0; k < columns.size(); ++k) {
                add(columns[k], at_joints(drive, only(drive, j, signals[k])));
              }
            }
            return columns;
          }};
}

Effect viscous_bent_on_one_side() {
  return {.name = "viscous_asymmetric",
          .sentence = "More viscous friction at one wheel than at the other, whose slope changes with the speed.",
          .common = "viscous",
          .parameters = bent_parameters(),
          .shapes = {side(), bend()},
          .free_form = true,
          .excite = "drive straight at different steady speeds, with the pose logged",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const std::size_t j = shape[0] < 0.5 ? 0 : 1;
            std::vector<Column> columns;
            for (const Signal& signal : bent_signals(drive, j, shape[1])) {
              columns.push_back(at_joints(drive, only(drive, j, signal)));
            }
            return columns;
          }};
}

Effect quadratic_drag(std::size_t joints) {
  Effect effect{.name = "quadratic_drag",
                .sentence = "Drag that grows with the square of the speed.",
                .parameters = {{"c", "N·s²/m", 1}},
                .excite = "drive from slow to as fast as it goes, straight and turning",
                .measured_by = DirectMeasurement::lifted_wheels};
  if (joints == 1) {
    effect.columns = [](const Drive& drive, Shape) {
      const auto v = drive.joints[0].smooth_speed.array();
      return std::vector{at_joints(drive, {Signal(v * v.abs())})};
    };
    return effect;
  }
  effect.parameters.push_back({"c2", "N·m²·s²/rad²", 1});
  effect.applies = needs_two_wheels;
  effect.columns = [](const Drive& drive, Shape) {
    const auto v1 = drive.coordinates[0].smooth_speed.array();
    const auto v2 = drive.coordinates[1].smooth_speed.array();
    Column along, about;
    along.effort = {v1 * v1.abs(), {}};
    about.effort = {{}, v2 * v2.abs()};
    return std::vector{along, about};
  };
  return effect;
}

// Drag that grows faster than in proportion to the body's speed, in any way: Σ c_k v|v|^p with c_k >= 0.
Effect drag_of_any_growth() {
  static constexpr std::array<double, 3> kPowers{0.5, 1.0, 2.0};
  return {.name = "quadratic_drag",
          .sentence = "Drag that grows faster than the speed.",
          .parameters = {{"c_early", "N·(s/m)^1.5", 1},
                         {"c_square", "N·s²/m²", 1},
                         {"c_cube", "N·s³/m³", 1},
                         {"c2_square", "N·m²·s²/rad²", 1}},
          .free_form = true,
          .excite = "drive from slow to as fast as it goes, straight and turning",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            const auto v1 = drive.coordinates[0].smooth_speed.array();
            const auto v2 = drive.coordinates[1].smooth_speed.array();
            std::vector<Column> columns(kPowers.size() + 1);
            for (std::size_t k = 0; k < kPowers.size(); ++k) {
              columns[k].effort = {Signal(v1 * v1.abs().pow(kPowers[k])), {}};
            }
            columns.back().effort = {{}, v2 * v2.abs()};
            return columns;
          }};
}

// Oil that gears churn in: of each wheel by itself.
Effect drag_of_wheels() {
  return {.name = "quadratic_drag",
          .sentence = "Drag at each wheel that grows with the square of its speed.",
          .parameters = {{"c_wheel", "N·m·s²/rad²", 1}},
          .free_form = true,
          .excite = "drive from slow to as fast as it goes, straight and turning",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const auto w = drive.joints[j].smooth_speed.array();
                                           return w * w.abs();
                                         }))};
          }};
}

Applicability needs_signed_efforts(const Drive& drive) {
  return drive.efforts_unsigned ? Applicability{false,
                                                "the log has the size of the efforts only, so that this friction would "
                                                "be all of them"}
                                : Applicability{};
}

Effect load_friction() {
  return {.name = "load_friction",
          .sentence = "Friction in proportion to the torque that is passed on, as in a worm or harmonic drive.",
          .parameters = {{"k", "1", 1}},
          .after_reversals = true,
          .excite = "accelerate and brake hard, and drive at constant speed",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_signed_efforts,
          .columns = [](const Drive& drive, Shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           return drive.joints[j].smooth_effort.array().abs() *
                                                  speed_sign(drive, j).array();
                                         }))};
          }};
}

// Friction that grows with the load in any way, from nothing: Σ c_k g_k(u) with c_k >= 0, u the load over a typical
// one, g = u/(1 + 2u) for what grows early, u, and what lies above two loads for what grows late; and u where the wheel
// drives the motor, which gears lose more of.
Effect load_friction_of_any_growth() {
  return {.name = "load_friction",
          .sentence = "Friction that grows with the torque that is passed on.",
          .parameters = {{"early", "N·m", 1},
                         {"even", "N·m", 1},
                         {"late", "N·m", 1},
                         {"latest", "N·m", 1},
                         {"driven_back", "N·m", 1}},
          .shapes = {{.name = "load",
                      .unit = "N·m",
                      .lower = 1.0,
                      .upper = 1.0,
                      .scan = 1,
                      .discrete = true,
                      .scale = typical_effort}},
          .after_reversals = true,
          .free_form = true,
          .excite = "accelerate and brake hard, and drive at constant speed",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_signed_efforts,
          .columns = [](const Drive& drive, Shape shape) {
            constexpr std::array kAbove{0.5, 1.0};
            std::vector<std::vector<Signal>> efforts(3 + kAbove.size());
            for (std::size_t j = 0; j < drive.joints.size(); ++j) {
              const Eigen::ArrayXd u = drive.joints[j].smooth_effort.array().abs() / shape[0];
              const Eigen::ArrayXd sign = speed_sign(drive, j).array();
              efforts[0].emplace_back(sign * u / (1.0 + 2.0 * u));
              efforts[1].emplace_back(sign * u);
              for (std::size_t k = 0; k < kAbove.size(); ++k) {
                efforts[2 + k].emplace_back(sign * (u - kAbove[k]).max(0.0));
              }
              const Eigen::ArrayXd back = -sign * drive.joints[j].smooth_effort.array() / shape[0];
              efforts.back().emplace_back(sign * back.max(0.0));
            }
            std::vector<Column> columns;
            for (const std::vector<Signal>& effort : efforts) {
              columns.push_back(at_joints(drive, effort));
            }
            return columns;
          }};
}

// The load as it was a moment ago: what presses the parts together follows it with a lag.
Effect load_friction_that_lags() {
  return {.name = "load_friction",
          .sentence = "Friction in proportion to the torque that was passed on a moment ago.",
          .parameters = {{"k", "1", 1}},
          .shapes = {{.name = "lag", .unit = "s", .lower = 0.04, .upper = 0.5, .scan = 4, .logarithmic = true}},
          .after_reversals = true,
          .free_form = true,
          .excite = "accelerate and brake hard, and drive at constant speed",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_signed_efforts,
          .columns = [](const Drive& drive, Shape shape) {
            return std::vector{at_joints(drive, each_joint(drive, [&](std::size_t j) -> Signal {
                                           const Signal load = drive.joints[j].smooth_effort.cwiseAbs();
                                           return lagged(drive, load, shape[0]).cwiseProduct(speed_sign(drive, j));
                                         }))};
          }};
}

Effect friction_drift() {
  return {.name = "friction_drift",
          .sentence = "Friction, viscous and dry, that changes as the drive warms up.",
          .steady = {"coulomb", "viscous"},
          .common = "viscous",
          .parameters = {{"loss", "N·m·s/rad", 0}, {"loss_dry", "N·m", 0}},
          .shapes = {{.name = "T", .unit = "s", .lower = 10.0, .upper = 200.0, .scan = 8, .logarithmic = true}},
          .excite = "drive for several minutes from cold, the same manoeuvre again and again",
          .columns = [](const Drive& drive, Shape shape) {
            const Signal warmth = 1.0 - (-(drive.t.array() - drive.t[0]) / shape[0]).exp();
            const auto lost = [&](auto friction) {
              return at_joints(
                  drive, each_joint(drive, [&](std::size_t j) -> Signal { return -warmth.cwiseProduct(friction(j)); }));
            };
            return std::vector{lost([&](std::size_t j) { return drive.joints[j].smooth_speed; }),
                               lost([&](std::size_t j) { return speed_sign(drive, j); })};
          }};
}

// A castor at the distance p from the axle's middle slides with V² = v1² + p² v2².
Effect caster_drag() {
  return {.name = "caster_drag",
          .sentence = "A castor or skid that drags: a force of constant size against the motion of its contact.",
          .parameters = {{"c", "N·m", 1}},
          .shapes = {{.name = "p",
                      .unit = "m",
                      .lower = 0.1,
                      .upper = 2.0,
                      .scan = 6,
                      .logarithmic = true,
                      .scale = [](const Drive& drive) { return drive.track_width; }},
                     {.name = "softness",
                      .unit = "m/s",
                      .lower = 0.004,
                      .upper = 0.1,
                      .scan = 3,
                      .logarithmic = true,
                      .scale = [](const Drive& drive) { return drive.wheel_radius * typical_speed(drive); }}},
          .excite = "mix straight driving and turning in all ratios",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const double p = shape[0];
            const auto v1 = drive.coordinates[0].smooth_speed.array();
            const auto v2 = drive.coordinates[1].smooth_speed.array();
            const Eigen::ArrayXd v = (v1.square() + (p * v2).square() + shape[1] * shape[1]).sqrt();
            Column column;
            column.effort = {v1 / v, p * p * v2 / v};
            return std::vector{column};
          }};
}

Effect lateral_scrub() {
  return {.name = "lateral_scrub",
          .sentence = "Tyres that scrub when the robot turns: a yaw moment of constant size against the turn.",
          .parameters = {{"mu", "N·m²", 1}},
          .shapes = {{.name = "softness",
                      .unit = "rad/s",
                      .lower = 0.004,
                      .upper = 0.4,
                      .scan = 6,
                      .logarithmic = true,
                      .scale =
                          [](const Drive& drive) {
                            return std::max(deviation(drive.coordinates[1].smooth_speed), 1e-12);
                          }}},
          .excite = "turn on the spot and in curves, both ways",
          .measured_by = DirectMeasurement::lifted_wheels,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            Column column;
            column.effort = {{}, soft_sign(drive.coordinates[1].smooth_speed, shape[0])};
            return std::vector{column};
          }};
}

// Tyres that bend before they slide, by the angle turned.
Effect scrub_of_bristles() {
  Effect effect = lateral_scrub();
  effect.sentence = "Tyres that bend and then scrub when the robot turns.";
  effect.free_form = true;
  effect.shapes = {{.name = "bending",
                    .unit = "rad",
                    .lower = 0.003,
                    .upper = 0.3,
                    .scan = 4,
                    .logarithmic = true,
                    .scale = [](const Drive& drive) {
                      return std::max(deviation(drive.coordinates[1].smooth_speed), 1e-12) * kSecond;
                    }}};
  effect.columns = [](const Drive& drive, Shape shape) {
    Column column;
    column.effort = {{}, bent_bristles(drive, drive.coordinates[1].smooth_speed, shape[0])};
    return std::vector{column};
  };
  return effect;
}

}  // namespace

std::vector<Effect> friction_effects(std::size_t joints) {
  std::vector<Effect> effects{coulomb(),
                              stribeck(),
                              viscous(joints),
                              quadratic_drag(joints),
                              load_friction(),
                              friction_drift(),
                              coulomb_of_bristles(),
                              coulomb_smoothed(),
                              viscous_bent(),
                              load_friction_of_any_growth(),
                              load_friction_that_lags()};
  if (joints == 2) {
    for (auto* make :
         {&coulomb_asymmetric, &viscous_asymmetric, &caster_drag, &lateral_scrub, &viscous_bent_on_one_side,
          &drag_of_any_growth, &drag_of_wheels, &coulomb_asymmetric_of_bristles, &scrub_of_bristles}) {
      effects.push_back(make());
    }
  }
  return effects;
}

}  // namespace wheelwright::gap
