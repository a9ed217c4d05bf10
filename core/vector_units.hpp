// SPDX-License-Identifier: Apache-2.0
/// \file
/// The vector units of the processor, which loops over many rows have variants for.
#pragma once

#include <cstddef>

namespace wheelwright::core {

/// How many of the variants baseline, AVX2, AVX-512 (F and DQ) this processor can run: the first so many.
[[nodiscard]] inline std::size_t vector_units() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") ? 3
         : __builtin_cpu_supports("avx2")                                        ? 2
                                                                                 : 1;
#else
  return 1;
#endif
}

}  // namespace wheelwright::core
