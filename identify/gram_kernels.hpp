// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sums of products over many rows, for the vector units that the processor has. Every element is one running sum in
/// the order of the rows, without fused multiply-add: all variants give the same digits.
#pragma once

#include <cstddef>
#include <span>

namespace wheelwright::identify::gram_kernels {

/// Columns of `b` come in groups of this many, padded with zeros.
inline constexpr std::size_t kGroup = 4;

/// Rows of numbers: row k begins at data + k·stride.
struct Matrix {
  const double* data = nullptr;
  std::size_t stride = 0;
};

/// One variant of the loops.
struct GramKernels {
  const char* name;  ///< "baseline", "avx2" or "avx512"
  /// out[j·columns + l] += Σ over `rows` rows k of a(k, j)·b(k, l) for j < a_columns and l < columns (a whole number of
  /// groups); then, unless y.data is null, out[a_columns·columns + l] += Σ y(k, 0)·b(k, l). With `upper` (a and b the
  /// same) elements left of the diagonal may be left alone: only those with l >= j count.
  void (*products)(Matrix a, std::size_t a_columns, Matrix b, std::size_t columns, Matrix y, std::size_t rows,
                   bool upper, double* out);
  /// With r_k = y(k, 0) − Σ_l b(k, l)·x[l] (the groups of a row first, then (0 + 2) + (1 + 3) within the group):
  /// gradient[l] += Σ r_k·b(k, l), and squares[k mod 4] += r_k².
  void (*gradient)(Matrix y, Matrix b, std::size_t columns, std::size_t rows, const double* x, double* gradient,
                   double* squares);
};

/// The variants that this processor can run, slowest first; the first is always there.
[[nodiscard]] std::span<const GramKernels* const> available();
/// The last of them.
[[nodiscard]] const GramKernels& best();

}  // namespace wheelwright::identify::gram_kernels
