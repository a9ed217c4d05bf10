// SPDX-License-Identifier: Apache-2.0
/// \file
/// Progress of long work, on standard error, for people who watch a terminal.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace wheelwright::app {

/// "  40 %  identifying (12 s, about 18 s left)": `seconds` have passed at the share [0, 1] of the work. What is left
/// is told from a twentieth of the work and 2 s on: seconds·(1 − share)/share.
[[nodiscard]] std::string progress_line(std::string_view stage, double share, double seconds);

/// One line that is rewritten, without colours; nothing where standard error is no terminal that can rewrite a line
/// (TERM=dumb), or `quiet` is set. The first line appears after half a second: short work stays silent.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Tells that `stage` began, at the share [0, 1] of the work. At most ten lines a second are written.
  void tell(std::string_view stage, double share);

 private:
  bool shown_ = false;
  bool active_;
  std::string stage_;
  double last_ = 0.0;  // s
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace wheelwright::app
