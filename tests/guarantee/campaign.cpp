// SPDX-License-Identifier: Apache-2.0
/// \file
/// The campaign: random robots by the thousand, every promise checked. Resumable; each case follows from its number.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/guarantee/judge.hpp"

namespace wheelwright::guarantee {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kPatience = 50.0;  // wall time over processor time, on a busy machine

struct Options {
  std::uint64_t seed = 1, first = 0, last = 1000;
  std::size_t workers = 1, watch_rows = 5000;
  double minutes = 1e9, timeout = 60.0;  // s of processor for a case
  bool oracle = false, faults = false;
  std::string out;
};

constexpr const char* kUsage =
    "campaign --seed N --cases A..B --out FILE.jsonl [--minutes M] [--threads N] [--watch-rows N] [--timeout S] "
    "[--oracle] [--faults]\n"
    "campaign --summary FILE.jsonl...\n"
    "campaign --describe N [--seed N]\n"
    "Cases in FILE are not done again. --summary ends with 1 where a promise was broken, or where more than one in a\n"
    "hundred of the logs that keep to their assumptions was called impossible.\n";

Json describe(std::uint64_t number, const Case& c) {
  return {{"case", number},
          {"robot", c.truth.axis ? "axis" : "two_wheels"},
          {"mass", c.truth.mass},
          {"rate", c.rate},
          {"stamps", name(c.stamps)},
          {"jitter", c.jitter},
          {"lost", c.lost},
          {"sense", name(c.sense)},
          {"noise", name(c.noise)},
          {"noise_watch", name(c.noise_watch)},
          {"changes", name(c.changes)},
          {"motion", name(c.learn.motion)},
          {"motion_watch", name(c.watch.motion)},
          {"bandwidth_ratio", c.bandwidth_ratio()},
          {"watch_ratio", c.watch.bandwidth / c.rate},
          {"time_constant_steps", c.truth.mass / c.truth.viscous_linear * c.rate},
          {"friction", c.truth.coulomb / c.learn.reach[0]},
          {"delay_declared", c.delay_declared ? c.delay : 0.0},
          {"prior", c.prior.value_or(0.0)},
          {"beta", c.beta.value_or(0.0)},
          {"broken", name(c.broken)}};
}

std::string line_of(std::uint64_t number, const Options& options) {
  Case c = random_case(options.seed, number);
  c.watch_rows = options.watch_rows;
  Json line = describe(number, c);
  line["seed"] = options.seed;
  const Verdict v = judge(c, {.oracle = options.oracle, .faults = options.faults});
  line["end"] = name(v.end);
  line["violation"] = v.violation(c.broken == Broken::none);
  line["outside"] = v.outside;
  line["facet_cuts"] = v.facet_cuts;
  line["failing"] = v.failing;
  line["width"] = v.width;
  line["oracle"] = v.oracle;
  line["rows"] = v.rows;
  line["watched"] = v.watched;
  line["decisions"] = v.decisions;
  line["alarms"] = v.alarms;
  line["events"] = v.events;
  line["first_alarm"] = v.first_alarm;
  const auto each = [&](std::size_t FaultTally::*count) {
    return std::vector<std::size_t>{v.faults[0].*count, v.faults[1].*count, v.faults[2].*count};
  };
  line["faults"] = each(&FaultTally::certain);
  line["missed"] = each(&FaultTally::missed);
  line["isolated"] = each(&FaultTally::isolated);
  line["excluded"] = each(&FaultTally::excluded);
  line["seconds"] = v.commission_seconds + v.watch_seconds;
  if (v.end != Verdict::End::guaranteed) {
    line["message"] = v.message;
  }
  return line.dump();
}

// A case in a process of its own, so that neither an abort nor an endless loop ends the campaign.
std::string line_in_child(std::uint64_t number, const Options& options) {
  std::array<int, 2> pipe_ends{};
  if (pipe(pipe_ends.data()) != 0) {
    throw std::runtime_error("no pipe");
  }
  const pid_t child = fork();
  if (child < 0) {
    throw std::runtime_error("no process");
  }
  if (child == 0) {
    close(pipe_ends[0]);
    const auto seconds = static_cast<rlim_t>(std::ceil(options.timeout));
    const rlimit limit{seconds, seconds};
    setrlimit(RLIMIT_CPU, &limit);
    const std::string line = line_of(number, options);
    std::size_t written = 0;
    while (written < line.size()) {
      const ssize_t n = write(pipe_ends[1], line.data() + written, line.size() - written);
      if (n <= 0) _exit(3);
      written += static_cast<std::size_t>(n);
    }
    _exit(0);
  }
  close(pipe_ends[1]);
  std::string line;
  const auto end = Clock::now() + std::chrono::duration<double>(kPatience * options.timeout);
  bool in_time = true;
  for (;;) {
    pollfd wait{pipe_ends[0], POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0 || poll(&wait, 1, static_cast<int>(left)) == 0) {
      in_time = false;
      kill(child, SIGKILL);
      break;
    }
    std::array<char, 4096> buffer{};
    const ssize_t n = read(pipe_ends[0], buffer.data(), buffer.size());
    if (n <= 0) break;
    line.append(buffer.data(), static_cast<std::size_t>(n));
  }
  close(pipe_ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  in_time = in_time && !(WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL));
  if (in_time && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return line;
  }
  Json failed = describe(number, random_case(options.seed, number));
  failed["seed"] = options.seed;
  failed["end"] = in_time ? "crashed" : "timed_out";
  failed["violation"] = false;
  return failed.dump();
}

std::set<std::uint64_t> done_already(const Options& options) {
  std::set<std::uint64_t> done;
  std::ifstream in(options.out);
  for (std::string line; std::getline(in, line);) {
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_discarded() && json.value("seed", std::uint64_t{0}) == options.seed) {
      done.insert(json.at("case").get<std::uint64_t>());
    }
  }
  return done;
}

int run(const Options& options) {
  const std::set<std::uint64_t> done = done_already(options);
  // Each worker is a process with a share of the cases; a line is one write, so that they may share a file.
  std::vector<pid_t> workers;
  const auto start = Clock::now();
  for (std::size_t w = 0; w < options.workers; ++w) {
    const pid_t child = fork();
    if (child < 0) {
      throw std::runtime_error("no process");
    }
    if (child > 0) {
      workers.push_back(child);
      continue;
    }
    std::FILE* out = std::fopen(options.out.c_str(), "a");
    if (out == nullptr) {
      std::fprintf(stderr, "campaign: cannot write %s\n", options.out.c_str());
      _exit(2);
    }
    for (std::uint64_t k = options.first + w; k < options.last; k += options.workers) {
      if (std::chrono::duration<double>(Clock::now() - start).count() > 60.0 * options.minutes) {
        break;
      }
      if (done.contains(k)) {
        continue;
      }
      const std::string line = line_in_child(k, options) + "\n";
      std::fwrite(line.data(), 1, line.size(), out);
      std::fflush(out);
    }
    std::fclose(out);
    _exit(0);
  }
  int worst = 0;
  for (const pid_t worker : workers) {
    int status = 0;
    waitpid(worker, &status, 0);
    worst = std::max(worst, WIFEXITED(status) ? WEXITSTATUS(status) : 3);
  }
  return worst;
}

// ---- summary -------------------------------------------------------------------------------------------------------

// Of all kinds of faults, or of one.
std::size_t total(const Json& j, const char* field, std::optional<std::size_t> kind = std::nullopt) {
  const Json counts = j.value(field, Json::array());
  std::size_t sum = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    sum += !kind || *kind == k ? counts[k].get<std::size_t>() : 0;
  }
  return sum;
}

struct Tally {
  std::size_t cases = 0, guaranteed = 0, intervals = 0, learnt = 0, empty = 0, refused = 0, lost = 0;
  std::size_t outside = 0, alarm_robots = 0;
  double alarms = 0.0, watched = 0.0;
  std::size_t faults = 0, missed = 0, isolated = 0, excluded = 0;
  std::vector<double> widths, ratios;

  void add(const Json& j) {
    ++cases;
    const std::string end = j.at("end");
    guaranteed += end == "guaranteed" ? 1 : 0;
    intervals += end == "intervals" ? 1 : 0;
    learnt += end == "learnt" ? 1 : 0;
    empty += end == "empty" ? 1 : 0;
    refused += end == "refused" ? 1 : 0;
    lost += end == "timed_out" || end == "crashed" ? 1 : 0;
    if (end == "guaranteed" || end == "intervals") {
      outside += !j.at("outside").get<std::string>().empty() || j.at("facet_cuts").get<bool>() ? 1 : 0;
      widths.push_back(j.at("width"));
      if (j.at("oracle").get<double>() > 0.0) {
        ratios.push_back(j.at("width").get<double>() / j.at("oracle").get<double>());
      }
    }
    if (end == "guaranteed") {
      alarm_robots += j.at("alarms").get<double>() > 0.0 ? 1 : 0;
      alarms += j.at("alarms").get<double>();
      watched += j.at("decisions").get<double>();
      faults += total(j, "faults");
      missed += total(j, "missed");
      isolated += total(j, "isolated");
      excluded += total(j, "excluded");
    }
  }
};

double median(std::vector<double> x) {
  if (x.empty()) {
    return std::nan("");
  }
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

std::string bucket(double x, const std::vector<double>& edges, const char* unit) {
  for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
    if (x < edges[k + 1] || k + 2 == edges.size()) {
      return fmt::format("{}: {:g} to {:g}{}", static_cast<char>('a' + k), edges[k], edges[k + 1], unit);
    }
  }
  return {};
}

void print_table(const char* title, const std::map<std::string, Tally>& rows) {
  fmt::print(
      "\n{:<24} {:>6} {:>10} {:>9} {:>6} {:>6} {:>7} {:>5} | {:>7} {:>7} {:>9} {:>11} | {:>6} {:>6} {:>8} {:>8} | "
      "{:>8} "
      "{:>7}\n",
      title, "cases", "guaranteed", "intervals", "learnt", "empty", "refused", "lost", "outside", "alarmed", "alarms",
      "decisions", "faults", "missed", "isolated", "excluded", "width", "/oracle");
  for (const auto& [value, t] : rows) {
    fmt::print(
        "{:<24} {:>6} {:>10} {:>9} {:>6} {:>6} {:>7} {:>5} | {:>7} {:>7} {:>9.0f} {:>11.0f} | {:>6} {:>6} {:>8} {:>8} "
        "| "
        "{:>8.3g} {:>7.3g}\n",
        value, t.cases, t.guaranteed, t.intervals, t.learnt, t.empty, t.refused, t.lost, t.outside, t.alarm_robots,
        t.alarms, t.watched, t.faults, t.missed, t.isolated, t.excluded, median(t.widths), median(t.ratios));
  }
}

int summary(const std::vector<std::string>& files) {
  using Key = std::function<std::string(const Json&)>;
  const auto text = [](const char* field) -> Key {
    return [field](const Json& j) { return j.at(field).get<std::string>(); };
  };
  const auto number = [](const char* field, std::vector<double> edges, const char* unit) -> Key {
    return [field, edges, unit](const Json& j) { return bucket(j.at(field).get<double>(), edges, unit); };
  };
  const std::vector<std::pair<const char*, Key>> dimensions = {
      {"all", [](const Json&) { return std::string("all"); }},
      {"rate", number("rate", {5, 20, 50, 200, 1001}, " Hz")},
      {"stamps",
       [](const Json& j) {
         const double jitter = j.at("jitter");
         return j.at("stamps").get<std::string>() + (jitter > 0.1 ? " > 10 %" : jitter > 0.0 ? " <= 10 %" : "");
       }},
      {"lost rows", [](const Json& j) { return std::string(j.at("lost").get<double>() > 0.0 ? "some" : "none"); }},
      {"bandwidth / rate", number("bandwidth_ratio", {0.005, 0.01, 0.05, 0.125, 0.5}, "")},
      {"watched / rate", number("watch_ratio", {0.005, 0.01, 0.05, 0.125, 0.5}, "")},
      {"efforts", text("changes")},
      {"motion column", text("sense")},
      {"noise", text("noise")},
      {"noise watched", text("noise_watch")},
      {"motion", text("motion")},
      {"dry friction", number("friction", {0, 1e-9, 0.1, 0.6}, "")},
      {"m/f, steps", number("time_constant_steps", {0.5, 2, 10, 100, 1e9}, "")},
      {"mass", number("mass", {1e-3, 1e-2, 1e-1, 1, 10, 100, 1e3, 1e4, 1e6}, " kg")},
      {"robot", text("robot")},
      {"prior", [](const Json& j) { return std::string(j.at("prior").get<double>() > 0.0 ? "declared" : "default"); }},
  };
  std::vector<std::map<std::string, Tally>> tables(dimensions.size());
  std::map<std::string, Tally> broken;
  Tally kept;
  std::array<std::array<std::size_t, 4>, 3> by_fault{};
  for (const std::string& file : files) {
    std::ifstream in(file);
    if (!in) {
      fmt::print(stderr, "campaign: cannot read {}\n", file);
      return 2;
    }
    for (std::string line; std::getline(in, line);) {
      const Json json = Json::parse(line, nullptr, false);
      if (json.is_discarded()) {
        continue;
      }
      if (json.at("broken") != "none") {
        broken[json.at("broken")].add(json);
        continue;
      }
      kept.add(json);
      for (std::size_t k = 0; k < by_fault.size(); ++k) {
        constexpr std::array<const char*, 4> kCounts = {"faults", "missed", "isolated", "excluded"};
        for (std::size_t f = 0; f < kCounts.size(); ++f) {
          by_fault[k][f] += total(json, kCounts[f], k);
        }
      }
      for (std::size_t d = 0; d < dimensions.size(); ++d) {
        tables[d][dimensions[d].second(json)].add(json);
      }
    }
  }
  fmt::print(
      "Logs that keep to what their robot file declares. intervals: only they are guaranteed, thresholds are not; "
      "outside: the truth is not in the published set; alarmed: "
      "robots with "
      "a\nfalse alarm; empty: called impossible; lost: timed out or crashed; faults: of a size that margins call "
      "certain; "
      "isolated:\nalarms looked into; excluded: of them, with the true fault, its size or time ruled out; width: "
      "median of "
      "(upper − lower) /\ntruth of the mass; /oracle: median of that over the width for exact rows with the sensors' "
      "worst "
      "case only.\n");
  for (std::size_t d = 0; d < dimensions.size(); ++d) {
    print_table(dimensions[d].first, tables[d]);
  }
  fmt::print("\n{:<24} {:>7} {:>7} {:>9} {:>9}\n", "fault of a certain size", "tried", "missed", "isolated",
             "excluded");
  for (std::size_t k = 0; k < by_fault.size(); ++k) {
    fmt::print("{:<24} {:>7} {:>7} {:>9} {:>9}\n", name(static_cast<Breakdown::Kind>(k)), by_fault[k][0],
               by_fault[k][1], by_fault[k][2], by_fault[k][3]);
  }
  fmt::print(
      "\nLogs that break an assumption that their robot file declares: wanted is the truth inside, or no model (empty, "
      "refused).\nAlarms on such a log are no false alarms in the strict sense.\n");
  print_table("broken", broken);
  const std::size_t promises = kept.outside + kept.alarm_robots + kept.missed + kept.excluded + kept.lost;
  fmt::print(
      "\nOf {} logs that keep to their assumptions: truth outside {}, robots with a false alarm {}, certain faults "
      "missed {} of {}, true faults excluded {} of {}, lost {}; called impossible {}. Decisions: {:.3g}.\n",
      kept.cases, kept.outside, kept.alarm_robots, kept.missed, kept.faults, kept.excluded, kept.isolated, kept.lost,
      kept.empty, kept.watched);
  constexpr std::size_t kMostImpossible = 100;  // one in
  return promises == 0 && kMostImpossible * kept.empty <= kept.cases ? 0 : 1;
}

int main_of(const std::vector<std::string>& words) {
  Options options;
  bool describe_only = false;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string& word = words[k];
    const auto value = [&]() -> const std::string& {
      if (k + 1 >= words.size()) throw std::invalid_argument(word + " needs a value");
      return words[++k];
    };
    if (word == "--summary") {
      return summary({words.begin() + static_cast<std::ptrdiff_t>(k) + 1, words.end()});
    }
    if (word == "--seed") {
      options.seed = std::stoull(value());
    } else if (word == "--cases") {
      const std::string range = value();
      const auto dots = range.find("..");
      if (dots == std::string::npos) throw std::invalid_argument("--cases wants A..B");
      options.first = std::stoull(range.substr(0, dots));
      options.last = std::stoull(range.substr(dots + 2));
    } else if (word == "--out") {
      options.out = value();
    } else if (word == "--minutes") {
      options.minutes = std::stod(value());
    } else if (word == "--threads") {
      options.workers = std::max<std::size_t>(1, std::stoull(value()));
    } else if (word == "--watch-rows") {
      options.watch_rows = std::stoull(value());
    } else if (word == "--timeout") {
      options.timeout = std::stod(value());
    } else if (word == "--oracle") {
      options.oracle = true;
    } else if (word == "--faults") {
      options.faults = true;
    } else if (word == "--describe") {
      options.first = std::stoull(value());
      describe_only = true;
    } else {
      throw std::invalid_argument("unknown: " + word);
    }
  }
  if (describe_only) {
    fmt::print("{}\n", line_of(options.first, options));
    return 0;
  }
  if (options.out.empty()) {
    throw std::invalid_argument("--out is missing");
  }
  return run(options);
}

}  // namespace
}  // namespace wheelwright::guarantee

int main(int argc, char** argv) {
  try {
    return wheelwright::guarantee::main_of({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "campaign: %s\n%s", e.what(), wheelwright::guarantee::kUsage);
    return 2;
  }
}
