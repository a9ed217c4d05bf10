// SPDX-License-Identifier: Apache-2.0
/// \file
/// Expected discrimination between rival causes by a planned drive.
///
/// Let rival A be true with its estimated coefficients. Without noise the rows of a log are y_A = Yθ + Σ X_A c_A:
/// filtered efforts and, where there is a pose, its increments against odometry, each divided by the standard deviation
/// of its noise. What rival B cannot imitate of them is
///
///     d_AB = y_A − Yθ' − X_B(φ) c,    S_AB = |d_AB|² the least over θ', c (within its signs) and the shapes φ.
///
/// Maximising the least S over the rivals is T-optimality (Atkinson and Fedorov 1975). With noise e, the sums of
/// squares that B and A leave differ by S + 2 dᵀe, of variance 4 dᵀRd, R the correlation of e. Neighbouring rows are
/// not independent: white noise of the efforts through f₂ has the correlation (1 + β|s|)e^{−β|s|} at the distance s,
/// whose integral is 4/β, so that dᵀRd <= S·4/(βh) up to O(βh)², equality for slow d, and N rows count for Nhβ/4 at
/// worst. With
///
///     Δ_AB = S²/dᵀRd        (>= S·hβ/4)
///
/// the comparison is S/(2√(dᵀRd)) = ½√Δ standard deviations from going wrong where coefficients are known. They are
/// estimated along: with a and b the unit vectors along y_A and its imitation, of cosine ρ, A leaves less than B just
/// where (a + b)ᵀy and (a − b)ᵀy have one sign, and the second one is √(Δ/(2(1 + ρ))) standard deviations from zero,
/// where R acts alike on a − b and d. Increments of the pose over windows are taken as independent of each other. The
/// noise of encoders in the inertia's columns has less power at low frequencies than f₂ of white noise, so that the
/// number errs on the safe side. The promise is for residuals of one fit to the whole log: held out by blocks, a
/// difference of one deviation is found less often (70 to 74 % in place of 84 %, measured for four to eight blocks of
/// 16 s), since each fit sees less.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gap/effects/effect.hpp"
#include "gap/rival.hpp"
#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::design {
struct DesignSubject;
}  // namespace wheelwright::design

namespace wheelwright::gap {

/// Expected noise of the rows: standard deviations.
struct PlannedNoise {
  double beta = 10.0;          ///< of the filter f₂, α = β, 1/s
  std::vector<double> output;  ///< of each filtered output, > 0, unit of the output
  IncrementNoise pose;         ///< of the pose's increments; one that is 0 is not looked at
  double window = 0.5;         ///< s, of an increment
};

/// The noise to be expected with the sensors that are declared, each error uniform within its bound and independent
/// from sample to sample: noise_gram() for f₂ with the subject's β. Where the subject has bounds on rows in place of
/// declared noise, a quarter of them, since the bound is an extreme of many rows. Increments of the pose: √2 times its
/// own noise, where the robot file declares it.
[[nodiscard]] PlannedNoise expected_noise(const design::DesignSubject& subject);

/// Separation of rival `truth`, when it is true, from rival `other`.
struct RivalSeparation {
  std::size_t truth = 0;  ///< index of A
  std::size_t other = 0;  ///< index of B
  double excess = 0.0;    ///< S: what B leaves above the noise, sum of squares in units of the noise
  double delta = 0.0;     ///< Δ
  double rows = 0.0;      ///< number of rows that it is spread over
  double share = 0.0;  ///< of A's signature (after θ is fitted again) that B cannot explain, sum of squares, in [0, 1]
  double kept = 0.0;   ///< of A's signature that is left after θ is fitted again, sum of squares, in [0, 1]
  std::vector<double> shape{};  ///< of B where it imitates best, cause after cause

  /// √(Δ/(2(1 + ρ))), ρ² = 1 − share: by how many standard deviations the comparison goes the right way.
  [[nodiscard]] double deviations() const;
  /// That it goes the right way: Φ(deviations()).
  [[nodiscard]] double probability() const;
  /// Expected ratio of the residual that B leaves to that of A, root mean squares: √(1 + S/rows).
  [[nodiscard]] double ratio() const;
};

/// Kind of drive.
enum class DriveKind {
  planned,  ///< of planned_drive(): efforts are the base model's; those of the true rival are added (a fixed point, two
            ///< passes), and the motion begins from rest, so that the filter needs no time to settle
  logged,   ///< of make_drive(), with predicted efforts: efforts are what they are, and the filter must settle
};

/// Every ordered pair of `rivals` on `drive`, A after A. Shapes of B are searched on their grid, then between its
/// points (golden section), each beside the others. Rows where a joint rests are left out. Throws InvalidArgument for
/// fewer than two rivals, one that does not pass validate(), or noise that is not > 0.
[[nodiscard]] std::vector<RivalSeparation> discrimination(const Drive& drive, const std::vector<Rival>& rivals,
                                                          const std::vector<Effect>& catalogue,
                                                          const PlannedNoise& noise,
                                                          DriveKind kind = DriveKind::planned);

}  // namespace wheelwright::gap
