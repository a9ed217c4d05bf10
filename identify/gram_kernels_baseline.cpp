// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/gram_kernels_impl.hpp>

namespace wheelwright::identify::gram_kernels {

namespace {
struct Variant {};
}  // namespace

extern const GramKernels k_baseline;
const GramKernels k_baseline{"baseline", GramLoops<2, Variant>::products, GramLoops<2, Variant>::gradient};

}  // namespace wheelwright::identify::gram_kernels
