// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/sound_log.hpp"
#include "commission/doctor/log_health.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "formats/logs/bag.hpp"
#include "formats/robots/controller_file.hpp"
#include "formats/robots/online_model_file.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "identify/inference/kinematic_calibration.hpp"
#include "model/model.hpp"
#include "results/report/page.hpp"
#include "results/software.hpp"
#include "results/words/commission_summary.hpp"

namespace wheelwright::app {
namespace try_command {
namespace {

using robots::RobotWithOrigins;

struct Arguments {
  std::vector<std::filesystem::path> logs;
  std::filesystem::path urdf, ros2_control, robot;
  robots::RobotHints hints;
  CommonOptions common;
};

constexpr const char* kHelp =
    "From a recording to an answer, without a robot file: finds topics, joints and sides, the kind of effort and how "
    "it "
    "is held, encoder counts, and the geometry (from --urdf, a robot description in the recording, or odometry or a "
    "pose in it), and says where each came from. Then it runs doctor, commission, margins and, where the robot's mass "
    "is known, gap, and leaves one page that begins with the answer.\n\n"
    "What was settled goes to DIR/robot.yaml: later runs with the same --out, and every other command with --robot "
    "DIR/robot.yaml, need no option twice, --map included. Edit it where it is wrong; options of the geometry settle "
    "it "
    "anew.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright try this_morning/ --urdf my_robot.urdf\n"
    "  wheelwright try drive.csv --wheel-radius 9.75cm --track-width 38.1cm --out result\n"
    "  then wheelwright detect this_afternoon/ --model result/commission/model.json\n\n"
    "Exit code: 0 a model was made, 1 none could be made of this log (the page says why and what to do), 2 bad input.";

constexpr std::size_t kMessages = 200000;  // that are looked at for a robot description
constexpr double kStartRadius = 0.1;       // m, where a search for the geometry begins
constexpr double kStartTrack = 0.4;        // m
constexpr double kHalfAStep = 0.25;        // of a step, about half a one

/// The text on a topic .../robot_description (std_msgs/String) of a recording; empty where there is none.
std::string description_in(const std::vector<std::filesystem::path>& paths, const CommonOptions& common) {
  constexpr std::size_t header = 8;  // of CDR, and of the string
  for (const std::filesystem::path& path : paths) {
    if (!logs::is_bag(path)) {
      continue;
    }
    const auto bag = logs::open_bag({path}, {.msg_path = common.msg_path, .hashed = false, .trust = common.trust});
    logs::BagMessage message;
    for (std::size_t k = 0; k < kMessages && bag->next(message); ++k) {
      const logs::BagTopic& topic = bag->topics()[message.topic];
      if (topic.type == "std_msgs/msg/String" && topic.name.ends_with("robot_description") &&
          message.data.size() > header && message.data[1] == 1) {
        std::uint32_t length = 0;
        std::memcpy(&length, message.data.data() + 4, sizeof length);
        const std::string text(message.data.substr(header, length));
        return text.substr(0, text.find('\0'));
      }
    }
  }
  return {};
}

/// The first topic with an odometry's pose in it; empty where there is none.
std::string odometry_in(const logs::LogReport& report) {
  constexpr std::string_view field = ".pose.pose.position.x";
  for (const logs::LogFileReport& file : report.files) {
    for (const std::string& name : file.header) {
      if (name.ends_with(field)) {
        return name.substr(0, name.size() - field.size());
      }
    }
  }
  return {};
}

/// Speeds beside angles, by central differences, for the search of the geometry.
void add_speeds(LogTable& log) {
  for (const std::string side : {"r", "l"}) {
    const std::vector<double>* const angle = log.find("phi_" + side);
    if (angle == nullptr || log.find("omega_" + side) != nullptr) {
      continue;
    }
    const std::vector<double>& phi = *angle;
    std::vector<double> omega(phi.size(), 0.0);
    for (std::size_t k = 1; k + 1 < phi.size(); ++k) {
      const double h = log.t[k + 1] - log.t[k - 1];
      omega[k] = h > 0.0 ? (phi[k + 1] - phi[k - 1]) / h : 0.0;
    }
    log.names.push_back("omega_" + side);
    log.columns.push_back(std::move(omega));
  }
}

/// Radius and track that odometry or a pose in the log shows.
void geometry_from_log(const Arguments& a, RobotWithOrigins& made) {
  logs::LogOptions reader = reader_options(a.common);
  auto log = logs::open_log(a.logs, reader);
  std::string from = "the pose in the log";
  if (const std::string topic = odometry_in(log->report()); !topic.empty() && !log->find("theta")) {
    for (const char* axis : {"x", "y"}) {
      reader.map[axis] = fmt::format("{}.pose.pose.position.{}", topic, axis);
    }
    reader.map["theta"] = topic + ".pose.pose.orientation.yaw";
    log = logs::open_log(a.logs, reader);
    from = topic;
  }
  LogTable table = read_all(*log, kExaminedRows);
  add_speeds(table);
  const auto has = [&](const char* name) { return table.find(name) != nullptr; };
  const std::string wanted =
      "expected --urdf FILE, or --wheel-radius and --track-width: neither a robot description nor a pose in the log "
      "gives them";
  if (!has("theta") || !has("x") || !has("y") || !has("omega_r") || !has("omega_l")) {
    throw InputError(wanted);
  }
  inference::KinematicOptions options;
  options.wheel_radius = a.hints.wheel_radius.value_or(kStartRadius);
  options.track_width = a.hints.track_width.value_or(kStartTrack);
  const inference::KinematicCalibration found = inference::calibrate_kinematics(table, options);
  if (!found.converged || found.radius_right.state != inference::KinematicState::identified ||
      found.track_width.state != inference::KinematicState::identified) {
    throw InputError(wanted + " for certain");
  }
  const auto rounded = [](double metres) { return std::round(1e5 * metres) / 1e5; };
  const auto settle = [&](const char* key, const std::optional<double>& given, double value, double& of_robot) {
    of_robot = given.value_or(rounded(value));
    made.origins[key] = given ? "given" : fmt::format("{:.4g} m by the wheels and {}", value, from);
  };
  settle("wheel_radius", a.hints.wheel_radius, 0.5 * (found.radius_right.estimate + found.radius_left.estimate),
         made.robot.wheel_radius);
  settle("track_width", a.hints.track_width, found.track_width.estimate, made.robot.track_width);
}

RobotWithOrigins geometry(const Arguments& a) {
  std::optional<robots::DriveFacts> controller;
  if (!a.ros2_control.empty()) {
    controller = robots::read_ros2_control(a.ros2_control, "");
  }
  std::optional<robots::RobotTree> tree;
  if (!a.urdf.empty()) {
    tree = robots::read_urdf(a.urdf);
  } else if (const std::string text = description_in(a.logs, a.common); !text.empty()) {
    tree = robots::parse_urdf(text, a.logs.front().string() + " robot_description");
  }
  if (tree || controller) {
    return robots::robot_from(tree ? &*tree : nullptr, controller ? &*controller : nullptr, a.hints);
  }
  RobotWithOrigins made;
  made.robot.name = a.logs.front().stem().string();
  made.robot.model = "differential_drive";
  made.files = {a.logs.front().string()};
  if (a.hints.wheel_radius && a.hints.track_width) {
    made.robot.wheel_radius = *a.hints.wheel_radius;
    made.robot.track_width = *a.hints.track_width;
    made.origins = {{"wheel_radius", "given"}, {"track_width", "given"}};
  } else {
    geometry_from_log(a, made);
  }
  return made;
}

/// Whether the log has the efforts of all joints of `robot`, of this kind.
bool has_efforts(const LogSource& log, const Robot& robot, model::EffortKind kind) {
  return std::ranges::all_of(model::make_model(robot).joints, [&](const model::Joint& joint) {
    return log.find(model::effort_column(joint, kind)).has_value();
  });
}

/// Kind and hold of the efforts, and encoder counts, as the log shows them.
void settle_from_log(const Arguments& a, RobotWithOrigins& made) {
  const auto log = logs::open_log(a.logs, reader_options(a.common));
  Robot& robot = made.robot;
  for (const auto kind : {model::EffortKind::torque, model::EffortKind::current, model::EffortKind::voltage}) {
    if (has_efforts(*log, robot, kind)) {
      robot.effort = kind;
      break;
    }
  }
  made.origins["effort.kind"] = "by the columns of the log";
  const LogTable table = read_all(*log, kExaminedRows);
  const doctor::LogHealth health = doctor::examine(table, robot);
  const doctor::LogFinding* delay = health.find("time.effort_delay");
  if (delay != nullptr && health.median_step > 0.0) {
    const double steps = delay->value / health.median_step;
    if (robot.hold == Hold::first_order && std::abs(steps + 0.5) < kHalfAStep) {
      robot.hold = Hold::zero_order;
      made.origins["effort.hold"] = "efforts come half a step before the motion: commands that are held";
    } else if (robot.hold == Hold::zero_order && std::abs(steps - 0.5) < kHalfAStep) {
      robot.hold = Hold::first_order;
      made.origins["effort.hold"] = "efforts come half a step after the motion if they are held: they are measured";
    } else if (delay->taken) {
      robot.effort_delay = *delay->taken;
      made.origins["effort.delay"] =
          fmt::format("{:g} to {:g} s: {}", delay->taken->lower, delay->taken->upper, delay->sentence);
    }
  }
  const auto smoothed =
      std::ranges::find_if(health.findings, [](const doctor::LogFinding& f) { return f.effort_smoothing.has_value(); });
  if (smoothed != health.findings.end() && (smoothed->id != "time.effort_delay" || robot.effort_delay != Interval{})) {
    robot.effort_smoothing = *smoothed->effort_smoothing;
    made.origins["effort.smoothing"] = smoothed->sentence;
  }
  if (health.clock) {
    robot.clock = health.clock;
    made.origins["clock"] = health.find("time.even_clock")->sentence;
  }
  if (const doctor::LogFinding* encoder = health.find("signals.encoder");
      encoder != nullptr && !robot.encoder_counts_per_turn) {
    robot.encoder_counts_per_turn = encoder->value;
    made.origins["encoder_counts_per_turn"] = encoder->sentence;
  }
}

/// What the runs of other commands came to.
struct Page {
  report::PageContent content;
  bool model = false;

  void section(const std::string& name, const std::vector<std::string>& sentences) {
    content.sections.push_back(
        {name, name,
         report::bullets(sentences) + report::paragraph(fmt::format("<a href=\"{0}/report.html\">All that "
                                                                    "<code>{0}</code> says</a>",
                                                                    name))});
  }
};

// A robot file that stands for a run that did not come to its end, and would be taken for the user's.
class Unfinished {
 public:
  explicit Unfinished(std::filesystem::path file) : file_(std::move(file)), mine_(!std::filesystem::exists(file_)) {
    if (std::ifstream in(file_, std::ios::binary); std::filesystem::is_regular_file(file_)) {
      before_ = std::string(std::istreambuf_iterator<char>(in), {});
    }
  }
  ~Unfinished() {
    try {
      if (before_) {
        files::atomic_write(file_, *before_);
      } else if (mine_) {
        std::filesystem::remove(file_);
      }
    } catch (const std::exception&) {  // what went wrong is told already
    }
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  void keep() {
    mine_ = false;
    before_.reset();
  }

 private:
  std::filesystem::path file_;
  bool mine_;
  std::optional<std::string> before_;
};

/// Runs another command with its own options; false, with the reason in `why`, where it refuses.
bool call(Run (*add)(CLI::App&), std::vector<std::string> words, std::string& why) {
  CLI::App program;
  const Run run = add(program);
  std::string line = "wheelwright";
  for (const std::string& word : words) {
    line += " " + word;
  }
  std::ranges::reverse(words);
  try {
    program.parse(std::move(words));
    (void)run(line);
    return true;
  } catch (const Error& error) {
    why = error.what();
    return false;
  }
}

/// "mass 21.01 [20.95, 21.04] kg (extrapolated)".
std::vector<std::string> quantities(const Json& model) {
  std::vector<std::string> out;
  const Json physical = model.value("physical", Json::object());
  for (const auto& [name, of] : physical.items()) {
    if (of.at("estimate").is_number() && of.at("lower").is_number() && of.at("upper").is_number()) {
      const std::string word =
          model.contains("little_learned") ? "" : model.value("warrant", std::string("extrapolated")) + " ";
      out.push_back(fmt::format("{} {:.4g} {}, {}between {:.4g} and {:.4g}", name, of.at("estimate").get<double>(),
                                of.at("unit").get<std::string>(), word, of.at("lower").get<double>(),
                                of.at("upper").get<double>()));
    }
  }
  return out;
}

std::string smallest_change(const Json& model, const Robot& robot) {
  double least = std::numeric_limits<double>::infinity();
  for (const Json& output : model.at("validation").value("outputs", Json::array())) {
    if (const auto kappa = output.find("smallest_certain_kappa"); kappa != output.end() && kappa->is_number()) {
      least = std::min(least, kappa->get<double>());
    }
  }
  return std::isfinite(least) ? words::smallest_fault(robot, least) : "";
}

std::vector<std::string> troubles(const Json& doctor, const std::string& severity) {
  std::vector<std::string> out;
  for (const Json& finding : doctor.at("findings")) {
    if (finding.at("severity") == severity) {
      out.push_back(
          fmt::format("{} {}", finding.at("sentence").get<std::string>(), finding.at("next").get<std::string>()));
    }
  }
  return out;
}

int run(const Arguments& given) {
  Arguments a = given;
  a.common.out = a.common.out.empty() ? "wheelwright_try" : a.common.out;
  const std::filesystem::path& out = a.common.out;
  const std::filesystem::path file = out / "robot.yaml";
  std::vector<std::string> took;
  Robot robot;
  const bool anew = !a.urdf.empty() || !a.ros2_control.empty() || a.hints.wheel_radius || a.hints.track_width;
  if (a.robot.empty() && !anew && std::filesystem::exists(file)) {
    a.robot = file;
    take_columns(a.robot, a.common);
  }
  if (!a.robot.empty()) {
    robot = read_robot(a.robot);
    took.push_back(fmt::format("robot file: {}", a.robot.string()));
  }
  std::string yaml;
  if (a.robot.empty()) {
    RobotWithOrigins made = geometry(a);
    if (!made.columns.empty()) {
      took.push_back(fmt::format("joints: {}", made.origins["columns"]));
      a.common.columns.merge(std::exchange(made.columns, {}));
    }
    settle_from_log(a, made);
    for (const logs::LogOptions reader = reader_options(a.common); const auto& [name, column] : reader.map) {
      a.common.columns[name] = column;
    }
    robot = made.robot;
    yaml = robots::robot_yaml(made) + robots::columns_yaml(a.common.columns);
    for (const char* key : {"wheel_radius", "track_width", "nominal.mass", "effort.kind", "effort.hold", "effort.delay",
                            "effort.smoothing", "clock", "encoder_counts_per_turn"}) {
      if (const auto origin = made.origins.find(key);
          origin != made.origins.end() &&
          (std::string_view(key) != "effort.delay" || robot.effort_delay != Interval{})) {
        took.push_back(fmt::format("{}: {}", key, origin->second));
      }
    }
    took.insert(took.end(), made.remarks.begin(), made.remarks.end());
  }
  const auto log = open_robot_log(a.logs, robot, a.common);
  took.push_back(fmt::format("columns of the log: {}", core::listed(log->columns())));
  const std::vector<std::string> read = logs::sentences(log->report());
  took.insert(took.end(), read.begin(), read.end());
  std::optional<Unfinished> unfinished;
  make_directory(a.common, yaml.empty() ? std::vector<std::string>{"try.json"}
                                        : std::vector<std::string>{"try.json", "robot.yaml"});
  if (!yaml.empty()) {
    static_cast<void>(robots::parse_robot(yaml, file.string()));
    unfinished.emplace(file);
    files::atomic_write(file, yaml);
    a.robot = file;
  }
  const auto words = [&](const std::string& command, const std::vector<std::string>& options, std::size_t most_logs) {
    std::vector<std::string> line{command};
    for (std::size_t k = 0; k < std::min(most_logs, a.logs.size()); ++k) {
      line.push_back(a.logs[k].string());
    }
    line.insert(line.end(), options.begin(), options.end());
    for (const std::string& map : a.common.map) {
      line.insert(line.end(), {"--map", map});
    }
    for (const std::filesystem::path& path : a.common.msg_path) {
      line.insert(line.end(), {"--msg-path", path.string()});
    }
    for (const auto& [wanted, option] : {std::pair(a.common.trust, "--trust"), {a.common.force, "--force"}}) {
      if (wanted) {
        line.emplace_back(option);
      }
    }
    line.insert(line.end(), {"--out", (out / command).string(), "--quiet", "--threads",
                             std::to_string(a.common.threads), "--seed", std::to_string(a.common.seed)});
    return line;
  };
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  const std::vector<std::string> with_robot = {"--robot", a.robot.string()};
  Page page;
  page.content.title = fmt::format("{}: {}", robot.name, a.logs.front().string());
  page.content.software = results::software();
  std::string why;
  Json result{{"schema", "wheelwright/try/1"}, {"software", results::software()}, {"robot_file", a.robot.string()}};
  if (!call(add_doctor, words("doctor", with_robot, kAll), why)) {
    throw InputError(why);
  }
  const Json doctor = files::read_json(out / "doctor" / "doctor.json");
  std::string verdict;
  std::vector<std::string>& said = page.content.sentences;
  if (!has_efforts(*log, robot, robot.effort)) {
    verdict = "No model: the log has no efforts of both wheels.";
    if (call(add_identify, words("identify", with_robot, kAll), why)) {
      page.section("identify", {"what wheels and pose alone say"});
    }
  } else if (!call(add_commission, words("commission", with_robot, kAll), why)) {
    verdict = "No model: " + doctor.at("sentence").get<std::string>();
    page.content.sections.push_back({"commission", "commission", report::bullets({why})});
  } else {
    const Json model = files::read_json(out / "commission" / "model.json");
    page.model = model.contains("detector");
    const std::string message = model.at("message").get<std::string>();
    verdict = message.starts_with("no model: ") ? core::capital(message)
                                                : fmt::format("{}: {}", page.model ? "A model" : "No model", message);
    if (page.model) {
      if (const std::string least = smallest_change(model, robot); !least.empty()) {
        verdict += "; " + least;
      }
      if (!model.contains("little_learned")) {
        page.content.warrant = robots::read_model(out / "commission" / "model.json").warrant;
      }
      page.section("commission", quantities(model));
      if (call(add_margins,
               words("margins",
                     {"--model", (out / "commission" / "model.json").string(), "--fault", "wheel_radius", "--fault",
                      "payload_lost", "--window", "1"},
                     1),
               why)) {
        page.section("margins", {"which faults are certainly seen, from which size on, in which manoeuvre"});
      }
      if (robot.nominal.contains("mass") && call(add_gap, words("gap", with_robot, kAll), why)) {
        page.section("gap", {files::read_json(out / "gap" / "gap.json").at("summary").get<std::string>()});
      }
    } else {
      page.section("commission", {model.at("message").get<std::string>()});
    }
  }
  for (const std::string& trouble : troubles(doctor, "fatal")) {
    said.push_back(trouble);
  }
  const std::vector<std::string> warnings = troubles(doctor, "warning");
  said.insert(said.end(), warnings.begin(), warnings.end());
  if (page.model) {
    said.push_back(
        fmt::format("Next: wheelwright detect LOG --model {}", (out / "commission" / "model.json").string()));
  }
  page.content.verdict = verdict;
  page.content.status = page.model ? warnings.empty() ? "good" : "caution" : "bad";
  page.content.sections.insert(page.content.sections.begin(),
                               {"took", "What was taken from where", report::bullets(took)});
  page.section("doctor", {doctor.at("sentence").get<std::string>()});
  result["model"] = page.model;
  result["verdict"] = verdict;
  result["sentences"] = said;
  result["taken"] = took;
  if (!yaml.empty()) {
    files::atomic_write(gathered(a.common) / file.filename(), yaml);
  }
  publish(a.common, result, "try.json", report::page(page.content));
  if (unfinished) {
    unfinished->keep();
  }
  if (!a.common.quiet && !a.common.json) {
    say("{}\n", verdict);
    for (const std::string& sentence : said) {
      say("  {}\n", sentence);
    }
    for (const std::string& sentence : took) {
      say("took: {}\n", sentence);
    }
    say("wrote {}{}\n", yaml.empty() ? std::string() : file.string() + " and ", (out / "report.html").string());
  }
  return page.model ? kDone : kNo;
}

}  // namespace
}  // namespace try_command

Run add_try(CLI::App& program) {
  using namespace try_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("try", kHelp);
  command.add_option("LOG", a->logs, "Logs (rosbag2, CSV, HDF5) of one robot; several are taken together")->required();
  command.add_option("--urdf", a->urdf, "Robot description; without it one in the recording")->type_name("FILE");
  command.add_option("--ros2-control", a->ros2_control, "Parameters of the diff_drive_controller (YAML)")
      ->type_name("FILE");
  command
      .add_option("--robot", a->robot, "Robot file (YAML) that settles it; without it DIR/robot.yaml of an earlier run")
      ->type_name("FILE");
  command.add_option("--wheel-radius", a->hints.wheel_radius, "Wheel radius, m; goes before all files")
      ->transform(in_unit("m"))
      ->type_name("M");
  command.add_option("--track-width", a->hints.track_width, "Distance of the wheels, m; goes before all files")
      ->transform(in_unit("m"))
      ->type_name("M");
  command
      .add_option("--massless", a->hints.massless,
                  "A link of the description that has a shape and no mass (may be repeated); all: every such link")
      ->type_name("LINK")
      ->allow_extra_args(false);
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app
