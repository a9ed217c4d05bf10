// SPDX-License-Identifier: Apache-2.0
#include "bounds/kernels_impl.hpp"

namespace wheelwright::bounds::kernels {

extern const Table k_avx2;
const Table k_avx2 = Loops<4>::table("avx2");

}  // namespace wheelwright::bounds::kernels
