// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: how soon, and from which size on, do a guaranteed threshold and the detector at a stated risk see a fault,
/// compared with detectors whose limits were chosen in hindsight so that they raise no false alarm on the very logs of
/// the study, and with the same detectors tuned on other logs, as users have to?
///
/// Random robots drive gently, variedly and hard, in two regimes: parameters uncertain by 20 % (another θ in the box in
/// every drive), and commissioned from a rich log. The first pass walks fault-free drives, and finds every peer's
/// limits in hindsight: the largest value it ever had, per robot, class of driving and output. The fault-free twins of
/// all faulty drives are among them. Limits of other logs (bank.hpp, Tuning) are tried on the same drives. The second
/// pass breaks the robots, by multiples of the size that is certain for half of all onsets within 1 s: from 4 down in
/// steps of √2, until nothing sees the fault. Prints Markdown.
///
///     wheelwright-peers [--samples N] [--seed S] [--robots R] [--runs K] [--regime uncertain|identified]
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

#include "core/error.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/peers/bank.hpp"
#include "tests/benchmarks/peers/field.hpp"

using namespace wheelwright;
using namespace wheelwright::peers;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::size_t kMembers = 12;   // long fault-free drives per robot and class of driving
constexpr double kUsualSamples = 1e5;  // of the other logs that peers are tuned on
constexpr double kMargin = 1.5;        // customary; enough for Gaussian tails from 10⁵ samples to ten years at 100 Hz
constexpr double kMostFalse = 1e-4;    // false alarms by sample: a column with more is no rival
constexpr std::size_t kSilentSizes = 3;  // one after the other that nothing sees: smaller ones are not tried

// Powers of √2 from 2⁻¹⁰ to 4.
constexpr std::size_t kSizes = 25, kCertain = 20, kDouble = 22;
double multiple(std::size_t m) { return std::exp2(0.5 * (static_cast<double>(m) - kCertain)); }

struct Options {
  double samples = 1e7;  // fault-free, per regime
  std::uint64_t seed = 1;
  std::size_t robots = 6, runs = 6;  // runs per robot, class of driving and fault
  std::vector<Regime> regimes = {Regime::uncertain, Regime::identified};
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
  std::size_t unpromised = 0;                                   // runs without a certain size
  std::array<std::vector<std::vector<double>>, kSizes> delays;  // [multiple][column][run], s
  std::array<std::vector<double>, kSizes> by_twin;              // of |ε| against the maximum of the run's own twin

  [[nodiscard]] double seen(std::size_t m, std::size_t column) const {
    const std::vector<double>& all = delays[m][column];
    return static_cast<double>(std::count_if(all.begin(), all.end(), [](double d) { return d <= kPatience; })) /
           static_cast<double>(all.size());
  }
  // The smallest multiple from which on half of the runs see the fault: between two that were tried by their shares.
  [[nodiscard]] double smallest(std::size_t column) const {
    double found = kNever, above = 0.0;
    for (std::size_t m = kSizes; m-- > 0;) {
      if (delays[m].empty() || delays[m][column].empty()) {
        continue;
      }
      const double share = seen(m, column);
      if (share < 0.5) {
        return found < kNever ? found * std::exp2(-0.5 * (above - 0.5) / (above - share)) : kNever;
      }
      found = multiple(m);
      above = share;
    }
    return found;
  }
  // The delay that half of the runs keep at the size that was tried next above `size`.
  [[nodiscard]] double delay(std::size_t column, double size) const {
    for (std::size_t m = 0; m < kSizes; ++m) {
      if (multiple(m) >= size * (1.0 - 1e-9) && !delays[m].empty() && !delays[m][column].empty()) {
        std::vector<double> all = delays[m][column];
        std::sort(all.begin(), all.end());
        return all[(all.size() - 1) / 2];
      }
    }
    return kNever;
  }
};

struct FalseAlarms {
  std::size_t samples = 0;
  std::vector<std::size_t> alarms = std::vector<std::size_t>(columns().size());  // none by limits of hindsight
  std::vector<std::size_t> early = std::vector<std::size_t>(columns().size());   // before onsets

  // True if a column sees faults where there are none: more than once in 10⁴ samples.
  [[nodiscard]] bool blares(std::size_t column) const {
    return static_cast<double>(alarms[column]) > kMostFalse * static_cast<double>(samples);
  }
};

using Limits = std::vector<double>;

bool exceeds(const Bank& bank, std::size_t statistic, const std::vector<double>& values, const Limits& limits) {
  for (std::size_t v = bank.first(statistic); v < bank.first(statistic + 1); ++v) {
    if (values[v] > limits[v]) {
      return true;
    }
  }
  return false;
}

bool alarms(const Bank& bank, const Column& column, const std::vector<double>& values, const Limits& limits) {
  return exceeds(bank, column.statistic, values, limits) ||
         (column.also && exceeds(bank, *column.also, values, limits));
}

void raise(Limits& limits, const std::vector<double>& values) {
  for (std::size_t v = 0; v < limits.size(); ++v) {
    limits[v] = std::max(limits[v], values[v]);
  }
}

Limits largest_of(Bank& bank, const std::vector<LogTable>& logs) {
  Limits limits(bank.values(), 0.0);
  for (const LogTable& table : logs) {
    TableSource log(table);
    bank.walk(log, [&](double, const std::vector<double>& values) { raise(limits, values); });
  }
  return limits;
}

// One robot in one regime: its banks and limits.
class Trial {
 public:
  Trial(const Options& options, std::uint64_t robot, Regime regime)
      : options_(&options),
        robot_(robot),
        subject_(make_subject(robot, regime)),
        runs_(make_runs(subject_, robot, options.runs)) {
    const std::vector<LogTable> minute{sim::simulate(subject_.learning)},
        usual = usual_logs(subject_, robot, kUsualSamples);
    const Calibration by_minute = calibrate(subject_, minute), by_usual = calibrate(subject_, usual);
    for (const auto& runs : runs_) {
      std::vector<LogTable> twins;
      for (const FaultyRun& run : runs) {
        twins.push_back(sim::simulate(run.drive));
      }
      banks_.emplace_back(subject_, std::array{calibrate(subject_, twins), by_minute, by_usual});
      twins_.push_back(std::move(twins));
    }
    Bank& bank = banks_.front();
    const Limits minute_limits = largest_of(bank, minute), usual_limits = largest_of(bank, usual);
    for (std::size_t c = 0; c < columns().size(); ++c) {
      const Column& column = columns()[c];
      limits_[c].fill(column.tuning == Tuning::minute         ? bank.with_margin(minute_limits, kMargin)
                      : column.tuning == Tuning::usual        ? usual_limits
                      : column.tuning == Tuning::usual_margin ? bank.with_margin(usual_limits, kMargin)
                                                              : Limits(bank.values(), column.given));
    }
  }

  void drive_without_faults(FalseAlarms& found) {
    const double per_drive = options_->samples / static_cast<double>(options_->robots * kDriving.size() * kMembers);
    std::array<Limits, kDriving.size()> largest;
    Limits everywhere(banks_.front().values(), 0.0);
    for (const Driving driving : kDriving) {
      const auto d = static_cast<std::size_t>(driving);
      Bank& bank = banks_[d];
      largest[d] = Limits(bank.values(), 0.0);
      const auto watch = [&](double, const std::vector<double>& values) {
        ++found.samples;
        raise(largest[d], values);
        for (std::size_t c = 0; c < columns().size(); ++c) {
          const bool alarm = !columns()[c].hindsight() && alarms(bank, columns()[c], values, limits_[c][d]);
          found.alarms[c] += alarm ? 1 : 0;
        }
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
          raise(own, values);
        });
        twin_limits_.push_back(own);
      }
      raise(everywhere, largest[d]);
    }
    for (std::size_t c = 0; c < columns().size(); ++c) {
      for (std::size_t d = 0; d < kDriving.size() && columns()[c].hindsight(); ++d) {
        limits_[c][d] = columns()[c].tuning == Tuning::own_driving ? largest[d] : everywhere;
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
  using FaultyRun = testing_support::FaultyRun;

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
    std::size_t silent = 0;
    for (std::size_t m = kSizes; m-- > 0;) {
      cell.delays[m].resize(columns().size());
      if (multiple(m) * size > largest) {
        continue;
      }
      std::vector<double> first(columns().size(), kNever);
      double by_twin = kNever;
      if (silent < kSilentSizes) {
        const LogTable table = testing_support::log_of(run, run.side * multiple(m) * size, true);
        TableSource log(table);
        const Limits& twin = twin_limits_[d * options_->runs + number];
        bank.walk(log, [&](double t, const std::vector<double>& values) {
          for (std::size_t c = 0; c < columns().size(); ++c) {
            if (first[c] < kNever || !alarms(bank, columns()[c], values, limits_[c][d])) {
              continue;
            }
            if (t < run.onset) {
              ++found.early[c];
            } else {
              first[c] = t - run.onset;
            }
          }
          if (t >= run.onset && exceeds(bank, kConstant, values, twin)) {
            by_twin = std::min(by_twin, t - run.onset);
          }
        });
      }
      const auto in_time = [](double delay) { return delay <= kPatience; };
      ++silent;
      for (std::size_t c = 0; c < columns().size(); ++c) {
        silent = in_time(first[c]) && !found.blares(c) ? 0 : silent;
        cell.delays[m][c].push_back(in_time(first[c]) ? first[c] : kNever);
      }
      cell.by_twin[m].push_back(in_time(by_twin) ? by_twin : kNever);
    }
  }

  const Options* options_;
  std::uint64_t robot_;
  Subject subject_;
  std::array<std::vector<FaultyRun>, kDriving.size()> runs_;  // by driving, as the following
  std::vector<Bank> banks_;
  std::vector<std::vector<LogTable>> twins_;                                   // fault-free logs of runs_
  std::vector<Limits> twin_limits_;                                            // [driving · runs + run]
  std::vector<std::array<Limits, kDriving.size()>> limits_{columns().size()};  // [column][driving]
};

std::string number(double x) { return x == kNever ? "–" : fmt::format("{:.2g}", x); }
std::string delay(double x) { return x == kNever ? "> 5 s" : std::isnan(x) ? "n/a" : fmt::format("{:.2f} s", x); }

struct Study {
  std::array<std::map<std::string, Cell>, 3> cells;
  FalseAlarms alarms;
};

// Every row of the tables.
template <class At>
void for_each_row(const Study& study, At&& at) {
  for (const auto& [name, unused] : study.cells[0]) {
    for (const Driving driving : kDriving) {
      at(fmt::format("{}, {}", name, to_string(driving)), study.cells[static_cast<std::size_t>(driving)].at(name));
    }
  }
}

std::vector<std::size_t> columns_where(bool (*chosen)(const Column&)) {
  std::vector<std::size_t> found;
  for (std::size_t c = 0; c < columns().size(); ++c) {
    if (chosen(columns()[c])) {
      found.push_back(c);
    }
  }
  return found;
}

std::string words(const Column& column) {
  switch (column.tuning) {
    case Tuning::given:
    case Tuning::own_driving:
    case Tuning::every_driving: break;
    case Tuning::minute: return column.name + " (60 s, with margin)";
    case Tuning::usual: return column.name + " (10⁵ samples)";
    case Tuning::usual_margin: return column.name + " (10⁵ samples, with margin)";
  }
  return column.name;
}

// Peers that were tuned in one way.
struct Peers {
  std::string how;
  std::vector<std::size_t> columns;

  [[nodiscard]] std::size_t best(const Cell& cell) const {
    return *std::min_element(columns.begin(), columns.end(),
                             [&](std::size_t a, std::size_t b) { return cell.smallest(a) < cell.smallest(b); });
  }
};

// Without those that raise false alarms all the time.
std::vector<Peers> rivals(const FalseAlarms& alarms) {
  std::vector<Peers> all = {
      {"in hindsight", columns_where([](const Column& c) { return c.hindsight(); })},
      {"60 s, with margin", columns_where([](const Column& c) { return c.tuning == Tuning::minute; })},
      {"10⁵ samples", columns_where([](const Column& c) { return c.tuning == Tuning::usual; })},
      {"10⁵ samples, with margin", columns_where([](const Column& c) { return c.tuning == Tuning::usual_margin; })}};
  for (Peers& peers : all) {
    std::erase_if(peers.columns, [&](std::size_t c) { return alarms.blares(c); });
  }
  std::erase_if(all, [](const Peers& peers) { return peers.columns.empty(); });
  return all;
}

void header(const std::string& first, const std::vector<std::string>& names) {
  fmt::print("| {} |", first);
  for (const std::string& name : names) {
    fmt::print(" {} |", name);
  }
  fmt::print("\n|---|");
  for (std::size_t c = 0; c < names.size(); ++c) {
    fmt::print("---|");
  }
  fmt::print("\n");
}

void print_columns(const Study& study, const std::vector<std::size_t>& shown) {
  std::vector<std::string> names;
  for (const std::size_t c : shown) {
    names.push_back(words(columns()[c]));
  }
  header("fault, driving, certain size", names);
  for_each_row(study, [&](const std::string& row, const Cell& cell) {
    const double size = median(cell.sizes);
    const std::string unit = cell.unit == "1" ? "" : " " + cell.unit;
    fmt::print("| {}, {}{}{} |", row, number(size), unit,
               cell.unpromised > 0 ? fmt::format(" ({} of {} runs: range)", cell.unpromised, cell.sizes.size()) : "");
    for (const std::size_t c : shown) {
      const double half = cell.smallest(c);
      const std::size_t twice = cell.delays[kDouble][c].empty() ? kCertain : kDouble;
      fmt::print(" {}{}; {}{} |", delay(median(cell.delays[twice][c])), twice == kDouble ? "" : " at 1×",
                 number(half * size), half == kNever ? "" : fmt::format("{} ({:.2g}×)", unit, half));
    }
    fmt::print("\n");
  });
}

// Sums against the best peer of each way to tune them, row by row.
void print_best(const Study& study, const std::vector<Peers>& groups) {
  std::vector<std::string> names = {"dead zone", "sums", "dead zone or sums"};
  for (const Peers& peers : groups) {
    names.push_back("best peer, " + peers.how);
  }
  header("fault, driving", names);
  for_each_row(study, [&](const std::string& row, const Cell& cell) {
    fmt::print("| {} |", row);
    const double size = cell.smallest(kSumsColumn);
    const auto put = [&](std::size_t c, const std::string& name) {
      const double half = cell.smallest(c);
      fmt::print(" {}{}; {} |", name, half == kNever ? "–" : fmt::format("{:.2g}×", half), delay(cell.delay(c, size)));
    };
    for (const std::size_t c : {kDeadZoneColumn, kSumsColumn, kEitherColumn}) {
      put(c, "");
    }
    for (const Peers& peers : groups) {
      const std::size_t best = peers.best(cell);
      put(best, columns()[best].name + ": ");
    }
    fmt::print("\n");
  });
}

// Every column against the sums.
void print_summary(const Study& study, const std::vector<Peers>& groups) {
  header("", {"size: ahead of / behind the sums", "its size over the sums', median", "over that of dead zone or sums",
              "delay at 2×: ahead of / behind the sums", "false alarms, fault-free", "before onsets"});
  for (std::size_t c = 0; c < columns().size(); ++c) {
    std::vector<double> ratio, either;
    std::array<int, 2> size{}, soon{};
    for_each_row(study, [&](const std::string&, const Cell& cell) {
      const double own = cell.smallest(c), sums = cell.smallest(kSumsColumn);
      const std::size_t twice = cell.delays[kDouble][c].empty() ? kCertain : kDouble;
      const double after = median(cell.delays[twice][c]), sums_after = median(cell.delays[twice][kSumsColumn]);
      size[0] += own < sums ? 1 : 0;
      size[1] += own > sums ? 1 : 0;
      soon[0] += after < sums_after ? 1 : 0;
      soon[1] += after > sums_after ? 1 : 0;
      ratio.push_back(own == sums ? 1.0 : own / sums);
      either.push_back(own == cell.smallest(kEitherColumn) ? 1.0 : own / cell.smallest(kEitherColumn));
    });
    fmt::print("| {} | {} / {} | {} | {} | {} / {} | {} | {} |\n", words(columns()[c]), size[0], size[1],
               number(median(ratio)), number(median(either)), soon[0], soon[1],
               columns()[c].hindsight() ? std::string("0, tuned") : std::to_string(study.alarms.alarms[c]),
               study.alarms.early[c]);
  }
  fmt::print(
      "\nRows in which the smallest size that half of the runs see is within 1.5 times that of the best peer; "
      "smaller than that of every peer; median of the ratio to the best peer:\n\n");
  header("peers tuned", {"sums", "dead zone or sums"});
  for (const Peers& peers : groups) {
    fmt::print("| {} |", peers.how);
    for (const std::size_t own : {kSumsColumn, kEitherColumn}) {
      int near = 0, smaller = 0, rows = 0;
      std::vector<double> ratio;
      for_each_row(study, [&](const std::string&, const Cell& cell) {
        const double size = cell.smallest(own), best = cell.smallest(peers.best(cell));
        ++rows;
        near += size <= 1.5 * best ? 1 : 0;
        smaller += size < best ? 1 : 0;
        ratio.push_back(size / best);
      });
      fmt::print(" {} of {}; {} of {}; {} |", near, rows, smaller, rows, number(median(ratio)));
    }
    fmt::print("\n");
  }
}

void print(const Study& study) {
  const std::vector<Peers> groups = rivals(study.alarms);
  print_columns(study, columns_where([](const Column& c) { return c.tuning == Tuning::given || c.hindsight(); }));
  fmt::print("\nPeers tuned on other logs:\n\n");
  print_columns(study, columns_where([](const Column& c) { return c.tuning != Tuning::given && !c.hindsight(); }));
  fmt::print(
      "\nThe smallest size that half of the runs see, in multiples of the certain one; the median delay at that "
      "size of the sums:\n\n");
  print_best(study, groups);
  fmt::print("\nFault-free samples: {}. Rows out of 24, and alarms by sample:\n\n", study.alarms.samples);
  print_summary(study, groups);
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
  against("the best constant threshold in hindsight", median(cell.delays[kDouble][kConstantColumn]));
  against("the best for all driving", median(cell.delays[kDouble][kConstantColumn + 1]));
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
    const std::string word = words[i], text = i + 1 < count ? words[i + 1] : "";
    if (word == "--regime" && (text == "uncertain" || text == "identified")) {
      options.regimes = {text == "uncertain" ? Regime::uncertain : Regime::identified};
      continue;
    }
    const double value = i + 1 < count ? std::atof(words[i + 1]) : 0.0;
    if (value < 1.0) {
      fmt::print(stderr,
                 "usage: wheelwright-peers [--samples N] [--seed S] [--robots R] [--runs K] "
                 "[--regime uncertain|identified]\n");
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
    for (const Regime regime : options.regimes) {
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
