// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "core/check.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "gap/diagnose.hpp"
#include "gap/effects/effect.hpp"
#include "gap/next_drive.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "results/gap_json.hpp"
#include "results/software.hpp"
#include "results/words/gap_words.hpp"

namespace wheelwright::python {

using gap::Drive;
using gap::JointSignals;
using gap::ShapeParameter;

namespace {

// A drive as an effect's function sees it: good for the time of the call. Needs the interpreter's lock.
class DriveObject {
 public:
  explicit DriveObject(const gap::Drive& drive) : drive_(&drive) {}
  // The call is over.
  void close() { drive_ = nullptr; }
  // Throws InvalidArgument after the call.
  [[nodiscard]] const gap::Drive& drive() const {
    check::that(drive_ != nullptr, "drive", "to be used during the call that it was given to: keep its arrays instead");
    return *drive_;
  }

 private:
  const gap::Drive* drive_;
};

// A function that may be copied and dropped without the interpreter's lock.
std::shared_ptr<py::function> kept(const py::function& function) {
  return {new py::function(function), [](py::function* held) {
            const py::gil_scoped_acquire lock;
            delete held;
          }};
}

// Closes the drive whatever happens.
class OpenDrive {
 public:
  explicit OpenDrive(const Drive& drive) : object_(std::make_shared<DriveObject>(drive)) {}
  ~OpenDrive() { object_->close(); }
  OpenDrive(const OpenDrive&) = delete;
  OpenDrive& operator=(const OpenDrive&) = delete;
  [[nodiscard]] const std::shared_ptr<DriveObject>& object() const { return object_; }

 private:
  std::shared_ptr<DriveObject> object_;
};

// What an effect adds, as Python makes it: arrays, or None for zeros.
struct ColumnObject {
  std::vector<std::optional<Doubles>> effort, effort_rate;
  std::optional<Doubles> forward, lateral, yaw;
};

Eigen::VectorXd signal(const std::optional<Doubles>& array, Eigen::Index rows, const std::string& what) {
  if (!array) {
    return {};
  }
  const auto v = values(*array, what, rows);
  for (const double each : v) {
    check::finite(each, what);
  }
  return Eigen::Map<const Eigen::VectorXd>(v.data(), rows);
}

std::vector<Eigen::VectorXd> signals(const std::vector<std::optional<Doubles>>& arrays, const Drive& drive,
                                     const std::string& what) {
  check::that(arrays.size() <= drive.model.n(), what, "one signal for each output, " + std::to_string(drive.model.n()));
  std::vector<Eigen::VectorXd> out;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    out.push_back(signal(arrays[i], drive.rows(), what + "[" + std::to_string(i) + "]"));
  }
  return out;
}

// `columns(drive, shape)` as Effect::columns: called with the interpreter's lock, from whatever thread. What it returns
// is checked: as many columns as `count`, signals of one value per instant, finite.
std::function<std::vector<gap::Column>(const Drive&, std::span<const double>)> columns_in_python(
    const std::string& name, const py::function& columns, std::size_t count) {
  return [name, count, function = kept(columns)](const Drive& drive, std::span<const double> shape) {
    const py::gil_scoped_acquire lock;
    const OpenDrive open(drive);
    const py::object made = (*function)(open.object(), copy(std::vector<double>(shape.begin(), shape.end())));
    std::vector<gap::Column> out;
    for (const py::handle each : made) {
      if (!py::isinstance<ColumnObject>(each)) {
        throw InvalidArgument("effect " + name + " returned " + py::repr(each).cast<std::string>() +
                              ": expected a sequence of Column");
      }
      const auto& column = each.cast<const ColumnObject&>();
      const std::string what = "effect " + name + ", column " + std::to_string(out.size()) + ", ";
      out.push_back(
          {signals(column.effort, drive, what + "effort"), signals(column.effort_rate, drive, what + "effort_rate"),
           signal(column.forward, drive.rows(), what + "forward"),
           signal(column.lateral, drive.rows(), what + "lateral"), signal(column.yaw, drive.rows(), what + "yaw")});
    }
    check::that(out.size() == count, "effect " + name + " returned " + std::to_string(out.size()) + " columns",
                "one for each parameter, " + std::to_string(count));
    return out;
  };
}

// `applies(drive)` as Effect::applies: it returns None, or the reason why not.
std::function<gap::Applicability(const Drive&)> applies_in_python(const py::function& applies) {
  return [function = kept(applies)](const Drive& drive) -> gap::Applicability {
    const py::gil_scoped_acquire lock;
    const OpenDrive open(drive);
    const py::object reason = (*function)(open.object());
    return reason.is_none() ? gap::Applicability{} : gap::Applicability{false, reason.cast<std::string>()};
  };
}

Effect make_effect(const std::string& name, const py::function& columns, std::vector<gap::EffectParameter> parameters,
                   std::vector<ShapeParameter> shapes, const std::string& sentence, const std::string& family,
                   bool parametric, bool unit_coefficient, const std::string& excite,
                   const std::optional<py::function>& applies) {
  Effect effect;
  effect.name = name;
  effect.sentence = sentence;
  effect.family = family;
  effect.parametric = parametric;
  effect.unit_coefficient = unit_coefficient;
  effect.excite = excite;
  check::that(unit_coefficient || !parameters.empty(), "effect " + name, "at least one parameter");
  effect.columns = columns_in_python(name, columns, unit_coefficient ? 1 : parameters.size());
  effect.parameters = std::move(parameters);
  effect.shapes = std::move(shapes);
  if (applies) {
    effect.applies = applies_in_python(*applies);
  }
  gap::validate(effect);
  return effect;
}

// A part of a drive, which knows whether the drive is still there.
template <int kind>
struct Part {
  std::shared_ptr<DriveObject> owner;
  std::size_t index = 0;
};
using JointObject = Part<0>;
using CoordinateObject = Part<1>;

py::array rests(const gap::Mask& mask) {
  py::array_t<bool> out(mask.size());
  std::copy(mask.data(), mask.data() + mask.size(), out.mutable_data());
  return out;
}

void bind_drive(py::module_& m) {
  py::class_<JointObject> joint(m, "JointSignals", "One wheel of a drive; arrays are copies of shape (rows,).");
  const auto of_joint = [&joint](const char* name, Eigen::VectorXd JointSignals::*member, const char* doc) {
    joint.def_property_readonly(
        name, [member](const JointObject& j) { return copy(j.owner->drive().joints[j.index].*member); }, doc);
  };
  of_joint("speed", &JointSignals::speed, "as measured, rad/s");
  of_joint("smooth_speed", &JointSignals::smooth_speed, "rad/s");
  of_joint("smooth_acceleration", &JointSignals::smooth_acceleration, "rad/s^2");
  of_joint("angle", &JointSignals::angle, "rad");
  of_joint("effort", &JointSignals::effort, "unit of the log's efforts");
  of_joint("smooth_effort", &JointSignals::smooth_effort, "unit of the log's efforts");
  of_joint("predicted_effort", &JointSignals::predicted_effort, "of the base model on the smooth motion");
  of_joint("expected_effort", &JointSignals::expected_effort, "predicted_effort, or with what causes add to it");
  joint.def_property_readonly(
      "resting", [](const JointObject& j) { return rests(j.owner->drive().joints[j.index].resting); },
      "whether it stands still, bool");
  py::class_<CoordinateObject> coordinate(m, "CoordinateSignals",
                                          "One motion coordinate (v1 in m/s, v2 in rad/s); arrays are copies.");
  const auto of_coordinate = [&coordinate](const char* name, Eigen::VectorXd gap::CoordinateSignals::*member,
                                           const char* doc) {
    coordinate.def_property_readonly(
        name, [member](const CoordinateObject& c) { return copy(c.owner->drive().coordinates[c.index].*member); }, doc);
  };
  of_coordinate("speed", &gap::CoordinateSignals::speed, "as measured");
  of_coordinate("smooth_speed", &gap::CoordinateSignals::smooth_speed, "smoothed");
  of_coordinate("smooth_acceleration", &gap::CoordinateSignals::smooth_acceleration, "smoothed, per s");

  py::class_<DriveObject, std::shared_ptr<DriveObject>> drive(
      m, "Drive",
      "A log as effects see it: evenly sampled, `rows` instants. Good during the call that it was given to; arrays are "
      "copies of shape (rows,) that may be kept.");
  const auto number = [&drive](const char* name, double Drive::*member, const char* doc) {
    drive.def_property_readonly(
        name, [member](const DriveObject& d) { return d.drive().*member; }, doc);
  };
  const auto array = [&drive](const char* name, Eigen::VectorXd Drive::*member, const char* doc) {
    drive.def_property_readonly(
        name, [member](const DriveObject& d) { return copy(d.drive().*member); }, doc);
  };
  number("wheel_radius", &Drive::wheel_radius, "m (0 for other than wheeled robots)");
  number("track_width", &Drive::track_width, "m");
  number("lever_arm", &Drive::lever_arm, "of the difference channel, m");
  number("step", &Drive::step, "s");
  array("t", &Drive::t, "s");
  array("x", &Drive::x, "m; empty where the log has no pose");
  array("y", &Drive::y, "m; empty where the log has no pose");
  array("heading", &Drive::heading, "rad, unwrapped; empty where the log has none");
  array("gyro", &Drive::gyro, "yaw rate, rad/s; empty where the log has none");
  drive.def_property_readonly("rows", [](const DriveObject& d) { return d.drive().rows(); })
      .def_property_readonly("has_pose", [](const DriveObject& d) { return d.drive().has_pose(); })
      .def_property_readonly("outputs", [](const DriveObject& d) { return d.drive().model.outputs; })
      .def_property_readonly(
          "segment_starts",
          [](const DriveObject& d) {
            const auto& starts = d.drive().segment_starts;
            return copy(std::vector<std::int64_t>(starts.begin(), starts.end()));
          },
          "rows at which segments begin")
      .def_property_readonly("joints",
                             [](const std::shared_ptr<DriveObject>& d) {
                               std::vector<JointObject> out;
                               for (std::size_t i = 0; i < d->drive().joints.size(); ++i) {
                                 out.push_back({d, i});
                               }
                               return out;
                             })
      .def_property_readonly("coordinates",
                             [](const std::shared_ptr<DriveObject>& d) {
                               std::vector<CoordinateObject> out;
                               for (std::size_t i = 0; i < d->drive().coordinates.size(); ++i) {
                                 out.push_back({d, i});
                               }
                               return out;
                             })
      .def(
          "physical", [](const DriveObject& d, const std::string& name) { return d.drive().physical(name); },
          py::arg("name"), "The physical parameter of the base model, e.g. 'mass' (kg); 0 where there is none.");
}

void bind_effect(py::module_& m) {
  bind_drive(m);
  using Signals = std::vector<std::optional<Doubles>>;
  using Signal = std::optional<Doubles>;
  py::class_<ColumnObject>(m, "Column",
                           "What an effect adds per unit of one of its parameters: one value per instant of the drive, "
                           "not filtered (the toolkit filters it). None stands for zeros.")
      .def(py::init([](Signals effort, Signals effort_rate, Signal forward, Signal lateral, Signal yaw) {
             return ColumnObject{std::move(effort), std::move(effort_rate), std::move(forward), std::move(lateral),
                                 std::move(yaw)};
           }),
           py::arg("effort") = Signals{}, py::arg("effort_rate") = Signals{}, py::kw_only(),
           py::arg("forward") = std::nullopt, py::arg("lateral") = std::nullopt, py::arg("yaw") = std::nullopt,
           "effort: for each output (sum, difference) the effort that is asked for in addition (15), shape (rows,). "
           "effort_rate: signals whose time derivative is such an effort. forward, lateral (m/s), yaw (rad/s): body "
           "velocity that the wheels do not show.");
  py::class_<gap::EffectParameter>(m, "EffectParameter",
                                   "A coefficient of an effect: what multiplies one of its columns.")
      .def(py::init([](std::string name, std::string unit, int sign) {
             return gap::EffectParameter{std::move(name), std::move(unit), sign};
           }),
           py::arg("name"), py::arg("unit"), py::arg("sign") = 0,
           "sign: 1 where physics wants it >= 0, -1 for <= 0, 0 for either.")
      .def_readonly("name", &gap::EffectParameter::name)
      .def_readonly("unit", &gap::EffectParameter::unit)
      .def_readonly("sign", &gap::EffectParameter::sign);
  py::class_<ShapeParameter>(m, "ShapeParameter", "A parameter on which an effect's columns depend nonlinearly.")
      .def(py::init(
               [](std::string name, std::string unit, double lower, double upper, std::size_t scan, bool logarithmic) {
                 ShapeParameter shape;
                 shape.name = std::move(name);
                 shape.unit = std::move(unit);
                 shape.lower = lower;
                 shape.upper = upper;
                 shape.scan = scan;
                 shape.logarithmic = logarithmic;
                 return shape;
               }),
           py::arg("name"), py::arg("unit"), py::arg("lower"), py::arg("upper"), py::arg("scan") = 5,
           py::arg("logarithmic") = false, "scan: points of the grid, between the bounds, on which a search begins.")
      .def_readonly("name", &ShapeParameter::name)
      .def_readonly("unit", &ShapeParameter::unit)
      .def_readonly("lower", &ShapeParameter::lower)
      .def_readonly("upper", &ShapeParameter::upper);
  py::class_<Effect>(m, "Effect", "An unmodelled effect: of the catalogue, or a user's own.")
      .def(py::init(&make_effect), py::arg("name"), py::arg("columns"),
           py::arg("parameters") = std::vector<gap::EffectParameter>{},
           py::arg("shapes") = std::vector<ShapeParameter>{}, py::kw_only(), py::arg("sentence") = "",
           py::arg("family") = "", py::arg("parametric") = false, py::arg("unit_coefficient") = false,
           py::arg("excite") = "", py::arg("applies") = std::nullopt,
           "columns(drive, shape) returns a Column for each of `parameters`, at the values `shape` of `shapes`; it is "
           "called often, from any thread, with the interpreter's lock. applies(drive) returns None, or why the effect "
           "cannot be looked for. family: of effects that are the same cause. unit_coefficient: one column whose "
           "coefficient is 1; only the shapes are estimated.")
      .def_readonly("name", &Effect::name)
      .def_readonly("sentence", &Effect::sentence)
      .def_readonly("family", &Effect::family)
      .def_readonly("parametric", &Effect::parametric)
      .def_readonly("parameters", &Effect::parameters)
      .def_readonly("shapes", &Effect::shapes)
      .def("__repr__", [](const Effect& e) { return "<wheelwright.Effect " + e.name + ">"; });
  m.def(
      "effect_catalogue",
      [](const RobotObject* robot) {
        return robot != nullptr ? gap::effect_catalogue(model::make_model(robot->robot)) : gap::effect_catalogue();
      },
      py::arg("robot") = nullptr,
      "The effects that gap() looks for, for a robot (by default on two driven wheels). One that may follow one of "
      "several "
      "laws is there once for each, with other columns.");
}

using gap::GapEstimate;

struct DiagnosisObject {
  Diagnosis diagnosis;
  gap::NextDrive next;
  Json json;
};

// A residual series that keeps its diagnosis alive.
struct SeriesObject {
  std::shared_ptr<const DiagnosisObject> owner;
  std::size_t index = 0;
  [[nodiscard]] const gap::ResidualSeries& series() const { return owner->diagnosis.series[index]; }
};

// The first `own` are the catalogue's, in which an effect of several laws stands several times.
void check_names(const std::vector<std::string>& without, const std::vector<Effect>& catalogue, std::size_t own) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < catalogue.size(); ++k) {
    const bool met = std::ranges::find(names, catalogue[k].name) != names.end();
    check::that(k < own || !met, "effect " + catalogue[k].name, "each name once");
    if (!met) {
      names.push_back(catalogue[k].name);
    }
  }
  for (const std::string& name : without) {
    if (std::ranges::find(names, name) == names.end()) {
      throw InputError("without " + files::shown(name) + ": no effect of the catalogue: expected one of " +
                       core::listed(names) + files::did_you_mean(name, names));
    }
  }
}

std::shared_ptr<DiagnosisObject> gap(LogObject& log, const RobotObject& robot, LogObject* baseline, LogObject* fresh,
                                     const std::vector<Effect>& effects, const std::vector<std::string>& without,
                                     const std::optional<double>& beta, bool shrink, bool manoeuvre, std::uint64_t seed,
                                     std::size_t threads, py::object progress) {
  std::vector<Effect> catalogue = gap::effect_catalogue(model::make_model(robot.robot));
  const std::size_t own = catalogue.size();
  catalogue.insert(catalogue.end(), effects.begin(), effects.end());
  check_names(without, catalogue, own);
  gap::DiagnoseOptions options;
  options.catalogue = catalogue;
  options.without = without;
  options.beta = beta;
  options.shrink = shrink;
  options.seed = seed;
  options.threads = threads;
  LongWork work(std::move(progress));
  options.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    const Robot measured = model::with_column_errors(robot.robot, logs::interpolation_errors(log.source->report()));
    logs::require_columns(*log.source, gap::required_columns(*log.source, robot.robot));
    WatchedLog source(*log.source, work);
    std::optional<LogWalk> healthy_walk;
    std::optional<WatchedLog> healthy_source;
    if (baseline != nullptr) {
      healthy_walk.emplace(*baseline);
      logs::require_columns(*baseline->source, gap::required_columns(*baseline->source, robot.robot));
      healthy_source.emplace(*baseline->source, work);
    }
    LogSource* const healthy = healthy_source ? &*healthy_source : nullptr;
    auto out = std::make_shared<DiagnosisObject>();
    Diagnosis& d = out->diagnosis;
    d = diagnose(source, healthy, measured, options);
    if (fresh != nullptr) {
      const LogWalk fresh_walk(*fresh);
      logs::require_columns(*fresh->source, gap::required_columns(*fresh->source, robot.robot));
      WatchedLog fresh_source(*fresh->source, work);
      d.shrink.fresh_torque_rms = gap::torque_on(fresh_source, healthy, measured, d, options);
    }
    if (manoeuvre) {
      out->next = gap::what_next(source, healthy, measured, d, options);
    }
    for (std::vector<std::string>* texts : {&d.notes, &d.not_excited}) {
      for (std::string& text : *texts) {
        text = words::in_words(text, catalogue);
      }
    }
    out->next.sentence = words::in_words(out->next.sentence, catalogue);
    const std::string promise = out->next.commands ? out->next.sentence : "";
    if (d.summary.empty()) {
      d.summary = words::gap_verdict(d);
      for (const std::string& sentence : words::gap_sentences(d, promise)) {
        d.summary += " " + sentence;
      }
    }
    results::GapFiles files;
    files.robot = robot.path;
    files.logs = log.paths();
    files.baseline = baseline != nullptr ? baseline->name() : "";
    files.software = results::software();
    if (out->next.commands) {
      files.next_manoeuvre = results::NextManoeuvre{"", promise};
    }
    out->json = results::to_json(d, files);
    out->json["improved"] = nullptr;
    results::add_rivals(out->json, out->next);
    return out;
  });
}

void bind_cause(py::module_& m) {
  py::class_<GapEstimate>(m, "GapEstimate", "A number with its 95 % interval.")
      .def_readonly("name", &GapEstimate::name)
      .def_readonly("unit", &GapEstimate::unit)
      .def_readonly("estimate", &GapEstimate::estimate)
      .def_readonly("lower", &GapEstimate::lower)
      .def_readonly("upper", &GapEstimate::upper)
      .def("__repr__", [](const GapEstimate& e) {
        return "<wheelwright.GapEstimate " + e.name + ": " + words::estimate_words(e) + ">";
      });
  const auto by_name = [](const std::vector<GapEstimate>& parameters) {
    py::dict out;
    for (const GapEstimate& e : parameters) {
      out[py::str(e.name)] = e;
    }
    return out;
  };
  py::class_<gap::GapLaw>(m, "GapLaw", "An effect that a cause may be, as fitted in its place.")
      .def_readonly("effect", &gap::GapLaw::effect)
      .def_readonly("sentence", &gap::GapLaw::sentence)
      .def_property_readonly(
          "parameters", [by_name](const gap::GapLaw& law) { return by_name(law.parameters); }, "by name")
      .def("__repr__", [](const gap::GapLaw& law) { return "<wheelwright.GapLaw " + law.effect + ">"; });
  py::class_<gap::GapCause>(m, "GapCause", "One cause of the best combination.")
      .def_readonly("effect", &gap::GapCause::effect)
      .def_readonly("family", &gap::GapCause::family, "shared by effects that are one cause; empty: none")
      .def_readonly("laws", &gap::GapCause::laws,
                    "effects of the family between which the log does not tell, `effect` first; empty: no other one")
      .def_readonly("sentence", &gap::GapCause::sentence)
      .def_readonly("parametric", &gap::GapCause::parametric)
      .def_readonly("share", &gap::GapCause::share, "of the gap (Shapley value over the combination)")
      .def_property_readonly(
          "parameters", [by_name](const gap::GapCause& c) { return by_name(c.parameters); }, "by name")
      .def("__repr__", [](const gap::GapCause& c) { return "<wheelwright.GapCause " + c.effect + ">"; });
  py::class_<SeriesObject> series(m, "ResidualSeries",
                                  "Residuals of one channel on the rows that the analysis used; read-only views of "
                                  "shape (rows,), empty where there is none.");
  series
      .def_property_readonly(
          "space",
          [](const SeriesObject& s) { return s.series().space == gap::GapSpace::dynamic ? "dynamic" : "kinematic"; })
      .def_property_readonly("channel", [](const SeriesObject& s) { return s.series().channel; })
      .def_property_readonly("unit", [](const SeriesObject& s) { return s.series().unit; })
      .def_property_readonly(
          "floor", [](const SeriesObject& s) { return s.series().floor; }, "standard deviation of the noise");
  const auto array = [&series](const char* name, Eigen::VectorXd gap::ResidualSeries::*member, const char* doc) {
    series.def_property_readonly(
        name,
        [member](const py::object& self) { return view(self.cast<const SeriesObject&>().series().*member, self); },
        doc);
  };
  array("t", &gap::ResidualSeries::t, "s");
  array("signal", &gap::ResidualSeries::signal, "the left side: filtered effort, or increment of the pose");
  array("nominal", &gap::ResidualSeries::nominal, "left by the nominal model");
  array("refitted", &gap::ResidualSeries::refitted, "left by the model with theta fitted again");
  array("after", &gap::ResidualSeries::after, "left with the causes");
}

}  // namespace

Json diagnosis_json(const py::handle& object) {
  check::that(py::isinstance<DiagnosisObject>(object), "gap", "a Diagnosis or the path of a gap.json");
  return object.cast<const DiagnosisObject&>().json;
}

void bind_gap(py::module_& m) {
  bind_effect(m);
  bind_cause(m);
  py::class_<DiagnosisObject, std::shared_ptr<DiagnosisObject>> diagnosis(
      m, "Diagnosis", "The sim-to-real gap of a robot: gap.json and the numbers behind it.");
  diagnosis
      .def_property_readonly(
          "verdict", [](const DiagnosisObject& d) { return std::string(gap::to_string(d.diagnosis.verdict)); },
          "no_gap, explained, ambiguous or unexplained")
      .def_property_readonly("summary", [](const DiagnosisObject& d) { return d.diagnosis.summary; })
      .def_property_readonly(
          "causes", [](const DiagnosisObject& d) { return d.diagnosis.causes; }, "largest share first")
      .def_property_readonly(
          "gap", [](const DiagnosisObject& d) { return d.diagnosis.gap; },
          "what the nominal model leaves above the noise floor, share of the efforts' mean square")
      .def_property_readonly(
          "structural", [](const DiagnosisObject& d) { return d.diagnosis.structural; },
          "the part of it that stays after theta is fitted again")
      .def_property_readonly(
          "remaining", [](const DiagnosisObject& d) { return d.diagnosis.remaining; },
          "share of the gap that the causes leave")
      .def_property_readonly("notes", [](const DiagnosisObject& d) { return d.diagnosis.notes; })
      .def_property_readonly(
          "theta", [](const DiagnosisObject& d) { return copy(d.diagnosis.theta); },
          "with the causes beside it, shape (p,)")
      .def_property_readonly(
          "series",
          [](const std::shared_ptr<DiagnosisObject>& d) {
            std::vector<SeriesObject> out;
            for (std::size_t i = 0; i < d->diagnosis.series.size(); ++i) {
              out.push_back({d, i});
            }
            return out;
          },
          "residuals of each channel, for pictures")
      .def_property_readonly(
          "improved",
          [](const DiagnosisObject& d) {
            return d.diagnosis.improved ? std::optional<RobotObject>(RobotObject{*d.diagnosis.improved, ""})
                                        : std::nullopt;
          },
          "the robot with its causes, where a robot file can carry them; else None")
      .def_property_readonly(
          "next_commands",
          [](const DiagnosisObject& d) {
            return d.next.commands ? std::optional<py::dict>(arrays_of(*d.next.commands)) : std::nullopt;
          },
          "wheel-speed commands of the drive that would tell the causes apart, by name; None where there is none")
      .def(
          "to_dict", [](const DiagnosisObject& d) { return to_python(d.json); },
          "The content of gap.json (results/gap.schema.json).")
      .def(
          "save", [](const DiagnosisObject& d, const std::filesystem::path& path) { files::write_json(path, d.json); },
          py::arg("path"), "Writes gap.json, whole or not at all.");
  tables_of(diagnosis);
  for (const char* key :
       {"credible_set", "confusable", "where", "shrink", "parametric", "contradictions", "next_manoeuvre",
        "not_excited", "visible", "healthy_misfit", "floor_error", "floor_origin"}) {
    diagnosis.def_property_readonly(
        key, [key](const DiagnosisObject& d) { return to_python(d.json[key]); }, "as in gap.json");
  }
  m.def("gap", &gap, py::arg("log"), py::arg("robot"), py::kw_only(), py::arg("baseline") = nullptr,
        py::arg("fresh") = nullptr, py::arg("effects") = std::vector<Effect>{},
        py::arg("without") = std::vector<std::string>{}, py::arg("beta") = std::nullopt, py::arg("shrink") = true,
        py::arg("manoeuvre") = true, py::arg("seed") = 1, py::arg("threads") = 1, py::arg("progress") = py::none(),
        "Diagnoses the gap between the model of a robot and a log of it, as `wheelwright gap` does.\n\n"
        "baseline: a log of the same robot when it was healthy. fresh: another log of it as it is now. effects: a "
        "user's own, looked for beside the catalogue's. without: names that are not looked for. beta: of the filter, "
        "1/s. shrink: measure how far the gap shrinks (most of the time). manoeuvre: design a drive where causes "
        "cannot be told apart. The result does not depend on `threads`.\n\n"
        "The interpreter's lock is released, and taken for effects written in Python; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python
