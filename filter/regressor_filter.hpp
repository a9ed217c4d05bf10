// SPDX-License-Identifier: Apache-2.0
/// \file
/// Samples in, rows {τ_f, Y_f} out: the one recursion behind the batch and the online use of the filter.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/filter/design.hpp>
#include <wheelwright/filter/effort_correction.hpp>
#include <wheelwright/filter/exact.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>
#include <wheelwright/model/model.hpp>

namespace wheelwright {

/// One instant of the filtered regression (25).
struct FilteredRow {
  RowMatrix Y;         ///< n × p, Y_f
  RowMatrix dY;        ///< n × p, Δ >= 0
  Eigen::VectorXd y;   ///< n, τ_f
  Eigen::VectorXd dy;  ///< n, n̄ >= 0
};

/// Filters torque and regressor sample by sample: (28) for τ_f, the identities of theory section 2 for Y_f, discretised
/// exactly for steps of any length.
///
/// Between samples: speeds and functions of the motion (friction terms) linear; efforts as Measurement::hold says. Angles
/// are first reduced to mean speeds over their intervals, and efforts to means alike, both at the intervals' mid-points:
/// a moving average of both sides of (20), which leaves the equation as it is. Where both sides are interpolated alike the
/// errors of second order in the step cancel; a filter of the angles themselves would keep (βh)²/12 of the inertia.
/// Efforts pass Measurement::correction first; where that has a memory, rows begin when it has forgotten the segment's start
/// too, unless the segment begins at rest without effort.
///
/// step() does not allocate. Batch filtering is this class in a loop, so that both give the same bits.
class RegressorFilter {
 public:
  /// Throws InvalidArgument when `model`, `design` or `measurement` is not valid. `errors` says what dY and dy are.
  RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors = {});

  /// Forgets all samples: the next one starts a segment.
  void restart();

  /// Takes the sample at time `t` (s): motion of each joint, effort of each joint, heading where
  /// Measurement::heading_column names one (the order of Measurement::columns()). `t` must exceed that of the sample
  /// before. Returns whether row() now holds an instant of the regression: not for the first sample of a segment, nor
  /// before the filter has settled (FilterDesign::settle).
  bool step(double t, std::span<const double> sample);

  /// The instant at the last sample.
  [[nodiscard]] const FilteredRow& row() const { return row_; }
  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const FilterDesign& design() const { return design_; }
  [[nodiscard]] const Measurement& measurement() const { return measurement_; }
  /// What dY and dy are made of; zeros where nothing was given.
  [[nodiscard]] const SignalErrors& errors() const { return errors_; }

  /// Time of the instant that the row belongs to, s: the sample's, or for angles the middle of the last sampling
  /// interval.
  [[nodiscard]] double instant() const { return t_; }
  /// Speeds of the model's coordinates at that instant, as the filter takes them.
  [[nodiscard]] const Eigen::VectorXd& speed() const { return speed_; }
  /// Speeds of the joints at that instant.
  [[nodiscard]] const Eigen::VectorXd& joint_speed() const {
    return measurement_.motion == MotionKind::angle ? joint_speed_ : joint_;
  }
  /// Heading at that instant, rad: measured where there is a column for it, else odometry from the segment's start.
  [[nodiscard]] double heading() const { return heading_; }

 private:
  // One FOH sample of all signals, at time `t`.
  bool advance(double t);
  void begin(double t);

  struct FunctionTerm {
    std::size_t term;
    Cascade value;
    Cascade error;
    double last_value = 0.0;
    double last_error = 0.0;
  };

  void read_motion(std::span<const double> sample);
  void read_efforts(double t, std::span<const double> sample);
  [[nodiscard]] bool settled() const;
  void evaluate_functions(const Eigen::VectorXd& speed);
  void advance_motion(const StepWeights& w);
  void advance_efforts(const StepWeights& w);
  void write_row();
  [[nodiscard]] double filtered(const Cascade& c) const;

  Model model_;
  FilterDesign design_;
  Measurement measurement_;
  SignalErrors errors_;
  EffortCorrector corrector_;

  StepWeights weights_;
  bool started_ = false;  // a sample of this segment was seen
  bool running_ = false;  // the recursion has its first instant
  bool at_rest_ = false;  // the segment begins at standstill
  double t0_ = 0.0;       // first instant of the recursion
  double t_ = 0.0;        // last instant of the recursion
  double sample_time_ = 0.0;
  double heading_ = 0.0;
  double heading_sample_ = 0.0;
  Eigen::VectorXd joint_, joint_before_, joint_speed_;  // motion as measured
  Eigen::VectorXd joint_effort_;
  Eigen::VectorXd speed_, speed_before_;                  // of coordinates
  Eigen::VectorXd effort_sample_, effort_sample_before_;  // of outputs, as measured
  Eigen::VectorXd effort_, effort_before_;                // of outputs, at the instants of the recursion
  std::vector<Cascade> motion_;                           // driven by the coordinates' speeds
  std::vector<Cascade> slope_;                            // driven by their derivatives
  std::vector<Cascade> torque_;
  std::vector<FunctionTerm> functions_;
  std::vector<double> state_speed_, state_joint_, joint_error_;
  FilteredRow row_;
};

}  // namespace wheelwright
