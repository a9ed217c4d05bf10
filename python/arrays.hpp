// SPDX-License-Identifier: Apache-2.0
/// \file
/// numpy arrays ↔ Eigen and std::vector: read-only views of what lives in C++, arguments without copies where they fit;
/// numpy columns as a log, read where they lie.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/regression.hpp"
#include "formats/logs/csv_format.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::python {

namespace py = pybind11;

/// An argument of doubles, rows one after the other: the caller's own memory where it is float64 and C-contiguous, else
/// a converted copy.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A read-only array over `data` (row-major), which lives as long as `owner`.
template <typename T>
[[nodiscard]] py::array view(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
  py::array_t<T> array(std::move(shape), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

[[nodiscard]] inline py::array view(const Eigen::VectorXd& v, py::handle owner) {
  return view(v.data(), {v.size()}, owner);
}
[[nodiscard]] inline py::array view(const std::vector<double>& v, py::handle owner) {
  return view(v.data(), {static_cast<py::ssize_t>(v.size())}, owner);
}
[[nodiscard]] inline py::array view(const core::RowMatrix& m, py::handle owner) {
  return view(m.data(), {m.rows(), m.cols()}, owner);
}

/// A read-only copy.
template <typename T>
[[nodiscard]] py::array copy(const std::vector<T>& v) {
  py::array_t<T> array(static_cast<py::ssize_t>(v.size()), v.data());
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
[[nodiscard]] inline py::array copy(const Eigen::VectorXd& v) {
  return copy(std::vector<double>(v.data(), v.data() + v.size()));
}

/// The columns of `table` by name, the time `t` first.
[[nodiscard]] inline py::dict arrays_of(const LogTable& table) {
  py::dict out;
  out["t"] = copy(table.t);
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    out[py::str(table.names[c])] = copy(table.columns[c]);
  }
  return out;
}

/// Throws InvalidArgument, naming `what`, unless `array` has this shape (−1: any length).
inline void check_shape(const py::array& array, const std::vector<py::ssize_t>& shape, const std::string& what) {
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  std::string wanted, found;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    fits = fits && (shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i]);
    wanted += (i > 0 ? ", " : "") + (shape[i] < 0 ? std::string("any") : std::to_string(shape[i]));
  }
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    found += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  }
  check::that(fits, what + " of shape (" + found + ")", "shape (" + wanted + ")");
}

/// The values of a one-dimensional argument.
[[nodiscard]] inline std::span<const double> values(const Doubles& array, const std::string& what,
                                                    py::ssize_t size = -1) {
  check_shape(array, {size}, what);
  return {array.data(), static_cast<std::size_t>(array.size())};
}

/// The log that `columns` (name → one-dimensional array, one of them the time) is, cleaned as a file's rows are: rows
/// with NaN are dropped and counted, gaps and resets begin segments. The arrays are kept and read block by block; those
/// that are not float64 and contiguous are converted first. Names are understood as in a CSV header. Needs the
/// interpreter's lock, which it gives up while it looks at the rows; reading does not need it. Throws InputError as
/// CsvLog does, InvalidArgument for shapes.
[[nodiscard]] std::unique_ptr<logs::RecordedLog> array_log(const pybind11::dict& columns,
                                                           const logs::CsvOptions& options);

}  // namespace wheelwright::python
