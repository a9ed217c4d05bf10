// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: what does a guarantee cost, and does it hold on a log of which the tool has seen only the first half?
///
/// Commissions on the first half of every log with filters of several orders and bandwidths, watches the second, and
/// prints one line of a Markdown table each. The last two columns are for comparison what a usual recipe gives, the set
/// of all θ that explain the first half within 1.1 times its minimax error: its width, and how many instants of the
/// fault-free second half leave it.
///
///     wheelwright-half-logs ROBOT.yaml LOG.csv.gz [ROBOT.yaml LOG.csv.gz ...]
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "bounds/minimax.hpp"
#include "commission/commission.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/error.hpp"
#include "detector/online_model.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/filter/row_stream.hpp"

using namespace wheelwright;

namespace {

/// The filter of one line; β is chosen from the log where it is not given.
struct Line {
  int order;
  std::optional<double> beta;
};

/// Output 0 under the recipe: rows without bounds of their own, ē = 1.1 ē* for every output.
struct Recipe {
  double width = 0.0;  ///< median width of [l, u] / torque rms on the second half
  std::size_t outside = 0, instants = 0;
};

Recipe recipe(LogSource& learning, LogSource& watching, const OnlineModel& model) {
  const RegressorFilter bare(model.model, model.filter, model.measurement);
  TorqueRows rows(learning, bare);
  const model::PriorBox prior = model::prior_box(model.robot, model.model);
  const Box box{prior.bounds};
  const auto n = static_cast<Eigen::Index>(model.model.n());
  Eigen::VectorXd error(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    bounds::MinimaxOptions only;
    only.weights.assign(static_cast<std::size_t>(n), std::numeric_limits<double>::infinity());
    only.weights[static_cast<std::size_t>(i)] = 1.0;
    error[i] = 1.1 * bounds::minimax_fit(rows, box, only).upper;
  }
  filter::SignalErrors errors;
  errors.output = error;
  TorqueRows bounded(learning, RegressorFilter(model.model, model.filter, model.measurement, errors));
  const FeasibleSet set = feasible_set(bounded, box);
  Recipe result;
  if (!set.polytope) {
    return result;
  }
  TorqueRows test(watching, RegressorFilter(model.model, model.filter, model.measurement, errors));
  const auto validation = commission::validate_on(test, detector::ThresholdRule(*set.polytope, model.estimate));
  return {validation[0].median_width / validation[0].torque_rms, validation[0].outside, validation[0].instants};
}

void study_halves(const std::string& robot_file, const std::string& log_file) {
  const Robot robot = read_robot(robot_file);
  CsvLog log({log_file});
  const LogTable all = read_all(log);
  const LogTable first = core::slice(all, 0, all.rows() / 2), second = core::slice(all, all.rows() / 2, all.rows());
  for (const Line line : {Line{1, 20.0}, Line{2, 20.0}, Line{2, 5.0}, Line{1, std::nullopt}, Line{2, std::nullopt}}) {
    Robot asked = robot;
    asked.filter = {.order = line.order, .alpha = line.beta, .beta = line.beta};
    TableSource learning(first), watching(second);
    const Commissioning result = commission_robot(learning, asked);
    const std::string label =
        fmt::format("{} | {} | {}{:.3g}", log_file.substr(log_file.rfind('/', log_file.rfind('/') - 1) + 1), line.order,
                    line.beta ? "" : "chosen: ", result.model.filter.beta);
    if (result.model.facets.empty()) {
      fmt::print("| {} | {} |\n", label, result.message);
      continue;
    }
    const Detection detection = detect(watching, make_detector(result.model));
    TorqueRows rows(watching, RegressorFilter(result.model.model, result.model.filter, result.model.measurement,
                                              result.model.errors));
    const commission::OutputValidation v =
        commission::validate_on(rows, detector::ThresholdRule(*result.feasible.polytope, result.model.estimate))[0];
    const Recipe usual = recipe(learning, watching, result.model);
    fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {} | {:.3f} | {} of {} |\n", label, v.nrmse,
               v.median_width / v.torque_rms, v.smallest_kappa, detection.events.size(), usual.width, usual.outside,
               usual.instants);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int count, char** words) {
  if (count < 3 || count % 2 == 0) {
    fmt::print(stderr, "usage: wheelwright-half-logs ROBOT.yaml LOG.csv.gz [ROBOT.yaml LOG.csv.gz ...]\n");
    return EXIT_FAILURE;
  }
  fmt::print(
      "| log | order | β, 1/s | residual / torque, rms | median width / torque rms | smallest certain κ | events "
      "| recipe: width / torque rms | recipe: outside |\n|---|---|---|---|---|---|---|---|---|\n");
  try {
    for (int i = 1; i < count; i += 2) {
      study_halves(words[i], words[i + 1]);
    }
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
