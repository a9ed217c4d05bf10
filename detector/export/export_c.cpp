// SPDX-License-Identifier: Apache-2.0
#include "detector/export/export_c.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "core/words.hpp"
#include "detector/export/export_c_filter.hpp"
#include "detector/export/export_c_sums.hpp"
#include "detector/export/export_c_text.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::exporter {
namespace {

using c_text::hex;
using c_text::list;
using c_text::plain;

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
  Writer(const TorqueDetector& detector, const detector::ScaleDetector* sums, const CExportOptions& options)
      : detector_(detector),
        options_(options),
        filter_(detector.filter()),
        model_(filter_.model()),
        measurement_(filter_.measurement()),
        rule_(detector.threshold()),
        written_(filter_, thresholds(), sums != nullptr),
        risk_rule_(sums == nullptr ? nullptr : &sums->rule()) {
    check_name(options.name);
    if (thresholds() && rule_.kind() == detector::ParameterSetKind::polytope && !rule_.table()) {
      throw InputError(
          fmt::format("export: the feasible set has too many vertices for a table (more than {} in one group of "
                      "parameters, or it is too flat); export its box instead (--set box)",
                      bounds::SupportTableOptions{}.vertices));
    }
    if (risk_rule_ != nullptr && of_polytope(*risk_rule_) && !risk_rule_->table()) {
      throw InputError("export: the set at a stated risk has too many vertices for a table; export its box instead");
    }
    if (sums != nullptr) {
      sums_.emplace(*sums, written_);
    }
  }

  std::string text() {
    comment();
    put("#ifndef PFX_H\n#define PFX_H\n\n");
    put(c_text::kCompiler);
    put("\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n");
    constants();
    put("\n");
    put(c_text::kTypes);
    put("\n");
    put(written_.types());
    state();
    if (sums_) {
      put(sums_->types());
    }
    if (thresholds()) {
      tables();
    }
    if (sums_) {
      put("\n/* Interval hull of the set at a stated risk. */\n");
      hull("risk_", *risk_rule_);
      graphs("risk_", *risk_rule_);
      put(sums_->tables());
    }
    put(written_.functions());
    if (thresholds() || sums_) {
      put("\n");
      put(c_text::kHull);
    }
    if (followed()) {
      put("\n");
      put(c_text::kFollow);
    }
    if (thresholds()) {
      support("", "state", rule_);
      put("\n");
      put(c_text::kThreshold);
    }
    put("\n");
    put(c_text::kPersistence);
    interface();
    if (sums_) {
      put("\n/* ---- The detector at a stated risk ---- */\n");
      support("risk_", "sums", *risk_rule_);
      put(sums_->functions());
    }
    put("\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n");
    std::string upper = options_.name;
    for (char& c : upper) {
      c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    core::replace_all(text_, "PFX", upper);
    core::replace_all(text_, "pfx", options_.name);
    return std::move(text_);
  }

 private:
  void put(std::string_view text) { text_ += text; }
  template <typename... Arguments>
  void line(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    text_ += fmt::format(format, std::forward<Arguments>(arguments)...) + "\n";
  }

  [[nodiscard]] bool thresholds() const { return !detector_.options().mu; }
  [[nodiscard]] static bool of_polytope(const detector::ThresholdRule& rule) {
    return rule.kind() == detector::ParameterSetKind::polytope;
  }
  [[nodiscard]] static bool has_graphs(const detector::ThresholdRule& rule) {
    return of_polytope(rule) && !rule.table()->graphs().empty();
  }
  [[nodiscard]] bool polytope() const { return of_polytope(rule_); }
  /// The sets that are looked at; whether one of them has a table.
  [[nodiscard]] std::vector<const detector::ThresholdRule*> rules() const {
    std::vector<const detector::ThresholdRule*> result;
    if (thresholds()) {
      result.push_back(&rule_);
    }
    if (sums_) {
      result.push_back(risk_rule_);
    }
    return result;
  }
  [[nodiscard]] bool followed() const {
    const auto all = rules();
    return std::any_of(all.begin(), all.end(), [](const auto* rule) { return has_graphs(*rule); });
  }
  [[nodiscard]] std::size_t slots() const { return std::min(2 * model_.n(), detector::ThresholdRule::kSlots); }
  [[nodiscard]] bool two_sided() const { return detector_.options().test == detector::Test::two_sided; }
  void comment() {
    const auto columns = measurement_.columns();
    line("/* {}.h: on-line fault detector.", options_.name);
    line(" *");
    if (!options_.software.empty()) {
      line(" * Written by {}{}; do not edit.", plain(options_.software),
           options_.source.empty() ? "" : " from " + plain(options_.source));
    }
    line(" * Robot: {} ({}).", plain(options_.robot.empty() ? "unnamed" : options_.robot), plain(model_.name));
    line(" * Filter: order {}, alpha = {} 1/s, beta = {} 1/s.", filter_.design().order, filter_.design().alpha,
         filter_.design().beta);
    line(" * Effort: {}.", written_.effort_words());
    line(" * Residual: filtered effort minus what the model expects (a kinematic residual is not part of this file).");
    const detector::Persistence persistence = detector_.options().persistence.value_or(detector::Persistence{});
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
    line(" * A sample with a value that is no finite number is taken for lost. {}", written_.segment_words());
    line(" * pfx_restart restarts the detector at once.");
    if (measurement_.motion == MotionKind::mean_speed) {
      line(" * A decision is about the interval of the sample before, whose effort the last one has made known.");
    }
    if (sums_) {
      line(" *");
      put(sums_->words());
    }
    line(" *");
    line(
        " * C99, or C++17 for its hexadecimal numbers. No heap, no mutable static data, no recursion, bounded work; a "
        "state");
    line(" * belongs to one thread at a time. Of libm: {}{}.", written_.libm_words(),
         sums_ ? "; expm1, log1p, sqrt" : "");
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
    const detector::Persistence persistence = detector_.options().persistence.value_or(detector::Persistence{});
    line("#define PFX_INPUTS {}     /* numbers of a sample */", measurement_.columns().size());
    line("#define PFX_JOINTS {}", model_.joints.size());
    line("#define PFX_COORDINATES {}", model_.coordinates.size());
    line("#define PFX_CHANNELS {}", model_.n());
    line("#define PFX_PARAMETERS {}", model_.p());
    put(written_.constants());
    line("#define PFX_PERSISTENCE_K {}", persistence.k);
    line("#define PFX_PERSISTENCE_N {}", persistence.n);
    line("#define PFX_PERSISTENCE_MASK 0x{:x}ULL", persistence.n == 64 ? ~0ULL : (1ULL << persistence.n) - 1);
    if (sums_) {
      put(sums_->constants());
      line("#define PFX_RISK_SLOTS {}", detector::ThresholdRule::kSlots);
    }
    if (thresholds()) {
      line("#define PFX_SLOTS {}        /* directions that are followed from one sample to the next */", slots());
      line("#define PFX_ROUNDING {} /* relative, of residual and threshold */",
           hex(4.0 * (static_cast<double>(model_.p()) + 4.0) * core::kEpsilon));
    }
    set_constants();
  }

  /// Of all sets that are looked at.
  void set_constants() {
    const auto p = static_cast<double>(model_.p());
    std::size_t groups = 0, largest = 1;
    bool polytopes = false;
    for (const detector::ThresholdRule* rule : rules()) {
      polytopes = polytopes || of_polytope(*rule);
      if (has_graphs(*rule)) {
        for (const bounds::VertexGraph& graph : rule->table()->graphs()) {
          largest = std::max(largest, graph.parameters.size());
          ++groups;
        }
      }
    }
    if (rules().empty()) {
      return;
    }
    line("#define PFX_HULL_ROUNDING {}", hex(4.0 * (p + 1.0) * core::kEpsilon));
    line("#define PFX_HULL_UNDERFLOW {}", hex(2.0 * p * std::numeric_limits<double>::min()));
    if (polytopes) {
      line("#define PFX_SLACK {}", hex(1.0 + (p + 6.0) * core::kEpsilon));
      line("#define PFX_SUM {}", hex((p + 2.0) * core::kEpsilon));
      line("#define PFX_TINY {}", hex(std::numeric_limits<double>::min()));
    }
    if (groups > 0) {
      if (thresholds() && has_graphs(rule_)) {
        line("#define PFX_GROUPS {}       /* of parameters that bound each other */", rule_.table()->graphs().size());
      }
      line("#define PFX_LARGEST_GROUP {}", largest);
      line("#define PFX_EDGES {}       /* most edges walked for one direction and group */",
           bounds::SupportTableOptions{}.budget);
      line("#define PFX_TIGHT {}", hex(bounds::SupportTable::kTight));
    }
  }

  void state() {
    put("\n/* What the detector remembers; all of it is set by pfx_init. */\ntypedef struct pfx_state {\n");
    line("  int started; /* a sample was seen */");
    put(written_.state());
    line("  unsigned long long window[PFX_CHANNELS]; /* of the persistence */");
    if (thresholds() && has_graphs(rule_)) {
      line("  unsigned short place[PFX_GROUPS][PFX_SLOTS]; /* the vertex that was best last time */");
    }
    put("} pfx_state;\n");
  }

  void tables() {
    const auto& sides = rule_.set().hull().sides;
    const std::size_t p = model_.p();
    put("\n/* Parameters: estimate, and the interval hull of the feasible set. */\n");
    line("static const double pfx_estimate[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(rule_.estimate()[static_cast<Eigen::Index>(j)]); }));
    hull("", rule_);
    line("static const double pfx_largest[PFX_PARAMETERS] = {};",
         list(p, [&](std::size_t j) { return hex(core::magnitude(sides[j])); }));
    line("static const double pfx_sign[PFX_PARAMETERS] = {}; /* 0 where it is open */", list(p, [&](std::size_t j) {
           return std::string(sides[j].lower >= 0.0 ? "1.0" : sides[j].upper <= 0.0 ? "-1.0" : "0.0");
         }));
    graphs("", rule_);
  }

  /// pfx_NAMElower and pfx_NAMEupper.
  void hull(std::string_view name, const detector::ThresholdRule& rule) {
    const auto& sides = rule.set().hull().sides;
    line("static const double pfx_{}lower[PFX_PARAMETERS] = {};", name,
         list(sides.size(), [&](std::size_t j) { return hex(sides[j].lower); }));
    line("static const double pfx_{}upper[PFX_PARAMETERS] = {};", name,
         list(sides.size(), [&](std::size_t j) { return hex(sides[j].upper); }));
  }

  void graphs(std::string_view name, const detector::ThresholdRule& rule) {
    if (!of_polytope(rule)) {
      return;
    }
    const auto& graphs = rule.table()->graphs();
    for (std::size_t g = 0; g < graphs.size(); ++g) {
      const bounds::VertexGraph& graph = graphs[g];
      const std::size_t q = graph.parameters.size(), stride = q * q + 4 * q;
      line(
          "\n/* Group {} of parameters: the {} vertices of its feasible set, and where their edges lead (pfx_follow). "
          "*/",
          g, graph.vertices());
      line("static const unsigned char pfx_{}index{}[{}] = {};", name, g, q,
           list(q, [&](std::size_t k) { return std::to_string(graph.parameters[k]); }));
      line("static const double pfx_{}half{}[{}] = {};", name, g, q,
           list(q, [&](std::size_t k) { return hex(graph.half[k]); }));
      line("static const unsigned short pfx_{}next{}[{}] = {};", name, g, graph.neighbours.size(),
           list(graph.neighbours.size(), [&](std::size_t k) { return std::to_string(graph.neighbours[k]); }));
      line("static const double pfx_{}vertices{}[{}] = {{", name, g, graph.numbers.size());
      for (std::size_t v = 0; v < graph.vertices(); ++v) {
        std::string row = list(stride, [&](std::size_t k) { return hex(graph.numbers[v * stride + k]); });
        line(" {},", std::string_view(row).substr(1, row.size() - 2));
      }
      put("};\n");
    }
  }

  /// pfx_NAMEsupport, for the state pfx_STATE.
  void support(std::string_view name, std::string_view state, const detector::ThresholdRule& rule) {
    put("\n/* Largest a.theta over the set, rounded outward; slot: which direction is followed. */\n");
    line("static inline double pfx_{}support(pfx_{} *s, const double *a, int slot)\n{{", name, state);
    const std::string hull = fmt::format("pfx_support_of_hull(pfx_{0}lower, pfx_{0}upper, a)", name);
    if (!of_polytope(rule)) {
      line("  (void)s;");
      line("  (void)slot;");
      line("  return {};", hull);
      put("}\n");
      return;
    }
    const auto& graphs = rule.table()->graphs();
    line("  const double hull = {};", hull);
    line("  double value = 0.0, magnitude = 0.0, slack = 0.0, bound;");
    if (graphs.empty()) {
      line("  (void)s;");
      line("  (void)slot;");
    }
    for (const std::size_t j : rule.table()->singles()) {
      line("  {{");
      line("    const double product = a[{0}] * (a[{0}] > 0.0 ? pfx_{1}upper[{0}] : pfx_{1}lower[{0}]);", j, name);
      line("    value += product;");
      line("    magnitude += fabs(product);");
      line("  }}");
    }
    for (std::size_t g = 0; g < graphs.size(); ++g) {
      line("  pfx_follow(pfx_{1}vertices{0}, pfx_{1}next{0}, pfx_{1}index{0}, pfx_{1}half{0}, {2}, a,", g, name,
           graphs[g].parameters.size());
      line("             &s->place[{}][slot], &value, &magnitude, &slack);", g);
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
    line("  s->started = 0;");
    line("  pfx_forget(&s->elements);");
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
    line("    s->window[i] = 0;");
    line("  }}");
    put("}\n\n/* To be called once, before all else. */\nstatic inline void pfx_init(pfx_state *s)\n{\n");
    line("  memset(s, 0, sizeof *s);");
    line("  pfx_restart(s);");
    put("}\n\n/* Takes the sample at time t (s) and decides. */\n"
        "static inline void pfx_step(pfx_state *s, double t, const double sample[PFX_INPUTS], pfx_decision "
        "*decision)\n{\n");
    line("  double y[PFX_CHANNELS][PFX_PARAMETERS], torque[PFX_CHANNELS];");
    if (thresholds()) {
      line("  double dy[PFX_CHANNELS][PFX_PARAMETERS], torque_error[PFX_CHANNELS];");
    }
    line("  const int whole = pfx_whole(t, sample);");
    line("  int valid, i, j;");
    line("  if (whole && s->started && (!(t > s->elements.sample[0].t){})) {{",
         measurement_.nominal_step > 0.0 ? " || t - s->elements.sample[0].t > PFX_GAP" : "");
    line("    pfx_restart(s);");
    line("  }}");
    line("  s->started = s->started || whole;");
    line("  valid = whole && pfx_filter(s, t, sample);");
    line("  decision->valid = valid;");
    line("  decision->fault = 0;");
    line("  if (valid) {{");
    line("    pfx_row(s, y, {}torque{});", thresholds() ? "dy, " : "", thresholds() ? ", torque_error" : "");
    line("  }}");
    line("  for (i = 0; i < PFX_CHANNELS; ++i) {{");
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
    line("    c->residual = torque[i] - c->predicted;");
    if (thresholds()) {
      line("    pfx_threshold(s, y[i], dy[i], torque_error[i], i, &c->lower, &c->upper);");
    } else {
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

  const TorqueDetector& detector_;
  const CExportOptions& options_;
  const RegressorFilter& filter_;
  const Model& model_;
  const Measurement& measurement_;
  const detector::ThresholdRule& rule_;
  const c_text::FilterWriter written_;
  const detector::ThresholdRule* risk_rule_;
  std::optional<c_text::SumsWriter> sums_{};
  std::string text_;
};

}  // namespace

std::string c_header(const TorqueDetector& detector, const CExportOptions& options) {
  return Writer(detector, nullptr, options).text();
}

std::string c_header(const TorqueDetector& detector, const detector::ScaleDetector& sums,
                     const CExportOptions& options) {
  return Writer(detector, &sums, options).text();
}

detector::ScaleDetector scale_detector_for_c(const OnlineModel& model, detector::ScaleDetectorOptions options) {
  detector::ScaleDetector result(model, options);
  if (options.set == detector::ParameterSetKind::polytope && !result.rule().table()) {
    options.set = detector::ParameterSetKind::box;
    return detector::ScaleDetector(model, options);
  }
  return result;
}

std::string c_header(const OnlineModel& model, const detector::DetectorOptions& detector, double false_alarms,
                     const CExportOptions& options) {
  const TorqueDetector made = make_detector(model, detector);
  return model.at_risk
             ? c_header(made, scale_detector_for_c(model, {.false_alarms = false_alarms, .set = detector.set}), options)
             : c_header(made, options);
}

}  // namespace wheelwright::exporter
