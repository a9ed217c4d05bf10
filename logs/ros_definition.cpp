// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/ros_definition.hpp>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/byte_source.hpp>
#include <wheelwright/logs/ros_message_text.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t longest_definition = std::size_t{1} << 20;
constexpr std::size_t most_entries = 1'000'000;

constexpr std::array<std::string_view, 13> type_words = {"bool",    "int8",   "uint8",  "int16",  "uint16",
                                                         "int32",   "uint32", "int64",  "uint64", "float32",
                                                         "float64", "string", "wstring"};

/// "pkg/Type", as fields name it.
std::string short_name(const std::string& name) {
  const std::size_t middle = name.find("/msg/");
  return middle == std::string::npos ? name : name.substr(0, middle) + name.substr(middle + 4);
}

}  // namespace

std::string full_ros_name(std::string_view type_name) {
  const std::size_t slash = type_name.find('/');
  if (slash == std::string_view::npos || type_name.find('/', slash + 1) != std::string_view::npos) {
    return std::string(type_name);
  }
  return fmt::format("{}/msg/{}", type_name.substr(0, slash), type_name.substr(slash + 1));
}

RosDefinition parse_ros_definition(std::string type_name, std::string_view text) {
  type_name = full_ros_name(type_name);
  if (type_name.find('/') == std::string::npos) {
    throw InputError(type_name + ": expected the name of a type as \"pkg/msg/Type\"");
  }
  RosDefinition definition =
      ros::assemble(type_name, ros::read_messages(type_name, text, type_name), ros::bundled_message);
  definition.origin = "the text of its definition";
  return definition;
}

std::string ros_definition_text(const RosDefinition& definition) {
  std::string text;
  for (const RosMessage& message : definition.messages) {
    if (&message != &definition.messages.front()) {
      text += fmt::format("{:=<80}\nMSG: {}\n", "", short_name(message.name));
    }
    for (const RosField& field : message.fields) {
      if (field.name == "structure_needs_at_least_one_member") {
        continue;
      }
      text += field.kind == RosKind::message ? short_name(definition.messages[field.message].name)
                                             : std::string(type_words[static_cast<std::size_t>(field.kind)]);
      if (field.longest > 0) {
        text += fmt::format("<={}", field.longest);
      }
      if (field.shape == RosShape::array) {
        text += fmt::format("[{}]", field.count);
      } else if (field.shape == RosShape::sequence) {
        text += field.count > 0 ? fmt::format("[<={}]", field.count) : "[]";
      }
      text += " " + field.name + "\n";
    }
  }
  return text;
}

std::optional<RosDefinition> RosDefinitions::find(const std::string& type_name) const {
  const std::string root = full_ros_name(type_name);
  if (!files_.contains(root)) {
    return std::nullopt;
  }
  ros::TextMessages read;
  const auto more = [&](const std::string& name) -> const ros::TextMessage* {
    const auto known = read.find(name);
    if (known != read.end()) {
      return &known->second;
    }
    const auto file = files_.find(name);
    if (file == files_.end()) {
      return ros::bundled_message(name);
    }
    const std::string source = file->second.string();
    const std::string text =
        std::filesystem::is_empty(file->second) ? "" : read_bytes(file->second, longest_definition);
    auto messages = ros::read_messages(name, text, source);
    return &read.emplace(name, std::move(messages[name])).first->second;
  };
  RosDefinition definition = ros::assemble(root, {}, more);
  definition.origin = files_.at(root).string();
  return definition;
}

std::vector<std::string> RosDefinitions::names() const {
  std::vector<std::string> all;
  for (const auto& [name, file] : files_) {
    all.push_back(name);
  }
  return all;
}

RosDefinitions ros_definitions_from(const std::filesystem::path& directory) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::is_directory(directory, error)) {
    throw InputError(directory.string() + ": is no directory: expected one with PKG/msg/TYPE.msg below it");
  }
  RosDefinitions definitions;
  std::size_t entries = 0;
  const fs::path whole = fs::absolute(directory).lexically_normal();
  for (fs::recursive_directory_iterator at(whole, fs::directory_options::skip_permission_denied, error), end;
       !error && at != end && entries < most_entries; at.increment(error), ++entries) {
    const fs::path& file = at->path();
    if (file.extension() != ".msg" || file.parent_path().filename() != "msg") {
      continue;
    }
    const std::string name =
        fmt::format("{}/msg/{}", file.parent_path().parent_path().filename().string(), file.stem().string());
    const auto [place, added] = definitions.files_.try_emplace(name, file);
    if (!added && file < place->second) {
      place->second = file;
    }
  }
  if (error) {
    throw InputError(fmt::format("{}: cannot be read ({}): expected a directory with definitions", directory.string(),
                                 error.message()));
  }
  if (definitions.files_.empty()) {
    throw InputError(directory.string() + ": no message definition found: expected PKG/msg/TYPE.msg below it");
  }
  return definitions;
}

}  // namespace wheelwright
