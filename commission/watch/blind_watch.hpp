// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of a stream that come without a decision: for how long nothing is known of faults.
#pragma once

#include <cstddef>
#include <optional>

namespace wheelwright::commission {

/// Whether rows are so near to each other, `step` (s), that they tell nothing to a model with rows `nominal` (s) apart:
/// less than a hundredth of that, as of a clock that creeps on (seconds read as thousandths of it). What is decided
/// there is true of an instant that is over already.
[[nodiscard]] bool hardly_goes_on(double step, double nominal);

/// Rows in a row without a decision.
struct BlindSpell {
  std::optional<double> since;  ///< s, the last instant before them with a decision; nothing where there was none
  std::size_t rows = 0;         ///< how many came, readable or not
  double seconds = 0.0;  ///< how long they lasted at the model's rate, or by their own clock where that is longer
};

/// Tells when a stream has been undecided for longer than a filter needs to settle: one and a half times as long, and
/// 20 rows at least. A pause in which no rows come is none: the filter settles behind it. A decision about no time is
/// none (crawls()).
class BlindWatch {
 public:
  /// `step`: seconds between rows as the model has them; `settling`: seconds that the filter needs from a standing
  /// start. Throws InvalidArgument unless both are finite and >= 0.
  BlindWatch(double step, double settling);

  /// Whether the clock hardly went on (hardly_goes_on()) from the last row to one at time `t` (s), whose decision is to
  /// be told as undecided().
  [[nodiscard]] bool crawls(double t) const;

  /// A row with a decision at time `t` (s). Returns the spell that it ends, where that had been told.
  std::optional<BlindSpell> decided(double t);

  /// A row without one; `t` (s) where it could be read. Returns the spell at the row from which on it is one.
  std::optional<BlindSpell> undecided(std::optional<double> t);

  /// Whether a spell stands that was told.
  [[nodiscard]] bool blind() const { return told_; }
  /// The rows without a decision that came last; none behind a decision.
  [[nodiscard]] const BlindSpell& spell() const { return spell_; }

 private:
  double step_, longest_;
  BlindSpell spell_;
  std::optional<double> first_;  // time of the first row of the spell that has one
  std::optional<double> last_;   // time of the last row that has one
  bool told_ = false;
};

/// A time in which no row of a stream came.
struct StreamSilence {
  std::optional<double> since;  ///< s, the last row before it; nothing where there was none
  std::optional<double> until;  ///< s, the first row behind it; nothing while it lasts
  double seconds = 0.0;         ///< how long it has lasted, by the machine's clock
};

}  // namespace wheelwright::commission
