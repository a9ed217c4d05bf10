// SPDX-License-Identifier: Apache-2.0
/// \file
/// Where in a file something stands.
#pragma once

#include <string>
#include <string_view>

#include <wheelwright/core/error.hpp>

namespace wheelwright {

/// A place in a file, for messages and for comments that say where a value came from.
struct FilePlace {
  std::string where;    ///< "robot.urdf:12"
  std::string element;  ///< "<mass> of link 'base'"

  /// "robot.urdf:12: <mass> of link 'base'"; the element alone where there is no file.
  [[nodiscard]] std::string text() const { return where.empty() ? element : where + ": " + element; }
  /// Throws InputError "robot.urdf:12: <mass> of link 'base': `message`".
  [[noreturn]] void fail(std::string_view message) const { throw InputError(text() + ": " + std::string(message)); }
};

/// A number and where it came from.
struct OriginNumber {
  double value = 0.0;
  FilePlace place;
};

}  // namespace wheelwright
