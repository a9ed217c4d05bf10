// SPDX-License-Identifier: Apache-2.0
/// \file
/// Where the structural part of a gap lies: by channel, operating regime, place, time and frequency.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/gap/drive.hpp>
#include <wheelwright/gap/regimes.hpp>
#include <wheelwright/gap/residual_series.hpp>

namespace wheelwright {

/// How locate_gap() looks.
struct WhereOptions {
  double beta = 5.0;                ///< of the filter that the dynamic residuals passed, 1/s
  double floor_error = 0.0;         ///< relative error of the floors
  RegimeOptions regimes;            ///< how finely the drive is divided
  std::size_t permutations = 1999;  ///< of the blocks of time
  std::uint64_t seed = 1;           ///< of the permutations and of the noise that bands are compared with
};

/// The structural part's mean square above the floor, ResidualSeries::refitted² − floor², divided
/// - by channel (kind "channel", regime "all"): of the sum over all series, each in units of its own floor;
/// - within each channel by the regimes of `drive` (regimes.hpp) and by frequency band (kind "frequency"): of that
///   channel's sum. Presence is the share of the rows; of a band, the share of the noise.
///
/// Shares lie in 0 … 1, are rounded to 0.01 and sorted, largest first; of equal ones the rarer regime comes first. A
/// filter delays what passes it by about 2/β, so the regime of a dynamic row at t is that of the drive at t − 2/β.
///
/// p-values answer whether so much could lie there by chance; all of one call are corrected together, so that noise
/// without structure shows any p < 0.05 in at most 5 % of logs:
/// - regimes: by permutation of contiguous blocks of log(1 + (residual/floor)²), each about ten times as long as they remember,
///   against the regimes, with the step-down maximum over all regimes of the channel (Westfall and Young 1993);
/// - bands: against 24 simulated noises of the floor's variance through the same filter, white, differentiated once and
///   twice (torque, speed and angle noise; poses: white and differenced), whichever leaves the band the most room; Holm
///   (1979) over the bands;
/// - channels: Student's t under the long-run variance of block_sums.hpp;
/// and Bonferroni over these families.
///
/// Series with fewer than 64 rows are passed over. Throws InvalidArgument when the vectors of a series disagree in size
/// or an option makes no sense.
[[nodiscard]] std::vector<GapShare> locate_gap(const Drive& drive, const std::vector<ResidualSeries>& series,
                                               const WhereOptions& options = {});

/// Whether the gap is concentrated there: p < 0.05 and a share above the presence. A channel is a finding by its p alone.
[[nodiscard]] bool is_finding(const GapShare& share);

}  // namespace wheelwright
