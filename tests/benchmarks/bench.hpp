// SPDX-License-Identifier: Apache-2.0
/// \file
/// Benchmarks that register themselves and are measured against a peer in the same process run. Google Benchmark times,
/// repeats and interleaves. It knows no peers, and would hold the problems of all benchmarks at once: here every pair
/// is a run of its own, made when its problem is there.
#pragma once

#include <concepts>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include <benchmark/benchmark.h>

namespace wheelwright::bench {

using benchmark::DoNotOptimize;

/// What is timed, made of any function without arguments. One that returns a double has taken its time (s) itself.
struct Work {
  template <std::invocable Function>
  Work(Function work)
      : own_clock(std::is_same_v<std::invoke_result_t<Function&>, double>),
        run([work](benchmark::State& state) mutable {
          for ([[maybe_unused]] const auto iteration : state) {
            if constexpr (std::is_same_v<std::invoke_result_t<Function&>, double>) {
              state.SetIterationTime(work());
            } else {
              work();
            }
          }
        }) {}

  bool own_clock;                              ///< whether it takes the time itself
  std::function<void(benchmark::State&)> run;  ///< what Google Benchmark calls for a repetition
};

/// What a line says beside the times.
struct Subject {
  std::string name;      ///< module and subject, e.g. "logs/csv"
  std::size_t rows = 0;  ///< rows of the problem
  int p = 0;             ///< number of parameters, 0 where there are none
  int threads = 1;       ///< threads used
  std::string peer;      ///< what it is compared with, e.g. "bare read"
  /// A figure in other words, e.g. "250 MB/s", of the median time of ours (s). Called when both have run and before
  /// anything is printed; what it throws ends the program.
  std::function<std::string(double seconds)> note = {};
};

/// Where lines go: to standard output, as JSON or as a table.
enum class Form { table, json };

/// Hands Google Benchmark the `options` of a command line (the program's name first): repetitions are in random order,
/// of 0.1 s at least and after one call that is not counted, unless they say otherwise. `help` is what --help prints.
/// Returns false where there is an option that it does not know.
[[nodiscard]] bool take_options(std::vector<char*> options, void (*help)());

/// Times `ours` and `peer`, `repetitions` times each in random order after one call of each that is not counted, so
/// that both meet the same state of the machine, and prints their medians as one line. A repetition lasts for
/// --benchmark_min_time at least: shorter work is done again, and its mean counts. Work that takes its time itself is
/// done once.
void compare(Form form, const Subject& subject, const Work& ours, const Work& peer, int repetitions);

/// All benchmarks that were registered, by name; two may have one name.
[[nodiscard]] std::multimap<std::string, std::function<void(Form)>>& benchmarks();

/// Registers `run` under `name`; to initialise a variable with, at namespace scope:
///     const bool registered = register_bench("logs/csv", csv_against_bare_read);
bool register_bench(std::string name, std::function<void(Form)> run);

}  // namespace wheelwright::bench
