// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <variant>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "commission/design/stages.hpp"
#include "core/check.hpp"
#include "formats/robots/robot_file.hpp"
#include "gap/effects/effect.hpp"
#include "gap/next/discrimination_design.hpp"
#include "gap/next/named_rivals.hpp"
#include "model/sim/simulation.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "results/design_json.hpp"
#include "results/gap_json.hpp"
#include "results/scenario_file.hpp"
#include "results/software.hpp"
#include "results/words/design_summary.hpp"

namespace wheelwright::python {
namespace {

RobotObject read_file(const std::filesystem::path& path) { return {read_robot(path), path.string()}; }

RobotObject from_keys(const py::kwargs& keys) { return {robots::robot_from_json(to_json(keys, "Robot"), "Robot"), ""}; }

py::list parameters(const RobotObject& r) {
  py::list out;
  for (const model::Parameter& p : model::make_model(r.robot).parameters) {
    py::dict row;
    row["name"] = p.name;
    row["unit"] = p.unit;
    row["physical"] = p.physical;
    row["physical_unit"] = p.physical_unit;
    row["per_physical"] = p.per_physical;
    out.append(std::move(row));
  }
  return out;
}

}  // namespace

void bind_robot(py::module_& m) {
  py::class_<RobotObject>(m, "Robot", "What is known of a robot before its first drive: the robot file. Immutable.")
      .def(py::init(&from_keys),
           "Robot(wheel_radius=0.0975, track_width=0.381, noise={...}, ...): the keys of a robot file, SI units.\n\n"
           "Raises InputError, naming the key, for unknown keys, wrong types and impossible values.")
      .def_property_readonly("name", [](const RobotObject& r) { return r.robot.name; })
      .def_property_readonly(
          "model", [](const RobotObject& r) { return r.robot.model; }, "differential_drive or single_axis")
      .def_property_readonly(
          "path", [](const RobotObject& r) { return r.path; }, "as its file was named; empty for one made in Python")
      .def_property_readonly("parameters", &parameters,
                             "one dict for each parameter of theta_L (20): name, unit, physical, physical_unit and "
                             "per_physical (theta_j = per_physical * physical quantity)")
      .def(
          "to_dict", [](const RobotObject& r) { return to_python(robots::to_json(r.robot)); },
          "the keys of the robot file")
      .def(
          "to_yaml", [](const RobotObject& r) { return robots::robot_yaml(r.robot); }, "the text of a robot file")
      .def(
          "save", [](const RobotObject& r, const std::filesystem::path& path) { robots::write_robot(path, r.robot); },
          py::arg("path"), "Writes a robot file, whole or not at all.")
      .def(
          "__eq__",
          [](const RobotObject& a, const RobotObject& b) {
            return robots::to_json(a.robot) == robots::to_json(b.robot);
          },
          py::is_operator())
      .def("__repr__", [](const RobotObject& r) { return "<wheelwright.Robot " + r.robot.name + ">"; });
  m.def("read_robot", &read_file, py::arg("path"),
        "Reads a robot file (YAML).\n\nRaises InputError, naming file, line, key, value and what was expected.");
}

namespace {

using Path = std::filesystem::path;

std::unique_ptr<LogObject> simulated(const std::variant<Path, py::dict>& given,
                                     const std::optional<std::uint64_t>& seed) {
  Scenario scenario =
      std::holds_alternative<Path>(given)
          ? read_scenario(std::get<Path>(given))
          : results::parse_scenario(files::json_text(to_json(std::get<py::dict>(given), "scenario")), "scenario", ".");
  scenario.seed = seed.value_or(scenario.seed);
  LongWork work{py::none()};
  const LogTable table = work.run([&] {
    Simulation simulation(scenario);
    WatchedLog source(simulation, work);
    return read_all(source);
  });
  logs::CsvOptions options;
  options.min_rows = 1;
  auto log = std::make_unique<LogObject>();
  log->source = array_log(arrays_of(table), options);
  return log;
}

struct DesignObject {
  LogTable commands;
  std::optional<LogTable> figure_eight;
  Json json;
  std::string summary;
};

design::MotionLimits limits_for(const Robot& robot, double duration, const std::optional<double>& speed,
                                const std::optional<double>& acceleration, const std::optional<double>& effort,
                                const std::optional<double>& radius, const std::optional<std::array<double, 4>>& box) {
  design::MotionLimits limits = design::limits_of(robot);
  limits.duration = duration;
  limits.joint_speed = speed.value_or(limits.joint_speed);
  limits.joint_acceleration = acceleration ? acceleration : limits.joint_acceleration;
  limits.effort = effort ? effort : limits.effort;
  limits.radius = radius;
  if (box) {
    limits.box = {Interval{(*box)[0], (*box)[1]}, Interval{(*box)[2], (*box)[3]}};
  }
  design::validate(limits);
  return limits;
}

design::WidthCriterion criterion_called(const std::string& name) {
  check::that(name == "geometric_mean" || name == "mean" || name == "largest", "criterion '" + name + "'",
              "geometric_mean, mean or largest");
  return name == "mean"      ? design::WidthCriterion::mean
         : name == "largest" ? design::WidthCriterion::largest
                             : design::WidthCriterion::geometric_mean;
}

design::Promise guarantee_called(const std::string& name) {
  check::that(name == "every_noise" || name == "at_risk", "guarantee '" + name + "'", "every_noise or at_risk");
  return name == "at_risk" ? design::Promise::at_risk : design::Promise::every_noise;
}

std::vector<design::InspectedFault> inspected(const std::map<std::string, double>& faults, const OnlineModel& model) {
  if (faults.empty()) {
    return design::usual_inspection(model);
  }
  const std::vector<FaultType> catalogue = model::fault_catalogue(model.model, model.estimate, model.robot.effort);
  std::vector<design::InspectedFault> out;
  for (const auto& [name, size] : faults) {
    out.push_back({model::find_fault(catalogue, name), check::positive(size, "faults['" + name + "']")});
  }
  return out;
}

// What a drive is to tell apart: the credible set of a gap, or causes by name with their sizes.
struct Rivals {
  std::optional<Json> gap;
  std::string file;  // of it, for messages
  std::vector<std::string> between;
  std::map<std::string, double> sizes;
};

Rivals rivals_of(const py::object& gap, std::vector<std::string> between, std::map<std::string, double> sizes) {
  Rivals out{{}, "", std::move(between), std::move(sizes)};
  if (py::isinstance<py::str>(gap) || py::hasattr(gap, "__fspath__")) {
    const Path path = gap.cast<Path>();
    out.gap = files::read_json(path);
    out.file = path.string();
  } else if (!gap.is_none()) {
    out.gap = diagnosis_json(gap);
    out.file = "gap";
  }
  check::that(out.gap.has_value() != (out.between.size() >= 2), "aim 'discrimination'",
              "gap, or at least two causes in between");
  check::that(!out.gap || out.sizes.empty(), "sizes", "between, since a gap has the sizes");
  return out;
}

gap::DiscriminationDesign tell_apart(const Rivals& given, const design::DesignSubject& subject,
                                     const design::MotionLimits& limits, const design::DesignOptions& options) {
  std::vector<Effect> catalogue = gap::effect_catalogue(subject.model);
  const gap::Drive drive = gap::ordinary_drive(subject, limits);
  gap::PlannedNoise noise = gap::expected_noise(subject);
  std::vector<gap::NamedSize> sizes;
  for (const auto& [what, value] : given.sizes) {
    sizes.push_back({what, [v = value](const std::string&) { return v; }, "sizes['" + what + "']"});
  }
  const std::vector<gap::Rival> rivals = given.gap
                                             ? results::rivals_of_gap(*given.gap, given.file, catalogue, drive, noise)
                                             : gap::rivals_named(given.between, "between ", sizes, catalogue, drive);
  return gap::design_for_discrimination(subject, limits, rivals, catalogue, noise, options);
}

std::unique_ptr<DesignObject> design(const std::variant<const ModelObject*, const RobotObject*>& of,
                                     const std::string& aim, double duration, const std::optional<double>& speed,
                                     const std::optional<double>& acceleration, const std::optional<double>& effort,
                                     const std::optional<double>& radius,
                                     const std::optional<std::array<double, 4>>& box, double rate,
                                     const std::string& criterion, const std::map<std::string, double>& faults,
                                     std::size_t stages, const std::string& guarantee, const py::object& gap,
                                     std::vector<std::string> between, std::map<std::string, double> sizes,
                                     std::uint64_t seed, std::size_t threads, py::object progress) {
  const bool discrimination = aim == "discrimination";
  check::that(aim == "bounds" || aim == "detection" || discrimination, "aim '" + aim + "'",
              "bounds, detection or discrimination");
  check::that(discrimination || (gap.is_none() && between.empty() && sizes.empty()), "gap, between, sizes",
              "aim 'discrimination'");
  const std::optional<Rivals> rivals =
      discrimination ? std::optional(rivals_of(gap, std::move(between), std::move(sizes))) : std::nullopt;
  const bool from_model = std::holds_alternative<const ModelObject*>(of);
  check::that(aim != "detection" || from_model, "aim 'detection'", "a commissioned Model, not a Robot");
  check::positive(rate, "rate");
  const Robot& robot = from_model ? std::get<0>(of)->model->robot : std::get<1>(of)->robot;
  const design::MotionLimits limits = limits_for(robot, duration, speed, acceleration, effort, radius, box);
  const design::WidthCriterion wanted = criterion_called(criterion);
  LongWork work(std::move(progress));
  design::DesignOptions options;
  options.stages = stages;
  options.guarantee = guarantee_called(guarantee);
  check::that(!discrimination || options.guarantee == design::Promise::every_noise, "guarantee 'at_risk'",
              "aim bounds or detection; telling causes apart is statistical");
  options.seed = seed;
  options.threads = threads;
  options.progress = work.teller();
  return work.run([&] {
    const design::DesignSubject subject =
        from_model ? design::subject_of(*std::get<0>(of)->model) : design::subject_of(robot, 1.0 / rate);
    auto out = std::make_unique<DesignObject>();
    const auto finish = [&](const auto& made) {
      out->json["software"] = results::software();
      out->json["seed"] = seed;
      out->json["warrant"] = core::warrant_word(subject.warrant);
      out->summary += "  these promises are " + std::string(core::warrant_word(subject.warrant)) + "\n";
      out->commands = design::command_table(made.manoeuvre.plan, subject.model);
      if (made.figure_eight_plan) {
        out->figure_eight = design::command_table(*made.figure_eight_plan, subject.model);
      }
    };
    if (aim == "detection") {
      const OnlineModel& model = *std::get<0>(of)->model;
      const design::DetectionDesign made = design::design_for_detection(
          model, subject, limits, inspected(faults, model), design::sized_for(design::PlanCost::walk_each, options));
      out->json = results::to_json(made, limits);
      out->summary = words::summary(made);
      finish(made);
    } else if (rivals) {
      const design::MotionLimits in_torques = gap::limits_in_torques(limits, subject);
      const gap::DiscriminationDesign made = tell_apart(*rivals, gap::in_torques(subject), in_torques,
                                                        design::sized_for(design::PlanCost::walk_each, options));
      out->json = results::to_json(made, in_torques);
      out->summary = words::summary(made);
      finish(made);
    } else {
      const design::BoundsDesign made = design::design_for_bounds(
          subject, limits, wanted, design::sized_for(design::cost_of_bounds(options.guarantee), options));
      out->json = results::to_json(made, subject, limits);
      out->summary = words::summary(made, subject);
      finish(made);
    }
    return out;
  });
}

}  // namespace

void bind_sim(py::module_& m) {
  m.def("simulate", &simulated, py::arg("scenario"), py::arg("seed") = std::nullopt,
        "Drives the paper's robot as a scenario file (or a dict with its keys) says, and returns what its sensors "
        "would log. seed: of all noise, in place of the scenario's.\n\n"
        "Raises InputError, naming file, line and key. The interpreter's lock is released; Ctrl-C ends the work.");
  py::class_<DesignObject> designed(m, "Design", "A manoeuvre, and what it promises.");
  designed
      .def_property_readonly(
          "commands", [](const DesignObject& d) { return arrays_of(d.commands); },
          "t (s), wheel-speed commands command_r, command_l (rad/s), and the motion that they are for; read-only, "
          "shape (rows,) each")
      .def_property_readonly(
          "figure_eight",
          [](const DesignObject& d) {
            return d.figure_eight ? std::optional<py::dict>(arrays_of(*d.figure_eight)) : std::nullopt;
          },
          "the best figure eight within the same limits; None for other than differential drives");
  result_of(designed, "design");
  m.def("design", &design, py::arg("of"), py::arg("aim") = "bounds", py::kw_only(), py::arg("duration") = 20.0,
        py::arg("speed") = std::nullopt, py::arg("acceleration") = std::nullopt, py::arg("effort") = std::nullopt,
        py::arg("radius") = std::nullopt, py::arg("box") = std::nullopt, py::arg("rate") = 100.0,
        py::arg("criterion") = "geometric_mean", py::arg("faults") = std::map<std::string, double>{},
        py::arg("stages") = design::DesignOptions{}.stages, py::arg("guarantee") = "every_noise",
        py::arg("gap") = py::none(), py::arg("between") = std::vector<std::string>{},
        py::arg("sizes") = std::map<std::string, double>{}, py::arg("seed") = 1, py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Designs a drive for a Model (or, not for detection, a Robot with nominal values and declared noise), as "
        "`wheelwright design` does.\n\n"
        "aim: bounds (narrow bounds on theta), detection (certain to find faults that are small) or discrimination "
        "(tells "
        "causes of a gap apart: the credible set of `gap`, a Diagnosis or a gap.json, or the effects in `between`, "
        "several "
        "joined by +, each of a size in `sizes`, EFFECT or EFFECT.PARAMETER -> SI value). duration: s. speed "
        "(rad/s), acceleration (rad/s^2), effort (N m): of a wheel; those of the robot file where they are not given. "
        "radius: m about the start; box: (xmin, xmax, ymin, ymax), m. rate: of the log to come, Hz, for a Robot. "
        "criterion: geometric_mean, mean or largest. guarantee: every_noise, or at_risk where errors average out "
        "(docs/methods/risk.md), is the promise that is to be good; both are told. faults: name -> size asked for. The "
        "result "
        "does not depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python
