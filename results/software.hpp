// SPDX-License-Identifier: Apache-2.0
/// \file
/// Name and version, as results carry them.
#pragma once

#include <string>

namespace wheelwright::results {

/// Name and version of the program.
[[nodiscard]] std::string software();

}  // namespace wheelwright::results
