// SPDX-License-Identifier: Apache-2.0
/// \file
/// Faults as data: their kinds, their time profiles, and the signature of each in robot and sensors, with one unknown
/// size. What a simulator does with them is in faults.hpp.
///
/// A fault has a size κ, 0 without it. With the profile s(t) in [0, 1] of its coming, v the coordinate speeds that the
/// encoders of a healthy robot would show, and Y the model's regressor, a faulty robot
///
///     moves at        w = (I + κ s K) v + κ s a, and at κ s d across its heading, to the left,
///     reads efforts   u = (I + κ s (H + G)) Y(w, ẇ) (θ + κ s ϑ) + κ s o,
///     reads speeds    (I + κ s S) v.
///
/// G acts on what passes through the ground only, not on dry friction in the wheels: it is the torque that another
/// wheel radius takes. This is (16) of the paper and its relatives: for both radii K = G = I and κ = δ1/r, so that
/// ζ = ((1 + κ)² − 1) Yθ. Motion across the heading adds −w2 κ d to the forward acceleration.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::model {

/// Kinds of fault: what changes. Each is one entry of model/fault_catalogue.cpp, with its name, sentence, unit, range
/// and signature. Those from effort_loss to encoder_dropout are of each joint.
enum class FaultKind {
  wheel_radius,             ///< both wheel radii, δ1 of (1)
  wheel_radius_right,       ///< the right wheel's, δ1R of Remark 1
  wheel_radius_left,        ///< the left wheel's, δ1L of Remark 1
  slip_x,                   ///< slip or skid along the world x axis, δ2 of (1)
  slip_y,                   ///< along the world y axis, δ3 of (1)
  slip_yaw,                 ///< about the vertical, δ4 of (1)
  matched,                  ///< along the heading, ρ_M of (10)
  unmatched,                ///< across the heading, to the right, ρ_U of (11)
  wheel_radius_drift,       ///< both wheel radii, slowly
  wheel_radius_bump_right,  ///< the right wheel's, over a part of its turn
  wheel_radius_bump_left,   ///< the left wheel's
  wheel_slip_right,         ///< a share of the right wheel's way is lost
  wheel_slip_left,          ///< of the left wheel's
  effort_loss,              ///< a share of the effort is not delivered
  effort_bias,              ///< the effort's reading is off
  effort_stuck,             ///< it stays at its value
  effort_dead,              ///< it is zero
  encoder_scale,            ///< the encoder counts too much or too little
  encoder_frozen,           ///< it stands still
  encoder_dropout,          ///< it stands still for a moment
  payload_lost,             ///< mass in line with the axle is lost or gained
};
/// How many there are.
inline constexpr std::size_t fault_kinds = static_cast<std::size_t>(FaultKind::payload_lost) + 1;

/// Name of a kind as results and scenario files write it, e.g. "wheel_radius_right"; where it is of each joint, the
/// part before the joint's: "effort_loss" of "effort_loss_right".
[[nodiscard]] std::string_view to_string(FaultKind kind);

/// Time profile of a fault: s(t) of its signature.
struct FaultProfile {
  /// Shape.
  enum class Kind {
    step,    ///< 0, then 1 from the onset on
    ramp,    ///< linear from 0 to 1 over `rise`
    smooth,  ///< half a cosine over `rise`, (1 − cos πs)/2: differentiable, as (8) asks for; simulators only
    pulse,   ///< 1 for the time `rise` after the onset, then 0 again
    bump,  ///< once per turn of joint `joint`: (1 + cos(2π ψ/arc))/2 where |ψ| <= arc/2, ψ the joint's angle from the
           ///< middle of the bump, which lies half an arc ahead at the onset
  };
  Kind kind = Kind::step;
  double rise = 0.0;      ///< s, > 0 for ramp, smooth and pulse
  double arc = 0.0;       ///< rad, in (0, 2π], for a bump
  std::size_t joint = 0;  ///< for a bump

  /// s at `since` >= 0 s after the onset, when the joint has turned by `angle` (rad) since then at `speed` (rad/s).
  [[nodiscard]] double at(double since, double angle, double speed) const;
  /// True if s jumps to 1 at the onset.
  [[nodiscard]] bool jumps() const { return kind == Kind::step || kind == Kind::pulse; }
};

/// A fault of a robot. Matrices and vectors may be left empty where they are zero.
struct FaultType {
  std::string name{};        ///< as in results, e.g. "wheel_radius_right"
  std::string sentence{};    ///< for people, e.g. "the right wheel's radius changes"
  std::string unit{};        ///< of the magnitude; "1" for a share
  Interval range{};          ///< magnitudes that are looked at, in it 0: one side or both
  double per_kappa = 1.0;    ///< κ = magnitude/per_kappa (where `share_lost`: see there)
  bool share_lost = false;   ///< the magnitude is the share m in [0, 1) of an effort that is lost: κ = m/(1 − m)
  bool whole = false;        ///< it is there or not, κ = range.upper: its magnitude is not asked for
  Eigen::MatrixXd motion{};  ///< K, coordinates × coordinates
  Eigen::VectorXd slip{};    ///< a, m/s, rad/s per unit of κ
  double lateral = 0.0;      ///< d, m/s per unit of κ
  Eigen::MatrixXd effort{};  ///< H, outputs × outputs
  Eigen::MatrixXd ground{};  ///< G, outputs × outputs
  Eigen::VectorXd offset{};  ///< o, units of the outputs per unit of κ
  Eigen::VectorXd theta{};   ///< ϑ, θ_L's units per unit of κ
  Eigen::MatrixXd seen{};    ///< S, coordinates × coordinates
  bool held_effort = false;  ///< a reading that stands still: H Y is taken away and H times its filtered value at the
                             ///< onset over the filter's static gain put in its place: a picture of it, no promise
                             ///< (margins.hpp)
  bool of_reading = false;  ///< K is of what encoders show: the joints' own speeds share in it, and dry friction's sign
  FaultProfile profile{};
  double inspected = 0.0;  ///< size for which people ask how well a drive would show it; 0: none is usual

  /// κ of a magnitude.
  [[nodiscard]] double kappa(double magnitude) const;
  /// The magnitude of κ.
  [[nodiscard]] double magnitude(double kappa) const;
};

/// Throws InvalidArgument, naming fault and field, unless shapes fit `model`, numbers are finite, the range holds 0 and
/// κ of its ends is finite, profiles are as FaultProfile says, and no fault changes both the efforts' gain and the
/// speeds that are seen (which margins could not be solved exactly for).
void validate(const FaultType& fault, const Model& model);

/// The faults of a robot that can be told from its model alone: of every joint's effort (`effort_loss`, `effort_bias`,
/// `effort_stuck`, `effort_dead`) and encoder (`encoder_scale`, `encoder_frozen`, `encoder_dropout`), named after the
/// joint where there are several ("_right", "_left"); of the mass (`payload_lost`); for a differential drive of its
/// wheel radii (`wheel_radius`, with `_right`, `_left`, `_drift`, `_bump_right`, `_bump_left`), and slip
/// (`wheel_slip_right`, `wheel_slip_left`: a share of the wheel's way is lost; `matched`, `unmatched`, `slip_yaw`:
/// (10), (11), δ4 of (1)).
///
/// `unmatched` is left out for anisotropic friction, whose part along the heading it would change.
///
/// `theta` (p), a best guess of θ_L, bounds the mass that can be lost or gained; `effort` names the unit of a bias. The
/// mass is in kg where efforts are torques, else a share of what `theta` says.
[[nodiscard]] std::vector<FaultType> fault_catalogue(const Model& model, const Eigen::VectorXd& theta,
                                                     EffortKind effort = EffortKind::torque);

/// The fault called `name`. Throws InvalidArgument, naming those that there are, where there is none.
[[nodiscard]] const FaultType& find_fault(const std::vector<FaultType>& catalogue, const std::string& name);

}  // namespace wheelwright::model

namespace wheelwright {
using model::FaultProfile;
using model::FaultType;
}  // namespace wheelwright
