// SPDX-License-Identifier: Apache-2.0
#include "results/report/fleet_report.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "detector/faults/fault_rows.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using study::FleetResult;

using namespace words;
namespace {

constexpr double kFleetWidth = 860.0, kHeight = 240.0, kFleetLeft = 74.0, kFleetRight = 10.0, kFleetTop = 10.0,
                 kFleetBottom = 30.0;
constexpr std::size_t kColumns = 400;

std::string frame(const Axis& axis, const std::string& label, const std::string& unit, const std::string& below) {
  std::string out =
      fmt::format("<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"{2}\">",
                  kFleetWidth, kHeight, escape(label));
  for (int k = 0; k <= 4; ++k) {
    const double x = axis.low + 0.25 * k * (axis.high - axis.low);
    out += fmt::format(
        "<line class=\"axis\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/><text x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{}</text>",
        kFleetLeft, kFleetWidth - kFleetRight, axis.inside(x), axis.inside(x), kFleetLeft - 5.0, axis.inside(x) + 4.0,
        escape(number(x)));
  }
  return out + fmt::format(
                   "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text><text x=\"12\" y=\"{:.0f}\" "
                   "transform=\"rotate(-90 12 {:.0f})\" text-anchor=\"middle\">{}</text>",
                   0.5 * (kFleetLeft + kFleetWidth), kHeight - 8.0, escape(below), 0.5 * kHeight, 0.5 * kHeight,
                   escape(unit));
}

// Robots of one column of the drawing.
struct Bin {
  Range bounds, estimates;
};

}  // namespace

std::string fleet_strip(const FleetResult& fleet, std::size_t parameter) {
  const study::ParameterPopulation& population = fleet.population.parameters.at(parameter);
  const study::FleetColumn& column = fleet.table.columns[population.column];
  std::vector<const study::FleetEntry*> shown;
  for (const study::FleetEntry& e : column.entries) {
    if (std::isfinite(e.estimate)) {
      shown.push_back(&e);
    }
  }
  if (shown.empty()) {
    return {};
  }
  std::stable_sort(shown.begin(), shown.end(), [](const auto* a, const auto* b) { return a->estimate < b->estimate; });
  std::set<std::size_t> outside;
  for (const study::RobotOutside& o : fleet.population.outside) {
    if (o.column == population.column) {
      outside.insert(o.robot);
    }
  }
  Axis axis{kHeight - kFleetBottom, kFleetTop};
  std::vector<double> lower, upper;
  for (const study::FleetEntry* e : shown) {
    axis.take(e->estimate);
    lower.push_back(e->lower);
    upper.push_back(e->upper);
  }
  // Most robots' bounds; those of a robot whose log shows next to nothing would flatten the rest.
  const std::size_t tenth = shown.size() / 10;
  std::sort(lower.begin(), lower.end());
  std::sort(upper.begin(), upper.end());
  axis.take(lower[tenth]);
  axis.take(upper[shown.size() - 1 - tenth]);
  axis.pad(0.08);
  std::string out = frame(axis, "bounds of " + spaced(column.name) + " of all robots", column.unit,
                          fmt::format("{}, sorted by estimate", plural(shown.size(), "robot")));
  if (population.described) {
    const double two = 2.0 * population.fit.spread;
    const double y0 = axis.inside(population.fit.centre + two), y1 = axis.inside(population.fit.centre - two);
    out += fmt::format(
        "<rect x=\"{}\" width=\"{}\" y=\"{:.1f}\" height=\"{:.1f}\" style=\"fill:var(--pale)\"/><line x1=\"{}\" "
        "x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" style=\"stroke:var(--second);stroke-dasharray:6 4\"/>",
        kFleetLeft, kFleetWidth - kFleetLeft - kFleetRight, y0, std::max(y1 - y0, 0.5), kFleetLeft,
        kFleetWidth - kFleetRight, axis.inside(population.fit.centre), axis.inside(population.fit.centre));
  }
  const std::size_t bins = std::min(shown.size(), kColumns);
  const double step = (kFleetWidth - kFleetLeft - kFleetRight) / static_cast<double>(bins);
  std::string bars, dots, marks;
  std::vector<Bin> content(bins);
  const auto x_of = [&](std::size_t bin) { return kFleetLeft + (static_cast<double>(bin) + 0.5) * step; };
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::size_t at = i * bins / shown.size();
    Bin& bin = content[at];
    bin.bounds.take(shown[i]->lower);
    bin.bounds.take(shown[i]->upper);
    bin.estimates.take(shown[i]->estimate);
    if (outside.contains(shown[i]->robot)) {
      marks += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" style=\"fill:none;stroke:var(--bad);stroke-width:2\">"
          "<title>{}</title></circle>",
          x_of(at), axis.inside(shown[i]->estimate), escape(fleet.table.robots[shown[i]->robot]));
    }
  }
  for (std::size_t b = 0; b < bins; ++b) {
    bars += fmt::format("M{:.1f} {:.1f}V{:.1f}", x_of(b), axis.inside(content[b].bounds.low),
                        axis.inside(content[b].bounds.high));
    const double y = axis.inside(content[b].estimates.low), to = axis.inside(content[b].estimates.high);
    dots += fmt::format("M{:.1f} {:.1f}V{:.1f}", x_of(b), y + 1.0, to - 1.0);
  }
  const double thick = std::clamp(0.7 * step, 0.8, 6.0);
  return out +
         fmt::format(
             "<path d=\"{}\" style=\"stroke:var(--first);stroke-opacity:.45;stroke-width:{:.1f}\"/><path d=\"{}\" "
             "style=\"stroke:var(--ink);stroke-width:{:.1f}\"/>{}</svg>",
             bars, thick, dots, thick, marks);
}

std::string slope_strip(const FleetResult& fleet, std::size_t column, std::size_t most) {
  std::vector<const study::ParameterDrift*> shown;
  for (const study::ParameterDrift& d : fleet.drift) {
    if (d.column == column && d.has_trend && shown.size() < most) {
      shown.push_back(&d);
    }
  }
  if (shown.empty()) {
    return {};
  }
  Axis axis{kHeight - kFleetBottom, kFleetTop};
  axis.take(0.0);
  for (const study::ParameterDrift* d : shown) {
    axis.take(d->slope - 2.0 * d->slope_error);
    axis.take(d->slope + 2.0 * d->slope_error);
  }
  axis.pad(0.05);
  const study::FleetColumn& of = fleet.table.columns[column];
  std::string out =
      frame(axis, "slopes of " + spaced(of.name), of.unit + (shown.front()->dated ? " per week" : " per log"),
            fmt::format("{}, worst first", plural(shown.size(), "robot")));
  const double step = (kFleetWidth - kFleetLeft - kFleetRight) / static_cast<double>(shown.size());
  out += fmt::format("<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" style=\"stroke:var(--ink)\"/>", kFleetLeft,
                     kFleetWidth - kFleetRight, axis.inside(0.0), axis.inside(0.0));
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const study::ParameterDrift& d = *shown[k];
    const double x = kFleetLeft + (static_cast<double>(k) + 0.5) * step;
    out += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" style=\"stroke:var(--first);stroke-width:{3:.1f}\"/><circle "
        "cx=\"{0:.1f}\" "
        "cy=\"{4:.1f}\" r=\"3\" style=\"fill:var({5})\"><title>{6}</title></circle>",
        x, axis.inside(d.lower), axis.inside(d.upper), std::clamp(0.4 * step, 1.0, 5.0), axis.inside(d.slope),
        d.drifts(fleet.drift_level) ? "--bad" : "--ink", escape(fleet.table.robots[d.robot]));
  }
  return out + "</svg>";
}

namespace {

constexpr std::size_t kMostRows = 500;

// A table of the first kMostRows items for which `row` gives cells; "none" where there is none.
template <typename Items, typename Row>
std::string limited(const std::vector<Cell>& header, const Items& items, const Row& row) {
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < std::min(items.size(), kMostRows); ++k) {
    rows.push_back(row(items[k]));
  }
  if (rows.empty()) {
    return paragraph("None.");
  }
  return table(header, rows) +
         (items.size() > kMostRows
              ? note(fmt::format("The first {} of {}: fleet.json has all.", kMostRows, count(items.size())))
              : std::string());
}

std::string robot_name(const FleetResult& fleet, std::size_t robot) { return escape(fleet.table.robots[robot]); }

std::string population_section(const FleetResult& fleet) {
  std::vector<std::vector<Cell>> rows;
  std::string strips;
  for (std::size_t j = 0; j < fleet.population.parameters.size(); ++j) {
    const study::ParameterPopulation& p = fleet.population.parameters[j];
    const study::FleetColumn& column = fleet.table.columns[p.column];
    const auto cell = [&](double x) { return numeric(p.described ? number(x) : std::string("–")); };
    const auto range = outward(p.central.lower, p.central.upper);
    rows.push_back({escape(core::capital(spaced(column.name))) + "<small>" + escape(column.unit) + "</small>",
                    numeric(count(p.shown)), cell(p.fit.centre), cell(p.fit.spread), cell(p.typical_error),
                    numeric(p.described ? "[" + range.first + ", " + range.second + "]" : "–")});
    const std::string strip = fleet_strip(fleet, j);
    if (!strip.empty()) {
      strips += "<h3>" + escape(core::capital(spaced(column.name))) + "</h3>" + strip;
    }
  }
  if (rows.empty()) {
    return paragraph("No robot shows a parameter.");
  }
  return table({"Parameter", numeric("Robots"), numeric("Centre"), numeric("Spread between robots"),
                numeric("Typical own error"), numeric("Middle 90 % certainly in")},
               rows) +
         note(fmt::format(
             "Centre and spread are those of a random-effects model: what robots differ by beyond their own "
             "uncertainty, "
             "fitted so that strange robots do not move it. A robot is outside where that is unlikely among equals: at "
             "most {:g} % of fleets of equals have any such robot, over all {} comparisons (Holm). The last column "
             "needs "
             "no model: if noise keeps to its bounds, nine tenths of the robots’ true values lie there.",
             100.0 * fleet.drift_level, count(fleet.population.tests))) +
         strips +
         note(
             "Bars: bounds; dark: estimates; band: centre ± 2 spreads; rings: robots outside. Where robots "
             "are "
             "many, a bar is the envelope of neighbours.");
}

std::string outside_section(const FleetResult& fleet) {
  return limited(
             {"Robot", "Parameter", numeric("Estimate"), numeric("Deviations"), numeric("p, adjusted"), "For certain"},
             fleet.population.outside,
             [&](const study::RobotOutside& o) -> std::vector<Cell> {
               const study::FleetColumn& column = fleet.table.columns[o.column];
               return {robot_name(fleet, o.robot),
                       escape(spaced(column.name)),
                       numeric(escape(with_unit(number(o.value, 4), column.unit))),
                       numeric(number(o.deviations)),
                       numeric(number(o.adjusted_p, 2)),
                       o.certain ? "yes: beyond " + escape(percent(o.certainly_beyond)) + " of the others " +
                                       warrant_badge(column.warrant)
                                 : std::string("no: bounds meet")};
             }) +
         note(
             "For certain: the robot’s bounds lie entirely beyond those of at least 95 % of the robots that "
             "are "
             "not outside.");
}

std::string drift_section(const FleetResult& fleet) {
  std::vector<study::ParameterDrift> drifting;
  std::copy_if(fleet.drift.begin(), fleet.drift.end(), std::back_inserter(drifting),
               [&](const study::ParameterDrift& d) { return d.drifts(fleet.drift_level); });
  std::string out = limited({"Robot", "Parameter", numeric("Certain change"), numeric("Trend"),
                             numeric("95 % interval"), numeric("p, adjusted")},
                            drifting, [&](const study::ParameterDrift& d) -> std::vector<Cell> {
                              const study::FleetColumn& column = fleet.table.columns[d.column];
                              const std::string per = column.unit + (d.dated ? "/week" : " a log");
                              return {robot_name(fleet, d.robot),
                                      escape(spaced(column.name)),
                                      numeric(d.certain == 0.0 ? std::string("–")
                                                               : escape((d.certain > 0.0 ? "at least +" : "at most ") +
                                                                        with_unit(number(d.certain, 3), column.unit)) +
                                                                     " " + warrant_badge(column.warrant)),
                                      numeric(d.has_trend ? escape(with_unit(number(d.slope), per)) : "–"),
                                      numeric(d.has_trend ? "[" + number(d.lower) + ", " + number(d.upper) + "]" : "–"),
                                      numeric(d.has_trend ? number(d.adjusted_p, 2) : "–")};
                            });
  out += note(
      "A change is certain where the bounds of two logs do not meet: it assumes nothing but the noise bounds. "
      "A trend is a line through the logs’ estimates" +
      std::string(
          study::repeats_known(fleet.drift)
              ? "; how much logs differ beyond their standard errors was learnt from the whole fleet."
              : "; with two logs a robot, a change that most robots share cannot be told from what differs between "
                "logs (floor, payload, temperature)."));
  for (std::size_t j = 0; j < fleet.table.columns.size(); ++j) {
    const bool any = std::any_of(drifting.begin(), drifting.end(), [&](const auto& d) { return d.column == j; });
    const std::string strip = any ? slope_strip(fleet, j) : std::string();
    if (!strip.empty()) {
      out += "<h3>" + escape(core::capital(spaced(fleet.table.columns[j].name))) + "</h3>" + strip;
    }
  }
  return out;
}

std::string alarm_section(const FleetResult& fleet) {
  return limited({"Robot", "Log", numeric("Alarms"), numeric("First"), numeric("Instants outside")}, fleet.alarms,
                 [&](const study::FleetAlarm& a) -> std::vector<Cell> {
                   return {robot_name(fleet, a.robot), escape(a.log), numeric(count(a.events)),
                           numeric(escape(with_unit(number(a.first), "s"))), numeric(escape(percent(a.outside_share)))};
                 });
}

std::string failed_section(const FleetResult& fleet) {
  return limited({"Robot", "Log", "Why"}, fleet.failed, [&](const study::FleetFinding& f) -> std::vector<Cell> {
    return {robot_name(fleet, f.robot), escape(f.log), escape(f.text)};
  });
}

std::string threshold_section(const FleetResult& fleet) {
  std::vector<std::vector<Cell>> rows;
  const auto take = [&](const study::FleetSpread& s, const auto& text) {
    if (!s.values.empty()) {
      rows.push_back({escape(core::capital(spaced(s.name))), numeric(count(s.values.size())),
                      numeric(text(s.quantile(0.0))), numeric(text(s.quantile(0.5))), numeric(text(s.quantile(0.95))),
                      numeric(text(s.largest)), robot_name(fleet, s.largest_robot)});
    }
  };
  for (const study::FleetSpread& s : fleet.widths) {
    take(s, [&](double x) { return escape(with_unit(number(x), s.unit)); });
  }
  take(fleet.smallest, [](double x) { return escape(percent(x)); });
  return table({"Threshold width of", numeric("Robots"), numeric("Smallest"), numeric("Median"), numeric("95 %"),
                numeric("Largest"), "Of"},
               rows);
}

std::string prior_section(const FleetResult& fleet) {
  const study::PooledPrior& prior = fleet.prior;
  std::string out = paragraph(escape(core::capital(prior.message)) + ".");
  if (!prior.exists) {
    return out;
  }
  std::vector<std::vector<Cell>> rows;
  for (const study::PooledParameter& p : prior.parameters) {
    const study::FleetColumn& column = fleet.table.columns[p.column];
    const auto before = outward(p.before.lower, p.before.upper), box = outward(p.box.lower, p.box.upper);
    rows.push_back({escape(core::capital(spaced(column.name))) + "<small>" + escape(column.unit) + "</small>",
                    numeric("[" + before.first + ", " + before.second + "]"),
                    numeric(p.included ? "[" + box.first + ", " + box.second + "]" : "–"), escape(p.reason)});
  }
  return out + table({"Parameter", numeric("Prior until now"), numeric("Pooled prior"), "Left out"}, rows) +
         note(
             "pooled_prior.yaml holds it as a robot file takes it. The coverage is for the whole box at once and needs "
             "no "
             "distribution: centres and scales come from one half of the robots, and the size of the box from the "
             "bounds of the other half, none left out.");
}

}  // namespace

std::string fleet_report(const FleetResult& fleet, const ReportContext& context) {
  const std::vector<std::string> said = study::sentences(fleet);
  PageContent content;
  content.title = context.title.empty() ? "Fleet of " + plural(fleet.table.robots.size(), "robot") : context.title;
  const bool nobody = fleet.count(study::RobotStatus::commissioned) + fleet.count(study::RobotStatus::partial) == 0;
  content.status = fleet.well() ? "good" : nobody ? "bad" : "caution";
  content.verdict = said.front();
  content.sentences.assign(said.begin() + 1, said.end());
  content.software = context.software;
  content.sections = {{"population", "Population", population_section(fleet)},
                      {"outside", "Robots outside", outside_section(fleet)}};
  if (!fleet.drift.empty()) {
    content.sections.push_back({"drift", "Drift", drift_section(fleet)});
  }
  if (fleet.checked > 0) {
    content.sections.push_back({"alarms", "Alarms in later logs", alarm_section(fleet)});
  }
  content.sections.push_back({"failed", "Failed, and why", failed_section(fleet)});
  if (!fleet.widths.empty()) {
    content.sections.push_back({"thresholds", "Thresholds", threshold_section(fleet)});
  }
  content.sections.push_back({"prior", "Pooled prior", prior_section(fleet)});
  const TimeAxis axis;
  content.sections.push_back({"data", "Data", provenance(context, axis)});
  return page(content);
}

}  // namespace wheelwright::report
