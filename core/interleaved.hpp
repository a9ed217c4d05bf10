// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of a second source among those of a first, as when two publishers share a topic.
#pragma once

#include <cstddef>
#include <vector>

namespace wheelwright::core {

/// Rows that come from another source than their neighbours.
struct InterleavedRows {
  std::vector<std::size_t> rows;  ///< in rising order; empty: there is one source
  bool constant = false;          ///< they all hold the same numbers
  std::size_t column = 0;         ///< one that tells, as an example
};

/// Looks for rows of a second source in `columns` (of equal length, NaN for what is missing; nullptrs are passed over).
///
/// Rows that repeat the one before count as one. A column tells a row apart where its number lies outside of the
/// interval between its two neighbours by more than 5 times the neighbours' distance and a fiftieth of the column's
/// range: a signal that is sampled faster than it changes never does, noise does so rarely. A row stands apart where
/// at least half of the columns that change tell, and one of them takes more than 50 values, told apart to a 500th of
/// its range, that is not seen at the row's own number otherwise (so that speeds of a coarse encoder that fall to 0
/// and rise again are none). A second source has at least 5 such rows, and one row of 500: of one constant content;
/// or, in at least half of the columns with more than 50 values, two tracks that alternate row by row, or rows that
/// follow each other more closely than they lie to their neighbours and lie ten times as far off as noise bends the
/// others. Single corrupted rows are none.
[[nodiscard]] InterleavedRows interleaved_rows(const std::vector<const std::vector<double>*>& columns);

}  // namespace wheelwright::core
