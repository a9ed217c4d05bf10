// SPDX-License-Identifier: Apache-2.0
/// \file
/// HDF5 files as files of a log.
///
/// A log is a group with one-dimensional numeric datasets of the same length, one for each column (any names that
/// log_columns.hpp knows; other datasets are ignored), or one dataset of a compound type whose members are the columns, as
/// h5py writes structured arrays. A text attribute `units` (or `unit`) that is not the contract's keeps a dataset from
/// being taken.
#pragma once

#include <filesystem>
#include <memory>

#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/logs/row_log.hpp>

namespace wheelwright {

/// Whether the file begins as HDF5 files do (without a user block).
[[nodiscard]] bool is_hdf5(const std::filesystem::path& path);

/// An HDF5 file as a file of a log. The group is the one whose columns include a time; where there are several, the first
/// in alphabetical order of paths, and LogFileReport::notes says so. `LogOptions::map` names datasets by their path
/// ("/drive/w_right", or relative to the group), or members of the compound dataset. Rows are cleaned as in a CSV file,
/// but nothing is ever text. Throws InputError, naming file and dataset, for what cannot be read.
[[nodiscard]] std::unique_ptr<RowFile> hdf5_file(const std::filesystem::path& path, const LogOptions& options);

}  // namespace wheelwright
