// SPDX-License-Identifier: Apache-2.0
/// \file
/// The loops of gram_kernels.hpp for vectors of W doubles. Included by one source file per processor variant; nothing of
/// the standard library is called here, since an inline function compiled for a newer processor could be the one the
/// linker keeps for all; for the same reason each variant brings a type of its own.
#pragma once

#include <wheelwright/identify/gram_kernels.hpp>

namespace wheelwright::gram_kernels {

template <int W>
struct VectorOf {
  typedef double Type __attribute__((vector_size(W * sizeof(double))));
};

template <int W, class Variant>
struct GramLoops {
  using Vector = typename VectorOf<W>::Type;

  static Vector load(const double* from) {
    Vector v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
  }
  static void store(double* to, Vector v) { __builtin_memcpy(to, &v, sizeof v); }

  // C columns of a by N vectors of columns of b, sums in registers.
  template <int C, int N>
  static void panel(const double* a, std::size_t a_stride, const double* b, std::size_t b_stride, std::size_t rows,
                    double* out, std::size_t out_stride) {
    Vector sum[C][N];
    for (int c = 0; c < C; ++c) {
      for (int v = 0; v < N; ++v) {
        sum[c][v] = load(out + static_cast<std::size_t>(c) * out_stride + static_cast<std::size_t>(v * W));
      }
    }
    for (std::size_t k = 0; k < rows; ++k) {
      Vector row[N];
      for (int v = 0; v < N; ++v) {
        row[v] = load(b + k * b_stride + static_cast<std::size_t>(v * W));
      }
      for (int c = 0; c < C; ++c) {
        const double left = a[k * a_stride + static_cast<std::size_t>(c)];
        for (int v = 0; v < N; ++v) {
          sum[c][v] += row[v] * left;
        }
      }
    }
    for (int c = 0; c < C; ++c) {
      for (int v = 0; v < N; ++v) {
        store(out + static_cast<std::size_t>(c) * out_stride + static_cast<std::size_t>(v * W), sum[c][v]);
      }
    }
  }

  template <int N>
  static void columns_of_a(const double* a, std::size_t a_stride, std::size_t count, const double* b,
                           std::size_t b_stride, std::size_t rows, double* out, std::size_t out_stride) {
    switch (count) {
      case 1: panel<1, N>(a, a_stride, b, b_stride, rows, out, out_stride); break;
      case 2: panel<2, N>(a, a_stride, b, b_stride, rows, out, out_stride); break;
      case 3: panel<3, N>(a, a_stride, b, b_stride, rows, out, out_stride); break;
      default: panel<4, N>(a, a_stride, b, b_stride, rows, out, out_stride); break;
    }
  }

  static void products(const double* a, std::size_t a_stride, std::size_t a_columns, const double* b,
                       std::size_t b_stride, std::size_t columns, std::size_t rows, bool upper, double* out) {
    constexpr std::size_t kColumnsOfA = 4;
    for (std::size_t j = 0; j < a_columns; j += kColumnsOfA) {
      const std::size_t count = a_columns - j < kColumnsOfA ? a_columns - j : kColumnsOfA;
      std::size_t l = upper ? j / W * W : 0;
      while (l + 2 * W <= columns) {
        columns_of_a<2>(a + j, a_stride, count, b + l, b_stride, rows, out + j * columns + l, columns);
        l += 2 * W;
      }
      if (l < columns) {
        columns_of_a<1>(a + j, a_stride, count, b + l, b_stride, rows, out + j * columns + l, columns);
      }
    }
  }

  static void residuals(const double* y, std::size_t y_stride, const double* b, std::size_t b_stride,
                        std::size_t columns, std::size_t rows, const double* x, double* out) {
    typedef double Group __attribute__((vector_size(kGroup * sizeof(double))));
    for (std::size_t k = 0; k < rows; ++k) {
      Group sum{};
      for (std::size_t l = 0; l < columns; l += kGroup) {
        Group left, right;
        __builtin_memcpy(&left, b + k * b_stride + l, sizeof left);
        __builtin_memcpy(&right, x + l, sizeof right);
        sum += left * right;
      }
      out[k] = y[k * y_stride] - ((sum[0] + sum[2]) + (sum[1] + sum[3]));
    }
  }
};

}  // namespace wheelwright::gram_kernels
