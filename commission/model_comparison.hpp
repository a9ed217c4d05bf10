// SPDX-License-Identifier: Apache-2.0
/// \file
/// Two commissioned models of one kind of robot against each other: what has changed for certain between their logs,
/// which parameters explain it, what could have changed unseen, and whose best guesses differ by more than chance.
///
/// Let P and Q be the sets of parameters that the two logs allow. Where their assumptions hold the true θ of the first
/// is in P and the true θ' of the second in Q. So θ'_j − θ_j lies between min Q_j − max P_j and max Q_j − min P_j,
/// whatever else has changed; and where P ∩ Q is proved empty something has changed, although every interval of the one
/// may overlap that of the other. A set S of parameters explains a change alone when
///
///     { (θ, θ') : θ in P, θ' in Q, θ'_j = θ_j for all j outside S }
///
/// is not proved empty; the true set of changed parameters is never among those that are refused.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/slab_rows.hpp"
#include "core/interval.hpp"
#include "core/warrant.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// One parameter, or the physical quantity behind it, in two sets. Intervals are rounded outward.
struct ParameterChange {
  std::string name;      ///< of θ's entry, e.g. "r_mass"
  std::string quantity;  ///< that the intervals are of: the physical one where both robot files tell one scale, e.g.
                         ///< "mass"; else the name
  std::string unit;
  Interval before, after;
  Interval change;                   ///< holds after − before, whatever else has changed
  std::optional<Interval> together;  ///< where one θ explains both logs: bounds of both, if nothing has changed

  /// True if it has changed whatever else has.
  [[nodiscard]] bool certain() const { return change.lower > 0.0 || change.upper < 0.0; }
};

/// Parameters that explain a change when all others stay.
struct ChangeExplanation {
  std::vector<std::size_t> parameters;  ///< ascending
  std::vector<Interval> change;         ///< of each, in the unit of its ParameterChange: holds after − before
};

/// Result for one pair of sets.
struct SetComparison {
  bool wheels = false;         ///< of wheel radii and yaw gains; else of θ_L
  std::optional<double> risk;  ///< that one of the two sets lacks its truth; nothing: for every noise within its bounds
  core::Warrant warrant = core::Warrant::extrapolated;  ///< the weaker of both
  bool compatible = true;                               ///< not proved: no one θ is in both sets
  std::vector<ParameterChange> parameters;
  std::vector<ChangeExplanation> explanations;  ///< where not compatible: all of the smallest number of parameters
  std::size_t sought = 0;                       ///< largest number of parameters at once that was tried
};

/// Standard errors by which two best guesses differ before this is called a change: errors of Student's kind with ten
/// degrees of freedom exceed it in one of 10,000 logs.
inline constexpr double kToldStandardErrors = 6.0;

/// The best guess (least squares) of one log at a quantity.
struct BestGuess {
  std::string quantity;
  std::string unit;
  double value = 0.0;
  double standard_error = 0.0;  ///< > 0
};

/// A quantity that both logs have a best guess of.
struct GuessChange {
  BestGuess before, after;

  /// after − before, as a multiple of its standard error.
  [[nodiscard]] double standard_errors() const;
  /// True if they differ by more than kToldStandardErrors: a change by statistics, whose errors are those that the two
  /// logs show of themselves. No bound on any error stands behind it.
  [[nodiscard]] bool told() const { return std::abs(standard_errors()) > kToldStandardErrors; }
};

/// The quantities of `before`, in its order, that `after` has too, in the same unit.
[[nodiscard]] std::vector<GuessChange> compare_guesses(const std::vector<BestGuess>& before,
                                                       const std::vector<BestGuess>& after);

/// Result of compare_models(): the sets that both models have.
struct ModelComparison {
  std::vector<SetComparison> sets;
  std::vector<std::string> only_before, only_after;  ///< names of θ's entries that only one of the models has
  std::vector<GuessChange> guesses{};                ///< where they are known: see compare_guesses()

  /// The sets that tell a change, in their order: for every noise before a stated risk.
  [[nodiscard]] std::vector<const SetComparison*> telling() const;
  /// True if something has changed: for certain, or but for the stated risk.
  [[nodiscard]] bool changed() const { return !telling().empty(); }
  /// The quantities whose best guesses differ by more than chance, the clearest first.
  [[nodiscard]] std::vector<GuessChange> likely() const;
};

/// What a set of parameters is compared by.
struct ParameterSet {
  const std::vector<bounds::HalfSpace>& facets;
  const Box& box;
};

/// Compares { θ in box : facets } of two logs. Sets S are tried from single parameters on, until a number of them
/// explains, or `most_sets` sets would be passed. `parameters` get their intervals, names apart. Throws InvalidArgument
/// unless the dimensions agree.
[[nodiscard]] SetComparison compare_sets(const ParameterSet& before, const ParameterSet& after,
                                         std::size_t most_sets = 250);

/// Compares all that two models have in common; a parameter that only one has (dry friction) may be anything in the
/// other, and is no part of the sets that are returned. Best guesses are compared where both models have the same
/// parameters. Throws InvalidArgument, naming what differs, unless the others mean the same in both: kind of robot,
/// geometry, unit of the efforts; and where there are no others.
[[nodiscard]] ModelComparison compare_models(const detector::OnlineModel& before, const detector::OnlineModel& after,
                                             const std::vector<BestGuess>& guesses_before = {},
                                             const std::vector<BestGuess>& guesses_after = {});

}  // namespace wheelwright::commission
