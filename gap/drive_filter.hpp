// SPDX-License-Identifier: Apache-2.0
/// \file
/// The one filter that everything in a gap analysis passes: f₂ = f * f of (24) with α = β, on whole signals.
#pragma once

#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// f₂ * u for u linear between instants, β² t e^{−βt} (static gain 1), exact; begins at zero at each segment.
/// `beta` > 0, 1/s. Throws InvalidArgument unless `signal` has one value per instant.
[[nodiscard]] Eigen::VectorXd filtered(const Drive& drive, double beta, const Eigen::VectorXd& signal);

/// f₂ * u̇ for the same u: no derivative is taken.
[[nodiscard]] Eigen::VectorXd filtered_rate(const Drive& drive, double beta, const Eigen::VectorXd& signal);

/// f₂ * τ: Model::input · efforts as the log holds them (held or linear), one signal per output.
[[nodiscard]] std::vector<Eigen::VectorXd> filtered_outputs(const Drive& drive, double beta);

/// The base regressor f₂ * Y, [parameter][output]; an empty vector stands for a signal of zeros. RegressorFilter (order 2,
/// α = β) weighs the same motion by means of f₂, so that the rows differ by (βh)² in relation; for angles its instants are
/// half a step later.
[[nodiscard]] std::vector<std::vector<Eigen::VectorXd>> filtered_regressor(const Drive& drive, double beta);

/// Rows after `memory`/β from the start of their segment, whose filter has forgotten what was before.
[[nodiscard]] Mask settled(const Drive& drive, double beta, double memory = 10.0);

/// Rows for which no joint's filtered indicator of rest exceeds `share`: with stiction the torque of a resting joint
/// is any number, and no model of motion says anything about it. None for a drive without efforts.
[[nodiscard]] Mask moving(const Drive& drive, double beta, double share = 0.02);

}  // namespace wheelwright
