// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of any known format, read and written: CSV (plain, gzip, zstd), rosbag2 (MCAP, SQLite), HDF5.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "formats/logs/csv_format.hpp"
#include "formats/logs/mcap_format.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {

/// Options for reading a log.
struct LogOptions : CsvOptions {
  /// Directories with definitions of messages (PKG/msg/TYPE.msg below them), for bags that do not bring their own.
  std::vector<std::filesystem::path> msg_path;
  /// By which rows are timed in place of their stamps, where its step is > 0 (read_evenly()).
  std::optional<EvenClock> clock;
};

/// `log` with its rows timed by `clock`; its report stays that of the files. Throws InvalidArgument as
/// core::EvenTimes.
[[nodiscard]] std::unique_ptr<RecordedLog> read_evenly(std::unique_ptr<RecordedLog> log, const EvenClock& clock);

/// Opens a log in one or several files or bag directories, told apart by their content; each begins a new segment.
/// All of it is read once, as RowLog says, and kept in memory where 256 MiB are enough for that (RowLogOptions).
/// `LogOptions::map` and `extra` name columns of CSV and HDF5 files and fields of bags (TOPIC.FIELD, bag_log.hpp).
/// Throws InputError, naming file and place, for what cannot be read, and for a file with the bytes of another;
/// InvalidArgument when `paths` is empty.
[[nodiscard]] std::unique_ptr<RecordedLog> open_log(const std::vector<std::filesystem::path>& paths,
                                                    const LogOptions& options = {});

/// Options for writing a log.
struct LogWriteOptions {
  McapCompression compression = McapCompression::zstd;  ///< of MCAP files
  std::string columns_topic = "/columns";               ///< of a bag: what has no message of its own
  double time_origin = 0.0;  ///< s that is added to every time where the format keeps whole clocks (bags)
};

/// A writer of one log, which appears whole at commit() or not at all.
class LogWriter {
 public:
  virtual ~LogWriter() = default;
  /// Appends rows. Throws InputError when they cannot be written; InvalidArgument when a value is not finite or the
  /// columns are not as many as the names.
  virtual void write(const LogBlock& block) = 0;
  /// Puts the log in its place. To be called once, last.
  virtual void commit() = 0;
};

/// Begins a log with the columns `names` (time apart) in the format that the ending of `path` says: .csv (.csv.gz,
/// .csv.zst), .h5 or .hdf5, .mcap, .db3, or none: a directory as rosbag2 records it. Segments are not marked: a reader
/// finds those that begin at a gap or a reset.
///
/// A bag holds sensor_msgs/JointState on /joint_states (the arrays for which both wheels, or the axis, have a column;
/// joints right_wheel and left_wheel, or axis), geometry_msgs/PoseStamped on /pose, sensor_msgs/Imu on /imu, and
/// everything else as float64 fields of a message of its own on `columns_topic`, all with the row's time as stamp;
/// times are rounded to nanoseconds, and a heading goes through a quaternion. CSV and HDF5 keep every digit.
/// Throws InputError for another ending and where the file cannot be made; InvalidArgument for a name that is not fit
/// for a header.
[[nodiscard]] std::unique_ptr<LogWriter> create_log(const std::filesystem::path& path,
                                                    const std::vector<std::string>& names,
                                                    const LogWriteOptions& options = {});

/// The parts of create_log(), one for each kind of file.
[[nodiscard]] std::unique_ptr<LogWriter> create_csv(const std::filesystem::path& path,
                                                    const std::vector<std::string>& names);
[[nodiscard]] std::unique_ptr<LogWriter> create_hdf5(const std::filesystem::path& path,
                                                     const std::vector<std::string>& names);
[[nodiscard]] std::unique_ptr<LogWriter> create_bag(const std::filesystem::path& path,
                                                    const std::vector<std::string>& names,
                                                    const LogWriteOptions& options);

/// Throws InvalidArgument unless `names` are fit for a header: no separators, quotes, # or line ends, each once.
void check_column_names(const std::vector<std::string>& names);

/// Throws InvalidArgument unless `block` has `columns` columns of its length and finite values only.
void check_block(const LogBlock& block, std::size_t columns);

}  // namespace wheelwright::logs
