// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <nlohmann/json.hpp>

#include "formats/robots/simulator_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// A bit of everything that can be changed; without `wheels` the radii stay.
model::SimulatorChange change(bool wheels) {
  model::SimulatorChange more;
  for (const char* const member : {"mass", "yaw_inertia", "moment_ahead", "dry_friction", "damping", "armature",
                                   "track_factor", "gain", "effort_limit"}) {
    more.because[member] = "a_cause";
  }
  more.mass = 1.0;
  more.yaw_inertia = 0.1;
  more.moment_ahead = 0.1;
  more.dry_friction.setConstant(0.1);
  more.damping.setConstant(0.01);
  more.armature.setConstant(0.001);
  more.track_factor = 1.03;
  more.gain.setConstant(0.9);
  more.effort_limit = 5.0;
  if (wheels) {
    more.because["radius_factor"] = "a_cause";
    more.radius_factor.setConstant(1.02);
  }
  return more;
}

}  // namespace

// MJCF, SDF or URDF: without a change the file stays to the last byte. With one, what is written again without a change
// stays as well, and has the same wheels. (Wheels of very different radii share no axle when both have grown by 2 %.)
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(fuzz::text_of(data, size));
  const auto has = [&](const char* word) { return text.find(word) != std::string::npos; };
  const robots::SimulatorFormat format = has("<mujoco") ? robots::SimulatorFormat::mjcf
                                         : has("<sdf")  ? robots::SimulatorFormat::sdf
                                                        : robots::SimulatorFormat::urdf;
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  return fuzz::clean([&] {
    const robots::EditedSimulator same = robots::edit_simulator(format, text, "robot.xml", {}, robot);
    fuzz::require(same.text == text && same.changed.empty());
    const robots::EditedSimulator edited = robots::edit_simulator(format, text, "robot.xml", change(false), robot);
    static_cast<void>(robots::edit_simulator(format, text, "robot.xml", change(true), robot));
    fuzz::promised([&] {
      const robots::EditedSimulator again = robots::edit_simulator(format, edited.text, "again.xml", {}, robot);
      fuzz::require(again.text == edited.text && again.left == edited.left && again.right == edited.right);
    });
  });
}
