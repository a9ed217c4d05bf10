// SPDX-License-Identifier: Apache-2.0
#include "results/software.hpp"

namespace wheelwright::results {

std::string software() { return std::string("wheelwright ") + WHEELWRIGHT_VERSION; }

}  // namespace wheelwright::results
