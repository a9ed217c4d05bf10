// SPDX-License-Identifier: Apache-2.0
/// \file
/// Two-wheeled robot and single axis driven by efforts that are linear in time piece by piece, solved exactly.
///
/// Shares nothing with `sim/`: no integrator and no step size. With p = ω_R + ω_L, q = ω_R − ω_L the robot is two
/// scalar linear equations a p' + A p = T_R + T_L, b q' + B q = T_R − T_L (T_j: effort less dry friction), whose
/// solution over a piece is written down. Dry friction is Coulomb's, with sticking: a piece is cut where a wheel stops,
/// breaks loose or is caught.
#pragma once

#include <array>
#include <cstddef>
#include <numbers>

namespace wheelwright::guarantee {

/// True parameters of a robot, SI units. A single axis uses `mass`, `viscous_linear` and `coulomb` only.
struct Truth {
  bool axis = false;            ///< single axis instead of two wheels
  double radius = 1.0;          ///< of the wheels, m
  double track = 1.0;           ///< m
  double mass = 1.0;            ///< kg (rotary axis: kg·m²)
  double yaw_inertia = 1.0;     ///< kg·m²
  double viscous_linear = 1.0;  ///< N·s/m
  double viscous_yaw = 1.0;     ///< N·m·s/rad
  double coulomb = 0.0;         ///< per wheel, N·m (axis: N or N·m)
};

/// Right and left wheel; an axis uses the first only.
using Pair = std::array<double, 2>;

inline constexpr double kTurn = 2.0 * std::numbers::pi;  ///< rad

/// The robot in motion. Starts at rest at angle zero.
class Plant {
 public:
  explicit Plant(const Truth& truth);

  /// Lets `h` seconds (> 0) pass with the efforts `effort` + `slope`·s at s seconds from now.
  void advance(double h, const Pair& effort, const Pair& slope);

  [[nodiscard]] Pair angle() const { return {static_cast<double>(angle_[0]), static_cast<double>(angle_[1])}; }
  [[nodiscard]] Pair speed() const { return speed_; }

 private:
  // Values at s: ∫…∫ of exp(−λ·) once, twice, three times, and exp(−λ s) itself.
  struct Weights {
    double decay, once, twice, thrice;
  };
  // inertia·x' + friction·x = drive + slope·s
  struct Mode {
    double inertia, friction;
    mutable double h = -1.0;
    mutable Weights last{};
    [[nodiscard]] Weights weights(double s) const;
  };
  struct Sides {
    Pair speed, turned, rise, reaction;  // rise: acceleration
  };

  [[nodiscard]] Sides after(double s, const Pair& effort, const Pair& slope) const;
  [[nodiscard]] bool consistent(const Pair& effort, const Pair& slope) const;
  void choose_slipping(const Pair& effort, const Pair& slope);
  [[nodiscard]] bool holds(const Sides& sides) const;
  void take(const Sides& sides);

  std::size_t joints_;
  double coulomb_;
  Mode sum_, difference_, alone_;
  std::array<int, 2> slipping_{1, 1};  // sign of the motion that friction opposes; 0 where the wheel sticks
  std::array<long double, 2> angle_{};
  Pair speed_{};
};

}  // namespace wheelwright::guarantee
