// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "commission/margin_survey.hpp"
#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "commission/watch/other_parameters.hpp"
#include "core/check.hpp"
#include "detector/online_model.hpp"
#include "formats/robots/robot_file.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "results/detection_json.hpp"
#include "results/margins_json.hpp"
#include "results/software.hpp"
#include "results/words/detect_summary.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::python {
namespace {

// K instants with a decision, n outputs each. Matrices are K × n in memory, rows one after the other.
struct DetectorRun {
  std::vector<double> t;          // s
  std::vector<std::int64_t> row;  // of the log
  std::vector<double> residual, predicted, lower, upper, dead_zone;
  std::vector<std::uint8_t> outside, alarm;
  std::vector<detector::Event> events;
  std::size_t outputs = 0;
};

// Walks `log` through `detector` from its beginning, as detect() does. Throws InvalidArgument when the log lacks a
// column.
DetectorRun run_detector(LogSource& log, TorqueDetector& detector, double merge) {
  DetectorRun run;
  run.outputs = detector.filter().model().n();
  detector::EventRecorder recorder(run.outputs, merge);
  commission::walk_detector(log, detector, [&](std::size_t row, double t, bool, const Decision& decision) {
    run.t.push_back(t);
    run.row.push_back(static_cast<std::int64_t>(row));
    for (std::size_t i = 0; i < run.outputs; ++i) {
      const detector::ChannelDecision& c = decision.channels[i];
      run.residual.push_back(c.residual);
      run.predicted.push_back(c.predicted);
      run.lower.push_back(c.threshold.lower);
      run.upper.push_back(c.threshold.upper);
      run.dead_zone.push_back(c.dead_zone);
      run.outside.push_back(c.outside ? 1 : 0);
      run.alarm.push_back(c.alarm ? 1 : 0);
      recorder.add(i, row, t, c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm);
    }
  });
  run.events = recorder.events();
  return run;
}

constexpr double kMerge = 0.5;  // s, as detect()

}  // namespace

detector::DetectorOptions options_of(const std::string& set, const std::string& test, const Rule& persistence,
                                     const std::string& residual) {
  check::that(set == "polytope" || set == "box", "set '" + set + "'", "polytope or box");
  check::that(test == "two_sided" || test == "symmetric", "test '" + test + "'", "two_sided or symmetric");
  check::that(residual == "d1" || residual == "d2", "residual '" + residual + "'", "d1 or d2");
  detector::DetectorOptions options;
  options.residual = residual == "d2" ? detector::Residual::d2 : detector::Residual::d1;
  options.set = set == "box" ? detector::ParameterSetKind::box : detector::ParameterSetKind::polytope;
  options.test = test == "symmetric" ? detector::Test::symmetric : detector::Test::two_sided;
  if (persistence) {
    options.persistence = detector::Persistence{persistence->first, persistence->second};
  }
  return options;
}

namespace {

// An event with the name of its channel.
struct EventObject {
  detector::Event event;
  std::string output;
};

std::vector<EventObject> named(const std::vector<detector::Event>& events, const std::vector<std::string>& outputs) {
  std::vector<EventObject> out;
  for (const detector::Event& event : events) {
    out.push_back({event, outputs[event.output]});
  }
  return out;
}

struct RunObject {
  DetectorRun run;
  std::vector<std::string> outputs, units;
};

struct DetectorObject {
  ModelObject model;
  TorqueDetector detector;
};

// Fields of the last decision, as a robot would read them.
struct DecisionObject {
  bool fault = false;
  std::vector<double> residual, predicted, lower, upper, rho, dead_zone;
  std::vector<std::uint8_t> outside, alarm;
};

py::array flags(const std::vector<std::uint8_t>& v, std::vector<py::ssize_t> shape, py::handle owner) {
  static_assert(sizeof(bool) == sizeof(std::uint8_t));
  return view(reinterpret_cast<const bool*>(v.data()), std::move(shape), owner);
}

py::object step(DetectorObject& d, double t, const Doubles& sample) {
  const auto columns = static_cast<py::ssize_t>(d.detector.filter().measurement().columns().size());
  const Decision& decision = d.detector.step(t, values(sample, "sample", columns));
  if (!decision.valid) {
    return py::none();
  }
  DecisionObject out;
  out.fault = decision.fault;
  for (const detector::ChannelDecision& c : decision.channels) {
    out.residual.push_back(c.residual);
    out.predicted.push_back(c.predicted);
    out.lower.push_back(c.threshold.lower);
    out.upper.push_back(c.threshold.upper);
    out.rho.push_back(c.threshold.rho());
    out.dead_zone.push_back(c.dead_zone);
    out.outside.push_back(c.outside ? 1 : 0);
    out.alarm.push_back(c.alarm ? 1 : 0);
  }
  return py::cast(std::move(out));
}

RunObject run_through(const DetectorObject& d, LogObject& log, py::object progress) {
  LongWork work(std::move(progress));
  Detector detector = d.detector;  // the stream of step() goes on where it was
  return work.run([&] {
    const LogWalk walk(log);
    WatchedLog source(*log.source, work);
    const Model& model = d.model.model->model;
    return RunObject{run_detector(source, detector, kMerge), model.outputs, model.output_units};
  });
}

struct DetectionObject {
  ModelObject model;
  std::string log;
  Detection detection;
  commission::KinematicWatch kinematic;
  std::vector<detector::Isolation> isolations;
  commission::RiskWatch at_risk;
  std::vector<detector::Incident> incidents;
  std::string undecided;
  double undecided_share = 0.0;
  bool asked_other = false;
  std::optional<commission::OtherParameters> other{};

  [[nodiscard]] bool fault() const {
    return !detection.events.empty() || !at_risk.events.empty() ||
           (kinematic.detection && !kinematic.detection->events.empty());
  }
  [[nodiscard]] Json json() const {
    Json json = results::to_json(detection, *model.model, model.path, log, results::software());
    results::add_isolation(json, isolations);
    results::add_kinematic(json, kinematic, *model.model);
    results::add_at_risk(json, at_risk, *model.model);
    if (detection.residual == detector::Residual::d1) {
      results::add_incidents(json, incidents);
    }
    if (asked_other) {
      results::add_other_parameters(json, other);
    }
    results::add_undecided(json, undecided, undecided_share);
    return json;
  }
  [[nodiscard]] std::string summary() const {
    return words::summary(other) + words::summary(incidents) + words::summary(detection, *model.model) +
           words::summary(at_risk, *model.model) + words::summary(kinematic, *model.model);
  }
};

DetectionObject detect_in(LogObject& log, const ModelObject& given, const std::string& set, const std::string& test,
                          const Rule& persistence, std::size_t threads, const std::string& residual,
                          py::object progress) {
  LongWork work(std::move(progress));
  const detector::DetectorOptions options = options_of(set, test, persistence, residual);
  return work.run([&] {
    auto model = std::make_shared<OnlineModel>(detector::decided_by(*given.model, options.residual));
    model->persistence = options.persistence.value_or(model->persistence);
    if (model->kinematic) {
      model->kinematic->persistence = options.persistence.value_or(model->kinematic->persistence);
    }
    detector::DetectorOptions own = options;
    own.persistence.reset();
    const LogWalk walk(log);
    logs::require_columns(*log.source, model->measurement.columns());
    WatchedLog source(*log.source, work);
    DetectionObject out{{model, given.path}, log.name(), {}, {}, {}, {}, {}, {}, 0.0, false, {}};
    const auto tell = work.teller();
    tell("the torque residual", 0.0);
    out.detection = detect(source, make_detector(*model, own));
    tell("the kinematic residual", 0.4);
    out.kinematic = commission::watch_kinematics(source, *model, own);
    tell("sums at a stated risk", 0.6);
    out.at_risk = commission::watch_at_risk(source, *model);
    const bool proves = options.residual == detector::Residual::d1;  // isolation stands on bounds
    if (proves) {
      tell("what the events can be", 0.8);
      commission::EventIsolationOptions isolation;
      isolation.isolation.threads = threads;
      out.isolations = commission::isolate_events(source, *model, out.detection, isolation);
      out.incidents = commission::join_events(source, *model, out.detection, out.isolations, out.kinematic, isolation);
      commission::explain_courses(source, *model, out.detection, out.kinematic, out.incidents,
                                  isolation.isolation.threads);
    }
    out.asked_other = proves && (!out.detection.events.empty() ||
                                 (out.kinematic.detection && !out.kinematic.detection->events.empty()));
    if (out.asked_other) {
      out.other = commission::explained_by_other_parameters(source, *model, out.detection, out.kinematic);
    }
    const logs::LogReport& read = log.source->report();
    out.undecided = words::why_not_decided(out.detection, *model, read.rows, log.source->median_step(), read.rows_read,
                                           logs::sentences(read));
    out.undecided_share = undecided_share(out.detection, *model, log.source->median_step(), read.rows_read);
    tell("done", 1.0);
    return out;
  });
}

void bind_event(py::module_& m) {
  py::class_<EventObject>(m, "Event", "One fault event in one channel. Times in s.")
      .def_property_readonly("output", [](const EventObject& e) { return e.output; })
      .def_property_readonly(
          "start", [](const EventObject& e) { return e.event.start; }, "first instant outside the threshold")
      .def_property_readonly(
          "alarm", [](const EventObject& e) { return e.event.alarm; }, "when the persistence rule was satisfied")
      .def_property_readonly(
          "end", [](const EventObject& e) { return e.event.end; }, "last instant outside")
      .def_property_readonly("peak_time", [](const EventObject& e) { return e.event.peak_time; })
      .def_property_readonly(
          "peak_residual", [](const EventObject& e) { return e.event.peak_residual; }, "unit of the output")
      .def_property_readonly(
          "peak_ratio", [](const EventObject& e) { return e.event.peak_ratio; },
          "distance from the middle of [l, u] over half its width, > 1")
      .def_property_readonly("instants", [](const EventObject& e) { return e.event.instants; })
      .def_property_readonly(
          "start_row", [](const EventObject& e) { return e.event.start_sample; }, "row of the log")
      .def("__repr__", [](const EventObject& e) {
        return "<wheelwright.Event in " + e.output + " at " + std::to_string(e.event.alarm) + " s>";
      });
}

void bind_decision(py::module_& m) {
  const auto numbers = [](auto member) {
    return [member](const py::object& self) { return view(self.cast<const DecisionObject&>().*member, self); };
  };
  const auto truths = [](auto member) {
    return [member](const py::object& self) {
      const auto& v = self.cast<const DecisionObject&>().*member;
      return flags(v, {static_cast<py::ssize_t>(v.size())}, self);
    };
  };
  py::class_<DecisionObject>(m, "Decision", "The decision at one instant; arrays of shape (n,), read-only.")
      .def_readonly("fault", &DecisionObject::fault, "an alarm stands in some channel")
      .def_property_readonly("residual", numbers(&DecisionObject::residual), "(29)")
      .def_property_readonly("predicted", numbers(&DecisionObject::predicted), "Y_f theta (30)")
      .def_property_readonly("lower", numbers(&DecisionObject::lower), "l <= residual without a fault")
      .def_property_readonly("upper", numbers(&DecisionObject::upper), "residual <= u without a fault")
      .def_property_readonly("rho", numbers(&DecisionObject::rho), "max(u, -l) (34)")
      .def_property_readonly("dead_zone", numbers(&DecisionObject::dead_zone),
                             "D1 (35) or D2 (39): |residual| outside the threshold, else 0")
      .def_property_readonly("outside", truths(&DecisionObject::outside))
      .def_property_readonly("alarm", truths(&DecisionObject::alarm));
}

void bind_run(py::module_& m) {
  const auto numbers = [](auto member) {
    return [member](const py::object& self) {
      const auto& o = self.cast<const RunObject&>();
      return view((o.run.*member).data(),
                  {static_cast<py::ssize_t>(o.run.t.size()), static_cast<py::ssize_t>(o.run.outputs)}, self);
    };
  };
  const auto truths = [](auto member) {
    return [member](const py::object& self) {
      const auto& o = self.cast<const RunObject&>();
      return flags(o.run.*member, {static_cast<py::ssize_t>(o.run.t.size()), static_cast<py::ssize_t>(o.run.outputs)},
                   self);
    };
  };
  py::class_<RunObject> run(
      m, "DetectorRun",
      "Every decision over a log: K instants, n outputs. Arrays are read-only views of shape (K, n) "
      "where nothing else is said.");
  run.def_property_readonly(
         "t", [](const py::object& self) { return view(self.cast<const RunObject&>().run.t, self); }, "s, shape (K,)")
      .def_property_readonly(
          "row",
          [](const py::object& self) {
            const auto& rows = self.cast<const RunObject&>().run.row;
            return view(rows.data(), {static_cast<py::ssize_t>(rows.size())}, self);
          },
          "rows of the log, shape (K,)")
      .def_readonly("outputs", &RunObject::outputs, "names of the n channels")
      .def_readonly("output_units", &RunObject::units, "with torque as effort")
      .def_property_readonly("residual", numbers(&DetectorRun::residual), "(29)")
      .def_property_readonly("predicted", numbers(&DetectorRun::predicted), "Y_f theta (30)")
      .def_property_readonly("lower", numbers(&DetectorRun::lower), "l <= residual without a fault")
      .def_property_readonly("upper", numbers(&DetectorRun::upper), "residual <= u without a fault")
      .def_property_readonly("dead_zone", numbers(&DetectorRun::dead_zone),
                             "D1 (35) or D2 (39): |residual| outside the threshold, else 0")
      .def_property_readonly("outside", truths(&DetectorRun::outside))
      .def_property_readonly("alarm", truths(&DetectorRun::alarm))
      .def_property_readonly(
          "fault", [](const RunObject& o) { return !o.run.events.empty(); }, "whether there is an event")
      .def_property_readonly("events", [](const RunObject& o) { return named(o.run.events, o.outputs); })
      .def("__len__", [](const RunObject& o) { return o.run.t.size(); });
  tables_of(run);
}

}  // namespace

void bind_detector(py::module_& m) {
  bind_event(m);
  bind_decision(m);
  bind_run(m);
  py::class_<DetectorObject>(m, "Detector",
                             "Filter, threshold and decision of the paper's section V. step() has a memory and serves "
                             "one thread at a time; run() has none.")
      .def(py::init([](const ModelObject& model, const std::string& set, const std::string& test,
                       const Rule& persistence, const std::string& residual) {
             return DetectorObject{model, make_detector(*model.model, options_of(set, test, persistence, residual))};
           }),
           py::arg("model"), py::kw_only(), py::arg("set") = "polytope", py::arg("test") = "two_sided",
           py::arg("persistence") = std::nullopt, py::arg("residual") = "d1",
           "set: polytope (the feasible set itself) or box. test: two_sided (l <= residual <= u) or symmetric "
           "(|residual| <= rho, the paper's (35)). persistence: (k, n), an alarm is k of the last n instants outside; "
           "by default the model's. residual: d1, or d2, which decides by the model's constant thresholds, found by "
           "experiment or stated, without guarantee (the paper's (39)); InvalidArgument where it has none.")
      .def_property_readonly(
          "columns", [](const DetectorObject& d) { return d.detector.filter().measurement().columns(); },
          "columns of a sample, in the order of step()")
      .def("step", &step, py::arg("t"), py::arg("sample"),
           "Takes the sample at time t (s), shape (columns,), and decides; None until the filter has settled. A gap of "
           "more than five nominal steps, or a time that does not increase, restarts the filter.")
      .def(
          "restart", [](DetectorObject& d) { d.detector.restart(); }, "Forgets all samples: for a gap in the data.")
      .def("run", &run_through, py::arg("log"), py::kw_only(), py::arg("progress") = py::none(),
           "All decisions over a log, from a fresh start. The interpreter's lock is released.");
  py::class_<DetectionObject> detection(m, "Detection",
                                        "What `wheelwright detect` says of a log: both residuals, and isolation.");
  detection.def_property_readonly("fault", &DetectionObject::fault)
      .def_property_readonly(
          "events", [](const DetectionObject& d) { return named(d.detection.events, d.model.model->model.outputs); },
          "of the torque residual")
      .def_property_readonly(
          "kinematic_events",
          [](const DetectionObject& d) {
            return d.kinematic.detection ? named(d.kinematic.detection->events,
                                                 commission::with_kinematic_outputs(*d.model.model).model.outputs)
                                         : std::vector<EventObject>{};
          },
          "of wheel odometry against pose or gyro")
      .def_property_readonly(
          "incidents",
          [](const DetectionObject& d) {
            py::list list;
            for (const detector::Incident& incident : d.incidents) {
              list.append(to_python(results::to_json(incident)));
            }
            return list;
          },
          "events that one fault explains, as in detection.json")
      .def_readonly(
          "undecided", &DetectionObject::undecided,
          "why the log as a whole was not decided on, so that no fault seen says nothing of it; empty where it "
          "was")
      .def_property_readonly("summary", &DetectionObject::summary)
      .def(
          "to_dict", [](const DetectionObject& d) { return to_python(d.json()); },
          "The content of detection.json (results/detection.schema.json).")
      .def(
          "save",
          [](const DetectionObject& d, const std::filesystem::path& path) { files::write_json(path, d.json()); },
          py::arg("path"), "Writes detection.json, whole or not at all.");
  tables_of(detection);
  m.def("detect", &detect_in, py::arg("log"), py::arg("model"), py::kw_only(), py::arg("set") = "polytope",
        py::arg("test") = "two_sided", py::arg("persistence") = std::nullopt, py::arg("threads") = 1,
        py::arg("residual") = "d1", py::arg("progress") = py::none(),
        "Looks for faults in a log with a commissioned model, as `wheelwright detect` does.\n\n"
        "residual: d1, or d2, as in Detector; with d2 nothing is isolated and nothing said at a risk, which both stand "
        "on bounds.\n\n"
        "The interpreter's lock is released; Ctrl-C ends the work. Raises InputError where the log lacks a column.");
}

using detector::FaultMargins;

namespace {

struct MarginsObject {
  commission::MarginSurvey survey;
  std::string model, log;
  [[nodiscard]] Json json() const { return results::to_json(survey, model, log, results::software()); }
};

std::unique_ptr<MarginsObject> survey(LogObject& log, const ModelObject& model, std::vector<std::string> faults,
                                      const std::optional<std::vector<double>>& windows, double onset_step,
                                      double noise_share, const std::string& set, const Rule& persistence,
                                      std::size_t threads, py::object progress) {
  check::that(set == "polytope" || set == "box", "set '" + set + "'", "polytope or box");
  commission::MarginSurveyOptions options;
  options.faults = std::move(faults);
  options.set = set == "box" ? detector::ParameterSetKind::box : detector::ParameterSetKind::polytope;
  options.margins.windows = windows.value_or(options.margins.windows);
  options.margins.onset_step = onset_step;
  options.margins.noise_share = noise_share;
  options.margins.threads = threads;
  if (persistence) {
    options.persistence = detector::Persistence{persistence->first, persistence->second};
  }
  LongWork work(std::move(progress));
  options.margins.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    logs::require_columns(*log.source, model.model->measurement.columns());
    WatchedLog source(*log.source, work);
    return std::unique_ptr<MarginsObject>(
        new MarginsObject{commission::survey_margins(source, *model.model, options), model.path, log.name()});
  });
}

std::optional<detector::ManoeuvreKind> kind_called(const std::optional<std::string>& name) {
  if (!name) {
    return std::nullopt;
  }
  std::string known;
  for (const detector::ManoeuvreKind kind :
       {detector::ManoeuvreKind::standstill, detector::ManoeuvreKind::cruising, detector::ManoeuvreKind::accelerating,
        detector::ManoeuvreKind::turning, detector::ManoeuvreKind::spinning}) {
    if (detector::manoeuvre_words(kind) == *name) {
      return kind;
    }
    known += (known.empty() ? "" : ", ") + std::string(detector::manoeuvre_words(kind));
  }
  throw InvalidArgument("manoeuvre '" + *name + "': expected one of " + known);
}

void bind_fault(py::module_& m) {
  py::class_<FaultMargins>(m, "FaultMargins",
                           "What a drive is worth for one fault on one side, onset by onset. Sizes are magnitudes in "
                           "`unit` ('1' for a share).")
      .def_property_readonly("fault", [](const FaultMargins& f) { return f.fault.name; })
      .def_property_readonly("sentence", [](const FaultMargins& f) { return f.fault.sentence; })
      .def_property_readonly("unit", [](const FaultMargins& f) { return f.fault.unit; })
      .def_readonly("side", &FaultMargins::side, "1: growing, -1: shrinking")
      .def_property_readonly("largest", &FaultMargins::largest, "the largest size that was looked at")
      .def_property_readonly(
          "t",
          [](const FaultMargins& f) {
            std::vector<double> t;
            for (const detector::OnsetMargin& onset : f.onsets) {
              t.push_back(onset.t);
            }
            return copy(t);
          },
          "onsets, s, shape (onsets,)")
      .def_property_readonly(
          "manoeuvres",
          [](const FaultMargins& f) {
            std::vector<std::string> kinds;
            for (const detector::OnsetMargin& onset : f.onsets) {
              kinds.emplace_back(detector::manoeuvre_words(onset.kind));
            }
            return kinds;
          },
          "what the robot does at each onset, in words")
      .def_property_readonly(
          "certain",
          [](const FaultMargins& f) {
            std::size_t windows = 0;
            for (const detector::OnsetMargin& onset : f.onsets) {
              windows = std::max(windows, onset.certain.size());
            }
            py::array_t<double> out({f.onsets.size(), windows});
            for (std::size_t k = 0; k < f.onsets.size(); ++k) {
              const std::vector<double>& own = f.onsets[k].certain;
              for (std::size_t w = 0; w < windows; ++w) {
                out.mutable_at(k, w) = w < own.size() ? own[w] : std::numeric_limits<double>::quiet_NaN();
              }
            }
            return out;
          },
          "every size from here up is seen for certain within the window: shape (onsets, windows); inf where none is, "
          "NaN where the window runs past the segment's end")
      .def_property_readonly(
          "hidden",
          [](const FaultMargins& f) {
            std::vector<double> hidden;
            for (const detector::OnsetMargin& onset : f.onsets) {
              hidden.push_back(onset.hidden);
            }
            return copy(hidden);
          },
          "no size up to this one raises an alarm within the last window that fits, shape (onsets,)")
      .def(
          "summarise",
          [](const FaultMargins& f, std::size_t window, const std::optional<std::string>& manoeuvre) {
            const detector::MarginSummary s = detector::summarise(f, window, kind_called(manoeuvre));
            py::dict out;
            out["onsets"] = s.onsets;
            out["certain"] = s.certain;
            out["best"] = s.best;
            out["most"] = s.most;
            out["median"] = s.median;
            out["worst"] = s.worst;
            return out;
          },
          py::arg("window"), py::arg("manoeuvre") = std::nullopt,
          "Order statistics of the smallest certain size over the onsets (of one manoeuvre, in words) in window number "
          "`window`: onsets, certain (how many have one), best, most, median, worst.")
      .def("__repr__", [](const FaultMargins& f) {
        return "<wheelwright.FaultMargins of " + f.fault.name + (f.side > 0.0 ? ", growing>" : ", shrinking>");
      });
}

}  // namespace

void bind_margins(py::module_& m) {
  bind_fault(m);
  py::class_<commission::ResidualMargins>(m, "ResidualMargins", "Margins in one residual.")
      .def_readonly("name", &commission::ResidualMargins::name, "torque or kinematic")
      .def_readonly("outputs", &commission::ResidualMargins::outputs, "names of the channels")
      .def_readonly("faults", &commission::ResidualMargins::margins, "each fault and side that this residual can see")
      .def_readonly("blind", &commission::ResidualMargins::blind,
                    "faults that leave no trace in it, whatever their size");
  py::class_<commission::RiskMargins>(m, "RiskMargins", "Margins in sums over scales: certain but for a stated chance.")
      .def_readonly("risk", &commission::RiskMargins::risk, "probability that the set lacks the true parameters")
      .def_readonly("miss", &commission::RiskMargins::miss,
                    "a fault of a certain size is missed with at most this probability")
      .def_readonly("false_alarms", &commission::RiskMargins::false_alarms, "expected number in a second, at most")
      .def_property_readonly(
          "windows", [](const commission::RiskMargins& r) { return copy(r.windows); }, "s, shape (windows,)")
      .def_readonly("faults", &commission::RiskMargins::margins, "each fault and side, in either residual")
      .def_readonly("pose_faults", &commission::RiskMargins::pose, "those that the pose shows, in it alone");
  py::class_<MarginsObject> margins(m, "Margins", "Detectability along a drive: which faults are certain to be seen.");
  margins
      .def_property_readonly(
          "windows", [](const MarginsObject& o) { return copy(o.survey.windows); }, "s, shape (windows,)")
      .def_property_readonly(
          "seconds", [](const MarginsObject& o) { return o.survey.seconds; }, "of driving")
      .def_property_readonly("residuals", [](const MarginsObject& o) { return o.survey.residuals; })
      .def_property_readonly(
          "at_risk", [](const MarginsObject& o) { return o.survey.at_risk; },
          "what is certain at a stated risk; None where the model says nothing at one")
      .def_property_readonly(
          "sentences", [](const MarginsObject& o) { return words::margin_sentences(o.survey); }, "for people")
      .def(
          "to_dict", [](const MarginsObject& o) { return to_python(o.json()); },
          "The content of margins.json (results/margins.schema.json).")
      .def(
          "save", [](const MarginsObject& o, const std::filesystem::path& path) { files::write_json(path, o.json()); },
          py::arg("path"), "Writes margins.json, whole or not at all.");
  tables_of(margins);
  const detector::MarginOptions usual;
  m.def("margins", &survey, py::arg("log"), py::arg("model"), py::kw_only(),
        py::arg("faults") = std::vector<std::string>{}, py::arg("windows") = std::nullopt,
        py::arg("onset_step") = usual.onset_step, py::arg("noise_share") = usual.noise_share,
        py::arg("set") = "polytope", py::arg("persistence") = std::nullopt, py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Which faults the detector of `model` is certain to see on the motion of `log`, from what size on and how "
        "soon, as `wheelwright margins` does.\n\n"
        "faults: names of the catalogue, by default all. windows: times after the onset, s, ascending. onset_step: "
        "time between the onsets tried, s. noise_share: of the noise bounds, for the size that stays hidden. The "
        "result does not depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python
