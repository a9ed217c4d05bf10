// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sums of products over many rows, for the vector units that the processor has. Every element is one running sum in the
/// order of the rows, without fused multiply-add: all variants give the same digits.
#pragma once

#include <cstddef>
#include <span>

namespace wheelwright::gram_kernels {

/// Columns of `b` come in groups of this many, padded with zeros.
inline constexpr std::size_t kGroup = 4;

/// One variant of the loops.
struct GramKernels {
  const char* name;  ///< "baseline", "avx2" or "avx512"
  /// out[j·columns + l] += Σ over `rows` rows k of a[k·a_stride + j]·b[k·b_stride + l] for j < a_columns and l < columns
  /// (a whole number of groups). With `upper` (a and b the same) elements left of the diagonal are left alone or not, as
  /// it comes: only those with l >= j count.
  void (*products)(const double* a, std::size_t a_stride, std::size_t a_columns, const double* b, std::size_t b_stride,
                   std::size_t columns, std::size_t rows, bool upper, double* out);
  /// out[k] = y[k·y_stride] − Σ_l b[k·b_stride + l]·x[l], groups of columns first, then within the group.
  void (*residuals)(const double* y, std::size_t y_stride, const double* b, std::size_t b_stride, std::size_t columns,
                    std::size_t rows, const double* x, double* out);
};

/// The variants that this processor can run, slowest first; the first is always there.
[[nodiscard]] std::span<const GramKernels* const> available();
/// The last of them.
[[nodiscard]] const GramKernels& best();

}  // namespace wheelwright::gram_kernels
