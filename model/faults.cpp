// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/faults.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

using std::numbers::pi;

double rise(TimeProfile::Shape shape, double since, double rise_time) {
  if (since < 0.0) {
    return 0.0;
  }
  if (shape == TimeProfile::Shape::step || since >= rise_time) {
    return 1.0;
  }
  const double s = since / rise_time;
  return shape == TimeProfile::Shape::ramp ? s : 0.5 * (1.0 - std::cos(pi * s));
}

double rise_rate(TimeProfile::Shape shape, double since, double rise_time) {
  if (shape == TimeProfile::Shape::step || since < 0.0 || since >= rise_time) {
    return 0.0;
  }
  return (shape == TimeProfile::Shape::ramp ? 1.0 : 0.5 * pi * std::sin(pi * since / rise_time)) / rise_time;
}

constexpr std::array<std::string_view, 8> kind_names = {
    "wheel_radius", "wheel_radius_right", "wheel_radius_left", "slip_x", "slip_y", "slip_yaw", "matched", "unmatched"};

// v⁺ = K v is what unequal or changed radii add to the body speed: K = G diag(δ1R, δ1L) (r G)⁻¹, G = [½ ½; 1/D −1/D].
Eigen::Matrix2d radius_gain(const DifferentialDrive& drive, const Eigen::Vector2d& radius) {
  const double r = drive.wheel_radius, d = drive.track_width;
  const double mean = 0.5 * (radius[0] + radius[1]) / r, half_difference = 0.5 * (radius[0] - radius[1]) / r;
  return (Eigen::Matrix2d() << mean, half_difference * d / 2.0, half_difference * 2.0 / d, mean).finished();
}

// [1 1; ℓ −ℓ] diag(r+δ1R, r+δ1L) [1 1; ℓ −ℓ]⁻¹
Eigen::Matrix2d torque_gain(const DifferentialDrive& drive, const Eigen::Vector2d& radius) {
  const double l = drive.lever_arm();
  const double mean = drive.wheel_radius + 0.5 * (radius[0] + radius[1]);
  const double half_difference = 0.5 * (radius[0] - radius[1]);
  return (Eigen::Matrix2d() << mean, half_difference / l, half_difference * l, mean).finished();
}

}  // namespace

void validate(const DriveParameters& p) {
  check::positive(p.mass, "mass");
  check::positive(p.yaw_inertia, "yaw_inertia");
  check::non_negative(p.viscous_x, "viscous_x");
  check::non_negative(p.viscous_y, "viscous_y");
  check::non_negative(p.viscous_yaw, "viscous_yaw");
}

double TimeProfile::value(double t) const {
  return rise(shape, t - onset, rise_time) - rise(shape, t - end, rise_time);
}

double TimeProfile::rate(double t) const {
  return rise_rate(shape, t - onset, rise_time) - rise_rate(shape, t - end, rise_time);
}

std::string_view to_string(Fault::Kind kind) { return kind_names.at(static_cast<std::size_t>(kind)); }

void validate(std::span<const Fault> faults, const DifferentialDrive& drive) {
  check::positive(drive.wheel_radius, "wheel_radius");
  check::positive(drive.track_width, "track_width");
  double right = drive.wheel_radius, left = drive.wheel_radius;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const Fault& fault = faults[k];
    const std::string name = "faults[" + std::to_string(k) + "] (" + std::string(to_string(fault.kind)) + ")";
    check::finite(fault.magnitude, name + ".magnitude");
    check::finite(fault.profile.onset, name + ".onset");
    check::non_negative(fault.profile.rise_time, name + ".rise_time");
    check::that(fault.profile.shape == TimeProfile::Shape::step || fault.profile.rise_time > 0.0, name + ".rise_time",
                "a number > 0 for a fault that is not a step");
    check::that(fault.profile.end >= fault.profile.onset + fault.profile.rise_time, name + ".end",
                "a time not before the fault is fully there");
    if (fault.kind == Fault::Kind::wheel_radius || fault.kind == Fault::Kind::wheel_radius_right) {
      right += std::min(0.0, fault.magnitude);
    }
    if (fault.kind == Fault::Kind::wheel_radius || fault.kind == Fault::Kind::wheel_radius_left) {
      left += std::min(0.0, fault.magnitude);
    }
  }
  check::that(right > 0.0 && left > 0.0, "faults", "wheel radii that stay positive, r + δ1 > 0 (12)");
}

FaultState fault_state(std::span<const Fault> faults, double t) {
  FaultState state;
  for (const Fault& fault : faults) {
    const double value = fault.magnitude * fault.profile.value(t);
    const double rate = fault.magnitude * fault.profile.rate(t);
    const auto slip = [&](Eigen::Index axis) {
      state.slip[axis] += value;
      state.slip_rate[axis] += rate;
    };
    const auto radius = [&](Eigen::Index wheel) {
      state.radius[wheel] += value;
      state.radius_rate[wheel] += rate;
    };
    switch (fault.kind) {
      case Fault::Kind::wheel_radius: radius(0), radius(1); break;
      case Fault::Kind::wheel_radius_right: radius(0); break;
      case Fault::Kind::wheel_radius_left: radius(1); break;
      case Fault::Kind::slip_x: slip(0); break;
      case Fault::Kind::slip_y: slip(1); break;
      case Fault::Kind::slip_yaw: slip(2); break;
      case Fault::Kind::matched: state.matched += value, state.matched_rate += rate; break;
      case Fault::Kind::unmatched: state.unmatched += value, state.unmatched_rate += rate; break;
    }
  }
  return state;
}

Eigen::Vector3d delta(const DifferentialDrive& drive, const FaultState& fault, const DriveMotion& motion) {
  const double c = std::cos(motion.heading), s = std::sin(motion.heading);
  return fault.slip + kinematic_matrix(motion.heading) * (radius_gain(drive, fault.radius) * motion.speed) +
         fault.matched * Eigen::Vector3d(c, s, 0.0) + fault.unmatched * Eigen::Vector3d(s, -c, 0.0);
}

Eigen::Vector3d delta_rate(const DifferentialDrive& drive, const FaultState& fault, const DriveMotion& motion) {
  const double c = std::cos(motion.heading), s = std::sin(motion.heading);
  const Eigen::Vector2d gained = radius_gain(drive, fault.radius) * motion.speed;
  const Eigen::Vector2d gained_rate =
      radius_gain(drive, fault.radius) * motion.acceleration + radius_gain(drive, fault.radius_rate) * motion.speed;
  const double yaw_rate = motion.speed[1] + gained[1] + fault.slip[2];
  const Eigen::Vector3d along(c, s, 0.0), right(s, -c, 0.0);
  return fault.slip_rate + kinematic_matrix(motion.heading) * gained_rate + fault.matched_rate * along +
         fault.unmatched_rate * right + yaw_rate * (fault.unmatched * along - (fault.matched + gained[0]) * right);
}

Eigen::Vector2d zeta(const DifferentialDrive& drive, const DriveParameters& p, const FaultState& fault,
                     const DriveMotion& motion) {
  const Eigen::Matrix<double, 3, 2> s = kinematic_matrix(motion.heading);
  const Eigen::Vector3d mass(p.mass, p.mass, p.yaw_inertia), friction(p.viscous_x, p.viscous_y, p.viscous_yaw);
  const Eigen::Matrix2d mbar = s.transpose() * mass.asDiagonal() * s, fbar = s.transpose() * friction.asDiagonal() * s;
  const Eigen::Vector2d healthy = mbar * motion.acceleration + fbar * motion.speed;
  const Eigen::Vector2d added = s.transpose() * (mass.cwiseProduct(delta_rate(drive, fault, motion)) +
                                                 friction.cwiseProduct(delta(drive, fault, motion)));
  return torque_gain(drive, fault.radius) * (healthy + added) - drive.wheel_radius * healthy;
}

Eigen::Vector3d delta_bound(const DifferentialDrive& drive, std::span<const Fault> faults,
                            const Eigen::Vector2d& speed_bound) {
  check::non_negative(speed_bound[0], "speed_bound[0]");
  check::non_negative(speed_bound[1], "speed_bound[1]");
  const double v1 = speed_bound[0] / drive.wheel_radius, v2 = speed_bound[1] / drive.wheel_radius;
  const double wheel = v1 + 0.5 * drive.track_width * v2;  // |ω_R|, |ω_L| at most
  Eigen::Vector3d bound = Eigen::Vector3d::Zero();
  for (const Fault& fault : faults) {
    const double size = std::abs(fault.magnitude);
    switch (fault.kind) {
      case Fault::Kind::wheel_radius: bound += size * Eigen::Vector3d(v1, v1, v2); break;
      case Fault::Kind::wheel_radius_right:
      case Fault::Kind::wheel_radius_left:
        bound += size * wheel * Eigen::Vector3d(0.5, 0.5, 1.0 / drive.track_width);
        break;
      case Fault::Kind::slip_x: bound[0] += size; break;
      case Fault::Kind::slip_y: bound[1] += size; break;
      case Fault::Kind::slip_yaw: bound[2] += size; break;
      case Fault::Kind::matched:
      case Fault::Kind::unmatched: bound.head<2>().array() += size; break;
    }
  }
  return bound;
}

}  // namespace wheelwright
