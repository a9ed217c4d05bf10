// SPDX-License-Identifier: Apache-2.0
/// \file
/// Handles of the HDF5 library that close themselves.
#pragma once

#include <utility>

#include <hdf5.h>

namespace wheelwright::hdf5 {

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

  /// Whether the library gave one.
  explicit operator bool() const { return id_ >= 0; }
  /// For the library's functions.
  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

}  // namespace wheelwright::hdf5
