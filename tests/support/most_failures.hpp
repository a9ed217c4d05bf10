// SPDX-License-Identifier: Apache-2.0
/// \file
/// How many of many runs may fail that each fail with a known risk.
#pragma once

#include <cmath>
#include <cstddef>

namespace wheelwright::testing_support {

/// The chance of more than this is below 1e-6 if each of `runs` fails with `risk`, independently.
inline std::size_t most_failures(std::size_t runs, double risk) {
  double term = std::pow(1.0 - risk, static_cast<double>(runs)), sum = term;
  std::size_t k = 0;
  while (1.0 - sum > 1e-6) {
    term *= static_cast<double>(runs - k) / static_cast<double>(k + 1) * risk / (1.0 - risk);
    sum += term;
    ++k;
  }
  return k;
}

}  // namespace wheelwright::testing_support
