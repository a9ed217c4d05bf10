// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how is a sim-to-real gap traced to an effect that the toolkit has never heard of?
///
/// One Effect filled in: its columns are the additional efforts that it asks for, per unit of each of its coefficients.
/// Here cogging: six magnets a turn pull each wheel's motor forwards and back, τ = a sin 6φ + b cos 6φ. A robot is
/// simulated twice, healthy and with cogging torque in its log, and the gap between the two is searched with the
/// catalogue that ships and the effect beside it. The claim: the diagnosis names it and finds its size. Without it in
/// the catalogue, the log is called unexplained.
///
///     diagnose_a_gap examples/scenarios/commissioning.yaml
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include <wheelwright/gap/diagnose.hpp>
#include <wheelwright/gap/effects/effect.hpp>
#include <wheelwright/model/sim/simulation.hpp>
#include <wheelwright/results/scenario_file.hpp>

using namespace wheelwright;

namespace {

constexpr double kMagnets = 6.0, kTruth = 0.15;  // N·m

Effect cogging() {
  Effect effect;
  effect.name = "cogging";
  effect.sentence = "The magnets of the motors pull the wheels into six places a turn.";
  effect.parameters = {{"a", "N·m"}, {"b", "N·m"}};
  effect.excite = "drive slowly for several turns of the wheels";
  effect.columns = [](const gap::Drive& drive, std::span<const double>) {
    std::vector<Eigen::VectorXd> sine, cosine;
    for (const gap::JointSignals& joint : drive.joints) {
      sine.emplace_back((kMagnets * joint.angle.array()).sin());
      cosine.emplace_back((kMagnets * joint.angle.array()).cos());
    }
    return std::vector<gap::Column>{gap::catalogue::at_joints(drive, sine), gap::catalogue::at_joints(drive, cosine)};
  };
  return effect;
}

/// A minute of driving, slowly enough for the filter to pass six periods a turn; cogging is what the motors must
/// overcome.
LogTable drive(Scenario scenario, double torque, std::uint64_t seed) {
  scenario.duration = 60.0;
  scenario.seed = seed;
  scenario.trajectory.speed = 0.15;
  scenario.trajectory.yaw_rate = 0.6;
  scenario.sensors.angles = true;
  Simulation simulation(scenario);
  LogTable log = read_all(simulation);
  for (const char* side : {"r", "l"}) {
    const std::vector<double>& angle = log.column(std::string("phi_") + side);
    std::vector<double>& effort = log.column(std::string("tau_") + side);
    for (std::size_t k = 0; k < log.rows(); ++k) {
      effort[k] += torque * std::sin(kMagnets * angle[k]);
    }
  }
  return log;
}

Diagnosis diagnosed(const LogTable& log, const LogTable& healthy, const Robot& robot, std::vector<Effect> catalogue) {
  gap::DiagnoseOptions options;
  options.catalogue = std::move(catalogue);
  options.shrink = false;
  TableSource real(log), baseline(healthy);
  return diagnose(real, &baseline, robot, options);
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    fmt::print(stderr, "usage: diagnose_a_gap SCENARIO.yaml\n");
    return EXIT_FAILURE;
  }
  const Scenario scenario = read_scenario(words[1]);
  const LogTable healthy = drive(scenario, 0.0, 1), log = drive(scenario, kTruth, 2);
  std::vector<Effect> catalogue = gap::effect_catalogue();
  const Diagnosis before = diagnosed(log, healthy, scenario.robot, catalogue);
  catalogue.push_back(cogging());
  const Diagnosis after = diagnosed(log, healthy, scenario.robot, catalogue);

  fmt::print("with the catalogue as it is: {}\n",
             before.verdict == gap::GapVerdict::unexplained ? "unexplained" : "taken for something else");
  bool found = after.verdict == gap::GapVerdict::explained && after.causes.size() == 1;
  for (const gap::GapCause& cause : after.causes) {
    fmt::print("with cogging in it: {}, {:.0f} % of the gap\n", cause.effect, 100.0 * cause.share);
    for (const gap::GapEstimate& p : cause.parameters) {
      fmt::print("  {} = {:.4f} in [{:.4f}, {:.4f}] {}\n", p.name, p.estimate, p.lower, p.upper, p.unit);
    }
    found = found && cause.effect == "cogging" && cause.parameters[0].lower <= kTruth &&
            kTruth <= cause.parameters[0].upper;
  }
  return found && before.verdict == gap::GapVerdict::unexplained ? EXIT_SUCCESS : EXIT_FAILURE;
}
