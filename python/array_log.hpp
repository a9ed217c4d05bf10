// SPDX-License-Identifier: Apache-2.0
/// \file
/// numpy columns as a log, read where they lie.
#pragma once

#include <memory>

#include <pybind11/pybind11.h>

#include <wheelwright/logs/csv_format.hpp>
#include <wheelwright/logs/recorded_log.hpp>

namespace wheelwright::python {

/// The log that `columns` (name → one-dimensional array, one of them the time) is, cleaned as a file's rows are: rows
/// with NaN are dropped and counted, gaps and resets begin segments. The arrays are kept and read block by block; those
/// that are not float64 and contiguous are converted first. Names are understood as in a CSV header. Needs the
/// interpreter's lock, which it gives up while it looks at the rows; reading does not need it. Throws InputError as
/// CsvLog does, InvalidArgument for shapes.
[[nodiscard]] std::unique_ptr<logs::RecordedLog> array_log(const pybind11::dict& columns,
                                                           const logs::CsvOptions& options);

}  // namespace wheelwright::python
