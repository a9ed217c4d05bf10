// SPDX-License-Identifier: Apache-2.0
/// \file
/// Choice of a detector for a stated guarantee: order of the filter, β, decision rule; with the cost of the
/// alternatives.
///
/// Not part of the search:
/// - **α**: (25) and all its error bounds are linear in the filter's gain, so that α scales residual and threshold
///   alike, and decisions do not change. α = β, for a gain of 1.
/// - **[l, u] or ρ**: [l, u] lies inside [−ρ, ρ], so it is never less sensitive, at the same guarantee.
/// - **k of n**, under bounds that no healthy instant exceeds: an alarm of k of n needs an instant outside, which is
///   an alarm of 1 of 1 that is no later. It only loses; candidates show how much. (It would pay against noise beyond
///   its bounds, which is what the guarantee rules out. Under an hourly guarantee a false alarm takes k exceedances, so
///   that by Markov's inequality each instant may err k times as often; bounds grow with the root of the logarithm of
///   that, which is worth few per cent, and learning gains nothing.)
/// - **a window**, over which decisions are averaged: the filter is one, of length about order/β.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commission/choice/detector_trial.hpp"

namespace wheelwright::commission {

/// Options of choose_detector().
struct DetectorChoiceOptions {
  TrialOptions trial;  ///< no faults: wheel_radius and wheel_radius_right, or effort_loss where a robot has no wheels
  double beta_factor = 1.5;          ///< between neighbours of the grid over β
  std::size_t most_refinements = 6;  ///< candidates between the best one's neighbours
  double tie = 0.01;                 ///< relative difference of sizes below which the delay decides
  /// Sizes and delays that count: false, those for every noise within its bounds; true, those of either guarantee, by
  /// whichever sees a fault first.
  bool either = false;
  std::vector<detector::Persistence> persistences = {{2, 3}, {3, 5}};       ///< shown beside 1/1 for the chosen filter
  std::function<void(std::string_view stage, double share)> progress = {};  ///< may be empty
};

/// The choice.
struct DetectorChoice {
  std::vector<DetectorCandidate>
      candidates;                       ///< the chosen one first, the others from small sizes to large ones, those
                                        ///< without a detector last
  std::optional<Commissioning> chosen;  ///< of the first candidate; nothing where none has a finite size
  std::vector<StatedFault> faults;      ///< with their sizes
  std::vector<std::string> hopeless;  ///< faults ("wheel_radius +") that no candidate is certain to see at half of the
                                      ///< onsets: they do not count
  double window = 0.0;                ///< s
  double false_alarms = 0.0;
  bool either = false;  ///< DetectorChoiceOptions::either
  double tie = 0.0;
  /// Largest relative difference of the sizes at the stated risk between candidates that say something at a risk;
  /// nothing where fewer than two do, infinite where one has a size and another has none.
  std::optional<double> risk_spread;
  std::vector<std::string> notes;  ///< what was left out, and what the guarantee assumes, for people
};

/// Tries filters of order 1 (where speeds are measured) and 2 on a logarithmic grid over β, beside those that the robot
/// file or commission_robot() would take and the paper's (order 1, β = 20), and takes the one with the least `size`:
/// the largest, over the stated faults and sides, of the smallest size that is certain within the window (median over
/// onsets while moving) over the stated size. Sizes within `tie` of the least are ties: the shortest delay wins. log β
/// is refined between the best one's neighbours. β spans from order/β = window, as far as the log's length allows, to
/// βh = 0.5.
///
/// Sums at a stated risk (detector/multiscale/scale_detector.hpp) do not pass through the filter. A candidate changes
/// them by what its order reads, speeds or angles, and through the guaranteed set, of which the set at the risk is a
/// part. Sizes are compared for every noise, unless `either` is asked for; what holds at the risk is told beside them.
///
/// It looks at the torque residual only. All candidates learn from the log that they are judged on: margins are proofs
/// for each of them, whichever is chosen, and an hourly guarantee counts all of them in (hourly_confidence; trial.tried
/// is set to their number).
///
/// Deterministic, whatever the number of threads. Throws as try_detector, and InputError as find_measurement.
[[nodiscard]] DetectorChoice choose_detector(LogSource& log, const Robot& robot,
                                             const DetectorChoiceOptions& options = {});

/// The delay from which on, up to the window, the size at the stated risk is the smaller one; nothing where it is not
/// at the window, or nothing is said at a risk. In fortieths of the window `window`, s.
[[nodiscard]] std::optional<double> risk_decides_from(const StatedMargin& margin, double window);

/// True if `a` is to be taken rather than `b`, given the least size among all candidates.
[[nodiscard]] bool better(const DetectorCandidate& a, const DetectorCandidate& b, double least, double tie);

}  // namespace wheelwright::commission
