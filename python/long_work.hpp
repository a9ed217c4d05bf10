// SPDX-License-Identifier: Apache-2.0
/// \file
/// Work that takes long: without the interpreter's lock, with progress, and stopped by Ctrl-C.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include <pybind11/pybind11.h>

#include <wheelwright/core/log.hpp>

namespace wheelwright::python {

namespace py = pybind11;

/// One piece of long work. Made and run with the interpreter's lock, which is given up while it runs.
class LongWork {
 public:
  /// `progress` is None or is called as progress(fraction, text), with the lock, on the thread that works.
  explicit LongWork(py::object progress) : progress_(std::move(progress)) {}

  /// What a room of the toolkit is to be told with.
  [[nodiscard]] std::function<void(std::string_view, double)> teller() {
    return [this](std::string_view text, double share) { tell(text, share); };
  }

  /// Calls Python: `call()` with the lock. An exception there ends the work, and run() throws it.
  template <typename Call>
  auto ask(const Call& call) -> decltype(call());

  /// Lets a signal's handler run, if a tenth of a second has passed since the last time; what it raises ends the work.
  void breathe();

  /// The result of work(), which runs without the lock.
  template <typename Work>
  auto run(const Work& work) -> decltype(work());

 private:
  // Ends the work; the Python exception waits in failure_.
  struct Stopped {};

  void tell(std::string_view text, double share);

  py::object progress_;
  std::optional<py::error_already_set> failure_;  // touched with the lock only
  std::mutex watch_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// A log that breathes between its blocks.
class WatchedLog final : public LogSource {
 public:
  WatchedLog(LogSource& log, LongWork& work) : log_(&log), work_(&work) {}
  [[nodiscard]] const std::vector<std::string>& columns() const override { return log_->columns(); }
  bool next(LogBlock& block) override {
    work_->breathe();
    return log_->next(block);
  }
  void rewind() override { log_->rewind(); }
  [[nodiscard]] double median_step() const override { return log_->median_step(); }

 private:
  LogSource* log_;
  LongWork* work_;
};

template <typename Call>
auto LongWork::ask(const Call& call) -> decltype(call()) {
  const py::gil_scoped_acquire lock;
  if (failure_) {
    throw Stopped{};
  }
  try {
    return call();
  } catch (py::error_already_set& error) {
    failure_.emplace(error);
  }
  throw Stopped{};
}

template <typename Work>
auto LongWork::run(const Work& work) -> decltype(work()) {
  std::optional<decltype(work())> result;
  try {
    const py::gil_scoped_release unlocked;
    result.emplace(work());
  } catch (...) {
    if (!failure_) {
      throw;
    }
  }
  // Whatever the rooms made of Stopped, the Python exception is what happened.
  if (failure_) {
    throw py::error_already_set(*failure_);
  }
  return std::move(*result);
}

}  // namespace wheelwright::python
