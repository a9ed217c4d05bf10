// SPDX-License-Identifier: Apache-2.0
/// \file
/// Progress of long work, on standard error, for people who watch a terminal.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace wheelwright::app {

/// One line that is rewritten; nothing where standard error is no terminal or `quiet` is set. The first line appears
/// after half a second: short work stays silent.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Tells that `stage` began, at the share [0, 1] of the work.
  void tell(std::string_view stage, double share);

 private:
  bool shown_ = false;
  bool active_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace wheelwright::app
