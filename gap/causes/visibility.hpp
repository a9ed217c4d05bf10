// SPDX-License-Identifier: Apache-2.0
/// \file
/// Smallest sizes of causes that a log without a gap would have shown.
#pragma once

#include <cstdint>
#include <vector>

#include "gap/causes/selection.hpp"
#include "gap/diagnosis.hpp"
#include "gap/prepared.hpp"

namespace wheelwright::gap {

/// What a log without a gap leaves already.
struct Baseline {
  double nominal_excess = 0.0;          ///< Selection::nominal_excess; not cut off at 0
  double refitted_excess = 0.0;         ///< of the model with θ fitted again; not cut off at 0
  std::vector<Eigen::VectorXd> left{};  ///< residual of that model in each space of the rows
};

/// For each effect of the catalogue that applies, the smallest size at which select_causes() with `options` would have
/// found a cause on this drive, or one channel would have stood out: sizes at which, added to what the log leaves
/// (`now`), the effect
/// - leaves, beside θ fitted again, a mean square of SelectionOptions::smallest floors more, in savings over stretches
///   of SelectionOptions::piece that are more than chance;
/// - or, where some θ is trusted, more than θ may take up without a cause (SelectionOptions::theta_share, smallest);
/// - or lifts one channel to twice SelectionOptions::tolerated_floor above its floor.
///
/// Each coefficient alone, the others 0, the shapes in the middle of their grid; of an effect of unit coefficient with
/// one shape, that shape, within its bounds. Errors held out are taken as those of the fit, so that sizes are right to
/// some ten per cent. Laws of free form, effects with no number of their own (play), and those that this log does not
/// show at any size are left out.
[[nodiscard]] std::vector<VisibleSize> visible_sizes(const PreparedGap& prepared, const GapProblem& problem,
                                                     const Baseline& now, const SelectionOptions& options);

}  // namespace wheelwright::gap
