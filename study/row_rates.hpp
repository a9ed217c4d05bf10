// SPDX-License-Identifier: Apache-2.0
/// \file
/// How the rows of a log that hold a commissioned robot's bounds move with an input of its file.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/filter/regression_stream.hpp>
#include <wheelwright/study/hull_derivatives.hpp>
#include <wheelwright/study/local_inputs.hpp>

namespace wheelwright {

/// The two half-spaces of a row.
struct RowSides {
  HalfSpace upper, lower;
};

/// Some rows of a log, by sample and output.
using LogRows = std::map<std::pair<std::size_t, std::size_t>, RowSides>;

/// Rows and prior where an input has been moved.
struct RowsBeside {
  LogRows rows;
  Box prior;
};

/// How the active rows of an optimum move, to both sides of an input's value; one rate for each.
struct RowRates {
  std::vector<RowRate> left, right;
  std::string trouble{};  ///< why there are none, in words; empty where there are
};

/// Whether the rows' error bounds stand on declared noise alone.
[[nodiscard]] bool noise_is_declared(const Commissioning& commissioning);

/// The prior box of θ.
[[nodiscard]] Box prior_of(const Robot& robot);

/// How fast the motion of the robot `at` can change between samples, for rows that stand on declared noise: by the limit
/// of its accelerations and, where there are `sides` (p), by the dynamics with all parameters inside them.
[[nodiscard]] MotionBound motion_at(const Commissioning& commissioning, const RobotAt& at,
                                    std::span<const Interval> sides);

/// The rows of `log` for the robot and filter `at`, all else as `commissioning` chose it: the same columns and instants;
/// errors are propagated anew where noise is declared, with `motion` between samples, else they stay. `confidence` as
/// CommissionOptions has it.
[[nodiscard]] RegressionStream rows_of(LogSource& log, const Commissioning& commissioning, const RobotAt& at,
                                       const MotionBound& motion, double confidence);

/// The half-spaces that the rows named in `wanted` are in the box `prior`; those that are not there are left out.
[[nodiscard]] LogRows pick_rows(RegressionSource& rows, const Box& prior, const LogRows& wanted);

/// The rows of the log that are active at an optimum, with the sides that are.
[[nodiscard]] LogRows active_rows(const HullOptima& optima);

/// Rates of the active rows of `optimum` by differences, from their half-spaces at the input's value and by `step` below
/// and above it: central where a row is smooth, one-sided where it has a kink there. None where a row of the log jumps or
/// is gone; `reach` is a large change of the input, by which that is judged. Rates to both sides that differ by less than
/// 1e-3 of them are a curvature where `curved`, else a kink too.
[[nodiscard]] RowRates row_rates(const HullOptima& optima, const HullOptimum& optimum, double reach, double step,
                                 const RowsBeside& below, const RowsBeside& above, bool curved);

}  // namespace wheelwright
