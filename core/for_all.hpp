// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parallel loop over independent iterations, and two tasks side by side, on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

namespace wheelwright::core {

/// Calls work(i) once for every i < `count`, on at most `threads` threads, the calling one among them, which also tells
/// `done` (may be empty) how many turns have begun. The first exception is thrown again when all threads have stopped;
/// turns that had not begun are then left out.
template <typename Work>
void for_all(std::size_t count, std::size_t threads, const Work& work,
             const std::function<void(std::size_t)>& done = {}) {
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::atomic<bool> failed = false;
  const auto run = [&](bool tells) {
    for (std::size_t i = next++; i < count && !failed; i = next++) {
      try {
        work(i);
        if (tells && done) {
          done(std::min(next.load(), count));
        }
      } catch (...) {
        if (!failed.exchange(true)) {
          failure = std::current_exception();
        }
      }
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t k = 1; k < std::min(threads, count); ++k) {
      helpers.emplace_back([&run] { run(false); });
    }
    run(true);
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

/// Calls first() on this thread and second() beside it on another one where `threads` > 1, else one after the other.
/// What first() throws is thrown again when both have ended; what second() throws, where first() threw nothing.
template <typename First, typename Second>
void both(std::size_t threads, const First& first, const Second& second) {
  if (threads < 2) {
    first();
    second();
    return;
  }
  std::exception_ptr failure;
  {
    const std::jthread helper([&] {
      try {
        second();
      } catch (...) {
        failure = std::current_exception();
      }
    });
    first();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace wheelwright::core
