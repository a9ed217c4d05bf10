// SPDX-License-Identifier: Apache-2.0
/// \file
/// RegressorFilter as C99, with only what one model and one measurement need.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <vector>

#include "model/filter/regressor_filter.hpp"

namespace wheelwright::exporter::c_text {

/// Writes the parts of a header that stand for a filter, and for the elements that it is driven by. Each gives text
/// with `pfx` for the prefix (export_c_text.hpp).
///
/// The C has the library's operations in the library's order. Left out is what adds an exact zero, multiplies by one,
/// or is never looked at; sums of constants alone are done here.
class FilterWriter {
 public:
  /// `bounds`: whether dY and dy are wanted; `sums`: whether elements are for a ScaleDetector, too. Throws InputError
  /// where the filter has no C form.
  FilterWriter(const RegressorFilter& filter, bool bounds, bool sums);

  /// The numbers of the filter, as macros.
  [[nodiscard]] std::string constants() const;
  /// The kernel; types of a sample, a step, an element, and of what elements and the recursion remember.
  [[nodiscard]] std::string types() const;
  /// Members of the state.
  [[nodiscard]] std::string state() const;
  /// Functions: pfx_take_sample and pfx_make, which make elements (ElementFilter); pfx_filter, which takes a sample and
  /// says whether there is a row, and pfx_row, which gives it; pfx_forget, after which the next sample starts a
  /// segment.
  [[nodiscard]] std::string functions() const;
  /// Function pfx_regressor: element_regressor() of model/filter/sample_weights.hpp.
  [[nodiscard]] std::string regressor() const;

  /// Lines of the header's comment: how efforts are taken, when a segment ends, what of libm is called.
  [[nodiscard]] std::string effort_words() const;
  [[nodiscard]] std::string segment_words() const;
  [[nodiscard]] std::string libm_words() const;
  /// True if elements are hats at samples.
  [[nodiscard]] bool nodes() const { return nodes_; }
  /// Which members an element has beside motion, slope, torque: torque_doubt, motion_doubt.
  [[nodiscard]] bool doubted() const { return doubted_; }
  [[nodiscard]] bool moving() const { return moving_; }
  /// True if a segment goes on where rows are lost (ElementFilter::bridges): elements say whether they are known.
  [[nodiscard]] bool bridged() const { return bridged_; }

 private:
  struct FunctionTerm {
    std::size_t term;
    model::TermShape shape;
  };
  class Text;

  [[nodiscard]] bool uses(std::initializer_list<model::TermShape> any) const;
  void conversions(Text& out) const;
  void read(Text& out) const;
  void evaluate(Text& out) const;
  void reach(Text& out) const;
  void solve(Text& out) const;
  void by_dynamics(Text& out) const;
  void find_moving(Text& out) const;
  void follow_flow(Text& out) const;
  void enclose(Text& out) const;
  void describe(Text& out) const;
  void measure_effort(Text& out) const;
  void change(Text& out) const;
  void curve(Text& out) const;
  void make_unknown(Text& out) const;
  void make_hat(Text& out) const;
  void make_step(Text& out) const;
  void make(Text& out) const;
  void cut_out(Text& out) const;
  void advance(Text& out) const;
  void take_sample(Text& out) const;
  void filter(Text& out) const;
  void row(Text& out) const;

  const RegressorFilter& filter_;
  const Model& model_;
  const Measurement& measurement_;
  const filter::SignalErrors& errors_;
  filter::FilterKernel kernel_;
  std::vector<FunctionTerm> functions_;

  // kind of motion; whether signals enter at samples
  bool angle_ = false, mean_ = false, nodes_ = false;
  // efforts
  bool held_ = false, between_ = false;
  // dY and dy are wanted; they hold what happens between samples
  bool bounds_ = false, bounded_ = false;
  // elements are for sums, too
  bool sums_ = false;
  // which bounds on accelerations there are; whether any
  bool mobile_ = false, limited_ = false, moved_ = false;
  // a function looks at it; it has a column
  bool heading_ = false, measured_heading_ = false;
  // a function looks at joints
  bool joints_ = false;
  // signs of speeds are looked at, and what bounds motion may tell that they do not change
  bool sided_ = false;
  // held efforts make a gradient flow of the motion
  filter::FlowKind flow_ = filter::FlowKind::none;
  // there are terms of speeds, of accelerations
  bool viscous_ = false, inertial_ = false;
  // parabola through efforts; all efforts of a step; two halves of a step that differ
  bool linear_ = false, hull_ = false, split_ = false;
  // efforts differ within a step; by how much is wanted; it goes into dy
  bool ranging_ = false, change_ = false, doubt_ = false;
  // the error of interpolated motion goes into dY
  bool interpolated_ = false;
  // elements have these
  bool doubted_ = false, moving_ = false;
  // error of a segment's first slope; weight of its first node; area of the kernel
  bool first_error_ = false, start_ = false, area_ = false;
  // lost rows are known from the length of a step; a segment goes on there, or begins anew
  bool lost_ = false, bridged_ = false, restarted_ = false;
  // what is left out there counts in dy alone; by errors of the motion
  bool rough_ = false, cut_ = false, edge_ = false;
  // of a step's mean
  bool speed_error_ = false, joint_error_ = false;
  std::size_t samples_ = 2;            // that are remembered
  std::size_t ahead_ = 0;              // of which this many are ahead of the step
  Eigen::MatrixXd rate_, joint_from_;  // of StepEnclosure
};

}  // namespace wheelwright::exporter::c_text
