// SPDX-License-Identifier: Apache-2.0
/// \file
/// The dual form of a linear program, column by column, for CLP.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

#include <wheelwright/core/error.hpp>

#include "scaled_rows.hpp"

namespace wheelwright::bench {

/// Columns λ >= 0 of min b·λ with Aᵀλ = a, one for each half-space of max { a·x : Ax <= b }.
class ClpColumns {
 public:
  /// A half-space with its dense coefficients.
  void add(std::span<const double> a, double b) {
    for (std::size_t j = 0; j < a.size(); ++j) {
      index_.push_back(static_cast<int>(j));
      value_.push_back(a[j]);
    }
    close(b);
  }
  /// The sides of a box.
  void add(const Box& box) {
    for (std::size_t j = 0; j < box.sides.size(); ++j) {
      for (const double side : {1.0, -1.0}) {
        index_.push_back(static_cast<int>(j));
        value_.push_back(side);
        close(side > 0.0 ? box.sides[j].upper : -box.sides[j].lower);
      }
    }
  }
  [[nodiscard]] int size() const { return static_cast<int>(b_.size()); }

  /// A program of these columns with `rows` equalities whose right-hand sides are zero.
  void load(ClpSimplex& model, std::size_t rows) const {
    const std::vector<double> lower(b_.size(), 0.0), upper(b_.size(), COIN_DBL_MAX), right(rows, 0.0);
    model.setLogLevel(0);
    model.loadProblem(size(), static_cast<int>(rows), start_.data(), index_.data(), value_.data(), lower.data(),
                      upper.data(), b_.data(), right.data(), right.data());
    model.scaling(0);
    model.setPerturbation(100);  // none
  }
  /// More columns for such a program.
  void append(ClpSimplex& model) const {
    const std::vector<double> lower(b_.size(), 0.0), upper(b_.size(), COIN_DBL_MAX);
    model.addColumns(size(), lower.data(), upper.data(), b_.data(), start_.data(), index_.data(), value_.data());
  }

 private:
  void close(double b) {
    start_.push_back(static_cast<CoinBigIndex>(index_.size()));
    b_.push_back(b);
  }
  std::vector<CoinBigIndex> start_{0};
  std::vector<int> index_;
  std::vector<double> value_, b_;
};

/// Throws Error unless CLP has found an optimum.
inline void check_optimal(const ClpSimplex& model) {
  if (model.status() != 0) {
    throw Error("CLP ends with status " + std::to_string(model.status()));
  }
}

}  // namespace wheelwright::bench
