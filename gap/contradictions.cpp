// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/contradictions.hpp>

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/core/check.hpp>
#include <wheelwright/core/regression.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/gap/drive_filter.hpp>

namespace wheelwright {
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
  check_finite(prior, "find_contradictions: prior");
  Contradictions out;
  const auto instants = static_cast<double>(rows.count());
  if (instants == 0.0) {
    out.statement = "No row of the log could be used.";
    return out;
  }
  out.factor = normal_upper_quantile((1.0 - options.confidence) / (2.0 * instants * static_cast<double>(n)));
  for (const double floor : floors) {
    out.bounds.push_back(out.factor * check::positive(floor, "find_contradictions: floor"));
  }
  RegressionTable table(rows_of(drive, beta, rows, out.bounds));
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
  for (const WeightedRow& weighted : set.contradiction) {
    const RowOrigin& origin = weighted.row.origin;
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
  out.statement =
      fmt::format("No parameters of the model explain every row {}: {} contradict each other.", within,
                  out.rows.size() == 1 ? "one row and the prior bounds" : fmt::format("{} rows", out.rows.size()));
  return out;
}

}  // namespace wheelwright
