// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how soon, and from which size on, does a guaranteed threshold see a fault, compared with detectors whose
/// limits were chosen in hindsight so that they raise no false alarm on the very logs of the study?
///
/// Random robots drive gently, variedly and hard, in two regimes: parameters uncertain by 20 % (another θ in the box in
/// every drive), and commissioned from a rich log. The first pass walks fault-free drives, and finds every peer's
/// limits: the largest value it ever had, per robot, class of driving and output. The fault-free twins of all faulty
/// drives are among them. The second breaks the robots, by multiples of the size that is certain for half of all onsets
/// within 1 s. Prints Markdown.
///
///     wheelwright-peers [--samples N] [--seed S] [--robots R] [--runs K]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/sim/simulation.hpp>

#include "peers/bank.hpp"
#include "peers/field.hpp"

using namespace wheelwright;
using namespace wheelwright::peers;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kPatience = 5.0;     // s after the onset in which a fault counts as seen
constexpr std::size_t kMembers = 12;  // long fault-free drives per robot and class of driving
constexpr std::array kMultiples = {0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0};
constexpr std::size_t kDouble = 5;  // of kMultiples: 2

struct Options {
  double samples = 1e7;  // fault-free, per regime
  std::uint64_t seed = 1;
  std::size_t robots = 6, runs = 6;  // runs per robot, class of driving and fault
};

double median(std::vector<double> values) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1 || *middle == kNever) {
    return *middle;
  }
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

// All runs of one fault in one class of driving.
struct Cell {
  std::vector<double> sizes;  // the certain size of each run's robot and side
  std::string unit;
  std::size_t unpromised = 0;                                              // runs without a certain size
  std::array<std::vector<std::vector<double>>, kMultiples.size()> delays;  // [multiple][column][run], s
  std::array<std::vector<double>, kMultiples.size()> by_twin;  // of |ε| against the maximum of the run's own twin

  [[nodiscard]] double seen(std::size_t multiple, std::size_t column) const {
    const std::vector<double>& all = delays[multiple][column];
    return all.empty()
               ? 0.0
               : static_cast<double>(std::count_if(all.begin(), all.end(), [](double d) { return d <= kPatience; })) /
                     static_cast<double>(all.size());
  }
  // The smallest multiple from which on at least `share` of the runs see the fault.
  [[nodiscard]] double smallest(std::size_t column, double share) const {
    double found = kNever;
    for (std::size_t m = kMultiples.size(); m-- > 0;) {
      if (!delays[m][column].empty()) {
        if (seen(m, column) < share) {
          break;
        }
        found = kMultiples[m];
      }
    }
    return found;
  }
};

struct FalseAlarms {
  std::size_t samples = 0;
  std::vector<std::size_t> alarms = std::vector<std::size_t>(columns().size());  // by given limits only
  std::vector<std::size_t> early = std::vector<std::size_t>(columns().size());   // before onsets
};

using Limits = std::vector<double>;

bool exceeds(const Bank& bank, std::size_t statistic, const std::vector<double>& values, const double* limits) {
  for (std::size_t v = bank.first(statistic); v < bank.first(statistic + 1); ++v) {
    if (values[v] > limits[v]) {
      return true;
    }
  }
  return false;
}

std::uint64_t drive_seed(std::uint64_t robot, Driving driving, std::uint64_t number) {
  return robot * 100'000 + static_cast<std::uint64_t>(driving) * 10'000 + number;
}

// One robot in one regime: its banks and limits.
class Trial {
 public:
  Trial(const Options& options, std::uint64_t robot, Regime regime)
      : options_(&options), robot_(robot), subject_(make_subject(robot, regime)) {
    Random random(robot + 3'000'000);
    for (const Driving driving : kDriving) {
      std::vector<FaultyRun> runs;
      std::vector<LogTable> twins;
      for (std::size_t k = 0; k < options.runs; ++k) {
        FaultyRun run{.robot = nullptr, .drive = {}, .fault = {}, .simulated = std::nullopt};
        const double onset = 3.0 + 9.0 * random.unit();
        run.drive = make_drive(subject_, driving, drive_seed(robot, driving, 5'000 + k), onset + kPatience + 0.2);
        run.onset = (std::floor(onset * run.drive.rate) + 0.01) / run.drive.rate;
        run.side = random.unit() < 0.5 ? -1.0 : 1.0;
        twins.push_back(sim::simulate(run.drive));
        runs.push_back(run);
      }
      banks_.emplace_back(subject_, twins);
      twins_.push_back(std::move(twins));
      runs_.push_back(std::move(runs));
    }
  }

  void drive_without_faults(FalseAlarms& found) {
    const double per_drive = options_->samples / static_cast<double>(options_->robots * kDriving.size() * kMembers);
    for (const Driving driving : kDriving) {
      const auto d = static_cast<std::size_t>(driving);
      Bank& bank = banks_[d];
      limits_.emplace_back(bank.values(), 0.0);
      const auto watch = [&](double, const std::vector<double>& values) {
        ++found.samples;
        for (std::size_t v = 0; v < values.size(); ++v) {
          limits_[d][v] = std::max(limits_[d][v], values[v]);
        }
        count_given(bank, values, found.alarms);
      };
      for (std::size_t k = 0; k < kMembers; ++k) {
        const double duration = (per_drive + 2.0) / subject_.scenario.rate;
        Simulation log(make_drive(subject_, driving, drive_seed(robot_, driving, k), duration));
        bank.walk(log, watch);
      }
      for (const LogTable& twin : twins_[d]) {
        TableSource log(twin);
        Limits own(bank.values(), 0.0);
        bank.walk(log, [&](double t, const std::vector<double>& values) {
          watch(t, values);
          for (std::size_t v = 0; v < values.size(); ++v) {
            own[v] = std::max(own[v], values[v]);
          }
        });
        twin_limits_.push_back(own);
      }
    }
    everywhere_ = limits_[0];
    for (const Limits& each : limits_) {
      for (std::size_t v = 0; v < each.size(); ++v) {
        everywhere_[v] = std::max(everywhere_[v], each[v]);
      }
    }
  }

  // Cells by [driving][fault].
  void drive_with_faults(std::array<std::map<std::string, Cell>, 3>& cells, FalseAlarms& found) {
    for (const Driving driving : kDriving) {
      const auto d = static_cast<std::size_t>(driving);
      for (const TriedFault& fault : tried_faults(subject_, driving, drive_seed(robot_, driving, 9'000))) {
        Cell& cell = cells[d][fault.type.name];
        cell.unit = fault.type.unit;
        for (std::size_t k = 0; k < runs_[d].size(); ++k) {
          try_run(driving, k, fault, cell, found);
        }
      }
    }
  }

  [[nodiscard]] const Subject& subject() const { return subject_; }

 private:
  using Random = testing_support::Random;
  using FaultyRun = testing_support::FaultyRun;

  void count_given(const Bank& bank, const std::vector<double>& values, std::vector<std::size_t>& alarms) const {
    for (std::size_t c = 0; c < columns().size(); ++c) {
      const Column& column = columns()[c];
      if (column.limit == Column::Limit::given) {
        bool alarm = false;
        for (std::size_t v = bank.first(column.statistic); v < bank.first(column.statistic + 1); ++v) {
          alarm = alarm || values[v] > column.given;
        }
        alarms[c] += alarm ? 1 : 0;
      }
    }
  }

  void try_run(Driving driving, std::size_t number, const TriedFault& fault, Cell& cell, FalseAlarms& found) {
    const auto d = static_cast<std::size_t>(driving);
    FaultyRun run = runs_[d][number];
    run.fault = fault.type;
    run.simulated = fault.simulated;
    run.side = fault.type.range.lower < 0.0 ? run.side : 1.0;
    const double largest = run.side > 0.0 ? fault.type.range.upper : -fault.type.range.lower;
    double size = fault.certain[run.side > 0.0 ? 0 : 1];
    if (size == kNever) {
      size = largest;
      ++cell.unpromised;
    }
    cell.sizes.push_back(size);
    Bank& bank = banks_[d];
    for (std::size_t m = 0; m < kMultiples.size(); ++m) {
      cell.delays[m].resize(columns().size());
      if (kMultiples[m] * size > largest) {
        continue;
      }
      const LogTable table = testing_support::log_of(run, run.side * kMultiples[m] * size, true);
      TableSource log(table);
      std::vector<double> first(columns().size(), kNever);
      double by_twin = kNever;
      const Limits& twin = twin_limits_[d * options_->runs + number];
      bank.walk(log, [&](double t, const std::vector<double>& values) {
        for (std::size_t c = 0; c < columns().size(); ++c) {
          const Column& column = columns()[c];
          if (first[c] < kNever || !alarms(bank, column, values, d)) {
            continue;
          }
          if (t < run.onset) {
            ++found.early[c];
          } else {
            first[c] = t - run.onset;
          }
        }
        if (t >= run.onset && exceeds(bank, kConstant, values, twin.data())) {
          by_twin = std::min(by_twin, t - run.onset);
        }
      });
      for (std::size_t c = 0; c < columns().size(); ++c) {
        cell.delays[m][c].push_back(first[c] <= kPatience ? first[c] : kNever);
      }
      cell.by_twin[m].push_back(by_twin <= kPatience ? by_twin : kNever);
    }
  }

  [[nodiscard]] bool alarms(const Bank& bank, const Column& column, const std::vector<double>& values,
                            std::size_t d) const {
    switch (column.limit) {
      case Column::Limit::own_driving: return exceeds(bank, column.statistic, values, limits_[d].data());
      case Column::Limit::every_driving: return exceeds(bank, column.statistic, values, everywhere_.data());
      case Column::Limit::given: break;
    }
    for (std::size_t v = bank.first(column.statistic); v < bank.first(column.statistic + 1); ++v) {
      if (values[v] > column.given) {
        return true;
      }
    }
    return false;
  }

  const Options* options_;
  std::uint64_t robot_;
  Subject subject_;
  std::vector<Bank> banks_;                   // by driving, as the following
  std::vector<std::vector<LogTable>> twins_;  // fault-free logs of runs_
  std::vector<std::vector<FaultyRun>> runs_;
  std::vector<Limits> limits_, twin_limits_;  // twin_limits_: [driving · runs + run]
  Limits everywhere_;
};

std::string number(double x) { return x == kNever ? "–" : fmt::format("{:.2g}", x); }
std::string delay(double x) { return x == kNever ? "> 5 s" : std::isnan(x) ? "n/a" : fmt::format("{:.2f} s", x); }

struct Study {
  std::array<std::map<std::string, Cell>, 3> cells;
  FalseAlarms alarms;
};

void header(const char* first) {
  fmt::print("| {} |", first);
  for (const Column& column : columns()) {
    fmt::print(" {} |", column.name);
  }
  fmt::print("\n|---|");
  for (std::size_t c = 0; c < columns().size(); ++c) {
    fmt::print("---|");
  }
  fmt::print("\n");
}

void print(const Study& study) {
  header("fault, driving, certain size");
  for (const auto& [name, unused] : study.cells[0]) {
    for (const Driving driving : kDriving) {
      const Cell& cell = study.cells[static_cast<std::size_t>(driving)].at(name);
      const double size = median(cell.sizes);
      const std::string unit = cell.unit == "1" ? "" : " " + cell.unit;
      fmt::print("| {}, {}, {}{}{} |", name, to_string(driving), number(size), unit,
                 cell.unpromised > 0 ? fmt::format(" ({} of {} runs: range)", cell.unpromised, cell.sizes.size()) : "");
      for (std::size_t c = 0; c < columns().size(); ++c) {
        const double half = cell.smallest(c, 0.5);
        const std::size_t twice = cell.delays[kDouble][c].empty() ? kDouble - 1 : kDouble;
        fmt::print(" {}{}; {}{} |", delay(median(cell.delays[twice][c])), twice == kDouble ? "" : " at 1×",
                   number(half * size), half == kNever ? "" : fmt::format("{} ({}×)", unit, half));
      }
      fmt::print("\n");
    }
  }
  fmt::print(
      "\nShare of runs that see the fault within 5 s at 0.0625, 0.125, 0.25, 0.5, 1, 2, 4 times that size, in %; "
      "then the smallest multiple that every run sees.\n\n");
  header("fault, driving");
  for (const auto& [name, unused] : study.cells[0]) {
    for (const Driving driving : kDriving) {
      const Cell& cell = study.cells[static_cast<std::size_t>(driving)].at(name);
      fmt::print("| {}, {} |", name, to_string(driving));
      for (std::size_t c = 0; c < columns().size(); ++c) {
        for (std::size_t m = 0; m < kMultiples.size(); ++m) {
          fmt::print(" {}", cell.delays[m][c].empty() ? "n/a" : fmt::format("{:.0f}", 100.0 * cell.seen(m, c)));
        }
        const double all = cell.smallest(c, 1.0);
        fmt::print("; {} |", all == kNever ? "–" : fmt::format("{}×", all));
      }
      fmt::print("\n");
    }
  }
  fmt::print("\nFault-free samples: {}. Alarms in them, and before onsets in faulty runs, by sample:\n\n",
             study.alarms.samples);
  header("");
  for (const bool early : {false, true}) {
    fmt::print("| {} |", early ? "before onsets" : "fault-free");
    for (std::size_t c = 0; c < columns().size(); ++c) {
      const bool given = columns()[c].limit == Column::Limit::given;
      fmt::print(" {} |", early   ? fmt::format("{}", study.alarms.early[c])
                          : given ? fmt::format("{}", study.alarms.alarms[c])
                                  : std::string("0, tuned"));
    }
    fmt::print("\n");
  }
}

void acceptance(const Study& study) {
  const Cell& cell = study.cells[1].at("wheel_radius");
  const auto precise = [](double x) { return x == kNever ? delay(x) : fmt::format("{:.4f} s", x); };
  const double tight = median(cell.delays[kDouble][0]);
  fmt::print(
      "\nRadius of both wheels, varied driving, twice the certain size, {} runs: median delay {} of the tight "
      "threshold",
      cell.delays[kDouble][0].size(), precise(tight));
  const auto against = [&](const char* what, double peer) {
    fmt::print("; {} of {}: ratio {}", precise(peer), what, peer == kNever ? "0" : fmt::format("{:.2f}", tight / peer));
  };
  against("the best constant threshold in hindsight", median(cell.delays[kDouble][kConstant]));
  against("the best for all driving", median(cell.delays[kDouble][kConstant + 1]));
  against("one that every run has for itself, from its own fault-free twin", median(cell.by_twin[kDouble]));
  fmt::print(".\n");
}

Study run(const Options& options, Regime regime) {
  Study study;
  std::size_t done = 0;
  for (std::uint64_t robot = options.seed; done < options.robots; ++robot) {
    try {
      Trial trial(options, robot, regime);
      fmt::print(stderr, "robot {}: fault-free\n", robot);
      trial.drive_without_faults(study.alarms);
      fmt::print(stderr, "robot {}: faults\n", robot);
      trial.drive_with_faults(study.cells, study.alarms);
      ++done;
    } catch (const Error& error) {
      fmt::print(stderr, "left out: {}\n", error.what());
      if (robot > options.seed + 3 * options.robots) {
        throw;
      }
    }
  }
  return study;
}

}  // namespace

int main(int count, char** words) {
  Options options;
  for (int i = 1; i < count; i += 2) {
    const std::string word = words[i];
    const double value = i + 1 < count ? std::atof(words[i + 1]) : 0.0;
    if (value < 1.0) {
      fmt::print(stderr, "usage: wheelwright-peers [--samples N] [--seed S] [--robots R] [--runs K]\n");
      return 2;
    }
    if (word == "--samples") {
      options.samples = value;
    } else if (word == "--seed") {
      options.seed = static_cast<std::uint64_t>(value);
    } else if (word == "--robots") {
      options.robots = static_cast<std::size_t>(value);
    } else if (word == "--runs") {
      options.runs = static_cast<std::size_t>(value);
    } else {
      fmt::print(stderr, "unknown option {}\n", word);
      return 2;
    }
  }
  try {
    fmt::print(
        "{} robots from seed {} on, {} runs each per fault and class of driving; {:.3g} fault-free samples "
        "per regime asked for.\n",
        options.robots, options.seed, options.runs, options.samples);
    for (const Regime regime : {Regime::uncertain, Regime::identified}) {
      fmt::print("\n## {}\n\n", regime == Regime::uncertain ? "Parameters uncertain by 20 %" : "Well identified");
      const Study study = run(options, regime);
      print(study);
      if (regime == Regime::uncertain) {
        acceptance(study);
      }
      std::fflush(stdout);
    }
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
