// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rival causes in a gap.json.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <wheelwright/files/json.hpp>
#include <wheelwright/gap/discrimination.hpp>

namespace wheelwright::results {

/// Members of the credible set of a gap.json. Parameters are those of credible_set[].parameters, keyed
/// "effect.parameter", else of `causes` where the effects are the same; a member without any is as large as
/// typical_rival() makes it. Noise and filter of the analysed log, where the file has them, take the place of those in
/// `noise`. Throws InputError where fewer than two members are left that the catalogue knows.
[[nodiscard]] std::vector<gap::Rival> rivals_of_gap(const std::filesystem::path& file,
                                                    const std::vector<Effect>& catalogue, const gap::Drive& drive,
                                                    gap::PlannedNoise& noise);

/// Adds the parameters of `rivals` to the members of the credible set of a gap.json: `design --gap` begins from them.
void add_rivals(Json& result, const std::vector<gap::Rival>& rivals, const std::vector<Effect>& catalogue);

}  // namespace wheelwright::results
