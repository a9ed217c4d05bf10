// SPDX-License-Identifier: Apache-2.0
/// \file
/// Laws of effects: several for each effect of which several are known, and what they are made of.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/world/effect.hpp"

namespace wheelwright::reality {

/// Where a law comes from.
enum class Origin {
  own,     ///< a law of this world
  engine,  ///< the physics engine's
};

/// One law of an effect. An effect without an entry here has one law, that of its Entry.
struct Law {
  std::string_view effect;
  std::string_view name;
  MakeEffect make = nullptr;
  std::string_view says;  ///< the law in a line
  Origin origin = Origin::own;
  bool formula = false;  ///< the common formula of the effect, by other means; at most one law of an effect
};

/// All laws, effect by effect in the order of catalogue().
[[nodiscard]] const std::vector<Law>& laws();

/// @name Laws, by what they act on
/// @{
[[nodiscard]] std::vector<Law> friction_laws();
[[nodiscard]] std::vector<Law> drive_laws();
/// @}

/// A law for each effect of which several laws are known, whose functions are drawn with the effect: Increasing of
/// speed, load, depth, slip or time, and filters of random times. They are not in laws(), so that sets of those stay as
/// they are.
[[nodiscard]] const std::vector<Law>& drawn_laws();

/// Which laws a set of cases is drawn from.
class LawChoice {
 public:
  /// `given`: the law of each Entry, and no draw. `all`: the table's. `other`: the table's without the common formulas.
  /// `drawn`: drawn_laws(). Else laws by comma, each `law` or `effect/law`; an effect of which none is named keeps that
  /// of its Entry. Throws InvalidArgument for a law that nobody knows.
  explicit LawChoice(std::string_view text = "given");

  /// A law of `effect` drawn from `random`; null: the Entry's.
  [[nodiscard]] const Law* draw(std::string_view effect, Random random) const;
  /// Laws that can be drawn.
  [[nodiscard]] const std::vector<const Law*>& able() const { return able_; }

 private:
  std::vector<const Law*> able_;
};

/// Names and numbers of a law.
using Parameters = std::vector<std::pair<std::string, double>>;

/// Friction torque against a motion, N m, after a step (s) at a speed (rad/s, or m/s and N). May have memory.
using Friction = std::function<double(double speed, double step)>;

/// A number by another.
using Curve = std::function<double(double)>;

/// Linear between knots, constant outside. Abscissas rise.
struct Table {
  std::vector<double> at, value;
  [[nodiscard]] double operator()(double x) const;
};

/// An increasing function from (0, 0) to (1, 1) between three to seven knots that are drawn: straight lines, or of any
/// bend also cubics (Fritsch and Butland 1984). Goes straight on beyond 1. No line is steeper than four times the mean.
class Increasing {
 public:
  enum class Bend { any, convex, concave };
  explicit Increasing(Random& random, Bend bend = Bend::any);
  /// At x >= 0.
  [[nodiscard]] double operator()(double x) const;

 private:
  std::vector<double> x_{0.0}, y_{0.0}, slope_;
  bool smooth_ = false;
};

/// level(|ω|) sgn ω, smooth within 0.02.
[[nodiscard]] Friction static_friction(Curve level);

/// LuGre (Canudas de Wit et al. 1995): ż = ω − σ0 |ω| z / g(|ω|), torque σ0 z + σ1 ż, by implicit steps. In steady
/// motion the torque is g(|ω|) sgn ω.
[[nodiscard]] Friction lugre(Curve g, double stiffness, double damping);

/// Dahl (1968): dF/dx = σ (1 − F sgn ω / c)^i, integrated exactly; i is 0.5, 1 or another number > 0.
[[nodiscard]] Friction dahl(double c, double stiffness, double exponent);

/// Play operator (Krasnosel'skii and Pokrovskii 1989): follows its input at a distance of at most `half`.
struct PlayOperator {
  double half = 0.0;
  double state = 0.0;
  double operator()(double input);
};

/// D sin(C atan(Bκ − E(Bκ − atan Bκ))) (Pacejka and Bakker 1992).
struct MagicFormula {
  double b = 10.0, c = 1.5, d = 1.0, e = 0.0;
  [[nodiscard]] double operator()(double slip) const;
};

/// Brush tyre with a parabolic pressure (Fiala 1954): rises with `stiffness`, reaches `limit` at 3 limit/stiffness.
struct BrushTyre {
  double stiffness = 1.0, limit = 1.0;
  [[nodiscard]] double operator()(double slip) const;
};

/// A tyre at each wheel: rotor and rim turn at their own speed, which is what the encoder shows, and the ground's
/// torque grip(slip), N m, drives the rolling wheel.
[[nodiscard]] Effect tyre(const RobotDesign& robot, Parameters parameters, const Curve& grip);

/// A rotor with a gap before the wheel and rigid contacts: impacts with restitution, and no bounce below `slow` rad/s.
struct Gear {
  double gap = 0.0;          ///< rad
  double restitution = 0.0;  ///< of the relative speed
  double rotor = 1.0;        ///< kg m²
  double wheel = 1.0;        ///< what meets it, kg m²
  double slow = 0.01;

  double offset = 0.0;  ///< rotor's angle less wheel's, within ±gap/2, rad
  double speed = 0.0;   ///< of the rotor, rad/s

  /// Mean torque on the wheel in a step with `torque` on the rotor; the wheel has `wheel_speed` (rad/s) and is
  /// accelerated by `load` (rad/s²) where the rotor does not touch it.
  double step(double torque, double wheel_speed, double load, double step);
};

}  // namespace wheelwright::reality
