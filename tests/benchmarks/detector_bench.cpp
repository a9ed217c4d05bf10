// SPDX-License-Identifier: Apache-2.0
// The on-line detector: a whole step in C++ and as exported C, with the box and with the polytope, next to the same
// filter with constant thresholds; the support function from the table next to the walk, and a threshold made of it.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "bounds/support_table.hpp"
#include "core/error.hpp"
#include "detector/detector.hpp"
#include "detector/export/export_c.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/row_stream.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/compiled_c.hpp"
#include "tests/benchmarks/drive_rows.hpp"

namespace wheelwright::bench::detector_bench {

using detector::ParameterSetKind;

namespace {

constexpr int kRepetitions = 5;

std::string each(double seconds, std::size_t count, const std::string& more = "") {
  return fmt::format("{:.0f} ns each{}", 1e9 * seconds / static_cast<double>(count), more);
}

/// A drive of the robot of the examples with declared noise, and the set that it leaves.
struct World {
  static constexpr std::size_t rows = 200000;
  Scenario scenario;
  std::vector<double> t, samples;  // samples: rows × inputs
  std::size_t inputs = 0;
  std::optional<RegressorFilter> filter;
  std::optional<Polytope> set;
  Eigen::VectorXd estimate;

  explicit World(bool dry_friction) {
    scenario.robot.wheel_radius = 0.0975;
    scenario.robot.track_width = 0.381;
    scenario.robot.hold = Hold::zero_order;
    scenario.robot.encoder_counts_per_turn = 4096.0;
    if (dry_friction) {
      scenario.robot.parameters = {{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw", "coulomb"}};
    }
    scenario.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
    scenario.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 0.6, .yaw_rate = 1.2, .period = 12.0};
    scenario.rate = 100.0;
    scenario.duration = static_cast<double>(rows - 1) / scenario.rate;
    scenario.sensors.encoder_counts_per_turn = 4096.0;
    scenario.sensors.effort = 0.02;
    scenario.sensors.speeds = scenario.sensors.pose = scenario.sensors.commands = false;
    const LogTable table = sim::simulate(scenario);
    TableSource log(table);
    const Model model = model::make_model(scenario.robot);
    const FilterDesign design{.order = 2, .alpha = 10.0, .beta = 10.0};
    const wheelwright::Measurement measurement = filter::find_measurement(log, scenario.robot, model, design.order);
    const filter::SensorErrors sensors{.motion = 3.1415927 / 4096.0, .effort = 0.02};
    filter.emplace(model, design, measurement, filter::propagate(model, design, measurement, sensors));
    TorqueRows stream(log, *filter);
    Box prior;
    prior.sides = model::prior_box(scenario.robot, model).bounds;
    set = feasible_set(stream, prior).polytope.value();
    estimate = Eigen::Map<const Eigen::VectorXd>(set->chebyshev_centre().data(), static_cast<Eigen::Index>(model.p()));
    const auto names = measurement.columns();
    inputs = names.size();
    t = table.t;
    for (std::size_t k = 0; k < rows; ++k) {
      for (const std::string& name : names) {
        samples.push_back(table.column(name)[k]);
      }
    }
  }

  [[nodiscard]] TorqueDetector detector(detector::DetectorOptions options) const {
    return {*filter, detector::ThresholdRule(*set, estimate, options.set), options};
  }
  void run(TorqueDetector& detector) const {
    detector.restart();
    for (std::size_t k = 0; k < rows; ++k) {
      DoNotOptimize(detector.step(t[k], {samples.data() + k * inputs, inputs}).fault);
    }
  }
};

/// The exported detector.
class Exported {
 public:
  Exported(const TorqueDetector& detector, std::size_t inputs)
      : compiled_(exporter::c_header(detector, {.name = "robot"}),
                  fmt::format("#include \"robot.h\"\n"
                              "int robot_run(long rows, const double *t, const double *samples) {{\n"
                              "  robot_state s; robot_decision d; long k; int faults = 0;\n"
                              "  robot_init(&s);\n"
                              "  for (k = 0; k < rows; ++k) {{ robot_step(&s, t[k], samples + k * {}, &d); "
                              "faults += d.fault; }}\n"
                              "  return faults;\n}}\n",
                              inputs)),
        run_(compiled_.function<int(long, const double*, const double*)>("robot_run")) {}
  explicit operator bool() const { return run_ != nullptr; }
  void run(const World& w) const { DoNotOptimize(run_(static_cast<long>(World::rows), w.t.data(), w.samples.data())); }

 private:
  CompiledC compiled_;
  int (*run_)(long, const double*, const double*);
};

void steps(Form form) {
  for (const bool dry_friction : {false, true}) {
    const World w(dry_friction);
    const int p = static_cast<int>(w.estimate.size());
    Detector constant = w.detector({.mu = Eigen::Vector2d(1.0, 1.0)});
    for (const ParameterSetKind kind : {ParameterSetKind::box, ParameterSetKind::polytope}) {
      const std::string name = kind == ParameterSetKind::box ? "box" : "polytope";
      Detector detector = w.detector({.set = kind});
      const std::string more = kind == ParameterSetKind::polytope
                                   ? fmt::format(", {} facets{}", w.set->facets().size(),
                                                 detector.threshold().table() ? "" : ", walked without a table")
                                   : "";
      const auto note = [&](double seconds) { return each(seconds, World::rows, more); };
      const auto measure = [&](const std::string& what, const Work& ours) {
        compare(
            form, {"detector/step " + what + name, World::rows, p, 1, "constant thresholds", note}, ours,
            [&] { w.run(constant); }, kRepetitions);
      };
      measure("", [&] { w.run(detector); });
      if (kind == ParameterSetKind::box || detector.threshold().table()) {
        if (const Exported exported(detector, w.inputs); exported) {
          measure("exported C ", [&] { exported.run(w); });
        }
      }
    }
  }
}

/// Many robots in one process, each with a detector of its own, a sample of each in turn.
void robots(Form form) {
  const World w(false);
  const TorqueDetector one = w.detector({.set = ParameterSetKind::box});
  for (const std::size_t count : {1, 100, 10000}) {
    std::vector<TorqueDetector> fleet(count, one);
    TorqueDetector alone = one;
    const std::size_t turns = World::rows / count;
    compare(
        form,
        {fmt::format("detector/robots {} of them", count), World::rows, 4, 1, "one robot, as many steps",
         [&](double seconds) { return each(seconds, World::rows); }},
        [&] {
          for (TorqueDetector& detector : fleet) {
            detector.restart();
          }
          for (std::size_t k = 0; k < turns; ++k) {
            for (TorqueDetector& detector : fleet) {
              DoNotOptimize(detector.step(w.t[k], {w.samples.data() + k * w.inputs, w.inputs}).fault);
            }
          }
        },
        [&] { w.run(alone); }, kRepetitions);
  }
}

/// Thresholds of both channels of slowly turning rows, next to constant ones.
void thresholds(Form form) {
  const std::size_t n = 100000;
  for (const std::size_t p : {4, 6, 8}) {
    const DriveRows rows = drive_rows(n, p, RowNoise::uniform);
    core::RegressionTable table(as_block(rows));
    const Polytope set = feasible_set(table, rows.prior).polytope.value();
    const Eigen::VectorXd estimate = Eigen::Map<const Eigen::VectorXd>(rows.truth.data(), static_cast<Eigen::Index>(p));
    const std::vector<double> along = directions(rows, n), none(p, 0.0);
    for (const ParameterSetKind kind : {ParameterSetKind::box, ParameterSetKind::polytope}) {
      const detector::ThresholdRule rule(set, estimate, kind);
      const auto ours = [&] {
        for (std::size_t k = 0; k < n; ++k) {
          DoNotOptimize(rule.at({along.data() + k * p, p}, none, 0.01, k < n / 2 ? 0 : 1));
        }
      };
      const auto constant = [&] {
        for (std::size_t k = 0; k < n; ++k) {
          double predicted = 0.0;
          for (std::size_t j = 0; j < p; ++j) {
            predicted += along[k * p + j] * estimate[static_cast<Eigen::Index>(j)];
          }
          DoNotOptimize(predicted);
        }
      };
      const bool box = kind == ParameterSetKind::box;
      const auto note = [&](double seconds) {
        return each(seconds, n, box ? "" : rule.table() ? ", table" : ", walk");
      };
      compare(form,
              {box ? "detector/threshold box" : "detector/threshold polytope", n, static_cast<int>(p), 1,
               "prediction alone", note},
              ours, constant, kRepetitions);
    }
  }
}

/// The support function from the table, next to the walk that finds its vertices as it goes.
void supports(Form form) {
  const std::size_t n = 100000;
  for (const std::size_t p : {4, 6, 8}) {
    const DriveRows rows = drive_rows(n, p, RowNoise::uniform);
    core::RegressionTable source(as_block(rows));
    const Polytope set = feasible_set(source, rows.prior).polytope.value();
    std::optional<bounds::SupportTable> table = bounds::SupportTable::make(set, {.vertices = 1 << 14});
    if (!table) {
      continue;
    }
    std::size_t vertices = 0;
    for (const bounds::VertexGraph& graph : table->graphs()) {
      vertices += graph.vertices();
    }
    bounds::SupportWalk walk(set);
    const std::vector<double> along = directions(rows, n);
    const auto note = [&](double seconds) {
      return each(seconds, n, fmt::format(", {} facets, {} vertices", set.facets().size(), vertices));
    };
    compare(
        form, {"detector/support table", n, static_cast<int>(p), 1, "walk, warm", note},
        [&] {
          for (std::size_t k = 0; k < n; ++k) DoNotOptimize(table->support({along.data() + k * p, p}, 2 * k / n));
        },
        [&] {
          for (std::size_t k = 0; k < n; ++k) DoNotOptimize(walk.support({along.data() + k * p, p}, 2 * k / n));
        },
        kRepetitions);
  }
}

const bool registered = register_bench("detector/step", steps) && register_bench("detector/robots", robots) &&
                        register_bench("detector/threshold", thresholds) &&
                        register_bench("detector/support", supports);

}  // namespace
}  // namespace wheelwright::bench::detector_bench
