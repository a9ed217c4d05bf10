// SPDX-License-Identifier: Apache-2.0
/// \file
/// Benchmarks that register themselves and are measured against a peer in the same process run.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace wheelwright::bench {

/// One line of output.
struct Measurement {
  std::string name;           ///< room and subject, e.g. "logs/csv"
  std::size_t rows = 0;       ///< rows of the problem
  int p = 0;                  ///< number of parameters, 0 where there are none
  int threads = 1;            ///< threads used
  double seconds = 0.0;       ///< median time of ours, s
  std::string peer;           ///< what it is compared with, e.g. "bare read"
  double peer_seconds = 0.0;  ///< median time of the peer, s
  std::string note;           ///< a figure in other words, e.g. "250 MB/s"; may be empty
};

/// A registered benchmark.
struct Benchmark {
  std::string name;
  std::function<std::vector<Measurement>()> run;
};

/// All benchmarks that were registered, in no particular order.
[[nodiscard]] std::vector<Benchmark>& benchmarks();

/// Registers `run` under `name`; to initialise a variable with, at namespace scope:
///     const bool registered = register_bench("logs/csv", csv_against_bare_read);
bool register_bench(std::string name, std::function<std::vector<Measurement>()> run);

/// Median times (s) of `ours` and of `peer`, called in turn `repetitions` times each after one call of each that is not
/// counted, so that both meet the same state of the machine. Throws InvalidArgument unless repetitions >= 1.
[[nodiscard]] std::pair<double, double> interleaved_medians(const std::function<void()>& ours,
                                                            const std::function<void()>& peer, int repetitions);

/// Keeps the compiler from removing the computation of `value`.
template <typename T>
void keep(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

}  // namespace wheelwright::bench
