// SPDX-License-Identifier: Apache-2.0
/// \file
/// How the rows of a log that hold a commissioned robot's bounds move with an input of its file.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/filter/regression_stream.hpp>
#include <wheelwright/sensitivity/hull_derivatives.hpp>
#include <wheelwright/sensitivity/local_inputs.hpp>

namespace wheelwright {

/// The two half-spaces of a row.
struct RowSides {
  HalfSpace upper, lower;
};

/// Some rows of a log, by sample and output.
using LogRows = std::map<std::pair<std::size_t, std::size_t>, RowSides>;

/// How the active rows of an optimum move, to both sides of an input's value; one rate for each.
struct RowRates {
  std::vector<RowRate> left, right;
  std::string trouble{};  ///< why there are none, in words; empty where there are
};

/// Whether the rows' error bounds stand on declared noise alone.
[[nodiscard]] bool noise_is_declared(const Commissioning& commissioning);

/// The prior box of θ.
[[nodiscard]] Box prior_of(const Robot& robot);

/// The rows of `log` for the robot and filter `at`, all else as `commissioning` chose it: the same columns and instants;
/// errors are propagated anew where noise is declared, else they stay. `confidence` as CommissionOptions has it.
[[nodiscard]] RegressionStream rows_of(LogSource& log, const Commissioning& commissioning, const RobotAt& at,
                                       double confidence);

/// The half-spaces that the rows named in `wanted` are for `at`; those that are not there are left out.
[[nodiscard]] LogRows rows_at(LogSource& log, const Commissioning& commissioning, const RobotAt& at, double confidence,
                              const LogRows& wanted);

/// The names of all rows that are active at an optimum.
[[nodiscard]] LogRows active_rows(const HullOptima& optima);

/// Rates of the active rows of `optimum` by differences, from their half-spaces at the input's value and by `step` below
/// and above it: central where a row is smooth, one-sided where it has a kink there. None where a row jumps or is gone.
[[nodiscard]] RowRates row_rates(const HullOptima& optima, const HullOptimum& optimum, const LocalInput& input,
                                 double step, const LogRows& before, const Box& prior_before, const LogRows& after,
                                 const Box& prior_after);

/// Rates where only the sides of the prior of one parameter move: `parameter` its number, `per_physical` the unit of θ in
/// that of the physical quantity.
[[nodiscard]] RowRates prior_rates(const HullOptimum& optimum, const PriorRate& prior, double per_physical,
                                   std::size_t parameter);

}  // namespace wheelwright
