// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how far is the detector at a stated risk from the limit of any test at that risk (limit/likelihood.hpp)?
///
/// The robots, drives and faults of the study of peers, well identified. For every run the smallest size that
/// ScaleDetector sees within 5 s of the onset (in steps of 2^(1/4), noise and all), and the smallest that the most
/// powerful test at the same rate of false alarms sees as often as not, for Gaussian errors of the deviations that the
/// robot file declares. Prints Markdown: medians over runs, and what the thresholds of the sums that saw them are made
/// of: errors that average out, errors at their worst (angles, bias, between samples), and the set.
///
///     wheelwright-risk-limit [--seed S] [--robots R] [--runs K]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/limit/likelihood.hpp"
#include "tests/benchmarks/peers/field.hpp"

using namespace wheelwright;
using namespace wheelwright::peers;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Options {
  std::uint64_t seed = 1;
  std::size_t robots = 6, runs = 4;
};

struct Cell {
  std::string unit;
  std::vector<double> seen, limit, ratio;    // run by run
  std::vector<double> averaged, worst, set;  // shares of the threshold
};

double median(std::vector<double> values) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The look that raises the first alarm within kPatience of the onset.
std::optional<detector::SumState> sees(detector::ScaleDetector& detector, const LogTable& table, double onset) {
  TableSource log(table);
  std::optional<detector::SumState> found;
  detector.restart();
  detector::walk_log(log, detector, [&](double t, bool, bool) {
    if (!found && detector.alarm() && t >= onset && t <= onset + kPatience) {
      found = *std::ranges::find_if(detector.looks(), [](const auto& look) { return look.excess > 0.0; });
    }
  });
  return found;
}

detector::ReferenceMotion noise_free(const Subject& subject, Scenario drive) {
  const OnlineModel& m = subject.model;
  drive.sensors.encoder_counts_per_turn.reset();
  drive.sensors.effort = 0.0;
  Simulation log(drive);
  return detector::read_reference(log, RegressorFilter(m.model, m.filter, m.measurement));
}

void study_robot(const Options& options, std::uint64_t robot, std::array<std::map<std::string, Cell>, 3>& cells) {
  const Subject subject = make_subject(robot, Regime::identified);
  const OnlineModel& m = subject.model;
  const Eigen::VectorXd theta = sim::true_parameters(subject.scenario, m.model);
  const detector::ScaleDetectorOptions detecting;
  const bench::LikelihoodQuestion question{.risk = detecting.false_alarms * kPatience, .window = kPatience};
  detector::ScaleDetector detector(m, detecting);
  const auto runs = make_runs(subject, robot, options.runs);
  for (const Driving driving : kDriving) {
    const std::vector<TriedFault> faults = tried_faults(subject, driving, drive_seed(robot, driving, 9'000));
    for (testing_support::FaultyRun run : runs[static_cast<std::size_t>(driving)]) {
      const detector::ReferenceMotion motion = noise_free(subject, run.drive);
      const auto onset = static_cast<std::size_t>(
          std::lower_bound(motion.instant.begin(), motion.instant.end(), run.onset) - motion.instant.begin());
      const double drawn = run.side;
      for (const TriedFault& fault : faults) {
        run.fault = fault.type;
        run.simulated = fault.simulated;
        run.side = fault.type.range.lower < 0.0 ? drawn : 1.0;
        const double largest = run.side > 0.0 ? fault.type.range.upper : -fault.type.range.lower;
        Cell& cell = cells[static_cast<std::size_t>(driving)][fault.type.name];
        cell.unit = fault.type.unit;
        cell.limit.push_back(bench::likelihood_limit(m.model, m.measurement,
                                                     {.motion = subject.angle_sd, .effort = subject.torque_sd}, theta,
                                                     motion, fault.type, run.side, onset, question));
        double size = cell.limit.back();
        std::optional<detector::SumState> look;
        while (size <= largest &&
               !(look = sees(detector, testing_support::log_of(run, run.side * size, true), run.onset))) {
          size *= std::exp2(0.25);
        }
        if (look) {
          cell.averaged.push_back(look->averaged / look->threshold);
          cell.worst.push_back((look->radius - look->averaged) / look->threshold);
          cell.set.push_back(1.0 - look->radius / look->threshold);
        }
        cell.seen.push_back(size <= largest ? size : kNever);
        cell.ratio.push_back(cell.seen.back() / cell.limit.back());
      }
    }
  }
}

void print(const std::array<std::map<std::string, Cell>, 3>& cells) {
  fmt::print(
      "| fault, driving | sums | limit | ratio | averaged | at worst | set |\n"
      "|---|---|---|---|---|---|---|\n");
  const auto number = [](double x) { return x == kNever ? std::string("–") : fmt::format("{:.2g}", x); };
  const auto shares = [](const Cell& cell) {
    return fmt::format("{:.2f} | {:.2f} | {:.2f}", median(cell.averaged), median(cell.worst), median(cell.set));
  };
  Cell all;
  const auto add = [](Cell& to, const Cell& cell) {
    for (const auto part : {&Cell::ratio, &Cell::averaged, &Cell::worst, &Cell::set}) {
      (to.*part).insert((to.*part).end(), (cell.*part).begin(), (cell.*part).end());
    }
  };
  for (const auto& [name, unused] : cells[0]) {
    Cell of_fault;
    for (const Driving driving : kDriving) {
      const Cell& cell = cells[static_cast<std::size_t>(driving)].at(name);
      const std::string unit = cell.unit == "1" ? "" : " " + cell.unit;
      fmt::print("| {}, {} | {}{} | {}{} | {} | {} |\n", name, to_string(driving), number(median(cell.seen)), unit,
                 number(median(cell.limit)), unit, number(median(cell.ratio)), shares(cell));
      add(of_fault, cell);
    }
    fmt::print("| {}, all | | | {} | {} |\n", name, number(median(of_fault.ratio)), shares(of_fault));
    add(all, of_fault);
  }
  fmt::print("| all ({} runs) | | | {} | {} |\n", all.ratio.size(), number(median(all.ratio)), shares(all));
}

}  // namespace

int main(int count, char** words) {
  Options options;
  for (int i = 1; i < count; i += 2) {
    const std::string word = words[i];
    const double value = i + 1 < count ? std::atof(words[i + 1]) : 0.0;
    if (value < 1.0 || (word != "--seed" && word != "--robots" && word != "--runs")) {
      fmt::print(stderr, "usage: wheelwright-risk-limit [--seed S] [--robots R] [--runs K]\n");
      return 2;
    }
    (word == "--seed"     ? options.seed
     : word == "--robots" ? options.robots
                          : options.runs) = static_cast<std::uint64_t>(value);
  }
  try {
    std::array<std::map<std::string, Cell>, 3> cells;
    std::size_t done = 0;
    for (std::uint64_t robot = options.seed; done < options.robots; ++robot) {
      try {
        study_robot(options, robot, cells);
        ++done;
      } catch (const Error& error) {
        fmt::print(stderr, "left out: {}\n", error.what());
        if (robot > options.seed + 3 * options.robots) {
          throw;
        }
      }
    }
    print(cells);
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
