// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log that was recorded in files, whatever their format.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/logs/csv_report.hpp>

namespace wheelwright {

/// A log read from files, which says what reading found.
class RecordedLog : public LogSource {
 public:
  /// What the first reading found and repaired.
  [[nodiscard]] virtual const LogReport& report() const = 0;
};

/// Throws InputError, naming each missing column, `file`, what the file has and the nearest name, unless `source` has
/// all of `names`. A name may list alternatives of which one suffices: "omega_r|phi_r". `header` is what the file has
/// as written; where it is empty, the columns of `source` are named.
void require_columns(const LogSource& source, const std::vector<std::string>& names, std::string_view file,
                     const std::vector<std::string>& header = {});

/// The same for a log that knows its files.
void require_columns(const RecordedLog& log, const std::vector<std::string>& names);

}  // namespace wheelwright
