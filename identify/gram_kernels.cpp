// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/gram_kernels.hpp>

namespace wheelwright::gram_kernels {

extern const GramKernels k_baseline;

#if defined(__x86_64__)

extern const GramKernels k_avx2;
extern const GramKernels k_avx512;

std::span<const GramKernels* const> available() {
  static constexpr const GramKernels* kAll[] = {&k_baseline, &k_avx2, &k_avx512};
  const std::size_t usable = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") ? 3
                             : __builtin_cpu_supports("avx2")                                        ? 2
                                                                                                     : 1;
  return {kAll, usable};
}

#else

std::span<const GramKernels* const> available() {
  static constexpr const GramKernels* kAll[] = {&k_baseline};
  return kAll;
}

#endif

const GramKernels& best() { return *available().back(); }

}  // namespace wheelwright::gram_kernels
