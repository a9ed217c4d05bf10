// SPDX-License-Identifier: Apache-2.0
/// \file
/// Correction of logged efforts to the efforts that acted: saturation, dead zone, gain, delay and lag of an actuator,
/// sample by sample.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "model/robot.hpp"

namespace wheelwright::filter {

/// Actuator model between a logged effort u and the effort y that acts. Applied in this order, per joint:
///   clip to ±limit,  u − deadzone·sgn u (0 inside),  times gain,  u(t − delay),  lag·ẏ + y = u,
/// and then the filter that the speeds passed through, if there is one.
struct EffortCorrection {
  double limit = std::numeric_limits<double>::infinity();  ///< unit of the effort, > 0
  double deadzone = 0.0;                                   ///< unit of the effort, >= 0
  std::vector<double> gain;                                ///< one per joint, > 0; empty: 1
  double delay = 0.0;                                      ///< s, >= 0
  double lag = 0.0;                                        ///< time constant, s, >= 0
  std::optional<model::SpeedFilter> smoothing{};           ///< of the speeds; not beside a delay or a lag

  /// True if it leaves every effort as it is.
  [[nodiscard]] bool empty() const {
    return limit == std::numeric_limits<double>::infinity() && deadzone == 0.0 && gain.empty() && delay == 0.0 &&
           lag == 0.0 && !smoothing;
  }
  /// True if it is linear: independent zero-mean noise of the effort then stays so.
  [[nodiscard]] bool linear() const { return limit == std::numeric_limits<double>::infinity() && deadzone == 0.0; }
  /// Gain of joint `j`: by so much a bound on the error of an effort grows. The other steps do not raise it: clip and
  /// dead zone have slopes in [0, 1], a delay shifts, and the kernels of lags and means have the L1 norm 1.
  [[nodiscard]] double gain_of(std::size_t j) const { return gain.empty() ? 1.0 : gain[j]; }
};

/// Throws InvalidArgument, naming the field, unless `correction` fits `joints` joints.
void validate(const EffortCorrection& correction, std::size_t joints);

/// The correction that the robot's effects ask for (`saturation`, `torque_deadzone`, `torque_gain_asymmetric`: 1 + g
/// right, 1 − g left, `delay` and `sensor_time_offset` together, `actuator_lag`), in the unit of its efforts, and that
/// its speed_filter asks for where motion is read `from_speeds`. Throws InvalidArgument where its effects make no
/// sense.
[[nodiscard]] EffortCorrection effort_correction(const Robot& robot, bool from_speeds);

/// The correction of a running signal. Efforts are constant from a sample to the next (Hold::zero_order) or linear
/// between samples; the lag is integrated exactly for either. Before a segment's first sample the effort is taken to
/// have been that of the first sample for ever: what follows is right once memory() has passed.
///
/// step() does not allocate: history is kept in a ring that holds the delay at an eighth of the nominal step; samples
/// that come closer than that replace each other.
class EffortCorrector {
 public:
  EffortCorrector() = default;
  /// `nominal_step` (s) sizes the history: > 0 where there is a delay. Throws InvalidArgument as validate.
  EffortCorrector(EffortCorrection correction, std::size_t joints, Hold hold, double nominal_step);

  /// True if there is nothing to do.
  [[nodiscard]] bool empty() const { return correction_.empty(); }
  /// Forgets all samples.
  void restart() { count_ = 0; }
  /// Takes the efforts at time `t` (s), one per joint.
  void step(double t, const double* effort);
  /// The effort at the last sample (for first_order).
  [[nodiscard]] double now(std::size_t joint) const { return joints_[joint].y; }
  /// The mean effort between the last two samples (for zero_order; the effort at the first sample).
  [[nodiscard]] double mean(std::size_t joint) const { return joints_[joint].mean; }
  /// Bound on how far the efforts of the last step (both ends included) would be from these for any other time constant
  /// of the speeds' filter within SpeedFilter::time.
  [[nodiscard]] double doubt(std::size_t joint) const { return joints_[joint].doubt; }
  /// Time after which the start of a segment is forgotten to the share `share` of the effort, s.
  [[nodiscard]] double memory(double share) const;

 private:
  struct Joint {
    std::vector<double> history;  // a ring, beside times_
    double y = 0.0;
    double mean = 0.0;
    std::vector<double> window;             // of a mean: the last samples, a ring
    std::array<double, 2> smooth{}, off{};  // of each exponential filter in a row: its value, how far others may be
    double now = 0.0;                       // doubt at the newest sample
    double doubt = 0.0;
  };
  [[nodiscard]] double instantaneous(double u, std::size_t joint) const;
  [[nodiscard]] std::size_t slot(std::size_t age) const;  // 0: newest
  [[nodiscard]] double at(const Joint& joint, double t) const;
  void push(double t, const double* effort);
  [[nodiscard]] double filtered(Joint& joint, double u, double rows, bool first) const;
  [[nodiscard]] double exponential(Joint& joint, double u, double rows) const;
  [[nodiscard]] double window_mean(Joint& joint, double u) const;
  void advance(Joint& joint, double from, double to) const;
  void piece(Joint& joint, double begin, double end, double length) const;

  EffortCorrection correction_;
  Hold hold_ = Hold::first_order;
  double closest_ = 0.0;  // s between neighbours in the history
  std::vector<double> times_;
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  double nominal_ = 0.0;       // s, step of the samples
  std::size_t in_window_ = 0;  // place of the newest sample in the windows
  std::vector<Joint> joints_;
};

}  // namespace wheelwright::filter
