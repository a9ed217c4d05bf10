// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include <cstdio>

#include <unistd.h>

#include <fmt/format.h>

namespace wheelwright::app {

Progress::Progress(bool quiet) : active_(!quiet && isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
  }
}

void Progress::tell(std::string_view stage, double share) {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  if (!active_ || seconds < 0.5) {
    return;
  }
  shown_ = true;
  fmt::print(stderr, "\r\033[K{:3.0f} %  {} ({:.0f} s)", 100.0 * share, stage, seconds);
  std::fflush(stderr);
}

}  // namespace wheelwright::app
