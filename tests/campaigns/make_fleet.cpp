// SPDX-License-Identifier: Apache-2.0
//
// make_fleet DIR [--robots N] [--seconds S] [--checks K] [--seed N]: a fleet of simulated robots to measure
// `wheelwright fleet` with.
//
// Parameters are drawn around a nominal robot (lognormal, 5 %); each robot drives the commissioning trajectory for S
// seconds at 100 Hz, and K times again a week apart each. The same arguments give the same files: DIR/fleet.csv,
// DIR/robot.yaml, DIR/logs/.
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/log.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/sim/simulation.hpp"

namespace {

using namespace wheelwright;

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  // Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(unit()));
    return radius * std::cos(2.0 * std::numbers::pi * unit());
  }

 private:
  double unit() { return (static_cast<double>(engine_() >> 11U) + 0.5) * 0x1.0p-53; }
  std::mt19937_64 engine_;
};

Scenario nominal_drive(double seconds) {
  Scenario s;
  s.robot.name = "nominal";
  s.robot.wheel_radius = 0.0975;
  s.robot.track_width = 0.381;
  s.robot.hold = Hold::zero_order;
  s.robot.encoder_counts_per_turn = 4096.0;
  s.robot.noise.effort.value = 0.02;
  s.robot.filter.beta = 8.0;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  s.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 0.6, .yaw_rate = 1.2, .period = seconds / 5.0};
  s.duration = seconds;
  s.rate = 100.0;
  s.sensors.speeds = s.sensors.pose = s.sensors.commands = false;
  s.sensors.encoder_counts_per_turn = 4096.0;
  s.sensors.effort = 0.02;
  return s;
}

void write(const std::filesystem::path& path, const Scenario& scenario) {
  Simulation drive(scenario);
  const auto writer = logs::create_log(path, drive.columns());
  LogBlock block;
  while (drive.next(block)) {
    writer->write(block);
  }
  writer->commit();
}

int make(const std::filesystem::path& directory, std::map<std::string, double> options) {
  const auto robots = static_cast<std::uint64_t>(options["--robots"]);
  const auto checks = static_cast<std::uint64_t>(options["--checks"]);
  std::filesystem::create_directories(directory / "logs");
  const Scenario nominal = nominal_drive(options["--seconds"]);
  robots::write_robot(directory / "robot.yaml", nominal.robot);
  std::string list = "robot,log,when\n";
  for (std::uint64_t i = 0; i < robots; ++i) {
    Draw draw(static_cast<std::uint64_t>(options["--seed"]) * 1000003 + i);
    Scenario s = nominal;
    const auto vary = [&](double& x) { x *= std::exp(0.05 * draw.normal()); };
    vary(s.parameters.mass);
    vary(s.parameters.yaw_inertia);
    vary(s.parameters.viscous_x);
    vary(s.parameters.viscous_yaw);
    s.parameters.viscous_y = s.parameters.viscous_x;
    for (std::uint64_t k = 0; k <= checks; ++k) {
      s.seed = 1 + i * (checks + 1) + k;
      const std::string log = fmt::format("logs/robot_{}_{}.csv", i + 1, k);
      write(directory / log, s);
      list += fmt::format("robot_{},{},{}\n", i + 1, log, 7 * k);
    }
  }
  files::atomic_write(directory / "fleet.csv", list);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::map<std::string, double> options = {{"--robots", 500}, {"--seconds", 30}, {"--checks", 0}, {"--seed", 1}};
  bool good = argc >= 2 && argc % 2 == 0;
  for (int k = 2; good && k + 1 < argc; k += 2) {
    const auto option = options.find(argv[k]);
    const std::string_view text = argv[k + 1];
    good = option != options.end() &&
           std::from_chars(text.data(), text.data() + text.size(), option->second).ptr == text.data() + text.size() &&
           option->second >= 0.0;
  }
  if (!good) {
    fmt::print(stderr, "make_fleet DIR [--robots N] [--seconds S] [--checks K] [--seed N]\n");
    return 2;
  }
  try {
    return make(argv[1], options);
  } catch (const Error& error) {
    fmt::print(stderr, "make_fleet: {}\n", error.what());
    return 2;
  }
}
