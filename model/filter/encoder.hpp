// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detection of wheel speeds that are differenced encoder counts, and of the encoder's resolution.
#pragma once

#include <optional>
#include <span>

namespace wheelwright::filter {

/// Result of the search.
struct EncoderFinding {
  double counts_per_turn = 0.0;  ///< N
  double speed_step = 0.0;       ///< 2π/(N h), rad/s: every speed is a whole multiple of it
  double rounding = 0.0;         ///< largest distance of a speed from a multiple, in counts (< 0.25)
};

/// The largest quantum q such that all `speeds` (rad/s, sampled with the constant step `step`, s) are whole multiples
/// of it up to the decimals they were printed with, where q = 2π/(N·step) for a whole N between 8 and 2²² that explains
/// them; nothing where there is none. Speeds that were merely rounded are no encoder and are not taken for one: printed
/// with few decimals they have a decimal quantum (1, 2 or 5 · 10ᵏ rad/s), and a drive that reports whole rpm, or tenths
/// or tens of them, one of 1, 2 or 5 · 10ᵏ rpm. An encoder that happens to have such a quantum must be declared.
///
/// `counts_per_turn`, where it is known, is checked instead of searched for.
[[nodiscard]] std::optional<EncoderFinding> find_encoder(std::span<const double> speeds, double step,
                                                         std::optional<double> counts_per_turn = std::nullopt);

/// The same for the steps of an angle, rad: whole multiples of 2π/N. EncoderFinding::speed_step is then one count, rad.
[[nodiscard]] std::optional<EncoderFinding> find_encoder_of_angles(std::span<const double> steps);

}  // namespace wheelwright::filter
