// SPDX-License-Identifier: Apache-2.0
#include "results/report/detect_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/constant_thresholds.hpp"
#include "commission/event_isolation.hpp"
#include "commission/physical.hpp"
#include "commission/watch/other_parameters.hpp"
#include "core/limits.hpp"
#include "results/report/drawing.hpp"
#include "results/report/outlook.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/report/signals.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using namespace words;

namespace {

TimeAxis axis_for(const Detection& detection, const ReportContext& context) {
  return context.signals && context.signals->rows() > 0 ? TimeAxis(context.signals->t) : TimeAxis(detection.trace.t);
}

std::string event_table(const Detection& detection, const OnlineModel& model, const TimeAxis& axis) {
  if (detection.events.empty()) {
    return paragraph("None.");
  }
  constexpr std::size_t most_rows = 500;
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < detection.events.size() && k < most_rows; ++k) {
    const detector::Event& e = detection.events[k];
    rows.push_back({time_button(e.start, e.end, "event " + std::to_string(k + 1), axis),
                    escape(output_name(model.model, e.output)), numeric(axis.text(e.start)),
                    numeric(axis.text(e.alarm)), numeric(axis.text(e.end)), numeric(axis.text(e.peak_time)),
                    numeric(number(e.peak_residual)), numeric(number(e.peak_ratio)), numeric(count(e.instants))});
  }
  std::string out = table({"", "Output", numeric("start"), numeric("alarm"), numeric("end"), numeric("peak at"),
                           numeric("ε at the peak"), numeric("peak ratio"), numeric("instants outside")},
                          rows);
  if (detection.events.size() > most_rows) {
    out += paragraph(fmt::format("The first {} of {} events.", count(most_rows), count(detection.events.size())));
  }
  return out +
         paragraph(
             "<span class=\"note\">Peak ratio: distance of ε from the middle of [l, u] over half its width; above "
             "1 is outside. A click on an event zooms all charts to it.</span>");
}

std::string output_table(const Detection& detection, const OnlineModel& model) {
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < detection.utilisation.size(); ++i) {
    const std::size_t outside = i < detection.outside.size() ? detection.outside[i] : 0;
    const std::string nrmse = i < detection.nrmse.size() ? percent(detection.nrmse[i]) : "–";
    rows.push_back({escape(output_name(model.model, i)), numeric(count(detection.instants)), numeric(count(outside)),
                    numeric(percent(detection.utilisation[i])), numeric(nrmse)});
  }
  return table({"Output", numeric("instants"), numeric("outside"), numeric("utilisation"), numeric("NRMSE")}, rows) +
         paragraph(
             "<span class=\"note\">Utilisation: how far the residual went from the middle of [l, u] at most, 100 % "
             "being "
             "the threshold. NRMSE: rms of the residual over rms of the filtered effort.</span>");
}

// Constant thresholds, and what was tried of them.
std::string constant_section(const detector::ConstantThresholds& thresholds, const OnlineModel& model) {
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < thresholds.outputs.size(); ++i) {
    const detector::ConstantThreshold& t = thresholds.outputs[i];
    rows.push_back({escape(output_name(model.model, i)), numeric(number(t.value)),
                    escape(unit_of(commission::output_unit(model.robot, model.model.output_units[i]))),
                    t.stated ? "the robot file" : "experiment", numeric(count(t.held_out)),
                    numeric(count(t.exceeded))});
  }
  return paragraph(escape(core::capital(commission::sentence(thresholds))) + ".") +
         table({"Output", numeric("μ_o"), "unit", "from", numeric("blocks<br>tried on"), numeric("of these<br>above")},
               rows);
}

std::string kinematic_section(const KinematicFindings& kinematic, const OnlineModel& model, const TimeAxis& axis) {
  if (!kinematic.detection || !model.kinematic) {
    return paragraph("The kinematic residual was not watched: " +
                     escape(kinematic.message.empty() ? "the model has none" : kinematic.message) +
                     ". Slip across the heading, among others, does not show without it.");
  }
  const Detection& d = *kinematic.detection;
  OnlineModel names = model;
  names.robot.effort = model::EffortKind::torque;
  names.model = detector::kinematic_outputs(*model.kinematic);
  std::vector<std::vector<ChartMark>> marks(d.trace.outputs.size());
  for (std::size_t k = 0; k < d.events.size(); ++k) {
    if (d.events[k].output < marks.size()) {
      marks[d.events[k].output].push_back({d.events[k].start, d.events[k].end, "K" + std::to_string(k + 1)});
    }
  }
  return paragraph(fmt::format(
             "What pose or gyro saw over the last {} against what the wheels rolled: {} instants over "
             "{} of driving. {}",
             with_unit(number(model.kinematic->window), "s"), count(d.instants), with_unit(number(d.seconds, 4), "s"),
             d.residual == detector::Residual::d2 ? "The grey band is [−μ_o, μ_o] of D2, without guarantee."
                                                  : "Without a fault the residual stays inside the grey "
                                                    "band.")) +
         (d.residual == detector::Residual::d2 ? constant_section(*model.kinematic->constant, names) : std::string()) +
         event_table(d, names, axis) + output_table(d, names) +
         (d.trace.t.empty() ? std::string()
                            : residual_charts(d.trace, names.robot, names.model, marks, axis, "kinematic") +
                                  thinning_note(d.instants, d.trace.t.size(), "instants"));
}

std::string isolation_section(const std::vector<detector::Isolation>& isolations, const Detection& detection,
                              const TimeAxis& axis) {
  using Verdict = detector::FaultFinding::Verdict;
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < isolations.size() && k < detection.events.size(); ++k) {
    std::vector<std::string> possible, excluded, open;
    for (const detector::FaultFinding& f : isolations[k].findings) {
      switch (f.verdict) {
        case Verdict::consistent: possible.push_back(core::capital(commission::sentence(f))); break;
        case Verdict::excluded: excluded.push_back(spaced(f.fault.name)); break;
        case Verdict::not_examined: open.push_back(spaced(f.fault.name)); break;
      }
    }
    const detector::Event& e = detection.events[k];
    std::string others = fmt::format("<details><summary>{} excluded</summary>{}</details>", excluded.size(),
                                     escape(core::enumerated(excluded)));
    if (!open.empty()) {
      others += "<small>not examined: " + escape(core::enumerated(open)) + "</small>";
    }
    rows.push_back({time_button(e.start, e.end, "event " + std::to_string(k + 1), axis),
                    possible.empty() ? "Nothing in the catalogue explains it." : bullets(possible), others});
  }
  return paragraph(
             "Which faults of the catalogue the data around each alarm leave possible. What is excluded is proved to "
             "explain them with no size, no onset, no parameters of the feasible set and no admissible noise, if they "
             "are steps that stay: of such a fault of the catalogue the true size and onset lie in the intervals. A "
             "fault that came slowly may be excluded, or its size and onset may lie elsewhere. What is said at the "
             "stated risk stands "
             "on "
             "sums over scales, and on errors that average out.") +
         table({"", "Still possible", "other faults"}, rows);
}

// Sums over scales: how near they came to what a healthy robot's can be, and where they went beyond.
std::string at_risk_section(const commission::RiskWatch& watch, const OnlineModel& model, const TimeAxis& axis) {
  constexpr double kYear = 365.25 * 86400.0;
  const std::vector<double>& scales = model.at_risk ? model.at_risk->scales : model.kinematic->at_risk->scales;
  const bool declared = !model.at_risk || model.at_risk->warrant == core::Warrant::guaranteed;
  std::string out = paragraph(fmt::format(
      "Weighted sums over {} to {} s of {}, matched to faults, were compared {} times with what the "
      "errors of a healthy robot can make of them; in {} years of driving at most one false alarm is to be expected, "
      "as long as the errors are as {}. The largest reached {} of its threshold.",
      number(scales.front()), number(scales.back()),
      !watch.pose     ? "what the model leaves"
      : model.at_risk ? "what the model leaves of the torque, and wheel odometry of the pose"
                      : "what wheel odometry leaves of the pose",
      count(watch.looks), number(1.0 / (watch.false_alarms * kYear), 2),
      declared ? "the robot file declares them" : "they were in the log that the model was learnt from",
      percent(watch.utilisation)));
  std::vector<std::vector<Cell>> rows;
  for (const commission::RiskEvent& e : watch.events) {
    rows.push_back({escape(axis.text(e.alarm)), escape(axis.text(e.end)), escape(commission::sum_words(e, model.model)),
                    numeric(number(e.scale)), numeric(number(e.ratio, 3))});
  }
  return rows.empty()
             ? out
             : out + table({"alarm", "until", "matched to", numeric("over, s"), numeric("times the threshold")}, rows);
}

// Sizes over time, incident by incident: of the candidates first.
std::string sizes_section(const std::vector<detector::Incident>& incidents) {
  constexpr std::size_t most_incidents = 8, most_faults = 6;
  std::string out;
  for (std::size_t k = 0; k < std::min(incidents.size(), most_incidents); ++k) {
    const detector::Incident& incident = incidents[k];
    std::vector<const detector::SizeOverTime*> shown;
    for (const detector::IncidentCandidate& candidate : incident.candidates) {
      const auto at = std::ranges::find(incident.sizes, candidate.finding.fault.name,
                                        [](const detector::SizeOverTime& s) { return s.fault.name; });
      if (at != incident.sizes.end()) {
        shown.push_back(&*at);
      }
    }
    for (const detector::SizeOverTime& size : incident.sizes) {
      if (!size.growing_excluded && std::ranges::find(shown, &size) == shown.end()) {
        shown.push_back(&size);
      }
    }
    std::string drawings;
    for (std::size_t i = 0; i < std::min(shown.size(), most_faults); ++i) {
      const std::string drawing = size_band(*shown[i], incident.start);
      if (!drawing.empty()) {
        const std::string known = commission::sentence(*shown[i]);
        drawings += "<div><h3>" + escape(core::capital(shown[i]->fault.sentence)) + "</h3>" + drawing +
                    (known.empty() ? "" : paragraph(escape(core::capital(known)) + ".")) + "</div>";
      }
    }
    if (!drawings.empty()) {
      out += fmt::format("<h3>Incident {}</h3><div class=\"pairs\">{}</div>", k + 1, drawings);
    }
  }
  return out.empty() ? out
                     : paragraph(
                           "How large each fault can have been over time, whether it was a step or not. Band: the "
                           "size at each instant, if it only grew (a step, a ramp, from before the log or not). Bars: "
                           "the mean of the size over the time that a bar covers, whatever its course; the weights are "
                           "the way of the wheel, or the filter's kernel, for a lost share times the effort. The "
                           "dashed line: from here on some fault was there.") +
                           out;
}

}  // namespace

std::string detect_report(const Detection& detection, const OnlineModel& model, const ReportContext& context,
                          const KinematicFindings& kinematic, const std::vector<detector::Isolation>& isolations,
                          const commission::RiskWatch& at_risk, const std::vector<detector::Incident>& incidents,
                          const std::string& undecided, const commission::OtherParameters* other) {
  const TimeAxis axis = axis_for(detection, context);
  std::vector<std::vector<ChartMark>> marks(detection.trace.outputs.size());
  std::vector<ChartMark> all_marks;
  for (std::size_t k = 0; k < detection.events.size(); ++k) {
    const detector::Event& e = detection.events[k];
    const ChartMark mark{e.start, e.end, std::to_string(k + 1)};
    all_marks.push_back(mark);
    if (e.output < marks.size()) {
      marks[e.output].push_back(mark);
    }
  }

  PageContent content;
  content.title = context.title.empty() ? "Detection on " + model.robot.name : context.title;
  const std::size_t kinematic_events = kinematic.detection ? kinematic.detection->events.size() : 0;
  const bool fault = !detection.events.empty() || kinematic_events > 0 || !at_risk.events.empty();
  content.status = fault ? "bad" : detection.instants == 0 || !undecided.empty() ? "caution" : "good";
  content.verdict = detect_verdict(detection, kinematic_events + at_risk.events.size(), !undecided.empty());
  const bool d2 = detection.residual == detector::Residual::d2;
  if (d2) {
    content.sentences.emplace_back(
        "Decided by the residual D2 with constant thresholds: without guarantee, and with false alarms now and then.");
  }
  if (!undecided.empty()) {
    content.sentences.push_back(core::capital(undecided) + (undecided.ends_with('?') ? "" : "."));
  }
  if (other != nullptr) {
    content.sentences.push_back(core::capital(commission::sentence(*other)) + ".");
  }
  for (const detector::Incident& incident : incidents) {  // what an event may be is said of its incident
    content.sentences.push_back(core::capital(incident_sentence(incident)));
  }
  if (!at_risk.events.empty()) {
    content.sentences.push_back(core::capital(commission::sentence(at_risk.events.front(), model.model)) + ".");
  }
  const std::vector<std::string> words =
      detect_words(detection, model, incidents.empty() ? isolations : std::vector<detector::Isolation>(), axis);
  content.sentences.insert(content.sentences.end(), words.begin(), words.end());
  if (kinematic_events > 0) {
    const detector::Event& first = kinematic.detection->events.front();
    content.sentences.push_back(fmt::format(
        "{} of these in the kinematic residual, the first alarm at {}: pose or gyro did not move as the wheels rolled.",
        core::capital(plural(kinematic_events, "event")), axis.text(first.alarm)));
  }
  content.software = context.software;
  if (!d2) {
    content.warrant = model.warrant;
  }
  content.sections.push_back({"events", "Events", event_table(detection, model, axis)});
  if (at_risk.watched) {
    content.sections.push_back({"at_risk", "At a stated risk", at_risk_section(at_risk, model, axis)});
  }
  if (!isolations.empty()) {
    content.sections.push_back({"isolation", "What it can be", isolation_section(isolations, detection, axis)});
  }
  if (std::string sizes = sizes_section(incidents); !sizes.empty()) {
    content.sections.push_back({"sizes", "How large, over time", std::move(sizes)});
  }
  if (d2) {
    content.sections.push_back({"thresholds", "Constant thresholds", constant_section(*model.constant, model)});
  }
  if (!detection.trace.t.empty()) {
    content.sections.push_back(
        {"residual", "Residual and threshold",
         paragraph(d2 ? "The grey band is [−μ_o, μ_o] of D2, without guarantee: ε = τ_f − Y_f θ̂ of a healthy robot "
                        "leaves it no "
                        "more often than the thresholds promise, if they hold. Events are shaded and numbered. Drag to "
                        "zoom (all charts "
                        "follow), Shift and drag to pan, double click for the whole log."
                      : "Without a fault ε = τ_f − Y_f θ̂ stays inside the grey band [l, u]. Events are shaded and "
                        "numbered. Drag to zoom (all charts follow), Shift and drag to pan, double click for the whole "
                        "log.") +
             residual_charts(detection.trace, model.robot, model.model, marks, axis, "trace") +
             torque_charts(detection.trace, model.robot, model.model, axis, "trace") +
             thinning_note(detection.instants, detection.trace.t.size(), "instants")});
  }
  content.sections.push_back({"kinematic", "Kinematic residual", kinematic_section(kinematic, model, axis)});
  content.sections.push_back({"signals", "Raw signals",
                              context.signals ? signal_charts(*context.signals, all_marks, axis, context.rows)
                                              : paragraph("The raw signals were not handed to this page.")});
  std::string data = output_table(detection, model);
  data += paragraph(
      fmt::format("{} rows; an alarm is raised when {} of {} successive instants lie outside; filter of order {}, "
                  "β = {} 1/s, delay {}.",
                  count(detection.rows), model.persistence.k, model.persistence.n, model.filter.order,
                  number(model.filter.beta), with_unit(number(model.filter.delay()), "s")));
  data += provenance(context, axis);
  if (!context.warnings.empty()) {
    data += "<h3>Repairs and remarks of the log reader</h3>\n" + bullets(context.warnings);
  }
  if (std::string given = assumptions_section(model.assumptions); !given.empty()) {
    content.sections.push_back({"assumptions", "Assumptions", std::move(given)});
  }
  content.sections.push_back({"data", "Data", std::move(data)});
  return page(content);
}

namespace {

constexpr std::array kDashes = {"", "7 4", "2 3", "9 3 2 3", "4 3"};
constexpr std::array kColours = {"--first", "--second", "--third", "--ink", "--caution"};

struct Curve {
  std::string label;
  std::vector<std::pair<double, double>> median, worst;
};

std::string path(const std::vector<std::pair<double, double>>& points, const Axis& x, const Axis& y, std::size_t style,
                 double width) {
  std::string d;
  for (const auto& [at, size] : points) {
    d += fmt::format("{}{:.1f} {:.1f}", d.empty() ? "M" : " L", x(at), y(size));
  }
  return fmt::format("<path d=\"{}\" style=\"fill:none;stroke:var({});stroke-width:{};stroke-dasharray:{}\"/>", d,
                     kColours[style], width, *kDashes[style] != '\0' ? kDashes[style] : "none");
}

// Smallest certain sizes over the delay, of some onsets.
Curve curve_of(const std::string& label, const detector::FaultMargins& margins, const std::vector<double>& windows,
               std::optional<detector::ManoeuvreKind> kind) {
  Curve curve{label, {}, {}};
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const detector::MarginSummary summary = detector::summarise(margins, w, kind);
    const auto add = [&](std::vector<std::pair<double, double>>& to, double size) {
      if (summary.onsets > 0 && std::isfinite(size) && size > 0.0) {
        to.emplace_back(windows[w], size);
      }
    };
    add(curve.median, summary.median);
    add(curve.worst, summary.worst);
  }
  return curve;
}

std::string chart_of(const std::vector<Curve>& curves, const model::FaultType& fault, double from, double to) {
  double low = core::kInfinity, high = 0.0;
  for (const Curve& curve : curves) {
    for (const auto* points : {&curve.median, &curve.worst}) {
      for (const auto& [at, size] : *points) {
        low = std::min(low, size);
        high = std::max(high, size);
      }
    }
  }
  const bool drawn = std::any_of(curves.begin(), curves.end(), [](const Curve& c) { return c.median.size() > 1; });
  if (!drawn) {
    return {};
  }
  constexpr double width = 520.0, height = 260.0, left = 70.0, right = 170.0, top = 10.0, bottom = 40.0;
  const double scale = fault.unit == "1" ? 100.0 : 1.0;
  const Axis x{{from, to}, left, width - right, true};
  const Axis y{{scale * low / 1.1, scale * high * 1.1}, height - bottom, top, true};
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"smallest certain size over "
      "delay\">",
      width, height);
  for (const double tick : logarithmic_ticks(x.low, x.high, true)) {
    out += fmt::format(
        "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4:g}</text>",
        x(tick), top, height - bottom, height - bottom + 14.0, tick);
  }
  for (const double tick : logarithmic_ticks(y.low, y.high, true)) {
    out += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:g}</text>",
        left, width - right, y(tick), left - 6.0, y(tick) + 4.0, tick);
  }
  out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">delay, s</text>", 0.5 * (left + width - right),
                     height - 6.0);
  out +=
      fmt::format("<text x=\"14\" y=\"{0}\" transform=\"rotate(-90 14 {0})\" text-anchor=\"middle\">size, {1}</text>",
                  0.5 * (top + height - bottom), escape(fault.unit == "1" ? "%" : fault.unit));
  double at = top + 10.0;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const std::size_t style = k % kDashes.size();
    const auto scaled = [&](std::vector<std::pair<double, double>> points) {
      for (auto& point : points) {
        point.second *= scale;
      }
      return points;
    };
    if (curves[k].median.empty()) {
      continue;
    }
    out += path(scaled(curves[k].median), x, y, style, 2.0);
    out += path(scaled(curves[k].worst), x, y, style, 0.8);
    out += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\" "
        "style=\"stroke:var({3});stroke-width:2;stroke-dasharray:{4}\"/><text class=\"ink\" x=\"{5}\" "
        "y=\"{6}\">{7}</text>",
        width - right + 8.0, width - right + 36.0, at, kColours[style],
        *kDashes[style] != '\0' ? kDashes[style] : "none", width - right + 42.0, at + 4.0, escape(curves[k].label));
    at += 18.0;
  }
  return out + "</svg>";
}

}  // namespace

std::string size_band(const detector::SizeOverTime& size, double start) {
  constexpr double width = 380.0, height = 220.0, left = 56.0, right = 356.0, top = 22.0, bottom = 176.0;
  const double factor = size.fault.unit == "1" ? 100.0 : 1.0;
  const std::string unit = size.fault.unit == "1" ? "%" : size.fault.unit;
  Axis x(left, right), y(bottom, top);
  // The fault's whole range would dwarf what is known: it is shown to twice the largest amount that is certain or told.
  double amount = 0.0;
  const auto known = [&](const Interval& each) {
    amount = std::max({amount, each.lower, -each.upper});
    for (const double end : {each.lower, each.upper}) {
      if (end > 0.99 * size.fault.range.lower && end < 0.99 * size.fault.range.upper) {
        amount = std::max(amount, std::abs(end));
      }
    }
  };
  for (const detector::SizeAt& at : size.growing) {
    x.take(at.t);
    known(at.size);
  }
  for (const detector::MeanSize& mean : size.means) {
    x.take(mean.from);
    x.take(mean.to);
    known(mean.size);
  }
  if (x.empty() || !(amount > 0.0)) {
    return {};
  }
  x.take(start);
  // Where one sign alone is possible the other has no place.
  Interval ends{0.0, 0.0};
  const auto take = [&](const Interval& each) {
    ends = {std::min(ends.lower, each.lower), std::max(ends.upper, each.upper)};
  };
  for (const detector::SizeAt& each : size.growing) {
    take(each.size);
  }
  for (const detector::MeanSize& each : size.means) {
    take(each.size);
  }
  y.take(factor * std::max(ends.lower, -2.0 * amount));
  y.take(factor * std::min(ends.upper, 2.0 * amount));
  y.take(0.0);
  const auto at = [&](double value) { return y.inside(factor * value); };
  std::string out = open_svg(width, height, "size of the fault over time");
  for (const double tick : y.ticks()) {
    out += fmt::format("<path d=\"M{:.1f} {:.1f} H{:.1f}\" style=\"stroke:var(--pale)\"/>", left, y(tick), right) +
           svg_text(left - 5.0, y(tick) + 4.0, "end", fmt::format("{:.3g}", tick));
  }
  for (const double tick : x.ticks()) {
    out += svg_text(x(tick), bottom + 16.0, "middle", fmt::format("{:.5g}", tick));
  }
  out += svg_text(0.5 * (left + right), bottom + 34.0, "middle", "time, s") + svg_text(left, top - 10.0, "end", unit);
  if (!size.growing.empty()) {
    std::string upper, lower;
    for (const detector::SizeAt& each : size.growing) {
      upper += fmt::format("{}{:.1f} {:.1f}", upper.empty() ? "M" : " L", x(each.t), at(each.size.upper));
      lower = fmt::format(" L{:.1f} {:.1f}", x(each.t), at(each.size.lower)) + lower;
    }
    out += "<path d=\"" + upper + lower +
           " Z\" style=\"fill:var(--first);fill-opacity:0.35;stroke:var(--first);stroke-width:1\"/>";
  }
  // Of means that lie over each other every so many.
  constexpr std::size_t most_bars = 60;
  const std::size_t every = size.means.size() / most_bars + 1;
  for (std::size_t k = 0; k < size.means.size(); k += every) {
    const detector::MeanSize& mean = size.means[k];
    const double high = at(mean.size.upper), low = at(mean.size.lower);
    out += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
        "style=\"fill:var(--second);fill-opacity:0.12\"/><path d=\"M{:.1f} {:.1f} V{:.1f}\" "
        "style=\"stroke:var(--second);stroke-width:1.5\"/>",
        x(mean.from), high, std::max(0.5, x(mean.to) - x(mean.from)), std::max(0.5, low - high), x(mean.to), high, low);
  }
  return out +
         fmt::format("<path d=\"M{0:.1f} {1:.1f} V{2:.1f}\" style=\"stroke:var(--ink);stroke-dasharray:4 3\"/></svg>",
                     x(start), top, bottom);
}

std::string delay_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey) {
  std::vector<Curve> curves;
  for (const auto& [kind, count] : survey.manoeuvres) {
    curves.push_back(curve_of(std::string(detector::manoeuvre_words(kind)), margins, survey.windows, kind));
  }
  return chart_of(curves, margins.fault, survey.windows.front(), survey.windows.back());
}

std::string risk_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey) {
  if (!survey.at_risk) {
    return {};
  }
  std::vector<Curve> curves;
  for (const commission::ResidualMargins& residual : survey.residuals) {
    for (const detector::FaultMargins& each : residual.margins) {
      if (each.fault.name == margins.fault.name && each.side == margins.side) {
        curves.push_back(curve_of("every noise, " + residual.name, each, survey.windows, std::nullopt));
        curves.back().worst.clear();
      }
    }
  }
  const std::vector<double>& windows = survey.at_risk->windows;
  curves.push_back(curve_of("at the stated risk", margins, windows, std::nullopt));
  curves.back().worst.clear();
  return chart_of(curves, margins.fault, std::min(windows.front(), survey.windows.front()), windows.back());
}

std::string margin_map(const detector::OperatingMap& map, const model::FaultType& fault, const std::string& x_label,
                       const std::string& y_label) {
  double low = core::kInfinity, high = 0.0;
  for (const double size : map.smallest.reshaped()) {
    if (std::isfinite(size) && size > 0.0) {
      low = std::min(low, size);
      high = std::max(high, size);
    }
  }
  if (!(high > 0.0)) {
    return {};
  }
  high = std::max(high, low * 1.01);
  const std::size_t nx = map.plane.x.size(), ny = map.plane.y.size();
  constexpr double side = 230.0, left = 60.0, top = 10.0;
  const double cell_x = side / static_cast<double>(nx), height = ny > 1 ? side : 40.0,
               cell_y = height / static_cast<double>(ny);
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"smallest certain size over "
      "the "
      "operating space\">",
      left + side + 20.0, top + height + 60.0);
  for (std::size_t a = 0; a < nx; ++a) {
    for (std::size_t b = 0; b < ny; ++b) {
      const double size = map.smallest(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      const double share =
          std::isfinite(size) ? 1.0 - std::log(std::max(size, low) / low) / std::log(high / low) : -1.0;
      out += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
          "style=\"fill:var({});fill-opacity:{:.3f}\">"
          "<title>{:.3g}, {:.3g}: {}</title></rect>",
          left + cell_x * static_cast<double>(a), top + height - cell_y * static_cast<double>(b + 1), cell_x, cell_y,
          share >= 0.0 ? "--first" : "--pale", share >= 0.0 ? 0.12 + 0.88 * share : 1.0, map.plane.x[a], map.plane.y[b],
          escape(magnitude_words(fault, size)));
    }
  }
  const auto text = [&](double x, double y, const char* anchor, const std::string& what) {
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor, escape(what));
  };
  text(left, top + height + 14.0, "start", number(map.plane.x.front(), 2));
  text(left + side, top + height + 14.0, "end", number(map.plane.x.back(), 2));
  text(left + 0.5 * side, top + height + 14.0, "middle", x_label);
  if (ny > 1) {
    text(left - 5.0, top + height, "end", number(map.plane.y.front(), 2));
    text(left - 5.0, top + 10.0, "end", number(map.plane.y.back(), 2));
    out += fmt::format("<text x=\"14\" y=\"{0}\" transform=\"rotate(-90 14 {0})\" text-anchor=\"middle\">{1}</text>",
                       top + 0.5 * height, escape(y_label));
  }
  text(left, top + height + 34.0, "start",
       fmt::format("dark {}, pale {}, empty: none", magnitude_words(fault, low), magnitude_words(fault, high)));
  return out + "</svg>";
}

namespace {

std::string name_of(const detector::FaultMargins& margins) {
  const bool sides = !margins.fault.whole && margins.fault.range.lower < 0.0;
  return spaced(margins.fault.name) + (sides ? margins.side > 0.0 ? ", growing" : ", shrinking" : "");
}

std::string margins_table(const commission::MarginSurvey& survey, const commission::ResidualMargins& residual) {
  const std::size_t window = shown_window(survey);
  std::vector<Cell> header = {"Fault"};
  for (const auto& [kind, count] : survey.manoeuvres) {
    header.push_back(numeric(core::capital(std::string(detector::manoeuvre_words(kind))) +
                             fmt::format("<small>{}</small>", plural(count, "onset"))));
  }
  std::vector<std::vector<Cell>> rows;
  for (const detector::FaultMargins& margins : residual.margins) {
    std::vector<Cell> row = {escape(core::capital(name_of(margins))) + "<small>" + escape(margins.fault.sentence) +
                             "</small>"};
    for (const auto& [kind, count] : survey.manoeuvres) {
      row.push_back(numeric(escape(certain_words(margins, window, kind))));
    }
    rows.push_back(std::move(row));
  }
  std::string out = warrant_note(residual.warrant) + table(header, rows);
  if (!residual.blind.empty()) {
    std::vector<std::string> names;
    for (const std::string& name : residual.blind) {
      names.push_back(spaced(name));
    }
    out += paragraph("Leaves no trace in this residual, whatever its size: " + escape(core::enumerated(names)) + ".");
  }
  return out +
         paragraph(fmt::format(
             "<span class=\"note\">Size from which on the fault raises an alarm within {:g} s, for every θ of the "
             "feasible set and all noise within its bounds, whenever it sets in during such driving, or at so many "
             "of the moments that were tried; –: at none. The rule is {} of {} instants.</span>",
             survey.windows[window], survey.persistence.k, survey.persistence.n));
}

std::string curves(const commission::MarginSurvey& survey, const commission::ResidualMargins& residual) {
  std::string out;
  for (const detector::FaultMargins& margins : residual.margins) {
    const std::string drawing = margins.fault.whole ? "" : delay_curves(margins, survey);
    if (!drawing.empty()) {
      out += "<div><h3>" + escape(core::capital(name_of(margins))) + "</h3>" + drawing + "</div>";
    }
  }
  return "<div class=\"pairs\">" + out + "</div>" +
         paragraph(
             "<span class=\"note\">Thick: certain at half of the onsets of the manoeuvre; thin: at every one. A "
             "size reads the other way round, too: how long a fault of that size can go unseen.</span>");
}

std::string maps(const commission::ResidualMargins& residual, const OnlineModel& model) {
  std::string out;
  const auto& names = model.model.coordinates;
  const std::string first = names.front(), second = names.size() > 1 ? names[1] : "";
  for (const commission::FaultMaps& each : residual.maps) {
    const auto margins = std::find_if(
        residual.margins.begin(), residual.margins.end(),
        [&](const detector::FaultMargins& m) { return m.fault.name == each.fault && m.side == each.side; });
    if (margins == residual.margins.end() || margins->fault.whole) {
      continue;
    }
    const std::string speeds = margin_map(each.speeds, margins->fault, first, second);
    const std::string accelerations =
        margin_map(each.accelerations, margins->fault, "d" + first + "/dt", second.empty() ? "" : "d" + second + "/dt");
    if (!speeds.empty() || !accelerations.empty()) {
      out += "<div><h3>" + escape(core::capital(name_of(*margins))) + "</h3>" + speeds + accelerations + "</div>";
    }
  }
  return "<div class=\"pairs\">" + out + "</div>" +
         paragraph(
             "<span class=\"note\">Smallest certain size where the robot keeps its speed (left), and where it "
             "keeps accelerating at the drive's typical speeds (right), m/s and rad/s, over the range of the "
             "drive: drive there to check the robot.</span>");
}

std::string at_risk_section(const commission::MarginSurvey& survey) {
  const commission::RiskMargins& at_risk = *survey.at_risk;
  std::vector<Cell> header = {"Fault"};
  for (const char* guarantee : {"every noise", "at the stated risk"}) {
    for (const double within : kRiskWindows) {
      header.push_back(numeric(fmt::format("{}<small>within {:g} s</small>", guarantee, within)));
    }
  }
  std::vector<std::vector<Cell>> rows;
  for (const RiskSizes& sizes : risk_sizes(survey)) {
    std::vector<Cell> row = {escape(core::capital(sizes.fault))};
    for (const auto* words : {&sizes.worst_case, &sizes.at_risk}) {
      for (const std::string& size : *words) {
        row.push_back(numeric(escape(size)));
      }
    }
    rows.push_back(std::move(row));
  }
  std::string out = paragraph(escape(risk_meaning(at_risk))) + table(header, rows), charts;
  for (const detector::FaultMargins& margins : at_risk.margins) {
    const std::string drawing = margins.fault.whole ? "" : risk_curves(margins, survey);
    if (!drawing.empty()) {
      charts += "<div><h3>" + escape(core::capital(name_of(margins))) + "</h3>" + drawing + "</div>";
    }
  }
  return out + "<div class=\"pairs\">" + charts + "</div>" +
         paragraph(fmt::format(
             "<span class=\"note\">Smallest size that is certain to raise an alarm over the time since it set in, from "
             "half of the onsets. Sums over scales from 0.1 to 100 s raise at most {:.2g} false alarms an hour.</span>",
             3600.0 * at_risk.false_alarms));
}

}  // namespace

std::string margins_report(const commission::MarginSurvey& survey, const OnlineModel& model,
                           const ReportContext& context) {
  const TimeAxis axis(context.signals ? context.signals->t : std::vector<double>{});
  PageContent content;
  content.title = context.title.empty() ? "What is certainly seen: " + model.robot.name : context.title;
  content.status = "good";
  content.verdict = "Faults that this robot's detector is certain to see in this drive.";
  content.first = outlook(survey, model);
  content.warrant = model.warrant;
  content.sentences.push_back(certain_meaning(model.warrant));
  content.sentences.push_back(
      fmt::format("Every size below is about {} of driving.", with_unit(number(survey.seconds), "s")));
  if (!survey.without_kinematic.empty()) {
    content.sentences.push_back("There is no kinematic residual: " + survey.without_kinematic +
                                ". Slip across the heading cannot be promised while driving straight.");
  }
  content.software = context.software;
  const std::vector<std::string> sentences = margin_sentences(survey);
  if (!sentences.empty()) {
    content.sentences.push_back("For one: " + sentences.front());
  }
  if (survey.at_risk) {
    content.sections.push_back({"at-risk", "Both guarantees", at_risk_section(survey)});
  }
  for (const commission::ResidualMargins& residual : survey.residuals) {
    content.sections.push_back(
        {residual.name, core::capital(residual.name) + " residual", margins_table(survey, residual)});
    content.sections.push_back(
        {residual.name + "-delay", "How soon: " + residual.name + " residual", curves(survey, residual)});
    if (!residual.maps.empty()) {
      content.sections.push_back({residual.name + "-map", "Where it shows best", maps(residual, model)});
    }
  }
  content.sections.push_back({"words", "In words", bullets(sentences)});
  if (context.signals) {
    content.sections.push_back({"signals", "Raw signals", signal_charts(*context.signals, {}, axis, context.rows)});
  }
  if (std::string given = assumptions_section(survey.assumptions); !given.empty()) {
    content.sections.push_back({"assumptions", "Assumptions", std::move(given)});
  }
  content.sections.push_back({"data", "Data", provenance(context, axis)});
  return page(content);
}

}  // namespace wheelwright::report
