// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how much tighter is the polytope than its box, and the two-sided test than the paper's symmetric ρ?
///
/// A fault ζ is certain to be found where |ζ| exceeds u − l (two-sided) or 2ρ (symmetric), so these are compared, at
/// every instant of one healthy drive. The claims: polytope <= box, two-sided <= symmetric, and none raises an alarm.
///
///     thresholds examples/scenarios/commissioning.yaml examples/scenarios/healthy.yaml
#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/detector/detector_options.hpp>
#include <wheelwright/detector/threshold.hpp>
#include <wheelwright/model/filter/row_stream.hpp>
#include <wheelwright/model/sim/simulation.hpp>
#include <wheelwright/results/scenario_file.hpp>

using namespace wheelwright;

namespace {

constexpr std::array kKinds = {"polytope, two-sided", "polytope, symmetric", "box, two-sided", "box, symmetric"};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    fmt::print(stderr, "usage: thresholds COMMISSIONING.yaml HEALTHY.yaml\n");
    return EXIT_FAILURE;
  }
  Simulation log(read_scenario(words[1]));
  const OnlineModel model = commission_robot(log, log.scenario().robot).model;
  if (model.facets.empty()) {
    fmt::print(stderr, "the log made no model\n");
    return EXIT_FAILURE;
  }
  const Polytope set(model.facets, model.box);
  const detector::ThresholdRule polytope(set, model.estimate, detector::ParameterSetKind::polytope);
  const detector::ThresholdRule box(set, model.estimate, detector::ParameterSetKind::box);

  Simulation drive(read_scenario(words[2]));
  TorqueRows stream(drive, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
  const RegressionBlock rows = read_all(stream);
  const std::size_t n = rows.outputs, p = rows.parameters;

  bool ordered = true;
  std::size_t alarms = 0;
  std::vector<std::array<std::vector<double>, 4>> width(n);  // per output and kind, over time
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const std::span<const double> y(rows.Y.row(row).data(), p), dy(rows.dY.row(row).data(), p);
    const std::size_t channel = static_cast<std::size_t>(row) % n;
    const detector::Threshold tight = polytope.at(y, dy, rows.dy[row], channel), loose = box.at(y, dy, rows.dy[row]);
    const std::array of_kind = {tight.width(), 2.0 * tight.rho(), loose.width(), 2.0 * loose.rho()};
    ordered = ordered && of_kind[0] <= of_kind[1] && of_kind[2] <= of_kind[3] && of_kind[0] <= of_kind[2] &&
              of_kind[1] <= of_kind[3];
    const double residual = rows.y[row] - rows.Y.row(row).dot(model.estimate);
    alarms += residual < tight.lower || residual > tight.upper ? 1 : 0;  // the tightest: the others follow
    for (std::size_t kind = 0; kind < of_kind.size(); ++kind) {
      width[static_cast<std::size_t>(row) % n][kind].push_back(of_kind[kind]);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    fmt::print("{} channel, median over {} instants\n", model.model.outputs[i], rows.instants());
    const double loosest = median(width[i][3]);
    for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
      const double middle = median(width[i][kind]);
      fmt::print("  {:<20} {:.4f} {}  {:3.0f} %\n", kKinds[kind], middle, model.model.output_units[i],
                 100.0 * middle / loosest);
    }
  }
  fmt::print("{} instants outside the tightest\n", alarms);
  return ordered && alarms == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
