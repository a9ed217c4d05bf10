// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/ros_path.hpp>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/suggest.hpp>
#include <wheelwright/logs/ros_extractor.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t most_paths = 10'000;

std::vector<std::string> field_names(const RosMessage& message) {
  std::vector<std::string> names;
  for (const RosField& field : message.fields) {
    names.push_back(field.name);
  }
  return names;
}

/// Reads a path from the left.
struct PathReader {
  const RosDefinition& definition;
  const std::string& whole;
  std::string_view rest = whole;
  ros::Path path{};
  std::vector<std::size_t> messages{};  ///< in which the steps are

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}: {}", definition.name(), shown(whole), what));
  }

  std::size_t take_field(const RosMessage& message) {
    const std::size_t end = std::min(rest.find_first_of(".["), rest.size());
    const std::string_view name = rest.substr(0, end);
    rest.remove_prefix(end);
    const auto found = std::find_if(message.fields.begin(), message.fields.end(),
                                    [&](const RosField& field) { return field.name == name; });
    if (found == message.fields.end()) {
      const auto names = field_names(message);
      fail(fmt::format("{} has no field {}{}{}", message.name, shown(name), did_you_mean(name, names),
                       nearest_name(name, names).empty() ? "; it has " + listed(names) : ""));
    }
    return static_cast<std::size_t>(found - message.fields.begin());
  }

  void take_element(const RosField& field, ros::PathStep& step) {
    const bool given = rest.starts_with('[');
    if (field.shape == RosShape::single) {
      if (given) {
        fail(fmt::format("{} is no list", shown(field.name)));
      }
      return;
    }
    const std::string expected = fmt::format("{0}[0] or {0}[NAME]", field.name);
    const std::size_t end = rest.find(']');
    if (!given || end == std::string_view::npos || end < 2) {
      fail(fmt::format("{} is a list: expected an element of it as {}", shown(field.name), expected));
    }
    const std::string_view element = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
    std::uint32_t index = 0;
    const auto [last, error] = std::from_chars(element.data(), element.data() + element.size(), index);
    if (error == std::errc() && last == element.data() + element.size()) {
      if (field.count > 0 && index >= field.count) {
        fail(fmt::format("{} has at most {} elements, from [0] on", shown(field.name), field.count));
      }
      step.index = index;
      return;
    }
    step.element = std::string(element);
    for (std::size_t level = messages.size(); level-- > 0;) {
      const std::size_t place = level == path.size() ? step.field : path[level].field;
      if (ros::names_of(definition.messages[messages[level]], place)) {
        return;
      }
    }
    fail(
        fmt::format("no field name, names, joint_names or interface_names of strings says which element of {} that is: "
                    "expected its index, as {}[0]",
                    shown(field.name), field.name));
  }

  ros::Path read() {
    std::size_t message = 0;
    while (true) {
      messages.push_back(message);
      const RosMessage& in = definition.messages[message];
      ros::PathStep step{take_field(in), {}, {}};
      const RosField& field = in.fields[step.field];
      take_element(field, step);
      path.push_back(std::move(step));
      if (rest.empty()) {
        demand_number(field);
        return std::move(path);
      }
      if (rest.front() != '.') {
        fail("expected '.' or the end behind ']'");
      }
      if (field.kind != RosKind::message) {
        fail(fmt::format("{} has no fields", shown(field.name)));
      }
      rest.remove_prefix(1);
      message = field.message;
    }
  }

  void demand_number(const RosField& field) const {
    if (field.kind == RosKind::string || field.kind == RosKind::wstring) {
      fail("is text: expected a number");
    }
    if (field.kind == RosKind::message) {
      const RosMessage& inner = definition.messages[field.message];
      fail(fmt::format("is a {}: expected one of its numbers, such as {}.{}", inner.name, whole,
                       inner.fields.front().name));
    }
  }
};

void add_paths(const RosDefinition& definition, std::size_t message, const std::string& before,
               std::vector<std::string>& paths) {
  for (const RosField& field : definition.messages[message].fields) {
    if (paths.size() >= most_paths) {
      return;
    }
    const std::string path = before + field.name + (field.shape == RosShape::single ? "" : "[]");
    if (field.kind == RosKind::message) {
      add_paths(definition, field.message, path + ".", paths);
    } else if (field.kind != RosKind::string && field.kind != RosKind::wstring) {
      paths.push_back(path);
    }
  }
}

}  // namespace

ros::Path ros::find_path(const RosDefinition& definition, const std::string& path) {
  return PathReader{definition, path}.read();
}

std::optional<std::size_t> ros::names_of(const RosMessage& message, std::size_t list) {
  const auto texts = [&](std::string_view name) -> std::optional<std::size_t> {
    const auto found = std::find_if(message.fields.begin(), message.fields.end(), [&](const RosField& field) {
      return field.name == name && field.kind == RosKind::string && field.shape != RosShape::single;
    });
    return found == message.fields.end() ? std::nullopt
                                         : std::optional(static_cast<std::size_t>(found - message.fields.begin()));
  };
  if (list < message.fields.size() && message.fields[list].name.starts_with("multi_dof_")) {
    if (const auto found = texts("multi_dof_joint_names")) {
      return found;
    }
  }
  for (const std::string_view name : {"name", "names", "joint_names", "interface_names"}) {
    if (const auto found = texts(name)) {
      return found;
    }
  }
  return std::nullopt;
}

std::vector<std::string> numeric_paths(const RosDefinition& definition) {
  std::vector<std::string> paths;
  add_paths(definition, 0, "", paths);
  return paths;
}

}  // namespace wheelwright
