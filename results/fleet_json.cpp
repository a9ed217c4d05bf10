// SPDX-License-Identifier: Apache-2.0
#include "results/fleet_json.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/words.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/model_json.hpp"

namespace wheelwright::results {

using files::JsonPlace;

namespace {

constexpr files::Words<study::RobotStatus, 5> status_words = {{{study::RobotStatus::commissioned, "commissioned"},
                                                               {study::RobotStatus::partial, "partial"},
                                                               {study::RobotStatus::contradicted, "contradicted"},
                                                               {study::RobotStatus::nothing, "nothing"},
                                                               {study::RobotStatus::unreadable, "unreadable"}}};

// A number of a record; what is computed of one beyond these sizes is none.
double sized(const JsonPlace& place) {
  constexpr double largest = 1e100;
  const double number = place.number();
  if (std::abs(number) > largest) {
    place.fail("a number of at most 1e100");
  }
  return number;
}

std::optional<double> maybe(const JsonPlace& object, std::string_view key) {
  return object.has(key) ? std::optional(sized(object.at(key))) : std::nullopt;
}

Json log_json(const study::LogRecord& log) {
  Json parameters = Json::array();
  for (const study::RecordedParameter& p : log.parameters) {
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"is_prior_key", p.is_prior_key},
                          {"estimate", files::or_null(p.estimate)},
                          {"standard_error", files::or_null(p.standard_error)},
                          {"freedom", files::or_null(p.freedom)},
                          {"lower", p.lower},
                          {"upper", p.upper},
                          {"lower_is_prior", p.lower_is_prior},
                          {"upper_is_prior", p.upper_is_prior},
                          {"prior", {p.prior.lower, p.prior.upper}},
                          {"warrant", core::warrant_word(p.warrant)}});
  }
  return {{"log", log.log},
          {"when", log.when},
          {"status", files::word_of(status_words, log.status)},
          {"message", log.message},
          {"seconds", log.seconds},
          {"rows", log.rows},
          {"parameters", std::move(parameters)}};
}

study::LogRecord log_from(const JsonPlace& at) {
  study::LogRecord log{.log = at.at("log").text(),
                       .when = sized(at.at("when")),
                       .status = files::value_of(status_words, at.at("status")),
                       .message = at.at("message").text(),
                       .seconds = sized(at.at("seconds")),
                       .rows = at.at("rows").count()};
  const JsonPlace parameters = at.at("parameters");
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const JsonPlace p = parameters.at(j);
    if (const auto error = maybe(p, "standard_error"); error && !(*error == 0.0 || *error >= 1e-100)) {
      p.at("standard_error").fail("0 or a number >= 1e-100");
    }
    if (p.has("freedom") && !(p.at("freedom").number() >= 0.1)) {
      p.at("freedom").fail("degrees of freedom");
    }
    log.parameters.push_back({.name = p.at("name").text(),
                              .unit = p.at("unit").text(),
                              .is_prior_key = p.at("is_prior_key").boolean(),
                              .estimate = maybe(p, "estimate"),
                              .standard_error = maybe(p, "standard_error"),
                              .freedom = maybe(p, "freedom"),
                              .lower = sized(p.at("lower")),
                              .upper = sized(p.at("upper")),
                              .lower_is_prior = p.at("lower_is_prior").boolean(),
                              .upper_is_prior = p.at("upper_is_prior").boolean(),
                              .prior = {sized(p.at("prior").at(std::size_t{0})), sized(p.at("prior").at(1))},
                              .warrant = robots::warrant_at(p, core::Warrant::extrapolated)});
  }
  return log;
}

Json population_json(const study::FleetResult& fleet) {
  Json list = Json::array();
  for (const study::ParameterPopulation& p : fleet.population.parameters) {
    const study::FleetColumn& column = fleet.table.columns[p.column];
    Json entry = {{"parameter", column.name},
                  {"unit", column.unit},
                  {"warrant", core::warrant_word(column.warrant)},
                  {"robots", p.shown},
                  {"described", p.described}};
    if (p.described) {
      entry["centre"] = p.fit.centre;
      entry["centre_standard_error"] = p.fit.centre_error;
      entry["spread"] = p.fit.spread;
      entry["typical_standard_error"] = p.typical_error;
      entry["central"] = {p.central.lower, p.central.upper};
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json outside_json(const study::FleetResult& fleet, const std::vector<study::RobotOutside>& robots) {
  Json list = Json::array();
  for (const study::RobotOutside& o : robots) {
    list.push_back({{"robot", fleet.table.robots[o.robot]},
                    {"parameter", fleet.table.columns[o.column].name},
                    {"estimate", o.value},
                    {"deviations", o.deviations},
                    {"p_value", o.p},
                    {"adjusted_p_value", o.adjusted_p},
                    {"certain", o.certain},
                    {"warrant", core::warrant_word(fleet.table.columns[o.column].warrant)},
                    {"certainly_beyond", o.certainly_beyond}});
  }
  return list;
}

Json drift_json(const study::FleetResult& fleet) {
  Json list = Json::array();
  for (const study::ParameterDrift& d : fleet.drift) {
    if (!d.drifts(fleet.drift_level)) {
      continue;
    }
    Json entry = {{"robot", fleet.table.robots[d.robot]},
                  {"parameter", fleet.table.columns[d.column].name},
                  {"unit", fleet.table.columns[d.column].unit},
                  {"logs", d.logs},
                  {"per", d.dated ? "week" : "log"},
                  {"warrant", core::warrant_word(fleet.table.columns[d.column].warrant)},
                  {"certain", nullptr},
                  {"trend", nullptr}};
    if (d.certain != 0.0) {
      entry["certain"] = {{"least_change", d.certain}, {"from", d.certain_from}, {"to", d.certain_to}};
    }
    if (d.has_trend) {
      entry["trend"] = {{"slope", d.slope}, {"standard_error", d.slope_error}, {"lower", d.lower}, {"upper", d.upper},
                        {"p_value", d.p},   {"adjusted_p_value", d.adjusted_p}};
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json spread_json(const study::FleetSpread& spread, const study::FleetResult& fleet) {
  return {{"name", spread.name},
          {"unit", spread.unit},
          {"robots", spread.values.size()},
          {"smallest", spread.quantile(0.0)},
          {"median", spread.quantile(0.5)},
          {"largest", spread.quantile(1.0)},
          {"largest_robot", spread.values.empty() ? Json(nullptr) : Json(fleet.table.robots[spread.largest_robot])}};
}

Json prior_json(const study::FleetResult& fleet) {
  const study::PooledPrior& prior = fleet.prior;
  Json json = {{"exists", prior.exists},     {"message", prior.message},     {"asked", prior.asked},
               {"coverage", prior.coverage}, {"learning", prior.learning},   {"scored", prior.scored},
               {"rank", prior.rank},         {"boundless", prior.boundless}, {"needed", prior.needed},
               {"parameters", Json::array()}};
  for (const study::PooledParameter& p : prior.parameters) {
    const bool boxed = prior.exists && p.included;
    json["parameters"].push_back({{"parameter", fleet.table.columns[p.column].name},
                                  {"unit", fleet.table.columns[p.column].unit},
                                  {"included", boxed},
                                  {"reason", p.reason},
                                  {"hidden", p.hidden},
                                  {"before", {p.before.lower, p.before.upper}},
                                  {"box", boxed ? Json({p.box.lower, p.box.upper}) : Json(nullptr)}});
  }
  return json;
}

// A spreadsheet computes a cell that begins like a formula; behind an apostrophe it is text.
std::string csv_field(std::string text) {
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos) {
    text.insert(0, "'");
  }
  if (text.find_first_of(",\"\r\n") == std::string::npos) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    out += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return out + "\"";
}

}  // namespace

std::string record_text(const study::RobotRecord& record) {
  Json json = {{"robot", record.robot}, {"dated", record.dated}, {"commissioning", log_json(record.commissioning)}};
  json["outputs"] = Json::array();
  for (const study::RecordedOutput& o : record.outputs) {
    json["outputs"].push_back({{"name", o.name},
                               {"unit", o.unit},
                               {"median_width", o.median_width},
                               {"instants", o.instants},
                               {"false_alarms", o.false_alarms}});
  }
  json["smallest_radius_change"] = files::or_null(record.smallest_radius_change);
  json["checks"] = Json::array();
  for (const study::CheckRecord& c : record.checks) {
    json["checks"].push_back({{"log", log_json(c.log)},
                              {"checked", c.checked},
                              {"not_checked", c.not_checked},
                              {"events", c.events},
                              {"first", files::or_null(c.first)},
                              {"instants", c.instants},
                              {"outside_share", c.outside_share}});
  }
  json["notes"] = record.notes;
  json["findings"] = record.findings;
  if (record.passing) {
    json["passing"] = true;
  }
  return files::json_text(json, -1);
}

bool is_passing(std::string_view record) { return record.find(R"("passing":true)") != std::string_view::npos; }

study::RobotRecord record_from_text(std::string_view text, const std::string& where) {
  const Json json = files::parse_json(text, where);
  const JsonPlace at(json, where);
  study::RobotRecord record{.robot = at.at("robot").text(),
                            .dated = at.at("dated").boolean(),
                            .commissioning = log_from(at.at("commissioning"))};
  const JsonPlace outputs = at.at("outputs");
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const JsonPlace o = outputs.at(i);
    record.outputs.push_back({.name = o.at("name").text(),
                              .unit = o.at("unit").text(),
                              .median_width = o.at("median_width").number(),
                              .instants = o.at("instants").count(),
                              .false_alarms = o.at("false_alarms").count()});
  }
  record.smallest_radius_change = maybe(at, "smallest_radius_change");
  const JsonPlace checks = at.at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const JsonPlace c = checks.at(i);
    record.checks.push_back({.log = log_from(c.at("log")),
                             .checked = c.at("checked").boolean(),
                             .not_checked = c.at("not_checked").text(),
                             .events = c.at("events").count(),
                             .first = maybe(c, "first"),
                             .instants = c.at("instants").count(),
                             .outside_share = c.at("outside_share").number()});
  }
  record.notes = at.at("notes").texts();
  record.findings = at.at("findings").texts();
  record.passing = at.has("passing") && at.at("passing").boolean();
  return record;
}

Json to_json(const study::FleetResult& fleet, const std::string& list, const std::string& software) {
  Json json = {
      {"schema", kFleetSchema}, {"software", software}, {"list", list}, {"sentences", study::sentences(fleet)}};
  Json status = Json::object();
  for (const auto& [value, word] : status_words) {
    status[std::string(word)] = fleet.count(value);
  }
  json["robots"] = {{"all", fleet.table.robots.size()},
                    {"status", std::move(status)},
                    {"outside", fleet.robots_outside()},
                    {"drifting", fleet.robots_drifting()},
                    {"drifting_for_certain", fleet.robots_drifting_for_certain()},
                    {"alarmed", fleet.robots_alarmed()}};
  json["logs"] = fleet.logs;
  json["seconds"] = fleet.seconds;
  json["population"] = population_json(fleet);
  json["outside"] = outside_json(fleet, fleet.population.outside);
  json["odd"] = outside_json(fleet, fleet.population.odd);
  json["drift"] = drift_json(fleet);
  json["alarms"] = Json::array();
  for (const study::FleetAlarm& a : fleet.alarms) {
    json["alarms"].push_back({{"robot", fleet.table.robots[a.robot]},
                              {"log", a.log},
                              {"events", a.events},
                              {"first", a.first},
                              {"outside_share", a.outside_share}});
  }
  json["failed"] = Json::array();
  for (const study::FleetFinding& f : fleet.failed) {
    json["failed"].push_back({{"robot", fleet.table.robots[f.robot]}, {"log", f.log}, {"reason", f.text}});
  }
  json["thresholds"] = Json::array();
  for (const study::FleetSpread& spread : fleet.widths) {
    json["thresholds"].push_back(spread_json(spread, fleet));
  }
  json["smallest_radius_change"] = spread_json(fleet.smallest, fleet);
  json["pooled_prior"] = prior_json(fleet);
  return json;
}

std::string fleet_csv_header() {
  return "robot,status,parameter,unit,estimate,standard_error,lower,upper,lower_is_prior,upper_is_prior,warrant\n";
}

std::string fleet_csv_rows(const study::RobotRecord& record) {
  const std::string begin =
      csv_field(record.robot) + "," + files::word_of(status_words, record.commissioning.status) + ",";
  const auto text = [](const std::optional<double>& x) { return x ? files::number_text(*x) : std::string(); };
  std::string out;
  for (const study::RecordedParameter& p : record.commissioning.parameters) {
    out += begin + fmt::format("{},{},{},{},{},{},{:d},{:d},{}\n", p.name, p.unit, text(p.estimate),
                               text(p.standard_error), files::number_text(p.lower), files::number_text(p.upper),
                               p.lower_is_prior, p.upper_is_prior, core::warrant_word(p.warrant));
  }
  return out.empty() ? begin + ",,,,,,,,\n" : out;
}

namespace {

// `text` as comment lines of at most 100 bytes; line ends and control characters become blanks.
std::string comment(std::string text) {
  constexpr std::size_t most = 98;
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  std::string out;
  std::string_view rest = text;
  while (rest.size() > most) {
    std::size_t cut = rest.rfind(' ', most);
    cut = cut == std::string_view::npos || cut == 0 ? rest.size() : cut;
    out += fmt::format("# {}\n", rest.substr(0, cut));
    rest.remove_prefix(std::min(cut + 1, rest.size()));
  }
  return out + fmt::format("# {}\n", rest);
}

}  // namespace

std::string pooled_prior_yaml(const study::FleetResult& fleet, const std::string& software) {
  const study::PooledPrior& prior = fleet.prior;
  std::string out = comment("Pooled prior of a fleet, by " + software + ": copy it into the next robot's file.");
  out += comment((prior.exists ? "Coverage: " : "No box: ") + prior.message + ".");
  if (prior.exists) {
    out += comment(
        "It is distribution-free (split conformal prediction on the robots' bounds); \"drawn alike\" means "
        "exchangeable: the next robot is of the same kind, not one that was chosen for being different.");
  }
  std::string rows;
  for (const study::PooledParameter& p : prior.parameters) {
    const study::FleetColumn& column = fleet.table.columns[p.column];
    if (prior.exists && p.included) {
      rows += fmt::format("  {}: [{}, {}]  # {}\n", column.name, files::number_text(p.box.lower),
                          files::number_text(p.box.upper), column.unit);
    } else if (prior.exists) {
      out += comment("Left out: " + column.name + ", " + p.reason + ".");
    }
  }
  return out + (rows.empty() ? "prior: {}\n" : "prior:\n" + rows);
}

}  // namespace wheelwright::results
