// SPDX-License-Identifier: Apache-2.0
#include "bench.hpp"

#include <algorithm>
#include <chrono>

#include <wheelwright/core/check.hpp>

namespace wheelwright::bench {
namespace {

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::vector<Benchmark>& benchmarks() {
  static std::vector<Benchmark> all;
  return all;
}

bool register_bench(std::string name, std::function<std::vector<Measurement>()> run) {
  benchmarks().push_back({std::move(name), std::move(run)});
  return true;
}

std::pair<double, double> interleaved_medians(const std::function<void()>& ours, const std::function<void()>& peer,
                                              int repetitions) {
  check::that(repetitions >= 1, "repetitions", "at least 1");
  ours();
  peer();
  std::vector<double> our_times, peer_times;
  for (int k = 0; k < repetitions; ++k) {
    our_times.push_back(seconds_of(ours));
    peer_times.push_back(seconds_of(peer));
  }
  return {median(our_times), median(peer_times)};
}

}  // namespace wheelwright::bench
