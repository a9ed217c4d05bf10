// SPDX-License-Identifier: Apache-2.0
/// \file
/// Location of the structural part of a gap: by channel, operating regime, place, time and frequency.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "gap/diagnosis.hpp"
#include "gap/regimes.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {

/// A one-sided power spectral density.
struct Spectrum {
  Eigen::VectorXd frequency;  ///< Hz, equally spaced, the zero left out
  Eigen::VectorXd density;    ///< (unit of the values)²/Hz
  std::size_t windows = 0;    ///< that were averaged
  /// Mean square between two frequencies, lower <= f < upper (Hz).
  [[nodiscard]] double power(double lower, double upper) const;
};

/// Options of the spectrum.
struct SpectrumOptions {
  double window = 20.0;   ///< s; half of it for logs shorter than two windows
  double highest = 10.0;  ///< Hz; values are averaged over cells of at most a quarter of its period
};

/// Averaged periodograms of overlapping Hann windows (Welch 1967) of `values` at the ascending times `t` (s), which may
/// have gaps: missing cells are zero, and windows with less than half of their cells are left out. No window: no
/// frequencies. Throws InvalidArgument when sizes disagree.
[[nodiscard]] Spectrum spectrum(const Eigen::VectorXd& t, const Eigen::VectorXd& values,
                                const SpectrumOptions& options = {});

/// Density at `frequency` (Hz) of white noise that passed f₂ (static gain 1, `beta` in 1/s) and has standard deviation
/// `sd` behind it: sd² (8/β) β⁴/(β² + (2πf)²)².
[[nodiscard]] double filtered_noise_density(double beta, double sd, double frequency);

/// Options of locate_gap().
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
/// - regimes: by permutation of contiguous blocks of log(1 + (residual/floor)²), each about ten times as long as they
///   remember, against the regimes, with the step-down maximum over all regimes of the channel (Westfall and Young
///   1993);
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

/// True if the gap is concentrated there: p < 0.05 and a share above the presence. A channel is a finding by its p
/// alone.
[[nodiscard]] bool is_finding(const GapShare& share);

}  // namespace wheelwright::gap
