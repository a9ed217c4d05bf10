// SPDX-License-Identifier: Apache-2.0
/// \file
/// Argument checks, written so that NaN fails.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "core/error.hpp"

namespace wheelwright::core::check {

/// Throws InvalidArgument "`what`: expected `expected`" unless `condition` holds.
inline void that(bool condition, std::string_view what, std::string_view expected) {
  if (!condition) {
    throw InvalidArgument(std::string(what) + ": expected " + std::string(expected));
  }
}

/// Throws InvalidArgument unless `value` is finite; returns it.
inline double finite(double value, std::string_view what) {
  if (!std::isfinite(value)) {
    throw InvalidArgument(std::string(what) + " is " + std::to_string(value) + ": expected a finite number");
  }
  return value;
}

/// Throws InvalidArgument unless `value` is finite and > 0; returns it.
inline double positive(double value, std::string_view what) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw InvalidArgument(std::string(what) + " is " + std::to_string(value) + ": expected a number > 0");
  }
  return value;
}

/// Throws InvalidArgument unless `value` is finite and >= 0; returns it.
inline double non_negative(double value, std::string_view what) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw InvalidArgument(std::string(what) + " is " + std::to_string(value) + ": expected a number >= 0");
  }
  return value;
}

}  // namespace wheelwright::core::check

namespace wheelwright {
namespace check = core::check;
}  // namespace wheelwright
