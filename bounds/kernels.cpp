// SPDX-License-Identifier: Apache-2.0
#include "bounds/kernels.hpp"

#include "bounds/kernels_impl.hpp"
#include "core/vector_units.hpp"

namespace wheelwright::bounds::kernels {

extern const Table k_baseline;
#if defined(__x86_64__)
extern const Table k_avx2;
extern const Table k_avx512;
#endif

std::span<const Table* const> available() {
  static constexpr const Table* kAll[] = {
    &k_baseline,
#if defined(__x86_64__)
    &k_avx2,
    &k_avx512,
#endif
  };
  return {kAll, core::vector_units()};
}

const Table& best() { return *available().back(); }

const Table k_baseline = Loops<2>::table("baseline");

}  // namespace wheelwright::bounds::kernels
