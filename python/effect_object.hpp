// SPDX-License-Identifier: Apache-2.0
/// \file
/// Unmodelled effects that are written in Python.
#pragma once

#include <memory>
#include <vector>

#include <wheelwright/gap/effect.hpp>

#include "module.hpp"

namespace wheelwright::python {

/// A drive as an effect's function sees it: good for the time of the call. Needs the interpreter's lock.
class DriveObject {
 public:
  explicit DriveObject(const gap::Drive& drive) : drive_(&drive) {}
  /// The call is over.
  void close() { drive_ = nullptr; }
  /// Throws InvalidArgument after the call.
  [[nodiscard]] const gap::Drive& drive() const;

 private:
  const gap::Drive* drive_;
};

/// `columns(drive, shape)` as Effect::columns: called with the interpreter's lock, from whatever thread. What it
/// returns is checked: as many columns as `count`, signals of one value per instant, finite.
[[nodiscard]] std::function<std::vector<gap::Column>(const gap::Drive&, std::span<const double>)> columns_in_python(
    const std::string& name, const py::function& columns, std::size_t count);

/// `applies(drive)` as Effect::applies: it returns None, or the reason why not.
[[nodiscard]] std::function<gap::Applicability(const gap::Drive&)> applies_in_python(const py::function& applies);

void bind_effect(py::module_& m);

}  // namespace wheelwright::python
