// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs as the commands read and write them: the options of the reader, of a robot and of an output.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "model/robot.hpp"

namespace wheelwright::app {

struct CommonOptions;

/// --map as reader options. Throws InputError where an entry is not name=column, or its name none of the log contract.
[[nodiscard]] logs::LogOptions reader_options(const CommonOptions& options);

/// reader_options() for the columns that `robot` can use.
[[nodiscard]] logs::LogOptions robot_reader(const Robot& robot, const CommonOptions& options);

/// The log in `paths`, with the columns that `robot` can use. Throws InputError as open_log does.
[[nodiscard]] std::unique_ptr<logs::RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths,
                                                                const Robot& robot, const CommonOptions& options);

/// logs::create_log(); a stream whose name has no ending takes CSV.
[[nodiscard]] std::unique_ptr<logs::LogWriter> create_output(const std::filesystem::path& out,
                                                             const std::vector<std::string>& names,
                                                             const logs::LogWriteOptions& options);

/// Prints what reading a log found (sentences(LogReport)), a line each, on standard output.
void print_log(const std::vector<std::string>& sentences);

}  // namespace wheelwright::app
