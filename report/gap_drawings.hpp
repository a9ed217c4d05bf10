// SPDX-License-Identifier: Apache-2.0
/// \file
/// Drawings of a gap report, as SVG. All of them tell without colour: by place, length, dash, hatching or print.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/gap/diagnosis.hpp>

namespace wheelwright::report {

/// Three bars for each figure, before, after (with its 95 % interval) and floor, as long as their share of the largest;
/// numbers beside them. Empty for no figures.
[[nodiscard]] std::string shrink_bars(const std::vector<gap::ShrinkFigure>& figures);

/// One bar for each share, at most `most`, with a tick at its presence: full where it is a finding, pale where chance
/// would do. Empty for no shares.
[[nodiscard]] std::string share_bars(const std::vector<gap::GapShare>& shares, std::size_t most = 16);

/// Power spectral densities of what each stage leaves, and of noise of the floor's size through the same filter (of
/// constant `beta`, 1/s; dynamic residuals only), both axes logarithmic. Empty for too short a series.
[[nodiscard]] std::string spectrum_drawing(const gap::ResidualSeries& series, double beta);

/// Root mean square of the re-fitted residual over the places where the robot was (columns x and y of `signals`, at
/// t − `delay`), in cells on one scale; darker is more. Empty where the log has no place, or never left it.
[[nodiscard]] std::string position_map(const gap::ResidualSeries& series, const LogTable& signals, double delay);

/// Similarities of pairs of causes as a triangle of shaded cells with the numbers in them (per cent), the most
/// confusable ones first, at most `most` causes; a frame marks what no log without further sensors separates. Empty for
/// no pairs.
[[nodiscard]] std::string confusability_matrix(const std::vector<gap::ConfusablePair>& pairs, std::size_t most = 12);

}  // namespace wheelwright::report
