// SPDX-License-Identifier: Apache-2.0
/// \file
/// Selection of causes: from the held-out errors of many sets of causes to one verdict.
///
/// Two questions are asked one after the other. First, which effects change the *structure*: sets are compared with θ
/// fitted again beside them, so that nothing depends on θ being known. Then, where a nominal θ can be trusted (a
/// healthy baseline log, or the robot file), what θ itself had to do: the structural causes with θ held at its nominal
/// value, and parametric causes added until that leaves no more than θ fitted freely.
///
/// A further cause is taken only if it removes a large part of the remaining gap or of the whole gap (SelectionOptions
/// has the limits), and more than chance explains, over blocks of time and the number of effects that were tried. At
/// the noise floor no further cause is sought. Columns are not exact (a smoothed sign, a neglected second order), so
/// the misfit of the best set is the reference by which other sets count as equally good.
///
/// Of the sets that are equally good some are no answer of their own and leave:
/// - one that contains another one, with more coefficients, and is not worth them by the conditions of a further cause;
/// - on a log without a pose, one that needs two lengths of the robot to be wrong at once where another needs none. By
///   the efforts alone a robot of other lengths is one of other parameters. Masses and friction change in use; lengths
///   do not, somebody has measured them, and a wheel and a track that are wrong together are two mistakes. For the same
///   reason the set with the fewest such lengths is named first among those with as few causes.
/// Causes whose share of the gap is nothing in two decimals make no set another answer (CredibleSet::principal).
///
/// Naive selection rule for comparison with selection.hpp (docs/methods/gap.md has its results).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gap/causes/candidate.hpp"

namespace wheelwright::gap {

/// Options of select_causes(). Gains, remainders and the gap are mean squares in units of the noise floor, held out and
/// beyond the floor. A further cause is taken where its gain is significant, above `smallest`, and satisfies one of
///
///     gain > share·gap and gain > part·remainder,     a relevant part of both,
///     gain > large_share·gap,                         a large part of the gap,
///     gain > large_part·remainder, tolerated_floor and small_share·gap,   nearly all of the remainder.
///
/// The causes explain the log where the remainder is at most the largest of tolerated·(structural part) +
/// EffectKind::inexact, min(tolerated_nominal·gap, 4·tolerated_floor) and tolerated_floor.
struct SelectionOptions {
  double share = 0.03;         ///< fraction of the gap, with `part`
  double part = 0.5;           ///< fraction of the remainder, with `share`
  double large_share = 0.25;   ///< fraction of the gap that suffices alone
  double large_part = 0.8;     ///< fraction of the remainder, with `small_share`
  double small_share = 0.002;  ///< fraction of the gap, with `large_part`
  double smallest = 0.3;       ///< least gain of a cause in any case
  double least_gap = 0.1;      ///< less is nothing, though a cause may lower the noise of a log that has less
  double significance = 0.05;  ///< of a gain, over all effects that were tried; of one that leaves no more than is
                               ///< tolerated, of this effect alone
  double piece = 1.0;          ///< s, shortest stretch of time over which a gain is compared: errors that are further
                               ///< apart are taken to be independent
  double misfit = 1.0;  ///< another set is as good if it is worse by at most this many times the best set's excess
  double level = 0.10;  ///< 1 − level is that of the confidence set
  double cancellation = 4.0;  ///< largest sum of squares of the causes' own signatures over that of their sum; above
                              ///< it the causes cancel each other and the set is no explanation
  double theta_cancellation = 300.0;  ///< the same limit with the change of θ among the signatures; larger, since a
                                      ///< cause that θ had absorbed moves θ back
  double tolerated = 0.04;            ///< fraction of the structural part that an explanation may leave
  double tolerated_nominal = 0.003;   ///< fraction of the whole gap, θ's part included, that an explanation may leave
  double tolerated_floor = 0.5;       ///< remainder that an explanation may leave in any case
  double theta_share =
      0.02;                 ///< fraction of the gap that a change of θ may explain without a parametric cause, besides
                            ///< twice what the causes leave and what their columns miss (EffectKind::inexact)
  double contained = 1e-3;  ///< one set contains another's signature if it leaves less than this fraction of it
  std::uint64_t seed = 1;
  std::size_t threads = 1;
};

/// A set that may be the right one.
struct CredibleSet {
  CauseSet set;
  double p_value = 1.0;
  std::vector<std::size_t> principal{};  ///< members whose share of the gap (shapley_shares()) is at least 0.005: the
                                         ///< others are nothing in two decimals
};

/// Result of select_causes().
struct Selection {
  CauseSet structural;  ///< best set with θ fitted again; empty: θ explains the log
  CauseSet all;         ///< with the parametric causes, θ nominal (as `structural` where no θ is trusted)
  std::vector<CredibleSet> credible;  ///< alternatives to `all`, itself first; best first
  std::vector<CredibleSet> trifles;   ///< the credible sets before what differed in them was left out of `all`, each
                                      ///< with another trifle beside the same principal causes; empty: nothing was
  double nominal_excess = 0.0;   ///< of M0 with θ nominal, above the floor; the refitted one where none is trusted
  double refitted_excess = 0.0;  ///< of M0 with θ fitted again, or nominal where that leaves less
  double left = 0.0;             ///< excess of `structural`
  BaseModel base = BaseModel::refitted;  ///< what `all` was judged with
  bool theta_moved = false;              ///< θ differs from nominal and no parametric cause says why
  bool reaches_floor = true;             ///< what is left is tolerable, and not by any of many combinations
  bool any_cause = false;
  bool enough_time = true;          ///< else no gain could have been significant over so short a time
  std::vector<CauseSet> looked_at;  ///< every single effect and the best pairs and triples, θ fitted again
};

/// Properties of an effect that selection needs besides its columns.
struct EffectKind {
  double inexact = 0.0;                   ///< Effect::inexact
  std::vector<std::size_t> stands_for{};  ///< Effect::stands_for, by index
  bool parametric = false;                ///< Effect::parametric
  bool unseen_length = false;             ///< a length of the robot (DirectMeasurement::lengths), on a log without a
                                          ///< pose: it shows in the efforts alone, as parameters do
};

/// Selects. `floor_error` is the mean square that noise alone leaves (1 where the floors are right); `kinds` has one
/// for each effect. Effects that move θ only, which is found from the columns, are tried only with `nominal_trusted`.
[[nodiscard]] Selection select_causes(const CandidateTable& table, const std::vector<EffectKind>& kinds,
                                      bool nominal_trusted, double floor_error, const SelectionOptions& options = {});

/// Whether `savings` (of losses, one for each stretch of time) are more than chance at this level: by the signed-rank
/// test, or by random signs of their logarithms, for a cause that shows in half of the stretches only, but by far.
[[nodiscard]] bool saves_more_than_chance(const Eigen::VectorXd& savings, double level, std::uint64_t seed);

/// A set of causes that the naive rule chose.
struct NaiveChoice {
  std::vector<std::size_t> members;  ///< indices of candidates, in the order in which they were taken
  double criterion = 0.0;            ///< the smallest n ln s² + k ln n that was reached
};

/// Forward selection of single effects by the Bayesian information criterion (Schwarz 1978), θ fitted again beside
/// them, in sample: at each step the candidate that lowers n ln s² + k ln n most, until none does or there are
/// `largest`. s² is the mean square over all n rows of the table, k counts the coefficients of θ and of the causes and
/// their shapes.
///
/// The criterion takes rows for independent. Filtered rows are not, so that chance pays for its columns: without any
/// effect about two logs in three are given one. A forward search never takes back what it took.
[[nodiscard]] NaiveChoice naive_selection(const CandidateTable& table, std::size_t largest = 3);

}  // namespace wheelwright::gap
