// SPDX-License-Identifier: Apache-2.0
#include "results/words/summary.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/physical.hpp"
#include "core/words.hpp"
#include "gap/where.hpp"
#include "identify/noise_level.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/gap_words.hpp"
#include "results/words/identification_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

constexpr std::size_t kWidth = 110;  // of a line of words

// `text` in lines, the first one after `first` and the others as deep.
std::string wrapped(std::string_view text, const std::string& first) {
  const std::string indent(text_width(first), ' ');
  std::string out = first, line;
  const auto flush = [&] {
    out += line + "\n";
    line.clear();
  };
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string_view word = text.substr(at, end - at);
    if (!line.empty() && text_width(line) + text_width(word) + 1 + indent.size() > kWidth) {
      flush();
      out += indent;
    }
    line += line.empty() ? "" : " ";
    line += word;
    at = end + 1;
  }
  flush();
  return out;
}

// A table as rows of cells, the first column set to the left and the others to the right.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width;
  for (const auto& row : rows) {
    width.resize(std::max(width.size(), row.size()), 0);
    for (std::size_t c = 0; c < row.size(); ++c) {
      width[c] = std::max(width[c], text_width(row[c]));
    }
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(width[c] - text_width(row[c]), ' ');
      line += c == 0 ? " " + row[c] + blanks : "  " + blanks + row[c];
    }
    out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return out;
}

// How many digits after the point show `spread` with two digits.
int decimals(double spread) {
  return spread > 0.0 && std::isfinite(spread) ? std::clamp(1 - static_cast<int>(std::floor(std::log10(spread))), 0, 12)
                                               : 4;
}

std::string fixed_number(double x, int digits) { return std::isfinite(x) ? fmt::format("{:.{}f}", x, digits) : "-"; }

// Estimators and intervals by method are the lines; one block for each parameter keeps lines short.
std::string comparison(const inference::Identification& r) {
  const auto shown = shown_parameters(r);
  const identify::EstimatorChoice& choice = r.fit.choice;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> header = {""}, units = {""};
  std::vector<int> digits;
  for (std::size_t j = 0; j < shown.size(); ++j) {
    header.push_back(words::spaced(shown[j].name));
    units.push_back(shown[j].unit);
    const auto at = static_cast<Eigen::Index>(j);
    const Eigen::VectorXd& error = r.fit.residuals.standard_error;
    digits.push_back(decimals(at < error.size() ? std::abs(shown[j].scale.scale) * error[at] : 0.0));
  }
  rows.push_back(header);
  rows.push_back(units);
  const auto excluded = [&](std::size_t j) { return r.fit.excitation[j].state == identify::Excitation::not_excited; };
  const auto line = [&](std::string name, const Eigen::VectorXd& theta) {
    std::vector<std::string> row = {std::move(name)};
    for (std::size_t j = 0; j < shown.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      row.push_back(excluded(j) || at >= theta.size() ? "-" : fixed_number(shown[j].value(theta[at]), digits[j]));
    }
    rows.push_back(row);
  };
  for (std::size_t c = 0; c < choice.candidates.size(); ++c) {
    const identify::Estimate& e = choice.candidates[c].estimate;
    if (e.usable) {
      line(words::spaced(identify::to_string(e.estimator)) + (c == choice.chosen ? " (taken)" : ""), e.theta);
    }
  }
  line("robust", r.robust.estimate);
  if (!binding(r.constrained).empty()) {
    line("physically consistent", r.constrained.estimate);
  }
  for (const inference::RegionRow& region : r.regions.rows) {
    if (!region.available) {
      continue;
    }
    for (const bool upper : {false, true}) {
      line(upper ? "  to"
                 : fmt::format("{} {:g} %{}", words::spaced(inference::to_string(region.method)),
                               100.0 * region.confidence, region.all_at_once ? ", all at once" : ""),
           upper ? region.upper : region.lower);
    }
  }
  return aligned(rows);
}

std::string promises(const inference::Identification& r) {
  std::string out;
  for (const inference::RegionRow& row : r.regions.rows) {
    const std::string name = "  " + words::spaced(inference::to_string(row.method)) + ": ";
    out += wrapped(
        row.available ? row.promise + (row.remark.empty() ? "" : "; " + row.remark) : "not available: " + row.remark,
        name);
  }
  return out;
}

std::string noise_lines(const inference::Identification& r) {
  std::string out;
  for (const inference::ColumnNoise& n : r.noise) {
    const bool of_angles = n.known && (n.known->unit != n.unit || n.known->origin == "half an encoder count" ||
                                       r.setting.measurement.motion == MotionKind::angle);
    std::string text = n.known ? fmt::format("{}: ± {:.2g} {}", n.known->origin, n.known->bound, n.known->unit) : "";
    const bool effort =
        std::ranges::find(r.setting.measurement.effort_columns, n.column) != r.setting.measurement.effort_columns.end();
    if (!n.known || effort || !of_angles) {
      text += text.empty() ? "" : "; ";
      text += n.choice.method == inference::NoiseMethod::none
                  ? "not found: " + n.choice.reason
                  : fmt::format("standard deviation {:.2g} {} by {} ({})", n.choice.sd, n.unit,
                                inference::to_string(n.choice.method), n.choice.assumption);
    }
    out += wrapped(text, "  " + n.column + ": ");
  }
  return out;
}

}  // namespace

std::string summary(const inference::Identification& r) {
  std::string text = wrapped(r.setting.robot.name + ": " + verdict(r), "");
  for (const std::string& finding : findings(r)) {
    text += wrapped(finding, "  ");
  }
  if (r.effort && !r.fit.choice.candidates.empty()) {
    text.append("\n").append(comparison(r)).append("\nwhat the intervals promise\n").append(promises(r));
  }
  if (!r.noise.empty()) {
    text.append("\nnoise\n").append(noise_lines(r));
  }
  if (!r.shapes.empty()) {
    text += "\nlooked for beside the model\n";
    for (const inference::ShapeFinding& shape : r.shapes) {
      text += wrapped(in_words(shape), "  ");
    }
  }
  text += "\nnext\n";
  for (const std::string& step : next_steps(r)) {
    text += wrapped(step, "  - ");
  }
  for (const std::string& note : r.notes) {
    text += wrapped(note, "  note: ");
  }
  return text;
}

namespace {

std::string causes_words(const Diagnosis& d) {
  std::string out;
  for (const gap::GapCause& cause : d.causes) {
    out += fmt::format("  {}: {}\n", core::capital(words::effect_noun(cause.effect)), cause.sentence);
    for (const gap::GapEstimate& p : cause.parameters) {
      out += fmt::format("      {} {}\n", words::parameter_words(p.name), words::estimate_words(p));
    }
  }
  return out;
}

std::string figures_words(const std::vector<gap::ShrinkFigure>& figures, const std::string& what) {
  std::string out;
  for (const gap::ShrinkFigure& f : figures) {
    if (!std::isfinite(f.before) || !std::isfinite(f.after)) {
      continue;
    }
    out += fmt::format("  {:<38} {:>9} → {:>9} {}{}\n", what + ", " + words::spaced(f.name), words::number(f.before),
                       words::number(f.after), words::unit_of(f.unit),
                       f.floor > 0.0 ? ", floor " + words::number(f.floor) : "");
  }
  return out;
}

std::string parameters_words(const Diagnosis& d) {
  std::string out;
  for (const gap::ParameterShift& p : d.parametric) {
    out += fmt::format("  {:<20} {:>9} {}{}, {} with the causes\n", words::spaced(p.parameter),
                       words::number(p.without_causes), p.unit,
                       p.nominal ? " (nominal " + words::number(*p.nominal) + ")" : "", words::shift_words(p));
  }
  return out;
}

std::string titled(const std::string& title, const std::string& body) {
  return body.empty() ? body : title + ":\n" + body;
}

// The regimes in which most of what is left lies.
std::string places(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const gap::GapShare& s : d.where) {
    if (s.kind != "channel" && s.kind != "time" && gap::is_finding(s) && names.size() < 3) {
      names.push_back(s.regime);
    }
  }
  return core::enumerated(names);
}

std::string next_step(const Diagnosis& d, const GapResults& r) {
  const auto file = [&r](const char* name) { return r.out + name; };
  const std::string improved =
      r.improved ? fmt::format("wheelwright commission LOG --robot {}", file("robot_improved.yaml")) : std::string();
  switch (d.verdict) {
    case gap::GapVerdict::no_gap:
      if (words::pose_alone(d)) {
        return "log the efforts, too: what changes the torque alone cannot be seen without them.";
      }
      return fmt::format("wheelwright commission LOG --robot {}; nothing is to be added to it.", r.robot);
    case gap::GapVerdict::explained:
      return !improved.empty() ? improved + ", for thresholds that are not widened by what the model lacked."
             : r.out.empty()   ? "run this with --out DIR, which writes the robot file with the causes in it."
                               : "the robot file cannot carry these causes (see the notes): mend them, or model them.";
    case gap::GapVerdict::ambiguous:
      return r.commands ? fmt::format("drive {}, then wheelwright gap on that log.", file("next_manoeuvre.csv"))
                        : std::string("a measurement that tells the causes apart; until then any of them is a guess.");
    case gap::GapVerdict::unexplained: {
      const std::string where = places(d);
      return "add a term to the model: what is left lies in " +
             (where.empty() ? std::string("no regime more than in others") : where) + ".";
    }
  }
  return {};
}

}  // namespace

std::string summary(const Diagnosis& d, const GapResults& r) {
  std::string out = words::gap_verdict(d) + "\n";
  for (const std::string& sentence : words::gap_sentences(d, {})) {
    out += sentence + "\n";
  }
  out += titled("causes, 95 % intervals", causes_words(d));
  out += titled("held out, before → after the causes are in the model",
                figures_words(d.shrink.torque_rms, "torque residual") +
                    figures_words(d.shrink.fresh_torque_rms, "torque residual, fresh log") +
                    figures_words(d.shrink.rollout, "rollout") +
                    figures_words(d.shrink.threshold_width, "width of the threshold") +
                    figures_words(d.shrink.smallest_fault, "smallest radius fault"));
  out += titled("parameters fitted to this log without the causes", parameters_words(d));
  for (const std::string& note : d.notes) {
    out += "note: " + note + "\n";
  }
  if (!r.next_manoeuvre.empty()) {
    out += r.next_manoeuvre + "\n";
  }
  if (r.naive) {
    out += fmt::format("the naive rule (forward selection by BIC over samples) says: {}\n",
                       words::effect_nouns(r.naive_effects));
  }
  return out + "next: " + next_step(d, r) + "\n";
}

namespace {

std::string planned_for(design::Promise guarantee) {
  return guarantee == design::Promise::at_risk ? "  planned for what holds at the stated risk\n" : "";
}

}  // namespace

std::string summary(const design::BoundsDesign& design, const design::DesignSubject& subject) {
  const auto scales = commission::physical_scales(subject.robot, subject.model);
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                design.manoeuvre.plan.t(design.manoeuvre.plan.samples() - 1),
                                design.manoeuvre.plan.reach(), design.manoeuvre.evaluations);
  out += fmt::format("  {:<20} {:>12}{}{}{}\n", "half widths", "promised",
                     design.at_risk ? fmt::format(" {:>12}", fmt::format("risk {:g}", design.risk)) : "",
                     subject.known ? fmt::format(" {:>12}", "model now") : "",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const model::Parameter& parameter = subject.model.parameters[j];
    const double scale = scales ? std::abs((*scales)[j].scale) : 1.0;
    const auto half = [&](const Box& box) { return 0.5 * scale * (box.sides[j].upper - box.sides[j].lower); };
    out += fmt::format("  {:<20} {:>12.4g}", scales ? parameter.physical : parameter.name, half(design.promised));
    if (design.at_risk) {
      out += fmt::format(" {:>12.4g}", half(*design.at_risk));
    }
    if (subject.known) {
      out += fmt::format(" {:>12.4g}", half(*subject.known));
    }
    if (design.figure_eight) {
      out += fmt::format(" {:>14.4g}", half(design.promised_eight));
    }
    out += "  " + (scales ? parameter.physical_unit : commission::parameter_unit(subject.robot, parameter)) + "\n";
  }
  return out + planned_for(design.guarantee);
}

std::string summary(const design::DetectionDesign& design) {
  const design::Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), plan.reach(), design.manoeuvre.evaluations);
  const bool at_risk = !design.at_risk.empty();
  out += fmt::format("  {:<26} {:>10} {:>12} {:>8}{}{}\n", "certainly found from", "asked", "promised", "after",
                     at_risk ? fmt::format(" {:>12} {:>8}", "at the risk", "after") : "",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const design::PromisedFault& p = design.promised[k];
    out += fmt::format("  {:<26} {:>10} {:>12} {:>8}", p.fault.name + (p.side > 0.0 ? " +" : " -"),
                       magnitude_words(p.fault, p.asked),
                       std::isfinite(p.smallest) ? magnitude_words(p.fault, p.smallest) : "none",
                       std::isfinite(p.smallest) ? fmt::format("{:.2f} s", p.t) : "");
    if (at_risk) {
      const design::PromisedFault& q = design.at_risk[k];
      out += fmt::format(" {:>12} {:>8}", std::isfinite(q.smallest) ? magnitude_words(q.fault, q.smallest) : "none",
                         std::isfinite(q.smallest) ? fmt::format("{:.2f} s", q.t) : "");
    }
    if (design.figure_eight) {
      const double eight = design.promised_eight[k].smallest;
      out += fmt::format(" {:>14}", std::isfinite(eight) ? magnitude_words(p.fault, eight) : "none");
    }
    out += "\n";
  }
  if (at_risk) {
    out += fmt::format("  at the risk: such a fault is missed with a probability of at most {:.2g}\n", design.miss);
  }
  return out + planned_for(design.guarantee);
}

std::string summary(const gap::DiscriminationDesign& design) {
  const design::Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), plan.reach(), design.manoeuvre.evaluations);
  for (const std::string& stage : design.stages) {
    out += "  " + stage + "\n";
  }
  out += fmt::format("  {:<52} {:>12}{}\n", "standard deviations from going wrong", "promised",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const gap::RivalSeparation& pair = design.promised[k];
    out +=
        fmt::format("  {:<52} {:>12.2f}",
                    design.rivals[pair.truth].name() + ", not " + design.rivals[pair.other].name(), pair.deviations());
    out += design.figure_eight ? fmt::format(" {:>14.2f}\n", design.promised_eight[k].deviations()) : "\n";
  }
  for (const std::string& sentence : design.sentences) {
    out += sentence + "\n";
  }
  return out;
}

namespace {

constexpr std::size_t kFindings = 5;

std::string with_unit(const std::string& unit) { return unit.empty() || unit == "1" ? "" : " " + unit; }

std::string shown(double x) { return words::number(x, 3); }

std::string interval(const study::SobolIndex& index) {
  return fmt::format("{} [{}, {}]", words::decimal(index.estimate, 2), words::decimal(index.lower, 2),
                     words::decimal(index.upper, 2));
}

std::string one_at_a_time_lines(const study::Study& study, const study::OneAtATime& found) {
  std::string out;
  for (const std::size_t i : found.order) {
    const study::StudyInput& input = study.inputs[i];
    const study::InputCurve& curve = found.inputs[i];
    const std::string range = fmt::format("{} … {}{}", shown(input.lower), shown(input.upper), with_unit(input.unit));
    out += "  " + padded(input.name, 26) + padded(range, 26) + shown(curve.low) + " … " + shown(curve.high) + "\n";
  }
  return out;
}

std::string sobol_lines(const study::Study& study, const study::SobolIndices& found) {
  if (found.status != study::SobolStatus::estimated) {
    return found.status == study::SobolStatus::constant ? "  does not depend on the inputs\n"
                                                        : "  too few points have a value for Sobol indices\n";
  }
  std::string out = "  " + padded("share of the variance", 26) + padded("alone", 26) + "with all interactions\n";
  for (std::size_t i = 0; i < found.first.size(); ++i) {
    out += "  " + padded(study.inputs[i].name, 26) + padded(interval(found.first[i]), 26) + interval(found.total[i]) +
           "\n";
  }
  if (found.left_out > 0.0) {
    out += fmt::format("  {} of the base points have no value: the shares are those of the rest\n",
                       words::percent(found.left_out));
  }
  return out;
}

std::string morris_lines(const study::Study& study, const std::vector<study::ElementaryEffects>& found) {
  std::string out =
      "  " + padded("elementary effects", 26) + padded("μ* over the whole range", 26) + "σ (curvature, interactions)\n";
  for (std::size_t i = 0; i < found.size(); ++i) {
    const study::ElementaryEffects& e = found[i];
    out += "  " + padded(study.inputs[i].name, 26) +
           padded(fmt::format("{} [{}, {}]", shown(e.mean_absolute), shown(e.lower), shown(e.upper)), 26) +
           shown(e.deviation) + "\n";
  }
  return out;
}

std::string local_lines(const study::LocalSensitivity& local) {
  if (local.inputs.empty()) {
    return {};
  }
  std::string out = padded("per cent of width per per cent of", 36);
  for (const std::string& parameter : local.parameters) {
    out += padded(parameter, 18);
  }
  out += "\n";
  for (const study::LocalDerivative& input : local.inputs) {
    out += "  " + padded(input.input, 34);
    for (const study::ParameterDerivative& d : input.parameters) {
      out += padded(d.elasticity ? shown(*d.elasticity) : "–", 18);
    }
    out += "\n";
  }
  const std::vector<std::string> kinks = study::not_differentiable(local);
  if (!kinks.empty()) {
    out += fmt::format("  –: not differentiable there ({} in all; the report and the JSON say why)\n", kinks.size());
  }
  return out;
}

// Why logs failed, the most frequent reasons first, each with one log that it befell.
std::string failure_lines(const study::FleetResult& fleet) {
  constexpr std::size_t kMostReasons = 5;
  struct Reason {
    const study::FleetFinding* first;
    std::size_t count;
  };
  std::vector<Reason> reasons;
  for (const study::FleetFinding& finding : fleet.failed) {
    const auto known = std::ranges::find_if(reasons, [&](const Reason& r) { return r.first->text == finding.text; });
    if (known == reasons.end()) {
      reasons.push_back({&finding, 1});
    } else {
      ++known->count;
    }
  }
  std::ranges::stable_sort(reasons, std::ranges::greater(), &Reason::count);
  std::string out;
  for (std::size_t i = 0; i < std::min(reasons.size(), kMostReasons); ++i) {
    const auto& [first, count] = reasons[i];
    out += fmt::format("  {}{}{}: {}\n", fleet.table.robots[first->robot], first->log.empty() ? "" : ", " + first->log,
                       count > 1 ? fmt::format(" and {} more", count - 1) : "", first->text);
  }
  if (reasons.size() > kMostReasons) {
    out +=
        fmt::format("  and {} other reasons: see fleet.json or report.html in --out\n", reasons.size() - kMostReasons);
  }
  return out;
}

}  // namespace

std::string summary(const study::Study& study, const study::StudyResult& result,
                    const std::optional<study::LocalSensitivity>& local) {
  std::string out;
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    out += study.quantities[q].name + with_unit(study.quantities[q].unit);
    if (!result.one_at_a_time.empty()) {
      out += ": " + shown(result.one_at_a_time[q].nominal) + " as it is\n" +
             one_at_a_time_lines(study, result.one_at_a_time[q]);
    } else {
      out += "\n";
    }
    if (!result.morris.empty()) {
      out += morris_lines(study, result.morris[q]);
    }
    if (!result.sobol.empty()) {
      out += sobol_lines(study, result.sobol[q]);
    }
  }
  out += local ? local_lines(*local) : std::string();
  std::size_t without = 0;
  for (const study::StudyFinding& finding : result.findings) {
    without += finding.points;
  }
  if (without > 0) {
    out += fmt::format("{} of {} points gave no model:\n", without, result.points);
    for (std::size_t k = 0; k < std::min(kFindings, result.findings.size()); ++k) {
      out += fmt::format("  {:5} {}\n", result.findings[k].points, result.findings[k].sentence);
    }
  }
  return out;
}

std::string summary(const study::FleetResult& fleet) {
  std::string out;
  for (const std::string& sentence : study::sentences(fleet)) {
    out += sentence + "\n";
  }
  return out + failure_lines(fleet);
}

}  // namespace wheelwright::words
