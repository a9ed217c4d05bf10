// SPDX-License-Identifier: Apache-2.0
/// \file
/// A bag as a file of a log: rows at the times of one topic, other topics brought to them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/logs/row_log.hpp>

namespace wheelwright::logs {

/// Origin of the times of all bags of a log, ns: set by the first that is opened.
using TimeOrigin = std::shared_ptr<std::optional<std::int64_t>>;

/// A bag (file or directory) as a file of a log. Columns are those of choose_bag_columns(), clocks those of
/// bag_clocks(), and values of other topics are interpolated as StreamAligner does, over at most 5 of their median
/// steps; rows where that cannot be are dropped and counted. Times that begin later than 10⁸ s (stamps of a wall clock)
/// are counted from the first whole second, since a double does not hold them to the nanosecond;
/// LogFileReport::time_origin has it. Throws InputError as open_bag and choose_bag_columns do, and where no topic has a
/// column that is wanted.
[[nodiscard]] std::unique_ptr<RowFile> bag_file(const std::filesystem::path& path, const LogOptions& options,
                                                const TimeOrigin& origin);

}  // namespace wheelwright::logs
