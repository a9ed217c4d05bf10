// SPDX-License-Identifier: Apache-2.0
/// \file
/// Paths to the numbers of a ROS 2 message, and the plan by which its bytes are walked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/logs/ros_definition.hpp>

namespace wheelwright::logs::ros {

/// One field of a path, and which of its elements.
struct PathStep {
  std::size_t field = 0;               ///< place among the fields of its message
  std::optional<std::uint32_t> index;  ///< of the element
  std::string element;                 ///< or its name, where the path has one; empty for a field that is no list

  bool operator==(const PathStep&) const = default;
};

/// From the message to the number.
using Path = std::vector<PathStep>;

/// Finds `path` in `definition`. Throws InputError "topic type: path: …", with the nearest name, unless it leads to a
/// number (bool, integer or floating-point) and has an index or a name for every list, and only for lists.
[[nodiscard]] Path find_path(const RosDefinition& definition, const std::string& path);

/// The field of strings that names the elements of `list` (both places among the fields of `message`):
/// "multi_dof_joint_names" for a field "multi_dof_…", else "name", "names", "joint_names" or "interface_names"; nothing
/// where there is none.
[[nodiscard]] std::optional<std::size_t> names_of(const RosMessage& message, std::size_t list);

/// Bytes of a number; 0 for strings and messages.
[[nodiscard]] std::size_t size_of(RosKind kind);

/// Wanted element of a list, and its use.
struct WantedElement {
  bool named = false;
  std::size_t element = 0;  ///< its index; named: place of its name in MessagePlan::names
  std::size_t target = 0;   ///< slot of the value; for a list of messages: the block that reads the element
};

/// One step.
struct Step {
  enum class Code : std::uint8_t {
    skip,      ///< `bytes` bytes, aligned to `align`
    value,     ///< a number of `kind` into the slots of `selections`
    text,      ///< a string
    numbers,   ///< a list of numbers of `kind`, of which `selections` are wanted
    texts,     ///< a list of strings; `selections` are names to be found in it (element: place in MessagePlan::names)
    messages,  ///< a list of messages, each read by block `target` or by that of its selection
    unknown    ///< from here on the bytes cannot be understood
  };

  Code code = Code::skip;
  RosKind kind = RosKind::uint8;
  bool counted = false;  ///< the message says how many elements there are; otherwise `count`
  std::uint8_t align = 1;
  std::uint32_t count = 0;  ///< elements of an array; most of a sequence, 0 without a bound
  std::uint64_t bytes = 0;
  std::size_t target = 0;
  std::size_t first = 0, last = 0;  ///< selections [first, last)
  const RosField* field = nullptr;  ///< for messages to people
};

/// Steps that are walked in turn. Single messages are part of what they are in.
using Block = std::vector<Step>;

/// Plan for the bytes of a message.
struct MessagePlan {
  std::vector<Block> blocks;  ///< [0] is the message's
  std::vector<WantedElement> selections;
  std::vector<std::string> names;  ///< names of elements that are looked for
  bool twice = false;              ///< some names come behind the list whose elements they name
};

/// Makes the plan that puts the number at paths[i] into slot i. `definition` must outlive it. Throws InputError for a
/// path behind a wstring, and for a definition of more than 100 000 steps.
[[nodiscard]] MessagePlan make_plan(const RosDefinition& definition, const std::vector<Path>& paths);

}  // namespace wheelwright::logs::ros
