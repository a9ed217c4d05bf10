// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/drive_files.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "app/sound_log.hpp"
#include "core/for_all.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/simulator_file.hpp"
#include "gap/causes/selection.hpp"
#include "gap/diagnose.hpp"
#include "gap/effects/effect.hpp"
#include "gap/next_drive.hpp"
#include "gap/prepared.hpp"
#include "gap/write_back.hpp"
#include "results/gap_json.hpp"
#include "results/report/gap_report.hpp"
#include "results/software.hpp"
#include "results/words/gap_summary.hpp"
#include "results/words/gap_words.hpp"

namespace wheelwright::app {
using namespace words;
namespace gap_command {
namespace {

struct SimulatorOption {
  robots::SimulatorFormat format;
  const char* option;
  const char* says;
};
constexpr std::array<SimulatorOption, 3> kSimulators = {
    {{robots::SimulatorFormat::mjcf, "--write-mjcf",
      "Write a copy of this MuJoCo file (MJCF) with the causes in it into --out"},
     {robots::SimulatorFormat::urdf, "--write-urdf", "Write a copy of this URDF file with the causes in it into --out"},
     {robots::SimulatorFormat::sdf, "--write-sdf",
      "Write a copy of this Gazebo file (SDF) with the causes in it into --out"}}};

struct Arguments {
  std::vector<std::filesystem::path> logs, baseline, simulated, fresh;
  std::array<std::filesystem::path, kSimulators.size()> simulators;  // empty: none of this format
  robots::SimulatorHints wheels;
  std::filesystem::path robot;
  std::optional<double> beta;
  std::vector<std::string> without;
  bool no_shrink = false;
  bool no_manoeuvre = false;
  bool naive = false;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Diagnoses the gap between the model of a robot and a log of it: where it lies, which effect that the model lacks "
    "causes it, how far it shrinks once the effect is in the model, and, where causes cannot be told apart, which "
    "drive "
    "would tell.\n\n"
    "A baseline is a log of the same robot when it was healthy: parameters and noise are learnt from it, and what it "
    "shows already is no news. Without one, the nominal values of the robot file are believed.\n\n"
    "A log of your own simulator, given the same commands (--sim), takes the place of the model: then the gap is the "
    "robot's from that simulator.\n\n"
    "What is found goes back into the file of your own simulator (--write-mjcf, --write-urdf, --write-sdf): masses, "
    "friction, geometry, gains and limits are edited, everything else stays byte for byte, and causes that such a file "
    "has no number for are named with what to do instead.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright gap drive.csv --robot robot.yaml --baseline healthy.csv --out gap\n"
    "  wheelwright gap drive.csv --robot robot.yaml --sim simulated.csv --write-mjcf robot.xml --out gap\n"
    "  wheelwright gap monday.csv tuesday.csv --robot robot.yaml --without slope --json > gap.json\n"
    "  then wheelwright commission drive.csv --robot gap/robot_improved.yaml --out result\n"
    "  wheelwright gap drive.csv --robot robot.yaml --write-mjcf robot.xml --out gap   # writes "
    "gap/robot_improved.xml\n\n"
    "Exit code: 0 a diagnosis was made, whatever it is; 2 bad input.";

constexpr const char* kImproved = "robot_improved.yaml";
constexpr const char* kNext = "next_manoeuvre";
constexpr const char* kResiduals = "residuals.csv";

std::vector<std::string> names_of_files(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files) {
    names.push_back(file.string());
  }
  return names;
}

void check_without(const std::vector<std::string>& without, const std::vector<Effect>& catalogue) {
  std::vector<std::string> names;
  for (const Effect& effect : catalogue) {  // an entry for each variant
    if (std::ranges::find(names, effect.name) == names.end()) {
      names.push_back(effect.name);
    }
  }
  for (const std::string& name : without) {
    if (std::ranges::find(names, name) == names.end()) {
      throw InputError("--without " + files::shown(name) + ": no effect of the catalogue: expected one of " +
                       core::listed(names) + files::did_you_mean(name, names));
    }
  }
}

// What the naive rule makes of every row of the log.
std::vector<std::string> naive_effects(LogSource& log, LogSource* baseline, const Robot& robot,
                                       const gap::DiagnoseOptions& options) {
  gap::PreparedGap prepared = gap::prepare_gap(log, baseline, robot, options);
  prepared.row_options.row_step = 1e-9;
  gap::GapProblem problem =
      gap::make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted, prepared.catalogue,
                        gap::all_shapes(prepared.catalogue, prepared.drive), prepared.row_options);
  gap::BlockOptions blocks = options.blocks;
  blocks.threads = options.threads;
  const gap::BlockGram gram(problem.rows.spaces, blocks);
  problem.table.gram = &gram;
  std::vector<std::string> names;
  for (const std::size_t c : gap::naive_selection(problem.table).members) {
    names.push_back(problem.table.names[problem.table.candidates[c].effect]);
  }
  return names;
}

// What the improved robot file is, in a line that YAML ignores.
std::string origin(const Arguments& a, const Diagnosis& d) {
  std::vector<std::string> effects;
  for (const gap::GapCause& cause : d.causes) {
    effects.push_back(words::effect_noun(cause.effect));
  }
  std::string line = fmt::format("# {} with what `wheelwright gap` found in {}: {} ({}). {}.", a.robot.string(),
                                 fmt::join(names_of_files(a.logs), ", "), fmt::join(effects, ", "),
                                 gap::to_string(d.verdict), results::software());
  for (char& c : line) {
    c = static_cast<unsigned char>(c) < 0x20U ? ' ' : c;
  }
  return line + "\n";
}

void write_beside(const Arguments& a, const Diagnosis& d, const gap::NextDrive& next, const Robot& robot) {
  const std::filesystem::path out = gathered(a.common);
  results::write_residuals(out / kResiduals, d.series);
  if (d.improved) {
    files::atomic_write(out / kImproved,
                        origin(a, d) + robots::robot_yaml(*d.improved) + robots::columns_yaml(a.common.columns));
  }
  if (next.commands) {
    write_drive(out, kNext, *next.commands, robot);
  }
}

// Name of an edited file in the directory of results: robot_improved.xml of robot.xml.
constexpr std::string_view kEdited = "_improved";

std::string edited_name(const std::filesystem::path& source) {
  return source.stem().string() + std::string(kEdited) + source.extension().string();
}

// Names of the edited files that stand beside an earlier result, and are not read now.
std::vector<std::string> earlier_simulators(const CommonOptions& options) {
  const std::filesystem::path result = options.out / "gap.json";
  std::vector<std::string> names;
  if (std::filesystem::is_regular_file(result)) {
    try {
      const Json json = files::read_json(result);
      for (const Json& simulator : json.at("simulators")) {
        const Json& file = simulator.at("file");
        const std::filesystem::path edited = file.is_string() ? file.get<std::string>() : "";
        if (edited.stem().string().ends_with(kEdited) && !is_read(options.out / edited.filename(), options.read)) {
          names.push_back(edited.filename().string());
        }
      }
    } catch (const std::exception&) {  // no result of this command: make_directory() says so
    }
  }
  return names;
}

// A file of the user's simulator.
struct SimulatorSource {
  robots::SimulatorFormat format = robots::SimulatorFormat::mjcf;
  std::filesystem::path path;
  std::string text;
};

// Files that are to be edited; what is wrong with them is told before the work begins.
std::vector<SimulatorSource> simulator_sources(const Arguments& a, const Robot& robot) {
  constexpr std::size_t kLongest = std::size_t{1} << 24;
  std::vector<SimulatorSource> sources;
  for (std::size_t k = 0; k < kSimulators.size(); ++k) {
    const auto& [format, option, says] = kSimulators[k];
    const std::filesystem::path& path = a.simulators[k];
    if (path.empty()) {
      continue;
    }
    if (a.common.out.empty()) {
      throw InputError(fmt::format("{}: expected --out DIR with it: the edited file is written there", option));
    }
    if (!model::on_two_wheels(robot)) {
      throw InputError(fmt::format("{}: {} is no robot on two driven wheels", option, a.robot.string()));
    }
    if (edited_name(path) == kImproved) {
      throw InputError(
          fmt::format("{} {}: its edited file would be {}, which is the improved robot file: expected "
                      "another name, such as robot.urdf",
                      option, path.string(), kImproved));
    }
    SimulatorSource source{format, path, files::read_bytes(path, kLongest)};
    for (const SimulatorSource& other : sources) {
      if (edited_name(other.path) == edited_name(source.path)) {
        throw InputError(fmt::format("{} {}: {} has the same name: expected one file for each", option, path.string(),
                                     other.path.string()));
      }
    }
    static_cast<void>(robots::edit_simulator(format, source.text, path.string(), {}, robot, a.wheels));
    sources.push_back(std::move(source));
  }
  if (sources.empty() && !(a.wheels.left.empty() && a.wheels.right.empty())) {
    throw InputError("--left and --right: expected --write-mjcf, --write-urdf or --write-sdf with them");
  }
  return sources;
}

// The causes as changes of a simulator; none, with the reason, where the diagnosis stands for nothing.
model::SimulatorChange change_of(LogSource& log, LogSource* baseline, const Robot& robot, const Diagnosis& d,
                                 const gap::DiagnoseOptions& options) {
  if (d.verdict == gap::GapVerdict::no_gap || d.verdict == gap::GapVerdict::unexplained) {
    model::SimulatorChange none;
    if (d.verdict == gap::GapVerdict::unexplained) {
      none.not_expressed.push_back({"", "what the best causes leave is above the noise floor",
                                    "nothing was written: find what is missing first"});
    }
    return none;
  }
  const gap::PreparedGap prepared = gap::prepare_gap(log, baseline, robot, options);
  // Without the motor's constants no torque goes into a file.
  return gap::simulator_change(prepared.view.physical ? prepared.view.robot : robot, prepared.drive, d);
}

// Edits the files and writes those of which something changed.
std::vector<robots::EditedSimulator> write_simulators(const Arguments& a, const std::vector<SimulatorSource>& sources,
                                                      const model::SimulatorChange& change, const Robot& robot,
                                                      Json& result) {
  std::vector<robots::EditedSimulator> edits;
  for (const SimulatorSource& source : sources) {
    edits.push_back(robots::edit_simulator(source.format, source.text, source.path.string(), change, robot, a.wheels));
    const robots::EditedSimulator& edit = edits.back();
    const std::string name = edited_name(source.path);
    if (!edit.changed.empty()) {
      files::atomic_write(gathered(a.common) / name, edit.text);
    }
    result["simulators"].push_back(
        robots::to_json(edit, source.path.string(), edit.changed.empty() ? std::string() : name));
  }
  return edits;
}

void say_simulators(const Arguments& a, const std::vector<SimulatorSource>& sources,
                    const std::vector<robots::EditedSimulator>& edits, const std::vector<Effect>& catalogue) {
  for (std::size_t k = 0; k < edits.size(); ++k) {
    const robots::EditedSimulator& edit = edits[k];
    if (edit.changed.empty()) {
      say("{}: nothing to change\n", sources[k].path.string());
    } else {
      say("wrote {}, which is {} but for:\n", (a.common.out / edited_name(sources[k].path)).string(),
          sources[k].path.string());
    }
    for (const robots::NumberChanged& c : edit.changed) {
      say("  {}: {}: {} {} -> {} ({})\n", c.where, c.element, c.number, c.before.empty() ? "(none)" : c.before, c.after,
          in_words(c.because, catalogue));
    }
    for (const model::NotExpressed& n : edit.not_expressed) {
      say("  not in it: {}{}: {}\n", n.cause.empty() ? "" : in_words(n.cause, catalogue) + ": ", n.why, n.instead);
    }
    for (const std::string& remark : edit.remarks) {
      say("  note: {}\n", remark);
    }
  }
}

int run(const Arguments& a) {
  std::vector<std::string> written = {"gap.json", kImproved, kResiduals};
  for (const std::string& file : drive_files(kNext)) {
    written.push_back(file);
  }
  for (const std::filesystem::path& simulator : a.simulators) {
    if (!simulator.empty()) {
      written.push_back(edited_name(simulator));
    }
  }
  const std::vector<std::string> earlier = earlier_simulators(a.common);
  written.insert(written.end(), earlier.begin(), earlier.end());
  make_directory(a.common, written);
  Robot robot = read_robot(a.robot);
  const std::vector<SimulatorSource> sources = simulator_sources(a, robot);
  const std::vector<Effect> catalogue = gap::effect_catalogue(model::make_model(robot));
  check_without(a.without, catalogue);
  const std::vector<std::filesystem::path>& reference = a.simulated.empty() ? a.baseline : a.simulated;
  SoundLog opened, baseline;
  CommonOptions each = a.common;
  each.threads = reference.empty() ? each.threads : std::max(each.threads / 2, 1);
  core::both(
      static_cast<std::size_t>(a.common.threads),
      [&] { opened = open_sound_log(a.logs, robot, each, WheelPose::hidden); },
      [&] { baseline = reference.empty() ? SoundLog{} : open_sound_log(reference, robot, each, WheelPose::hidden); });
  logs::RecordedLog& log = *opened.log;
  logs::RecordedLog* const healthy = baseline.log.get();
  robot = model::with_column_errors(opened.robot, logs::interpolation_errors(log.report()));
  report::ReportContext context = report_context(a.common, log.report(), log);
  for (const SoundLog* of : {&opened, &baseline}) {
    context.warnings.insert(context.warnings.end(), of->remarks.begin(), of->remarks.end());
  }
  context.seeds = {{"permutations, bootstrap and search", a.common.seed}};
  Progress progress(a.common.quiet);
  gap::DiagnoseOptions options;
  options.without = a.without;
  options.beta = a.beta;
  options.shrink = !a.no_shrink;
  options.baseline_simulated = !a.simulated.empty();
  options.seed = a.common.seed;
  options.threads = static_cast<std::size_t>(a.common.threads);
  options.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  Diagnosis diagnosis;
  gap::NextDrive next;
  std::vector<std::string> naive;
  model::SimulatorChange change;
  or_failure_page(a.common, context, [&] {
    logs::require_columns(log, gap::required_columns(log, robot));
    if (healthy != nullptr) {
      logs::require_columns(*healthy, gap::required_columns(*healthy, robot));
    }
    diagnosis = diagnose(log, healthy, robot, options);
    if (!a.fresh.empty()) {
      const SoundLog fresh = open_sound_log(a.fresh, robot, a.common, WheelPose::hidden);
      logs::require_columns(*fresh.log, gap::required_columns(*fresh.log, robot));
      diagnosis.shrink.fresh_torque_rms = gap::torque_on(*fresh.log, healthy, robot, diagnosis, options);
    }
    next = a.no_manoeuvre ? gap::NextDrive{} : gap::what_next(log, healthy, robot, diagnosis, options);
    naive = a.naive ? naive_effects(log, healthy, robot, options) : naive;
    if (!sources.empty()) {
      change = change_of(log, healthy, robot, diagnosis, options);
    }
  });
  for (std::vector<std::string>* texts : {&diagnosis.notes, &diagnosis.not_excited}) {
    for (std::string& text : *texts) {
      text = in_words(text, catalogue);
    }
  }
  next.sentence = in_words(next.sentence, catalogue);
  const std::string promise = next.commands ? next.sentence : "";
  if (diagnosis.summary.empty()) {
    diagnosis.summary = words::gap_verdict(diagnosis);
    for (const std::string& sentence : words::gap_sentences(diagnosis, promise)) {
      diagnosis.summary += " " + sentence;
    }
  }
  const bool files = !a.common.out.empty();
  results::GapFiles names;
  names.robot = a.robot.string();
  names.logs = names_of_files(a.logs);
  names.baseline = fmt::format("{}", fmt::join(names_of_files(a.baseline), ", "));
  names.simulator = fmt::format("{}", fmt::join(names_of_files(a.simulated), ", "));
  names.residuals = files ? kResiduals : "";
  names.software = results::software();
  if (next.commands) {
    names.next_manoeuvre = results::NextManoeuvre{files ? drive_files(kNext).front() : "", promise};
  }
  Json result = results::to_json(diagnosis, names);
  result["improved"] = files && diagnosis.improved ? Json(kImproved) : Json(nullptr);
  results::add_rivals(result, next);
  if (a.naive) {
    result["naive"] = {{"effects", naive}};
  }
  const std::vector<robots::EditedSimulator> edits = write_simulators(a, sources, change, robot, result);
  if (files) {
    write_beside(a, diagnosis, next, robot);
  }
  publish(a.common, result, "gap.json",
          files ? report::gap_report(diagnosis, robot.name, context, promise) : std::string());
  if (!a.common.quiet && !a.common.json) {
    print_log(context.warnings);
    say_lines(summary(diagnosis, {files ? (a.common.out / "").string() : "", a.robot.string(),
                                  files && diagnosis.improved, promise, files && next.commands, a.naive, naive}));
    say_simulators(a, sources, edits, catalogue);
    if (files) {
      say("wrote {} and {}\n", (a.common.out / "gap.json").string(), (a.common.out / "report.html").string());
    }
  }
  return kDone;
}

}  // namespace
}  // namespace gap_command

Run add_gap(CLI::App& program) {
  using namespace gap_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("gap", kHelp);
  command.add_option("LOG", a->logs, "Logs (CSV, rosbag2, HDF5) of one robot in one state; taken together")->required();
  command.add_option("--robot", a->robot, "Robot file (YAML): the model whose gap it is")
      ->required()
      ->type_name("FILE");
  repeatable(
      *command.add_option("--baseline", a->baseline, "Log of the same robot when it was healthy (may be repeated)")
           ->type_name("LOG"));
  repeatable(*command
                  .add_option("--sim", a->simulated,
                              "Log of your simulator under the same commands: the gap is from it (may be repeated)")
                  ->type_name("LOG"))
      .excludes("--baseline");
  repeatable(*command
                  .add_option("--fresh", a->fresh,
                              "Another log of the robot as it is now: whether what is promised holds there")
                  ->type_name("LOG"));
  command.add_option("--beta", a->beta, "Of the filter, 1/s (default: at most 10, lower where the motion is noisy)")
      ->transform(in_unit("1/s"))
      ->type_name("B")
      ->check(CLI::Range(0.1, 1000.0));
  repeatable(
      *command.add_option("--without", a->without, "Do not look for this effect of the catalogue (may be repeated)")
           ->type_name("EFFECT"));
  for (std::size_t k = 0; k < kSimulators.size(); ++k) {
    command.add_option(kSimulators[k].option, a->simulators[k], kSimulators[k].says)->type_name("FILE");
  }
  for (const auto& [name, joint, side] :
       {std::tuple{"--left", &a->wheels.left, "left"}, {"--right", &a->wheels.right, "right"}}) {
    command.add_option(name, *joint, fmt::format("Joint of the driven wheel on the {} side in that file", side))
        ->type_name("JOINT");
  }
  command.add_flag("--no-shrink", a->no_shrink, "Do not measure how far the gap shrinks: much faster");
  command.add_flag("--no-manoeuvre", a->no_manoeuvre, "Do not design a drive where causes cannot be told apart");
  command.add_flag("--naive", a->naive,
                   "Also say what forward selection by BIC over samples would say, to be compared with");
  add_map(command, a->common);
  add_despite(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app
