// SPDX-License-Identifier: Apache-2.0
/// \file
/// Moments of a log that no parameters of the base model explain together.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// How find_contradictions() sets the noise bound.
struct ContradictionOptions {
  double confidence = 0.999;  ///< that noise stays within its bound on all rows
};

/// What find_contradictions() found.
struct Contradictions {
  std::vector<Contradiction>
      rows;                    ///< largest weight first; empty where some θ explains all rows, or no proof was found
  double factor = 0.0;         ///< bound over floor
  std::vector<double> bounds;  ///< of each output, unit of the output
  std::string statement;       ///< the question, its bound and the answer in one sentence
};

/// Whether any θ in `prior` keeps |f₂*τ − (f₂*Y)θ| within k times the floor on all `rows` of the drive at once (theory,
/// section 3, "Empty P"), and if not, a Farkas certificate: a few rows that, with the prior, contradict each other,
/// checked in outward arithmetic (bounds/infeasibility.hpp). k is such that independent Gaussian noise of the floor's
/// standard deviation `floors` (one per output, > 0) stays within it on all N rows of all outputs with the confidence:
/// Φ(k) = 1 − (1 − confidence)/(2N), a union bound that holds for dependent rows too.
///
/// Weights are multipliers times the row's bound, as shares of their sum; sides of the prior take part in it but are no
/// rows. Throws InvalidArgument when sizes disagree or the prior is not finite.
[[nodiscard]] Contradictions find_contradictions(const Drive& drive, double beta, const Mask& rows,
                                                 const std::vector<double>& floors, const Box& prior,
                                                 const ContradictionOptions& options = {});

}  // namespace wheelwright
