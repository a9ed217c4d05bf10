// SPDX-License-Identifier: Apache-2.0
/// \file
/// HDF5 files as files of a log.
///
/// A log is a group with one-dimensional numeric datasets of the same length, one for each column (any names that
/// recorded_log.hpp knows; other datasets are ignored), or one dataset of a compound type whose members are the
/// columns, as h5py writes structured arrays. A text attribute `units` (or `unit`) that is not the contract's keeps a
/// dataset from being taken.
#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include <hdf5.h>

#include "formats/logs/log_file.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs::hdf5 {

/// An identifier and the function that gives it back.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) {
      close_(id_);
    }
  }

  /// True if the library gave one.
  explicit operator bool() const { return id_ >= 0; }
  /// For the library's functions.
  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

/// Before the first call: the library closes at exit what a failed write left open, and crashes there.
inline void begin_library() {
  H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

}  // namespace wheelwright::logs::hdf5

namespace wheelwright::logs {

/// True if the file begins as HDF5 files do (without a user block).
[[nodiscard]] bool is_hdf5(const std::filesystem::path& path);

/// An HDF5 file as a file of a log. The group is the one whose columns include a time; where there are several, the
/// first in alphabetical order of paths, and LogFileReport::notes says so. `LogOptions::map` names datasets by their
/// path ("/drive/w_right", or relative to the group), or members of the compound dataset. Rows are cleaned as in a CSV
/// file, but nothing is ever text. Times since 1970, in s or in whole ms, µs or ns, are counted from a whole second, of
/// `origin` where it has one. Throws InputError, naming file and dataset, for what cannot be read.
[[nodiscard]] std::unique_ptr<RowFile> hdf5_file(const std::filesystem::path& path, const LogOptions& options,
                                                 const TimeOrigin& origin);

}  // namespace wheelwright::logs
