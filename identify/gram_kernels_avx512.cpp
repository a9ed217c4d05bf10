// SPDX-License-Identifier: Apache-2.0
#include "identify/gram_kernels_impl.hpp"

namespace wheelwright::identify::gram_kernels {
namespace {

struct Variant {};

void products(Matrix a, std::size_t a_columns, Matrix b, std::size_t columns, Matrix y, std::size_t rows, bool upper,
              double* out) {
  (columns % 8 == 0 ? GramLoops<8, Variant>::products : GramLoops<4, Variant>::products)(a, a_columns, b, columns, y,
                                                                                         rows, upper, out);
}

void gradient(Matrix y, Matrix b, std::size_t columns, std::size_t rows, const double* x, double* gradient,
              double* squares) {
  (columns % 8 == 0 ? GramLoops<8, Variant>::gradient : GramLoops<4, Variant>::gradient)(y, b, columns, rows, x,
                                                                                         gradient, squares);
}

}  // namespace

extern const GramKernels k_avx512;
const GramKernels k_avx512{"avx512", products, gradient};

}  // namespace wheelwright::identify::gram_kernels
