// SPDX-License-Identifier: Apache-2.0
#include "identify/gram_kernels_impl.hpp"

namespace wheelwright::identify::gram_kernels {

namespace {
struct Variant {};
}  // namespace

extern const GramKernels k_avx2;
const GramKernels k_avx2{"avx2", GramLoops<4, Variant>::products, GramLoops<4, Variant>::gradient};

}  // namespace wheelwright::identify::gram_kernels
