// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/detect_report.hpp>

#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/report/data_sections.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/parameter_table.hpp>
#include <wheelwright/report/signals.hpp>
#include <wheelwright/words/detect_words.hpp>
#include <wheelwright/words/text.hpp>

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
  return paragraph(
             fmt::format("What pose or gyro saw over the last {} against what the wheels rolled: {} instants over "
                         "{} of driving. Without a fault the residual stays inside the grey band.",
                         with_unit(number(model.kinematic->window), "s"), count(d.instants),
                         with_unit(number(d.seconds, 4), "s"))) +
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
             "explain them with no size, no onset, no parameters of the feasible set and no admissible noise; the true "
             "size and onset of a fault of the catalogue lie in the intervals.") +
         table({"", "Still possible", "other faults"}, rows);
}

// Sums over scales: how near they came to what a healthy robot's can be, and where they went beyond.
std::string at_risk_section(const commission::RiskWatch& watch, const OnlineModel& model, const TimeAxis& axis) {
  constexpr double kYear = 365.25 * 86400.0;
  std::string out = paragraph(fmt::format(
      "Weighted sums over {} to {} s of what the model leaves, matched to faults, were compared {} times with what the "
      "errors of a healthy robot can make of them; in {} years of driving at most one false alarm is to be expected, "
      "as long as the errors are as {}. The largest reached {} of its threshold.",
      number(model.at_risk->scales.front()), number(model.at_risk->scales.back()), count(watch.looks),
      number(1.0 / (watch.false_alarms * kYear), 2),
      model.at_risk->warrant == core::Warrant::guaranteed ? "the robot file declares them"
                                                          : "they were in the log that the model was learnt from",
      percent(watch.utilisation)));
  std::vector<std::vector<Cell>> rows;
  for (const commission::RiskEvent& e : watch.events) {
    rows.push_back({escape(axis.text(e.alarm)), escape(axis.text(e.end)),
                    escape(commission::sum_words(e.weight, model.model)), numeric(number(e.scale)),
                    numeric(number(e.ratio, 3))});
  }
  return rows.empty()
             ? out
             : out + table({"alarm", "until", "matched to", numeric("over, s"), numeric("times the threshold")}, rows);
}

}  // namespace

std::string detect_report(const Detection& detection, const OnlineModel& model, const ReportContext& context,
                          const KinematicFindings& kinematic, const std::vector<detector::Isolation>& isolations,
                          const commission::RiskWatch& at_risk) {
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
  content.status = fault ? "bad" : detection.instants == 0 ? "caution" : "good";
  content.verdict = detect_verdict(detection, kinematic_events + at_risk.events.size());
  content.sentences = detect_words(detection, model, isolations, axis);
  if (!at_risk.events.empty()) {
    content.sentences.insert(content.sentences.begin(),
                             core::capital(commission::sentence(at_risk.events.front(), model.model)) + ".");
  }
  if (kinematic_events > 0) {
    const detector::Event& first = kinematic.detection->events.front();
    content.sentences.push_back(fmt::format(
        "{} of these in the kinematic residual, the first alarm at {}: pose or gyro did not move as the wheels rolled.",
        core::capital(plural(kinematic_events, "event")), axis.text(first.alarm)));
  }
  content.software = context.software;
  content.warrant = model.warrant;
  content.sections.push_back({"events", "Events", event_table(detection, model, axis)});
  if (at_risk.watched) {
    content.sections.push_back({"at_risk", "At a stated risk", at_risk_section(at_risk, model, axis)});
  }
  if (!isolations.empty()) {
    content.sections.push_back({"isolation", "What it can be", isolation_section(isolations, detection, axis)});
  }
  if (!detection.trace.t.empty()) {
    content.sections.push_back(
        {"residual", "Residual and threshold",
         paragraph(
             "Without a fault ε = τ_f − Y_f θ̂ stays inside the grey band [l, u]. Events are shaded and "
             "numbered. Drag to zoom (all charts follow), Shift and drag to pan, double click for the whole log.") +
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

}  // namespace wheelwright::report
