// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/options.hpp"
#include "formats/files/bytes.hpp"
#include "formats/robots/controller_file.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "results/software.hpp"

namespace wheelwright::app {
namespace robot_command {
namespace {

struct Arguments {
  std::filesystem::path urdf, ros2_control, file;
  std::string controller;
  robots::RobotHints hints;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Writes a robot file from what a robot already has: its URDF and the parameters of its ros2_control "
    "diff_drive_controller. Above each value stands where it came from; what cannot be used is an error that says "
    "where it "
    "stands.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright robot --urdf my_robot.urdf --ros2-control controllers.yaml --out-file robot.yaml\n"
    "  wheelwright robot --urdf my_robot.urdf --left left_wheel_joint --right right_wheel_joint > robot.yaml\n"
    "  wheelwright robot --urdf my_robot.urdf --wheel-radius 9.75cm --massless camera_link\n"
    "  wheelwright robot --urdf my_robot.urdf --massless all\n\n"
    "xacro has to be expanded first: xacro my_robot.urdf.xacro > my_robot.urdf.";

robots::RobotWithOrigins made(const Arguments& a) {
  if (a.urdf.empty() && a.ros2_control.empty()) {
    throw InputError("robot: expected at least one of --urdf, --ros2-control");
  }
  if (!a.controller.empty() && a.ros2_control.empty()) {
    throw InputError("--controller: expected --ros2-control FILE with it");
  }
  std::optional<robots::RobotTree> tree;
  if (!a.urdf.empty()) {
    tree = robots::read_urdf(a.urdf);
  }
  std::optional<robots::DriveFacts> controller;
  if (!a.ros2_control.empty()) {
    controller = robots::read_ros2_control(a.ros2_control, a.controller);
  }
  return robots::robot_from(tree ? &*tree : nullptr, controller ? &*controller : nullptr, a.hints);
}

int run(const Arguments& a) {
  if (!a.file.empty() && !a.common.out.empty()) {
    throw InputError("--out-file and --out: two places for one file: expected one of them");
  }
  const std::filesystem::path target = a.common.out.empty() ? a.file : a.common.out / "robot.yaml";
  keep_inputs(target, a.common.read);
  keep_existing(a.common, target);
  leave_standard_output(a.common, target);
  const robots::RobotWithOrigins robot = made(a);
  const std::string text = robots::robot_yaml(robot);
  static_cast<void>(robots::parse_robot(text, target.empty() ? "the robot file" : target.string()));
  if (!target.empty()) {
    make_directory(a.common);
    files::atomic_write(target, text);
  }
  if (a.common.json) {
    say_json(robots::to_json(robot, results::software()));
  } else if (target.empty()) {
    say_lines(text);
  } else if (!a.common.quiet) {
    say("wrote {}\n", target.string());
    for (const std::string& remark : robot.remarks) {
      say("  {}\n", remark);
    }
  }
  return kDone;
}

}  // namespace
}  // namespace robot_command

Run add_robot(CLI::App& program) {
  using namespace robot_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("robot", kHelp);
  command.add_option("--urdf", a->urdf, "Robot description in URDF: geometry, masses, joints")->type_name("FILE");
  command.add_option("--ros2-control", a->ros2_control, "Parameters of a diff_drive_controller (YAML)")
      ->type_name("FILE");
  command.add_option("--controller", a->controller, "Name of the controller, where the file has several")
      ->type_name("NAME");
  command.add_option("--out-file", a->file, "The robot file to write; without it, standard output")->type_name("FILE");
  for (const auto& [name, joints, side] :
       {std::tuple{"--left", &a->hints.left, "left"}, {"--right", &a->hints.right, "right"}}) {
    command.add_option(name, *joints, fmt::format("Joint of the driven wheel on the {} side", side))
        ->type_name("JOINT")
        ->allow_extra_args(false);
  }
  command.add_option("--wheel-radius", a->hints.wheel_radius, "Radius of the wheels, before what the files say, m")
      ->transform(in_unit("m"))
      ->type_name("LENGTH");
  command.add_option("--track-width", a->hints.track_width, "Distance of the wheels, before what the files say, m")
      ->transform(in_unit("m"))
      ->type_name("LENGTH");
  command
      .add_option("--massless", a->hints.massless,
                  "A link that has a shape and no mass (may be repeated); all: every such link")
      ->type_name("LINK")
      ->allow_extra_args(false);
  command.add_option("--name", a->hints.name, "Name of the robot")->type_name("NAME");
  Run added = finish(command, a, kExamples, run);
  command.get_option("--out")->description("Write robot.yaml into this directory");
  return added;
}

}  // namespace wheelwright::app
