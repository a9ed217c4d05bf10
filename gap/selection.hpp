// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which causes a log shows: from the held-out errors of many sets of causes to one verdict.
///
/// Two questions are asked one after the other. First, which effects change the *structure*: sets are compared with θ
/// fitted again beside them, so that nothing depends on θ being known. Then, where a nominal θ can be trusted (a
/// healthy baseline log, or the robot file), what θ itself had to do: the structural causes with θ held at its nominal
/// value, and parametric causes added until that leaves no more than θ fitted freely.
///
/// A further cause is taken only if it removes a good part of what is left and a part of the whole gap that counts, by
/// more than what chance does over blocks of time and the number of effects that were tried; none is asked for at the
/// floor. The rows of a model that
/// is nearly right leave a misfit of their own (a smoothed sign, a neglected second order); the misfit of the best set
/// is the yardstick by which others are as good.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <wheelwright/gap/candidate.hpp>

namespace wheelwright {

/// Options of select_causes().
struct SelectionOptions {
  double share = 0.03;         ///< of the gap that a cause must remove to be one …
  double part = 0.5;           ///< … and of what is left without it
  double large_share = 0.25;   ///< of the gap that is enough alone
  double large_part = 0.8;     ///< of what is left that is enough …
  double small_share = 0.002;  ///< … with this share of the gap
  double smallest = 0.3;       ///< gain that a cause must have in any case, mean squares of the floor
  double significance = 0.05;  ///< of a gain, over all effects that were tried
  double misfit = 1.0;         ///< times the best set's own excess by which another set may be worse and be as good
  double level = 0.10;         ///< 1 − level: of the confidence set
  double cancellation = 4.0;   ///< sum of squares of the causes' own signatures over that of their sum, above
                               ///< which a set is no explanation: causes that undo each other
  double theta_cancellation = 300.0;  ///< the same with what θ moves by among them; larger, since a cause that θ had
                                      ///< taken up moves it back
  double tolerated = 0.04;  ///< share of the structural part that an explanation may leave (EffectKind::inexact more) …
  double tolerated_nominal = 0.003;  ///< … or of the whole gap, θ's part included, up to four times …
  double tolerated_floor = 0.5;      ///< … or excess in mean squares of the floor, whichever is larger
  double theta_share = 0.06;         ///< of the gap that θ may make by having moved without a cause being asked for
  double contained = 1e-3;           ///< share of a signature that another set leaves of it, below which it contains it
  std::uint64_t seed = 1;
  std::size_t threads = 1;
};

/// A set that may be the right one.
struct CredibleSet {
  CauseSet set;
  double p_value = 1.0;
};

/// What select_causes() found.
struct Selection {
  CauseSet structural;  ///< best set with θ fitted again; empty: θ explains the log
  CauseSet all;         ///< with the parametric causes, θ nominal (as `structural` where no θ is trusted)
  std::vector<CredibleSet> credible;  ///< alternatives to `all`, itself first; best first
  double nominal_excess = 0.0;   ///< of M0 with θ nominal, above the floor; the refitted one where none is trusted
  double refitted_excess = 0.0;  ///< of M0 with θ fitted again
  double left = 0.0;             ///< excess of `structural`
  BaseModel base = BaseModel::refitted;  ///< what `all` was judged with
  bool theta_moved = false;              ///< θ differs from nominal and no parametric cause says why
  bool reaches_floor = true;             ///< what is left is tolerable
  bool any_cause = false;
  bool enough_blocks = true;        ///< else no gain could have been significant over so few blocks of time
  std::vector<CauseSet> looked_at;  ///< every single effect and the best pairs and triples, θ fitted again
};

/// What selection must know of an effect besides its columns.
struct EffectKind {
  double inexact = 0.0;  ///< Effect::inexact
};

/// Selects. `floor_error` is the mean square that noise alone leaves (1 where the floors are right); `kinds` has one
/// for each effect. Effects that move θ only, which is found from the columns, are tried only with `nominal_trusted`.
[[nodiscard]] Selection select_causes(const CandidateTable& table, const std::vector<EffectKind>& kinds,
                                      bool nominal_trusted, double floor_error, const SelectionOptions& options = {});

/// Largest share of a column of `a`, freed of θ, that the columns of `b` cannot make up: 0 where b contains a.
[[nodiscard]] double unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a,
                                    const std::vector<std::size_t>& b, BaseModel base);

}  // namespace wheelwright
