// SPDX-License-Identifier: Apache-2.0
/// \file
/// An identification in sentences and a table for a terminal.
#pragma once

#include <string>

#include "commission/identification.hpp"

namespace wheelwright::words {

/// Words first, then one table of estimates and intervals by every method, then what to do next.
[[nodiscard]] std::string summary(const commission::Identification& result);

}  // namespace wheelwright::words
