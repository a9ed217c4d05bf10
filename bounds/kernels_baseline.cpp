// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/kernels_impl.hpp>

namespace wheelwright::bounds::kernels {

extern const Table k_baseline;
const Table k_baseline = Loops<2>::table("baseline");

}  // namespace wheelwright::bounds::kernels
