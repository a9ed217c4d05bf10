// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <nlohmann/json.hpp>

#include "gap/next/discrimination.hpp"
#include "gap/rows/drive.hpp"
#include "model/filter/measurement.hpp"
#include "model/sim/simulation.hpp"
#include "results/gap_json.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// Four seconds of a drive, as gap analysis sees it.
gap::Drive drive() {
  Scenario scenario;
  scenario.robot.wheel_radius = 0.1;
  scenario.robot.track_width = 0.4;
  scenario.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  scenario.trajectory = {.kind = sim::Trajectory::Kind::multi_sine, .speed = 0.8, .yaw_rate = 1.6, .period = 2.0};
  scenario.duration = 4.0;
  scenario.rate = 50.0;
  const LogTable log = sim::simulate(scenario);
  core::TableSource source(log);
  const Model model = model::make_model(scenario.robot);
  gap::Drive made =
      gap::make_drive(log, scenario.robot, filter::find_measurement(source, scenario.robot, model, 2), {});
  gap::predict_efforts(made, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())));
  return made;
}

}  // namespace

// Rivals of a gap.json are two or more that a drive can be planned for, with noise that is > 0.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const gap::Drive planned = drive();
  return fuzz::clean([&] {
    const Json json = files::parse_json(fuzz::text_of(data, size), "gap.json");
    std::vector<gap::Effect> catalogue = gap::effect_catalogue();
    gap::PlannedNoise noise{.output = {0.1, 0.1}, .pose = {}};
    const std::vector<gap::Rival> rivals = results::rivals_of_gap(json, "gap.json", catalogue, planned, noise);
    fuzz::require(rivals.size() >= 2 && noise.beta > 0.0 && noise.output.size() == 2);
    fuzz::require(std::ranges::all_of(noise.output, [](double deviation) { return deviation > 0.0; }));
    for (const gap::Rival& rival : rivals) {
      gap::validate(rival, catalogue, planned);
    }
  });
}
