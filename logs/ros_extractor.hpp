// SPDX-License-Identifier: Apache-2.0
/// \file
/// Extraction of numbers from messages in CDR by their paths: a walk along the bytes of a message by its plan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/ros_definition.hpp>
#include <wheelwright/logs/ros_plan.hpp>

namespace wheelwright::logs::ros {

/// The place of a name that was not found.
inline constexpr std::size_t nowhere = ~std::size_t{0};

/// Targets of a walk.
struct WalkTargets {
  std::span<double> values{};                   ///< slots 0, 1, …
  std::span<double> more{};                     ///< slots behind those
  std::vector<std::string>* strings = nullptr;  ///< gets the strings of a list, where given
  std::size_t strings_step = 0;                 ///< the step of the plan's first block that walks along that list
};

/// Walks along `cdr` once (twice where the plan says so). Slots of what the message does not have stay as they were.
/// `places` has one element for each of the plan's names, and is where they were found afterwards. False, with the
/// reason in `error`, where the bytes are no message of `type`: see RosExtractor::read(). Never reads outside of `cdr`;
/// allocates nothing but `strings`, and `error` where it is set.
[[nodiscard]] bool walk(const MessagePlan& plan, const std::string& type, std::string_view cdr,
                        std::vector<std::size_t>& places, const WalkTargets& to, std::string& error);

}  // namespace wheelwright::logs::ros

namespace wheelwright::logs {

/// Reads some numbers of every message of one type.
///
/// Paths are fields joined by dots. An element of a list is an index, "velocity[0]", or a name,
/// "velocity[right_wheel]": the element whose place in the list of strings `name`, `names`, `joint_names` or
/// `interface_names` of the same message, or else of one around it, has that text (the first such place).
///
/// A message is CDR as ROS 2 writes it: 4 bytes that say the byte order, then the fields, each aligned to its own size
/// relative to what follows those 4 bytes (DDSI-RTPS 2.3, section 10; XCDR version 1). The definition becomes a plan
/// once; reading walks along it and allocates nothing. (Fast-CDR would decode into objects, strings included, and
/// report damage by exceptions; messages are written with it.)
class RosExtractor {
 public:
  /// Throws InputError, naming type and path, with the nearest name, for a path that is not there or no number, and for
  /// one behind a wstring, whose bytes differ between implementations.
  RosExtractor(const RosDefinition& definition, const std::vector<std::string>& paths);
  ~RosExtractor();
  RosExtractor(RosExtractor&&) noexcept;
  RosExtractor& operator=(RosExtractor&&) noexcept;

  /// Puts the number at each path into `values` (as many as paths), bool as 0 or 1; NaN for an element that this
  /// message does not have. False where the bytes are no message of the type: cut off, longer by 4 bytes or more, a
  /// list beyond its end or its bound, a string that does not end; error() then says what and where, and all values are
  /// NaN. Never throws for what the bytes are; throws InvalidArgument when `values` has another length.
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

/// The list of strings `name`, `names`, `joint_names` or `interface_names` of a message; nothing where the type has
/// none or the message cannot be read.
[[nodiscard]] std::optional<std::vector<std::string>> read_names(const RosDefinition& definition, std::string_view cdr);

}  // namespace wheelwright::logs
