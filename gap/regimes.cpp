// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/regimes.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace wheelwright {
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

}  // namespace wheelwright
