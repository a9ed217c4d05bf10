// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/export_c.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/io/export_c_text.hpp>
#include <wheelwright/model/differential_drive.hpp>
#include <wheelwright/model/single_axis.hpp>

namespace wheelwright {
namespace {

/// The functions of the models in model/ that stand in their terms.
enum class Function { along_x, along_y, signs_sum, signs_difference, sign_of_speed, one };

/// A number as it is, to the last bit.
std::string hex(double x) {
  check::finite(x, "a number of the exported detector");
  return fmt::format("{:a}", x);
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

/// `text` as ASCII that is safe inside a C comment.
std::string plain(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kWords = {
      {{"·", "*"}, {"²", "^2"}, {"³", "^3"}, {"Ω", "Ohm"}, {"−", "-"}, {"*/", "* /"}, {"/*", "/ *"}}};
  for (const auto& [from, to] : kWords) {
    replace_all(text, from, to);
  }
  for (char& c : text) {
    c = c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

void check_name(const std::string& name) {
  constexpr std::array<std::string_view, 12> kTaken = {"double", "int",   "void",  "static", "inline", "struct",
                                                       "for",    "while", "const", "if",     "exp",    "round"};
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto part = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; };
  if (name.empty() || name.size() > 40 || !letter(name.front()) || !std::all_of(name.begin(), name.end(), part) ||
      std::find(kTaken.begin(), kTaken.end(), name) != kTaken.end()) {
    throw InputError("export: name '" + name +
                     "': expected a prefix of C names: a letter, then letters, digits and _, at most 40");
  }
}

/// What a term's function is in C. Functions are known by their addresses in the models that have them.
Function function_of(const Model& model, const Term& term) {
  const auto is = [&](const Model& of, const char* physical, std::size_t output) {
    return std::any_of(of.terms.begin(), of.terms.end(), [&](const Term& other) {
      return other.kind == Term::Kind::function && other.function == term.function && other.output == output &&
             of.parameters[other.parameter].physical == physical;
    });
  };
  const Model drive = DifferentialDrive{1.0, 1.0, false, true, true}.model();
  const Model axis = SingleAxis{.coulomb = true, .offset = true}.model();
  const bool two_joints = model.joints.size() >= 2;
  if (is(drive, "viscous_x", 0)) return Function::along_x;
  if (is(drive, "viscous_y", 0)) return Function::along_y;
  if (is(drive, "coulomb", 0) && two_joints) return Function::signs_sum;
  if (is(drive, "coulomb", 1) && two_joints) return Function::signs_difference;
  if (is(axis, "coulomb", 0)) return Function::sign_of_speed;
  if (is(axis, "offset", 0)) return Function::one;
  throw InputError("export: the term of parameter " + model.parameters[term.parameter].name + " of the model " +
                   model.name +
                   " is a function of its own, which has no C form; expected accelerations, speeds, and the functions "
                   "of differential_drive and single_axis");
}

std::string unit_of(const std::string& column) {
  const auto starts = [&](std::string_view word) { return column.rfind(word, 0) == 0; };
  return starts("phi_")         ? "rad"
         : starts("omega_")     ? "rad/s"
         : starts("tau_")       ? "N*m"
         : starts("current_")   ? "A"
         : starts("voltage_")   ? "V"
         : column == "theta"    ? "rad"
         : column == "position" ? "m (rotary: rad)"
         : column == "velocity" ? "m/s (rotary: rad/s)"
         : column == "effort"   ? "N (rotary: N*m)"
                                : "unit of the log";
}

/// Writes one header.
class Writer {
 public:
  Writer(const Detector& detector, const CExportOptions& options)
      : detector_(detector),
        options_(options),
        filter_(detector.filter()),
        model_(filter_.model()),
        measurement_(filter_.measurement()),
        errors_(filter_.errors()),
        rule_(detector.threshold()) {
    check_name(options.name);
    if (!measurement_.correction.empty()) {
      throw InputError(
          "export: the robot's effects correct the measured efforts (lag, delay, gain, dead zone or saturation), which "
          "has no C form; expected a model without such effects");
    }
    for (std::size_t k = 0; k < model_.terms.size(); ++k) {
      if (model_.terms[k].kind == Term::Kind::function) {
        functions_.push_back({k, function_of(model_, model_.terms[k])});
      }
    }
    if (thresholds() && rule_.kind() == ParameterSetKind::polytope && !rule_.table()) {
      throw InputError(
          fmt::format("export: the feasible set has too many vertices for a table (more than {} in one group of "
                      "parameters, or it is too flat); export its box instead (--set box)",
                      SupportTableOptions{}.vertices));
    }
    heading_ = needs({Function::along_x, Function::along_y});
  }

  std::string text() {
    comment();
    put("#ifndef PFX_H\n#define PFX_H\n\n");
    put(c_text::kCompiler);
    put("\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n");
    constants();
    put("\n");
    put(c_text::kTypes);
    state();
    if (thresholds()) {
      tables();
    }
    put("\n");
    put(c_text::kWeights);
    put("\n");
    put(c_text::kCascade);
    functions();
    advance();
    rows();
    sample();
    if (thresholds()) {
      put("\n");
      put(c_text::kHull);
      if (polytope()) {
        if (!rule_.table()->graphs().empty()) {
          put("\n");
          put(c_text::kFollow);
        }
      }
      support();
      put("\n");
      put(c_text::kThreshold);
    }
    put("\n");
    put(c_text::kPersistence);
    interface();
    put("\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n");
    std::string upper = options_.name;
    for (char& c : upper) {
      c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    replace_all(text_, "PFX", upper);
    replace_all(text_, "pfx", options_.name);
    return std::move(text_);
  }

 private:
  struct FunctionTerm {
    std::size_t term;
    Function function;
  };

  void put(std::string_view text) { text_ += text; }
  template <typename... Arguments>
  void line(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    text_ += fmt::format(format, std::forward<Arguments>(arguments)...) + "\n";
  }

  [[nodiscard]] bool thresholds() const { return !detector_.options().mu; }
  [[nodiscard]] bool polytope() const { return rule_.kind() == ParameterSetKind::polytope; }
  [[nodiscard]] bool angles() const { return measurement_.motion == MotionKind::angle; }
  [[nodiscard]] bool measured_heading() const { return heading_ && !measurement_.heading_column.empty(); }
  [[nodiscard]] std::size_t slots() const { return std::min(2 * model_.n(), ThresholdRule::kSlots); }
  [[nodiscard]] bool two_sided() const { return detector_.options().test == Test::two_sided; }
  /// Whether the error of the first mean speed of a segment is in the rows.
  [[nodiscard]] bool starting_error() const {
    return measurement_.motion != MotionKind::speed &&
           std::any_of(model_.terms.begin(), model_.terms.end(), [&](const Term& term) {
             return term.kind == Term::Kind::acceleration &&
                    errors_.speed_sample[static_cast<Eigen::Index>(term.coordinate)] != 0.0;
           });
  }
  [[nodiscard]] bool needs(std::initializer_list<Function> any) const {
    return std::any_of(functions_.begin(), functions_.end(), [&](const FunctionTerm& f) {
      return std::find(any.begin(), any.end(), f.function) != any.end();
    });
  }

  void comment() {
    const auto columns = measurement_.columns();
    line("/* {}.h: on-line fault detector.", options_.name);
    line(" *");
    if (!options_.software.empty())
      line(" * Written by {}{}; do not edit.", plain(options_.software),
           options_.source.empty() ? "" : " from " + plain(options_.source));
    line(" * Robot: {} ({}).", plain(options_.robot.empty() ? "unnamed" : options_.robot), plain(model_.name));
    line(" * Filter: order {}, alpha = {} 1/s, beta = {} 1/s.", filter_.design().order, filter_.design().alpha,
         filter_.design().beta);
    line(" * Residual: filtered effort minus what the model expects (a kinematic residual is not part of this file).");
    const Persistence persistence = detector_.options().persistence.value_or(Persistence{});
    line(" * Decision: {}, alarm at {} of {} instants outside.",
         !thresholds() ? "constant thresholds"
         : polytope()  ? (two_sided() ? "two-sided, threshold from the feasible set"
                                      : "symmetric, threshold from the feasible set")
         : two_sided() ? "two-sided, threshold from the box of parameters"
                       : "symmetric, threshold from the box of parameters",
         persistence.k, persistence.n);
    line(" * Channels:");
    for (std::size_t i = 0; i < model_.n(); ++i) {
      line(" *   {}: {} (with torque as effort: {})", i, plain(model_.outputs[i]), plain(model_.output_units[i]));
    }
    line(" * Parameters:");
    for (std::size_t j = 0; j < model_.p(); ++j) {
      const Interval& side = rule_.set().hull().sides[j];
      line(" *   {}: {} = {:.6g}, in [{:.6g}, {:.6g}] (with torque as effort: {})", j, plain(model_.parameters[j].name),
           rule_.estimate()[static_cast<Eigen::Index>(j)], side.lower, side.upper, plain(model_.parameters[j].unit));
    }
    line(" *");
    line(" * Use, for one sample after the other, t in seconds:");
    line(" *");
    line(" *   pfx_state state;");
    line(" *   pfx_init(&state);");
    line(" *   for (;;) {{");
    line(" *     double t = now(), sample[PFX_INPUTS];");
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const bool heading = c + 1 == columns.size() && !measurement_.heading_column.empty();
      line(" *     sample[{}] = {};  // {}{}{}", c, plain(columns[c]), unit_of(columns[c]),
           c < model_.joints.size() && measurement_.motion == MotionKind::mean_speed
               ? ", encoder counts over the sampling interval divided by it, t its middle"
               : "",
           heading ? ", unwrapped" : "");
    }
    line(" *     pfx_decision decision;");
    line(" *     pfx_step(&state, t, sample, &decision);");
    line(" *     if (decision.fault) stop();");
    line(" *   }}");
    line(" *");
    put(" * Samples must be finite numbers. A time that does not increase");
    if (measurement_.nominal_step > 0.0) {
      line(", or a gap of more than five steps of {:.6g} s,\n * restarts the filter; pfx_restart does so at once.",
           measurement_.nominal_step);
    } else {
      line(" restarts the filter; pfx_restart does so at once.");
    }
    line(" *");
    line(
        " * C99, or C++17 for its hexadecimal numbers. No heap, no mutable static data, no recursion, bounded work; a "
        "state");
    line(" * belongs to one thread at a time. Of libm: exp (when the step changes{}), fabs{}{}.",
         starting_error() ? ", and near the start of a segment" : "", measurement_.count > 0.0 ? ", round" : "",
         heading_ ? ", cos, sin" : "");
    line(
        " * Every operation is that of the C++ library, in the same order: compiled with -ffp-contract=off (gcc "
        "otherwise");
    line(
        " * fuses multiplications and additions where the processor can) and with the same libm, all numbers have the "
        "same");
    line(" * bits. With another libm they differ by the rounding of its functions.");
    line(" */");
  }

  void constants() {
    const FilterDesign& design = filter_.design();
    const Persistence persistence = detector_.options().persistence.value_or(Persistence{});
    line("#define PFX_INPUTS {}     /* numbers of a sample */", measurement_.columns().size());
    line("#define PFX_JOINTS {}", model_.joints.size());
    line("#define PFX_COORDINATES {}", model_.coordinates.size());
    line("#define PFX_CHANNELS {}", model_.n());
    line("#define PFX_PARAMETERS {}", model_.p());
    line("#define PFX_ALPHA {} /* 1/s */", hex(design.alpha));
    line("#define PFX_BETA {} /* 1/s */", hex(design.beta));
    if (measurement_.motion != MotionKind::speed) {
      line("#define PFX_SETTLE {} /* rows before this over beta are left out */", hex(design.settle));
    }
    if (measurement_.count > 0.0) {
      line("#define PFX_COUNT {} /* speeds are whole multiples of this */", hex(measurement_.count));
    }
    if (measurement_.nominal_step > 0.0) {
      line("#define PFX_GAP {} /* s: a longer step restarts */", hex(5.0 * measurement_.nominal_step));
    }
    line("#define PFX_PERSISTENCE_K {}", persistence.k);
    line("#define PFX_PERSISTENCE_N {}", persistence.n);
    line("#define PFX_PERSISTENCE_MASK 0x{:x}ULL", persistence.n == 64 ? ~0ULL : (1ULL << persistence.n) - 1);
    if (!thresholds()) {
      return;
    }
    const auto p = static_cast<double>(model_.p());
    line("#define PFX_SLOTS {}        /* directions that are followed from one sample to the next */", slots());
    line("#define PFX_ROUNDING {} /* relative, of residual and threshold */", hex(4.0 * (p + 4.0) * kEpsilon));
    line("#define PFX_HULL_ROUNDING {}", hex(4.0 * (p + 1.0) * kEpsilon));
    line("#define PFX_HULL_UNDERFLOW {}", hex(2.0 * p * std::numeric_limits<double>::min()));
    if (polytope()) {
      const auto& graphs = rule_.table()->graphs();
      std::size_t largest = 1;
      for (const VertexGraph& graph : graphs) {
        largest = std::max(largest, graph.parameters.size());
      }
      line("#define PFX_SLACK {}", hex(1.0 + (p + 6.0) * kEpsilon));
      line("#define PFX_SUM {}", hex((p + 2.0) * kEpsilon));
      line("#define PFX_TINY {}", hex(std::numeric_limits<double>::min()));
      if (!graphs.empty()) {
        line("#define PFX_GROUPS {}       /* of parameters that bound each other */", graphs.size());
        line("#define PFX_LARGEST_GROUP {}", largest);
        line("#define PFX_EDGES {}       /* most edges walked for one direction and group */",
             rule_.table()->options().budget);
        line("#define PFX_TIGHT {}", hex(SupportTable::kTight));
      }
    }
  }

  void state() {
    put("\n/* What the detector remembers; all of it is set by pfx_init. */\ntypedef struct pfx_state {\n");
    line("  int started, running, at_rest; /* a sample was seen; the recursion runs; it began at standstill */");
    line("  double sample_time;            /* of the last sample, s */");
    line("  double t0, t;                  /* first and last instant of the recursion, s */");
    line("  pfx_weights weights;");
    line("  double joint[PFX_JOINTS], joint_before[PFX_JOINTS]; /* motion as measured */");
    if (angles()) {
      line("  double joint_speed[PFX_JOINTS];");
      line("  double torque_sample[PFX_CHANNELS]; /* effort of each channel at the last sample */");
    }
    line("  double speed[PFX_COORDINATES], speed_before[PFX_COORDINATES];");
    line("  double torque[PFX_CHANNELS], torque_before[PFX_CHANNELS]; /* at the instants of the recursion */");
    line("  pfx_cascade motion[PFX_COORDINATES];       /* driven by the speeds */");
    line("  pfx_cascade acceleration[PFX_COORDINATES]; /* driven by their derivatives */");
    line("  pfx_cascade filtered_torque[PFX_CHANNELS];");
    if (!functions_.empty()) {
      line("  pfx_cascade term[{0}], term_error[{0}]; /* of functions of the motion */", functions_.size());
      line("  double last_term[{0}], last_term_error[{0}];", functions_.size());
    }
    if (heading_) {
      line("  double heading{}; /* rad */", measured_heading() ? ", heading_sample" : "");
    }
    line("  unsigned long long window[PFX_CHANNELS]; /* of the persistence */");
    if (thresholds() && polytope() && !rule_.table()->graphs().empty()) {
      line("  unsigned short place[PFX_GROUPS][PFX_SLOTS]; /* the vertex that was best last time */");
    }
    put("} pfx_state;\n");
  }

  /// `count` numbers `of(i)` in braces, wrapped.
  template <typename Of>
  std::string list(std::size_t count, Of of) {
    std::string text = "{";
    std::size_t column = 1;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string item = of(i) + (i + 1 < count ? "," : "");
      if (column + item.size() > 110) {
        text += "\n ";
        column = 1;
      }
      text += (column == 1 ? "" : " ") + item;
      column += item.size() + 1;
    }
    return text + "}";
  }

  void tables() {
    const auto& sides = rule_.set().hull().sides;
    const std::size_t p = model_.p();
    put("\n/* Parameters: estimate, and the interval hull of the feasible set. */\n");
    line("static const double pfx_estimate[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(rule_.estimate()[static_cast<Eigen::Index>(j)]); }));
    line("static const double pfx_lower[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(sides[j].lower); }));
    line("static const double pfx_upper[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(sides[j].upper); }));
    line("static const double pfx_largest[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(std::max(std::abs(sides[j].lower), std::abs(sides[j].upper))); }));
    if (!polytope()) {
      return;
    }
    const auto& graphs = rule_.table()->graphs();
    for (std::size_t g = 0; g < graphs.size(); ++g) {
      const VertexGraph& graph = graphs[g];
      const std::size_t q = graph.parameters.size(), stride = q * q + 4 * q;
      line(
          "\n/* Group {} of parameters: the {} vertices of its feasible set, and where their edges lead (pfx_follow). "
          "*/",
          g, graph.vertices());
      line("static const unsigned char pfx_index{}[{}] = {};", g, q,
           list(q, [&](std::size_t k) { return std::to_string(graph.parameters[k]); }));
      line("static const double pfx_half{}[{}] = {};", g, q,
           list(q, [&](std::size_t k) { return hex(graph.half[k]); }));
      line("static const unsigned short pfx_next{}[{}] = {};", g, graph.neighbours.size(),
           list(graph.neighbours.size(), [&](std::size_t k) { return std::to_string(graph.neighbours[k]); }));
      line("static const double pfx_vertices{}[{}] = {{", g, graph.numbers.size());
      for (std::size_t v = 0; v < graph.vertices(); ++v) {
        std::string row = list(stride, [&](std::size_t k) { return hex(graph.numbers[v * stride + k]); });
        line(" {},", std::string_view(row).substr(1, row.size() - 2));
      }
      put("};\n");
    }
  }

  /// matrix(i, 0) x[0] + matrix(i, 1) x[1] + …
  static std::string combination(const Eigen::MatrixXd& matrix, std::size_t row, const char* x) {
    std::string text;
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      text += (j == 0 ? "" : " + ") + hex(matrix(static_cast<Eigen::Index>(row), j)) + fmt::format(" * {}[{}]", x, j);
    }
    return text;
  }

  void functions() {
    if (functions_.empty()) {
      return;
    }
    if (needs({Function::signs_sum, Function::signs_difference, Function::sign_of_speed})) {
      put("\nstatic inline double pfx_sign(double x)\n{\n  return (double)(x > 0.0) - (double)(x < 0.0);\n}\n");
    }
    put("\n/* Terms that are functions of the motion at this instant, and by how much each can be wrong. */\n"
        "static inline void pfx_evaluate(pfx_state *s)\n{\n");
    line("  double value, error;");
    const std::string joint = angles() ? "joint_speed" : "joint";
    for (std::size_t k = 0; k < functions_.size(); ++k) {
      const Term& term = model_.terms[functions_[k].term];
      const double speed_error = errors_.speed_sample[0];
      line("  /* {} in {} */", plain(model_.parameters[term.parameter].name), plain(model_.outputs[term.output]));
      switch (functions_[k].function) {
        case Function::along_x:
        case Function::along_y: {
          // std::min(1.0, x) of model/differential_drive.cpp.
          const double share_error = std::min(1.0, errors_.heading);
          line("  {{");
          line("    const double c = {}(s->heading), share = c * c, most = share + {};",
               functions_[k].function == Function::along_x ? "cos" : "sin", hex(share_error));
          line("    value = share * s->speed[0];");
          line("    error = (most < 1.0 ? most : 1.0) * {} + {} * fabs(s->speed[0]);", hex(speed_error),
               hex(share_error));
          line("  }}");
          break;
        }
        case Function::signs_sum:
        case Function::signs_difference: {
          const char* of_left = functions_[k].function == Function::signs_sum ? "+" : "-";
          line("  value = pfx_sign(s->{0}[0]) {1} pfx_sign(s->{0}[1]);", joint, of_left);
          if (errors_.joint_sample > 0.0) {
            for (int j = 0; j < 2; ++j) {
              line("  error {0} fabs(s->{1}[{2}]) <= {3} ? 1.0 + fabs(pfx_sign(s->{1}[{2}])) : 0.0;",
                   j == 0 ? "=" : "+=", joint, j, hex(errors_.joint_sample));
            }
          } else {
            line("  error = 0.0;");
          }
          break;
        }
        case Function::sign_of_speed:
          line("  value = pfx_sign(s->speed[0]);");
          line("  error = fabs(s->speed[0]) <= {} ? 1.0 + fabs(value) : 0.0;", hex(speed_error));
          break;
        case Function::one:
          line("  value = 1.0;");
          line("  error = 0.0;");
          break;
      }
      line("  s->last_term[{}] = {}value;", k, term.scale == 1.0 ? "" : hex(term.scale) + " * ");
      line("  s->last_term_error[{}] = {}error;", k,
           std::abs(term.scale) == 1.0 ? "" : hex(std::abs(term.scale)) + " * ");
    }
    put("}\n");
  }

  void advance() {
    put("\n/* One instant of the recursion; whether the filter has settled. */\n"
        "static inline int pfx_instant(pfx_state *s, double t)\n{\n");
    line("  const double h = t - s->t;");
    line("  int i;");
    line("  s->t = t;");
    line("  if (!s->running) {{");
    line("    s->running = 1;");
    line("    s->t0 = t;");
    line("    s->at_rest = 1;");
    line("    for (i = 0; i < PFX_COORDINATES; ++i) {{");
    line("      s->at_rest = s->at_rest && fabs(s->speed[i]) <= 0.0;");
    line("      s->motion[i].z1 = s->motion[i].z2 = 0.0;");
    line("      s->acceleration[i].z1 = s->acceleration[i].z2 = 0.0;");
    line("    }}");
    line("    for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("      s->filtered_torque[i].z1 = s->filtered_torque[i].z2 = 0.0;");
    line("    }}");
    if (heading_ && !measured_heading()) {
      line("    s->heading = 0.0;");
    }
    if (!functions_.empty()) {
      line("    pfx_evaluate(s);");
      line("    for (i = 0; i < {}; ++i) {{", functions_.size());
      line("      s->term[i].z1 = s->term[i].z2 = 0.0;");
      line("      s->term_error[i].z1 = s->term_error[i].z2 = 0.0;");
      line("    }}");
    }
    line("    return 0;");
    line("  }}");
    line("  if (h != s->weights.step) {{");
    line("    pfx_change_step(&s->weights, h);");
    line("  }}");
    if (heading_ && !measured_heading() && model_.heading_coordinate >= 0) {
      line("  s->heading += 0.5 * h * (s->speed_before[{0}] + s->speed[{0}]);", model_.heading_coordinate);
    }
    line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
    line("    const double by = s->speed[i] - s->speed_before[i];");
    line("    pfx_linear(&s->motion[i], &s->weights, s->speed_before[i], s->speed[i]);");
    line("    pfx_advance(&s->acceleration[i], &s->weights, s->weights.slope1 * by, s->weights.slope2 * by);");
    line("  }}");
    if (!functions_.empty()) {
      const auto each = [&](const char* format) {
        line("  for (i = 0; i < {}; ++i) {{", functions_.size());
        for (const char* which : {"term", "term_error"}) {
          std::string statement = format;
          replace_all(statement, "$", which);
          put(statement);
        }
        line("  }}");
      };
      each(
          "    pfx_advance(&s->$[i], &s->weights, s->weights.begin1 * s->last_$[i],\n"
          "                s->weights.begin2 * s->last_$[i]);\n");
      line("  pfx_evaluate(s);");
      each(
          "    s->$[i].z1 += s->weights.end1 * s->last_$[i];\n"
          "    s->$[i].z2 += s->weights.end2 * s->last_$[i];\n");
    }
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    if (measurement_.hold == Hold::zero_order && !angles()) {
      line("    pfx_advance(&s->filtered_torque[i], &s->weights, s->weights.held1 * s->torque_before[i],");
      line("                s->weights.held2 * s->torque_before[i]);");
    } else {
      line("    pfx_linear(&s->filtered_torque[i], &s->weights, s->torque_before[i], s->torque[i]);");
    }
    line("  }}");
    if (measurement_.motion == MotionKind::speed) {
      line("  return 1;");
    } else {
      line("  return s->at_rest || (s->t - s->t0) * PFX_BETA >= PFX_SETTLE;");
    }
    put("}\n");
  }

  void rows() {
    const char* of = filter_.design().order == 1 ? "PFX_ALPHA * c->z1" : "PFX_ALPHA * PFX_ALPHA * c->z2";
    put("\n/* Output of a cascade. */\nstatic inline double pfx_filtered(const pfx_cascade *c)\n{\n");
    line("  return {};", of);
    put("}\n\n/* The filtered regressor y and the bound dy on its error. */\n"
        "static inline void pfx_row(const pfx_state *s, double y[PFX_CHANNELS][PFX_PARAMETERS],\n"
        "                           double dy[PFX_CHANNELS][PFX_PARAMETERS])\n{\n");
    line("  int i, j;");
    if (starting_error()) {
      line("  /* Weight of the error of the first mean speed, a difference of two angles over one step. */");
      line("  const double x = PFX_BETA * (s->t - s->t0);");
      line("  const double start = x < 700.0 ? PFX_ALPHA * PFX_ALPHA * (s->t - s->t0) * exp(-x) : 0.0;");
    }
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    for (j = 0; j < PFX_PARAMETERS; ++j) {{");
    line("      y[i][j] = dy[i][j] = 0.0;");
    line("    }}");
    line("  }}");
    for (const Term& term : model_.terms) {
      if (term.kind == Term::Kind::function) {
        continue;
      }
      const auto c = static_cast<Eigen::Index>(term.coordinate);
      const bool speed = term.kind == Term::Kind::speed;
      line("  y[{}][{}] += {}pfx_filtered(&s->{}[{}]); /* {} */", term.output, term.parameter,
           term.scale == 1.0 ? "" : hex(term.scale) + " * ", speed ? "motion" : "acceleration", term.coordinate,
           plain(model_.parameters[term.parameter].name));
      const double error = speed ? errors_.speed[c] : errors_.acceleration[c];
      const bool starts = !speed && starting_error();
      if (error != 0.0 || starts) {
        const double scale = std::abs(term.scale);
        const std::string sum = starts ? hex(error) + " + start * " + hex(errors_.speed_sample[c]) : hex(error);
        line("  dy[{}][{}] += {};", term.output, term.parameter, scale == 1.0 ? sum : hex(scale) + " * (" + sum + ")");
      }
    }
    for (std::size_t k = 0; k < functions_.size(); ++k) {
      const Term& term = model_.terms[functions_[k].term];
      line("  y[{}][{}] += pfx_filtered(&s->term[{}]); /* {} */", term.output, term.parameter, k,
           plain(model_.parameters[term.parameter].name));
      line("  dy[{}][{}] += pfx_filtered(&s->term_error[{}]);", term.output, term.parameter, k);
    }
    put("}\n");
  }

  void sample() {
    const std::size_t joints = model_.joints.size();
    put("\n/* Takes one sample; whether there is a row. */\n"
        "static inline int pfx_filter(pfx_state *s, int first, double before, double t, const double *sample)\n{\n");
    line("  double effort[PFX_JOINTS];");
    if (angles()) {
      line("  double torque_sample_before[PFX_CHANNELS];");
    }
    line("  int i;");
    if (!angles()) {
      line("  (void)first;");
      line("  (void)before;");
    }
    line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    line("    s->joint_before[i] = s->joint[i];");
    line("    s->joint[i] = {};", measurement_.count > 0.0 ? "round(sample[i] / PFX_COUNT) * PFX_COUNT" : "sample[i]");
    if (angles()) {
      line("    if (first) {{");
      line("      s->joint_before[i] = s->joint[i];");
      line("    }}");
    }
    if (measurement_.effort_unsigned) {
      const std::string moved = angles() ? "s->joint[i] - s->joint_before[i]" : "s->joint[i]";
      line("    /* Only the size of the effort is known; its sign is that of the motion. */");
      line("    effort[i] = fabs(sample[PFX_JOINTS + i]) * ((double)({0} > 0.0) - (double)({0} < 0.0));", moved);
    } else {
      line("    effort[i] = sample[PFX_JOINTS + i];");
    }
    line("  }}");
    line("  for (i = 0; i < PFX_COORDINATES; ++i) {{");
    line("    s->speed_before[i] = s->speed[i];");
    line("  }}");
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    s->torque_before[i] = s->torque[i];");
    if (angles()) {
      line("    torque_sample_before[i] = s->torque_sample[i];");
    }
    line("  }}");
    const char* now = angles() ? "torque_sample" : "torque";
    for (std::size_t i = 0; i < model_.n(); ++i) {
      line("  s->{}[{}] = {}; /* {} */", now, i, combination(model_.input, i, "effort"), plain(model_.outputs[i]));
    }
    const char* speeds = angles() ? "s->joint_speed" : "s->joint";
    const auto coordinates = [&] {
      for (std::size_t c = 0; c < model_.coordinates.size(); ++c) {
        line("  s->speed[{}] = {}; /* {} */", c, combination(model_.motion, c, speeds), plain(model_.coordinates[c]));
      }
    };
    if (!angles()) {
      coordinates();
      if (measured_heading()) {
        line("  s->heading = sample[{}];", 2 * joints);
      }
      line("  return pfx_instant(s, t);");
      put("}\n");
      return;
    }
    if (measured_heading()) {
      line("  const double heading_before = s->heading_sample;");
      line("  s->heading_sample = sample[{}];", 2 * joints);
    }
    line("  if (first) {{");
    line("    return 0;");
    line("  }}");
    line("  for (i = 0; i < PFX_JOINTS; ++i) {{");
    line("    s->joint_speed[i] = (s->joint[i] - s->joint_before[i]) / (t - before);");
    line("  }}");
    coordinates();
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    s->torque[i] = {};", measurement_.hold == Hold::zero_order
                                       ? "torque_sample_before[i]"
                                       : "0.5 * (torque_sample_before[i] + s->torque_sample[i])");
    line("  }}");
    if (measured_heading()) {
      line("  s->heading = 0.5 * (heading_before + s->heading_sample);");
    }
    line("  return pfx_instant(s, 0.5 * (before + t));");
    put("}\n");
  }

  void support() {
    put("\n/* Largest a.theta over the feasible set, rounded outward; slot: which direction is followed. */\n"
        "static inline double pfx_support(pfx_state *s, const double *a, int slot)\n{\n");
    if (!polytope()) {
      line("  (void)s;");
      line("  (void)slot;");
      line("  return pfx_support_of_hull(a);");
      put("}\n");
      return;
    }
    const auto& graphs = rule_.table()->graphs();
    line("  const double hull = pfx_support_of_hull(a);");
    line("  double value = 0.0, magnitude = 0.0, slack = 0.0, bound;");
    if (graphs.empty()) {
      line("  (void)s;");
      line("  (void)slot;");
    }
    for (const std::size_t j : rule_.table()->singles()) {
      line("  {{");
      line("    const double product = a[{0}] * (a[{0}] > 0.0 ? pfx_upper[{0}] : pfx_lower[{0}]);", j);
      line("    value += product;");
      line("    magnitude += fabs(product);");
      line("  }}");
    }
    for (std::size_t g = 0; g < graphs.size(); ++g) {
      line(
          "  pfx_follow(pfx_vertices{0}, pfx_next{0}, pfx_index{0}, pfx_half{0}, {1}, a, &s->place[{0}][slot], &value,",
          g, graphs[g].parameters.size());
      line("             &magnitude, &slack);");
    }
    line("  bound = value + (slack * PFX_SLACK + (PFX_SUM * magnitude + PFX_TINY));");
    line("  return hull < bound ? hull : bound;");
    put("}\n");
  }

  void interface() {
    put("\n/* ---- What is called from outside ---- */\n\n"
        "/* Forgets all samples: the next one starts a segment. */\n"
        "static inline void pfx_restart(pfx_state *s)\n{\n");
    line("  int i;");
    line("  s->started = s->running = 0;");
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    s->window[i] = 0;");
    line("  }}");
    put("}\n\n/* To be called once, before all else. */\nstatic inline void pfx_init(pfx_state *s)\n{\n");
    line("  memset(s, 0, sizeof *s);");
    line("  pfx_fill_weights(&s->weights, 0.0, 1.0, 1.0, 0.5, 1.0 / 3.0);");
    line("  pfx_restart(s);");
    put("}\n\n/* Takes the sample at time t (s) and decides. */\n"
        "static inline void pfx_step(pfx_state *s, double t, const double sample[PFX_INPUTS], pfx_decision "
        "*decision)\n{\n");
    line("  double y[PFX_CHANNELS][PFX_PARAMETERS], dy[PFX_CHANNELS][PFX_PARAMETERS];");
    line("  const double before = s->sample_time;");
    line("  int first, valid, i, j;");
    line("  if (s->started && (!(t > before){})) {{",
         measurement_.nominal_step > 0.0 ? " || t - before > PFX_GAP" : "");
    line("    pfx_restart(s);");
    line("  }}");
    line("  first = !s->started;");
    line("  s->started = 1;");
    line("  s->sample_time = t;");
    line("  valid = pfx_filter(s, first, before, t, sample);");
    line("  decision->valid = valid;");
    line("  decision->fault = 0;");
    line("  if (valid) {{");
    line("    pfx_row(s, y, dy);");
    line("  }}");
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    static const double output_error[PFX_CHANNELS] = {};",
         list(model_.n(), [&](std::size_t i) { return hex(errors_.output[static_cast<Eigen::Index>(i)]); }));
    if (!thresholds()) {
      line("    static const double estimate[PFX_PARAMETERS] = {};",
           list(model_.p(), [&](std::size_t j) { return hex(rule_.estimate()[static_cast<Eigen::Index>(j)]); }));
      line("    static const double constant[PFX_CHANNELS] = {};", list(model_.n(), [&](std::size_t i) {
             return hex((*detector_.options().mu)[static_cast<Eigen::Index>(i)]);
           }));
    }
    line("    pfx_channel *c = &decision->channel[i];");
    line("    double size;");
    line("    c->predicted = 0.0;");
    line("    if (!valid) {{");
    line("      c->residual = c->lower = c->upper = c->dead_zone = 0.0;");
    line("      c->outside = c->alarm = 0;");
    line("      continue;");
    line("    }}");
    line("    for (j = 0; j < PFX_PARAMETERS; ++j) {{");
    line("      c->predicted += y[i][j] * {}[j];", thresholds() ? "pfx_estimate" : "estimate");
    line("    }}");
    line("    c->residual = pfx_filtered(&s->filtered_torque[i]) - c->predicted;");
    if (thresholds()) {
      line("    pfx_threshold(s, y[i], dy[i], output_error[i], i, &c->lower, &c->upper);");
    } else {
      line("    (void)output_error;");
      line("    c->lower = -constant[i];");
      line("    c->upper = constant[i];");
    }
    line("    size = fabs(c->residual);");
    if (two_sided()) {
      line("    c->outside = c->residual < c->lower || c->residual > c->upper;");
      line("    c->dead_zone = c->outside ? size : 0.0;");
    } else {
      line("    c->dead_zone = size > (c->upper > -c->lower ? c->upper : -c->lower) ? size : 0.0;");
      line("    c->outside = c->dead_zone > 0.0;");
    }
    line("    c->alarm = pfx_persistent(&s->window[i], c->outside);");
    line("    decision->fault = decision->fault || c->alarm;");
    line("  }}");
    put("}\n");
  }

  const Detector& detector_;
  const CExportOptions& options_;
  const RegressorFilter& filter_;
  const Model& model_;
  const Measurement& measurement_;
  const SignalErrors& errors_;
  const ThresholdRule& rule_;
  std::vector<FunctionTerm> functions_;
  bool heading_ = false;  // whether a term looks at it
  std::string text_;
};

}  // namespace

std::string c_header(const Detector& detector, const CExportOptions& options) {
  return Writer(detector, options).text();
}

}  // namespace wheelwright
