// SPDX-License-Identifier: Apache-2.0
/// \file
/// Messages of ROS 2: definitions of their types and the language of .msg files; paths to their numbers, and the plan
/// by which a walk along their bytes (CDR) extracts these.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace wheelwright::logs {

/// Type of an element of a field. `byte` and `char` of the language are `uint8`, as they are in a message's bytes.
enum class RosKind : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  wstring,
  message
};

/// Shape of a field, the number of its elements: one, a number that the definition fixes, or one that each message
/// says.
enum class RosShape : std::uint8_t { single, array, sequence };

/// A field of a message.
struct RosField {
  std::string name;
  RosKind kind = RosKind::uint8;
  RosShape shape = RosShape::single;
  std::uint32_t count = 0;    ///< elements of an array (> 0); most elements of a sequence, 0 where it has no bound
  std::uint32_t longest = 0;  ///< most characters of a string; 0 where it has no bound
  std::size_t message = 0;    ///< of kind `message`: its place in RosDefinition::messages

  bool operator==(const RosField&) const = default;
};

/// The fields of one type in their order. A type without fields has one that is named
/// "structure_needs_at_least_one_member" (uint8), as it has in a message's bytes.
struct RosMessage {
  std::string name;  ///< "pkg/msg/Type"
  std::vector<RosField> fields;

  bool operator==(const RosMessage&) const = default;
};

/// A type with everything that it depends on; no type contains itself, and nesting is at most `deepest`.
struct RosDefinition {
  std::vector<RosMessage> messages;  ///< the type itself is [0]
  std::string origin;                ///< where it comes from, for messages: "the recording", a file, "bundled (Humble)"

  static constexpr std::size_t deepest = 32;

  [[nodiscard]] const std::string& name() const { return messages.front().name; }
};

/// "pkg/msg/Type" of "pkg/msg/Type" or "pkg/Type"; other texts as they are.
[[nodiscard]] std::string full_ros_name(std::string_view type_name);

/// Reads a definition in the language of .msg files, followed by those of the types it uses, each behind a line of "="
/// and a line "MSG: pkg/Type" (MCAP's encoding "ros2msg"; REP 2016 does not change it). Constants and default values
/// are skipped. A type that is used and not there is taken from the bundled ones. Throws InputError
/// "`type_name`: line 7: 'text': expected …" for what is no definition, for types that are not known and for types that
/// contain themselves; for a text of more than 1 MiB and a name of more than 255 characters.
[[nodiscard]] RosDefinition parse_ros_definition(std::string type_name, std::string_view text);

/// The definition as parse_ros_definition reads it: without comments, constants and default values.
[[nodiscard]] std::string ros_definition_text(const RosDefinition& definition);

/// The bundled definition of a type (std_msgs, builtin_interfaces, geometry_msgs, sensor_msgs without images and
/// clouds, nav_msgs, tf2_msgs, trajectory_msgs, control_msgs, diagnostic_msgs, rosgraph_msgs); nothing where there is
/// none. It is the form of Humble: see bundled_ros_forms().
[[nodiscard]] std::optional<RosDefinition> bundled_ros_definition(const std::string& type_name);

/// Every form of a bundled type that a distribution from Foxy to Jazzy has, that of Humble first. Only
/// sensor_msgs/msg/Range (a variance since Jazzy) and control_msgs/msg/JointTrajectoryControllerState have several.
[[nodiscard]] std::vector<RosDefinition> bundled_ros_forms(const std::string& type_name);

/// Definitions of a directory: every PKG/msg/TYPE.msg below it.
class RosDefinitions {
 public:
  /// The definition of a type; nothing where the directory has none. What it uses is taken from the directory, else
  /// from the bundled ones. Throws InputError as parse_ros_definition does, naming the file.
  [[nodiscard]] std::optional<RosDefinition> find(const std::string& type_name) const;

 private:
  friend RosDefinitions ros_definitions_from(const std::filesystem::path& directory);
  std::map<std::string, std::filesystem::path> files_;
};

/// Looks for definitions below `directory` (a workspace, an installation's share/, a package, or its msg/). Where a
/// type is there twice, the first path in alphabetical order is taken. Throws InputError, naming it, when it is no
/// directory that can be read, or has no definition.
[[nodiscard]] RosDefinitions ros_definitions_from(const std::filesystem::path& directory);

}  // namespace wheelwright::logs

namespace wheelwright::logs::ros {

/// A field whose type, where it is a message, is still a name.
struct TextField {
  RosField field;
  std::string type;      ///< "pkg/msg/Type" of a message; empty otherwise
  std::size_t line = 0;  ///< in its text, from 1
  std::string text;      ///< of that line
};

/// A type as its text says it.
struct TextMessage {
  std::string source;  ///< what error messages name
  std::vector<TextField> fields;
};

/// Types by "pkg/msg/Type".
using TextMessages = std::map<std::string, TextMessage>;

/// Reads `text`, which defines `type_name` ("pkg/msg/Type"), and what follows it behind separators. Parts in IDL are
/// left out. Throws InputError "`source`: line 7: …".
[[nodiscard]] TextMessages read_messages(const std::string& type_name, std::string_view text,
                                         const std::string& source);

/// Puts `type_name` and all that it depends on together. What is not in `known` is asked of `more`, which returns
/// nullptr for what it does not have. Throws InputError for a type that neither has, cycles and nesting that is too
/// deep.
[[nodiscard]] RosDefinition assemble(const std::string& type_name, const TextMessages& known,
                                     const std::function<const TextMessage*(const std::string&)>& more);

/// A bundled type in the form of Humble; nullptr where there is none.
[[nodiscard]] const TextMessage* bundled_message(const std::string& type_name);

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

/// Numbers that a message may have, in the order of the definition, the first `most`; lists with "[]", as
/// "poses[].pose.position.x".
[[nodiscard]] std::vector<std::string> numeric_paths(const RosDefinition& definition, std::size_t most = 10'000);

/// The list of strings `name`, `names`, `joint_names` or `interface_names` of a message; nothing where the type has
/// none or the message cannot be read.
[[nodiscard]] std::optional<std::vector<std::string>> read_names(const RosDefinition& definition, std::string_view cdr);

}  // namespace wheelwright::logs
