// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/drive_effects.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/model/effect_law.hpp>

namespace wheelwright {
namespace {

constexpr double largest_slip = 0.2;

double soft_sign(double x, double x0) { return x0 > 0.0 ? std::clamp(x / x0, -1.0, 1.0) : 0.0; }

bool is_force(const RobotEffect& effect) {
  const EffectLaw& law = effect_law(effect.name);
  return law.mechanism == EffectMechanism::term || law.mechanism == EffectMechanism::simulation;
}

}  // namespace

DriveEffects::DriveEffects(const Robot& robot) {
  const auto value = [&](const char* effect, const char* parameter) { return effect_value(robot, effect, parameter); };
  const auto shape = [&](const char* effect, const char* parameter, double otherwise) {
    return has_effect(robot, effect) ? value(effect, parameter) : otherwise;
  };
  forces = std::ranges::any_of(robot.effects, is_force);
  const DriveGeometry geometry = drive_geometry(robot);
  radius = geometry.radius.array() - robot.wheel_radius;
  track = geometry.track_width - robot.track_width;
  const double c = value("coulomb", "c");
  coulomb = {c + value("coulomb_asymmetric", "c_R"), c + value("coulomb_asymmetric", "c_L")};
  bias = {value("torque_bias", "b_R"), value("torque_bias", "b_L")};
  round_cos = {value("wheel_out_of_round", "A_R"), value("wheel_out_of_round", "A_L")};
  round_sin = {value("wheel_out_of_round", "B_R"), value("wheel_out_of_round", "B_L")};
  stribeck = value("stribeck", "c_s");
  stribeck_speed = shape("stribeck", "omega_s", 1.0);
  viscous = value("viscous_asymmetric", "b");
  drag = value("quadratic_drag", "c");
  drag_yaw = value("quadratic_drag", "c2");
  com_longitudinal = value("com_longitudinal", "a");
  com_lateral = value("com_lateral", "b");
  gravity = {value("slope", "g_x"), value("slope", "g_y")};
  caster = value("caster_drag", "c");
  caster_arm = shape("caster_drag", "p", 1.0);
  scrub = value("lateral_scrub", "mu");
  load = value("load_friction", "k");
  drift = value("friction_drift", "k");
  drift_time = shape("friction_drift", "T", 1.0);
  stiffness = value("longitudinal_slip", "stiffness");
}

DryThreshold dry_threshold(const DriveEffects& e, const DifferentialDrive& drive, const DriveParameters& p,
                           double step) {
  const double r = drive.wheel_radius, arm = 0.5 * drive.track_width;
  const double mobility = 2.0 * std::max(1.0 / p.mass, arm * arm / p.yaw_inertia) / (r * r);
  const double friction = e.coulomb.maxCoeff() + std::abs(e.stribeck) + (e.load > 0.0 ? 10.0 * e.load : 0.0);
  return {2.0 * step * friction * mobility, 2.0 * step * std::abs(e.scrub) / (r * p.yaw_inertia),
          2.0 * step * e.caster / r * std::max(1.0 / p.mass, e.caster_arm * e.caster_arm / p.yaw_inertia)};
}

EffectLoad effect_load(const DriveEffects& e, const DifferentialDrive& drive, const DriveParameters& p,
                       const DryThreshold& threshold, const EffectState& x) {
  EffectLoad load;
  const double warm = e.drift * -std::expm1(-x.t / e.drift_time);
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double w = x.wheel_speed[j], slow = w / e.stribeck_speed;
    const double dry =
        e.coulomb[j] * (1.0 - warm) + e.stribeck * std::exp(-slow * slow) + e.load * std::abs(x.torque[j]);
    load.torque[j] = dry * soft_sign(w, threshold.wheel) + e.bias[j] + e.round_cos[j] * std::cos(x.wheel_angle[j]) +
                     e.round_sin[j] * std::sin(x.wheel_angle[j]);
  }
  const double r = drive.wheel_radius, arm = 0.5 * (drive.track_width + e.track), u = x.speed, w = x.yaw_rate;
  const double across = e.caster_arm * w, caster = std::max(std::hypot(u, across), threshold.caster);
  double sum = e.viscous * arm * w / r + e.drag * u * std::abs(u);
  double difference = e.viscous * arm * u / r + e.drag_yaw * w * std::abs(w) + e.scrub * soft_sign(w, threshold.yaw);
  if (caster > 0.0) {
    sum += e.caster * u / caster;
    difference += e.caster * e.caster_arm * across / caster;
  }
  load.force = sum / r - p.mass * e.com_longitudinal * w * w - warm * p.viscous_x * u +
               p.mass * (e.gravity[0] * std::cos(x.heading) + e.gravity[1] * std::sin(x.heading));
  load.moment = difference / r + p.mass * e.com_longitudinal * u * w - warm * p.viscous_yaw * w;
  return load;
}

Eigen::Vector2d slip_share(const DriveEffects& e, const Eigen::Vector2d& force, const Eigen::Vector2d& rim_speed) {
  Eigen::Vector2d share = Eigen::Vector2d::Zero();
  for (Eigen::Index j = 0; j < 2 && e.stiffness > 0.0; ++j) {
    share[j] = std::clamp(std::copysign(1.0, rim_speed[j]) * force[j] / e.stiffness, -largest_slip, largest_slip);
  }
  return share;
}

}  // namespace wheelwright
