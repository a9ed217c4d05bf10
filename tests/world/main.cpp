// SPDX-License-Identifier: Apache-2.0
// wheelwright-reality: logs of robots in another physics engine, with an effect that is withheld.
#include <array>
#include <atomic>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/log_file.hpp"
#include "tests/world/case.hpp"
#include "tests/world/replay.hpp"

namespace {

using namespace wheelwright;
using namespace wheelwright::reality;
namespace fs = std::filesystem;

double digits(double value) { return std::stod(fmt::format("{:.6g}", value)); }

Json answer(const Case& c) {
  Json effects = Json::array();
  bool known = true;
  for (const Cause& cause : c.causes) {
    Json parameters = Json::object();
    for (const auto& [name, value] : cause.parameters) {
      parameters[name] = digits(value);
    }
    effects.push_back({{"effect", cause.of.entry->name},
                       {"law", cause.of.law != nullptr ? cause.of.law->name : "given"},
                       {"severity", digits(cause.severity)},
                       {"alone_gap_percent", digits(cause.before)},
                       {"alone_gap_percent_after_refit", digits(cause.after)},
                       {"parameters", parameters}});
    known = known && cause.of.entry->kind != Class::outside;
  }
  const Oracle& o = c.oracle;
  Json oracle{{"floor_percent", digits(o.floor_percent)}, {"beta", o.beta}};
  if (!c.causes.empty() && known) {
    oracle["separable"] = o.separable;
    oracle["closest_rival"] = o.closest_rival;
    oracle["excess"] = digits(o.excess);
    oracle["own_form_leaves"] = digits(o.own_form);
  }
  return {
      {"in_catalogue", known},
      {"effects", effects},
      {"gap_percent", digits(c.gap.before)},
      {"gap_percent_after_refit", digits(c.gap.after)},
      {"healthy", {{"gap_percent_after_refit", digits(c.healthy.after)}, {"r_squared", digits(c.healthy.r_squared)}}},
      {"oracle", oracle}};
}

Json write_case(const Request& request, std::uint64_t index, const fs::path& out) {
  const std::string name = fmt::format("case_{:03}", index);
  const Case c = make_case(request, index);
  fs::create_directories(out / "logs" / name);
  fs::create_directories(out / "fresh" / name);
  logs::write_csv(out / "logs" / name / "baseline.csv.gz", c.baseline);
  logs::write_csv(out / "logs" / name / "real.csv.gz", c.real);
  logs::write_csv(out / "fresh" / name / "real.csv.gz", c.fresh);
  files::atomic_write(out / "logs" / name / "robot.yaml", robot_yaml(c.robot, name));
  files::atomic_write(out / "logs" / name / "robot.xml", designers_xml(c.robot));
  return answer(c);
}

int generate(const Request& request, std::uint64_t first, std::uint64_t cases, unsigned threads, const fs::path& out) {
  std::atomic<std::uint64_t> next{first};
  std::map<std::uint64_t, Json> answers;
  std::exception_ptr failure;
  std::mutex lock;
  const auto work = [&] {
    for (std::uint64_t index = next++; index < first + cases; index = next++) {
      try {
        Json json = write_case(request, index, out);
        const std::lock_guard guard(lock);
        answers.emplace(index, std::move(json));
        fmt::print(stderr, "\r{} of {}", answers.size(), cases);
      } catch (...) {
        const std::lock_guard guard(lock);
        failure = std::current_exception();
        return;
      }
    }
  };
  std::vector<std::thread> crew;
  for (unsigned k = 0; k < threads; ++k) {
    crew.emplace_back(work);
  }
  for (std::thread& one : crew) {
    one.join();
  }
  fmt::print(stderr, "\n");
  Json all = Json::object();
  for (const auto& [index, json] : answers) {
    all[fmt::format("case_{:03}", index)] = json;
  }
  files::write_json(out / "answers.json", all);
  if (failure) {
    std::rethrow_exception(failure);
  }
  return 0;
}

/// What `replay` is asked for.
struct ReplayRequest {
  std::vector<fs::path> logs, simulators;
  fs::path gap, out, log;
  ReplayOptions options;
};

// A figure of gap.json's shrink: before and after; nulls where it has none.
Json promised(const Json& gap, const char* group, const std::string& name) {
  if (!gap.contains("shrink") || !gap["shrink"].contains(group) || !gap["shrink"][group].contains(name)) {
    return {nullptr, nullptr};
  }
  const Json& figure = gap["shrink"][group][name];
  return {figure["before"], figure["after"]};
}

int run_replay(ReplayRequest request) {
  Json gap = Json::object();
  if (!request.gap.empty()) {
    gap = Json::parse(files::read_bytes(request.gap, std::size_t{1} << 28));
    request.options.beta = gap.at("filter").at("beta").get<double>();
  }
  const auto source = logs::open_log(request.logs);
  const LogTable log = read_all(*source);
  std::vector<Replay> all;
  for (const fs::path& simulator : request.simulators) {
    all.push_back(replay(files::read_bytes(simulator, std::size_t{1} << 24), log, request.options));
    // What the wheels show is read as the first simulator has it.
    request.options.wheel_radius = all.front().wheel_radius;
    request.options.track_width = all.front().track_width;
  }
  struct Figure {
    const char *name, *unit, *group, *key;
    double Replay::*value;
  };
  const std::string after = fmt::format("_{}s", request.options.horizon);
  const std::array<Figure, 6> figures = {
      {{"torque, sum", "N m", "torque_rms", "sum", &Replay::sum},
       {"torque, difference", "N m2", "torque_rms", "difference", &Replay::difference},
       {"velocity", "m/s", "rollout", "velocity", &Replay::velocity},
       {"yaw rate", "rad/s", "rollout", "yaw_rate", &Replay::yaw_rate},
       {"position", "m", "rollout", "position", &Replay::position},
       {"heading", "rad", "rollout", "heading", &Replay::heading}}};
  fmt::print("{:<20}{:>6}", "robot - simulator", "");
  for (const fs::path& simulator : request.simulators) {
    fmt::print("  {:>18}", simulator.filename().string());
  }
  fmt::print("{}\n", request.gap.empty() ? "" : "    promised: before       after");
  Json result = Json::object();
  for (const Figure& f : figures) {
    const bool loop = f.group == std::string("rollout");
    const Json promise = promised(gap, f.group, loop ? f.key + after : std::string(f.key));
    fmt::print("{:<20}{:>6}", f.name, f.unit);
    Json values = Json::array();
    for (const Replay& r : all) {
      fmt::print("  {:>18.4g}", r.*f.value);
      values.push_back(digits(r.*f.value));
    }
    if (!request.gap.empty()) {
      for (const Json& number : promise) {
        fmt::print("  {:>10}", number.is_number() ? fmt::format("{:.4g}", number.get<double>()) : "-");
      }
    }
    fmt::print("\n");
    result[loop ? f.key + after : std::string(f.key)] = {{"measured", values}, {"promised", promise}, {"unit", f.unit}};
  }
  fmt::print("root mean squares; torques through f2 at {} 1/s, the rest after {} s in open loop ({} runs)\n",
             request.options.beta, request.options.horizon, all.front().runs);
  if (!request.out.empty()) {
    files::write_json(request.out, result);
  }
  if (!request.log.empty()) {
    logs::write_csv(request.log, all.front().simulated);
  }
  return 0;
}

int list_laws() {
  for (const Subject& subject : subjects()) {
    const Law* law = subject.law;
    fmt::print("{:<24} {:<14} {}{}\n", subject.entry->name, law != nullptr ? law->name : "given",
               law == nullptr                  ? "one law only"
               : law->origin == Origin::engine ? "engine: "
                                               : "",
               law != nullptr ? law->says : "");
  }
  return 0;
}

/// Least and largest gap of one effect, per cent; `hard` takes a third of its own.
struct Severities {
  double low, high;
};
const std::map<std::string, Severities> severities{
    {"standard", {5.0, 35.0}}, {"plain", {3.0, 60.0}}, {"hard", {5.0, 35.0}}};

}  // namespace

int main(int count, char** arguments) try {
  CLI::App app("Logs of robots in another physics engine, with an effect that is withheld", "wheelwright-reality");
  app.require_subcommand(1);
  CLI::App& make = *app.add_subcommand("generate",
                                       "A set of cases: logs and robot files in DIR/logs, a second drive of "
                                       "each in DIR/fresh, answers in DIR/answers.json");
  CLI::App& list = *app.add_subcommand("laws", "Effects and the laws that they may follow");
  CLI::App& again = *app.add_subcommand("replay",
                                        "How far a robot's log and simulators (MJCF) are apart: the torque that each "
                                        "simulator needs for the log's speeds, and where the log's torques take it");
  ReplayRequest replayed;
  again.add_option("LOG", replayed.logs, "logs of the robot: wheel speeds, torques and pose")->required();
  again.add_option("--mjcf", replayed.simulators, "the simulator's file; several: before, after")
      ->required()
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  again.add_option("--gap", replayed.gap, "gap.json: its filter is taken, and what it promises stands beside");
  again.add_option("--right", replayed.options.right, "joint of the right wheel")->capture_default_str();
  again.add_option("--left", replayed.options.left, "joint of the left wheel")->capture_default_str();
  again.add_option("--horizon", replayed.options.horizon, "of runs in open loop, s")
      ->check(CLI::Range(0.05, 60.0))
      ->capture_default_str();
  again.add_option("--out", replayed.out, "the same as JSON");
  again.add_option("--log", replayed.log, "what the first simulator did at the log's speeds, as a log (CSV)");
  Request request;
  std::uint64_t cases = 0;
  std::uint64_t first = 0;
  unsigned threads = 2;
  std::string profile = "standard";
  std::string chosen = "all";
  std::string out;
  const std::map<std::string, Kind> kinds{{"mixed", Kind::mixed}, {"single", Kind::single},
                                          {"pair", Kind::pair},   {"triple", Kind::triple},
                                          {"none", Kind::none},   {"outside", Kind::outside}};
  make.add_option("--seed", request.seed, "of all draws")->capture_default_str();
  make.add_option("--cases", cases, "how many; 10 where nothing is said, with --laws each one of each");
  make.add_option("--first", first, "number of the first")->capture_default_str();
  make.add_option("--profile", profile,
                  "gap of one effect, per cent of the torque: standard 5 to 35, plain 3 to 60; hard: a "
                  "third of standard, three times the noise, imperfect robots")
      ->check(CLI::IsMember(severities))
      ->capture_default_str();
  make.add_option("--kind", request.kind, "what is withheld")->transform(CLI::CheckedTransformer(kinds));
  make.add_option("--effect", request.effect, "this effect in every case");
  make.add_option(
          "--laws", chosen,
          "what effects follow: all laws that `laws` lists, other (without the common formulas), drawn (functions and "
          "filters drawn anew for each case), given (the law of each effect before there were several), laws by "
          "comma, or each: every law in turn")
      ->capture_default_str();
  make.add_flag("--wide", request.wide, "robots of 0.5 to 500 kg (otherwise 5 to 150), none quite what its file says");
  make.add_flag("--ordinary", request.ordinary,
                "logs with jitter of the time stamps (to 20 % of the period), lost rows (0.05 to 2 %, in bursts) and, "
                "one in four, smoothed speeds");
  make.add_option("--duration", request.duration, "of each drive, s")
      ->check(CLI::Range(50.0, 3600.0))
      ->capture_default_str();
  make.add_option("--out", out, "directory")->required();
  make.add_option("--threads", threads, "cases at a time")->check(CLI::Range(1, 256))->capture_default_str();
  try {
    app.parse(count, arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (list.parsed()) {
    return list_laws();
  }
  // The engine writes its warnings into a file of its own in the working directory: the world looks at them itself.
  mju_user_warning = [](const char*) {};
  if (again.parsed()) {
    return run_replay(std::move(replayed));
  }
  request.hard = profile == "hard";
  request.low = severities.at(profile).low;
  request.high = severities.at(profile).high;
  request.each = chosen == "each";
  request.laws = LawChoice(request.each ? "all" : chosen);
  if (!request.effect.empty()) {
    static_cast<void>(find_entry(request.effect));
  }
  if (cases == 0) {
    cases = request.each ? subjects(request.effect).size() : 10;
  }
  return generate(request, first, cases, threads, out);
} catch (const InvalidArgument& error) {
  fmt::print(stderr, "wheelwright-reality: {}\n", error.what());
  return 2;
} catch (const InputError& error) {
  fmt::print(stderr, "wheelwright-reality: {}\n", error.what());
  return 2;
} catch (const std::exception& error) {
  fmt::print(stderr, "wheelwright-reality: {}\n", error.what());
  return 3;
}
