// SPDX-License-Identifier: Apache-2.0
/// \file
/// The estimators that were tried, side by side, and why one of them was taken.
#pragma once

#include <string>

#include <wheelwright/commission/commission.hpp>

namespace wheelwright::report {

/// Reason, Durbin-Wu-Hausman test and a table of all candidates with their 95 % intervals, as HTML; empty where nothing
/// was estimated.
[[nodiscard]] std::string estimator_table(const Commissioning& result);

}  // namespace wheelwright::report
