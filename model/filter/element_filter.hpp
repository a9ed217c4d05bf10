// SPDX-License-Identifier: Apache-2.0
/// \file
/// Elements of the weak form: the equation of motion times a short weight, integrated, sample by sample.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "model/filter/effort_correction.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::filter {

/// The equation (20) multiplied by a weight ω and integrated. For angles and mean speeds ω is a hat: 1 at a sample, 0
/// at those before and after it, linear between; with s_k the mean speed of the step before t_k, h_k its length,
///
///     ∫ ω φ̈ dt = s_k+1 − s_k          ∫ ω φ̇ dt = (h_k s_k + h_k+1 s_k+1)/2 + what the slope of ω makes of φ̈
///
/// For speeds ω is 1 in a step and 0 outside. Any weight that is linear between samples (constant in each step) is a
/// sum of these, so that every regression on this equation is made of elements: Σ g_k (element k).
///
/// Where rows are lost nothing is known of the effort in a step. A sum may have any weights: those of the elements that
/// hold such a step are 0, and the equation holds as before. What it costs is that weights fall to 0 and rise again at
/// its edges, where the motion's errors count for more.
struct WeakElement {
  std::size_t number = 0;        ///< from 1 on in a segment
  bool known = true;             ///< false: it holds a step of unknown effort, its weight is 0; what follows is then 0,
                                 ///< but for times, motion_doubt and motion_doubt_before of steps that are known
  double t = 0.0;                ///< s, its sample (angles), the end of its step (speeds)
  double length = 0.0;           ///< s, ∫ ω
  double before = 0.0;           ///< s, from the sample before to its sample (angles); its step (speeds)
  double step = 0.0;             ///< s, from its sample to the next one (angles); its step (speeds)
  Eigen::VectorXd motion;        ///< per coordinate: ∫ ω φ̇
  Eigen::VectorXd slope;         ///< per coordinate: ∫ ω φ̈, exactly
  Eigen::VectorXd torque;        ///< per output: ∫ ω u
  Eigen::VectorXd torque_doubt;  ///< per output: what efforts may do between samples
  /// Per coordinate; speeds: what the trapezoidal rule may miss. Angles: the most that ∫ (s − middle)(φ̇ − s_k) ds is
  /// in the step after the sample, by which the *slope* of a sum's weights is to be multiplied.
  Eigen::VectorXd motion_doubt;
  Eigen::VectorXd motion_doubt_before;      ///< angles: the same of the step before the sample
  bool run_begins = false;                  ///< not known, and the first of a run: the step before is known
  bool run_ends = false;                    ///< not known, and the last of a run: the step behind is known
  std::vector<model::TermValue> functions;  ///< ∫ ω f of each function term, in their order
};

/// Makes elements of samples: reads them as a Measurement says, bounds what may happen between them. Everything that
/// RegressorFilter promises of its signals before they are filtered. step() does not allocate.
class ElementFilter {
 public:
  ElementFilter() = default;
  /// `errors` as for RegressorFilter. Throws InvalidArgument when `model` or `measurement` is not valid.
  ElementFilter(Model model, Measurement measurement, SignalErrors errors = {});

  /// Forgets all samples: the next one starts a segment.
  void restart();

  /// Takes the sample at time `t` (RegressorFilter::step). Returns whether element() is a new one, which may be one
  /// that is not known (WeakElement::known).
  bool step(double t, std::span<const double> sample);

  /// The newest.
  [[nodiscard]] const WeakElement& element() const { return element_; }
  /// True if the last sample was the one with which a segment's first step is known: what was summed up before belongs
  /// to another segment.
  [[nodiscard]] bool began() const { return began_; }

  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const Measurement& measurement() const { return measurement_; }
  [[nodiscard]] const SignalErrors& errors() const { return errors_; }
  /// Numbers of the terms of the model that are functions.
  [[nodiscard]] const std::vector<std::size_t>& functions() const { return functions_; }
  /// True if elements are hats at samples.
  [[nodiscard]] bool angles() const { return angles_; }

  /// RegressorFilter says what these are.
  [[nodiscard]] std::size_t instants() const { return instants_; }
  [[nodiscard]] double instant() const { return t_; }
  [[nodiscard]] double first_instant() const { return t0_; }
  [[nodiscard]] const Eigen::VectorXd& speed() const { return speed_; }
  [[nodiscard]] const Eigen::VectorXd& joint_speed() const { return joint_speed_; }
  [[nodiscard]] double heading() const { return heading_; }
  [[nodiscard]] double step_length() const { return length_; }
  /// The last step.
  [[nodiscard]] const StepMotion& last_step() const { return steps_[newest_step_]; }
  /// True if the segment begins at standstill without effort.
  [[nodiscard]] bool at_rest() const { return at_rest_; }
  /// True if the segment begins after lost rows.
  [[nodiscard]] bool after_loss() const { return after_loss_; }
  /// True if a segment goes on where rows are lost, as SignalErrors::bridges asks for. Where it does not, the filter
  /// restarts there: efforts are corrected by what has a memory, or what the model looks at (a heading by odometry, the
  /// sign of an effort that comes without one) would have to be known in between.
  [[nodiscard]] bool bridges() const { return bridges_; }
  /// Length of the segment's first step, s.
  [[nodiscard]] double first_length() const { return first_length_; }
  /// Efforts' correction.
  [[nodiscard]] const EffortCorrector& corrector() const { return corrector_; }

  /// Weights with which logged efforts stand in the torque of the newest element, of four consecutive samples: from
  /// the one before its own sample on (angles), up to the end of its step (speeds). Not `exact` where torque is no
  /// fixed sum of logged efforts: late by an unknown time, changing at an unknown moment, or corrected.
  struct EffortWeights {
    bool exact = false;
    std::array<double, 4> weight{};  ///< s, oldest first
  };
  [[nodiscard]] EffortWeights effort_weights() const;

 private:
  // What a sample brings: motion and effort of the joints.
  struct Sample {
    double t = 0.0;
    Eigen::VectorXd joint;
    Eigen::VectorXd effort;     // at the stamp
    Eigen::VectorXd over;       // held efforts: what acts in the step that ends at the stamp
    Eigen::VectorXd doubt;      // of a corrected effort in the step that ends at the stamp
    Eigen::VectorXd logged;     // effort
    Eigen::VectorXd own_doubt;  // of the effort at the stamp, where it is sharpened
    bool sharp = true;          // false: the row before it is not known, by which it would be sharpened
    double heading = 0.0;
  };
  // Integrals of a step's effort with weights that fall from 1 to 0 and rise from 0 to 1, over its length; doubt alike.
  struct StepEffort {
    Eigen::VectorXd falling, rising, doubt;
  };

  [[nodiscard]] const Sample& sample(std::size_t age) const {
    return ring_[(newest_ + ring_.size() - age) % ring_.size()];
  }
  // The last step, and the one before it.
  [[nodiscard]] StepMotion& present() { return steps_[newest_step_]; }
  [[nodiscard]] const StepMotion& previous() const { return steps_[1 - newest_step_]; }
  [[nodiscard]] StepEffort& present_effort() { return efforts_[newest_step_]; }
  [[nodiscard]] const StepEffort& previous_effort() const { return efforts_[1 - newest_step_]; }
  void read(double t, std::span<const double> sample);
  void read_effort(Sample& now, std::span<const double> sample);
  void sharpen(Sample& now, const Sample& before);
  [[nodiscard]] bool take();
  bool describe(std::size_t age);
  void measure_motion(const Sample& now, const Sample& before);
  bool measure_effort(std::size_t age);
  [[nodiscard]] bool lost_before(std::size_t age) const;
  [[nodiscard]] bool effort_is_known(std::size_t age) const;
  void effort_of_range(double begin, double end);
  [[nodiscard]] bool effort_is_covered(double end) const;
  void begin();
  void make_hat();
  void make_step();
  void make_unknown();
  void curve_effort(double a, double b, const Eigen::VectorXd& first, const Eigen::VectorXd& middle,
                    const Eigen::VectorXd& last, double corrected, double covered);

  Model model_;
  Measurement measurement_;
  SignalErrors errors_;
  StepEnclosure enclosure_;
  EffortCorrector corrector_;
  bool angles_ = false;    // steps between angles, measured or those behind mean speeds
  std::size_t ahead_ = 0;  // samples that efforts are known ahead of the motion that is filtered
  bool ranged_ = false;    // efforts are late by an unknown time
  Interval sharpening_{};  // Measurement::sharpening()
  double longest_ = 0.0;   // s: in a longer step rows are lost; 0: not known
  bool bridges_ = false;
  std::vector<std::size_t> functions_;

  std::vector<Sample> ring_;
  std::size_t newest_ = 0;
  std::size_t samples_ = 0;  // of this segment
  std::size_t instants_ = 0;
  bool after_loss_ = false;
  bool at_rest_ = false;
  bool began_ = false;

  double t0_ = 0.0;  // first instant
  double t_ = 0.0;   // last instant
  double length_ = 0.0, length_before_ = 0.0;
  double first_length_ = 0.0;
  double heading_ = 0.0;
  Eigen::VectorXd speed_, speed_before_, joint_speed_;
  std::array<StepMotion, 2> steps_;
  std::array<StepEffort, 2> efforts_;
  std::size_t newest_step_ = 0;
  Eigen::VectorXd curve_, curve_doubt_;  // of the efforts about the node
  Eigen::VectorXd low_, high_, scratch_, falling_in_, rising_in_, effort_change_;
  WeakElement element_;
};

}  // namespace wheelwright::filter
