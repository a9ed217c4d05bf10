// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: does a detector that watches for a day still say what it said in the first minute, in the memory it had
/// then, and how long does its slowest step take?
///
/// Plays a recording over and over, as fast as it goes, with the clock running on, through the detector of the torque
/// residual, the one at a stated risk where the model has it, and the exported C (where there is a compiler). Once an
/// hour of the clock comes trouble: a spell of values that are no numbers, lost rows, a gap, a clock that jumps back,
/// one that stands, values too small to be normal. After each, and after each beginning of the recording, the decisions
/// must be those of the first time, residuals to 1e-6 of the threshold (the clock's digits differ).
///
///     wheelwright-endurance MODEL.json LOG.csv [HOURS]      prints what it found; ends with 1 where something differs
///     wheelwright-endurance MODEL.json LOG.csv HOURS --emit the same rows as CSV, for `wheelwright detect --follow`
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "detector/export/export_c.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/online_model.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/online_model_file.hpp"
#include "tests/benchmarks/compiled_c.hpp"

using namespace wheelwright;

namespace {

constexpr double kSecondsAnHour = 3600.0;

/// MB that the process holds.
double memory() {
  std::ifstream statm("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  statm >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Durations of steps in ns: counts of powers of 2^(1/8).
class Latencies {
 public:
  void add(double ns) {
    const auto at = static_cast<std::size_t>(8.0 * std::log2(std::max(ns, 1.0)));
    ++counts_[std::min(at, counts_.size() - 1)];
    ++all_;
    longest_ = std::max(longest_, ns);
  }
  [[nodiscard]] double share(double share) const {
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      sum += counts_[k];
      if (static_cast<double>(sum) >= share * static_cast<double>(all_)) {
        return std::exp2(static_cast<double>(k + 1) / 8.0);
      }
    }
    return longest_;
  }
  [[nodiscard]] double longest() const { return longest_; }

 private:
  std::array<std::uint64_t, 512> counts_{};
  std::uint64_t all_ = 0;
  double longest_ = 0.0;
};

/// What a detector said about one sample: nothing, or the residuals in units of the threshold, and whether it raised an
/// alarm.
struct Said {
  bool valid = false, fault = false;
  double size = 0.0;
};

/// Of one detector: what it said of every row of the recording the first time, and how later times compare.
struct Watched {
  std::string name;
  std::function<Said(double, const double*)> step;
  std::vector<Said> first{};
  Latencies latencies{};
  std::uint64_t steps = 0, valid = 0, faults = 0, different = 0;
  double largest_difference = 0.0;

  void take(double t, const double* sample, std::optional<std::size_t> row, bool learn) {
    const auto begun = std::chrono::steady_clock::now();
    const Said said = step(t, sample);
    latencies.add(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begun).count());
    ++steps;
    valid += said.valid ? 1 : 0;
    faults += said.fault ? 1 : 0;
    if (!row) {
      return;
    }
    if (learn) {
      first.push_back(said);
      return;
    }
    const Said& before = first[*row];
    if (said.valid && before.valid) {
      largest_difference = std::max(largest_difference, std::abs(said.size - before.size));
    }
    different +=
        said.fault != before.fault || (said.valid && before.valid && !(std::abs(said.size - before.size) < 1e-6)) ? 1
                                                                                                                  : 0;
  }
};

/// The exported detector.
class Exported {
 public:
  explicit Exported(const OnlineModel& model)
      : compiled_(exporter::c_header(make_detector(model), {.name = "robot"}),
                  "#include \"robot.h\"\n"
                  "static robot_state s;\n"
                  "void begin_robot(void) { robot_init(&s); }\n"
                  "int step_robot(double t, const double *sample, double *size) {\n"
                  "  robot_decision d; int i; robot_step(&s, t, sample, &d); *size = 0.0;\n"
                  "  for (i = 0; d.valid && i < ROBOT_CHANNELS; ++i) {\n"
                  "    const double width = d.channel[i].upper - d.channel[i].lower;\n"
                  "    *size += d.channel[i].residual / width;\n"
                  "  }\n"
                  "  return d.valid + 2 * d.fault;\n}\n"),
        step_(compiled_.function<int(double, const double*, double*)>("step_robot")) {
    if (auto* const begin = compiled_.function<void()>("begin_robot")) {
      begin();
    }
  }
  [[nodiscard]] bool loaded() const { return step_ != nullptr; }
  [[nodiscard]] Said step(double t, const double* sample) const {
    Said said;
    const int what = step_(t, sample, &said.size);
    said.valid = (what & 1) != 0;
    said.fault = (what & 2) != 0;
    return said;
  }

 private:
  bench::CompiledC compiled_;
  int (*step_)(double, const double*, double*);
};

/// Rows of the recording with the clock running on, and the troubles of each hour. `each` gets the time, the sample,
/// and the row's number where what is said of it can be compared.
class Player {
 public:
  Player(const LogTable& log, const std::vector<std::string>& columns) : log_(log), inputs_(columns.size()) {
    for (std::size_t k = 0; k < log.rows(); ++k) {
      for (const std::string& name : columns) {
        samples_.push_back(log.column(name)[k]);
      }
    }
  }

  template <class Each>
  void play(double hours, const Each& each, const std::function<void(double hour)>& hourly) {
    const double length = log_.t.back() - log_.t.front() + 1.0;  // a gap between one time and the next
    const double step = (log_.t.back() - log_.t.front()) / static_cast<double>(log_.rows() - 1);
    double next_hour = kSecondsAnHour, hour = 1.0;
    for (double start = 0.0; start < hours * kSecondsAnHour + length; start += length) {
      if (start >= next_hour) {
        trouble(start - 0.9, step, each);
        hourly(hour);
        next_hour += kSecondsAnHour;
        hour += 1.0;
      }
      for (std::size_t k = 0; k < log_.rows(); ++k) {
        each(start + log_.t[k] - log_.t.front(), samples_.data() + k * inputs_, std::optional(k), start == 0.0);
      }
    }
  }

  [[nodiscard]] std::size_t inputs() const { return inputs_; }

 private:
  template <class Each>
  void trouble(double t, double step, const Each& each) const {
    std::vector<double> sample(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(inputs_));
    const auto spell = [&](double first, double by, double value) {
      for (int k = 0; k < 50; ++k) {
        std::vector<double> bad = sample;
        bad[static_cast<std::size_t>(k) % inputs_] = value;
        each(first + by * k, bad.data(), std::optional<std::size_t>(), false);
      }
    };
    spell(t, step, std::numeric_limits<double>::quiet_NaN());
    spell(t + 0.2, step, -std::numeric_limits<double>::infinity());
    spell(t - 20.0, step, sample[0]);                                 // the clock jumps back
    spell(t - 20.0, 0.0, sample[0]);                                  // and stands
    spell(t + 0.4, step, std::numeric_limits<double>::denorm_min());  // too small to be normal
    spell(t + 0.6, 2.0 * step, sample[0]);                            // every other row is lost
  }

  const LogTable& log_;
  std::size_t inputs_;
  std::vector<double> samples_;
};

int watch(const OnlineModel& model, Player& player, double hours) {
  TorqueDetector detector = make_detector(model);
  std::optional<detector::ScaleDetector> sums;
  const Exported exported(model);
  std::vector<Watched> all;
  all.push_back({"Detector", [&](double t, const double* sample) {
                   const Decision& d = detector.step(t, {sample, player.inputs()});
                   Said said{d.valid, d.fault, 0.0};
                   for (const auto& channel : d.channels) {
                     said.size += d.valid ? channel.residual / channel.threshold.width() : 0.0;
                   }
                   return said;
                 }});
  if (model.at_risk) {
    sums.emplace(model);
    double last = -std::numeric_limits<double>::infinity();
    all.push_back({"ScaleDetector", [&sums, &player, last](double t, const double* sample) mutable {
                     if (std::isfinite(t) && (!(t > last) || t - last > 0.5)) {
                       sums->restart();
                     }
                     last = std::isfinite(t) ? t : last;
                     Said said;
                     said.valid = sums->step(t, {sample, player.inputs()});
                     said.fault = sums->alarm();
                     for (const detector::SumState& look : sums->looks()) {
                       said.size += look.threshold > 0.0 ? look.value / look.threshold : 0.0;
                     }
                     return said;
                   }});
  }
  if (exported.loaded()) {
    all.push_back({"exported C", [&](double t, const double* sample) { return exported.step(t, sample); }});
  }
  double first_hour = 0.0, last_hour = 0.0;
  player.play(
      hours,
      [&](double t, const double* sample, std::optional<std::size_t> row, bool learn) {
        for (Watched& each : all) {
          each.take(t, sample, row, learn);
        }
      },
      [&](double hour) {
        last_hour = memory();
        first_hour = hour == 1.0 ? last_hour : first_hour;
      });
  fmt::print("memory after the first hour {:.1f} MB, after the last {:.1f} MB\n\n", first_hour, last_hour);
  fmt::print(
      "| | steps | of them decided | alarms | different | largest difference | p50 | p99 | p99.99 | longest |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|\n");
  bool sound = last_hour < 1.02 * first_hour + 1.0;
  for (const Watched& w : all) {
    fmt::print("| {} | {} | {} | {} | {} | {:.1g} | {:.0f} ns | {:.0f} ns | {:.1f} us | {:.1f} us |\n", w.name, w.steps,
               w.valid, w.faults, w.different, w.largest_difference, w.latencies.share(0.5), w.latencies.share(0.99),
               1e-3 * w.latencies.share(0.9999), 1e-3 * w.latencies.longest());
    sound = sound && w.different == 0;
  }
  return sound ? EXIT_SUCCESS : EXIT_FAILURE;
}

void emit(const std::vector<std::string>& columns, Player& player, double hours) {
  std::string text = "t";
  for (const std::string& name : columns) {
    text += "," + name;
  }
  text += "\n";
  const auto flush = [&] {
    std::fwrite(text.data(), 1, text.size(), stdout);
    text.clear();
  };
  player.play(
      hours,
      [&](double t, const double* sample, std::optional<std::size_t>, bool) {
        fmt::format_to(std::back_inserter(text), "{}", t);
        for (std::size_t i = 0; i < player.inputs(); ++i) {
          fmt::format_to(std::back_inserter(text), ",{}", sample[i]);
        }
        text += '\n';
        if (text.size() > 1 << 16) {
          flush();
        }
      },
      [](double) {});
  flush();
}

}  // namespace

int main(int count, char** words) try {
  const bool only_rows = count == 5 && std::string_view(words[4]) == "--emit";
  if (count != 3 && count != 4 && !only_rows) {
    fmt::print(stderr, "usage: wheelwright-endurance MODEL.json LOG.csv [HOURS [--emit]]\n");
    return 2;
  }
  const OnlineModel model = read_model(words[1]);
  CsvLog source({words[2]});
  const LogTable log = core::read_all(source);
  const double hours = count > 3 ? std::strtod(words[3], nullptr) : 24.0;
  const std::vector<std::string> columns = model.measurement.columns();
  Player player(log, columns);
  if (only_rows) {
    emit(columns, player, hours);
    return EXIT_SUCCESS;
  }
  return watch(model, player, hours);
} catch (const Error& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 2;
}
