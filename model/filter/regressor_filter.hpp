// SPDX-License-Identifier: Apache-2.0
/// \file
/// Recursive torque filter: from samples to rows {τ_f, Y_f}, for batch and on-line use.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"
#include "model/filter/element_filter.hpp"
#include "model/filter/kernel.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::filter {

/// One instant of the filtered regression (25).
struct FilteredRow {
  core::RowMatrix Y;   ///< n × p, Y_f
  core::RowMatrix dY;  ///< n × p, Δ >= 0
  Eigen::VectorXd y;   ///< n, τ_f
  Eigen::VectorXd dy;  ///< n, n̄ >= 0
};

/// Filters torque and regressor sample by sample: (28) for τ_f, the identities of docs/methods/notation.md for Y_f,
/// with kernels that need no motion between samples for the acceleration, whatever the steps.
///
/// A row is the equation (20) multiplied by a weight w and integrated. For **angles** w goes linearly from one sample
/// to the next, with the values of a smoothed f₂ there (kernel.hpp), from 0 at the first sample of a segment: ẅ is a
/// row of impulses at the samples, and with s_k the mean speed of the step before t_k, h_k its length, without any
/// error
///
///     ∫ w φ̈ dt = Σ w_k (s_k+1 − s_k)
///     ∫ w φ̇ dt = Σ w_k (h_k s_k + h_k+1 s_k+1)/2  + Σ ẇ_k ∫ (s − middle)(φ̇ − s_k) ds,   |∫| <= h_k³/12 sup|φ̈|
///
/// **Mean speeds** are angles at the ends of their intervals, a known half step after their stamps. For **speeds** w is
/// constant over each step, with the mean of f or f₂ over it: ∫ w v̇ dt = Σ w_k (v_k − v_k−1), and the trapezoidal rule
/// for ∫ w v dt. The effort is integrated with the same w:
///
///     held, changes at samples   exactly
///     held, changes between      the mean of both samples of the step; half their difference goes into dy
///     linear, at samples         exactly
///     linear, between            as a parabola through three samples; what makes it differ from the line goes into dy
///     late by an unknown time    the middle of all values that may have acted in the step; half their range goes into
///     dy
///
/// dY and dy hold the sensors' errors (noise.hpp) and, where SignalErrors::between_samples says so, what motion and
/// efforts may do between samples, by SignalErrors::motion. Functions of the motion are then enclosed for every instant
/// of a step. Efforts pass Measurement::correction first; where that has a memory, rows begin when it has forgotten the
/// segment's start too, unless the segment begins at rest without effort. A correction takes efforts as changing at
/// samples.
///
/// step() does not allocate. Batch filtering is this class in a loop, so that both give the same bits.
class RegressorFilter {
 public:
  /// Throws InvalidArgument when `model`, `design` or `measurement` is not valid. `errors` says what dY and dy are.
  RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors = {});

  /// Forgets all samples: the next one starts a segment.
  void restart() { elements_.restart(); }

  /// Takes the sample at time `t` (s): motion of each joint, effort of each joint, heading where
  /// Measurement::heading_column names one (the order of Measurement::columns()). `t` must exceed that of the sample
  /// before. Of a step that is longer than Measurement::longest_step the effort is not known: elements that hold it are
  /// left out of the row (WeakElement::known; dY and dy say what that costs), or the filter restarts
  /// (ElementFilter::bridges). Returns whether row() now holds an instant of the regression: not for the first samples
  /// of a segment, nor before the filter has settled (FilterDesign::settle; after a restart for lost rows, before the
  /// segment's beginning weighs less than the noise of all later samples).
  bool step(double t, std::span<const double> sample);

  /// The instant at the last sample.
  [[nodiscard]] const FilteredRow& row() const { return row_; }
  [[nodiscard]] const Model& model() const { return elements_.model(); }
  [[nodiscard]] const FilterDesign& design() const { return design_; }
  [[nodiscard]] const Measurement& measurement() const { return elements_.measurement(); }
  /// Outputs and parameters of a row.
  [[nodiscard]] std::size_t outputs() const { return model().n(); }
  [[nodiscard]] std::size_t parameters() const { return model().p(); }
  /// What dY and dy are made of; zeros where nothing was given.
  [[nodiscard]] const SignalErrors& errors() const { return elements_.errors(); }

  /// Number of instants since the segment began: one for each step between two samples (for speeds: for each sample)
  /// that the filter has taken.
  [[nodiscard]] std::size_t instants() const { return elements_.instants(); }
  /// Time of the last instant, s: the end of the last step taken.
  [[nodiscard]] double instant() const { return elements_.instant(); }
  /// Speeds of the model's coordinates at that instant: means over the step that ends there, for speeds the sample.
  [[nodiscard]] const Eigen::VectorXd& speed() const { return elements_.speed(); }
  /// Speeds of the joints, alike.
  [[nodiscard]] const Eigen::VectorXd& joint_speed() const { return elements_.joint_speed(); }
  /// Heading at that instant, rad: measured where there is a column for it, else odometry from the segment's start. In
  /// the middle of the step for angles and mean speeds.
  [[nodiscard]] double heading() const { return elements_.heading(); }
  /// True if row() is there only because the segment began at standstill, exactly: other noise might have hidden that.
  [[nodiscard]] bool rests_on_standstill() const {
    return elements_.angles() && elements_.at_rest() &&
           (elements_.instant() - elements_.first_instant()) * design_.beta < design_.settle &&
           errors().joint_sample > 0.0;
  }
  /// Length of the last step, s.
  [[nodiscard]] double step_length() const { return elements_.step_length(); }
  /// With what share of its weight the newest element went into row(): 0 where it is not known, less than 1 for about
  /// 1/(4β) after that (angles).
  [[nodiscard]] double share() const { return share_; }
  /// True if the weights of all elements before the newest were made to end there (KernelBank::cut).
  [[nodiscard]] bool cut() const { return elements_.angles() && elements_.element().run_begins; }
  /// What cutting out steps of unknown effort adds at most to the noise of filtered accelerations, in units of what
  /// noise that is independent from sample to sample makes of them anyway; 0 where no rows were lost.
  [[nodiscard]] double rough() const { return bank_.out()[edge_] * per_edge_; }
  /// ElementFilter::bridges().
  [[nodiscard]] bool bridges() const { return elements_.bridges(); }
  /// rough() per filtered edge.
  [[nodiscard]] double per_edge() const { return per_edge_; }
  /// λ of FilterKernel::soften(), 1/s; 0 where nothing is cut.
  [[nodiscard]] double softness() const { return kernel_.lambda(); }

 private:
  void begin();
  void follow();
  void cut_out(const WeakElement& element);
  [[nodiscard]] bool settled() const;
  void write_row();

  // An entry of Y_f: a multiple of a filtered signal, with a multiple of that signal's error.
  struct Entry {
    std::size_t at = 0;      // of the n × p of a row
    std::size_t signal = 0;  // of motion or slope
    double scale = 1.0;
  };

  ElementFilter elements_;
  FilterDesign design_;
  FilterKernel kernel_;
  double static_gain_ = 1.0;
  // Per coordinate its speed and its slope, per output its torque, an area, the first node alone, functions; and what
  // is in doubt of torque, functions and, for speeds, of the trapezoidal rule.
  KernelBank bank_;
  std::size_t torque_ = 0, area_ = 0, start_ = 0, functions_ = 0;
  std::size_t torque_doubt_ = 0, function_doubt_ = 0, motion_doubt_ = 0;
  // Beside steps of unknown effort, angles: what the weights' slope varies by more, the weights themselves, and what
  // motion_doubt_ gets; the slope of the kernel there. Speeds: what the weights vary by more.
  std::size_t edge_ = 0, whole_ = 0, edge_doubt_ = 0;
  SlopeMajorant turn_;
  double per_edge_ = 0.0;                         // of rough()
  double share_ = 1.0;                            // of the newest element
  double left_ = 0.0, rate_ = 0.0, cross_ = 0.0;  // 1 − share_; slope of the share, and that met by the kernel's own
  double decay_before_ = 0.0, slope_before_ = 0.0;
  std::vector<double> doubt_before_;
  std::vector<Entry> entries_, function_entries_;
  std::vector<double> error_;               // of speeds and slopes
  std::vector<SlopeMajorant> slope_doubt_;  // angles: what motion_doubt_ is for speeds, by the slope of the kernel
  std::vector<double> first_doubt_;         // of a segment's first step, where the kernel rises from 0
  FilteredRow row_;
};

}  // namespace wheelwright::filter

namespace wheelwright {
using filter::RegressorFilter;
}  // namespace wheelwright
