// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rival causes as a user names them on the command line.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/gap/discrimination.hpp>

namespace wheelwright::app {

/// Rivals "A" or "A+B", at a typical size; `sizes` are EFFECT=VALUE (its first coefficient, or its first shape where it
/// has no coefficient; others in proportion) or EFFECT.PARAMETER=VALUE. Throws InputError for unknown names.
[[nodiscard]] std::vector<gap::Rival> rivals_named(const std::vector<std::string>& names,
                                                   const std::vector<std::string>& sizes,
                                                   const std::vector<Effect>& catalogue, const gap::Drive& drive);

}  // namespace wheelwright::app
