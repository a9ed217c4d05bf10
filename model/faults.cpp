// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/faults.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <wheelwright/core/check.hpp>

namespace wheelwright::model {
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

}  // namespace wheelwright::model
