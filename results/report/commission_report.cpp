// SPDX-License-Identifier: Apache-2.0
#include "results/report/commission_report.hpp"

#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "results/report/drawing.hpp"
#include "results/report/outlook.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/report/signals.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;

namespace {

TimeAxis axis_for(const CommissionContext& context) {
  if (context.signals && context.signals->rows() > 0) {
    return TimeAxis(context.signals->t);
  }
  return context.own_log ? TimeAxis(context.own_log->trace.t) : TimeAxis();
}

const char* status_class(Standing standing) {
  switch (standing) {
    case Standing::good: return "good";
    case Standing::caution: return "caution";
    case Standing::bad: return "bad";
  }
  return "bad";
}

// Moments that decide: rows of a contradiction as lines, samples that set a bound as pins. Of one output, or of all.
std::vector<ChartMark> deciding_marks(const Commissioning& result, std::optional<std::size_t> output = {}) {
  std::vector<ChartMark> marks;
  const auto add = [&](const bounds::RowOrigin& o, const std::string& label, bool pin) {
    if (!o.is_prior && o.output == output.value_or(o.output)) {
      marks.push_back({o.t, o.t, label, pin});
    }
  };
  for (const bounds::WeightedRow& w : result.feasible.contradiction) {
    add(w.row.origin, output_name(result.model.model, w.row.origin.output), false);
  }
  if (result.feasible.contradiction.empty()) {
    const std::vector<ParameterViews> views = parameter_views(result);
    for (std::size_t j = 0; j < views.size(); ++j) {
      for (const bounds::RowOrigin& o : result.parameters[j].lower_binding) {
        add(o, spaced(views[j].best().name) + " ≥", true);
      }
      for (const bounds::RowOrigin& o : result.parameters[j].upper_binding) {
        add(o, spaced(views[j].best().name) + " ≤", true);
      }
    }
  }
  return marks;
}

std::string residual_section(const Commissioning& result, const Detection& own, const TimeAxis& axis) {
  const OnlineModel& m = result.model;
  std::vector<std::vector<ChartMark>> marks;
  for (std::size_t i = 0; i < own.trace.outputs.size(); ++i) {
    marks.push_back(deciding_marks(result, i));
  }
  return paragraph(
             "ε = τ_f − Y_f θ̂ must stay inside the grey band [l, u] while there is no fault: the band holds for every "
             "parameter of the feasible set and every admissible noise. Triangles at the time axis: the samples that "
             "set a parameter’s lower (≥) or upper (≤) bound. Drag to zoom (all charts follow), Shift and drag to pan, "
             "double click for the whole log; arrow keys, + and − do the same where a chart has the focus.") +
         residual_charts(own.trace, m.robot, m.model, marks, axis, "trace") +
         torque_charts(own.trace, m.robot, m.model, axis, "trace") +
         thinning_note(own.instants, own.trace.t.size(), "instants");
}

std::string kinematic_section(const commission::KinematicCommissioning& k) {
  std::string out = k.message.empty() ? std::string() : paragraph(escape(core::capital(k.message)) + ".");
  if (!k.model) {
    return out;
  }
  out += warrant_note(k.model->warrant);
  std::vector<std::vector<Cell>> rows;
  for (const commission::KinematicParameter& p : k.parameters) {
    const std::string unit = unit_of(p.unit);
    rows.push_back({escape(p.name), numeric(p.estimate ? number(*p.estimate, 5) : "–"), numeric(number(p.lower, 5)),
                    numeric(number(p.upper, 5)), numeric(number(p.nominal, 5)), escape(unit)});
  }
  out +=
      table({"Parameter", numeric("estimate"), numeric("lower"), numeric("upper"), numeric("nominal"), "unit"}, rows);
  const auto names = k.model->measurement.outputs(), units = k.model->measurement.output_units();
  rows.clear();
  for (std::size_t i = 0; i < k.noise.size(); ++i) {
    const commission::OutputValidation v = i < k.validation.size() ? k.validation[i] : commission::OutputValidation{};
    rows.push_back({escape(names[i]), escape(units[i]),
                    k.noise[i].origin == core::NoiseOrigin::declared ? "declared" : "estimated",
                    numeric(number(k.noise[i].bound)), numeric(count(v.instants)), numeric(count(v.outside)),
                    numeric(number(v.residual_rms)), numeric(number(v.median_width))});
  }
  return out + table({"Output", "unit", "noise", numeric("bound"), numeric("held-out<br>instants"),
                      numeric("false<br>alarms"), numeric("residual<br>rms"), numeric("median width<br>of [l, u]")},
                     rows);
}

}  // namespace

std::string commission_report(const Commissioning& result, const CommissionContext& context) {
  const TimeAxis axis = axis_for(context);
  PageContent content;
  content.title = context.title.empty() ? "Commissioning of " + result.model.robot.name : context.title;
  content.status = status_class(standing(result));
  content.verdict = verdict(result);
  content.sentences = commission_words(result);
  content.first = context.seen ? outlook(*context.seen, result.model) : std::string();
  content.software = context.software;
  if (result.status != Commissioning::Status::empty && result.little.why.empty()) {
    content.warrant = result.model.warrant;
  }
  content.sections = context.lead;
  const auto add = [&](const char* id, const char* heading, std::string body) {
    if (!body.empty()) {
      content.sections.push_back({id, heading, std::move(body)});
    }
  };
  add("contradiction", "Contradiction", contradiction_section(result, axis));
  add("assumptions", "Assumptions", assumptions_section(result.assumptions));
  add("parameters", "Parameters", parameter_table(result, axis));
  add("set", "Feasible set", set_projections(result));
  add("estimators", "Estimators", estimator_table(result));
  if (context.own_log && !context.own_log->trace.t.empty()) {
    add("residual", "Residual and threshold", residual_section(result, *context.own_log, axis));
  }
  add("kinematic", "Wheel odometry against pose or gyro", kinematic_section(result.kinematic));
  add("signals", "Raw signals", signals_section(context, deciding_marks(result), axis));
  if (result.status != Commissioning::Status::empty) {
    add("validation", "Validation on held-out driving", validation_section(result));
  }
  add("noise", "Noise", noise_section(result));
  add("filter", "Filter", filter_section(result));
  add("data", "Data", data_section(result, context, axis));
  return page(content);
}

}  // namespace wheelwright::report
