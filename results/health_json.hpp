// SPDX-License-Identifier: Apache-2.0
/// \file
/// doctor.json: the result of `wheelwright doctor`; and what a reader counted, as the examination takes it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commission/doctor/log_health.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kHealthSchema = "wheelwright/doctor/1";

/// Files that were examined.
struct HealthFiles {
  std::string robot;              ///< the robot file as it was named; empty: none
  std::vector<std::string> logs;  ///< the logs as they were named
  std::string software;           ///< name and version
};

/// Defects that the reader of CSV logs dropped.
[[nodiscard]] doctor::ReaderCounts reader_counts(const logs::LogReport& report);

/// Examines the first `most` rows of `log` (doctor::examine); a finding says so where there are more.
[[nodiscard]] doctor::LogHealth examine_first(logs::RecordedLog& log, const std::optional<Robot>& robot,
                                              std::size_t most, std::size_t threads = 1);

/// The examination as JSON (results/doctor.schema.json), findings in their order.
[[nodiscard]] Json to_json(const doctor::LogHealth& health, const HealthFiles& files);

}  // namespace wheelwright::results
