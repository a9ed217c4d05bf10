// SPDX-License-Identifier: Apache-2.0
#include "gap/regimes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "core/check.hpp"
#include "core/regression.hpp"
#include "core/statistics.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {
namespace {

using Samples = Eigen::ArrayXd;

// Collects the regimes of a drive that are not too rare.
class Collector {
 public:
  Collector(const Drive& drive, const RegimeOptions& options) : drive_(drive), options_(options) {}

  void add(std::string kind, std::string name, Mask instants) {
    const double share = static_cast<double>(instants.count()) / static_cast<double>(instants.size());
    if (share >= options_.smallest_share && share > 0.0) {
      out_.push_back({std::move(kind), std::move(name), std::move(instants)});
    }
  }

  // Quarters of `values` over the instants of `among`.
  void add_quarters(const std::string& kind, const std::string& what, const Samples& values, const Mask& among,
                    const std::string& unit) {
    const std::vector<double> edges = quantiles(values, among, {0.25, 0.5, 0.75});
    if (edges.empty()) {
      return;
    }
    for (std::size_t k = 0; k <= edges.size(); ++k) {
      Mask in = among;
      if (k > 0) {
        in = in && values >= edges[k - 1];
      }
      if (k < edges.size()) {
        in = in && values < edges[k];
      }
      add(kind,
          k == 0              ? fmt::format("{} below {:.2g} {}", what, edges.front(), unit)
          : k == edges.size() ? fmt::format("{} above {:.2g} {}", what, edges.back(), unit)
                              : fmt::format("{} {:.2g} to {:.2g} {}", what, edges[k - 1], edges[k], unit),
          in);
    }
  }

  // Equal sectors of the full turn.
  void add_sectors(const std::string& kind, const std::string& what, const Samples& angle) {
    const double width = 360.0 / options_.sectors;
    const Samples turn = angle / (2.0 * std::numbers::pi);
    const Samples sector = ((turn - turn.floor()) * options_.sectors).floor();
    for (int k = 0; k < options_.sectors; ++k) {
      add(kind, fmt::format("{} {:g} to {:g}°", what, k * width, (k + 1) * width), sector == k);
    }
  }

  static std::vector<double> quantiles(const Samples& values, const Mask& among, const std::vector<double>& shares) {
    std::vector<double> sorted;
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      if (among[k]) {
        sorted.push_back(values[k]);
      }
    }
    std::vector<double> out;
    if (sorted.size() < 8) {
      return out;
    }
    std::sort(sorted.begin(), sorted.end());
    for (const double share : shares) {
      out.push_back(sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]);
    }
    return out;
  }

  [[nodiscard]] const Drive& drive() const { return drive_; }
  [[nodiscard]] const RegimeOptions& options() const { return options_; }
  std::vector<Regime> take() { return std::move(out_); }

 private:
  const Drive& drive_;
  const RegimeOptions& options_;
  std::vector<Regime> out_;
};

std::string joint_name(const Drive& drive, std::size_t i) {
  return drive.joints.size() == 2   ? (i == 0 ? "right wheel" : "left wheel")
         : drive.joints.size() == 1 ? "axis"
                                    : fmt::format("joint {}", i + 1);
}

Mask all_resting(const Drive& drive) {
  Mask resting = Mask::Constant(drive.rows(), true);
  for (const JointSignals& joint : drive.joints) {
    for (Eigen::Index k = 0; k < resting.size(); ++k) {
      resting[k] = resting[k] && joint.resting[k];
    }
  }
  return resting;
}

// Instants within `seconds` of one at which the joint moves the other way than it last moved, segment by segment.
Mask reversals(const Drive& drive, const JointSignals& joint, double seconds) {
  Mask near = Mask::Constant(drive.rows(), false);
  const auto reach = static_cast<Eigen::Index>(std::lround(seconds / drive.step));
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    double before = 0.0;
    for (Eigen::Index k = first; k < last; ++k) {
      const double now = joint.resting[k] ? 0.0 : joint.smooth_speed[k];
      if (now != 0.0 && now * before < 0.0) {
        const Eigen::Index from = std::max(first, k - reach), to = std::min(last, k + reach + 1);
        near.segment(from, to - from).setConstant(true);
      }
      before = now != 0.0 ? now : before;
    }
  }
  return near;
}

void add_motion(Collector& collect) {
  const Drive& drive = collect.drive();
  const Mask resting = all_resting(drive), moving = !resting;
  collect.add("speed", "standstill", resting);
  if (drive.coordinates.empty()) {
    return;
  }
  const CoordinateSignals& forward = drive.coordinates.front();
  const Samples speed = forward.smooth_speed.array();
  const std::string unit = drive.model.coordinates.size() > 1 ? "m/s" : "m/s or rad/s";
  collect.add_quarters("speed", "speed", speed.abs(), moving, unit);

  const Samples along = forward.smooth_acceleration.array() * speed.sign();
  if (const auto edges = Collector::quantiles(along, moving, {0.2, 0.8}); !edges.empty()) {
    collect.add("acceleration", "slowing down", moving && along <= edges[0]);
    collect.add("acceleration", "at about constant speed", moving && along > edges[0] && along < edges[1]);
    collect.add("acceleration", "speeding up", moving && along >= edges[1]);
  }
  if (drive.coordinates.size() < 2) {
    return;
  }
  const Samples yaw = drive.coordinates[1].smooth_speed.array();
  const auto fastest = Collector::quantiles(yaw.abs(), moving, {0.95});
  if (fastest.empty()) {
    return;
  }
  const double edge = collect.options().straight * fastest.front();
  collect.add("yaw rate", "straight", moving && yaw.abs() <= edge);
  for (const double side : {1.0, -1.0}) {
    const Mask turning = moving && side * yaw > edge;
    const auto median = Collector::quantiles(side * yaw, turning, {0.5});
    if (!median.empty()) {
      const char* name = side > 0.0 ? "left" : "right";
      collect.add("yaw rate", fmt::format("slow turn to the {}", name), turning && side * yaw < median.front());
      collect.add("yaw rate", fmt::format("fast turn to the {}", name), turning && side * yaw >= median.front());
    }
  }
}

void add_joints(Collector& collect) {
  const Drive& drive = collect.drive();
  for (std::size_t i = 0; i < drive.joints.size(); ++i) {
    const JointSignals& joint = drive.joints[i];
    const std::string name = joint_name(drive, i);
    const Samples speed = joint.smooth_speed.array(), effort = joint.smooth_effort.array();
    const Mask moving = !joint.resting;
    collect.add("direction", name + " forwards", moving && speed > 0.0);
    collect.add("direction", name + " backwards", moving && speed < 0.0);
    collect.add("reversal", "reversal of the " + name, reversals(drive, joint, collect.options().reversal));
    collect.add_quarters("effort", "effort of the " + name, effort.abs(), Mask::Constant(drive.rows(), true),
                         drive.model.output_units.empty() ? "" : drive.model.output_units.front());
    collect.add("braking", name + " braking", moving && effort * speed < 0.0);
    if (drive.wheel_radius > 0.0) {
      collect.add_sectors("wheel angle", name + " at", joint.angle.array());
    }
  }
}

void add_place(Collector& collect) {
  const Drive& drive = collect.drive();
  if (drive.has_heading()) {
    collect.add_sectors("heading", "heading", drive.heading.array());
  }
  if (!drive.has_pose()) {
    return;
  }
  const int grid = collect.options().grid;
  const double x0 = drive.x.minCoeff(), y0 = drive.y.minCoeff();
  const double dx = (drive.x.maxCoeff() - x0) / grid, dy = (drive.y.maxCoeff() - y0) / grid;
  if (!(dx > 0.0) || !(dy > 0.0)) {
    return;
  }
  const Samples column = ((drive.x.array() - x0) / dx).floor().min(grid - 1.0);
  const Samples row = ((drive.y.array() - y0) / dy).floor().min(grid - 1.0);
  for (int a = 0; a < grid; ++a) {
    for (int b = 0; b < grid; ++b) {
      collect.add("position",
                  fmt::format("x = {:.1f} to {:.1f} m, y = {:.1f} to {:.1f} m", x0 + a * dx, x0 + (a + 1) * dx,
                              y0 + b * dy, y0 + (b + 1) * dy),
                  column == a && row == b);
    }
  }
}

void add_time(Collector& collect) {
  const Drive& drive = collect.drive();
  const int stretches = collect.options().stretches;
  const double begin = drive.t[0], width = (drive.t[drive.rows() - 1] - begin) / stretches;
  if (!(width > 0.0)) {
    return;
  }
  const bool epoch = std::abs(begin) > 1e6;  // a clock's seconds since long ago say nothing
  const double origin = epoch ? begin : 0.0;
  const Samples stretch = ((drive.t.array() - begin) / width).floor().min(stretches - 1.0);
  for (int k = 0; k < stretches; ++k) {
    collect.add("time",
                fmt::format("t = {:.4g} to {:.4g} s{}", begin - origin + k * width, begin - origin + (k + 1) * width,
                            epoch ? " from the start" : ""),
                stretch == k);
  }
}

}  // namespace

std::vector<Regime> regimes(const Drive& drive, const RegimeOptions& options) {
  Collector collect(drive, options);
  if (drive.rows() > 1) {
    add_motion(collect);
    add_joints(collect);
    add_place(collect);
    add_time(collect);
  }
  return collect.take();
}

namespace {

RegressionBlock rows_of(const Drive& drive, double beta, const Mask& rows, const std::vector<double>& bounds) {
  const std::vector<Eigen::VectorXd> left = filtered_outputs(drive, beta);
  const std::vector<std::vector<Eigen::VectorXd>> columns = filtered_regressor(drive, beta);
  const std::size_t n = left.size(), p = columns.size();
  RegressionBlock block;
  block.resize(static_cast<std::size_t>(rows.count()), n, p);
  block.dY.setZero();
  std::size_t k = 0;
  for (Eigen::Index at = 0; at < drive.rows(); ++at) {
    if (!rows[at]) {
      continue;
    }
    block.sample[k] = static_cast<std::size_t>(at);
    block.t[k] = drive.t[at];
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Eigen::Index>(k * n + i);
      block.y[row] = left[i][at];
      block.dy[row] = bounds[i];
      for (std::size_t j = 0; j < p; ++j) {
        const Eigen::VectorXd& column = columns[j][i];
        block.Y(row, static_cast<Eigen::Index>(j)) = column.size() > 0 ? column[at] : 0.0;
      }
    }
    ++k;
  }
  return block;
}

}  // namespace

Contradictions find_contradictions(const Drive& drive, double beta, const Mask& rows, const std::vector<double>& floors,
                                   const Box& prior, const ContradictionOptions& options) {
  const std::size_t n = drive.model.n();
  check::positive(beta, "find_contradictions: beta");
  check::that(rows.size() == drive.rows(), "find_contradictions: rows", "one value for each instant");
  check::that(floors.size() == n, "find_contradictions: floors", "one for each output");
  check::that(prior.dimension() == drive.model.p(), "find_contradictions: prior", "one side for each parameter");
  check::that(options.confidence > 0.0 && options.confidence < 1.0, "find_contradictions: confidence",
              "a number between 0 and 1");
  bounds::check_finite(prior, "find_contradictions: prior");
  Contradictions out;
  const auto instants = static_cast<double>(rows.count());
  if (instants == 0.0) {
    out.statement = "No row of the log could be used.";
    return out;
  }
  out.factor = core::normal_upper_quantile((1.0 - options.confidence) / (2.0 * instants * static_cast<double>(n)));
  for (const double floor : floors) {
    out.bounds.push_back(out.factor * check::positive(floor, "find_contradictions: floor"));
  }
  core::RegressionTable table(rows_of(drive, beta, rows, out.bounds));
  const FeasibleSet set = feasible_set(table, prior);
  const std::string within = fmt::format(
      "within {:.2f} times the noise floor, which Gaussian noise leaves on none of {} rows with a confidence "
      "of {:.4g} %",
      out.factor, rows.count(), 100.0 * options.confidence);
  if (set.status == FeasibleSet::Status::nonempty) {
    out.statement = "It is not excluded that one set of parameters of the model explains every row " + within + ".";
    return out;
  }
  double sum = 0.0;
  std::map<std::pair<std::size_t, std::size_t>, Contradiction> found;  // a row counts once, whichever side
  for (const bounds::WeightedRow& weighted : set.contradiction) {
    const bounds::RowOrigin& origin = weighted.row.origin;
    if (origin.is_prior) {
      continue;
    }
    const double weight = weighted.multiplier * out.bounds[origin.output];
    Contradiction& row = found[{origin.sample, origin.output}];
    row.t = origin.t;
    row.channel = drive.model.outputs[origin.output];
    row.weight += weight;
    sum += weight;
  }
  for (auto& [key, row] : found) {
    row.weight = sum > 0.0 ? row.weight / sum : 0.0;
    out.rows.push_back(row);
  }
  std::stable_sort(out.rows.begin(), out.rows.end(),
                   [](const Contradiction& a, const Contradiction& b) { return a.weight > b.weight; });
  out.statement = fmt::format(
      "Without an effect beside the model no parameters explain every row {}: {} contradict each other.", within,
      out.rows.size() == 1 ? "one row and the prior bounds" : fmt::format("{} rows", out.rows.size()));
  return out;
}

}  // namespace wheelwright::gap
