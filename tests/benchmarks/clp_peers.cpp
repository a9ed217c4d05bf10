// SPDX-License-Identifier: Apache-2.0
#include <memory>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

#include "tests/benchmarks/clp_columns.hpp"
#include "tests/benchmarks/lp_peers.hpp"
#include "tests/benchmarks/scaled_rows.hpp"

namespace wheelwright::bench {

HullPeer clp_hull(const DriveRows& drive) {
  const ScaledRows rows(drive);
  ClpColumns columns;
  for (std::size_t i = 0; i < rows.n; ++i) {
    rows.sides(i, [&](const auto& a, double b) { columns.add({a.data(), rows.p}, b + 1.0); });
  }
  columns.add(rows.box);
  const auto model = std::make_shared<ClpSimplex>();
  columns.load(*model, rows.p);

  return [model, p = rows.p, unit = rows.unit] {
    model->allSlackBasis();
    Box hull;
    for (std::size_t j = 0; j < p; ++j) {
      double bounds[2];
      for (const double sign : {-1.0, 1.0}) {
        model->setRowBounds(static_cast<int>(j), sign, sign);
        if (j == 0 && sign < 0.0) {
          model->primal();
        } else {
          model->dual();
        }
        check_optimal(*model);
        bounds[sign > 0.0] = sign * model->objectiveValue() / unit[j];
      }
      model->setRowBounds(static_cast<int>(j), 0.0, 0.0);
      hull.sides.push_back({bounds[0], bounds[1]});
    }
    return hull;
  };
}

MinimaxPeer clp_minimax(const DriveRows& drive) {
  const ScaledRows rows(drive);
  ClpColumns columns;
  for (std::size_t i = 0; i < rows.n; ++i) {
    rows.sides(i, [&](auto a, double b) {
      a[rows.p] = 1.0;
      columns.add({a.data(), rows.p + 1}, b);
    });
  }
  columns.add(rows.box);
  const auto model = std::make_shared<ClpSimplex>();
  columns.load(*model, rows.p + 1);
  model->setRowBounds(static_cast<int>(rows.p), 1.0, 1.0);

  return [model] {
    model->allSlackBasis();
    model->primal();
    check_optimal(*model);
    return -model->objectiveValue();
  };
}

SupportPeer clp_support(const Facets& facets) {
  const ScaledFacets scaled(facets);
  const std::size_t p = facets.p;
  ClpColumns columns;
  for (std::size_t i = 0; i < facets.m; ++i) {
    columns.add({scaled.a.data() + i * p, p}, scaled.b[i]);
  }
  const auto model = std::make_shared<ClpSimplex>();
  columns.load(*model, p);

  return [model, p, unit = scaled.unit](std::span<const double> directions) {
    // What CLP keeps from one program to the next: 1 work areas, 2 factorisation, 4 their initialisation.
    constexpr int keep_all = 1 + 2 + 4;
    std::vector<double> values;
    values.reserve(directions.size() / p);
    model->allSlackBasis();
    for (std::size_t k = 0; k < directions.size(); k += p) {
      for (std::size_t j = 0; j < p; ++j) {
        const double a = directions[k + j] / unit[j];
        model->setRowBounds(static_cast<int>(j), a, a);
      }
      model->dual(0, k == 0 ? 0 : keep_all);
      check_optimal(*model);
      values.push_back(model->objectiveValue());
    }
    return values;
  };
}

}  // namespace wheelwright::bench
