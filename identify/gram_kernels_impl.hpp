// SPDX-License-Identifier: Apache-2.0
/// \file
/// The loops of gram_kernels.hpp for vectors of W doubles. Included by one source file per processor variant; nothing
/// of the standard library is called here, since an inline function compiled for a newer processor could be the one the
/// linker keeps for all; for the same reason each variant brings a type of its own.
#pragma once

#include <cstdint>

#include "identify/gram_kernels.hpp"

namespace wheelwright::identify::gram_kernels {

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
  // Asks for a cache line that will be wanted; it may lie beyond the end of the rows.
  static void fetch(const double* from, std::size_t offset) {
    __builtin_prefetch(reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(from) + offset * sizeof(double)));
  }
  static void store(double* to, Vector v) { __builtin_memcpy(to, &v, sizeof v); }

  // C columns of a, and y where Y says so, by N vectors of columns of b; sums in registers.
  template <int C, int N, bool Y>
  static void panel(Matrix a, Matrix b, Matrix y, std::size_t rows, double* out, double* out_y,
                    std::size_t out_stride) {
    Vector sum[C][N], sum_y[N] = {};
    for (int v = 0; v < N; ++v) {
      for (int c = 0; c < C; ++c) {
        sum[c][v] = load(out + static_cast<std::size_t>(c) * out_stride + static_cast<std::size_t>(v * W));
      }
      if (Y) {
        sum_y[v] = load(out_y + static_cast<std::size_t>(v * W));
      }
    }
    for (std::size_t k = 0; k < rows; ++k) {
      Vector row[N];
      for (int v = 0; v < N; ++v) {
        row[v] = load(b.data + k * b.stride + static_cast<std::size_t>(v * W));
      }
      for (int c = 0; c < C; ++c) {
        const double left = a.data[k * a.stride + static_cast<std::size_t>(c)];
        for (int v = 0; v < N; ++v) {
          sum[c][v] += row[v] * left;
        }
      }
      for (int v = 0; Y && v < N; ++v) {
        sum_y[v] += row[v] * y.data[k * y.stride];
      }
      if (Y) {
        fetch(b.data, (k + rows) * b.stride);
      }
    }
    for (int v = 0; v < N; ++v) {
      for (int c = 0; c < C; ++c) {
        store(out + static_cast<std::size_t>(c) * out_stride + static_cast<std::size_t>(v * W), sum[c][v]);
      }
      if (Y) {
        store(out_y + static_cast<std::size_t>(v * W), sum_y[v]);
      }
    }
  }

  template <int N, bool Y>
  static void columns_of_a(Matrix a, std::size_t count, Matrix b, Matrix y, std::size_t rows, double* out,
                           double* out_y, std::size_t out_stride) {
    switch (count) {
      case 1: panel<1, N, Y>(a, b, y, rows, out, out_y, out_stride); break;
      case 2: panel<2, N, Y>(a, b, y, rows, out, out_y, out_stride); break;
      case 3: panel<3, N, Y>(a, b, y, rows, out, out_y, out_stride); break;
      default: panel<4, N, Y>(a, b, y, rows, out, out_y, out_stride); break;
    }
  }

  static void products(Matrix a, std::size_t a_columns, Matrix b, std::size_t columns, Matrix y, std::size_t rows,
                       bool upper, double* out) {
    constexpr std::size_t kColumnsOfA = 4;
    double* out_y = out + a_columns * columns;
    for (std::size_t l = 0; l < columns;) {
      const bool two = l + 2 * W <= columns;
      const std::size_t width = two ? 2 * W : W;
      // y goes with the last columns of a that meet these columns of b.
      const std::size_t end = upper && l + width < a_columns ? l + width : a_columns;
      for (std::size_t j = 0; j < end; j += kColumnsOfA) {
        const std::size_t count = end - j < kColumnsOfA ? end - j : kColumnsOfA;
        const bool with_y = y.data != nullptr && j + kColumnsOfA >= end;
        const Matrix left{a.data + j, a.stride}, right{b.data + l, b.stride};
        double* to = out + j * columns + l;
        if (two && with_y) {
          columns_of_a<2, true>(left, count, right, y, rows, to, out_y + l, columns);
        } else if (two) {
          columns_of_a<2, false>(left, count, right, y, rows, to, out_y + l, columns);
        } else if (with_y) {
          columns_of_a<1, true>(left, count, right, y, rows, to, out_y + l, columns);
        } else {
          columns_of_a<1, false>(left, count, right, y, rows, to, out_y + l, columns);
        }
      }
      l += width;
    }
  }

  typedef double Group __attribute__((vector_size(kGroup * sizeof(double))));

  // Products of one row with x, added up over the groups of columns.
  static void product(const double* row, const double* x, std::size_t columns, Group& sum) {
    sum = Group{};
    for (std::size_t l = 0; l < columns; l += kGroup) {
      Group left, right;
      __builtin_memcpy(&left, row + l, sizeof left);
      __builtin_memcpy(&right, x + l, sizeof right);
      sum += left * right;
    }
  }

  // N vectors of columns from `first` on; the residuals are those of `residual`.
  template <int N>
  static void add_rows(const double* residual, Matrix b, std::size_t rows, double* gradient) {
    Vector sum[N];
    for (int v = 0; v < N; ++v) {
      sum[v] = load(gradient + v * W);
    }
    for (std::size_t k = 0; k < rows; ++k) {
      for (int v = 0; v < N; ++v) {
        sum[v] += load(b.data + k * b.stride + v * W) * residual[k];
      }
    }
    for (int v = 0; v < N; ++v) {
      store(gradient + v * W, sum[v]);
    }
  }

  static void gradient(Matrix y, Matrix b, std::size_t columns, std::size_t rows, const double* x, double* gradient,
                       double* squares) {
    constexpr std::size_t kRows = 4;
    Group square;
    __builtin_memcpy(&square, squares, sizeof square);
    for (std::size_t k = 0; k < rows; k += kRows) {
      const std::size_t count = rows - k < kRows ? rows - k : kRows;
      double residual[kRows] = {};
      if (count == kRows) {
        const double* row = b.data + k * b.stride;
        Group p0, p1, p2, p3;
        product(row, x, columns, p0);
        product(row + b.stride, x, columns, p1);
        product(row + 2 * b.stride, x, columns, p2);
        product(row + 3 * b.stride, x, columns, p3);
        const Group low01 = __builtin_shufflevector(p0, p1, 0, 4, 2, 6),
                    high01 = __builtin_shufflevector(p0, p1, 1, 5, 3, 7);
        const Group low23 = __builtin_shufflevector(p2, p3, 0, 4, 2, 6),
                    high23 = __builtin_shufflevector(p2, p3, 1, 5, 3, 7);
        const Group of0 = __builtin_shufflevector(low01, low23, 0, 1, 4, 5),
                    of2 = __builtin_shufflevector(low01, low23, 2, 3, 6, 7);
        const Group of1 = __builtin_shufflevector(high01, high23, 0, 1, 4, 5),
                    of3 = __builtin_shufflevector(high01, high23, 2, 3, 6, 7);
        const double* from = y.data + k * y.stride;
        const Group left{from[0], from[y.stride], from[2 * y.stride], from[3 * y.stride]};
        const Group r = left - ((of0 + of2) + (of1 + of3));
        square += r * r;
        __builtin_memcpy(residual, &r, sizeof r);
      } else {
        for (std::size_t i = 0; i < count; ++i) {
          Group p;
          product(b.data + (k + i) * b.stride, x, columns, p);
          residual[i] = y.data[(k + i) * y.stride] - ((p[0] + p[2]) + (p[1] + p[3]));
          square[i] += residual[i] * residual[i];
        }
      }
      std::size_t l = 0;
      for (; l + 2 * W <= columns; l += 2 * W) {
        add_rows<2>(residual, {b.data + k * b.stride + l, b.stride}, count, gradient + l);
      }
      for (; l < columns; l += W) {
        add_rows<1>(residual, {b.data + k * b.stride + l, b.stride}, count, gradient + l);
      }
    }
    __builtin_memcpy(squares, &square, sizeof square);
  }
};

}  // namespace wheelwright::identify::gram_kernels
