// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of which rows are lost.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/log.hpp"

namespace wheelwright::testing_support {

/// `log` without the rows for which `lost` is true.
template <typename Lost>
LogTable without_rows(const LogTable& log, Lost lost) {
  LogTable kept;
  kept.names = log.names;
  kept.columns.resize(log.columns.size());
  for (std::size_t k = 0; k < log.rows(); ++k) {
    if (lost(k)) {
      continue;
    }
    kept.t.push_back(log.t[k]);
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      kept.columns[c].push_back(log.columns[c][k]);
    }
  }
  return kept;
}

/// `log` without the rows `lost`.
inline LogTable without_rows(const LogTable& log, const std::vector<std::size_t>& lost) {
  return without_rows(log, [&](std::size_t k) { return std::find(lost.begin(), lost.end(), k) != lost.end(); });
}

}  // namespace wheelwright::testing_support
