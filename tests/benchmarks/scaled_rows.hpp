// SPDX-License-Identifier: Apache-2.0
/// \file
/// The scaling in which every peer gets its problem, so that tolerances mean the same to all of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "tests/benchmarks/lp_peers.hpp"

namespace wheelwright::bench {

/// |c − a·x| <= 1 for every row, x_j = θ_j·unit_j in `box`: rows divided by dy, columns by their largest entry.
struct ScaledRows {
  std::size_t n = 0;         ///< rows
  std::size_t p = 0;         ///< columns
  std::vector<double> a;     ///< p blocks of n: by columns, entries of size one at most
  std::vector<double> c;     ///< n
  std::vector<double> unit;  ///< p, > 0
  Box box;                   ///< prior box of x

  explicit ScaledRows(const DriveRows& rows)
      : n(rows.n), p(rows.p), a(rows.columns), c(rows.n), unit(rows.p, 0.0), box(rows.prior) {
    for (std::size_t i = 0; i < n; ++i) {
      c[i] = rows.y[i] / rows.dy[i];
    }
    for (std::size_t j = 0; j < p; ++j) {
      double* column = a.data() + j * n;
      for (std::size_t i = 0; i < n; ++i) {
        column[i] /= rows.dy[i];
        unit[j] = std::max(unit[j], std::abs(column[i]));
      }
      for (std::size_t i = 0; i < n; ++i) {
        column[i] /= unit[j];
      }
      box.sides[j] = {box.sides[j].lower * unit[j], box.sides[j].upper * unit[j]};
    }
  }

  /// Bounds of x, lower and upper of each in turn, as bounds of θ.
  [[nodiscard]] Box unscaled(std::span<const double> bounds) const {
    Box result;
    for (std::size_t j = 0; j < p; ++j) {
      result.sides.push_back({bounds[2 * j] / unit[j], bounds[2 * j + 1] / unit[j]});
    }
    return result;
  }

  /// Calls column(entries, b) for both sides of row i as half-spaces a·x <= b + 1: entries holds a and then zeros.
  template <typename Column>
  void sides(std::size_t i, const Column& column) const {
    std::array<double, 13> entries{};
    for (const double side : {1.0, -1.0}) {
      for (std::size_t j = 0; j < p; ++j) {
        entries[j] = side * a[j * n + i];
      }
      column(entries, side * c[i]);
    }
  }
};

/// Facets with every row divided by its largest entry after every column is divided by its own.
struct ScaledFacets {
  std::vector<double> a;     ///< m × p, row-major
  std::vector<double> b;     ///< m
  std::vector<double> unit;  ///< p: x_j = θ_j·unit_j

  explicit ScaledFacets(const Facets& facets) : a(facets.a), b(facets.b), unit(facets.p, 0.0) {
    for (std::size_t i = 0; i < facets.m; ++i) {
      for (std::size_t j = 0; j < facets.p; ++j) {
        unit[j] = std::max(unit[j], std::abs(a[i * facets.p + j]));
      }
    }
    for (std::size_t i = 0; i < facets.m; ++i) {
      double largest = 0.0;
      for (std::size_t j = 0; j < facets.p; ++j) {
        a[i * facets.p + j] /= unit[j];
        largest = std::max(largest, std::abs(a[i * facets.p + j]));
      }
      for (std::size_t j = 0; j < facets.p; ++j) {
        a[i * facets.p + j] /= largest;
      }
      b[i] /= largest;
    }
  }
};

}  // namespace wheelwright::bench
