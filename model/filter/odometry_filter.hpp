// SPDX-License-Identifier: Apache-2.0
/// \file
/// The kinematic residual's rows: measured pose or gyro against wheel odometry over a sliding window.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "model/filter/odometry_measurement.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::filter {

/// Mean of the unit vector whose direction goes from `from` to `to` (rad) at a constant rate: E_j below.
[[nodiscard]] std::array<double, 2> mean_direction(double from, double to);

/// Bound on what a motion that is not constant within a step of `h` s adds to E Δφ of a wheel that moved by `size` >= 0
/// rad (its errors included), while the measured heading turned by `turn` rad: the third sum below.
[[nodiscard]] double motion_within_step(double h, double size, double turn, const OdometryErrors& errors);

/// A window of wheel odometry against what a pose or a gyro saw of it, for every sample k; k0 is the sample of the same
/// segment with t_k − t_k0 nearest to the window W. With p and θ the measured pose, φ the wheel angles (speeds are
/// integrated by the trapezoidal rule) and ϑ = [r_R, r_L, c_R, c_L, b]: effective rolling radii, yaw gains c = r/D,
/// gyro bias,
///
///     longitudinal, lateral:  R(−θ_k0)(p_k − p_k0) = Σ_j E_j (Δφ_R,j r_R + Δφ_L,j r_L)/2
///     yaw:                    θ_k − θ_k0           = c_R Δφ_R − c_L Δφ_L
///     gyro_yaw:               ∫ gyro dt            = c_R Δφ_R − c_L Δφ_L + b (t_k − t_k0)
///
/// R(a) turns by a. E_j is the mean of the unit vector of direction ψ over step j, where ψ = θ − θ_k0 goes from one
/// measured heading to the next at a constant rate: its direction is that of the middle, its length the ratio
/// sin(Δψ/2)/(Δψ/2) of chord and arc, so that arcs are exact. Both sides are turned by the same measured angle, whose
/// error therefore does not matter. (5) with r_R ≠ r_L; the windows of Martinelli, Tomatis and Siegwart are alike.
///
/// Bounds, all for the worst case:
/// - dy, position: 2 n_p (|cos θ_k0| + |sin θ_k0|), at most 2√2 n_p. dy, yaw: 2 n_θ.
/// - dy, gyro: n_g (t_k − t_k0) + Σ h² cA/2, the trapezoidal rule's error for |θ̈| <= 2cA.
/// - dY, yaw and gyro: 2 n_φ, or n_ω (t_k − t_k0) for speeds.
/// - dY, position, each wheel: half the sum of
///     n_φ (|E_first| + |E_last| + Σ|E_j − E_j−1|)   summation by parts (speeds: n_ω (t_k − t_k0)),
///     n_θ Σ (|Δφ_j| + 2 n_φ)                        a mean of unit vectors moves by n_θ at most,
///     Σ h²[(|Δφ_j| + 2 n_φ + A h²/2) 2cA/12 + (|Δψ_j| + 2 n_θ) A/8]
///                                                   speed and turning rate not constant within a step of length h,
///   with A and c of OdometryErrors: for |ω̇| <= A a speed differs from its mean over the step by A h²/4 in the
///   integral, and the heading from the straight line between its ends by |θ̈| h³/12.
/// - the rounding of the sums, which are carried with twice the precision.
/// Bias and length of the window are exact.
///
/// The sums run along with the samples: a step costs the same whatever the window, and allocates nothing. Batch use is
/// this class in a loop.
class OdometryFilter {
 public:
  /// `window` W > 0, s. Throws InvalidArgument for a window shorter than two nominal steps, other than two motion
  /// columns, no output at all, or bounds that are negative.
  OdometryFilter(OdometryMeasurement measurement, double window, OdometryErrors errors = {});

  /// Forgets all samples: the next one starts a segment.
  void restart();

  /// Takes the sample at time `t` (s), in the order of OdometryMeasurement::columns(); headings may be wrapped or not.
  /// `t` must exceed that of the sample before. Returns whether row() now holds an instant: not before the segment is
  /// as long as the window, and for a held pose only where it is new. Where samples come so fast that one window has
  /// more than twice as many as the nominal step gives, the window is as long as the last so many samples.
  bool step(double t, std::span<const double> sample);

  /// The instant at the last sample.
  [[nodiscard]] const FilteredRow& row() const { return row_; }
  /// t_k0 of row(), s.
  [[nodiscard]] double window_start() const { return at(tail_).t; }
  /// t_k of row(), s.
  [[nodiscard]] double window_end() const { return at(size_ - 1).t; }
  [[nodiscard]] const OdometryMeasurement& measurement() const { return measurement_; }
  /// Outputs and parameters of a row.
  [[nodiscard]] std::size_t outputs() const { return static_cast<std::size_t>(row_.Y.rows()); }
  [[nodiscard]] std::size_t parameters() const { return static_cast<std::size_t>(row_.Y.cols()); }

 private:
  // A sum with its rounding error beside it (Dekker 1971): differences of two are as good as if they were summed alone.
  struct Sum {
    double value = 0.0;
    double rest = 0.0;
    void add(double x);
    [[nodiscard]] double since(const Sum& before) const { return (value - before.value) + (rest - before.rest); }
  };
  struct Wheel {
    Sum angle;                 // φ, where it is integrated
    double measured = 0.0;     // φ, where it is measured
    std::array<Sum, 2> along;  // Σ E_j Δφ_j in the pose's frame
    Sum size;                  // Σ |Δφ_j|
    Sum within;                // Σ of what happens within a step
  };
  struct Sample {
    double t = 0.0;
    double x = 0.0, y = 0.0, heading = 0.0, cosine = 1.0, sine = 0.0;
    std::array<double, 2> mean{};  // E_j of the step that ends here
    Sum variation;                 // Σ |E_j − E_j−1|
    Sum gyro;                      // ∫ gyro dt
    Sum squared_steps;             // h² of each sample's step, s²
    std::array<Wheel, 2> wheels;
    std::size_t steps = 0;
  };

  [[nodiscard]] const Sample& at(std::size_t k) const { return ring_[(first_ + k) % ring_.size()]; }
  [[nodiscard]] double turned(const Wheel& now, const Wheel& before) const;
  [[nodiscard]] double rounding(const Wheel& now, const Wheel& before) const;
  bool read(double t, std::span<const double> sample);
  void follow_pose(const Sample& before);
  void push();
  void write_row();
  void write_position(const Sample& begin, const Sample& end);
  void write_turn(const Sample& begin, const Sample& end);

  OdometryMeasurement measurement_;
  double window_;
  OdometryErrors errors_;
  std::vector<Sample> ring_;
  std::size_t first_ = 0, size_ = 0, tail_ = 0;
  bool started_ = false;
  double sample_time_ = 0.0;
  double gyro_ = 0.0;
  std::array<double, 2> speed_{};
  double turns_ = 0.0, wrapped_heading_ = 0.0;
  Sample now_;
  FilteredRow row_;
};

}  // namespace wheelwright::filter
