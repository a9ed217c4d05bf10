// SPDX-License-Identifier: Apache-2.0
/// \file
/// The report of `wheelwright gap`, and its drawings as SVG. All of them tell without colour: by place, length, dash,
/// hatching or print.
#pragma once

#include <string>
#include <vector>

#include "core/log.hpp"
#include "gap/diagnosis.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// Three bars for each figure, before, after (with its 95 % interval) and floor, as long as their share of the largest;
/// numbers beside them. Empty for no figures.
[[nodiscard]] std::string shrink_bars(const std::vector<gap::ShrinkFigure>& figures);

/// The steps of words::gap_steps() as bars on one scale, each cause's where it takes off what the one above it left:
/// dashed before, full for causes and after. Empty for a diagnosis without causes.
[[nodiscard]] std::string step_bars(const Diagnosis& diagnosis);

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

/// One self-contained page: the verdict in words; the causes with their parameters; what cannot be told apart on this
/// log, and which drive would; the residual over time before, after θ is fitted again and after the causes are added,
/// with the floor; how far it shrinks; where it lies by channel, regime, frequency and place; the parameters that the
/// missing effect had poisoned; contradictory rows. `robot` is its name, `next_manoeuvre` a sentence for the drive that
/// would tell the causes apart (may be empty). Columns x and y of `context.signals` give the map of places.
[[nodiscard]] std::string gap_report(const Diagnosis& diagnosis, const std::string& robot, const ReportContext& context,
                                     const std::string& next_manoeuvre = {});

}  // namespace wheelwright::report
