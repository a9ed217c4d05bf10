// SPDX-License-Identifier: Apache-2.0
/// \file
/// Numbers out of messages in CDR, by their paths.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/ros_definition.hpp>

namespace wheelwright {

/// Reads some numbers of every message of one type.
///
/// Paths are fields joined by dots. An element of a list is an index, "velocity[0]", or a name, "velocity[right_wheel]":
/// the element whose place in the list of strings `name`, `names`, `joint_names` or `interface_names` of the same message,
/// or else of one around it, has that text (the first such place).
///
/// A message is CDR as ROS 2 writes it: 4 bytes that say the byte order, then the fields, each aligned to its own size
/// relative to what follows those 4 bytes (DDSI-RTPS 2.3, section 10; XCDR version 1). The definition becomes a plan once;
/// reading walks along it and allocates nothing. (Fast-CDR would decode into objects, strings included, and report damage
/// by exceptions; messages are written with it.)
class RosExtractor {
 public:
  /// Throws InputError, naming type and path, with the nearest name, for a path that is not there or no number, and for
  /// one behind a wstring, whose bytes differ between implementations.
  RosExtractor(const RosDefinition& definition, const std::vector<std::string>& paths);
  ~RosExtractor();
  RosExtractor(RosExtractor&&) noexcept;
  RosExtractor& operator=(RosExtractor&&) noexcept;

  /// Puts the number at each path into `values` (as many as paths), bool as 0 or 1; NaN for an element that this message
  /// does not have. False where the bytes are no message of the type: cut off, longer by 4 bytes or more, a list beyond
  /// its end or its bound, a string that does not end; error() then says what and where, and all values are NaN. Never
  /// throws for what the bytes are; throws InvalidArgument when `values` has another length.
  bool read(std::string_view cdr, std::span<double> values);

  /// `header.stamp` (or else a `stamp`) of the last message, ns; nothing where the type has none, it is zero, or the
  /// message could not be read.
  [[nodiscard]] std::optional<std::int64_t> stamp() const;

  /// Why the last read() was false; empty when it was true.
  [[nodiscard]] const std::string& error() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Every number that a message may have, in the order of the definition, at most 10 000; lists with "[]", as
/// "poses[].pose.position.x".
[[nodiscard]] std::vector<std::string> numeric_paths(const RosDefinition& definition);

/// The list of strings `name`, `names`, `joint_names` or `interface_names` of a message; nothing where the type has none
/// or the message cannot be read.
[[nodiscard]] std::optional<std::vector<std::string>> read_names(const RosDefinition& definition, std::string_view cdr);

}  // namespace wheelwright
