// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sobol's quasi-random points, randomised.
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace wheelwright {

/// `replicates` independent randomisations of the first `points` points of Sobol's sequence (Boost's, with the direction
/// numbers of joe2008; the point at 0, which Boost leaves out, is the first): one point a row, the replicates one below the
/// other, coordinates inside (0, 1).
///
/// Each replicate scrambles the digits of every coordinate by a random lower triangular matrix over {0, 1} and adds a random
/// digital shift (matousek1998). So each point is uniform in the cube, the points of one replicate fill it as evenly as
/// the sequence does, and the replicates are independent of each other: what they say apart gives honest standard
/// errors (lecuyer2023), while points within one are dependent.
/// More replicates, with the same seed, only add rows.
///
/// Throws InvalidArgument unless `points` is a power of two up to 2³², `replicates` >= 1 and 1 <= `dimensions` <= 3667.
[[nodiscard]] Eigen::MatrixXd sobol_points(Eigen::Index points, Eigen::Index dimensions, Eigen::Index replicates,
                                           std::uint64_t seed);

}  // namespace wheelwright
