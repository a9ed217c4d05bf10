// SPDX-License-Identifier: Apache-2.0
/// \file
/// Somebody's MJCF run along a log: how far the robot and that simulator are apart.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/log.hpp"

namespace wheelwright::reality {

/// What a log is compared with, and how.
struct ReplayOptions {
  std::string right = "right", left = "left";  ///< joints of the wheels
  double beta = 10.0;                          ///< of f₂, 1/s
  double horizon = 1.0;                        ///< s, of runs in open loop
  double every = 1.0;                          ///< s from one run's start to the next
  /// Geometry by which wheel speeds are read as body speeds; nothing: the simulator's own.
  std::optional<double> wheel_radius{}, track_width{};
};

/// Root mean squares of robot less simulator.
struct Replay {
  double sum = 0.0;  ///< τ_R + τ_L through f₂, N·m: what the simulator needs to turn its wheels as the log did
  double difference = 0.0;                       ///< D/2 (τ_R − τ_L), likewise, N·m²
  double velocity = 0.0;                         ///< by the wheels after `horizon` s in open loop, m/s
  double yaw_rate = 0.0;                         ///< likewise, rad/s
  double position = 0.0;                         ///< distance after `horizon` s, m
  double heading = 0.0;                          ///< likewise, rad
  double wheel_radius = 0.0, track_width = 0.0;  ///< by which wheel speeds were read, m
  std::size_t rows = 0;                          ///< of the torque
  std::size_t runs = 0;
  /// What the simulator did while its wheels were held at the log's speeds: a log of it under the same commands (t,
  /// omega_r, omega_l, tau_r, tau_l, x, y, theta; SI units). The last row of the log is not in it.
  LogTable simulated;
};

/// Runs the robot of `xml`, which stands on a ground at height 0 and has one free joint, along `log` (omega_r, omega_l,
/// tau_r, tau_l, x, y, theta), in the engine's steps of the file, none longer than the log's.
///
/// - Torque: its wheels are held at the log's speeds (a quadratic over five samples) by a stiff servo, whose commands
///   are compared with the log's. A motor's command goes through its gear, and what is beyond its limits counts as
///   the limit on both sides; wheels without a motor take torques. Instants at which a
///   wheel hardly moves are left out, as in a diagnosis.
/// - Open loop: from the log's state every `every` s, the log's torques for `horizon` s.
///
/// Throws Error where the engine rejects the file, or it has no such joints.
[[nodiscard]] Replay replay(const std::string& xml, const LogTable& log, const ReplayOptions& options = {});

}  // namespace wheelwright::reality
