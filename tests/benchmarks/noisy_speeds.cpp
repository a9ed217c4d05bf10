// SPDX-License-Identifier: Apache-2.0
// A study: what noise of the wheel speeds does to the estimates, and what the automatic choice makes of it.
//
//   wheelwright-noisy-speeds [SEEDS]     default 200
//
// A robot of 20 kg drives 60 s with multi-sines under feedback that does not see the noise; speeds are logged at 200 Hz
// with white noise of 2 or 10 mm/s in v1 (and as much at the wheels' rims in turning), wheel torques with noise of 0.02
// N·m, white or autoregressive (0.98 a sample). First-order filter, β = 10 1/s. The robot file declares no noise.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include <fmt/format.h>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/statistics.hpp"
#include "identify/noise_level.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::bench {
namespace {

constexpr double kTorqueNoise = 0.02;  // N·m

class Normal {
 public:
  explicit Normal(std::uint64_t seed) : engine_(seed) {}
  double operator()() {
    const double radius = std::sqrt(-2.0 * std::log(unit()));
    return radius * std::cos(2.0 * std::numbers::pi * unit());
  }

 private:
  double unit() { return (static_cast<double>(engine_() >> 11U) + 0.5) * 0x1.0p-53; }
  std::mt19937_64 engine_;
};

Scenario drive(bool rich) {
  Scenario s;
  s.robot.wheel_radius = 0.1;
  s.robot.track_width = 0.4;
  s.robot.speed_source = model::SpeedSource::measured;
  s.robot.parameters = std::vector<std::string>{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  s.robot.filter = {.order = 1, .alpha = 10.0, .beta = 10.0};
  s.parameters = {.mass = 20.0, .yaw_inertia = 0.8, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  s.trajectory = {.kind = sim::Trajectory::Kind::multi_sine,
                  .speed = rich ? 0.8 : 0.2,
                  .yaw_rate = rich ? 1.6 : 0.6,
                  .period = rich ? 4.0 : 23.0};
  s.duration = 60.0;
  s.rate = 200.0;
  s.sensors.pose = s.sensors.angles = false;
  return s;
}

void add_noise(LogTable& log, const char* column, double sd, double correlation, Normal& normal) {
  double e = normal();
  for (double& value : log.column(column)) {
    value += sd * e;
    e = correlation * e + std::sqrt(1.0 - correlation * correlation) * normal();
  }
}

LogTable without_commands(const LogTable& log) {
  LogTable table = log;
  for (const char* name : {"command_r", "command_l"}) {
    const auto at = std::ranges::find(table.names, name) - table.names.begin();
    table.names.erase(table.names.begin() + at);
    table.columns.erase(table.columns.begin() + at);
  }
  return table;
}

struct Tally {
  int runs = 0;
  double mass_bias = 0.0, mass_square = 0.0, inertia_bias = 0.0, covered = 0.0, intervals = 0.0, mass_covered = 0.0;

  void add(const Eigen::VectorXd& theta, const Eigen::VectorXd& error, double t, const Eigen::VectorXd& truth) {
    ++runs;
    const double mass = theta[0] / truth[0] - 1.0;
    mass_bias += mass;
    mass_square += mass * mass;
    inertia_bias += theta[1] / truth[1] - 1.0;
    for (Eigen::Index j = 0; j < truth.size(); ++j) {
      const double in = std::abs(theta[j] - truth[j]) <= t * error[j] ? 1.0 : 0.0;
      covered += in;
      intervals += 1.0;
      mass_covered += j == 0 ? in : 0.0;
    }
  }
  [[nodiscard]] std::string words() const {
    const double mean = mass_bias / runs;
    return fmt::format("{:8.2f} {:8.2f} {:8.2f} {:9.1f} {:9.1f}", 100.0 * mean,
                       100.0 * std::sqrt(std::max(0.0, mass_square / runs - mean * mean)), 100.0 * inertia_bias / runs,
                       100.0 * mass_covered / runs, 100.0 * covered / intervals);
  }
};

void study(bool rich, double noise, double correlation, bool commands, int seeds) {
  const Scenario scenario = drive(rich);
  const LogTable exact = commands ? sim::simulate(scenario) : without_commands(sim::simulate(scenario));
  const Model model = model::make_model(scenario.robot);
  const Eigen::VectorXd truth = sim::true_parameters(scenario, model);
  // v1 = r (ω_R + ω_L)/2.
  const double of_wheel = noise / scenario.robot.wheel_radius * std::numbers::sqrt2;
  Tally squares, chosen;
  std::map<std::string, int> choices;
  int rejected = 0, tests = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Normal normal(static_cast<std::uint64_t>(seed));
    LogTable table = exact;
    for (const char* column : {"omega_r", "omega_l"}) {
      add_noise(table, column, of_wheel, 0.0, normal);
    }
    for (const char* column : {"tau_r", "tau_l"}) {
      add_noise(table, column, kTorqueNoise, correlation, normal);
    }
    TableSource log(table);
    const commission::Setting setting = commission::settle(log, scenario.robot);
    const commission::Fit fit = commission::fit_log(log, setting, commission::Part::everything, 1e-3);
    const identify::Estimate& ls = fit.choice.candidates.front().estimate;
    const identify::Estimate& best = fit.choice.best();
    squares.add(ls.theta, ls.standard_error, core::student_quantile(0.95, ls.freedom), truth);
    chosen.add(best.theta, best.standard_error, core::student_quantile(0.95, best.freedom), truth);
    ++choices[fmt::format(
        "{}{}", identify::to_string(best.estimator),
        fit.choice.chosen > 0 ? ", " + fit.choice.candidates[fit.choice.chosen].origin.substr(0, 12) : "")];
    tests += fit.choice.tested_against ? 1 : 0;
    rejected += fit.choice.tested_against && fit.choice.test.p_value < 0.05 ? 1 : 0;
  }
  const std::string what = fmt::format("{:6} {:2.0f} mm/s {:5} {:3}", rich ? "rich" : "gentle", 1e3 * noise,
                                       correlation > 0.0 ? "AR" : "white", commands ? "yes" : "no");
  fmt::print("{}  least squares   {}   DWH rejects in {} of {}\n", what, squares.words(), rejected, tests);
  std::string names;
  for (const auto& [name, count] : choices) {
    names += fmt::format("{}{} ({})", names.empty() ? "" : "; ", name, count);
  }
  fmt::print("{}  chosen          {}   {}\n", what, chosen.words(), names);
  std::fflush(stdout);
}

}  // namespace
}  // namespace wheelwright::bench

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 200;
  if (argc > 2 || seeds < 1) {
    fmt::print(stderr, "usage: wheelwright-noisy-speeds [SEEDS]\n");
    return 2;
  }
  fmt::print("seeds 1 to {}; bias and standard deviation in %, share of 95 % intervals that hold the truth in %\n",
             seeds);
  fmt::print("drive  noise  torque cmd  estimator       mass bias   mass sd inertia b.  mass int.  all int.\n");
  for (const double correlation : {0.0, 0.98}) {
    for (const bool commands : {true, false}) {
      for (const bool rich : {false, true}) {
        for (const double noise : {0.002, 0.01}) {
          wheelwright::bench::study(rich, noise, correlation, commands, seeds);
        }
      }
    }
  }
  return 0;
}
