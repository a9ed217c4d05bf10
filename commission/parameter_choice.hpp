// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether a robot needs dry friction (a single axis also an offset), where its file leaves it open.
#pragma once

#include <vector>

#include <wheelwright/commission/folds.hpp>
#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Root mean square errors on held-out blocks, relative to the torque, of the first `basic` parameters alone and of all.
struct ParameterChoice {
  double nrmse_basic = 0.0;
  double nrmse_full = 0.0;
  bool full = false;  ///< all parameters are worth having: the held-out error falls by more than a tenth
};

/// Fits both on the training blocks of `rows` and compares them on the held-out ones; two walks.
[[nodiscard]] ParameterChoice choose_parameters(RegressionSource& rows, std::size_t basic, std::size_t log_rows,
                                                const FoldOptions& folds);

}  // namespace wheelwright
