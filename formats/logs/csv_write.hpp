// SPDX-License-Identifier: Apache-2.0
/// \file
/// Tables with the times of a wall clock.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/logs/log_file.hpp"

namespace wheelwright::logs {

/// create_csv() of times that are written as `origin` (s, whole) more, digit for digit.
[[nodiscard]] std::unique_ptr<LogWriter> create_csv_since(const std::filesystem::path& path,
                                                          const std::vector<std::string>& names, std::int64_t origin);

}  // namespace wheelwright::logs
