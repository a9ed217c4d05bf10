// SPDX-License-Identifier: Apache-2.0
/// \file
/// Manoeuvres made of stages: from one constant speed to the next as fast as the limits allow, out and back; and a
/// derivative-free search over a cube, for objectives that are neither smooth nor convex.
///
/// Bounds that hold for every noise are set by the extreme rows of a log, not by their number: what they need is speed
/// held for as long as the memory of the filter, and acceleration as hard as is allowed. Hence stages of constant joint
/// speeds u_1 … u_K with ramps between them, in place of sines or splines, whose peaks are short. The second half runs
/// the first one backwards,
///
///     v(T/2 + s) = −v(T/2 − s),    v̇(T/2 + s) = v̇(T/2 − s),
///
/// so that the robot retraces its path and ends where it began, and each row (v̇, v) has its mirror image (v̇, −v):
/// inertia and friction, which add up in one, are told apart by the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "commission/design/plan.hpp"

namespace wheelwright::design {

/// Options of the search.
struct SearchOptions {
  std::size_t samples = 400;  ///< random points that are looked at first
  std::size_t descents = 6;   ///< best of these from which a local search starts
  std::size_t steps = 500;    ///< most evaluations of each local search
  double tolerance = 1e-4;    ///< a local search ends when the value falls by less than this share
  std::uint64_t seed = 1;     ///< of the random points
  std::size_t threads = 1;    ///< the result does not depend on it
  std::function<void(double share)> progress = {};  ///< told from the calling thread; may be empty
};

/// The best point that was met.
struct SearchResult {
  std::vector<double> x;
  double value = 0.0;
  std::size_t evaluations = 0;
};

/// Minimises `f` over [0, 1]^dimension: random points of a seeded generator and `starts`, then from the best ones a
/// local search by simplices that begin anew and smaller where the last one stood still (Nelder and Mead 1965, in
/// NLopt). On functions with kinks, like widths of bounds, they came further than BOBYQA and Sbplx for as many
/// evaluations. Deterministic. `f` is called from several threads where there are, must be pure and finite; a point
/// where it throws InvalidArgument is passed over. Throws InvalidArgument when the dimension is 0 or f is nowhere
/// defined.
[[nodiscard]] SearchResult minimise_over_cube(const std::function<double(std::span<const double>)>& f,
                                              std::size_t dimension, const std::vector<std::vector<double>>& starts,
                                              const SearchOptions& options = {});

/// The least duration (s) of a drive with `stages` stages a half: its rests, and its ramps where nothing limits them.
[[nodiscard]] double shortest_duration(std::size_t stages);

/// The family of manoeuvres with K stages a half. A member is named by a point x of the cube [0, 1]^dimension(): of
/// each stage the joints' speeds (0: full speed backwards, 1: full speed forwards) and the share of the time that its
/// speed is held. Every point of the cube is a manoeuvre within the limits, so that a search needs no constraints:
///
/// - ramps are as short as acceleration and effort allow (the acceleration rises over a quarter of the ramp, holds, and
///   falls over a quarter); the effort is a sum of friction F and inertia G/T, the ramp's duration T >= G/(limit −
///   |F|);
/// - speeds whose friction leaves no effort to accelerate with, or whose ramps do not fit into the duration, are scaled
///   down;
/// - a path that leaves the space is scaled as a whole, by scaling v1 alone (the robot turns as planned; wheel speeds,
///   accelerations and, where they are linear in v and v̇, efforts can only fall, being largest at the ends of a
///   segment);
/// - what is still beyond a limit at a sample (friction that depends on the heading) is scaled down with the whole
///   motion.
///
/// A motion rests for 0.1 s at both ends: a filter that begins at standstill needs no time to settle.
class StageFamily {
 public:
  /// Keeps a reference to `subject`. Throws InvalidArgument when `limits` does not pass its `validate`, `stages` is 0,
  /// or no motion is within the limits (dry friction above the effort limit, a duration below shortest_duration).
  StageFamily(const DesignSubject& subject, const MotionLimits& limits, std::size_t stages);

  /// Number of coordinates of x: stages · (joints + 1).
  [[nodiscard]] std::size_t dimension() const { return stages_ * (joints_ + 1); }
  /// The manoeuvre `x`, sampled every `step` s. Coordinates beyond [0, 1] are clamped.
  [[nodiscard]] Plan plan(std::span<const double> x, double step) const;

 private:
  [[nodiscard]] double ramp_time(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;
  void limit_friction(Eigen::VectorXd& joint_speed) const;
  void keep_within(Plan& plan) const;

  const DesignSubject* subject_;
  MotionLimits limits_;
  std::size_t stages_;
  std::size_t joints_;
  Eigen::MatrixXd motion_;
};

}  // namespace wheelwright::design
