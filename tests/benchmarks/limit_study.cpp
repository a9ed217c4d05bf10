// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how far is the threshold test from the limit that no residual can beat (detector/consistency.hpp)?
///
/// Commissions on the first half of every log with the filter of first and of second order, asks along the second half
/// for the smallest radius fault (both wheels shrink) that is certain to raise an alarm within 0.3, 1 and 3 s, and
/// for the smallest that any test on the same raw samples could be certain of with the same feasible set. Prints one
/// line of a Markdown table for each robot and order: medians over onsets.
///
///     wheelwright-limit [--simulated N] [--onsets N] [--before SECONDS] [DIR ...]
///
/// DIR holds one directory per robot with robot.yaml and baseline.csv.gz. Simulated robots: seeds 1 to N; their noise
/// is declared, and the raw samples obey the declared bounds. Where noise is not declared, an angle is wrong by half a
/// count, and an effort by the bound that would give the commissioned ē through the filter in the worst case, were it
/// the only error: the smallest over the outputs.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "commission/commission.hpp"
#include "core/error.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/margins.hpp"
#include "detector/threshold.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/limit/consistency.hpp"

using namespace wheelwright;

namespace {

const std::vector<double> kWindows = {0.3, 1.0, 3.0};

struct Options {
  std::size_t simulated = 0, onsets = 5;
  double before = 0.5;
  std::vector<std::string> directories;
};

struct Drive {
  std::string name;
  Robot robot;
  LogTable log;
};

/// Another robot for every seed: mass, rate, encoder, noise. Declared noise is twice what there is.
Drive simulated(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto one_of = [&](std::vector<double> values) { return values[random() % values.size()]; };
  Scenario s;
  s.robot.wheel_radius = between(0.05, 0.15);
  s.robot.track_width = between(0.3, 0.6);
  s.robot.hold = Hold::first_order;
  s.robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  s.robot.speed_source = model::SpeedSource::encoder_difference;
  s.parameters.mass = between(8.0, 48.0);
  s.parameters.yaw_inertia = s.parameters.mass * between(0.02, 0.07);
  s.parameters.viscous_x = s.parameters.viscous_y = between(1.0, 10.0);
  s.parameters.viscous_yaw = between(0.1, 1.3);
  s.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 0.6, .yaw_rate = 1.2, .period = 6.0};
  s.duration = 60.0;
  s.rate = one_of({50.0, 100.0});
  s.sensors.sampling = sim::Sampling::interval;
  s.sensors.angles = s.sensors.pose = s.sensors.commands = false;
  const double counts = one_of({2048.0, 8192.0, 32768.0});
  s.robot.encoder_counts_per_turn = s.sensors.encoder_counts_per_turn = counts;
  s.robot.noise.wheel_speed.value = 2.0 * std::numbers::pi / counts * s.rate;
  const double effort = between(0.01, 0.05);
  s.robot.noise.effort.value = effort;
  s.sensors.effort = 0.5 * effort;
  s.seed = seed;
  return {fmt::format("seed {}: {:.0f} Hz, {:.0f} counts, {:.3f} N·m", seed, s.rate, counts, effort), s.robot,
          sim::simulate(s)};
}

std::vector<std::string> robots_in(const std::string& directory) {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    if (std::filesystem::exists(entry.path() / "robot.yaml") &&
        std::filesystem::exists(entry.path() / "baseline.csv.gz")) {
      found.push_back(entry.path().string());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

filter::SensorErrors raw_errors(const OnlineModel& m, const Robot& robot, const Measurement& measurement) {
  filter::SensorErrors errors;
  if (measurement.count > 0.0) {
    errors.motion = 0.5 * measurement.count * measurement.nominal_step;
  } else if (robot.encoder_counts_per_turn) {
    errors.motion = std::numbers::pi / *robot.encoder_counts_per_turn;
  }
  if (robot.noise.effort.value) {
    errors.effort = *robot.noise.effort.value;
  } else {
    errors.effort = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < m.errors.output.size(); ++i) {
      const double gain = m.filter.static_gain() * m.model.input.row(i).cwiseAbs().sum();
      errors.effort = std::min(errors.effort, m.errors.output[i] / gain);
    }
  }
  return errors;
}

/// What one window showed, onset by onset.
struct Window {
  std::vector<double> test, upper, ratio, bracket;
  std::size_t below_one = 0;
  std::size_t onsets = 0;
};

void compare(const OnlineModel& m, const Drive& drive, const LogTable& second, const Options& options,
             std::vector<Window>& windows, std::size_t& programs) {
  TableSource log(second);
  const detector::ReferenceMotion filtered =
      detector::read_reference(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  const detector::ThresholdRule rule(Polytope(m.facets, m.box), m.estimate);
  FaultType radius;
  for (const FaultType& fault : model::fault_catalogue(m.model, m.estimate)) {
    if (fault.name == "wheel_radius") {
      radius = fault;
    }
  }
  radius.range.upper = 0.0;
  const auto margins =
      detector::margins_along(filtered, {radius}, rule,
                              [&](const FaultType& fault) {
                                return std::make_unique<detector::FaultFilter>(fault, m.model, m.filter, filtered);
                              },
                              {.windows = kWindows, .most_onsets = options.onsets});
  const Measurement raw = filter::find_measurement(log, drive.robot, m.model, 2);
  const detector::ReferenceMotion motion = detector::read_reference(log, RegressorFilter(m.model, {}, raw));
  bench::ConsistencyTest limit(m.model, raw, raw_errors(m, drive.robot, raw), rule.set(), {.before = options.before});
  for (const detector::OnsetMargin& onset : margins.at(0).onsets) {
    const auto at =
        static_cast<std::size_t>(std::lower_bound(motion.t.begin(), motion.t.end(), onset.t) - motion.t.begin());
    for (std::size_t w = 0; w < onset.certain.size(); ++w) {
      const bench::DetectableSize size = limit.smallest_detectable(motion, radius, -1.0, at, kWindows[w]);
      Window& window = windows[w];
      programs += size.programs;
      ++window.onsets;
      window.test.push_back(onset.certain[w]);
      window.upper.push_back(size.upper);
      if (std::isfinite(size.upper)) {
        window.ratio.push_back(onset.certain[w] / size.upper);
        window.below_one += window.ratio.back() < 1.0 ? 1 : 0;
        if (size.lower > 0.0) {
          window.bracket.push_back(size.upper / size.lower);
        }
      }
    }
  }
}

std::string percent(double share) { return std::isfinite(share) ? fmt::format("{:.2f} %", 100.0 * share) : "none"; }

void study_drive(const Drive& drive, const Options& options) {
  const LogTable first = core::slice(drive.log, 0, drive.log.rows() / 2),
                 second = core::slice(drive.log, drive.log.rows() / 2, drive.log.rows());
  for (const int order : {1, 2}) {
    Robot asked = drive.robot;
    asked.filter.order = order;
    TableSource learning(first);
    const Commissioning result = commission_robot(learning, asked);
    if (result.model.facets.empty()) {
      fmt::print("| {} | {} | {} |\n", drive.name, order, result.message);
      continue;
    }
    std::vector<Window> windows(kWindows.size());
    std::size_t programs = 0;
    compare(result.model, drive, second, options, windows, programs);
    std::string line = fmt::format("| {} | {} | {:.3g} |", drive.name, order, result.model.filter.beta);
    for (const Window& w : windows) {
      line += fmt::format(" {} | {} | {:.2f} | {:.3f} |", percent(median(w.test)), percent(median(w.upper)),
                          median(w.ratio), median(w.bracket));
      if (w.below_one > 0) {
        fmt::print(stderr, "{}, order {}: {} ratios below 1 of {}\n", drive.name, order, w.below_one, w.onsets);
      }
    }
    fmt::print("{} {} |\n", line, programs);
    std::fflush(stdout);
  }
}

int usage() {
  fmt::print(stderr, "usage: wheelwright-limit [--simulated N] [--onsets N] [--before SECONDS] [DIR ...]\n");
  return EXIT_FAILURE;
}

}  // namespace

int main(int count, char** words) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--simulated" && i + 1 < count) {
      options.simulated = static_cast<std::size_t>(std::max(0, std::atoi(words[++i])));
    } else if (word == "--onsets" && i + 1 < count) {
      options.onsets = static_cast<std::size_t>(std::max(1, std::atoi(words[++i])));
    } else if (word == "--before" && i + 1 < count) {
      options.before = std::atof(words[++i]);
    } else if (word.starts_with("-")) {
      return usage();
    } else {
      options.directories.push_back(word);
    }
  }
  if (options.simulated == 0 && options.directories.empty()) {
    return usage();
  }
  fmt::print("| robot | order | β, 1/s |");
  for (const double window : kWindows) {
    fmt::print(" test, {0} s | limit, {0} s | ratio | bracket |", window);
  }
  fmt::print(" programs |\n|---|---|---|");
  for (std::size_t w = 0; w < kWindows.size(); ++w) {
    fmt::print("---|---|---|---|");
  }
  fmt::print("---|\n");
  try {
    for (std::size_t seed = 1; seed <= options.simulated; ++seed) {
      study_drive(simulated(seed), options);
    }
    for (const std::string& directory : options.directories) {
      for (const std::string& robot : robots_in(directory)) {
        CsvLog log({robot + "/baseline.csv.gz"});
        study_drive(
            {std::filesystem::path(robot).filename().string(), read_robot(robot + "/robot.yaml"), read_all(log)},
            options);
      }
    }
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
