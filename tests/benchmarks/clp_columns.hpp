// SPDX-License-Identifier: Apache-2.0
/// \file
/// The dual form of a linear program, column by column, for CLP.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bounds/box.hpp"

class ClpSimplex;

namespace wheelwright::bench {

/// Columns λ >= 0 of min b·λ with Aᵀλ = a, one for each half-space of max { a·x : Ax <= b }.
class ClpColumns {
 public:
  /// A half-space with its dense coefficients.
  void add(std::span<const double> a, double b);
  /// The sides of a box.
  void add(const Box& box);
  [[nodiscard]] int size() const { return static_cast<int>(b_.size()); }

  /// A program of these columns with `rows` equalities whose right-hand sides are zero; CLP neither scales nor perturbs
  /// nor prints.
  void load(ClpSimplex& model, std::size_t rows) const;
  /// More columns for such a program.
  void append(ClpSimplex& model) const;

 private:
  void close(double b);
  std::vector<int> start_{0}, index_;
  std::vector<double> value_, b_;
};

/// Throws Error unless CLP has found an optimum.
void check_optimal(const ClpSimplex& model);

}  // namespace wheelwright::bench
