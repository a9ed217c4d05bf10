// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/kernels.hpp>

namespace wheelwright::kernels {

extern const Table k_baseline;

#if defined(__x86_64__)

extern const Table k_avx2;
extern const Table k_avx512;

std::span<const Table* const> available() {
  static constexpr const Table* kAll[] = {&k_baseline, &k_avx2, &k_avx512};
  const std::size_t usable = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") ? 3
                             : __builtin_cpu_supports("avx2")                                        ? 2
                                                                                                     : 1;
  return {kAll, usable};
}

#else

std::span<const Table* const> available() {
  static constexpr const Table* kAll[] = {&k_baseline};
  return kAll;
}

#endif

const Table& best() { return *available().back(); }

}  // namespace wheelwright::kernels
