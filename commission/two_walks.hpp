// SPDX-License-Identifier: Apache-2.0
/// \file
/// Two walks of one log side by side.
#pragma once

#include <cstddef>
#include <memory>

#include "core/for_all.hpp"
#include "core/log.hpp"

namespace wheelwright::commission {

/// core::both() of first(log) and second(a walk over the same rows): beside each other where `threads` > 1 and `log`
/// can be walked twice at once, else second(log) after first(log).
template <typename First, typename Second>
void two_walks(LogSource& log, std::size_t threads, const First& first, const Second& second) {
  const std::unique_ptr<LogSource> other = threads > 1 ? log.another_walk() : nullptr;
  core::both(
      other ? threads : 1, [&] { first(log); }, [&] { second(other ? *other : log); });
}

}  // namespace wheelwright::commission
