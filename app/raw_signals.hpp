// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log thinned to what a page can draw.
#pragma once

#include <cstddef>

#include <wheelwright/core/log.hpp>

namespace wheelwright::app {

/// At most `most` rows of `log`: where the log is longer, the smallest and the largest value of every column in each bin
/// of consecutive rows, so that no peak is lost. Walks the log once, in bounded memory.
[[nodiscard]] LogTable raw_signals(LogSource& log, std::size_t most = 8000);

}  // namespace wheelwright::app
