// SPDX-License-Identifier: Apache-2.0
/// \file
/// Operating regimes of a drive, and moments that no parameters of the base model explain together.
#pragma once

#include <string>
#include <vector>

#include "bounds/box.hpp"
#include "gap/diagnosis.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {

/// Moments of a drive that have something in common.
struct Regime {
  std::string kind;  ///< what was looked at: "speed", "reversal", "heading", …
  std::string name;  ///< the regime in words, e.g. "reversal of the right wheel"
  Mask instants;     ///< one value per instant of the drive
};

/// Resolution of the regimes.
struct RegimeOptions {
  double reversal = 0.3;          ///< s about a change of a joint's direction
  double straight = 0.1;          ///< |yaw rate| below this share of its 95 % quantile counts as straight
  int sectors = 8;                ///< of the heading, and of a wheel's angle
  int grid = 4;                   ///< cells along each side of the positions' bounding box
  int stretches = 10;             ///< of equal duration
  double smallest_share = 0.005;  ///< regimes with a smaller share of the instants are left out
};

/// The regimes of `drive`: speed (standstill, and quarters of the moving instants), yaw rate (straight, and halves to
/// either side), acceleration along the motion, direction and reversal of each joint, effort (quarters of each joint's
/// |effort|), braking (effort against the motion), heading and position (where there is a pose), wheel angle (of a
/// robot on wheels), and time. Regimes of one kind do not overlap, except reversals, directions, efforts, braking and
/// wheel angles, which are each joint's own.
[[nodiscard]] std::vector<Regime> regimes(const Drive& drive, const RegimeOptions& options = {});

/// Noise bound of find_contradictions().
struct ContradictionOptions {
  double confidence = 0.999;  ///< that noise stays within its bound on all rows
};

/// Result of find_contradictions().
struct Contradictions {
  std::vector<Contradiction>
      rows;                    ///< largest weight first; empty where some θ explains all rows, or no proof was found
  double factor = 0.0;         ///< bound over floor
  std::vector<double> bounds;  ///< of each output, unit of the output
  std::string statement;       ///< the question, its bound and the answer in one sentence
};

/// Tests if any θ in `prior` keeps |f₂*τ − (f₂*Y)θ| within k times the floor on all `rows` of the drive at once; if
/// none does, the result has a Farkas certificate: a few rows that, with the prior, contradict each other, checked in
/// outward arithmetic (bounds/certificate.hpp). k is such that independent Gaussian noise of the floor's standard
/// deviation `floors` (one per output, > 0) stays within it on all N rows of all outputs with the confidence: Φ(k) = 1
/// − (1 − confidence)/(2N), a union bound that holds for dependent rows too.
///
/// Weights are multipliers times the row's bound, as shares of their sum; sides of the prior take part in it but are no
/// rows. Throws InvalidArgument when sizes disagree or the prior is not finite.
[[nodiscard]] Contradictions find_contradictions(const Drive& drive, double beta, const Mask& rows,
                                                 const std::vector<double>& floors, const Box& prior,
                                                 const ContradictionOptions& options = {});

}  // namespace wheelwright::gap
