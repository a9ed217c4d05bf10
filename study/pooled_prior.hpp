// SPDX-License-Identifier: Apache-2.0
/// \file
/// A prior box for the next robot, learnt from a fleet, with a coverage that holds whatever the distribution.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/study/robot_record.hpp>

namespace wheelwright::study {

/// Options of pooled_prior().
struct PooledPriorOptions {
  double coverage = 0.95;    ///< least probability that the box holds the next robot's θ
  std::uint64_t seed = 1;    ///< of the split
  double most_hidden = 0.1;  ///< a parameter that more of the learning robots than this share do not show is left out
};

/// One parameter of the box.
struct PooledParameter {
  std::size_t column = 0;  ///< of the table
  bool included = false;
  std::string reason{};      ///< why it is left out; else empty
  double hidden = 0.0;       ///< share of the learning robots whose log does not show it
  double centre = 0.0;       ///< median of the learning robots' mid-points
  double scale_below = 0.0;  ///< median of how far their intervals reach below the centre
  double scale_above = 0.0;  ///< median of how far their intervals reach above the centre
  Interval before{};         ///< hull of the priors with which the fleet was commissioned
  Interval box{};            ///< rounded outward; `before` where it is not included or there is no box
};

/// The result of pooled_prior().
struct PooledPrior {
  bool exists = false;                        ///< there is a box with at least one parameter
  std::string message{};                      ///< one sentence for people: the statement, or why there is none
  double asked = 0.0;                         ///< coverage that was asked for
  double coverage = 0.0;                      ///< coverage that is stated: k/(m + 1); 0 where there is no box
  std::size_t learning = 0;                   ///< robots that gave centres and scales
  std::size_t scored = 0;                     ///< m, the others
  std::size_t rank = 0;                       ///< k
  std::size_t boundless = 0;                  ///< of the scored, robots without bounds: their scores are infinite
  std::size_t needed = 0;                     ///< fewest robots of a fleet for a box at the coverage asked for
  double radius = 0.0;                        ///< k-th smallest score
  std::vector<PooledParameter> parameters{};  ///< of the columns that are keys of a prior
};

/// Split-conformal prediction (`vovk2005`, `lei2018`) of a box. The robots whose logs could be read are split in halves
/// by a seeded hash of their names. One half gives each parameter a centre and a scale to each side, and says which
/// parameters are left out. Each of the m robots of the other half gets the score
///
///     S_i = max over parameters of max((c − l_i)/s_below, (u_i − c)/s_above)
///
/// of the farthest corner of its bounds: at least the score of its true θ, which is unknown. The box is all points with
/// a score of at most the k-th smallest, k = ⌈(m + 1)(1 − a)⌉, cut to the hull of the robots' own priors.
///
/// Where the robots and the next one are exchangeable and their noise keeps to its bounds, P(θ of the next robot in the
/// box) >= k/(m + 1) >= 1 − a, over fleets and next robots together, for any distribution of θ: the true θ's of the
/// scored robots and the next one's are exchangeable given the learning half, and larger scores only enlarge the box.
/// No robot is left out as an outlier. A robot that was read but gave no bounds (contradicted, nothing shown) has an
/// infinite score, so the statement is about such robots too; where they are more than the coverage allows, there is no
/// box. A parameter that a scored robot's log does not show has the bounds of its prior, which are wide and true. Which
/// parameters are included depends on the learning half only, and so costs no coverage. Robots whose logs could not be
/// read take no part: that has to have nothing to do with their θ.
///
/// Throws InvalidArgument for a coverage outside (0, 1) or a share outside [0, 1].
[[nodiscard]] PooledPrior pooled_prior(const FleetTable& table, const PooledPriorOptions& options = {});

}  // namespace wheelwright::study
