// SPDX-License-Identifier: Apache-2.0
/// \file
/// Proofs that a set of parameters is empty.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/bounds/slab_rows.hpp>

namespace wheelwright::bounds {

/// The 2p half-spaces of a box, lower before upper side, with their origin marked as prior. Where `parameters` is
/// given, side j belongs to parameter parameters[j].
[[nodiscard]] std::vector<HalfSpace> sides_as_rows(const Box& box, std::span<const std::size_t> parameters = {});

/// Looks for a Farkas certificate that { θ in box : row·θ <= row.b for every row } is empty: at most p + 1 of the rows,
/// with multipliers > 0 that proves_empty() accepts, and none of which can be left out (without it no such proof is
/// found). Nothing where no certificate passes the rigorous check, so the set may be non-empty. `coordinates` scale the
/// linear programs only.
[[nodiscard]] std::optional<std::vector<WeightedRow>> find_contradiction(std::span<const HalfSpace> rows,
                                                                         const Box& box,
                                                                         const Coordinates& coordinates);

}  // namespace wheelwright::bounds
