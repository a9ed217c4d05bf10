// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/gram_kernels_impl.hpp>

namespace wheelwright::gram_kernels {
namespace {

struct Variant {};

void products(const double* a, std::size_t a_stride, std::size_t a_columns, const double* b, std::size_t b_stride,
              std::size_t columns, std::size_t rows, bool upper, double* out) {
  (columns % 8 == 0 ? GramLoops<8, Variant>::products : GramLoops<4, Variant>::products)(
      a, a_stride, a_columns, b, b_stride, columns, rows, upper, out);
}

}  // namespace

extern const GramKernels k_avx512;
const GramKernels k_avx512{"avx512", products, GramLoops<4, Variant>::residuals};

}  // namespace wheelwright::gram_kernels
