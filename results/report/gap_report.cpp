// SPDX-License-Identifier: Apache-2.0
#include "results/report/gap_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/statistics.hpp"
#include "gap/where.hpp"
#include "results/report/page.hpp"
#include "results/report/signals.hpp"
#include "results/words/gap_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;

namespace {

const char* status_of(gap::GapVerdict verdict) {
  switch (verdict) {
    case gap::GapVerdict::no_gap:
    case gap::GapVerdict::explained: return "good";
    case gap::GapVerdict::ambiguous: return "caution";
    case gap::GapVerdict::unexplained: return "bad";
  }
  return "bad";
}

std::string channel_title(const gap::ResidualSeries& s) {
  return s.space == gap::GapSpace::dynamic ? "Torque residual of the " + spaced(s.channel) + " channel"
                                           : "Pose against wheel odometry, " + spaced(s.channel);
}

const char* reference_words(gap::GapReference reference) {
  switch (reference) {
    case gap::GapReference::robot_file: return "the model with its nominal parameters";
    case gap::GapReference::healthy_log: return "the model of the healthy robot";
    case gap::GapReference::simulator: return "the model of the simulator";
  }
  return "";
}

std::string p_words(double p) { return p < 0.001 ? "< 0.001" : decimal(p, 3); }

std::string chance_words(const std::optional<double>& probability) {
  return probability ? percent(*probability, 2) : "–";
}

std::string parameter_lines(const std::vector<gap::GapEstimate>& parameters) {
  std::string lines;
  for (const gap::GapEstimate& p : parameters) {
    lines += (lines.empty() ? "" : "<br>") + escape(parameter_words(p.name)) + " " + escape(estimate_words(p));
  }
  return lines;
}

std::string visible_section(const Diagnosis& d) {
  if (d.visible.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  for (const gap::VisibleSize& v : d.visible) {
    rows.push_back({escape(core::capital(effect_noun(v.effect))), escape(parameter_words(v.parameter)),
                    numeric(escape(with_unit(number(v.size, 2), unit_of(v.unit))))});
  }
  return table({"Cause", "parameter", numeric("would have shown from")}, rows) +
         note(
             "The smallest size of each cause, alone, at which this log would not have passed for one without a gap, "
             "to "
             "some ten per cent. Causes that are not in this table could not have been seen on it.");
}

std::string causes_section(const Diagnosis& d) {
  if (d.causes.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  for (const gap::GapCause& cause : d.causes) {
    const bool laws = !cause.laws.empty();
    rows.push_back(
        {escape(core::capital(cause_noun(cause))) + "<small>" +
             escape(laws ? "By one of the laws below, between which this log does not tell." : cause.sentence) +
             "</small>",
         "<code>" + escape(laws ? cause.family : cause.effect) + "</code>", numeric(percent(cause.share)),
         numeric(chance_words(cause.probability)), laws ? std::string() : parameter_lines(cause.parameters)});
    for (const gap::GapLaw& law : cause.laws) {
      rows.push_back({escape("either " + effect_noun(law.effect)) + "<small>" + escape(law.sentence) + "</small>",
                      "<code>" + escape(law.effect) + "</code>", numeric(""), numeric(""),
                      parameter_lines(law.parameters)});
    }
  }
  return step_bars(d) +
         table({"Cause", "name", numeric("share of<br>the gap"), numeric("chance that<br>it is there"),
                "parameters [95 % interval]"},
               rows) +
         note(fmt::format("The gap is what {} leaves above the noise floor: {} of the "
                          "efforts' mean square, {} after fitting θ again; the causes leave {} of the gap. Floor: {}.",
                          reference_words(d.reference), percent(d.gap), percent(d.structural), percent(d.remaining),
                          escape(d.floor_origin.empty() ? "unknown" : d.floor_origin)));
}

std::string apart_section(const Diagnosis& d, const std::string& next_manoeuvre) {
  std::string out;
  if (!d.credible.empty()) {
    std::vector<std::vector<Cell>> rows;
    for (const gap::CredibleCauses& c : d.credible) {
      rows.push_back({escape(core::capital(effect_nouns(c.effects))), numeric(number(c.held_out_error)),
                      numeric(p_words(c.p_value)), numeric(chance_words(c.probability))});
    }
    out +=
        "<h3>Causes that this log leaves standing</h3>" +
        table({"Causes", numeric("held-out error<br>(noise: 1)"), numeric("p: as good<br>as the best"),
               numeric("chance that it<br>is these alone")},
              rows) +
        note(
            "A model confidence set at 90 %: each of these predicts stretches of the log that it was not fitted to as "
            "well as the best one, but for chance.");
  }
  if (!next_manoeuvre.empty()) {
    out += "<h3>What to drive next</h3>" + paragraph(escape(next_manoeuvre));
  }
  if (const std::string matrix = confusability_matrix(d.confusable); !matrix.empty()) {
    out +=
        "<h3>What looks alike on this log</h3>" + matrix +
        note(
            "How much of one cause's signature, in per cent, the other can make up once θ is fitted again, however the "
            "verdict came out. Framed: no log without further sensors separates them.");
    std::vector<std::vector<Cell>> rows;
    for (const gap::ConfusablePair& pair : d.confusable) {
      if (!pair.reason.empty() && pair.similarity >= 0.5) {
        rows.push_back({escape(core::capital(effect_noun(pair.first))) + " · " + escape(effect_noun(pair.second)),
                        numeric(percent(pair.similarity, 2)), escape(pair.reason)});
      }
    }
    if (!rows.empty()) {
      out += table({"Pair", numeric("alike"), "why, and what would split them"}, rows);
    }
  }
  if (!d.not_excited.empty()) {
    out += "<h3>What this log could not show</h3>" + bullets(d.not_excited);
  }
  return out;
}

// Rows before which a stretch of used rows was interrupted.
std::vector<std::size_t> breaks_of(const Eigen::VectorXd& t) {
  std::vector<double> steps;
  for (Eigen::Index k = 1; k < t.size(); ++k) {
    steps.push_back(t[k] - t[k - 1]);
  }
  std::vector<std::size_t> out = {0};
  if (steps.empty()) {
    return out;
  }
  const double usual = core::median(steps);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (steps[k] > 5.0 * usual || steps[k] < 0.0) {
      out.push_back(k + 1);
    }
  }
  return out;
}

std::string residual_chart(const Diagnosis& d, std::size_t index, const TimeAxis& axis) {
  const gap::ResidualSeries& s = d.series[index];
  LogTable table;
  table.t.assign(s.t.begin(), s.t.end());
  table.segment_starts = breaks_of(s.t);
  const auto add = [&](const char* name, const Eigen::VectorXd& values) {
    if (values.size() == s.t.size() && values.size() > 0) {
      table.names.emplace_back(name);
      table.columns.emplace_back(values.begin(), values.end());
    }
  };
  add("before", s.nominal);
  add("θ fitted again", s.refitted);
  if (!d.causes.empty()) {
    add("after", s.after);
  }
  if (table.names.empty()) {
    return {};
  }
  const LogTable thin = thinned(table, most_chart_points);
  const std::string id = fmt::format("gap-{}", index);
  Chart chart{.title = channel_title(s), .unit = unit_of(s.unit), .clock = id, .series = {}, .bands = {}, .marks = {}};
  const std::vector<double> above(thin.rows(), 2.0 * s.floor), below(thin.rows(), -2.0 * s.floor);
  if (s.floor > 0.0) {
    chart.series.push_back({"+2 × floor", above, Line::bound});
    chart.series.push_back({"−2 × floor", below, Line::bound});
    chart.bands.push_back({0, 1, true});
  }
  for (std::size_t c = 0; c < thin.names.size(); ++c) {
    const Line line = thin.names[c] == "before" ? Line::second : thin.names[c] == "after" ? Line::first : Line::third;
    chart.series.push_back({thin.names[c], thin.columns[c], line});
  }
  for (const gap::Contradiction& c : d.contradictions) {
    if (c.channel == s.channel && s.space == gap::GapSpace::dynamic) {
      chart.marks.push_back({c.t, c.t, "contradiction"});
    }
  }
  return clock(id, thin.t, thin.segment_starts, axis) + figure(chart, axis);
}

std::string residual_section(const Diagnosis& d, const TimeAxis& axis) {
  std::string out;
  for (std::size_t k = 0; k < d.series.size(); ++k) {
    out += residual_chart(d, k, axis);
  }
  return out.empty() ? out
                     : paragraph(
                           "Measured minus predicted, behind the same filter. Dashed: the model with its nominal "
                           "parameters; dotted: with θ fitted again; solid: with the causes added. The grey band is "
                           "twice the standard deviation of noise alone. Drag to zoom (all charts follow), Shift and "
                           "drag to pan, double click for the whole log.") +
                           out;
}

std::string shrink_section(const Diagnosis& d) {
  const std::pair<const char*, const std::vector<gap::ShrinkFigure>*> groups[] = {
      {"Filtered torque, root mean square", &d.shrink.torque_rms},
      {"Filtered torque on a fresh log, to which nothing was fitted", &d.shrink.fresh_torque_rms},
      {"Open-loop simulation, root mean square error", &d.shrink.rollout},
      {"Width of the detection threshold u − l, median", &d.shrink.threshold_width},
      {"Smallest certainly detected change of wheel radius", &d.shrink.smallest_fault}};
  std::string out;
  for (const auto& [heading, figures] : groups) {
    if (const std::string bars = shrink_bars(*figures); !bars.empty()) {
      out += fmt::format("<div><h3>{}</h3>{}</div>", heading, bars);
    }
  }
  return out.empty()
             ? out
             : "<div class=\"pairs\">" + out + "</div>" +
                   note(
                       "On held-out stretches of the log. Dashed outline: the nominal model; full: with the causes, "
                       "whiskers: 95 % interval; grey: what noise alone leaves. Bars of one figure share a scale.");
}

// Buttons for the shares whose regime is a stretch of time, "t = 20 to 25 s".
std::string time_links(const std::vector<gap::GapShare>& shares, const gap::ResidualSeries& series,
                       const TimeAxis& axis) {
  std::string out;
  for (const gap::GapShare& share : shares) {
    double from = 0.0, to = 0.0;
    if (share.kind == "time" && series.t.size() > 0 &&
        std::sscanf(share.regime.c_str(), "t = %lf to %lf s", &from, &to) == 2) {
      const double origin = share.regime.ends_with("from the start") ? series.t[0] : 0.0;
      out += (out.empty() ? "" : ", ") +
             time_button(origin + from, origin + to,
                         fmt::format("{} ({}\u00a0%)", share.regime, number(100.0 * share.share, 2)), axis);
    }
  }
  return out.empty() ? out : paragraph("Show in the charts: " + out + ".");
}

std::string where_section(const Diagnosis& d, const TimeAxis& axis) {
  std::string out;
  std::vector<gap::GapShare> channels;
  for (const gap::GapShare& s : d.where) {
    if (s.kind == "channel") {
      channels.push_back(s);
      channels.back().regime = (s.space == gap::GapSpace::dynamic ? "torque, " : "pose, ") + spaced(s.channel);
    }
  }
  if (channels.size() > 1) {
    out += "<h3>By channel</h3>" + share_bars(channels);
  }
  for (const gap::ResidualSeries& s : d.series) {
    std::vector<gap::GapShare> regimes, bands;
    for (const gap::GapShare& share : d.where) {
      if (share.channel == s.channel && share.space == s.space && share.kind != "channel") {
        (share.kind == "frequency" ? bands : regimes).push_back(share);
      }
    }
    // Findings first: what is large only because it is always there tells nothing.
    std::stable_partition(regimes.begin(), regimes.end(),
                          [](const gap::GapShare& share) { return gap::is_finding(share); });
    const std::string by_regime = share_bars(regimes, 14) + time_links(regimes, s, axis),
                      by_band = share_bars(bands) + spectrum_drawing(s, d.beta);
    if (!by_regime.empty() || !by_band.empty()) {
      out += fmt::format("<h3>{}</h3><div class=\"pairs\"><div>{}</div><div>{}</div></div>", escape(channel_title(s)),
                         by_regime, by_band);
    }
  }
  return out.empty()
             ? out
             : paragraph("Shares of the structural part: what is left above the noise floor after θ is fitted again.") +
                   out +
                   note(
                       "Bar: share of the structural part; upright tick: share of the time (of the noise, for "
                       "frequencies), "
                       "where the bar would end if nothing were special; full bars: concentrated there by more than "
                       "chance "
                       "(p < 0.05, corrected for all that was looked at and valid for residuals that remember). A "
                       "filter "
                       "delays what passes it by about 2/β: regimes are those of that much earlier.");
}

std::string place_section(const Diagnosis& d, const ReportContext& context) {
  std::string out;
  for (const gap::ResidualSeries& s : d.series) {
    if (context.signals) {
      const double delay = s.space == gap::GapSpace::dynamic && d.beta > 0.0 ? 2.0 / d.beta : 0.0;
      if (const std::string map = position_map(s, *context.signals, delay); !map.empty()) {
        out += fmt::format("<div><h3>{}</h3>{}</div>", escape(channel_title(s)), map);
      }
    }
  }
  return out.empty() ? out
                     : paragraph("Root mean square of what is left after θ is fitted again, where the robot was.") +
                           "<div class=\"pairs\">" + out + "</div>";
}

std::string parameters_section(const Diagnosis& d) {
  if (d.parametric.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  for (const gap::ParameterShift& p : d.parametric) {
    const auto [low, high] = outward(p.lower, p.upper);
    const bool found = std::isfinite(p.estimate);
    const double base = p.nominal.value_or(p.estimate);
    rows.push_back({escape(core::capital(spaced(p.parameter))), escape(unit_of(p.unit)),
                    numeric(p.nominal ? number(*p.nominal, 4) : "–"), numeric(number(p.without_causes, 4)),
                    numeric(std::isfinite(base / p.without_causes) && base != 0.0
                                ? fmt::format("{}{}\u00a0%", p.without_causes >= base ? "+" : "−",
                                              number(100.0 * std::abs(p.without_causes / base - 1.0), 2))
                                : "–"),
                    numeric(found ? beside(p.estimate, p.lower, p.upper) : "not told from 0"),
                    numeric("[" + low + ", " + high + "]")});
  }
  return table({"Parameter", "unit", numeric("as designed"), numeric("without<br>the causes"),
                numeric("off from the design<br>(or the estimate)"), numeric("with them"), numeric("95 % interval")},
               rows) +
         note(
             "Without the causes in the model, least squares blames the parameters: that is how far each was "
             "poisoned.");
}

std::string contradiction_section(const Diagnosis& d, const TimeAxis& axis) {
  if (d.contradictions.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  for (const gap::Contradiction& c : d.contradictions) {
    rows.push_back({time_button(c.t - 1.0, c.t + 1.0, axis.text(c.t), axis), escape(spaced(c.channel)),
                    numeric(percent(c.weight, 2))});
  }
  const bool one = d.contradictions.size() == 1;
  return paragraph(
             fmt::format("No parameters of the base model, within their prior, explain {} within the noise: a proof in "
                         "outward arithmetic (Farkas). {} marked in the charts.",
                         one ? "this row" : "these rows together", one ? "It is" : "They are")) +
         table({"Time", "channel", numeric("weight in<br>the proof")}, rows);
}

std::string data_section(const Diagnosis& d, const ReportContext& context, const TimeAxis& axis) {
  std::string out = provenance(context, axis);
  out += definitions({{"Noise floor", (d.floor_origin.empty() ? "unknown" : d.floor_origin) +
                                          fmt::format(", known to {}", percent(d.floor_error, 2))},
                      {"Filter", fmt::format("second order, β = {} 1/s", number(d.beta))}});
  out += bullets(d.notes);
  return out + (context.warnings.empty()
                    ? ""
                    : "<h3>Repairs and remarks of the log reader</h3>\n" + bullets(context.warnings));
}

std::string signals_section(const Diagnosis& d, const ReportContext& context, const TimeAxis& axis) {
  std::vector<ChartMark> marks;
  for (const gap::Contradiction& c : d.contradictions) {
    marks.push_back({c.t, c.t, "contradiction"});
  }
  return context.signals ? signal_charts(*context.signals, marks, axis, context.rows) : std::string();
}

TimeAxis axis_of(const Diagnosis& d, const ReportContext& context) {
  if (context.signals && context.signals->rows() > 0) {
    return TimeAxis(context.signals->t);
  }
  return d.series.empty() ? TimeAxis() : TimeAxis({d.series.front().t.begin(), d.series.front().t.end()});
}

}  // namespace

std::string gap_report(const Diagnosis& d, const std::string& robot, const ReportContext& context,
                       const std::string& next_manoeuvre) {
  const TimeAxis axis = axis_of(d, context);
  PageContent content;
  content.title = context.title.empty() ? "Sim-to-real gap of " + robot : context.title;
  content.status = status_of(d.verdict);
  content.verdict = gap_verdict(d);
  content.sentences = gap_sentences(d, next_manoeuvre);
  content.software = context.software;
  const auto add = [&](const char* id, const char* heading, std::string body) {
    if (!body.empty()) {
      content.sections.push_back({id, heading, std::move(body)});
    }
  };
  add("causes", "Causes", causes_section(d));
  add("visible", "What would have been seen", visible_section(d));
  add("residual", "Residual over time", residual_section(d, axis));
  add("shrink", "How far it shrinks", shrink_section(d));
  add("apart", "What cannot be told apart", apart_section(d, next_manoeuvre));
  add("where", "Where it lies", where_section(d, axis));
  add("place", "By place", place_section(d, context));
  add("parameters", "Parameters", parameters_section(d));
  add("contradiction", "Contradictions", contradiction_section(d, axis));
  add("signals", "Raw signals", signals_section(d, context, axis));
  add("data", "Data", data_section(d, context, axis));
  return page(content);
}

}  // namespace wheelwright::report
