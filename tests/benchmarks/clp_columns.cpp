// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/clp_columns.hpp"

#include <string>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

#include "core/error.hpp"

namespace wheelwright::bench {

void ClpColumns::add(std::span<const double> a, double b) {
  for (std::size_t j = 0; j < a.size(); ++j) {
    index_.push_back(static_cast<int>(j));
    value_.push_back(a[j]);
  }
  close(b);
}

void ClpColumns::add(const Box& box) {
  for (std::size_t j = 0; j < box.sides.size(); ++j) {
    for (const double side : {1.0, -1.0}) {
      index_.push_back(static_cast<int>(j));
      value_.push_back(side);
      close(side > 0.0 ? box.sides[j].upper : -box.sides[j].lower);
    }
  }
}

void ClpColumns::close(double b) {
  start_.push_back(static_cast<int>(index_.size()));
  b_.push_back(b);
}

void ClpColumns::load(ClpSimplex& model, std::size_t rows) const {
  const std::vector<double> lower(b_.size(), 0.0), upper(b_.size(), COIN_DBL_MAX), right(rows, 0.0);
  model.setLogLevel(0);
  model.loadProblem(size(), static_cast<int>(rows), start_.data(), index_.data(), value_.data(), lower.data(),
                    upper.data(), b_.data(), right.data(), right.data());
  model.scaling(0);
  model.setPerturbation(100);
}

void ClpColumns::append(ClpSimplex& model) const {
  const std::vector<double> lower(b_.size(), 0.0), upper(b_.size(), COIN_DBL_MAX);
  model.addColumns(size(), lower.data(), upper.data(), b_.data(), start_.data(), index_.data(), value_.data());
}

void check_optimal(const ClpSimplex& model) {
  if (model.status() != 0) {
    throw Error("CLP ends with status " + std::to_string(model.status()));
  }
}

}  // namespace wheelwright::bench
