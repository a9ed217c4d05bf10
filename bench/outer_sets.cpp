// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how much wider is a threshold that is made of a box, an ellipsoid or a zonotope around the feasible set
/// than one that is made of the set itself?
///
/// Makes the set of every case, the three outer sets of it, and for every row of the case the parameter part of the
/// threshold, h(y) + h(−y), and ρ of (34); prints the ratios to those of the polytope, one line of a Markdown table for
/// each output. Cases are the logs, commissioned, or without arguments the rows of drive_rows.hpp.
///
///     wheelwright-outer-sets [ROBOT.yaml LOG.csv.gz ...]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/bounds/support_walk.hpp>
#include <wheelwright/bounds/survey.hpp>
#include <wheelwright/bounds/zonotope.hpp>
#include <wheelwright/commission/commission.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/filter/regression_stream.hpp>
#include <wheelwright/io/csv.hpp>
#include <wheelwright/io/robot_file.hpp>

#include "drive_rows.hpp"

using namespace wheelwright;

namespace {

constexpr std::size_t kSets = 4;  // polytope, box, ellipsoid, zonotope
using PerSet = std::array<double, kSets>;

/// h of the four sets, one direction after the other; of the polytope by linear program where its walk does not end.
class Sets {
 public:
  Sets(const Polytope& set, std::size_t outputs)
      : walk_(set, {.slots = kSlots * outputs, .budget = 1 << 14}),
        ellipsoid_(outer_ellipsoid(set)),
        zonotope_(outer_zonotope(set)) {}

  static constexpr std::size_t kSlots = 4;  // directions of an output: ±y, ±y + Δ

  [[nodiscard]] PerSet support(std::span<const double> a, std::size_t slot) {
    const std::size_t before = walk_.count().cut_short;
    double exact = walk_.support(a, slot);
    if (walk_.count().cut_short != before) {
      exact = std::min(exact, polytope().support(a));
    }
    return {exact, polytope().hull().support(a), ellipsoid_.support(a), zonotope_.support(a)};
  }
  [[nodiscard]] const Polytope& polytope() const { return walk_.set(); }

 private:
  SupportWalk walk_;
  Ellipsoid ellipsoid_;
  Zonotope zonotope_;
};

/// What is collected of one output.
struct Ratios {
  std::array<std::vector<double>, kSets> part, rho;  ///< to the polytope's
  std::vector<double> exact;                         ///< ρ of the polytope
  double torque_square = 0.0;
  std::size_t rows = 0, flat = 0;
};

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string median_and_worst(const std::vector<double>& ratios) {
  return ratios.empty() ? "–" : fmt::format("{:.2f}, {:.2f}", median(ratios), *std::ranges::max_element(ratios));
}

/// Adds row `row` of `block`. The shift by Δ and its signs are those of ThresholdRule, from the hull of the polytope
/// whichever the set is: who holds an ellipsoid can hold the hull too.
void add(Ratios& ratios, Sets& sets, const Eigen::VectorXd& estimate, const RegressionBlock& block, Eigen::Index row,
         std::size_t output) {
  const std::size_t p = block.parameters;
  const double* const y = block.Y.row(row).data();
  const double* const delta = block.dY.row(row).data();
  std::vector<double> a(p);
  const auto support = [&](double sign, bool shifted) {
    for (std::size_t j = 0; j < p; ++j) {
      const Interval& side = sets.polytope().hull().sides[j];
      const double shift = side.lower >= 0.0 ? delta[j] : side.upper <= 0.0 ? -delta[j] : 0.0;
      a[j] = sign * y[j] + (shifted ? shift : 0.0);
    }
    const std::size_t which = (sign > 0.0 ? 0U : 1U) + (shifted ? 2U : 0U);
    return sets.support(a, Sets::kSlots * output + which);
  };
  double noise = block.dy[row];
  for (std::size_t j = 0; j < p; ++j) {
    const Interval& side = sets.polytope().hull().sides[j];
    if (side.lower < 0.0 && side.upper > 0.0) {
      noise += delta[j] * std::max(-side.lower, side.upper);
    }
  }
  const PerSet up = support(1.0, false), down = support(-1.0, false);
  const PerSet above = support(1.0, true), below = support(-1.0, true);
  const double predicted = block.Y.row(row).dot(estimate);
  const double narrow = up[0] + down[0];
  const auto rho = [&](std::size_t s) { return std::max(above[s] - predicted, below[s] + predicted) + noise; };
  ++ratios.rows;
  ratios.torque_square += block.y[row] * block.y[row];
  ratios.exact.push_back(rho(0));
  ratios.flat += narrow > 0.0 ? 0 : 1;
  for (std::size_t s = 1; s < kSets; ++s) {
    if (narrow > 0.0) {
      ratios.part[s].push_back((up[s] + down[s]) / narrow);
    }
    ratios.rho[s].push_back(rho(s) / rho(0));
  }
}

void study(const std::string& name, RegressionSource& rows, const Polytope& set, const Eigen::VectorXd& estimate) {
  Sets sets(set, rows.outputs());
  std::vector<Ratios> outputs(rows.outputs());
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const std::size_t output = static_cast<std::size_t>(row) % block.outputs;
      add(outputs[output], sets, estimate, block, row, output);
    }
  }
  std::string blocks;
  for (const Polytope::Block& b : set.blocks()) {
    blocks += fmt::format("{}{}", blocks.empty() ? "" : " + ", b.parameters.size());
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Ratios& r = outputs[i];
    fmt::print("| {} | {} | {} | {} |", name, i, blocks, set.facets().size());
    for (const auto* kind : {&r.part, &r.rho}) {
      for (std::size_t s = 1; s < kSets; ++s) {
        fmt::print(" {} |", median_and_worst((*kind)[s]));
      }
    }
    fmt::print(" {:.3g} |\n", median(r.exact) / std::sqrt(r.torque_square / static_cast<double>(r.rows)));
    if (r.flat > 0) {
      fmt::print(stderr, "{}, output {}: {} of {} rows are zero and have no ratio of parameter parts\n", name, i,
                 r.flat, r.rows);
    }
  }
  std::fflush(stdout);
}

void study_log(const std::string& robot_file, const std::string& log_file) {
  const std::string name = log_file.substr(log_file.rfind('/', log_file.rfind('/') - 1) + 1);
  CsvLog log({log_file});
  const Commissioning result = commission(log, read_robot(robot_file));
  const CommissionedModel& model = result.model;
  if (model.facets.empty()) {
    fmt::print(stderr, "{}: {}\n", name, result.message);
    return;
  }
  RegressionStream rows(log, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
  study(name, rows, Polytope(model.facets, model.box), model.estimate);
}

void study_drive(std::size_t p, bench::RowNoise noise, const char* letter) {
  const bench::DriveRows drive = bench::drive_rows(100'000, p, noise);
  RegressionTable rows(bench::as_block(drive));
  const FeasibleSet found = feasible_set(rows, drive.prior);
  const std::string name = fmt::format("p = {}, {}", p, letter);
  if (!found.polytope) {
    fmt::print(stderr, "{}: the set is empty\n", name);
    return;
  }
  study(name, rows, *found.polytope, weighted_estimate(survey(rows, drive.prior, {}), drive.prior));
}

}  // namespace

int main(int count, char** words) {
  if (count % 2 == 0) {
    fmt::print(stderr, "usage: wheelwright-outer-sets [ROBOT.yaml LOG.csv.gz ...]\n");
    return EXIT_FAILURE;
  }
  fmt::print(
      "| case | output | parameters | facets | parameter part: box | ellipsoid | zonotope | ρ: box | ellipsoid "
      "| zonotope | ρ / torque rms |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  try {
    for (int i = 1; i < count; i += 2) {
      study_log(words[i], words[i + 1]);
    }
    for (const std::size_t p : {4, 6, 8, 12}) {
      using enum bench::RowNoise;
      for (const auto& [noise, letter] : {std::pair{uniform, "u"}, {gaussian, "g"}, {coloured, "s"}}) {
        if (count == 1) {
          study_drive(p, noise, letter);
        }
      }
    }
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
