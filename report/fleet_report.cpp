// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/fleet_report.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/report/fleet_drawings.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/text.hpp>
#include <wheelwright/report/time_axis.hpp>
#include <wheelwright/report/warrant_section.hpp>

namespace wheelwright {

using namespace report;

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
    const ParameterPopulation& p = fleet.population.parameters[j];
    const FleetColumn& column = fleet.table.columns[p.column];
    const auto cell = [&](double x) { return numeric(p.described ? number(x) : std::string("–")); };
    const auto range = outward(p.central.lower, p.central.upper);
    rows.push_back({escape(capital(words(column.name))) + "<small>" + escape(column.unit) + "</small>",
                    numeric(count(p.shown)), cell(p.fit.centre), cell(p.fit.spread), cell(p.typical_error),
                    numeric(p.described ? "[" + range.first + ", " + range.second + "]" : "–")});
    const std::string strip = fleet_strip(fleet, j);
    if (!strip.empty()) {
      strips += "<h3>" + escape(capital(words(column.name))) + "</h3>" + strip;
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
             [&](const RobotOutside& o) -> std::vector<Cell> {
               const FleetColumn& column = fleet.table.columns[o.column];
               return {robot_name(fleet, o.robot),
                       escape(words(column.name)),
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
  std::vector<ParameterDrift> drifting;
  std::copy_if(fleet.drift.begin(), fleet.drift.end(), std::back_inserter(drifting),
               [&](const ParameterDrift& d) { return d.drifts(fleet.drift_level); });
  std::string out = limited({"Robot", "Parameter", numeric("Certain change"), numeric("Trend"),
                             numeric("95 % interval"), numeric("p, adjusted")},
                            drifting, [&](const ParameterDrift& d) -> std::vector<Cell> {
                              const FleetColumn& column = fleet.table.columns[d.column];
                              const std::string per = column.unit + (d.dated ? "/week" : " a log");
                              return {robot_name(fleet, d.robot),
                                      escape(words(column.name)),
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
          repeats_known(fleet.drift)
              ? "; how much logs differ beyond their standard errors was learnt from the whole fleet."
              : "; with two logs a robot, a change that most robots share cannot be told from what differs between "
                "logs (floor, payload, temperature)."));
  for (std::size_t j = 0; j < fleet.table.columns.size(); ++j) {
    const bool any = std::any_of(drifting.begin(), drifting.end(), [&](const auto& d) { return d.column == j; });
    const std::string strip = any ? slope_strip(fleet, j) : std::string();
    if (!strip.empty()) {
      out += "<h3>" + escape(capital(words(fleet.table.columns[j].name))) + "</h3>" + strip;
    }
  }
  return out;
}

std::string alarm_section(const FleetResult& fleet) {
  return limited({"Robot", "Log", numeric("Alarms"), numeric("First"), numeric("Instants outside")}, fleet.alarms,
                 [&](const FleetAlarm& a) -> std::vector<Cell> {
                   return {robot_name(fleet, a.robot), escape(a.log), numeric(count(a.events)),
                           numeric(escape(with_unit(number(a.first), "s"))), numeric(escape(percent(a.outside_share)))};
                 });
}

std::string failed_section(const FleetResult& fleet) {
  return limited({"Robot", "Log", "Why"}, fleet.failed, [&](const FleetFinding& f) -> std::vector<Cell> {
    return {robot_name(fleet, f.robot), escape(f.log), escape(f.text)};
  });
}

std::string threshold_section(const FleetResult& fleet) {
  std::vector<std::vector<Cell>> rows;
  const auto take = [&](const FleetSpread& s, const auto& text) {
    if (!s.values.empty()) {
      rows.push_back({escape(capital(words(s.name))), numeric(count(s.values.size())), numeric(text(s.quantile(0.0))),
                      numeric(text(s.quantile(0.5))), numeric(text(s.quantile(0.95))), numeric(text(s.largest)),
                      robot_name(fleet, s.largest_robot)});
    }
  };
  for (const FleetSpread& s : fleet.widths) {
    take(s, [&](double x) { return escape(with_unit(number(x), s.unit)); });
  }
  take(fleet.smallest, [](double x) { return escape(percent(x)); });
  return table({"Threshold width of", numeric("Robots"), numeric("Smallest"), numeric("Median"), numeric("95 %"),
                numeric("Largest"), "Of"},
               rows);
}

std::string prior_section(const FleetResult& fleet) {
  const PooledPrior& prior = fleet.prior;
  std::string out = paragraph(escape(capital(prior.message)) + ".");
  if (!prior.exists) {
    return out;
  }
  std::vector<std::vector<Cell>> rows;
  for (const PooledParameter& p : prior.parameters) {
    const FleetColumn& column = fleet.table.columns[p.column];
    const auto before = outward(p.before.lower, p.before.upper), box = outward(p.box.lower, p.box.upper);
    rows.push_back({escape(capital(words(column.name))) + "<small>" + escape(column.unit) + "</small>",
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
  const std::vector<std::string> said = sentences(fleet);
  PageContent content;
  content.title = context.title.empty() ? "Fleet of " + plural(fleet.table.robots.size(), "robot") : context.title;
  const bool nobody = fleet.count(RobotStatus::commissioned) + fleet.count(RobotStatus::partial) == 0;
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

}  // namespace wheelwright
