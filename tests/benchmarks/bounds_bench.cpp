// SPDX-License-Identifier: Apache-2.0
// Feasible set and minimax fit of a source that is walked block by block, against a bare read of the same rows.
#include <cmath>
#include <random>
#include <vector>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "bounds/minimax.hpp"
#include "tests/benchmarks/bench.hpp"

namespace wheelwright::bench::bounds_bench {
namespace {

constexpr double noise = 0.1;

double uniform(std::mt19937_64& generator) { return 2.0 * static_cast<double>(generator() >> 11) * 0x1.0p-53 - 1.0; }

/// Rows y = Yθ + e with |e| <= noise, θ = (1, 2, …). With `separate` outputs take turns with the columns.
core::RegressionTable rows_of(std::size_t instants, std::size_t outputs, std::size_t p, bool separate) {
  std::mt19937_64 generator(1);
  RegressionBlock block;
  block.resize(instants, outputs, p);
  block.Y.setZero();
  block.dY.setZero();
  block.dy.setConstant(noise);
  for (std::size_t k = 0; k < instants; ++k) {
    block.sample[k] = k;
    block.t[k] = 0.01 * static_cast<double>(k);
    for (std::size_t i = 0; i < outputs; ++i) {
      const auto row = static_cast<Eigen::Index>(k * outputs + i);
      double y = noise * uniform(generator);
      for (std::size_t j = separate ? i : 0; j < p; j += separate ? outputs : 1) {
        const double value = std::sin(0.001 * static_cast<double>(k * (j + 1))) + 0.3 * uniform(generator);
        block.Y(row, static_cast<Eigen::Index>(j)) = value;
        y += value * static_cast<double>(j + 1);
      }
      block.y[row] = y;
    }
  }
  return core::RegressionTable(std::move(block));
}

Box positive(std::size_t p) {
  Box box;
  box.sides.assign(p, {0.0, 100.0});
  return box;
}

void read_bare(core::RegressionTable& table) {
  const RegressionBlock& block = table.block();
  DoNotOptimize(block.Y.sum() + block.dY.sum() + block.y.sum() + block.dy.sum());
}

void sets(Form form) {
  core::RegressionTable table = rows_of(1000000, 2, 4, true);
  const auto rows = static_cast<std::size_t>(table.block().rows());
  const auto measure = [&](const char* name, const Work& ours) {
    const auto note = [&](double seconds) {
      return fmt::format("{:.0f} ns a row", 1e9 * seconds / static_cast<double>(rows));
    };
    compare(
        form, {name, rows, 4, 1, "bare read", note}, ours, [&] { read_bare(table); }, 3);
  };
  measure("bounds/source/feasible set", [&] { DoNotOptimize(feasible_set(table, positive(4)).hull); });
  measure("bounds/source/minimax", [&] { DoNotOptimize(bounds::minimax_fit(table, positive(4)).upper); });
}

const bool registered = register_bench("bounds/source", sets);

}  // namespace
}  // namespace wheelwright::bench::bounds_bench
