// SPDX-License-Identifier: Apache-2.0
/// \file
/// Definitions of ROS 2 message types and the language of .msg files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
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
/// contain themselves.
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

}  // namespace wheelwright::logs::ros
