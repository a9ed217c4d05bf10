// SPDX-License-Identifier: Apache-2.0
#include "results/study_json.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/json.hpp"
#include "formats/files/place.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_json.hpp"
#include "results/scenario_file.hpp"

namespace wheelwright::results {

using files::or_null;
using files::YamlPlace;

namespace {

constexpr std::uint64_t kLargestSeed = std::uint64_t{1} << 53;
constexpr std::size_t kLongestFile = std::size_t{1} << 20;

constexpr Eigen::Index kMostPoints = 100'000;  // of a method, for each input that it moves

Eigen::Index whole_from(const YamlPlace& place, int least) {
  return static_cast<Eigen::Index>(place.whole(static_cast<std::uint64_t>(least), kMostPoints));
}

std::pair<double, double> two_numbers(const YamlPlace& place) {
  const std::string expected = "two numbers [from, to], the first below the second";
  const auto ends = place.elements(expected);
  if (ends.size() != 2) {
    place.fail(expected);
  }
  const std::pair<double, double> range = {ends[0].number(), ends[1].number()};
  if (!(range.first < range.second)) {
    place.fail(expected);
  }
  return range;
}

struct StudyReader {
  std::string_view text;
  const std::string& file;
  const std::filesystem::path& folder;
  StudyFile result = {};
  std::optional<YamlPlace> inputs = {}, quantities = {}, methods = {};
  std::uint64_t seed = 1;

  void read() {
    result.text = text;
    std::optional<YamlPlace> scenario, log, robot;
    for (const auto& [key, place] :
         YamlPlace::parse(text, file)
             .members({"name", "scenario", "log", "robot", "inputs", "quantities", "window", "methods", "seed"})) {
      if (key == "name") {
        result.study.name = place.text("a name");
      } else if (key == "window") {
        result.study.evaluate.window = place.positive();
      } else if (key == "seed") {
        seed = place.whole(0, kLargestSeed);
      } else {
        (key == "scenario"     ? scenario
         : key == "log"        ? log
         : key == "robot"      ? robot
         : key == "inputs"     ? inputs
         : key == "quantities" ? quantities
                               : methods) = place;
      }
    }
    if (scenario.has_value() == log.has_value()) {
      throw InputError(file + (scenario ? ": both a scenario and a log: expected one of them"
                                        : ": neither a scenario nor a log: expected one of them"));
    }
    if (log && !robot) {
      throw InputError(file + ": no key robot: expected the robot file beside the log");
    }
    if (!inputs) {
      throw InputError(file + ": no key inputs: expected what the study varies");
    }
    read_subject(scenario, log, robot);
    read_inputs();
    read_quantities();
    read_methods();
  }

  std::filesystem::path source(const YamlPlace& place, const std::string& expected) {
    result.sources.push_back(folder / place.text(expected));
    return result.sources.back();
  }

  void read_subject(const std::optional<YamlPlace>& scenario, const std::optional<YamlPlace>& log,
                    const std::optional<YamlPlace>& robot) {
    study::StudyCase& subject = result.study.subject;
    if (scenario) {
      subject.scenario = read_scenario(source(*scenario, "a scenario file"));
      subject.robot = subject.scenario->robot;
    }
    if (robot) {
      subject.robot = read_robot(source(*robot, "a robot file"));
    }
    if (log) {
      std::vector<std::filesystem::path> paths;
      if (log->is_scalar()) {
        paths.push_back(source(*log, "a log"));
      } else {
        for (const YamlPlace& each : log->elements("a log, or a list of logs")) {
          paths.push_back(source(each, "a log"));
        }
      }
      if (paths.empty()) {
        log->fail("at least one log");
      }
      const std::unique_ptr<logs::RecordedLog> opened = logs::open_log(paths, {});
      subject.robot = model::with_column_errors(subject.robot, logs::interpolation_errors(opened->report()));
      subject.log = std::make_shared<const LogTable>(read_all(*opened));
    }
  }

  void read_inputs() {
    const auto members = inputs->members();
    if (members.empty()) {
      inputs->fail("at least one input");
    }
    std::vector<std::string> names;
    for (const auto& [name, place] : members) {
      names.push_back(name);
    }
    try {
      const std::string note = study::settle_filter(result.study.subject, names);
      if (!note.empty()) {
        result.notes.push_back(note);
      }
    } catch (const InvalidArgument& error) {
      throw InputError(file + ": " + error.what());
    }
    for (const auto& [name, place] : members) {
      try {
        read_input(name, place);
      } catch (const InvalidArgument& error) {
        place.say(error.what());
      }
    }
  }

  void read_input(const std::string& name, const YamlPlace& place) {
    study::StudyInput input;
    input.name = name;
    input.unit = study::unit_of_input(name);
    std::optional<double> nominal = study::nominal_of_input(result.study.subject, name);
    std::optional<std::pair<double, double>> range, relative;
    if (place.is_mapping()) {
      for (const auto& [key, value] : place.members({"range", "relative", "scale", "nominal"})) {
        if (key == "range") {
          range = two_numbers(value);
        } else if (key == "relative") {
          relative = two_numbers(value);
        } else if (key == "scale") {
          input.logarithmic = value.choice({"linear", "log"}) == 1;
        } else {
          nominal = value.number();
        }
      }
    } else {
      range = two_numbers(place);
    }
    if (range.has_value() == relative.has_value()) {
      place.fail("either a range or a relative range");
    }
    if (relative) {
      if (!nominal) {
        place.fail("a range: " + name + " has no value that a relative one could count from");
      }
      range = {*nominal * (1.0 + relative->first), *nominal * (1.0 + relative->second)};
      if (range->first > range->second) {
        std::swap(range->first, range->second);
      }
    }
    input.lower = range->first;
    input.upper = range->second;
    input.nominal =
        nominal ? std::clamp(*nominal, input.lower, input.upper)
                : (input.logarithmic ? std::sqrt(input.lower * input.upper) : 0.5 * (input.lower + input.upper));
    study::validate(input);
    for (const double end : {input.lower, input.upper}) {
      study::StudyCase trial = result.study.subject;
      study::set_input(trial, name, end);
    }
    if (nominal && std::abs(input.nominal - *nominal) > 1e-6 * std::abs(*nominal)) {
      result.notes.push_back(name +
                             " is varied in a range that does not hold its own value: where others are varied, it "
                             "is at the end of the range nearest to that");
    }
    result.study.inputs.push_back(std::move(input));
  }

  void read_quantities() {
    std::vector<std::string> names;
    if (quantities) {
      for (const YamlPlace& each : quantities->elements("a list of quantities")) {
        names.push_back(each.text("the name of a quantity"));
        try {
          static_cast<void>(study::study_quantities({names.back()}, result.study.subject.robot));
        } catch (const InvalidArgument& error) {
          each.say(error.what());
        }
      }
    }
    try {
      result.study.quantities = study::study_quantities(names, result.study.subject.robot);
    } catch (const InvalidArgument& error) {
      throw InputError(file + ": " + error.what());
    }
  }

  void read_methods() {
    study::StudyMethods& out = result.study.methods;
    if (!methods) {
      out.local = true;
      out.one_at_a_time = 5;
      return;
    }
    for (const auto& [key, place] : methods->members({"local", "one_at_a_time", "morris", "sobol", "grid"})) {
      if (key == "local") {
        out.local = place.boolean();
      } else if (key == "one_at_a_time") {
        out.one_at_a_time = 5;
        for (const auto& [name, value] : place.members({"levels"})) {
          out.one_at_a_time = whole_from(value, 2);
        }
      } else if (key == "morris") {
        out.morris = study::MorrisOptions{};
        out.morris->seed = seed;
        for (const auto& [name, value] : place.members({"trajectories", "levels"})) {
          (name == "levels" ? out.morris->levels : out.morris->trajectories) = whole_from(value, 2);
        }
      } else if (key == "sobol") {
        read_sobol(place);
      } else {
        read_grid(place);
      }
    }
    try {
      static_cast<void>(study::design_of(result.study));
    } catch (const InvalidArgument& error) {
      methods->say(error.what());
    }
  }

  void read_sobol(const YamlPlace& place) {
    study::SobolOptions options;
    options.seed = seed;
    for (const auto& [name, value] : place.members({"points", "replicates", "confidence"})) {
      if (name == "confidence") {
        options.confidence = value.number("a number between 0 and 1", [](double x) { return x > 0.0 && x < 1.0; });
      } else {
        (name == "points" ? options.points : options.replicates) = whole_from(value, 2);
      }
    }
    if (options.points > kMostPoints / options.replicates) {
      place.fail(fmt::format("points times replicates of at most {}", kMostPoints));
    }
    result.study.methods.sobol = options;
  }

  void read_grid(const YamlPlace& place) {
    study::Grid grid;
    grid.nominal = study::nominal_point(result.study.inputs);
    grid.levels.assign(result.study.inputs.size(), 5);
    for (const auto& [name, value] : place.members({"levels"})) {
      if (!value.is_mapping()) {
        grid.levels.assign(result.study.inputs.size(), whole_from(value, 2));
        continue;
      }
      std::vector<std::string> names;
      for (const study::StudyInput& input : result.study.inputs) {
        names.push_back(input.name);
      }
      grid.levels.assign(result.study.inputs.size(), 1);
      for (const auto& [input, levels] : value.members(names)) {
        grid.levels[static_cast<std::size_t>(std::ranges::find(names, input) - names.begin())] = whole_from(levels, 1);
      }
    }
    result.study.methods.grid = grid;
  }
};

}  // namespace

StudyFile read_study(const std::filesystem::path& path) {
  return parse_study(files::read_bytes(path, kLongestFile), path.string(), path.parent_path());
}

StudyFile parse_study(std::string_view text, const std::string& file, const std::filesystem::path& folder) {
  StudyReader reader{text, file, folder};
  reader.read();
  return std::move(reader.result);
}

namespace {

Json inputs_json(const study::Study& study) {
  Json list = Json::array();
  for (const study::StudyInput& input : study.inputs) {
    list.push_back({{"name", input.name},
                    {"unit", input.unit},
                    {"lower", input.lower},
                    {"upper", input.upper},
                    {"nominal", input.nominal},
                    {"scale", input.logarithmic ? "log" : "linear"}});
  }
  return list;
}

Json one_at_a_time_json(const study::Study& study, std::size_t q, const study::StudyResult& result) {
  const study::OneAtATime& found = result.one_at_a_time[q];
  Json inputs = Json::array();
  for (const std::size_t i : found.order) {
    const study::InputCurve& curve = found.inputs[i];
    Json points = Json::array();
    for (Eigen::Index k = 0; k < curve.coordinates.size(); ++k) {
      points.push_back({study::value(study.inputs[i], curve.coordinates[k]), or_null(curve.values[k])});
    }
    inputs.push_back({{"input", study.inputs[i].name},
                      {"low", or_null(curve.low)},
                      {"high", or_null(curve.high)},
                      {"swing", or_null(curve.swing)},
                      {"curve", std::move(points)}});
  }
  return {{"nominal", or_null(found.nominal)}, {"inputs", std::move(inputs)}};
}

Json morris_json(const study::Study& study, const std::vector<study::ElementaryEffects>& found) {
  Json inputs = Json::array();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const study::ElementaryEffects& e = found[i];
    inputs.push_back({{"input", study.inputs[i].name},
                      {"mean", or_null(e.mean)},
                      {"mean_absolute", or_null(e.mean_absolute)},
                      {"lower", or_null(e.lower)},
                      {"upper", or_null(e.upper)},
                      {"deviation", or_null(e.deviation)},
                      {"effects", e.effects}});
  }
  return {{"inputs", std::move(inputs)}};
}

Json index_json(const study::SobolIndex& index) {
  return {{"estimate", or_null(index.estimate)}, {"lower", or_null(index.lower)}, {"upper", or_null(index.upper)}};
}

Json sobol_json(const study::Study& study, const study::SobolIndices& found) {
  Json inputs = Json::array();
  for (std::size_t i = 0; i < found.first.size(); ++i) {
    inputs.push_back({{"input", study.inputs[i].name},
                      {"first", index_json(found.first[i])},
                      {"total", index_json(found.total[i])}});
  }
  return {{"status", study::to_string(found.status)},
          {"mean", or_null(found.mean)},
          {"variance", or_null(found.variance)},
          {"inputs", std::move(inputs)},
          {"interactions", index_json(found.interactions)},
          {"base_points", found.base_points},
          {"left_out", or_null(found.left_out)}};
}

Json grid_json(const study::Study& study, const study::StudyResult& result) {
  const study::Grid& grid = *study.methods.grid;
  Json levels = Json::array();
  for (std::size_t i = 0; i < study.inputs.size(); ++i) {
    Json values = Json::array();
    for (const double u : study::grid_coordinates(grid, static_cast<Eigen::Index>(i))) {
      values.push_back(grid.levels[i] == 1 ? study.inputs[i].nominal : study::value(study.inputs[i], u));
    }
    levels.push_back({{"input", study.inputs[i].name}, {"values", std::move(values)}});
  }
  Json points = Json::array();
  for (Eigen::Index row = 0; row < result.grid.rows(); ++row) {
    Json values = Json::array();
    for (Eigen::Index q = 0; q < result.grid.cols(); ++q) {
      values.push_back(or_null(result.grid(row, q)));
    }
    points.push_back(std::move(values));
  }
  return {{"levels", std::move(levels)}, {"points", std::move(points)}};
}

Json one_sided_json(const study::OneSided& derivative) {
  return {{"left", or_null(derivative.left)}, {"right", or_null(derivative.right)}};
}

Json local_json(const study::LocalSensitivity& local) {
  Json inputs = Json::array();
  for (const study::LocalDerivative& input : local.inputs) {
    Json parameters = Json::array();
    for (std::size_t j = 0; j < input.parameters.size(); ++j) {
      const study::ParameterDerivative& d = input.parameters[j];
      parameters.push_back({{"parameter", local.parameters[j]},
                            {"unit", local.units[j]},
                            {"lower", one_sided_json(d.lower)},
                            {"upper", one_sided_json(d.upper)},
                            {"width", one_sided_json(d.width)},
                            {"elasticity", d.elasticity ? or_null(*d.elasticity) : Json(nullptr)},
                            {"differentiable", d.differentiable},
                            {"why_not", d.why_not}});
    }
    inputs.push_back(
        {{"input", input.input}, {"unit", input.unit}, {"value", input.value}, {"parameters", std::move(parameters)}});
  }
  return {{"warrant", core::warrant_word(local.warrant)}, {"inputs", std::move(inputs)}, {"notes", local.notes}};
}

}  // namespace

Json to_json(const StudyFile& file, const study::StudyResult& result,
             const std::optional<study::LocalSensitivity>& local, const std::string& name,
             const std::string& software) {
  const study::Study& study = file.study;
  Json quantities = Json::array();
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    Json one = {{"name", study.quantities[q].name}, {"unit", study.quantities[q].unit}};
    if (!result.one_at_a_time.empty()) {
      one["one_at_a_time"] = one_at_a_time_json(study, q, result);
    }
    if (!result.morris.empty()) {
      one["morris"] = morris_json(study, result.morris[q]);
    }
    if (!result.sobol.empty()) {
      one["sobol"] = sobol_json(study, result.sobol[q]);
    }
    quantities.push_back(std::move(one));
  }
  Json without = Json::array();
  for (const study::StudyFinding& finding : result.findings) {
    without.push_back({{"sentence", finding.sentence}, {"points", finding.points}});
  }
  Json sources = Json::array();
  for (const auto& source : file.sources) {
    sources.push_back(source.string());
  }
  Json out = {{"schema", kSensitivitySchema},
              {"software", software},
              {"name", study.name},
              {"study", name},
              {"sources", std::move(sources)},
              {"robot", study.subject.robot.name},
              {"points", result.points},
              {"inputs", inputs_json(study)},
              {"quantities", std::move(quantities)},
              {"without_model", std::move(without)},
              {"notes", file.notes}};
  if (local) {
    out["local"] = local_json(*local);
  }
  if (study.methods.grid) {
    out["grid"] = grid_json(study, result);
  }
  return out;
}

}  // namespace wheelwright::results
