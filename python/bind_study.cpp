// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <variant>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "core/check.hpp"
#include "formats/robots/fleet_list.hpp"
#include "formats/robots/robot_file.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "results/fleet_json.hpp"
#include "results/fleet_logs.hpp"
#include "results/software.hpp"
#include "results/study_json.hpp"
#include "results/words/fleet_summary.hpp"
#include "results/words/study_summary.hpp"
#include "study/examine_robot.hpp"
#include "study/study_work.hpp"

namespace wheelwright::python {
namespace {

using Path = std::filesystem::path;
using Paths = std::variant<Path, std::vector<Path>>;
using FleetLogs = std::variant<Path, std::vector<Path>, std::map<std::string, Paths>>;

// Results of items, as long as the call takes.
class ItemResults final : public study::ResultStore {
 public:
  explicit ItemResults(std::size_t items) : results_(items) {}
  [[nodiscard]] bool has(std::size_t item) override { return !results_[item].empty(); }
  void put(std::size_t item, std::string_view result) override { results_[item] = result; }
  [[nodiscard]] const std::vector<std::string>& all() const { return results_; }

 private:
  std::vector<std::string> results_;
};

// Evaluates all items; progress is told as the command line does: "robot 3 of 20".
std::vector<std::string> evaluated(const study::Work& items, LongWork& work, std::size_t threads,
                                   const std::string& noun) {
  ItemResults results(items.items);
  study::RunOptions options{threads, {}, [tell = work.teller(), noun](std::size_t done, std::size_t all) {
                              tell(noun + " " + std::to_string(done) + " of " + std::to_string(all),
                                   all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 1.0);
                            }};
  study::run_work(items, results, options);
  return results.all();
}

struct FleetObject {
  study::FleetResult fleet;
  Json json, records = Json::array();
  std::string prior, summary;
};

robots::FleetListRobot listed_robot(const std::string& name, const std::vector<Path>& logs) {
  check::that(!logs.empty(), "logs of " + name, "at least one");
  robots::FleetListRobot robot{.name = name};
  for (std::size_t k = 0; k < logs.size(); ++k) {
    (k == 0 ? robot.commission : robot.checks).push_back({logs[k], static_cast<double>(k)});
  }
  return robot;
}

// A list file or directory; logs of a robot each, called as their file; or the logs of each robot by its name.
std::vector<robots::FleetListRobot> robots_of(const FleetLogs& given) {
  if (const auto* const list = std::get_if<Path>(&given)) {
    return robots::read_fleet(*list);
  }
  std::vector<robots::FleetListRobot> out;
  if (const auto* const logs = std::get_if<std::vector<Path>>(&given)) {
    for (const Path& log : *logs) {
      const std::string file = log.filename().string();
      out.push_back(listed_robot(file.substr(0, file.find('.')), {log}));
      for (std::size_t k = 0; k + 1 < out.size(); ++k) {
        check::that(out[k].name != out.back().name, "logs: two robots called " + out.back().name,
                    "a dict of their logs by name");
      }
    }
  } else {
    for (const auto& [name, logs_of_it] : std::get<2>(given)) {
      const auto* const one = std::get_if<Path>(&logs_of_it);
      out.push_back(
          listed_robot(name, one != nullptr ? std::vector<Path>{*one} : std::get<std::vector<Path>>(logs_of_it)));
    }
  }
  check::that(!out.empty(), "logs", "at least one");
  return out;
}

std::unique_ptr<FleetObject> fleet_of(const FleetLogs& logs, const RobotObject* robot, double level, double coverage,
                                      bool statistical, const std::map<std::string, std::string>& map,
                                      const std::vector<std::string>& despite, std::uint64_t seed, std::size_t threads,
                                      py::object progress) {
  check::that(level > 0.0 && level <= 0.5, "level", "a probability > 0, at most 0.5");
  check::that(coverage > 0.0 && coverage < 1.0, "coverage", "a probability between 0 and 1");
  const std::vector<robots::FleetListRobot> robots = robots_of(logs);
  results::FleetReading reading{robot != nullptr ? std::optional(robot->robot) : std::nullopt,
                                robot != nullptr ? columns_of(*robot) : robots::ColumnMap{},
                                reader_options(nullptr, map, {}), despite};
  study::ExamineOptions examine;
  examine.commission.at_risk = commission::CommissionOptions::AtRisk::detector;  // as the command line
  examine.commission.noise_mode = statistical ? filter::NoiseMode::statistical : filter::NoiseMode::worst_case;
  study::FleetOptions judge;
  judge.population.level = judge.drift_level = level;
  judge.prior.coverage = coverage;
  judge.prior.seed = seed;
  const auto* const list = std::get_if<Path>(&logs);
  LongWork work(std::move(progress));
  return work.run([&] {
    const study::Work items{
        robots.size(), [&](std::size_t item) {
          return results::record_text(study::examine_robot(results::logs_of(robots[item], reading), examine));
        }};
    auto out = std::make_unique<FleetObject>();
    for (const std::string& text : evaluated(items, work, threads, "robot")) {
      study::take(out->fleet, results::record_from_text(text, "fleet"));
      out->records.push_back(files::parse_json(text, "fleet"));
    }
    study::judge_fleet(out->fleet, judge);
    out->json = results::to_json(out->fleet, list != nullptr ? list->string() : "", results::software());
    out->prior = results::pooled_prior_yaml(out->fleet, results::software());
    out->summary = words::summary(out->fleet);
    return out;
  });
}

struct SensitivityObject {
  std::vector<std::string> inputs, quantities, findings;
  std::vector<double> points, values;  // cases × inputs, cases × quantities
  Json json;
  std::string summary;
};

std::unique_ptr<SensitivityObject> sensitivity_of(const Path& path, std::size_t threads, py::object progress) {
  LongWork work(std::move(progress));
  return work.run([&] {
    results::StudyFile file = results::read_study(path);
    const study::Study& study = file.study;
    const study::StudyDesign design = study::design_of(study);
    const std::vector<std::string> texts = evaluated(study::work_of(study, design), work, threads, "point");
    study::StudyValues values(study, design);
    auto out = std::make_unique<SensitivityObject>();
    for (const study::StudyInput& input : study.inputs) {
      out->inputs.push_back(input.name);
    }
    for (const study::StudyQuantity& quantity : study.quantities) {
      out->quantities.push_back(quantity.name);
    }
    for (std::size_t item = 0; item < texts.size(); ++item) {
      const study::CaseResult result = study::case_result(texts[item]);
      values.put(item, result);
      const Eigen::VectorXd point = study::point_of(design, item);
      for (std::size_t i = 0; i < study.inputs.size(); ++i) {
        out->points.push_back(study::value(study.inputs[i], point[static_cast<Eigen::Index>(i)]));
      }
      for (std::size_t q = 0; q < study.quantities.size(); ++q) {
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        out->values.push_back(q < result.values.size() ? result.values[q] : nan);
      }
      out->findings.push_back(result.finding);
    }
    const study::StudyResult result = values.result();
    const std::optional<study::LocalSensitivity> local = study::nominal_derivatives(study, file.notes);
    out->json = results::to_json(file, result, local, path.string(), results::software());
    out->summary = words::summary(study, result, local);
    return out;
  });
}

py::array cases(const SensitivityObject& s, const std::vector<double>& v, std::size_t columns, py::handle owner) {
  return view(v.data(), {static_cast<py::ssize_t>(s.findings.size()), static_cast<py::ssize_t>(columns)}, owner);
}

}  // namespace

void bind_study(py::module_& m) {
  py::class_<FleetObject> fleet(m, "Fleet", "The robots of a fleet, judged together: fleet.json.");
  fleet
      .def_property_readonly(
          "well", [](const FleetObject& f) { return f.fleet.well(); },
          "whether no robot is outside, drifts, raised an alarm, was contradicted or could not be examined")
      .def_property_readonly(
          "records", [](const FleetObject& f) { return to_python(f.records); },
          "a dict for each robot: its commissioning with parameters, its checks, notes and findings")
      .def_readonly("prior_yaml", &FleetObject::prior, "the key `prior` for the next robot's file")
      .def("__len__", [](const FleetObject& f) { return f.records.size(); });
  result_of(fleet, "fleet");
  members_of(fleet, {"robots", "outside", "drift", "alarms", "failed", "population", "pooled_prior", "sentences"});
  m.def("fleet", &fleet_of, py::arg("logs"), py::arg("robot") = nullptr, py::kw_only(),
        py::arg("level") = study::PopulationOptions{}.level, py::arg("coverage") = study::PooledPriorOptions{}.coverage,
        py::arg("statistical") = false, py::arg("map") = std::map<std::string, std::string>{},
        py::arg("despite") = std::vector<std::string>{}, py::arg("seed") = 1, py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Commissions and checks the logs of many robots, as `wheelwright fleet` does, in memory.\n\n"
        "logs: a fleet list or directory, a sequence of log files (a robot each), or a dict of the log files of each "
        "robot by its name (the first commissions, the others are checked). robot: of every robot that has no file of "
        "its own. level: probability that any robot of a fleet of equals is called outside. coverage: of the pooled "
        "prior. despite: findings of the doctor that are passed over. A bad log never stops the rest. The result does "
        "not depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work.");
  py::class_<SensitivityObject> sensitivity(
      m, "Sensitivity", "How bounds and thresholds depend on sensors, filter and drive: sensitivity.json.");
  sensitivity
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& s = self.cast<const SensitivityObject&>();
            return cases(s, s.points, s.inputs.size(), self);
          },
          "values of the inputs, shape (cases, inputs), read-only view")
      .def_property_readonly(
          "values",
          [](const py::object& self) {
            const auto& s = self.cast<const SensitivityObject&>();
            return cases(s, s.values, s.quantities.size(), self);
          },
          "of the quantities, shape (cases, quantities); NaN where there is none, inf where no size is certain")
      .def_readonly("findings", &SensitivityObject::findings, "why a case gave no model; empty where it gave one")
      .def("__len__", [](const SensitivityObject& s) { return s.findings.size(); });
  result_of(sensitivity, "sensitivity");
  members_of(sensitivity, {"name", "inputs", "quantities", "without_model", "notes"});
  m.def("sensitivity", &sensitivity_of, py::arg("study"), py::kw_only(), py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Commissions the robot of a study file at many settings of its inputs, as `wheelwright sensitivity` does, in "
        "memory.\n\n"
        "The result does not depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work. Raises "
        "InputError, naming file, line, key, value and what was expected.");
}

}  // namespace wheelwright::python
