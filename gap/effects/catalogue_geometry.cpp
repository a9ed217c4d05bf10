// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "gap/effects/effect.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {
namespace {

using namespace catalogue;
using Signal = Eigen::VectorXd;
using Shape = std::span<const double>;

constexpr double kGravity = 9.80665;  // m/s²

// Slip goes by the load on each wheel too, which acceleration shifts and no log has: a share of its mean square.
constexpr double kLoadOfWheels = 0.05;

std::size_t chosen(Shape shape) { return shape[0] < 0.5 ? 0 : 1; }

Signal rim_speed(const Drive& drive, std::size_t joint) {
  return drive.wheel_radius * drive.joints[joint].smooth_speed;
}

// The rim of one wheel moves faster by `speed` than its joint shows.
Column unseen_rim_speed(const Drive& drive, std::size_t joint, const Signal& speed, double friction) {
  return joint == 0 ? unseen_rim_speeds(drive, speed, {}, friction) : unseen_rim_speeds(drive, {}, speed, friction);
}

// A wheel whose radius is larger by the share `growth` (a number, or one per instant): its rim is faster, and the same
// force on the ground takes more torque. Of the viscous friction the share `friction` is such a force; that in the
// joints stays as it is.
Column larger_wheel(const Drive& drive, std::size_t joint, const Signal& growth, double friction) {
  Column column = unseen_rim_speed(drive, joint, rim_speed(drive, joint).cwiseProduct(growth), friction);
  add(column, at_joints(drive, only(drive, joint, inertial_efforts(drive, friction)[joint].cwiseProduct(growth))));
  return column;
}

// The joints' own inertia is a part of the base model's that does not grow with a wheel.
EffectParameter armature_change() { return {"armature_change", "kg·m²", 0, true}; }

Effect com_longitudinal() {
  return {.name = "com_longitudinal",
          .sentence = "The centre of mass lies before or behind the axle.",
          .as_built = true,
          .parameters = {{"a", "m", 0}, {"inertia_change", "1", 0, true}},
          .excite = "drive fast curves of changing radius",
          .measured_by = DirectMeasurement::weight,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            const double rm = drive.wheel_radius * drive.physical("mass");
            const Signal& v1 = drive.coordinates[0].smooth_speed;
            const Signal& v2 = drive.coordinates[1].smooth_speed;
            Column offset, inertia;
            offset.effort = {-rm * v2.cwiseAbs2(), rm * v1.cwiseProduct(v2)};
            inertia.effort_rate = {{}, drive.wheel_radius * drive.physical("yaw_inertia") * drive.coordinates[1].speed};
            return std::vector{offset, inertia};
          }};
}

Effect com_lateral() {
  return {.name = "com_lateral",
          .sentence = "The centre of mass lies to the left or right of the middle.",
          .as_built = true,
          .parameters = {{"b", "m", 0}, {"inertia_change", "1", 0, true}},
          .excite = "accelerate and brake hard on a straight line",
          .measured_by = DirectMeasurement::weight,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            const double rm = drive.wheel_radius * drive.physical("mass");
            Column column;
            column.effort_rate = {-rm * drive.coordinates[1].speed, -rm * drive.coordinates[0].speed};
            Column inertia;
            inertia.effort_rate = {{}, drive.wheel_radius * drive.physical("yaw_inertia") * drive.coordinates[1].speed};
            return std::vector{column, inertia};
          }};
}

Effect slope() {
  return {.name = "slope",
          .sentence = "The ground slopes.",
          .parameters = {{"g_x", "m/s²", 0}, {"g_y", "m/s²", 0}},
          .excite = "drive slowly in all directions",
          .measured_by = DirectMeasurement::turned_round,
          .applies = needs_heading,
          .columns =
              [](const Drive& drive, Shape) {
                const double mass = drive.wheel_radius * drive.physical("mass");
                Column x, y;
                x.effort = {mass * drive.heading.array().cos().matrix(), {}};
                y.effort = {mass * drive.heading.array().sin().matrix(), {}};
                return std::vector{x, y};
              },
          .physical =
              [](std::span<const double> c, Shape) {
                // The model's mass holds 2J/r² of the wheels and rotors, on which no gravity acts: this share at most.
                constexpr double kMostOfWheels = 0.3;
                return std::vector<PhysicalValue>{
                    {"g_x", "m/s²", c[0]},
                    {"g_y", "m/s²", c[1]},
                    {"angle_rad", "rad", std::asin(std::min(1.0, std::hypot(c[0], c[1]) / kGravity)),
                     kMostOfWheels / (1.0 - kMostOfWheels)},
                    {"uphill_heading_rad", "rad", std::atan2(c[1], c[0])}};
              }};
}

// Eccentricity e: the radius grows by e cos(φ + φ0), and the weight on the wheel, which is lifted, asks for torque
// alike.
Effect wheel_out_of_round() {
  return {.name = "wheel_out_of_round",
          .sentence = "Wheels that are eccentric or out of round.",
          .parameters = {{"A_R", "N·m", 0},
                         {"radius_cos_R", "m", 0, true},
                         {"B_R", "N·m", 0},
                         {"radius_sin_R", "m", 0, true},
                         {"A_L", "N·m", 0},
                         {"radius_cos_L", "m", 0, true},
                         {"B_L", "N·m", 0},
                         {"radius_sin_L", "m", 0, true}},
          .excite = "drive straight for many turns of the wheels at several speeds",
          .applies =
              [](const Drive& drive) {
                const bool known = drive.angles_measured || drive.segment_starts.size() == 1;
                return known ? needs_two_wheels(drive)
                             : Applicability{false, "the wheels' angles are lost between the log's segments"};
              },
          .columns =
              [](const Drive& drive, Shape) {
                std::vector<Column> columns;
                for (std::size_t j = 0; j < 2; ++j) {
                  const auto angle = drive.joints[j].angle.array();
                  for (const Signal& wave : {Signal(angle.cos()), Signal(angle.sin())}) {
                    columns.push_back(at_joints(drive, only(drive, j, wave)));
                    columns.push_back(larger_wheel(drive, j, wave / drive.wheel_radius, 0.0));
                  }
                }
                return columns;
              },
          .physical =
              [](std::span<const double> c, Shape) {
                return std::vector<PhysicalValue>{{"A_R", "N·m", c[0]},
                                                  {"B_R", "N·m", c[2]},
                                                  {"A_L", "N·m", c[4]},
                                                  {"B_L", "N·m", c[6]},
                                                  {"offset_R", "m", std::hypot(c[1], c[3])},
                                                  {"offset_L", "m", std::hypot(c[5], c[7])}};
              }};
}

// Flats, ovals and eccentric wheels of any form: further harmonics of the torque. More than four would take a motor's
// cogging for a wheel.
Effect wheel_by_harmonics() {
  constexpr int kHarmonics = 4;
  Effect effect = wheel_out_of_round();
  effect.sentence = "Wheels that are out of round: eccentric, oval, or with a flat.";
  effect.free_form = true;
  for (const char* side : {"R", "L"}) {
    for (int k = 2; k <= kHarmonics; ++k) {
      effect.parameters.push_back({fmt::format("A{}_{}", k, side), "N·m", 0});
      effect.parameters.push_back({fmt::format("B{}_{}", k, side), "N·m", 0});
    }
  }
  effect.columns = [first = effect.columns](const Drive& drive, Shape shape) {
    std::vector<Column> columns = first(drive, shape);
    for (std::size_t j = 0; j < 2; ++j) {
      const auto angle = drive.joints[j].angle.array();
      for (int k = 2; k <= kHarmonics; ++k) {
        columns.push_back(at_joints(drive, only(drive, j, (k * angle).cos())));
        columns.push_back(at_joints(drive, only(drive, j, (k * angle).sin())));
      }
    }
    return columns;
  };
  effect.physical = [first = effect.physical, names = effect.parameters](std::span<const double> c, Shape shape) {
    std::vector<PhysicalValue> values = first(c, shape);
    for (std::size_t k = 8; k < c.size(); ++k) {
      values.push_back({names[k].name, names[k].unit, c[k]});
    }
    return values;
  };
  return effect;
}

Effect wheel_radius() {
  return {.name = "wheel_radius",
          .sentence = "Both wheels are larger or smaller than designed.",
          .parametric = true,
          .parameters = {{"epsilon", "1", 0}, armature_change()},
          .shapes = {friction_on_body()},
          .excite = "drive straight with the pose logged",
          .measured_by = DirectMeasurement::lengths,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const Signal one = Signal::Ones(drive.rows());
            Column column = larger_wheel(drive, 0, one, shape[0]);
            add(column, larger_wheel(drive, 1, one, shape[0]));
            return std::vector{column, rate_at_joints(drive, {drive.joints[0].speed, drive.joints[1].speed})};
          }};
}

Effect wheel_radius_asymmetric() {
  return {.name = "wheel_radius_asymmetric",
          .sentence = "One wheel is larger or smaller than the other.",
          .family = "rolling_distance",
          .parameters = {{"epsilon", "1", 0}, armature_change()},
          .shapes = {side_or_opposite(), friction_on_body()},
          .excite = "drive straight with the pose logged",
          .measured_by = DirectMeasurement::lengths,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const Signal one = Signal::Ones(drive.rows());
            const std::vector<Signal> growth = on_side(shape[0], one, one);
            Column larger;
            for (std::size_t j = 0; j < growth.size(); ++j) {
              if (growth[j].size() > 0) {
                add(larger, larger_wheel(drive, j, growth[j], shape[1]));
              }
            }
            return std::vector{larger,
                               rate_at_joints(drive, on_side(shape[0], drive.joints[0].speed, drive.joints[1].speed))};
          }};
}

// The joint itself turns faster, and its friction and inertia with it: the base model at the true speeds is exact,
// wherever its friction and inertia are.
Effect encoder_scale() {
  return {.name = "encoder_scale",
          .sentence = "One wheel's encoder has another scale than the robot file says.",
          .family = "rolling_distance",
          .parametric = true,
          .parameters = {{"epsilon", "1", 0}},
          .shapes = {side()},
          .excite = "drive straight with the pose logged",
          .measured_by = DirectMeasurement::lengths,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const std::size_t j = chosen(shape);
            return std::vector{unseen_rim_speed(drive, j, rim_speed(drive, j), 1.0)};
          }};
}

// D grows to D(1 + ε): the robot turns slower by c = ε/(1 + ε), and the same yaw moment takes less torque by as much.
Effect track_width() {
  return {
      .name = "track_width",
      .sentence = "The wheels stand further apart or closer together than designed.",
      .parametric = true,
      .parameters = {{"narrowing", "1", 0}, {"inertia_change", "1", 0, true}},
      .shapes = {friction_on_body()},
      .excite = "turn on the spot, both ways, with the heading logged",
      .measured_by = DirectMeasurement::lengths,
      .applies = needs_two_wheels,
      .columns =
          [](const Drive& drive, Shape shape) {
            Column column = unseen_motion(drive, {{}, -drive.coordinates[1].smooth_speed}, shape[0]);
            const std::vector<Signal> effort = inertial_efforts(drive, shape[0]);
            Column lever;
            lever.effort = {{}, -drive.lever_arm * (effort[0] - effort[1])};
            add(column, lever);
            Column inertia;
            inertia.effort_rate = {{}, drive.wheel_radius * drive.physical("yaw_inertia") * drive.coordinates[1].speed};
            return std::vector{column, inertia};
          },
      .physical =
          [](std::span<const double> c, Shape) {
            return std::vector<PhysicalValue>{{"epsilon", "1", c[0] / (1.0 - c[0])}};
          }};
}

// What the robot turns for each radian that its wheels say: 1 unless the wheels slip or the track is a wrong one.
double turn_for_turn(const Drive& drive) {
  const Windows windows = make_windows(drive);
  const Increments gap = pose_gap(drive, windows);
  Column wheels;
  wheels.yaw = drive.coordinates[1].smooth_speed;
  const Signal turned = increments_of(drive, windows, wheels).yaw;
  const double square = turned.squaredNorm();
  return square > 0.0 && gap.yaw.size() == turned.size() ? 1.0 + gap.yaw.dot(turned) / square : 1.0;
}

// A track is known better than to a seventh; wheels that must slide sideways to turn at all lose more than that.
Applicability needs_sliding_wheels(const Drive& drive) {
  constexpr double kMost = 1.0 / 1.15;
  if (!drive.two_wheels()) {
    return needs_two_wheels(drive);
  }
  if (!drive.has_heading() && drive.gyro.size() == 0) {
    return {false, "the log has no heading"};
  }
  return turn_for_turn(drive) < kMost
             ? Applicability{}
             : Applicability{false,
                             "the robot turns as its wheels say, but for what the width of its track can explain"};
}

// Instantaneous centres of rotation outside the wheels' tracks: the robot turns slower by a share, as with a wider
// track. The moment that scrubbing takes is an effect of its own (lateral_scrub).
Effect turning_slip() {
  return {
      .name = "turning_slip",
      .noun = "slip in turns",
      .sentence =
          "The wheels slide when the robot turns, as those of a skid-steer robot do: it turns slower than they "
          "say. Wheels and pose alone do not tell this from a wider track: measure the track on a turntable or "
          "with a rule, or drive on other ground, where the slip is another and the track the same.",
      .parameters = {{"slip", "1", 1}, {"inertia_change", "1", 0, true}},
      .excite = "turn on the spot, both ways, with the heading logged, on two kinds of ground",
      .applies = needs_sliding_wheels,
      .columns =
          [](const Drive& drive, Shape) {
            Column inertia;
            inertia.effort_rate = {{}, drive.wheel_radius * drive.physical("yaw_inertia") * drive.coordinates[1].speed};
            return std::vector{unseen_motion(drive, {{}, -drive.coordinates[1].smooth_speed}, 0.0), inertia};
          },
      .physical =
          [](std::span<const double> c, Shape) {
            return std::vector<PhysicalValue>{{"slip", "1", c[0]},
                                              {std::string(kTrackInEffect), "1", 1.0 / (1.0 - c[0])}};
          }};
}

// The centre of rotation lies ahead of the axle and is dragged outwards in a curve; wheels that slide sideways pass on
// less of their speed.
Effect curve_slip() {
  return {.name = "curve_slip",
          .noun = "slip in fast curves",
          .sentence =
              "The robot slides in curves: its centre of rotation is ahead of or behind the wheels' axle, curves "
              "carry it outwards, and it runs slower in them than its wheels say.",
          .parameters = {{"ahead", "m", 0}, {"outwards", "s", 0}, {"slower", "s²", 1}},
          .excite = "drive curves at several speeds, with the pose logged",
          .applies =
              [](const Drive& drive) {
                return drive.has_pose() ? needs_sliding_wheels(drive) : Applicability{false, "the log has no pose"};
              },
          .columns =
              [](const Drive& drive, Shape) {
                const Signal& v1 = drive.coordinates[0].smooth_speed;
                const Signal& v2 = drive.coordinates[1].smooth_speed;
                Column ahead, outwards, slower;
                ahead.lateral = v2;
                outwards.lateral = -v1.cwiseProduct(v2);
                slower.forward = -v1.cwiseProduct(v2.cwiseAbs2());
                return std::vector{ahead, outwards, slower};
              }};
}

// The rim runs ahead of the ground by the share σ = σ_max tanh(F/(k σ_max)) of the ground's speed, F the force that the
// wheel passes on in the direction of its motion.
Effect longitudinal_slip() {
  return {.name = "longitudinal_slip",
          .sentence = "The wheels slip in proportion to the force they pass on, up to a largest share.",
          .shapes = {{.name = "stiffness",
                      .unit = "N",
                      .lower = 1.5,
                      .upper = 1500.0,
                      .scan = 12,
                      .logarithmic = true,
                      .scale = [](const Drive& drive) { return typical_effort(drive) / drive.wheel_radius; }},
                     {.name = "largest", .unit = "1", .lower = 0.05, .upper = 1.0, .scan = 3, .logarithmic = true}},
          .unit_coefficient = true,
          .excite = "accelerate and brake as hard as it goes, with the pose logged",
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape shape) {
            const auto lost = [&](std::size_t j) -> Signal {
              const Signal rim = rim_speed(drive, j);
              const auto force = drive.joints[j].smooth_effort.array() / drive.wheel_radius;
              const Signal share = shape[1] * (rim.array().sign() * force / (shape[0] * shape[1])).tanh();
              return -rim.array() * share.array() / (1.0 + share.array());
            };
            return std::vector{unseen_rim_speeds(drive, lost(0), lost(1), 0.0)};
          }};
}

// Slip by the force that is passed on, as any increasing function of it: polygons with knots at quantiles of the force.
// A rubber tyre loses a share of its speed, a contact with a viscous creep a speed.
Effect slip_by_force(bool share) {
  constexpr std::array<double, 4> kKnots{0.0, 0.6, 0.9, 0.98};  // quantiles
  Effect effect{.name = "longitudinal_slip",
                .sentence = share ? "The wheels lose a share of their speed that grows with the force they pass on."
                                  : "The wheels slide at a speed that grows with the force they pass on.",
                .inexact = kLoadOfWheels,
                .free_form = true,
                .excite = "accelerate and brake as hard as it goes, with the pose logged",
                .applies = needs_heading};
  effect.shapes = {
      {.name = "force_total0_inertial1", .unit = "1", .lower = 0.0, .upper = 1.0, .scan = 2, .discrete = true}};
  for (const char* name : {"slip_1", "slip_2", "slip_3", "slip_4"}) {
    effect.parameters.push_back({name, share ? "1/N" : "m/(s·N)", 1});
  }
  effect.columns = [share, kKnots](const Drive& drive, Shape shape) {
    std::vector<Signal> forces = shape[0] > 0.5
                                     ? inertial_efforts(drive)
                                     : each_joint(drive, [&](std::size_t j) { return drive.joints[j].smooth_effort; });
    std::vector<double> sizes;
    for (Signal& force : forces) {
      force /= drive.wheel_radius;
      for (const double value : force) {
        sizes.push_back(std::abs(value));
      }
    }
    std::ranges::sort(sizes);
    std::vector<double> knots;
    for (const double quantile : kKnots) {
      knots.push_back(quantile > 0.0 ? sizes[static_cast<std::size_t>(quantile * static_cast<double>(sizes.size()))]
                                     : 0.0);
    }
    knots.push_back(std::max(sizes.back(), knots.back()));
    std::vector<Column> columns;
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      const auto lost = [&](std::size_t j) -> Signal {
        const auto force = forces[j].array();
        const Eigen::ArrayXd part = force.abs().min(knots[k + 1]).max(knots[k]) - knots[k];
        const Eigen::ArrayXd slip = -force.sign() * part;
        return share ? Signal(slip * rim_speed(drive, j).array().abs()) : Signal(slip);
      };
      columns.push_back(unseen_rim_speeds(drive, lost(0), lost(1), 0.0));
    }
    return columns;
  };
  return effect;
}

// A wheel whose contact passes on no more than its friction: the ground's speed follows the rim's, but never faster
// than the largest acceleration allows.
Effect slip_at_the_limit() {
  return {.name = "longitudinal_slip",
          .sentence = "The wheels spin or slide where they should pass on more force than the ground takes.",
          .parameters = {{"slid", "1", 1}},
          .shapes = {{.name = "largest_acceleration",
                      .unit = "m/s²",
                      .lower = 0.5,
                      .upper = 6.0,
                      .scan = 8,
                      .logarithmic = true,
                      .scale =
                          [](const Drive& drive) {
                            return std::max(drive.wheel_radius * deviation(drive.joints[0].smooth_acceleration), 1e-12);
                          }}},
          .inexact = kLoadOfWheels,
          .free_form = true,
          .excite = "accelerate and brake as hard as it goes, with the pose logged",
          .applies = needs_heading,
          .columns = [](const Drive& drive, Shape shape) {
            const auto lost = [&](std::size_t j) -> Signal {
              const Signal rim = rim_speed(drive, j);
              return followed(drive, rim, shape[0]) - rim;
            };
            return std::vector{unseen_rim_speeds(drive, lost(0), lost(1), 0.0)};
          }};
}

// A load at the distance x before the axle's middle: its mass, its moment of inertia, and its own centre.
Effect payload_offset() {
  return {
      .name = "payload_offset",
      .noun = "a payload before or behind the axle",
      .sentence = "A load was added before or behind the axle: mass, yaw inertia and a centre of mass off the axle.",
      .common = "payload",
      .stands_for = {"com_longitudinal", "payload"},
      .parameters = {{"mass_kg", "kg", 1}, {"yaw_inertia", "kg·m²", 1}, {"moment", "kg·m", 0}},
      .excite = "accelerate and brake, and drive fast curves of changing radius",
      .measured_by = DirectMeasurement::weight,
      .applies = needs_two_wheels,
      .columns =
          [](const Drive& drive, Shape) {
            const Signal& v1 = drive.coordinates[0].smooth_speed;
            const Signal& v2 = drive.coordinates[1].smooth_speed;
            Column offset;
            offset.effort = {-drive.wheel_radius * v2.cwiseAbs2(), drive.wheel_radius * v1.cwiseProduct(v2)};
            return std::vector{base_column(drive, "mass"), base_column(drive, "yaw_inertia"), offset};
          },
      .physical =
          [](std::span<const double> c, Shape) {
            return std::vector<PhysicalValue>{
                {"mass_kg", "kg", c[0]},
                {"yaw_inertia", "kg·m²", c[1]},
                {"moment", "kg·m", c[2]},
                {"x_m", "m", c[0] > 0.0 ? c[2] / c[0] : std::numeric_limits<double>::quiet_NaN()}};
          }};
}

Effect payload(std::size_t joints) {
  Effect effect{.name = "payload",
                .noun = "a payload",
                .sentence = "Mass was added or taken away; friction stayed.",
                .parametric = true,
                .parameters = {{"mass_kg", "kg", 0}},
                .excite = "accelerate and brake, straight and turning",
                .measured_by = DirectMeasurement::weight};
  if (joints == 1) {
    effect.columns = [](const Drive& drive, Shape) { return std::vector{base_column(drive, "inertia")}; };
    return effect;
  }
  effect.parameters.push_back({"yaw_inertia", "kg·m²", 0});
  effect.applies = needs_two_wheels;
  effect.columns = [](const Drive& drive, Shape) {
    return std::vector{base_column(drive, "mass"), base_column(drive, "yaw_inertia")};
  };
  return effect;
}

Effect armature() {
  return {.name = "armature",
          .noun = "inertia of rotors and gears",
          .sentence = "The joints' own turning parts (rotors, gears) have more inertia.",
          .parametric = true,
          .parameters = {{"armature", "kg·m²", 1}},
          .excite = "accelerate and brake, straight and turning",
          .measured_by = DirectMeasurement::weight,
          .applies = needs_two_wheels,
          .columns = [](const Drive& drive, Shape) {
            return std::vector{rate_at_joints(drive, {drive.joints[0].speed, drive.joints[1].speed})};
          }};
}

}  // namespace

std::vector<Effect> geometry_effects(std::size_t joints) {
  std::vector<Effect> effects{payload(joints)};
  if (joints == 2) {
    for (auto* make : {&com_longitudinal, &com_lateral, &slope, &wheel_out_of_round, &wheel_radius_asymmetric,
                       &longitudinal_slip, &turning_slip, &curve_slip, &wheel_radius, &track_width, &encoder_scale,
                       &armature, &payload_offset, &slip_at_the_limit, &wheel_by_harmonics}) {
      effects.push_back(make());
    }
    effects.push_back(slip_by_force(false));
    effects.push_back(slip_by_force(true));
  }
  return effects;
}

}  // namespace wheelwright::gap
