// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>

#include "results/study_json.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// A folder with a scenario of half a second, which a study may name.
std::filesystem::path folder() {
  const std::filesystem::path made = fuzz::folder_on_disk(".study");
  std::ofstream(made / "scenario.yaml")
      << "robot: {model: differential_drive, wheel_radius: 0.1, track_width: 0.4, effort: {kind: torque, hold: "
         "zero_order}, prior: {mass: [5, 60]}, noise: {wheel_speed: 0.02, effort: 0.02}, filter: {order: 2, alpha: 20, "
         "beta: 20}}\n"
         "parameters: {mass: 21, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}\n"
         "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 1}\n"
         "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02}\nduration: 0.5\nrate: 50\n";
  return made;
}

}  // namespace

// What a study that is read varies has a range, and a value in it.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path beside = folder();
  return fuzz::clean([&] {
    const results::StudyFile read =
        results::parse_study(fuzz::text_of(data, size, fuzz::kLongestYaml), "study.yaml", beside);
    fuzz::require(!read.study.inputs.empty() && !read.study.quantities.empty());
    for (const study::StudyInput& input : read.study.inputs) {
      study::validate(input);
    }
  });
}
