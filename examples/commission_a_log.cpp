// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how does one drive of a healthy robot become a detector, and can its bounds be believed?
///
/// A robot is simulated with noisy sensors; its log is commissioned: log → filtered regression → θ̂ → feasible set →
/// thresholds. The truth is known here, so the claim can be tried: every true value lies between its bounds, and the
/// detector is silent on the log that it was made from.
///
///     commission_a_log examples/scenarios/commissioning.yaml
#include <cstdlib>

#include <fmt/format.h>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/physical.hpp>
#include <wheelwright/commission/watch/detector_walk.hpp>
#include <wheelwright/detector/online_model.hpp>
#include <wheelwright/model/sim/simulation.hpp>
#include <wheelwright/results/scenario_file.hpp>

using namespace wheelwright;

int main(int count, char** words) {
  if (count != 2) {
    fmt::print(stderr, "usage: commission_a_log SCENARIO.yaml\n");
    return EXIT_FAILURE;
  }
  // Any LogSource will do: CsvLog for files, TableSource for a table in memory.
  Simulation log(read_scenario(words[1]));
  const Robot& robot = log.scenario().robot;

  const Commissioning result = commission_robot(log, robot);
  fmt::print("{}: {}\n", robot.name, result.message);
  if (result.status != Commissioning::Status::done) {
    return EXIT_FAILURE;
  }

  bool inside = true;
  const Eigen::VectorXd truth = sim::true_parameters(log.scenario(), result.model.model);
  const auto scales =
      commission::physical_scales(robot, result.model.model).value();  // θ_L is r times the physical quantity
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const commission::ParameterResult& p = result.parameters[j];
    const double exact = truth[static_cast<Eigen::Index>(j)], scale = scales[j].scale;
    inside = inside && p.lower <= exact && exact <= p.upper;
    fmt::print("  {:<15} {:8.4f} in [{:.4f}, {:.4f}] {:<10}  truth {:.4f}\n", p.parameter.physical, scale * *p.estimate,
               scale * p.lower, scale * p.upper, p.parameter.physical_unit, scale * exact);
  }
  for (const commission::OutputValidation& v : result.validation) {
    fmt::print("  held out: {} of {} instants outside, residual {:.2f} % of the torque\n", v.outside, v.instants,
               100.0 * v.nrmse);
  }

  const Detection own = detect(log, make_detector(result.model));
  fmt::print("  the detector sees {} faults in {:.0f} s of its own log\n", own.events.size(), own.seconds);
  return inside && own.events.empty() ? EXIT_SUCCESS : EXIT_FAILURE;
}
