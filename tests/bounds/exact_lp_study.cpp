// SPDX-License-Identifier: Apache-2.0
// exact-lp-study PROBLEMS SEED: so many problems of exact_lp.hpp, families and p = 1 … 12 in turn, against QSopt_ex;
// one line per family and one for all. Exit code 1 where a bound lies inside the exact one, a set is called empty that
// is not, or a bound is loose (exact_lp.hpp).
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include <fmt/format.h>

#include "tests/bounds/exact_lp.hpp"

int main(int count, char** arguments) try {
  using namespace wheelwright::bounds::exact_lp;
  const long long problems = count == 3 ? std::atoll(arguments[1]) : 0;
  if (problems <= 0) {
    fmt::print(stderr, "usage: exact-lp-study PROBLEMS SEED\n");
    return 2;
  }
  const auto first = static_cast<std::uint64_t>(std::atoll(arguments[2]));
  wheelwright::bounds::qsopt::start();
  constexpr std::size_t kinds = families.size(), dimensions = 12;
  std::array<Tally, kinds> each;
  Tally all;
  for (std::size_t k = 0; k < static_cast<std::size_t>(problems); ++k) {
    const std::size_t kind = k % kinds, p = 1 + k / kinds % dimensions;
    const std::uint64_t seed = first + k / (kinds * dimensions);
    const Verdict verdict = judge(problem(families[kind], p, seed), seed, 2);
    const std::string where = fmt::format("{}, p {}, seed {}", name_of(families[kind]), p, seed);
    each[kind].add(verdict, families[kind], where);
    all.add(verdict, families[kind], where);
  }
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    fmt::print("{:<13}{}\n", name_of(families[kind]), summary(each[kind]));
  }
  fmt::print("{:<13}{}\n{}", "all", summary(all), all.failures);
  return all.inside > 0 || all.empty > 0 || all.loose > 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "exact-lp-study: {}\n", error.what());
  return 3;
}
