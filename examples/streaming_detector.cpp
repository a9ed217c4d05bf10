// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: what runs on the robot, and how soon does it see a tyre that loses air?
///
/// Detector::step takes one sample and gives one decision; after construction it allocates nothing, which is counted
/// here. The claims: silent until the fault begins, an alarm afterwards, no allocation in the loop.
///
///     streaming_detector examples/scenarios/commissioning.yaml examples/scenarios/wheel_radius_fault.yaml
#include <cstdlib>
#include <new>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/detector/detector.hpp>
#include <wheelwright/detector/online_model.hpp>
#include <wheelwright/model/sim/simulation.hpp>
#include <wheelwright/results/scenario_file.hpp>

namespace {
std::size_t allocations = 0;  // since the program began
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) {
    return memory;
  }
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

using namespace wheelwright;

int main(int count, char** words) {
  if (count != 3) {
    fmt::print(stderr, "usage: streaming_detector HEALTHY.yaml FAULT.yaml\n");
    return EXIT_FAILURE;
  }
  Simulation healthy(read_scenario(words[1]));
  const Commissioning commissioned = commission_robot(healthy, healthy.scenario().robot);
  if (commissioned.status != Commissioning::Status::done) {
    fmt::print(stderr, "{}\n", commissioned.message);
    return EXIT_FAILURE;
  }

  // What a robot's control loop would hold.
  Detector detector = make_detector(commissioned.model);
  const std::vector<std::string> wanted = commissioned.model.measurement.columns();
  std::vector<double> sample(wanted.size());

  const Scenario scenario = read_scenario(words[2]);
  const LogTable drive = sim::simulate(scenario);
  std::vector<const std::vector<double>*> columns;
  for (const std::string& name : wanted) {
    columns.push_back(&drive.column(name));
  }

  const double onset = scenario.faults.at(0).profile.onset;
  std::optional<double> alarm;
  double peak = 0.0;  // largest residual over its threshold
  const std::size_t before = allocations;
  for (std::size_t k = 0; k < drive.rows(); ++k) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      sample[c] = (*columns[c])[k];
    }
    const Decision& decision = detector.step(drive.t[k], sample);
    if (decision.valid && decision.fault) {
      alarm = alarm ? alarm : drive.t[k];
      for (const detector::ChannelDecision& channel : decision.channels) {
        peak = std::max(peak, std::abs(channel.residual) / channel.threshold.rho());
      }
    }
  }
  const std::size_t allocated = allocations - before;

  fmt::print("{} steps, {} allocations\n", drive.rows(), allocated);
  if (!alarm) {
    fmt::print("the fault at {:.2f} s was not seen\n", onset);
    return EXIT_FAILURE;
  }
  fmt::print("onset {:.2f} s, alarm {:.2f} s: {:.2f} s later; residual up to {:.2f} times the threshold\n", onset,
             *alarm, *alarm - onset, peak);
  return *alarm >= onset && allocated == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
