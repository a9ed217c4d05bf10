// SPDX-License-Identifier: Apache-2.0
/// \file
/// The language of .msg files, and how types that name each other become one definition.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/ros_definition.hpp>

namespace wheelwright::ros {

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

/// Reads `text`, which defines `type_name` ("pkg/msg/Type"), and what follows it behind separators. Parts in IDL are left
/// out. Throws InputError "`source`: line 7: …".
[[nodiscard]] TextMessages read_messages(const std::string& type_name, std::string_view text,
                                         const std::string& source);

/// Puts `type_name` and all that it depends on together. What is not in `known` is asked of `more`, which returns nullptr
/// for what it does not have. Throws InputError for a type that neither has, cycles and nesting that is too deep.
[[nodiscard]] RosDefinition assemble(const std::string& type_name, const TextMessages& known,
                                     const std::function<const TextMessage*(const std::string&)>& more);

/// A bundled type in the form of Humble; nullptr where there is none.
[[nodiscard]] const TextMessage* bundled_message(const std::string& type_name);

}  // namespace wheelwright::ros
