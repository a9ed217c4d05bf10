// SPDX-License-Identifier: Apache-2.0
/// \file
/// Constant thresholds μ_o of D2 (37) to (40) by experiment: block maxima of |ε| on driving that the fit has not seen.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "core/regression.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// Options of constant_thresholds().
struct ConstantThresholdOptions {
  double step = 0.0;                            ///< s, between instants, > 0
  double memory = 0.0;                          ///< s, of the residual's filter: a block is no shorter; >= 0
  std::vector<std::optional<double>> stated{};  ///< μ_o of the outputs that the robot file states; empty: of none
  std::size_t most_blocks = 500;                ///< even, >= 20; from there on blocks are twice as long
};

/// Constant thresholds from fault-free `rows`, whose fit is `estimate` (θ̂), two walks.
///
/// The instants are cut into blocks of equal number, no shorter than the memory of the filter. In each block |ε| is
/// that of a fit without this block and its two neighbours: θ̂ less what their rows pulled it, θ̂ + A⁻¹ Σ Yᵀε/σ² over
/// the rows that are left, A = Σ YᵀY/σ², centred to be 0 over all rows (so for least squares it is their exact fit).
/// μ_o of an output is the largest |ε| of all blocks.
///
/// **What it promises** is the rank of a maximum: of n + 1 blocks that can be exchanged each is the largest with
/// probability 1/(n + 1), whatever the distribution of ε. No more can be promised from n blocks without an assumption
/// on its tail; a longer log promises more. Blocks that depend on each other, driving that another block never saw, and
/// a robot that ages cannot be exchanged.
///
/// **How it is tested**: the same is done with 7 tenths of the log, the blocks of the tenths 3, 6 and 9 held out, and
/// those of the latter are counted whose |ε| exceeds the threshold of the former. Of n' and m blocks that can be
/// exchanged k or more exceed with a probability of Π_{j < k} (m − j)/(n' + m − j).
///
/// Nothing where the rows make fewer than 10 blocks and some threshold is not stated. Throws InvalidArgument for
/// options out of range.
[[nodiscard]] std::optional<detector::ConstantThresholds> constant_thresholds(core::RegressionSource& rows,
                                                                              const Eigen::VectorXd& estimate,
                                                                              const ConstantThresholdOptions& options);

/// Of both residuals of `model`, which was commissioned from `log`: fills LearntSet::constant of each from the rows
/// that its detector sees. Outputs that the robot file states keep their value.
void learn_constant_thresholds(LogSource& log, OnlineModel& model);

/// "constant thresholds by experiment, without guarantee: 2.4 s of driving like the log's raise a false alarm with a
/// probability of at most 4.3 % (…)".
[[nodiscard]] std::string sentence(const detector::ConstantThresholds& thresholds);

}  // namespace wheelwright::commission
