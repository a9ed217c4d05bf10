// SPDX-License-Identifier: Apache-2.0
#include "identify/gram_kernels.hpp"

#include "core/vector_units.hpp"
#include "identify/gram_kernels_impl.hpp"

namespace wheelwright::identify::gram_kernels {

extern const GramKernels k_baseline;
#if defined(__x86_64__)
extern const GramKernels k_avx2;
extern const GramKernels k_avx512;
#endif

std::span<const GramKernels* const> available() {
  static constexpr const GramKernels* kAll[] = {
    &k_baseline,
#if defined(__x86_64__)
    &k_avx2,
    &k_avx512,
#endif
  };
  return {kAll, core::vector_units()};
}

const GramKernels& best() { return *available().back(); }

namespace {
struct Variant {};
}  // namespace

const GramKernels k_baseline{"baseline", GramLoops<2, Variant>::products, GramLoops<2, Variant>::gradient};

}  // namespace wheelwright::identify::gram_kernels
