// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of any format that is known: CSV (plain, gzip, zstd), rosbag2 (MCAP, SQLite), HDF5.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include <wheelwright/logs/csv_header.hpp>
#include <wheelwright/logs/recorded_log.hpp>

namespace wheelwright {

/// What to read from a log.
struct LogOptions : CsvOptions {
  /// Directories with definitions of messages (PKG/msg/TYPE.msg below them), for bags that do not bring their own.
  std::vector<std::filesystem::path> msg_path;
};

/// Opens a log in one or several files or bag directories, told apart by their content; each begins a new segment.
/// Memory does not grow with them. All of it is read once, as RowLog says. `LogOptions::map` and `extra` name columns of
/// CSV and HDF5 files and fields of bags (TOPIC.FIELD, bag_columns.hpp).
/// Throws InputError, naming file and place, for what cannot be read; InvalidArgument when `paths` is empty.
[[nodiscard]] std::unique_ptr<RecordedLog> open_log(const std::vector<std::filesystem::path>& paths,
                                                    const LogOptions& options = {});

}  // namespace wheelwright
