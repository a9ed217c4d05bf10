// SPDX-License-Identifier: Apache-2.0
#include "model/faults.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/check.hpp"

namespace wheelwright::model {
namespace {

using std::numbers::pi;
using Shape = TimeProfile::Shape;

double rise(Shape shape, double since, double rise_time) {
  return since < 0.0 ? 0.0 : FaultProfile{.kind = shape, .rise = rise_time}.at(since, 0.0, 0.0);
}

double rise_rate(Shape shape, double since, double rise_time) {
  if (since < 0.0 || since >= rise_time) {
    return 0.0;
  }
  switch (shape) {
    case Shape::ramp: return 1.0 / rise_time;
    case Shape::smooth: return 0.5 * pi * std::sin(pi * since / rise_time) / rise_time;
    case Shape::step:
    case Shape::pulse:
    case Shape::bump: break;
  }
  return 0.0;
}

// Adds a fault of this size; whether a simulator has its kind.
bool add(FaultKind kind, double value, double rate, FaultState& state) {
  const auto slip = [&](Eigen::Index axis) {
    state.slip[axis] += value;
    state.slip_rate[axis] += rate;
    return true;
  };
  const auto radius = [&](Eigen::Index wheel) {
    state.radius[wheel] += value;
    state.radius_rate[wheel] += rate;
    return true;
  };
  switch (kind) {
    case FaultKind::wheel_radius: return radius(0) && radius(1);
    case FaultKind::wheel_radius_right: return radius(0);
    case FaultKind::wheel_radius_left: return radius(1);
    case FaultKind::slip_x: return slip(0);
    case FaultKind::slip_y: return slip(1);
    case FaultKind::slip_yaw: return slip(2);
    case FaultKind::matched: state.matched += value, state.matched_rate += rate; return true;
    case FaultKind::unmatched: state.unmatched += value, state.unmatched_rate += rate; return true;
    case FaultKind::wheel_radius_drift:
    case FaultKind::wheel_radius_bump_right:
    case FaultKind::wheel_radius_bump_left:
    case FaultKind::wheel_slip_right:
    case FaultKind::wheel_slip_left:
    case FaultKind::effort_loss:
    case FaultKind::effort_bias:
    case FaultKind::effort_stuck:
    case FaultKind::effort_dead:
    case FaultKind::encoder_scale:
    case FaultKind::encoder_frozen:
    case FaultKind::encoder_dropout:
    case FaultKind::payload_lost: break;
  }
  return false;
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

void validate(std::span<const Fault> faults, const DifferentialDrive& drive) {
  check::positive(drive.wheel_radius, "wheel_radius");
  check::positive(drive.track_width, "track_width");
  double right = drive.wheel_radius, left = drive.wheel_radius;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const Fault& fault = faults[k];
    const std::string name = "faults[" + std::to_string(k) + "] (" + std::string(to_string(fault.kind)) + ")";
    FaultState none;
    check::that(add(fault.kind, 0.0, 0.0, none), name, "a fault that a simulator has");
    check::finite(fault.magnitude, name + ".magnitude");
    check::finite(fault.profile.onset, name + ".onset");
    check::non_negative(fault.profile.rise_time, name + ".rise_time");
    check::that(fault.profile.shape != Shape::pulse && fault.profile.shape != Shape::bump, name + ".shape",
                "step, ramp or smooth");
    check::that(fault.profile.shape == Shape::step || fault.profile.rise_time > 0.0, name + ".rise_time",
                "a number > 0 for a fault that is not a step");
    check::that(fault.profile.end >= fault.profile.onset + fault.profile.rise_time, name + ".end",
                "a time not before the fault is fully there");
    if (fault.kind == FaultKind::wheel_radius || fault.kind == FaultKind::wheel_radius_right) {
      right += std::min(0.0, fault.magnitude);
    }
    if (fault.kind == FaultKind::wheel_radius || fault.kind == FaultKind::wheel_radius_left) {
      left += std::min(0.0, fault.magnitude);
    }
  }
  check::that(right > 0.0 && left > 0.0, "faults", "wheel radii that stay positive, r + δ1 > 0 (12)");
}

std::vector<FaultKind> simulated_faults() {
  std::vector<FaultKind> kinds;
  for (std::size_t k = 0; k < fault_kinds; ++k) {
    FaultState none;
    if (const auto kind = static_cast<FaultKind>(k); add(kind, 0.0, 0.0, none)) {
      kinds.push_back(kind);
    }
  }
  return kinds;
}

FaultState fault_state(std::span<const Fault> faults, double t) {
  FaultState state;
  for (const Fault& fault : faults) {
    add(fault.kind, fault.magnitude * fault.profile.value(t), fault.magnitude * fault.profile.rate(t), state);
  }
  return state;
}

}  // namespace wheelwright::model
