// SPDX-License-Identifier: Apache-2.0
#include "detector/export/export_c_filter.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "detector/export/export_c_text.hpp"

namespace wheelwright::exporter::c_text {

using model::TermShape;

namespace {

constexpr double kOutward = 1.0 + 64.0 * core::kEpsilon;  // kUp of model/filter/motion_bound.cpp
constexpr int kWidenings = 12;                            // kRounds there
constexpr double kAlikeSteps = 0.05;                      // kAlike of model/filter/regressor_filter.cpp

bool any_kind(const Model& model, Term::Kind kind) {
  return std::ranges::any_of(model.terms, [&](const Term& term) { return term.kind == kind; });
}

// The shape, which FilterWriter::evaluate writes.
TermShape c_form(const Model& model, const Term& term) {
  if (term.function.shape() == TermShape::own) {
    throw InputError("export: the term of parameter " + model.parameters[term.parameter].name + " of the model " +
                     model.name +
                     " is a function of its own, which has no C form; expected accelerations, speeds, and the "
                     "functions of differential_drive and single_axis");
  }
  return term.function.shape();
}

bool any_not_zero(const Eigen::VectorXd& x) { return (x.array() != 0.0).any(); }

// Constant tables of StepEnclosure.
Eigen::MatrixXd friction_rate(const Model& model, const filter::MotionBound& bound) {
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  const auto n = static_cast<Eigen::Index>(model.n());
  Eigen::MatrixXd friction = Eigen::MatrixXd::Zero(n, coordinates);
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::speed) {
      friction(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.coordinate)) +=
          std::abs(term.scale) * bound.largest[static_cast<Eigen::Index>(term.parameter)];
    }
  }
  Eigen::MatrixXd rate(coordinates, coordinates);
  for (Eigen::Index c = 0; c < coordinates; ++c) {
    for (Eigen::Index d = 0; d < coordinates; ++d) {
      double sum = bound.mobility(c, 0) * friction(0, d);
      for (Eigen::Index i = 1; i < n; ++i) {
        sum += bound.mobility(c, i) * friction(i, d);
      }
      rate(c, d) = kOutward * sum;
    }
  }
  return rate;
}

Eigen::MatrixXd joints_from_coordinates(const Model& model, const Eigen::VectorXd& limit) {
  const Eigen::MatrixXd inverse = core::pseudo_inverse(model.motion);
  const bool determined =
      (inverse * model.motion - Eigen::MatrixXd::Identity(inverse.rows(), inverse.rows())).cwiseAbs().maxCoeff() < 1e-9;
  Eigen::MatrixXd from = Eigen::MatrixXd::Constant(inverse.rows(), inverse.cols() + 1, core::kInfinity);
  if (determined) {
    from.leftCols(inverse.cols()) = kOutward * inverse.cwiseAbs();
  }
  if (limit.size() > 0) {
    from.col(inverse.cols())
        .setConstant(kOutward * limit.cwiseQuotient(model.motion.cwiseAbs().rowwise().sum()).minCoeff());
  }
  return from;
}

// "scale * ", or nothing for 1.
std::string times(double scale) { return scale == 1.0 ? "" : hex(scale) + " * "; }

}  // namespace

class FilterWriter::Text {
 public:
  void put(std::string_view text) { text_ += text; }
  template <typename... Arguments>
  void line(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    text_ += fmt::format(format, std::forward<Arguments>(arguments)...) + "\n";
  }
  /// The same where `condition` holds.
  template <typename... Arguments>
  void line_if(bool condition, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    if (condition) {
      line(format, std::forward<Arguments>(arguments)...);
    }
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

FilterWriter::FilterWriter(const RegressorFilter& filter, bool bounds, bool sums)
    : filter_(filter),
      model_(filter.model()),
      measurement_(filter.measurement()),
      errors_(filter.errors()),
      kernel_(filter.design(), measurement_.motion, measurement_.nominal_step) {
  if (!measurement_.correction.empty()) {
    throw InputError(
        "export: the robot's effects or the filter of its speeds correct the measured efforts (lag, delay, gain, dead "
        "zone, saturation or speed_filter), which has no C form; expected a model without them");
  }
  if (measurement_.cut) {
    throw InputError("export: speeds that are cut off have no C form; expected a model without `speed_cut`");
  }
  if (measurement_.delay.lower != 0.0 || measurement_.delay.upper != 0.0) {
    throw InputError(fmt::format(
        "export: the efforts are late by {:g} to {:g} s, which has no C form; expected a model whose effort.delay is 0",
        measurement_.delay.lower, measurement_.delay.upper));
  }
  if (measurement_.smoothing.upper > 0.0) {
    throw InputError("export: efforts that are smoothed have no C form; expected a model without effort.smoothing");
  }
  if (measurement_.clock_drift > 0.0) {
    throw InputError(
        "export: the model is read by an even clock behind scattered stamps, which has no C form; expected a model "
        "whose `clock` has no drift, for times that the caller counts by himself");
  }
  for (std::size_t k = 0; k < model_.terms.size(); ++k) {
    if (model_.terms[k].kind == Term::Kind::function) {
      functions_.push_back({k, c_form(model_, model_.terms[k])});
    }
  }
  const filter::MotionBound& motion = errors_.motion;
  angle_ = measurement_.motion == MotionKind::angle;
  mean_ = measurement_.motion == MotionKind::mean_speed;
  nodes_ = kernel_.nodes();
  held_ = measurement_.hold == Hold::zero_order;
  between_ = measurement_.changes == model::EffortChanges::between;
  bounds_ = bounds;
  sums_ = sums;
  bounded_ = errors_.between_samples;
  mobile_ = bounded_ && motion.mobility.size() > 0;
  limited_ = bounded_ && motion.limit.size() > 0;
  moved_ = mobile_ || limited_;
  heading_ = uses({TermShape::along_x, TermShape::along_y});
  measured_heading_ = heading_ && !measurement_.heading_column.empty();
  joints_ = uses({TermShape::sum_of_signs, TermShape::difference_of_signs});
  sided_ = moved_ && (joints_ || uses({TermShape::sign_of_speed}));
  if (moved_ && held_ && !between_ && !mean_ && !measurement_.effort_unsigned && (mobile_ || !nodes_)) {
    flow_ = filter::flow_kind(model_);
  }
  viscous_ = any_kind(model_, Term::Kind::speed);
  inertial_ = any_kind(model_, Term::Kind::acceleration);
  linear_ = !held_ && between_;
  hull_ = held_ && between_ && bounded_;
  split_ = !hull_ && (mean_ ? held_ || !between_ : !held_);
  ranging_ = hull_ || !held_ || mean_;
  doubt_ = bounds_ && bounded_ && (hull_ || linear_);
  doubted_ = doubt_ || (sums_ && (hull_ || linear_));
  change_ = ranging_ && (mobile_ || (doubted_ && (hull_ || !nodes_)));
  interpolated_ = bounds_ && moved_ && viscous_;
  moving_ = (bounds_ || sums_) && moved_ && viscous_;
  lost_ = measurement_.longest_step() > 0.0;
  bridged_ = filter.bridges();
  restarted_ = lost_ && !bridged_;
  first_error_ =
      bounds_ && nodes_ && errors_.joint_sample > 0.0 && lost_ && inertial_ && any_not_zero(errors_.speed_sample);
  start_ = nodes_ && (first_error_ || interpolated_ || restarted_);
  rough_ = bounds_ && bridged_ && !(errors_.joint_sample > 0.0) && any_not_zero(errors_.output);
  cut_ = bounds_ && bridged_ && any_not_zero(errors_.speed_sample) && (inertial_ || (nodes_ && viscous_));
  edge_ = cut_ || rough_;
  area_ = bounds_ && bounded_ && any_not_zero(errors_.output);
  joint_error_ = joints_ || sided_;
  speed_error_ =
      flow_ != filter::FlowKind::none || (mobile_ && viscous_) || heading_ || uses({TermShape::sign_of_speed});
  ahead_ = mean_ ? 1 : 0;
  samples_ = ahead_ + (linear_ && (!mean_ || doubted_) ? 3 : 2);
  if (mobile_) {
    rate_ = friction_rate(model_, motion);
  }
  if (sided_) {
    joint_from_ = joints_from_coordinates(model_, motion.limit);
  }
}

bool FilterWriter::uses(std::initializer_list<TermShape> any) const {
  return std::any_of(functions_.begin(), functions_.end(),
                     [&](const FunctionTerm& f) { return std::find(any.begin(), any.end(), f.shape) != any.end(); });
}

std::string FilterWriter::effort_words() const {
  return fmt::format("{}, changes {}", held_ ? "held" : "linear",
                     between_ ? "between samples, too" : "at samples only");
}

std::string FilterWriter::segment_words() const {
  if (!lost_) {
    return "A time that does not increase restarts the detector.";
  }
  return fmt::format(
      "A time that does not increase, or a gap of more than five steps of {:.6g} s, restarts the\n"
      " * detector; {} of more than {:.6g} s (rows are lost) {}{}.",
      measurement_.nominal_step, bridged_ ? "a step" : "after a step", measurement_.longest_step(),
      bridged_ ? "is left out of what is summed up" : "the filter has to settle anew",
      !(mobile_ && !limited_ && viscous_) || (nodes_ ? rate_.isDiagonal(0.0) : flow_ == filter::FlowKind::separate) ? ""
      : bridged_ ? ".\n * The filter has to settle anew after a step that is too long for the robot's friction"
                 : ", as it has after a step\n * that is too long for the robot's friction");
}

std::string FilterWriter::libm_words() const {
  return fmt::format("exp (when the step changes), fabs{}{}", measurement_.count > 0.0 ? ", round" : "",
                     heading_ ? ", cos, sin" : "");
}

std::string FilterWriter::constants() const {
  Text out;
  const FilterDesign& design = filter_.design();
  out.line("#define PFX_SAMPLES {}    /* that are remembered */", samples_);
  out.line("#define PFX_BETA {} /* 1/s */", hex(design.beta));
  out.line("#define PFX_GAIN {} /* alpha to the power of the order */", hex(kernel_.gain()));
  if (kernel_.gamma() > 0.0) {
    const double apart = kernel_.gamma() - design.beta;
    out.line("#define PFX_GAMMA {} /* 1/s, of the smoothing */", hex(kernel_.gamma()));
    out.line("#define PFX_SLOW {}", hex(kernel_.slow()));
    out.line("#define PFX_QUICK {}", hex(kernel_.gamma() / (apart * apart)));
  }
  out.line_if((interpolated_ || cut_) && nodes_, "#define PFX_SLOPE {} /* gain of the kernel's slope */",
              hex(kernel_.gain() * kernel_.majorant_gain()));
  out.line_if(area_, "#define PFX_STATIC_GAIN {}", hex(design.static_gain()));
  out.line_if(nodes_, "#define PFX_SETTLE {} /* rows before this over beta are left out */", hex(design.settle));
  out.line_if(nodes_ && restarted_, "#define PFX_SETTLED_START {} /* ... unless the beginning weighs less */",
              hex(1.0 + std::exp(-2.0)));
  out.line_if(measurement_.count > 0.0, "#define PFX_COUNT {} /* speeds are whole multiples of this */",
              hex(measurement_.count));
  if (lost_) {
    out.line("#define PFX_NOMINAL {} /* s, step of the log */", hex(measurement_.nominal_step));
    out.line("#define PFX_GAP {} /* s: a longer step starts anew */", hex(5.0 * measurement_.nominal_step));
    out.line("#define PFX_LONGEST {} /* s: in a longer step rows are lost */", hex(measurement_.longest_step()));
    out.line_if(bridged_ && nodes_, "#define PFX_SOFT {} /* 1/s, of weights beside steps that are left out */",
                hex(filter_.softness()));
    out.line_if(rough_, "#define PFX_ROUGH {} /* noise beside that of a whole row, where steps are left out */",
                hex(filter_.per_edge()));
  }
  out.line_if(moved_, "#define PFX_UP {} /* above the rounding of a handful of sums */", hex(kOutward));
  return out.take();
}

std::string FilterWriter::types() const {
  Text out;
  out.put(!nodes_                           ? (filter_.design().order == 1 ? kFirstOrderKernel : kSpeedKernel)
          : bridged_                        ? kSoftKernel
          : measurement_.nominal_step > 0.0 ? kSmoothKernel
                                            : kNodeKernel);
  out.put("\n");
  out.put(kFade);
  out.line("    if (fabs(x) < {}) {{", hex(filter::kTrace));
  out.put(kFaded);
  if ((interpolated_ || cut_) && nodes_) {
    out.put(kMajorant);
    out.put("\n");
  }
  out.put("/* What a sample brings. */\ntypedef struct pfx_sample {\n");
  out.line("  double t; /* s */");
  out.line("  double joint[PFX_JOINTS], effort[PFX_JOINTS];");
  out.line_if(measured_heading_, "  double heading; /* rad */");
  out.put("} pfx_sample;\n\n/* One step between two samples. */\ntypedef struct pfx_span {\n");
  out.line("  double length; /* s */");
  out.line_if(bridged_, "  int known; /* 0: efforts in it are not */");
  out.line("  double speed[PFX_COORDINATES]; /* mean over the step */");
  out.line_if(speed_error_, "  double speed_error[PFX_COORDINATES]; /* what the samples are wrong by */");
  out.line_if(joint_error_, "  double joint_speed[PFX_JOINTS], joint_error;");
  out.line_if(sided_, "  int moving[PFX_JOINTS]; /* it never stands or turns round in the step */");
  out.line_if(heading_, "  double heading; /* rad, in its middle */");
  out.line_if(uses({TermShape::along_x}), "  double along_x; /* square of its cosine */");
  out.line_if(uses({TermShape::along_y}), "  double along_y; /* square of its sine */");
  if (moved_) {
    out.line("  double acceleration[PFX_COORDINATES]; /* its size is at most this in the step */");
    out.line("  double departure[PFX_COORDINATES]; /* speeds are within this of their mean */");
  }
  if (flow_ != filter::FlowKind::none) {
    out.line("  int steady; /* coordinates go one way, less and less fast */");
    out.line_if(!nodes_, "  double gain[PFX_COORDINATES], bow[PFX_COORDINATES]; /* of the speed; of its mean */");
  }
  out.line_if(!functions_.empty(),
              "  double term[{0}], term_error[{0}]; /* functions of the motion, at every instant */",
              functions_.size());
  out.line("  double falling[PFX_CHANNELS]{}; /* effort, with weights that fall from 1 to 0{} */",
           split_ ? ", rising[PFX_CHANNELS]" : "", split_ ? ", rise from 0 to 1" : " (and rise)");
  out.line_if(mobile_,
              "  double effort[PFX_CHANNELS], effort_error[PFX_CHANNELS]; /* its middle, and how far from it */");
  out.line_if(change_, "  double change[PFX_CHANNELS]; /* half the range of efforts in the step */");
  out.put("} pfx_span;\n\n/* What samples were so far. */\ntypedef struct pfx_elements {\n");
  out.line("  int samples, instants; /* samples, and instants of the recursion, in this segment: counted up to 3 */");
  out.line("  int began; /* with the last sample a segment's first step is known */");
  if (nodes_) {
    out.line("  int at_rest{}; /* the segment began at standstill{} */", restarted_ ? ", after_loss" : "",
             restarted_ ? ", after lost rows" : "");
  } else {
    out.line("  double speed[PFX_COORDINATES], speed_before[PFX_COORDINATES]; /* at the last two samples */");
  }
  out.line("  double t0, t; /* first and last instant of the recursion, s */");
  out.line("  pfx_sample sample[PFX_SAMPLES]; /* newest first */");
  out.line("  pfx_span span[2];               /* the last two steps; which of them is the last */");
  out.line("  int newest;");
  out.put(
      "} pfx_elements;\n\n/* The equation of motion times a weight, integrated: a hat at a sample, or a whole step. "
      "*/\ntypedef struct pfx_element {\n");
  out.line("  double t, length, before, step; /* s: its instant, integral of the weight, steps around it */");
  out.line_if(bridged_, "  int known; /* 0: it holds a step of unknown effort and is left out */");
  out.line_if(bridged_, "  int run_begins{}; /* it is the first such{} */", nodes_ ? ", run_ends" : "",
              nodes_ ? ", the last" : "");
  out.line_if(viscous_, "  double motion[PFX_COORDINATES]; /* of the speeds */");
  out.line_if(inertial_, "  double slope[PFX_COORDINATES]; /* of their derivatives */");
  out.line("  double torque[PFX_CHANNELS]{};", doubted_ ? ", torque_doubt[PFX_CHANNELS]" : "");
  out.line_if(moving_, "  double motion_doubt[PFX_COORDINATES]{}; /* speeds between samples */",
              sums_ && nodes_ ? ", motion_doubt_before[PFX_COORDINATES]" : "");
  out.line_if(!functions_.empty(), "  double term[{0}], term_error[{0}]; /* functions of the motion */",
              functions_.size());
  out.put(
      "} pfx_element;\n\n/* What the recursion remembers: zeros at the start of a segment. */\ntypedef struct "
      "pfx_memory {\n");
  out.line_if(viscous_, "  pfx_cascade motion[PFX_COORDINATES]; /* driven by the speeds */");
  out.line_if(inertial_, "  pfx_cascade slope[PFX_COORDINATES]; /* driven by their derivatives */");
  out.line("  pfx_cascade torque[PFX_CHANNELS];");
  out.line_if(!functions_.empty(), "  pfx_cascade term[{0}]{1}; /* functions of the motion */", functions_.size(),
              bounds_ ? fmt::format(", term_error[{}]", functions_.size()) : "");
  out.line_if(doubt_, "  pfx_cascade torque_doubt[PFX_CHANNELS];");
  if (interpolated_ && nodes_) {
    out.line("  pfx_majorant motion_doubt[PFX_COORDINATES]; /* speeds between samples */");
    out.line("  double first_doubt[PFX_COORDINATES]; /* the same in the first step */");
  } else if (interpolated_) {
    out.line("  pfx_cascade motion_doubt[PFX_COORDINATES]; /* speeds between samples */");
  }
  out.line_if(area_, "  pfx_cascade area; /* of the kernel */");
  if (bridged_ && nodes_) {
    out.line("  double left, decay_before; /* part of the weight that the newest element lacks; of the step before */");
    out.line_if(edge_ || interpolated_, "  double slope_before; /* of such a part */");
    out.line_if(edge_, "  double rate, cross; /* slope of that part; what it makes of the weights' own */");
    out.line_if(interpolated_, "  double doubt_before[PFX_COORDINATES];");
    out.line_if(interpolated_, "  pfx_cascade edge_doubt[PFX_COORDINATES];");
    out.line_if(cut_, "  pfx_cascade whole; /* by how much weights vary more */");
    out.line_if(cut_, "  pfx_majorant turn; /* slope of the kernel where it is cut */");
  }
  out.line_if(edge_, "  pfx_cascade edge; /* by how much {} */", nodes_ ? "their slope does" : "weights vary more");
  if (start_) {
    out.line("  pfx_cascade start; /* weight of the segment's beginning */");
    out.line("  double first_length; /* s, of the first step */");
  }
  out.put("} pfx_memory;\n");
  return out.take();
}

std::string FilterWriter::state() const {
  Text out;
  out.line("  pfx_elements elements;");
  out.line("  pfx_weights weights;");
  out.line("  pfx_memory memory;");
  out.line("  int fading; /* elements since pfx_fade */");
  return out.take();
}

void FilterWriter::conversions(Text& out) const {
  if (uses({TermShape::sum_of_signs, TermShape::difference_of_signs}) || measurement_.effort_unsigned) {
    out.put("\nstatic inline double pfx_signum(double x)\n{\n  return (double)(x > 0.0) - (double)(x < 0.0);\n}\n");
  }
  if (change_ || hull_) {
    out.put(
        "\nstatic inline double pfx_min(double a, double b)\n{\n  return b < a ? b : a;\n}\n"
        "\nstatic inline double pfx_max(double a, double b)\n{\n  return a < b ? b : a;\n}\n");
  }
  out.put(
      "\n/* From joints to coordinates. */\nstatic inline void pfx_coordinates(const double *joint, double "
      "*speed)\n{\n");
  for (std::size_t c = 0; c < model_.coordinates.size(); ++c) {
    out.line("  speed[{}] = {}; /* {} */", c, combination(model_.motion, c, "joint"), plain(model_.coordinates[c]));
  }
  out.put(
      "}\n\n/* From joints to channels. */\nstatic inline void pfx_channels(const double *joint, double "
      "*channel)\n{\n");
  for (std::size_t i = 0; i < model_.n(); ++i) {
    out.line("  channel[{}] = {}; /* {} */", i, combination(model_.input, i, "joint"), plain(model_.outputs[i]));
  }
  out.put("}\n");
  if (change_ || (doubted_ && linear_)) {
    out.put("\n/* The same for sizes. */\nstatic inline void pfx_sizes(const double *joint, double *channel)\n{\n");
    for (std::size_t i = 0; i < model_.n(); ++i) {
      out.line("  channel[{}] = {};", i, combination(model_.input.cwiseAbs(), i, "joint"));
    }
    out.put("}\n");
  }
}

void FilterWriter::read(Text& out) const {
  out.put("\nstatic inline void pfx_read(pfx_elements *s, double t, const double *input)\n{\n");
  out.line("  pfx_sample *now = &s->sample[0];");
  out.line("  int i;");
  out.line("  for (i = PFX_SAMPLES - 1; i > 0; --i) {{");
  out.line("    s->sample[i] = s->sample[i - 1];");
  out.line("  }}");
  out.line("  s->samples += s->samples < 3;");
  out.line("  now->t = t;");
  out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
  out.line("    now->joint[i] = {};",
           measurement_.count > 0.0 ? "round(input[i] / PFX_COUNT) * PFX_COUNT" : "input[i]");
  if (measurement_.effort_unsigned) {
    out.line("    /* Only the size of the effort is known; its sign is that of the motion. */");
    out.line("    now->effort[i] = fabs(input[PFX_JOINTS + i]) *");
    out.line("                     pfx_signum({});",
             angle_ ? "s->samples > 1 ? now->joint[i] - s->sample[1].joint[i] : 0.0" : "now->joint[i]");
  } else {
    out.line("    now->effort[i] = input[PFX_JOINTS + i];");
  }
  out.line("  }}");
  out.line_if(measured_heading_, "  now->heading = input[PFX_INPUTS - 1];");
  out.put("}\n");
}

void FilterWriter::evaluate(Text& out) const {
  reach(out);
  if (functions_.empty()) {
    return;
  }
  const bool first_speed = uses({TermShape::along_x, TermShape::along_y, TermShape::sign_of_speed});
  const int turning = heading_ && moved_ ? model_.heading_coordinate : -1;
  const bool joints_in_doubt = joints_ && (moved_ || errors_.joint_sample > 0.0);
  const auto widened = [&](int c) {
    return moved_ ? fmt::format("PFX_UP * (p->speed_error[{0}] + p->departure[{0}])", c)
                  : fmt::format("p->speed_error[{}]", c);
  };
  out.put(
      "\n/* Functions of the motion, and by how much each can be wrong, for every instant of the step. */\n"
      "static inline void pfx_evaluate(pfx_span *p)\n{\n");
  out.line_if(turning >= 0, "  const double half = 0.5 * p->length;");
  out.line_if(first_speed, "  const double speed_error = {};", widened(0));
  if (heading_) {
    const std::string turned =
        turning < 0 ? ""
                    : fmt::format(" + PFX_UP * half * (fabs(p->speed[{}]) +\n      {})", turning, widened(turning));
    out.line("  const double heading_error = {}{};", hex(errors_.heading), turned);
    out.line("  const double share_error = heading_error < 1.0 ? heading_error : 1.0;");
  }
  if (joints_) {
    out.line("  double sign[2]{};", joints_in_doubt ? ", doubt[2]" : "");
    out.line("  int i;");
    out.line("  for (i = 0; i < 2; ++i) {{");
    if (joints_in_doubt && moved_) {
      out.line("    const double error = p->moving[i] ? 0.0 : pfx_joint_reach(p, i, p->departure);");
    } else if (joints_in_doubt) {
      out.line("    const double error = p->joint_error;");
    }
    if (joints_in_doubt) {
      out.line("    doubt[i] = error > 0.0 && fabs(p->joint_speed[i]) <= error ? 1.0 : 0.0;");
      out.line("    sign[i] = doubt[i] > 0.0 ? 0.0 : pfx_signum(p->joint_speed[i]);");
    } else {
      out.line("    sign[i] = pfx_signum(p->joint_speed[i]);");
    }
    out.line("  }}");
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Term& term = model_.terms[functions_[k].term];
    const std::string scale = times(term.scale), size = times(std::abs(term.scale));
    out.line("  /* {} in {} */", plain(model_.parameters[term.parameter].name), plain(model_.outputs[term.output]));
    switch (functions_[k].shape) {
      case TermShape::along_x:
      case TermShape::along_y: {
        const std::string share = functions_[k].shape == TermShape::along_x ? "p->along_x" : "p->along_y";
        out.line("  p->term[{}] = {}({} * p->speed[0]);", k, scale, share);
        out.line("  p->term_error[{0}] = {1}(({2} + share_error < 1.0 ? {2} + share_error : 1.0) * speed_error +", k,
                 size, share);
        out.line("      share_error * fabs(p->speed[0]));");
        break;
      }
      case TermShape::sum_of_signs:
      case TermShape::difference_of_signs:
        out.line("  p->term[{}] = {}(sign[0] {} sign[1]);", k, scale,
                 functions_[k].shape == TermShape::sum_of_signs ? "+" : "-");
        if (joints_in_doubt) {
          out.line("  p->term_error[{}] = {}(doubt[0] + doubt[1]);", k, size);
        } else {
          out.line("  p->term_error[{}] = 0.0;", k);
        }
        break;
      case TermShape::sign_of_speed:
        out.line("  {{");
        out.line("    const int doubt = {}fabs(p->speed[0]) <= speed_error;",
                 sided_ && model_.coordinates.size() == 1 && model_.joints.size() == 1 ? "!p->moving[0] && " : "");
        out.line("    p->term[{}] = doubt ? 0.0 : p->speed[0] > 0.0 ? {} : {};", k, hex(term.scale), hex(-term.scale));
        out.line("    p->term_error[{}] = doubt ? {} : 0.0;", k, hex(std::abs(term.scale)));
        out.line("  }}");
        break;
      case TermShape::constant:
        out.line("  p->term[{}] = {};", k, hex(term.scale));
        out.line("  p->term_error[{}] = 0.0;", k);
        break;
      case TermShape::own: break;  // refused by c_form
    }
  }
  out.put("}\n");
}

// a = N(b(a) + F a h/2), solved for the viscous part.
void FilterWriter::solve(Text& out) const {
  const filter::MotionBound& motion = errors_.motion;
  const std::size_t coordinates = model_.coordinates.size();
  const bool apart = rate_.isDiagonal(0.0);
  out.put(
      "\n/* Bounds on accelerations: the inverse inertia, and that times viscous friction, over the feasible set. "
      "*/\n");
  out.line("static const double pfx_mobility[PFX_COORDINATES][PFX_CHANNELS] = {};", numbers(motion.mobility));
  out.line_if(viscous_, "static const double pfx_rate[PFX_COORDINATES][PFX_COORDINATES] = {};", numbers(rate_));
  out.put(
      "\n/* A parameter of at most `largest` times a value moves the ends of a force; `either`: it may be below 0. */\n"
      "static inline void pfx_push(double *high, double *low, double largest, double value, double error, int either)"
      "\n{\n");
  out.line("  double below = error - value, above = error + value;");
  out.line("  if (either) {{");
  out.line("    below = above = below < above ? above : below;");
  out.line("  }}");
  out.line("  *high += largest * (below < 0.0 ? 0.0 : below);");
  out.line("  *low += largest * (above < 0.0 ? 0.0 : above);");
  out.put(
      "}\n\n/* Accelerations by efforts and friction, where the speed is its mean. */\n"
      "static inline void pfx_force(const pfx_span *p, double *next)\n{\n");
  out.line("  double force[PFX_CHANNELS], low[PFX_CHANNELS];");
  out.line("  int c, i;");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    force[i] = p->effort[i] + p->effort_error[i];");
  out.line("    low[i] = p->effort_error[i] - p->effort[i];");
  out.line("  }}");
  std::size_t k = 0;
  for (const Term& term : model_.terms) {
    if (term.kind == Term::Kind::acceleration) {
      continue;
    }
    const model::Parameter& parameter = model_.parameters[term.parameter];
    const std::string value = term.kind == Term::Kind::speed
                                  ? fmt::format("{0}p->speed[{1}], {2}p->speed_error[{1}]", times(term.scale),
                                                term.coordinate, times(std::abs(term.scale)))
                                  : fmt::format("p->term[{0}], p->term_error[{0}]", k);
    k += term.kind == Term::Kind::function ? 1 : 0;
    out.line("  pfx_push(&force[{0}], &low[{0}], {1}, {2}, {3}); /* {4} */", term.output,
             hex(motion.largest[static_cast<Eigen::Index>(term.parameter)]), value, parameter.never_negative ? 0 : 1,
             plain(parameter.name));
  }
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    force[i] = force[i] < low[i] ? low[i] : force[i];");
  out.line("  }}");
  out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
  out.line("    next[c] = pfx_mobility[c][0] * force[0];");
  out.line("    for (i = 1; i < PFX_CHANNELS; ++i) {{");
  out.line("      next[c] += pfx_mobility[c][i] * force[i];");
  out.line("    }}");
  out.line("  }}");
  out.put(
      "}\n\n/* Bounds the accelerations in the step by all forces; 0 where it is too long for the robot's friction. "
      "*/\n"
      "static inline int pfx_solve(const pfx_span *p, double *next)\n{\n");
  out.line_if(viscous_ && !(apart && nodes_), "  const double half = 0.5 * p->length;");
  out.line("  int c;");
  out.line("  pfx_force(p, next);");
  if (viscous_ && apart && nodes_) {
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    const double longer = 1.0 + p->length * pfx_rate[c][c] / 6.0;");
    out.line("    next[c] *= 2.0 < longer ? 2.0 : longer;");
    out.line("  }}");
  } else if (viscous_ && apart) {
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    const double left = 1.0 - half * pfx_rate[c][c];");
    out.line("    if (!(left > 0.0)) {{");
    out.line("      return 0;");
    out.line("    }}");
    out.line("    next[c] /= left;");
    out.line("  }}");
  } else if (viscous_ && coordinates == 2) {
    out.line("  {{");
    out.line("    const double a = 1.0 - half * pfx_rate[0][0], d = 1.0 - half * pfx_rate[1][1];");
    out.line("    const double b = half * pfx_rate[0][1], c01 = half * pfx_rate[1][0], determinant = a * d - b * c01;");
    out.line("    double x;");
    out.line("    if (!(a > 0.0 && d > 0.0 && determinant > 0.0)) {{");
    out.line("      return 0;");
    out.line("    }}");
    out.line("    x = (d * next[0] + b * next[1]) / determinant;");
    out.line("    next[1] = (c01 * next[0] + a * next[1]) / determinant;");
    out.line("    next[0] = x;");
    out.line("  }}");
  } else if (viscous_) {
    Eigen::VectorXd sums(rate_.rows());
    for (Eigen::Index c = 0; c < rate_.rows(); ++c) {
      sums[c] = rate_.row(c).sum();
    }
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    static const double rate[PFX_COORDINATES] = {};", numbers(sums));
    out.line("    const double left = 1.0 - half * rate[c];");
    out.line("    if (!(left > 0.0)) {{");
    out.line("      return 0;");
    out.line("    }}");
    out.line("    next[c] /= left;");
    out.line("  }}");
  }
  if (coordinates > 2 && !apart) {
    out.line("  for (c = 1; c < PFX_COORDINATES; ++c) {{");
    out.line("    next[0] = next[0] < next[c] ? next[c] : next[0];");
    out.line("  }}");
    out.line("  for (c = 1; c < PFX_COORDINATES; ++c) {{");
    out.line("    next[c] = next[0];");
    out.line("  }}");
  }
  out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
  out.line("    next[c] *= PFX_UP;");
  out.line("  }}");
  out.line("  return 1;");
  out.put("}\n");
}

// StepEnclosure::by_dynamics(); `settled` where accelerations are solved for.
void FilterWriter::by_dynamics(Text& out) const {
  const bool functions = !functions_.empty();
  const auto depart = [&](const char* indent) {
    out.line("{}for (c = 0; c < PFX_COORDINATES; ++c) {{", indent);
    out.line("{}  p->departure[c] = half * p->acceleration[c];", indent);
    out.line("{}}}", indent);
    out.line_if(functions, "{}pfx_evaluate(p);", indent);
  };
  out.put(
      "\n/* Bounds the motion in the step by forces and inertia, and by the limit; 0 where nothing does. */\n"
      "static inline int pfx_by_dynamics(pfx_span *p)\n{\n");
  if (limited_) {
    out.line("  static const double limit[PFX_COORDINATES] = {};", numbers(errors_.motion.limit));
  }
  out.line("  const double half = 0.5 * p->length;");
  out.line_if(mobile_ && functions, "  double next[PFX_COORDINATES];");
  out.line("  int c{};", !mobile_ ? "" : functions ? ", round, settled = 0" : ", settled");
  if (mobile_ && functions) {
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    p->acceleration[c] = 0.0;");
    out.line("  }}");
    depart("  ");
    out.line("  if (pfx_solve(p, next)) {{");
    out.line("    /* Functions grow with the speed: widened until they agree with what they were evaluated for. */");
    out.line("    for (round = 0; round < {} && !settled; ++round) {{", kWidenings);
    out.line("      for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("        p->acceleration[c] = (round < 2 ? 1.0 : 1.5) * next[c];");
    out.line("      }}");
    depart("      ");
    out.line("      settled = pfx_solve(p, next);");
    out.line("      for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("        settled = settled && next[c] <= p->acceleration[c];");
    out.line("      }}");
    out.line("    }}");
    out.line("  }}");
  } else if (mobile_) {
    out.line("  settled = pfx_solve(p, p->acceleration);");
  }
  if (limited_) {
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    p->acceleration[c] = {};",
             mobile_ ? "!settled || limit[c] < p->acceleration[c] ? limit[c] : p->acceleration[c]" : "limit[c]");
    out.line("  }}");
    depart("  ");
    out.line("  return 1;");
  } else {
    out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
    out.line("    p->acceleration[c] = settled ? p->acceleration[c] : HUGE_VAL;");
    out.line("    p->departure[c] = half * p->acceleration[c];");
    out.line("  }}");
    out.line("  return settled;");
  }
  out.put("}\n");
}

// StepEnclosure::joint_reach(), moves() and all_move().
void FilterWriter::reach(Text& out) const {
  if (!sided_) {
    return;
  }
  out.put(
      "\n/* By how much the speed of a joint may differ from its mean, where coordinates stay within `departure`. */\n"
      "static inline double pfx_joint_reach(const pfx_span *p, int j, const double *departure)\n{\n");
  const Eigen::Index coordinates = joint_from_.cols() - 1;
  out.line("  static const double joint_from[PFX_JOINTS][PFX_COORDINATES] = {};",
           numbers(Eigen::MatrixXd(joint_from_.leftCols(coordinates))));
  out.line("  double faster = 0.0;");
  out.line("  int c;");
  out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
  out.line("    faster += departure[c] > 0.0 ? joint_from[j][c] * departure[c] : 0.0;");
  out.line("  }}");
  if (limited_) {
    out.line("  const double most = 0.5 * p->length * {};", hex(joint_from_(0, coordinates)));
    out.line("  faster = most < faster ? most : faster;");
  }
  out.line("  return PFX_UP * (p->joint_error + faster);");
  out.put(
      "}\n\n/* Whether a joint neither stands nor turns round. */\n"
      "static inline int pfx_moves(const pfx_span *p, int j, const double *departure)\n{\n");
  out.line("  return p->moving[j] || fabs(p->joint_speed[j]) > pfx_joint_reach(p, j, departure);");
  out.put("}\n");
  if (flow_ != filter::FlowKind::none) {
    out.put("\nstatic inline int pfx_all_move(const pfx_span *p, const double *departure)\n{\n");
    out.line("  int j, all = 1;");
    out.line("  for (j = 0; j < PFX_JOINTS && all; ++j) {{");
    out.line("    all = pfx_moves(p, j, departure);");
    out.line("  }}");
    out.line("  return all;");
    out.put("}\n");
  }
}

void FilterWriter::find_moving(Text& out) const {
  out.put(
      "\n/* Joints that move on through the step, by the forces on them while they do; whether there are any more. */\n"
      "static inline int pfx_find_moving(pfx_span *p)\n{\n");
  out.line("  double next[PFX_COORDINATES];");
  out.line("  int j, c{}, any = 0, tried = 0, more = 1;", viscous_ ? ", d" : "");
  out.line("  while (more) {{");
  out.line("    more = 0;");
  out.line("    for (j = 0; j < PFX_JOINTS; ++j) {{");
  out.line("      if (pfx_moves(p, j, p->departure) || !(fabs(p->joint_speed[j]) > p->joint_error)) {{");
  out.line("        continue;");
  out.line("      }}");
  out.line("      tried = p->moving[j] = 1;");
  out.line("      pfx_evaluate(p);");
  out.line("      pfx_force(p, next);");
  out.line("      for (c = 0; c < PFX_COORDINATES; ++c) {{");
  if (viscous_) {
    out.line("        for (d = 0; d < PFX_COORDINATES; ++d) {{");
    out.line("          next[c] += pfx_rate[c][d] * p->departure[d];");
    out.line("        }}");
  }
  out.line("        next[c] *= PFX_UP * 0.5 * p->length;");
  out.line("      }}");
  out.line("      p->moving[j] = 0;");
  out.line("      if (pfx_moves(p, j, next)) {{");
  out.line("        any = more = p->moving[j] = 1;");
  out.line("      }}");
  out.line("    }}");
  out.line("  }}");
  out.line("  if (tried && !any) {{");
  out.line("    pfx_evaluate(p);");
  out.line("  }}");
  out.line("  return any;");
  out.put("}\n");
}

void FilterWriter::follow_flow(Text& out) const {
  out.put(
      fmt::format("\n/* What a gradient flow leaves of the departures: coordinates go one way, less and less fast. */\n"
                  "static inline void pfx_follow_flow(pfx_span *p{})\n{{\n",
                  nodes_ ? ", const pfx_span *before" : ""));
  const bool predicts = nodes_ && flow_ == filter::FlowKind::by_signs && sided_;
  out.line("  double next[PFX_COORDINATES]{};", predicts ? ", ahead[PFX_COORDINATES]" : "");
  const bool asks = sided_ && (flow_ == filter::FlowKind::by_signs || (!nodes_ && mobile_));
  out.line("  int c{};", predicts ? ", moving, j" : asks ? ", moving" : "");
  out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
  if (nodes_) {
    out.line("    next[c] = HUGE_VAL;");
    out.line("    if (before && before->steady) {{");
    out.line("      const double apart = fabs(p->speed[c] - before->speed[c]) + p->speed_error[c] +");
    out.line("                           before->speed_error[c];");
    out.line("      const double push = pfx_mobility[c][c] * (fabs(p->effort[c] - before->effort[c]) +");
    out.line("                          p->effort_error[c] + before->effort_error[c]);");
    out.line("      next[c] = PFX_UP * (apart + 0.5 * before->length * push) / (1.0 + before->length / p->length);");
    if (predicts) {
      out.line("      ahead[c] = before->departure[c] +");
      out.line("                 p->length * (2.0 * before->departure[c] / before->length + push);");
    }
    out.line("    }}");
  } else {
    out.line("    next[c] = PFX_UP * (0.5 * fabs(p->gain[c]) + p->speed_error[c]);");
  }
  out.line("  }}");
  if (predicts) {
    out.line("  moving = before && before->steady;");
    out.line("  for (j = 0; j < PFX_JOINTS && moving; ++j) {{");
    out.line("    moving = fabs(before->joint_speed[j]) > pfx_joint_reach(before, j, ahead) &&");
    out.line("             fabs(p->joint_speed[j]) > p->joint_error;");
    out.line("  }}");
    out.line("  for (j = 0; j < PFX_JOINTS; ++j) {{");
    out.line("    p->moving[j] = moving || p->moving[j];");
    out.line("  }}");
  }
  out.line_if(asks, "  moving = pfx_all_move(p, p->departure){};", nodes_ ? "" : " || pfx_all_move(p, next)");
  out.line("  p->steady = {};", flow_ == filter::FlowKind::separate || !sided_ ? "1" : "moving");
  out.line("  if (!p->steady) {{");
  out.line("    return;");
  out.line("  }}");
  out.line("  for (c = 0; c < PFX_COORDINATES; ++c) {{");
  out.line("    p->departure[c] = next[c] < p->departure[c] ? next[c] : p->departure[c];");
  if (!nodes_) {
    const std::string least = "p->length * pfx_rate[c][c] / 12.0";
    out.line("    p->bow[c] = PFX_UP * 2.0 * next[c] * ({});",
             !mobile_    ? "0.5"
             : !viscous_ ? (sided_ ? "moving ? 0.0 : 0.5" : "0.0")
                         : fmt::format("{0}{1} < 0.5 ? {1} : 0.5", sided_ ? "moving && " : "", least));
  }
  out.line("  }}");
  out.put("}\n");
}

void FilterWriter::enclose(Text& out) const {
  if (!moved_) {
    return;
  }
  const bool flows = flow_ != filter::FlowKind::none, finds = mobile_ && sided_;
  if (mobile_) {
    solve(out);
  }
  by_dynamics(out);
  if (finds) {
    find_moving(out);
  }
  if (flows) {
    follow_flow(out);
  }
  out.put(
      fmt::format("\n/* Bounds the motion in the step; 0 where that cannot be done. */\n"
                  "static inline int pfx_enclose(pfx_span *p{})\n{{\n",
                  flows && nodes_ ? ", const pfx_span *before" : ""));
  const bool loops = sided_ || flows;
  out.line_if(loops, "  int i, finite = 1;");
  if (flows) {
    out.line("  p->steady = 0;");
    if (!nodes_) {
      out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
      out.line("    p->bow[i] = HUGE_VAL;");
      out.line("  }}");
    }
  }
  if (sided_) {
    out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    out.line("    p->moving[i] = 0;");
    out.line("  }}");
  }
  if (!loops) {
    out.line("  return pfx_by_dynamics(p);");
    out.put("}\n");
    return;
  }
  if (finds) {
    out.line("  if (pfx_by_dynamics(p) && pfx_find_moving(p)) {{");
    out.line("    pfx_by_dynamics(p);");
    out.line("  }}");
  } else {
    out.line("  pfx_by_dynamics(p);");
  }
  if (flows) {
    out.line("  pfx_follow_flow(p{});", nodes_ ? ", before" : "");
    if (!functions_.empty()) {
      out.line("  if (p->steady) {{");
      out.line("    pfx_evaluate(p);");
      out.line("  }}");
    }
  }
  out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line("    finite = finite && p->departure[i] < HUGE_VAL;");
  out.line("  }}");
  out.line("  return finite;");
  out.put("}\n");
}

// Effort in the step: what the hold makes of the samples around it.
void FilterWriter::measure_effort(Text& out) const {
  const auto joint_loop = [&](const std::string& falling, const std::string& rising) {
    out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    if (change_ || hull_) {
      const std::string last = mean_ && (hull_ || !held_) ? "next->effort[i]" : "";
      out.line("    double low = pfx_min(before->effort[i], now->effort[i]);");
      out.line("    double high = pfx_max(before->effort[i], now->effort[i]);");
      if (!last.empty()) {
        out.line("    low = pfx_min(low, {});", last);
        out.line("    high = pfx_max(high, {});", last);
      }
    }
    out.line("    falling[i] = {};", falling);
    out.line_if(split_, "    rising[i] = {};", rising);
    out.line_if(change_, "    range[i] = 0.5 * (high - low);");
    out.line("  }}");
  };
  if (hull_) {
    joint_loop("0.25 * (low + high)", "");
  } else if (!mean_ && held_) {
    joint_loop("0.5 * before->effort[i]", "");
  } else if (!mean_) {
    joint_loop("(2.0 * before->effort[i] + now->effort[i]) / 6.0", "(before->effort[i] + 2.0 * now->effort[i]) / 6.0");
  } else if (held_) {
    joint_loop("(3.0 * before->effort[i] + now->effort[i]) / 8.0", "(before->effort[i] + 3.0 * now->effort[i]) / 8.0");
  } else if (between_) {
    joint_loop("0.5 * now->effort[i]", "");
  } else {
    joint_loop("(5.0 * before->effort[i] + 18.0 * now->effort[i] + next->effort[i]) / 48.0",
               "(before->effort[i] + 18.0 * now->effort[i] + 5.0 * next->effort[i]) / 48.0");
  }
  out.line("  pfx_channels(falling, p->falling);");
  out.line_if(split_, "  pfx_channels(rising, p->rising);");
  out.line_if(change_, "  pfx_sizes(range, p->change);");
  if (mobile_) {
    const bool noisy = any_not_zero(errors_.motion.effort);
    out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    out.line_if(noisy, "    static const double noise[PFX_CHANNELS] = {};", numbers(errors_.motion.effort));
    out.line("    p->effort[i] = p->falling[i] + p->{}[i];", split_ ? "rising" : "falling");
    out.line("    p->effort_error[i] = {}{}{};", change_ ? "p->change[i]" : "", change_ && noisy ? " + " : "",
             noisy     ? "noise[i]"
             : change_ ? ""
                       : "0.0");
    out.line("  }}");
  }
}

void FilterWriter::describe(Text& out) const {
  const bool odometry = heading_ && !measured_heading_ && model_.heading_coordinate >= 0;
  const bool next = mean_ && (hull_ ? true : !held_ && (!between_ || change_));
  const bool step_error = nodes_ && errors_.joint_sample > 0.0;
  const bool before = !mean_ || !lost_ || bridged_ || measured_heading_ || held_ || change_ || split_;
  out.put(
      "\n/* The step between two samples, as far as they tell; 0 where no bounds on its motion can be given. */\n"
      "static inline int pfx_describe(pfx_elements *s)\n{\n");
  out.line(
      "  const pfx_sample *now = &s->sample[{}]{};", ahead_,
      (before ? fmt::format(", *before = &s->sample[{}]", ahead_ + 1) : "") + (next ? ", *next = &s->sample[0]" : ""));
  out.line_if(odometry || (flow_ != filter::FlowKind::none && nodes_),
              "  const pfx_span *last = &s->span[!s->newest];");
  out.line("  pfx_span *p = &s->span[s->newest];");
  const bool gains = flow_ != filter::FlowKind::none && !nodes_;
  out.line("  double joint_speed[PFX_JOINTS], falling[PFX_JOINTS]{}{}{};", split_ ? ", rising[PFX_JOINTS]" : "",
           change_ ? ", range[PFX_JOINTS]" : "", gains ? ", gain[PFX_JOINTS]" : "");
  out.line("  int i;");
  if (mean_ && bridged_) {
    out.line("  p->length = now->t - before->t > PFX_LONGEST ? now->t - before->t : PFX_NOMINAL;");
  } else {
    out.line("  p->length = {};", mean_ && lost_ ? "PFX_NOMINAL" : "now->t - before->t");
  }
  out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
  out.line("    joint_speed[i] = {};", angle_  ? "(now->joint[i] - before->joint[i]) / p->length"
                                       : mean_ ? "now->joint[i]"
                                               : "0.5 * (before->joint[i] + now->joint[i])");
  out.line_if(joint_error_, "    p->joint_speed[i] = joint_speed[i];");
  out.line_if(gains, "    gain[i] = now->joint[i] - before->joint[i];");
  out.line("  }}");
  out.line("  pfx_coordinates(joint_speed, p->speed);");
  out.line_if(gains, "  pfx_coordinates(gain, p->gain);");
  if (speed_error_ || joint_error_) {
    const std::string nominal = hex(measurement_.nominal_step);
    const auto error = [&](double sample) {
      return step_error ? fmt::format("{} / p->length * {}", lost_ ? "PFX_NOMINAL" : nominal, hex(sample))
                        : hex(sample);
    };
    for (std::size_t c = 0; speed_error_ && c < model_.coordinates.size(); ++c) {
      out.line("  p->speed_error[{}] = {};", c, error(errors_.speed_sample[static_cast<Eigen::Index>(c)]));
    }
    out.line_if(joint_error_, "  p->joint_error = {};", error(errors_.joint_sample));
  }
  if (heading_) {
    if (measured_heading_) {
      out.line("  p->heading = 0.5 * (before->heading + now->heading);");
    } else if (odometry) {
      out.line(
          "  p->heading = s->instants == {0} ? 0.0 : last->heading + 0.5 * (last->length * last->speed[{1}] +\n"
          "      p->length * p->speed[{1}]);",
          nodes_ ? 0 : 1, model_.heading_coordinate);
    } else {
      out.line("  p->heading = 0.0;");
    }
    for (const bool x : {true, false}) {
      if (uses({x ? TermShape::along_x : TermShape::along_y})) {
        out.line("  {{");
        out.line("    const double c = {}(p->heading);", x ? "cos" : "sin");
        out.line("    p->{} = c * c;", x ? "along_x" : "along_y");
        out.line("  }}");
      }
    }
  }
  if (bridged_) {
    out.line("  p->known = !(now->t - before->t > PFX_LONGEST{});",
             mean_ && !(held_ && !between_) ? " || s->sample[0].t - now->t > PFX_LONGEST" : "");
    out.line("  if (!p->known) {{");
    if (moved_) {
      out.line("    for (i = 0; i < PFX_COORDINATES; ++i) {{");
      out.line("      p->departure[i] = 0.0;");
      out.line("    }}");
    }
    out.line("    return 1;");
    out.line("  }}");
  }
  measure_effort(out);
  if (moved_) {
    const bool follows = flow_ != filter::FlowKind::none && nodes_;
    const std::string last = fmt::format(", s->instants > 0{} ? last : 0", bridged_ ? " && last->known" : "");
    out.line("  return pfx_enclose(p{});", follows ? last : "");
  } else {
    out.line_if(!functions_.empty(), "  pfx_evaluate(p);");
    out.line("  return 1;");
  }
  out.put("}\n");
}

// By how much an acceleration can change within a step between speeds.
void FilterWriter::change(Text& out) const {
  if (nodes_ || !moving_ || !mobile_) {
    return;
  }
  const bool exact = held_ && !between_;
  out.put("\n/* By how much the acceleration c can change within the step. */\n");
  out.line("static inline double pfx_change(const pfx_span *p, int c)\n{{");
  out.line("  double change = 0.0;");
  out.line("  int i;");
  if (!exact) {
    const bool noisy = any_not_zero(errors_.motion.effort);
    out.line_if(noisy, "  static const double noise[PFX_CHANNELS] = {};", numbers(errors_.motion.effort));
    out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    out.line("    change += pfx_mobility[c][i] * (2.0 * {});", noisy ? "(p->change[i] + noise[i])" : "p->change[i]");
    out.line("  }}");
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Term& term = model_.terms[functions_[k].term];
    out.line("  change += pfx_mobility[c][{}] * {} * 2.0 * p->term_error[{}];", term.output,
             hex(errors_.motion.largest[static_cast<Eigen::Index>(term.parameter)]), k);
  }
  out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line("    change += pfx_rate[c][i] * p->acceleration[i] * p->length;");
  out.line("  }}");
  out.line("  return PFX_UP * change;");
  out.put("}\n");
}

// Linear efforts that may change between samples: as a parabola through three.
void FilterWriter::curve(Text& out) const {
  if (!linear_ || (mean_ && !doubted_)) {
    return;
  }
  if (mean_) {
    out.put(
        "\n/* What makes the efforts around the last node differ from a line, h seconds long. */\n"
        "static inline void pfx_curve(const pfx_elements *s, double h, double *doubt)\n{\n");
    out.line("  double bend[PFX_JOINTS];");
    out.line("  int i;");
    out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    out.line("    bend[i] = fabs(s->sample[3].effort[i] - s->sample[2].effort[i] - s->sample[1].effort[i] +");
    out.line("                   s->sample[0].effort[i]) / 48.0;");
    out.line("  }}");
    out.line("  pfx_sizes(bend, doubt);");
    out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    out.line("    doubt[i] *= h;");
    out.line("  }}");
    out.put("}\n");
    return;
  }
  out.put("\n/* Curvature of a parabola through the last three efforts, a and b seconds apart, times what it corrects");
  out.put(doubted_ ? ",\n * and its size times what is in doubt. */\n" : ". */\n");
  out.line(
      "static inline void pfx_curve(const pfx_elements *s, double a, double b, double corrected, double *curve{})\n{{",
      doubted_ ? ",\n                             double covered, double *doubt" : "");
  out.line("  double bend[PFX_JOINTS];");
  out.line("  int i;");
  out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
  out.line("    const double middle = s->sample[1].effort[i];");
  out.line(
      "    bend[i] = 2.0 * ((s->sample[0].effort[i] - middle) / b - (middle - s->sample[2].effort[i]) / a) / (a + b);");
  out.line("  }}");
  out.line("  pfx_channels(bend, curve);");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    curve[i] *= corrected;");
  out.line("  }}");
  if (doubted_) {
    out.line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    out.line("    bend[i] = fabs(bend[i]);");
    out.line("  }}");
    out.line("  pfx_sizes(bend, doubt);");
    out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    out.line("    doubt[i] *= covered;");
    out.line("  }}");
  }
  out.put("}\n");
}

// The element where efforts of a step of it are not known.
void FilterWriter::make_unknown(Text& out) const {
  if (!bridged_) {
    return;
  }
  const bool doubts = moving_ && nodes_;
  out.put(
      "\n/* The same where the efforts of a step are not known. */\n"
      "static inline void pfx_make_unknown(const pfx_elements *s, pfx_element *e)\n{\n");
  out.line("  const pfx_span *p = &s->span[s->newest], *last = &s->span[!s->newest];");
  out.line("  const double h = p->length;");
  out.line_if(doubts, "  int i;");
  out.line("  memset(e, 0, sizeof *e);");
  out.line("  e->t = s->t{};", nodes_ ? " - h" : "");
  out.line("  e->before = {};", nodes_ ? "last->length" : "h");
  out.line("  e->step = h;");
  out.line("  e->run_begins = {}last->known;", nodes_ ? "" : "s->instants == 2 || ");
  out.line_if(nodes_, "  e->run_ends = p->known;");
  if (doubts) {
    out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
    out.line("    e->motion_doubt[i] = pfx_moment(p, i);");
    out.line_if(sums_, "    e->motion_doubt_before[i] = pfx_moment(last, i);");
    out.line("  }}");
  }
  out.put("}\n");
}

void FilterWriter::make_hat(Text& out) const {
  const char* rising = split_ ? "rising" : "falling";
  out.put(
      "\n/* The node between the last two steps, and the way to the end of the last. */\n"
      "static inline void pfx_make(const pfx_elements *s, pfx_element *e)\n{\n");
  out.line("  const pfx_span *p = &s->span[s->newest], *last = &s->span[!s->newest];");
  out.line("  const double h = p->length, before = last->length;");
  const bool curved = linear_ && angle_;
  if (curved) {
    out.line("  const double least = 2.0 * pfx_cube(before < h ? before : h) / 24.0;");
    out.line_if(doubted_, "  const double rest = (pfx_cube(h) + pfx_cube(before)) / 24.0 - least;");
    out.line("  double curve[PFX_CHANNELS];");
  }
  out.line("  int i;");
  if (bridged_) {
    out.line("  if (!p->known || !last->known) {{");
    out.line("    pfx_make_unknown(s, e);");
    out.line("    return;");
    out.line("  }}");
    out.line("  e->known = 1;");
    out.line("  e->run_begins = e->run_ends = 0;");
  }
  if (curved) {
    out.line("  pfx_curve(s, before, h, least, curve{});",
             doubted_ ? ", least < rest ? rest : least, e->torque_doubt" : "");
  } else if (linear_ && doubted_) {
    out.line("  pfx_curve(s, h, e->torque_doubt);");
  }
  out.line("  e->t = s->t - h;");
  out.line("  e->length = 0.5 * (before + h);");
  out.line("  e->before = before;");
  out.line("  e->step = h;");
  out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line_if(viscous_, "    e->motion[i] = 0.5 * (before * last->speed[i] + h * p->speed[i]);");
  out.line_if(inertial_, "    e->slope[i] = p->speed[i] - last->speed[i];");
  out.line_if(moving_, "    e->motion_doubt[i] = pfx_moment(p, i);");
  out.line_if(moving_ && sums_, "    e->motion_doubt_before[i] = pfx_moment(last, i);");
  out.line("  }}");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    e->torque[i] = before * last->{}[i] + h * p->falling[i]{};", rising, curved ? " - curve[i]" : "");
  out.line_if(doubted_ && !linear_, "    e->torque_doubt[i] = 0.5 * (before * last->change[i] + h * p->change[i]);");
  out.line("  }}");
  if (!functions_.empty()) {
    out.line("  for (i = 0; i < {}; ++i) {{", functions_.size());
    out.line("    e->term[i] = 0.5 * (before * last->term[i] + h * p->term[i]);");
    out.line("    e->term_error[i] = 0.5 * (before * last->term_error[i] + h * p->term_error[i]);");
    out.line("  }}");
  }
  out.put("}\n");
}

void FilterWriter::make_step(Text& out) const {
  out.put(
      "\n/* The step between the last two samples. */\n"
      "static inline void pfx_make(const pfx_elements *s, pfx_element *e)\n{\n");
  out.line("  const pfx_span *p = &s->span[s->newest]{};", linear_ ? ", *last = &s->span[!s->newest]" : "");
  out.line("  const double h = p->length;");
  out.line_if(linear_, "  double curve[PFX_CHANNELS];");
  out.line("  int i;");
  if (bridged_) {
    out.line("  if (!p->known) {{");
    out.line("    pfx_make_unknown(s, e);");
    out.line("    return;");
    out.line("  }}");
    out.line("  e->known = 1;");
    out.line("  e->run_begins = 0;");
  }
  if (linear_) {
    out.line("  if (s->instants > 2) {{");
    out.line("    const int even = fabs(h - last->length) <= {} * h;", hex(kAlikeSteps));
    out.line("    pfx_curve(s, last->length, h, even ? pfx_cube(h) / 12.0 : 0.0, curve{});",
             doubted_ ? ", pfx_cube(h) / 12.0, e->torque_doubt" : "");
    out.line("  }} else {{");
    out.line("    for (i = 0; i < PFX_CHANNELS; ++i) {{");
    out.line("      curve[i] = 0.0;");
    out.line_if(doubted_, "      e->torque_doubt[i] = h * p->change[i];");
    out.line("    }}");
    out.line("  }}");
  }
  out.line("  e->t = s->t;");
  out.line("  e->length = e->before = e->step = h;");
  out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line_if(viscous_, "    e->motion[i] = h * p->speed[i];");
  out.line_if(inertial_, "    e->slope[i] = s->speed[i] - s->speed_before[i];");
  if (moving_) {
    const bool flows = flow_ != filter::FlowKind::none;
    out.line("    e->motion_doubt[i] = {};", flows ? "p->bow[i] * h" : "HUGE_VAL");
    out.line("    if (p->acceleration[i] < HUGE_VAL) {{");
    out.line("      const double most = 0.25 * p->acceleration[i], change = 0.125 * {};",
             mobile_ ? "pfx_change(p, i)" : "(2.0 * p->acceleration[i])");
    out.line("      const double doubt = (change < most ? change : most) * h * h;");
    out.line("      e->motion_doubt[i] = doubt < e->motion_doubt[i] ? doubt : e->motion_doubt[i];");
    out.line("    }}");
  }
  out.line("  }}");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    e->torque[i] = h * (p->falling[i] + p->{}[i]){};", split_ ? "rising" : "falling",
           linear_ ? " - curve[i]" : "");
  out.line_if(doubted_ && !linear_, "    e->torque_doubt[i] = h * p->change[i];");
  out.line("  }}");
  if (!functions_.empty()) {
    out.line("  for (i = 0; i < {}; ++i) {{", functions_.size());
    out.line("    e->term[i] = h * p->term[i];");
    out.line("    e->term_error[i] = h * p->term_error[i];");
    out.line("  }}");
  }
  out.put("}\n");
}

void FilterWriter::make(Text& out) const {
  if (linear_ && !mean_) {
    out.put("\nstatic inline double pfx_cube(double x)\n{\n  return x * x * x;\n}\n");
  }
  if (moving_ && nodes_) {
    out.put(
        "\n/* First moment of a step's speed about its middle, at most. */\n"
        "static inline double pfx_moment(const pfx_span *p, int c)\n{\n"
        "  return p->departure[c] * p->length * p->length / 6.0;\n}\n");
  }
  make_unknown(out);
  curve(out);
  if (nodes_) {
    make_hat(out);
  } else {
    change(out);
    make_step(out);
  }
}

// RegressorFilter::cut_out().
void FilterWriter::cut_out(Text& out) const {
  if (!bridged_ || !nodes_) {
    return;
  }
  out.put(
      "\n/* Weights end before elements that are left out and begin behind them, each by and by. */\n"
      "static inline void pfx_cut_out(pfx_memory *m, const pfx_weights *w, const pfx_element *e)\n{\n");
  const bool slopes = edge_ || interpolated_;
  out.line("  const double decay = w->soft{};", slopes ? ", gone = 1.0 - decay, slope = gone / e->step" : "");
  out.line_if(slopes, "  const int goes_on = e->known || e->run_ends;");
  out.line("  double left = 1.0{}{};", edge_ ? ", edge = 0.0" : "", cut_ ? ", whole = 0.0, turn = 0.0" : "");
  out.line_if(slopes, "  double rate;");
  out.line("  int i;");
  out.line("  if (e->run_begins) {{");
  out.line_if(edge_, "    edge = 2.0 * (m->slope_before + m->cross);");
  out.line_if(cut_, "    whole = turn = 1.0;");
  out.line("    for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line_if(viscous_, "      pfx_cut(&m->motion[i]);");
  out.line_if(inertial_, "      pfx_cut(&m->slope[i]);");
  out.line("    }}");
  out.line("    for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("      pfx_cut(&m->torque[i]);");
  out.line_if(doubt_, "      pfx_cut(&m->torque_doubt[i]);");
  out.line("    }}");
  if (!functions_.empty()) {
    out.line("    for (i = 0; i < {}; ++i) {{", functions_.size());
    out.line("      pfx_cut(&m->term[i]);");
    out.line_if(bounds_, "      pfx_cut(&m->term_error[i]);");
    out.line("    }}");
  }
  out.line_if(area_, "    pfx_cut(&m->area);");
  out.line_if(start_, "    pfx_cut(&m->start);");
  out.line("  }}");
  out.line("  if (e->known) {{");
  out.line("    left = m->decay_before * m->left;");
  out.line_if(cut_, "    turn += 2.0 * (m->left - left);");
  out.line_if(cut_, "    whole += m->left - left;");
  out.line("  }}");
  out.line_if(slopes, "  rate = goes_on ? left * slope : 0.0;");
  if (edge_) {
    out.line("  if (goes_on) {{");
    out.line("    edge += fabs(rate - m->rate);");
    out.line("  }}");
  }
  if (interpolated_) {
    out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
    out.line(
        "    pfx_take(&m->edge_doubt[i], w, (e->run_begins ? m->doubt_before[i] : 0.0) + rate * e->motion_doubt[i]);");
    out.line("    m->doubt_before[i] = goes_on ? decay * m->doubt_before[i] + slope * e->motion_doubt[i] : 0.0;");
    out.line("  }}");
  }
  if (edge_) {
    out.line("  m->cross = goes_on ? decay * m->cross + left * gone * slope : 0.0;");
    out.line("  pfx_take(&m->edge, w, edge);");
    out.line("  m->rate = rate;");
  }
  if (cut_) {
    out.line("  pfx_take(&m->whole, w, whole);");
    out.line("  pfx_majorant_take(&m->turn, w->decay, PFX_BETA * e->step, turn);");
  }
  out.line("  m->left = left;");
  out.line("  m->decay_before = decay;");
  out.line_if(slopes, "  m->slope_before = slope;");
  out.put("}\n");
}

void FilterWriter::advance(Text& out) const {
  out.put(
      "\n/* An element goes through the filter. */\n"
      "static inline void pfx_advance(pfx_state *s, const pfx_element *e)\n{\n");
  out.line("  const pfx_weights *w = &s->weights;");
  out.line("  pfx_memory *m = &s->memory;");
  out.line_if(bridged_ && nodes_, "  double share; /* of the element's weight */");
  out.line("  int i;");
  out.line("  s->fading = (s->fading + 1) % {};", filter::kFade);
  out.line("  if (s->fading == 0) {{");
  out.line("    pfx_fade(m, sizeof *m);");
  out.line("  }}");
  const std::string share = bridged_ && nodes_ ? "share * " : "";
  if (bridged_ && nodes_) {
    out.line("  pfx_cut_out(m, w, e);");
    out.line("  share = e->known && m->left > 0.0 ? 1.0 - m->left : 1.0;");
  }
  out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
  out.line_if(viscous_, "    pfx_take(&m->motion[i], w, {}e->motion[i]);", share);
  out.line_if(inertial_, "    pfx_take(&m->slope[i], w, {}e->slope[i]);", share);
  out.line_if(interpolated_ && nodes_,
              "    pfx_majorant_take(&m->motion_doubt[i], w->decay, PFX_BETA * e->step, e->motion_doubt[i]);");
  out.line_if(interpolated_ && !nodes_, "    pfx_take(&m->motion_doubt[i], w, e->motion_doubt[i]);");
  out.line("  }}");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    pfx_take(&m->torque[i], w, {}e->torque[i]);", share);
  out.line_if(doubt_, "    pfx_take(&m->torque_doubt[i], w, {}e->torque_doubt[i]);", share);
  out.line("  }}");
  if (!functions_.empty()) {
    out.line("  for (i = 0; i < {}; ++i) {{", functions_.size());
    out.line("    pfx_take(&m->term[i], w, {}e->term[i]);", share);
    out.line_if(bounds_, "    pfx_take(&m->term_error[i], w, {}e->term_error[i]);", share);
    out.line("  }}");
  }
  out.line_if(area_, "  pfx_take(&m->area, w, {}e->length);", share);
  out.line_if(start_, "  pfx_take(&m->start, w, s->elements.instants == 2 ? 1.0 : 0.0);");
  out.line_if(edge_ && !nodes_, "  pfx_take(&m->edge, w, e->run_begins ? 2.0 : 0.0);");
  out.put("}\n");
}

void FilterWriter::take_sample(Text& out) const {
  out.put(
      "\n/* Whether all of a sample are finite numbers: one that is not is taken for lost. */\n"
      "static inline int pfx_whole(double t, const double *input)\n{\n");
  out.line("  double sum = t - t; /* of zeros, unless one of them is none */");
  out.line("  int i;");
  out.line("  for (i = 0; i < PFX_INPUTS; ++i) {{");
  out.line("    sum += input[i] - input[i];");
  out.line("  }}");
  out.line("  return sum == 0.0;");
  out.put("}\n");
  out.put("\n/* The next sample starts a segment. */\nstatic inline void pfx_forget(pfx_elements *s)\n{\n");
  out.line("  s->samples = s->instants = 0;");
  out.line_if(nodes_ && restarted_, "  s->after_loss = 0;");
  out.put(
      "}\n\n/* Takes one sample; whether there is an element. */\n"
      "static inline int pfx_take_sample(pfx_elements *s, double t, const double *input)\n{\n");
  out.line_if(nodes_, "  const pfx_span *p;");
  out.line("  int i;");
  out.line("  s->began = 0;");
  if (restarted_) {
    out.line("  if (s->samples > 0 && t - s->sample[0].t > PFX_LONGEST) {{ /* nothing is known of the effort in it */");
    out.line("    pfx_forget(s);");
    out.line_if(nodes_, "    s->after_loss = 1;");
    out.line("  }}");
  }
  out.line("  pfx_read(s, t, input);");
  if (nodes_) {
    out.line("  if (s->samples < {}) {{", 2 + ahead_);
    out.line("    return 0;");
    out.line("  }}");
  } else {
    out.line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
    out.line("    s->speed_before[i] = s->speed[i];");
    out.line("  }}");
    out.line("  pfx_coordinates(s->sample[0].joint, s->speed);");
    out.line("  if (s->instants == 0) {{");
    out.line("    s->instants = 1;");
    out.line("    s->t0 = s->t = t;");
    out.line("    return 0;");
    out.line("  }}");
  }
  out.line("  s->newest = !s->newest;");
  out.line("  if (!pfx_describe(s)) {{");
  out.line("    s->samples = s->instants = 0;");
  out.line("    return 0;");
  out.line("  }}");
  out.line_if(nodes_, "  p = &s->span[s->newest];");
  out.line("  s->instants += s->instants < 3;");
  out.line("  s->t = s->sample[{}].t{};", ahead_,
           !mean_     ? ""
           : bridged_ ? " + 0.5 * PFX_NOMINAL"
                      : " + 0.5 * p->length");
  out.line("  if (s->instants == {}) {{", nodes_ ? 1 : 2);
  out.line("    s->began = 1;");
  if (nodes_) {
    out.line("    s->at_rest = {};", bridged_ ? "p->known" : "1");
    out.line("    for (i = 0; i < PFX_COORDINATES; ++i) {{");
    out.line("      s->at_rest = s->at_rest && fabs(p->speed[i]) <= 0.0;");
    out.line("    }}");
    out.line("    s->t0 = s->t;");
    out.line("    return 0;");
  }
  out.line("  }}");
  out.line("  return 1;");
  out.put("}\n");
}

void FilterWriter::filter(Text& out) const {
  out.put(
      "\n/* Takes one sample; whether there is a row. */\n"
      "static inline int pfx_filter(pfx_state *s, double t, const double *input)\n{\n");
  const bool first_doubt = interpolated_ && nodes_;
  out.line("  pfx_elements *all = &s->elements;");
  out.line("  pfx_element element;");
  out.line_if(nodes_, "  double since;");
  out.line("  const int any = pfx_take_sample(all, t, input);");
  out.line("  const pfx_span *p = &all->span[all->newest];");
  out.line("  if (all->began) {{");
  out.line_if(first_doubt, "    int i;");
  out.line("    memset(&s->memory, 0, sizeof s->memory);");
  out.line("    s->fading = 0;");
  out.line_if(start_, "    s->memory.first_length = p->length;");
  out.line_if(bridged_ && nodes_ && (edge_ || interpolated_),
              "    s->memory.slope_before = (1.0 - exp(-PFX_SOFT * p->length)) / p->length;");
  if (first_doubt) {
    out.line("    for (i = 0; i < PFX_COORDINATES; ++i) {{");
    out.line("      s->memory.first_doubt[i] = p->departure[i] * p->length / 6.0;");
    out.line("    }}");
  }
  out.line("  }}");
  out.line("  if (!any) {{");
  out.line("    return 0;");
  out.line("  }}");
  out.line("  pfx_prepare(&s->weights, p->length);");
  out.line("  pfx_make(all, &element);");
  out.line("  pfx_advance(s, &element);");
  if (nodes_) {
    out.line("  since = all->t - all->t0;");
    out.line("  return all->at_rest || since * PFX_BETA >= PFX_SETTLE{};",
             restarted_
                 ? " ||\n         (all->after_loss && since * PFX_BETA >= 1.0 &&\n"
                   "          pfx_value(&s->memory.start) / (PFX_GAIN * s->memory.first_length) <= PFX_SETTLED_START)"
                 : "");
  } else {
    out.line("  return 1;");
  }
  out.put("}\n");
}

void FilterWriter::row(Text& out) const {
  out.put(bounds_ ? "\n/* Filtered regressor and torque, and the bounds dy and torque_error on their errors. */\n"
                    "static inline void pfx_row(const pfx_state *s, double y[PFX_CHANNELS][PFX_PARAMETERS],\n"
                    "                           double dy[PFX_CHANNELS][PFX_PARAMETERS], double *torque, "
                    "double *torque_error)\n{\n"
                  : "\n/* Filtered regressor and torque. */\n"
                    "static inline void pfx_row(const pfx_state *s, double y[PFX_CHANNELS][PFX_PARAMETERS], "
                    "double *torque)\n{\n");
  out.line("  const pfx_memory *m = &s->memory;");
  const bool start = bounds_ && (first_error_ || (interpolated_ && nodes_));
  out.line_if(start, "  const double start = pfx_value(&m->start);");
  if (first_error_) {
    out.line(
        "  /* The kernel rises from 0 to the weight of the first node: the slope of that has errors of its own. */");
    out.line("  const double first = start > 0.0 ? start * PFX_NOMINAL / m->first_length : 0.0;");
  }
  if (cut_) {
    out.line("  /* What is left out: in units of the error of a sample of the speed. */");
    if (nodes_) {
      out.line("  const double half = 0.5 * PFX_NOMINAL;");
      out.line_if(inertial_,
                  "  const double edge = half * (pfx_value(&m->edge) + PFX_SLOPE * pfx_majorant_value(&m->turn));");
      out.line_if(viscous_, "  const double whole = half * pfx_value(&m->whole);");
    } else {
      out.line("  const double edge = pfx_value(&m->edge);");
    }
  }
  const std::string rougher = rough_ ? "(1.0 + pfx_value(&m->edge) * PFX_ROUGH)" : "";
  if (area_) {
    out.line("  const double gain = pfx_value(&m->area) / PFX_STATIC_GAIN, area = {};",
             rough_ ? "(1.0 < gain ? gain : 1.0) *\n      " + rougher : "1.0 < gain ? gain : 1.0");
  } else if (rough_) {
    out.line("  const double area = {}; /* errors of the motion are not known */", rougher);
  }
  out.line("  int i, j;");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  if (bounds_) {
    out.line("    static const double noise[PFX_CHANNELS] = {};", numbers(errors_.output));
  }
  out.line("    for (j = 0; j < PFX_PARAMETERS; ++j) {{");
  out.line("      y[i][j] = {}0.0;", bounds_ ? "dy[i][j] = " : "");
  out.line("    }}");
  out.line("    torque[i] = pfx_value(&m->torque[i]);");
  out.line_if(bounds_, "    torque_error[i] = {}noise[i]{};", area_ || rough_ ? "area * " : "",
              doubt_ ? " + pfx_value(&m->torque_doubt[i])" : "");
  out.line("  }}");
  for (const Term& term : model_.terms) {
    if (term.kind == Term::Kind::function) {
      continue;
    }
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    const bool speed = term.kind == Term::Kind::speed;
    out.line("  y[{}][{}] += {}pfx_value(&m->{}[{}]); /* {} */", term.output, term.parameter, times(term.scale),
             speed ? "motion" : "slope", term.coordinate, plain(model_.parameters[term.parameter].name));
    const double constant = speed ? errors_.speed[c] : errors_.acceleration[c];
    std::string error = hex(constant);
    const bool cut = speed && cut_ && nodes_;
    if (cut) {
      error += fmt::format(" + whole * {}", hex(errors_.speed_sample[c]));
    }
    if (speed && interpolated_) {
      error += nodes_ ? fmt::format(
                            " + (PFX_SLOPE * pfx_majorant_value(&m->motion_doubt[{0}]) +\n"
                            "      start * m->first_doubt[{0}]{1})",
                            term.coordinate,
                            bridged_ ? fmt::format(" + pfx_value(&m->edge_doubt[{}])", term.coordinate) : "")
                      : fmt::format(" + pfx_value(&m->motion_doubt[{}])", term.coordinate);
    } else if (!speed && (first_error_ || cut_)) {
      error += fmt::format(" + {} * {}",
                           !cut_          ? "first"
                           : first_error_ ? "(first + edge)"
                                          : "edge",
                           hex(errors_.speed_sample[c]));
    } else if (constant == 0.0 && !cut) {
      continue;
    }
    const double scale = std::abs(term.scale);
    out.line_if(bounds_, "  dy[{}][{}] += {};", term.output, term.parameter,
                scale == 1.0 ? error : hex(scale) + " * (" + error + ")");
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Term& term = model_.terms[functions_[k].term];
    out.line("  y[{}][{}] += pfx_value(&m->term[{}]); /* {} */", term.output, term.parameter, k,
             plain(model_.parameters[term.parameter].name));
    out.line_if(bounds_, "  dy[{}][{}] += pfx_value(&m->term_error[{}]);", term.output, term.parameter, k);
  }
  out.put("}\n");
}

std::string FilterWriter::functions() const {
  Text out;
  conversions(out);
  read(out);
  evaluate(out);
  enclose(out);
  describe(out);
  make(out);
  take_sample(out);
  cut_out(out);
  advance(out);
  filter(out);
  row(out);
  return out.take();
}

std::string FilterWriter::regressor() const {
  Text out;
  out.put(
      "\n/* The regressor of an element, times its length. */\n"
      "static inline void pfx_regressor(const pfx_element *e, double y[PFX_CHANNELS][PFX_PARAMETERS])\n{\n");
  out.line("  int i, j;");
  out.line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
  out.line("    for (j = 0; j < PFX_PARAMETERS; ++j) {{");
  out.line("      y[i][j] = 0.0;");
  out.line("    }}");
  out.line("  }}");
  std::size_t function = 0;
  for (const Term& term : model_.terms) {
    const bool own = term.kind == Term::Kind::function;
    out.line("  y[{}][{}] += {}e->{}[{}]; /* {} */", term.output, term.parameter, own ? "" : times(term.scale),
             own                                     ? "term"
             : term.kind == Term::Kind::acceleration ? "slope"
                                                     : "motion",
             own ? function++ : term.coordinate, plain(model_.parameters[term.parameter].name));
  }
  out.put("}\n");
  return out.take();
}

}  // namespace wheelwright::exporter::c_text
