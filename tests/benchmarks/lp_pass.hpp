// SPDX-License-Identifier: Apache-2.0
/// \file
/// One pass over all rows for many points at once: the part of a cutting-plane loop that touches every row.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace wheelwright::bench {

/// A row and how much it is violated, in units of its bound.
struct Violation {
  std::size_t row = 0;
  double amount = 0.0;  ///< |c − a·x| − 1
};

/// For each of the points (p numbers each, one after the other): the most violated of the n rows |c − a·x| <= 1, at
/// most `most` of them, in no particular order, none violated by less than `tolerance`. `a` is p blocks of n; p <= 12.
void most_violated(const double* a, const double* c, std::size_t n, std::size_t p, std::span<const double> points,
                   std::size_t most, double tolerance, std::vector<std::vector<Violation>>& found);

}  // namespace wheelwright::bench
