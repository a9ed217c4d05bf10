// SPDX-License-Identifier: Apache-2.0
/// \file
/// The band above the filter's: what a log's efforts show there beyond the healthy log, and whether play does it.
#pragma once

#include <optional>
#include <vector>

#include "gap/prepared.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {

/// What the band above the filter's shows, in mean squares, in units of what the model leaves of the healthy log there.
struct FastBand {
  double beta = 0.0;   ///< upper corner of the band, 1/s
  double left = 1.0;   ///< held out, with θ and the causes fitted again in this band
  bool above = false;  ///< `left` is above the healthy log's by more than a quarter, in nearly all blocks of time
  double after_reversals = 0.0;  ///< just after reversals of a joint's torque
  double elsewhere = 0.0;        ///< away from them, while the torque changes as fast
  double presence = 0.0;         ///< share of the rows that are just after such a reversal
  bool play =
      false;  ///< it is the reversals that bring it: more than on the healthy log, in more blocks than by chance
  double effort_square = 0.0;  ///< what play adds in this band, as a share of all efforts' mean square
};

/// Options of look_at_fast_band().
struct FastBandOptions {
  double beta = 40.0;          ///< upper corner, 1/s; lower where the log's step is long
  double row_step = 0.4;       ///< in 1/β
  double after = 0.15;         ///< s, how long after a reversal its play is crossed and the impact over
  double contrast = 1.25;      ///< least ratio of what is left after reversals and elsewhere over the healthy log's
  double outweighs = 2.0;      ///< least ratio of what reversals add to what is above the healthy log's elsewhere
  double significance = 0.05;  ///< of the contrast, over blocks of time
  double above = 0.25;         ///< mean square above the healthy log's that counts as a gap of its own
  BlockOptions blocks{};
};

/// The efforts of the log of `prepared` between the filter's corner and that of `options`, against those of the healthy
/// log: both sides of the model's equation through f₂ at the upper corner less f₂ at the lower one, with the columns of
/// θ, of an offset between the clocks and of `causes` (their shapes as they are), all fitted again.
///
/// Play is crossed after each reversal of the torque, within hundredths of a second: whatever the contact is like, the
/// torque is missing first and then an impact. Below the band nothing of it is left. Rows just after a joint's speed
/// has changed its sign, where friction acts, do not count. A torque reverses while it changes fast, when whatever is
/// wrong with its delay or its limits shows too: it must also stand out against moments at which it changes as fast,
/// and outweigh what something else leaves at these. Nothing for a preparation without a healthy log, without efforts
/// or with too few rows.
[[nodiscard]] std::optional<FastBand> look_at_fast_band(const PreparedGap& prepared,
                                                        const std::vector<FittedEffect>& causes,
                                                        const FastBandOptions& options = {});

}  // namespace wheelwright::gap
