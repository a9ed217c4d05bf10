// SPDX-License-Identifier: Apache-2.0
#include "bounds/kernels_impl.hpp"

namespace wheelwright::bounds::kernels {

extern const Table k_avx512;
const Table k_avx512 = Loops<8>::table("avx512");

}  // namespace wheelwright::bounds::kernels
