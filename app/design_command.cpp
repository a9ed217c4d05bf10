// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/drive_files.hpp"
#include "app/options.hpp"
#include "app/units.hpp"
#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "commission/design/stages.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/online_model_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "gap/effects/effect.hpp"
#include "gap/next/discrimination_design.hpp"
#include "gap/next/further_drive.hpp"
#include "gap/next/named_rivals.hpp"
#include "results/design_json.hpp"
#include "results/gap_json.hpp"
#include "results/report/design_report.hpp"
#include "results/software.hpp"
#include "results/words/design_summary.hpp"

namespace wheelwright::app {
using namespace words;
namespace design_command {
namespace {

struct Arguments {
  std::filesystem::path model, robot;
  std::string aim;
  double duration = 20.0;
  std::optional<double> speed, acceleration, effort, radius;
  std::vector<double> box;
  double rate = 100.0;
  design::WidthCriterion criterion = design::WidthCriterion::geometric_mean;
  design::Promise guarantee = design::Promise::every_noise;
  std::vector<std::string> faults;
  std::filesystem::path gap;
  std::vector<std::string> between, sizes;
  std::size_t stages = design::DesignOptions{}.stages;
  CommonOptions common;
};

constexpr const char* kManoeuvre = "manoeuvre";
constexpr const char* kFigureEight = "figure_eight.csv";

constexpr const char* kHelp =
    "Designs a drive within limits of speed, acceleration, effort, space and time, and writes it as a table of "
    "wheel-speed commands: for the narrowest bounds on the parameters (bounds), or as an inspection that is "
    "certain to find faults that are as small as possible (detection), or to tell apart causes of a sim-to-real gap "
    "(discrimination).";

constexpr const char* kExamples =
    "Limits of a wheel may stand in the robot file, limits: {speed: rad/s, acceleration: rad/s², effort: N·m (or A, "
    "V)}; "
    "options go before them. A speed limit is needed, and one on acceleration or effort. Leave a reserve of effort for "
    "the robot's controller.\n\n"
    "Examples:\n"
    "  wheelwright design --model result/model.json --for bounds --speed 8 --acceleration 20 --radius 1.5 --out plan\n"
    "  wheelwright design --robot robot.yaml --for bounds --duration 30 --box -1 3 -1 1 --out plan\n"
    "  wheelwright design --model result/model.json --for detection --fault wheel_radius=0.03 --speed 8 --acceleration "
    "20\n"
    "  wheelwright design --robot robot.yaml --for bounds --guarantee at-risk --speed 8 --acceleration 20 --duration "
    "60\n"
    "  wheelwright design --robot robot.yaml --for discrimination --gap gap/gap.json --out plan\n"
    "  wheelwright design --robot robot.yaml --for discrimination --between coulomb --between caster_drag --size "
    "coulomb=0.2\n"
    "  then drive plan/manoeuvre.csv (speeds of the wheels), or let the robot's controller drive it:\n"
    "  ros2 bag play plan/manoeuvre_cmd_vel.mcap (TwistStamped on /cmd_vel, Twist on /cmd_vel_unstamped);\n"
    "  or simulate it with trajectory: {kind: table, file: plan/manoeuvre.csv}";

design::MotionLimits limits_from(const Arguments& a, const Robot& robot) {
  design::MotionLimits limits = design::limits_of(robot);
  if (const double shortest = design::shortest_duration(a.stages); a.duration < shortest) {
    throw InputError(fmt::format(
        "--duration {} s: expected at least {} s, since each half of the drive has {} stages (--stages) of speed",
        a.duration, shortest, a.stages));
  }
  limits.duration = a.duration;
  limits.joint_speed = a.speed.value_or(limits.joint_speed);
  limits.joint_acceleration = a.acceleration ? a.acceleration : limits.joint_acceleration;
  limits.effort = a.effort ? a.effort : limits.effort;
  limits.radius = a.radius;
  if (!a.box.empty()) {
    limits.box = {Interval{a.box[0], a.box[1]}, Interval{a.box[2], a.box[3]}};
  }
  return limits;
}

// What is missing of the limits, as a line of the robot file; empty where nothing is.
std::string missing_limits(const Arguments& a, const Robot& robot) {
  const design::MotionLimits own = design::limits_of(robot);
  const bool speed = a.speed || own.joint_speed > 0.0;
  const bool force = a.acceleration || a.effort || own.joint_acceleration || own.effort;
  if (speed && force) {
    return "";
  }
  return fmt::format("\n  limits: {{{}{}{}}}  # of a wheel: {}{}{}; or {}{}{}", speed ? "" : "speed: 8",
                     speed || force ? "" : ", ", force ? "" : "acceleration: 20", speed ? "" : "rad/s",
                     speed || force ? "" : ", ", force ? "" : "rad/s² (or effort, in the unit of the efforts)",
                     speed ? "" : "--speed", speed || force ? "" : " and ",
                     force ? "" : "--acceleration (or --effort)");
}

// What is planned for; what the robot file lacks is told all at once.
design::DesignSubject subject_of(const Arguments& a, const std::optional<OnlineModel>& model) {
  const Robot robot = model ? model->robot : read_robot(a.robot);
  const std::string limits = missing_limits(a, robot);
  const std::string file = (model ? a.model : a.robot).string();
  try {
    design::DesignSubject subject = model ? design::subject_of(*model) : design::subject_of(robot, 1.0 / a.rate);
    if (limits.empty()) {
      return subject;
    }
  } catch (const InvalidArgument& error) {
    throw InputError(file + ": " + error.what() + limits);
  }
  throw InputError(
      file +
      ": no limits: expected in the robot file, each key once, with values of your robot in place of these:" + limits);
}

// NAME or NAME=SIZE of the catalogue; without any, the usual ones.
std::vector<design::InspectedFault> inspected(const Arguments& a, const OnlineModel& model) {
  std::vector<design::InspectedFault> faults;
  const std::vector<design::InspectedFault> usual = design::usual_inspection(model);
  const std::vector<FaultType> catalogue = model::fault_catalogue(model.model, model.estimate, model.robot.effort);
  for (const std::string& text : a.faults) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    design::InspectedFault fault{model::find_fault(catalogue, name), 0.05};
    for (const design::InspectedFault& each : usual) {
      fault.asked = each.fault.name == name ? each.asked : fault.asked;
    }
    if (equals != std::string::npos) {
      fault.asked = quantity(text.substr(equals + 1), fault.fault.unit, "--fault " + text);
      if (!(fault.asked > 0.0)) {
        throw InputError("--fault " + text + ": expected NAME=SIZE with a size > 0");
      }
    }
    faults.push_back(std::move(fault));
  }
  return faults.empty() ? usual : faults;
}

void write_plans(const Arguments& a, const design::DesignSubject& subject, const design::Plan& plan,
                 const std::optional<design::Plan>& eight) {
  if (!a.common.out.empty()) {
    const std::filesystem::path out = gathered(a.common);
    write_drive(out, kManoeuvre, design::command_table(plan, subject.model), subject.robot);
    if (eight) {
      logs::write_csv(out / kFigureEight, design::command_table(*eight, subject.model));
    }
  }
}

void tell(const Arguments& a, const std::string& summary) {
  if (!a.common.quiet && !a.common.json) {
    say_lines(summary);
    if (!a.common.out.empty()) {
      say("wrote {} (speeds of the wheels to drive), design.json and report.html beside it\n",
          (a.common.out / drive_files(kManoeuvre).front()).string());
      if (std::filesystem::exists(a.common.out / drive_files(kManoeuvre).back())) {
        say("  to drive it through the robot's controller: ros2 bag play {}\n",
            (a.common.out / drive_files(kManoeuvre).back()).string());
      }
    }
  }
}

void check_rivals(const Arguments& a) {
  if (a.aim != "discrimination") {
    if (!a.gap.empty() || !a.between.empty() || !a.sizes.empty()) {
      throw InputError("--gap, --between, --size: expected --for discrimination");
    }
  } else if (a.gap.empty() == a.between.empty() || a.between.size() == 1) {
    throw InputError("--for discrimination: expected --gap gap.json, or --between at least twice");
  } else if (!a.gap.empty() && !a.sizes.empty()) {
    throw InputError("--size: expected --between, since gap.json has the sizes");
  }
}

// EFFECT[.PARAMETER]=VALUE.
std::vector<gap::NamedSize> sizes_from(const std::vector<std::string>& texts) {
  std::vector<gap::NamedSize> sizes;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) {
      throw InputError("--size " + text + ": expected EFFECT=VALUE or EFFECT.PARAMETER=VALUE");
    }
    sizes.push_back(
        {text.substr(0, equals),
         [text, equals](const std::string& unit) { return quantity(text.substr(equals + 1), unit, "--size " + text); },
         "--size " + text});
  }
  return sizes;
}

gap::DiscriminationDesign discriminate(const Arguments& a, const design::DesignSubject& subject,
                                       const design::MotionLimits& limits, const design::DesignOptions& options) {
  std::vector<Effect> catalogue = gap::effect_catalogue(subject.model);
  const gap::Drive drive = gap::ordinary_drive(subject, limits);
  gap::PlannedNoise noise = gap::expected_noise(subject);
  const std::vector<gap::Rival> rivals =
      a.gap.empty() ? gap::rivals_named(a.between, "--between ", sizes_from(a.sizes), catalogue, drive)
                    : results::rivals_of_gap(a.gap, catalogue, drive, noise);
  return gap::design_for_discrimination(subject, limits, rivals, catalogue, noise, options);
}

int run(const Arguments& a) {
  const bool detection = a.aim == "detection";
  if (a.model.empty() == a.robot.empty()) {
    throw InputError("expected either --model model.json or --robot robot.yaml");
  }
  if (detection && a.model.empty()) {
    throw InputError("--for detection: expected --model model.json, since what is certain depends on its feasible set");
  }
  if (!detection && !a.faults.empty()) {
    throw InputError("--fault: expected --for detection");
  }
  if (a.aim == "discrimination" && a.guarantee == design::Promise::at_risk) {
    throw InputError("--guarantee at-risk: expected --for bounds or detection; telling causes apart is statistical");
  }
  check_rivals(a);
  std::vector<std::string> written = {"design.json", kFigureEight};
  for (const std::string& file : drive_files(kManoeuvre)) {
    written.push_back(file);
  }
  make_directory(a.common, written);
  const std::optional<OnlineModel> model = a.model.empty() ? std::nullopt : std::optional(read_model(a.model));
  design::DesignSubject subject = subject_of(a, model);
  if (a.guarantee == design::Promise::at_risk && !subject.averaging) {
    throw InputError(
        "--guarantee at-risk: no errors are known to average out: expected noise: {effort: {bound: …, bias: …}} in the "
        "robot file, or a model that says something at a stated risk (docs/methods/risk.md)");
  }
  design::MotionLimits limits = limits_from(a, subject.robot);
  if (a.aim == "discrimination") {
    limits = gap::limits_in_torques(limits, subject);
    subject = gap::in_torques(subject);
  }
  Progress progress(a.common.quiet);
  design::DesignOptions options;
  options.guarantee = a.guarantee;
  options.stages = a.stages;
  options.seed = a.common.seed;
  options.threads = static_cast<std::size_t>(a.common.threads);
  options.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  report::ReportContext context;
  context.software = results::software();
  context.command_line = a.common.command_line;
  context.seeds = {{"search", a.common.seed}};
  const auto finish = [&](Json result, const auto& design, const std::string& words) {
    result["software"] = results::software();
    result["seed"] = a.common.seed;
    result["warrant"] = core::warrant_word(subject.warrant);
    write_plans(a, subject, design.manoeuvre.plan, design.figure_eight_plan);
    publish(a.common, result, "design.json", report::design_report(design, subject, limits, context));
    tell(a, words + fmt::format("  these promises are {}\n", core::warrant_word(subject.warrant)));
  };
  if (detection) {
    const design::DetectionDesign design = design::design_for_detection(
        *model, subject, limits, inspected(a, *model), design::sized_for(design::PlanCost::walk_each, options));
    finish(results::to_json(design, limits), design, summary(design));
  } else if (a.aim == "discrimination") {
    const gap::DiscriminationDesign design =
        discriminate(a, subject, limits, design::sized_for(design::PlanCost::walk_each, options));
    finish(results::to_json(design, limits), design, summary(design));
  } else {
    const design::BoundsDesign design = design::design_for_bounds(
        subject, limits, a.criterion, design::sized_for(design::cost_of_bounds(a.guarantee), options));
    finish(results::to_json(design, subject, limits), design, summary(design, subject));
  }
  return kDone;
}

}  // namespace
}  // namespace design_command

Run add_design(CLI::App& program) {
  using namespace design_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("design", kHelp);
  command.add_option("--for", a->aim, "What the drive is for: bounds, detection or discrimination")
      ->required()
      ->check(CLI::IsMember({"bounds", "detection", "discrimination"}));
  command.add_option("--model", a->model, "model.json of a commissioning: parameters, noise and filter")
      ->type_name("FILE");
  command
      .add_option("--robot", a->robot,
                  "Robot file, before there is a model: nominal values, declared noise; a filter that "
                  "it leaves open has β = 10 1/s")
      ->type_name("FILE");
  command.add_option("--duration", a->duration, "Length of the drive, s")
      ->transform(in_unit("s"))
      ->type_name("S")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  command.add_option("--speed", a->speed, "Largest wheel speed, rad/s (single axis: its own unit)")
      ->transform(in_unit("rad/s"))
      ->type_name("X")
      ->check(CLI::PositiveNumber);
  command.add_option("--acceleration", a->acceleration, "Largest wheel acceleration, rad/s²")
      ->transform(in_unit("rad/s²"))
      ->type_name("X")
      ->check(CLI::PositiveNumber);
  command.add_option("--effort", a->effort, "Largest effort of a wheel, N·m (or A, V, as in the robot file)")
      ->type_name("X")
      ->check(CLI::PositiveNumber);
  command.add_option("--radius", a->radius, "Largest distance from the start, m")
      ->transform(in_unit("m"))
      ->type_name("M")
      ->check(CLI::PositiveNumber);
  command.add_option("--box", a->box, "Room seen from the start, m: x ahead, y to the left")
      ->transform(in_unit("m"))
      ->type_name("XMIN XMAX YMIN YMAX")
      ->expected(4);
  command.add_option("--rate", a->rate, "Samples per second of the log to come, Hz (with --robot; a model knows)")
      ->transform(in_unit("Hz"))
      ->type_name("HZ")
      ->check(CLI::Range(5.0, 5000.0))
      ->capture_default_str();
  command
      .add_option("--criterion", a->criterion,
                  "Relative widths are judged by their geometric_mean, their mean, or the largest")
      ->transform(CLI::CheckedTransformer(std::map<std::string, design::WidthCriterion>{
                                              {"geometric_mean", design::WidthCriterion::geometric_mean},
                                              {"mean", design::WidthCriterion::mean},
                                              {"largest", design::WidthCriterion::largest}})
                      .description("{geometric_mean,mean,largest}"))
      ->default_str("geometric_mean");
  command
      .add_option("--guarantee", a->guarantee,
                  "The promise that is to be good: for every-noise within its bounds, or at-risk, where errors average "
                  "out (docs/methods/risk.md); both are told")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, design::Promise>{{"every-noise", design::Promise::every_noise},
                                                                         {"at-risk", design::Promise::at_risk}})
              .description("{every-noise,at-risk}"))
      ->default_str("every-noise");
  command
      .add_option("--fault", a->faults,
                  "With --for detection: a fault of the catalogue and the size asked for (may be repeated); without it "
                  "wheel radii, efforts lost, encoders' scale")
      ->type_name("NAME[=SIZE]")
      ->allow_extra_args(false);
  command.add_option("--gap", a->gap, "With --for discrimination: gap.json, whose credible set is to be told apart")
      ->type_name("FILE");
  command
      .add_option(
          "--between", a->between,
          "With --for discrimination: a cause, or several joined by +, to be told from the others (twice or more)")
      ->type_name("EFFECT")
      ->allow_extra_args(false);
  command
      .add_option(
          "--size", a->sizes,
          "Size of a cause named with --between; without it a twentieth of the drive's efforts (may be repeated)")
      ->type_name("EFFECT[.PARAMETER]=VALUE")
      ->allow_extra_args(false);
  command.add_option("--stages", a->stages, "Stages of constant speed in each half of the drive")
      ->type_name("N")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app
