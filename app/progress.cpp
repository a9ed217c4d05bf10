// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <unistd.h>

#include <fmt/format.h>

namespace wheelwright::app {
namespace {

constexpr double first_line = 0.5;      // s
constexpr double between_lines = 0.1;   // s
constexpr double earliest_guess = 2.0;  // s
constexpr double least_share = 0.05;

bool rewrites_lines() {
  const char* const terminal = std::getenv("TERM");
  return isatty(STDERR_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

std::string duration(double seconds) {
  const double whole = std::round(seconds);
  if (whole < 60.0) {
    return fmt::format("{:.0f} s", whole);
  }
  const double minutes = std::round(seconds / 60.0);
  return minutes < 60.0 ? fmt::format("{:.0f} min", minutes)
                        : fmt::format("{:.0f} h {:.0f} min", std::floor(minutes / 60.0), std::fmod(minutes, 60.0));
}

}  // namespace

std::string progress_line(std::string_view stage, double share, double seconds) {
  const double done = std::clamp(share, 0.0, 1.0);
  std::string left;
  if (done >= least_share && done < 1.0 && seconds >= earliest_guess) {
    left = fmt::format(", about {} left", duration(seconds * (1.0 - done) / done));
  }
  return fmt::format("{:3.0f} %  {} ({}{})", 100.0 * done, stage, duration(seconds), left);
}

Progress::Progress(bool quiet) : active_(!quiet && rewrites_lines()) {}

Progress::~Progress() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
  }
}

void Progress::tell(std::string_view stage, double share) {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  if (!active_ || seconds < first_line || (stage == stage_ && seconds < last_ + between_lines)) {
    return;
  }
  shown_ = true;
  stage_ = stage;
  last_ = seconds;
  fmt::print(stderr, "\r\033[K{}", progress_line(stage, share, seconds));
  std::fflush(stderr);
}

}  // namespace wheelwright::app
