// SPDX-License-Identifier: Apache-2.0
/// \file
/// A robot of this world: what it is built of, what its designer says of it, and seeded draws that are the same on
/// every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>

#include <Eigen/Core>

namespace wheelwright::reality {

/// One stream of draws, by own transforms of mt19937_64.
class Random {
 public:
  /// `item` and `stream` separate draws of one seed (SplitMix64, Steele et al. 2014): no two are related.
  Random(std::uint64_t seed, std::uint64_t item, std::uint64_t stream)
      : generator_(mix(mix(mix(seed) + item) + stream)) {}

  /// Uniform on [low, high).
  [[nodiscard]] double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  /// Log-uniform on [low, high), both > 0.
  [[nodiscard]] double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  /// Standard normal (Box and Muller 1958).
  [[nodiscard]] double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
  }
  /// −1 or 1.
  [[nodiscard]] double sign() { return uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0; }
  /// 0 … count − 1.
  [[nodiscard]] std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(uniform(0.0, static_cast<double>(count)));
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  std::mt19937_64 generator_;
};

/// Index of a wheel.
enum Side : std::size_t { right = 0, left = 1 };

/// Two values, right wheel first.
using Pair = std::array<double, 2>;

/// Bodies, joints and shapes: what the engine is told.
struct Body {
  Pair radius{0.1, 0.1};                     ///< of the wheels, m
  double half_track = 0.25;                  ///< m
  double chassis_mass = 20.0;                ///< kg
  Eigen::Vector3d chassis_inertia{1, 1, 1};  ///< about its own centre of mass, kg m²
  Eigen::Vector3d centre{0, 0, 0};           ///< of the chassis' mass, from the middle of the axle, m
  double wheel_mass = 1.0;                   ///< each, kg
  double wheel_width = 0.02;                 ///< half, m
  Pair armature{0, 0};                       ///< of rotors, at the wheel, kg m²
  Pair damping{0, 0};                        ///< viscous, N m s/rad
  Pair friction{0, 0};                       ///< dry, N m
  double caster = 0.2;                       ///< distance of the balls from the axle, m
  Eigen::Vector3d gravity{0, 0, -9.81};      ///< m/s²
  double grip = 1.5;                         ///< friction of wheels on the ground
  double caster_grip = 0.0;                  ///< likewise of the balls
  double fluid_density = 0.0;                ///< of what the robot moves in, kg/m³
  std::array<Pair, 2> off_centre{};          ///< tyre's centre from the axle, forward and up at angle 0, m
  std::string attached;                      ///< bodies hung into the chassis, in the engine's XML
  std::string beside;                        ///< elements beside the bodies
  std::string motor;                         ///< attributes of the engine's actuators; none: torques act on the joints
  std::string motor_at;                      ///< what the names of their joints begin with
};

/// A robot, its sensors and its controller.
struct RobotDesign {
  Body body;                     ///< as built
  double radius = 0.1;           ///< by its data sheet, m
  double half_track = 0.25;      ///< by its data sheet, m
  double mass = 20.0;            ///< lumped with 2J/r² of wheels and rotors, kg
  double yaw_inertia = 1.0;      ///< likewise with 2Jℓ²/r², kg m²
  double damping = 0.1;          ///< of each wheel, N m s/rad
  Pair gain{1, 1};               ///< of the drives, imperfect robots only
  Pair bias{0, 0};               ///< N m, imperfect robots only
  double rate = 100.0;           ///< Hz
  double counts = 8192.0;        ///< of the encoder in a turn
  double torque_noise = 0.02;    ///< standard deviation, N m
  double position_noise = 1e-3;  ///< standard deviation, m
  double heading_noise = 1e-3;   ///< standard deviation, rad
  double wheel_speed = 8.0;      ///< fastest, rad/s
  double acceleration = 1.5;     ///< largest of the drive, m/s²
  double bandwidth = 10.0;       ///< of the speed controller, rad/s
  double effort_limit = 10.0;    ///< of each wheel, N m

  /// Torque of a wheel in ordinary driving, N m: the unit of severities.
  [[nodiscard]] double typical_torque() const { return 0.5 * radius * mass * 0.5 * acceleration; }
};

/// What robots are drawn from.
struct Lot {
  double least = 5.0;      ///< kg
  double most = 150.0;     ///< kg
  double noise = 1.0;      ///< of the sensors, as a factor
  bool imperfect = false;  ///< radii, track, gains, a bias and dry friction are off by a per cent or less
};

/// A healthy robot of `lot`.
[[nodiscard]] RobotDesign draw_robot(Random& random, const Lot& lot);

/// Moment of inertia of a wheel about its axle, kg m².
[[nodiscard]] double wheel_spin(const Body& body);

/// The engine's description of `body`.
[[nodiscard]] std::string engine_xml(const Body& body, double step);

}  // namespace wheelwright::reality
