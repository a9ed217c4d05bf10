// SPDX-License-Identifier: Apache-2.0
/// \file
/// Elements of an XML file that know their line and their parents; the reader of URDF uses them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/files/yaml_place.hpp>

namespace wheelwright::files {

/// An element of an XML document. What is not as asked for throws InputError
/// "robot.urdf:12: <mass> of link 'base': value '-3': expected a number > 0".
class XmlPlace {
 public:
  /// Parses `text` and gives its root element; `file` is for messages. Throws InputError, naming file and line, when it
  /// is no XML, holds more than one root element, or an <xacro:...> that should have been expanded.
  static XmlPlace parse(std::string_view text, const std::string& file);

  /// Name of the element.
  [[nodiscard]] std::string name() const;
  /// "robot.urdf:12" and "<mass> of link 'base'".
  [[nodiscard]] FilePlace place() const;

  /// The elements inside, in the order of the file: all, or those called `name`.
  [[nodiscard]] std::vector<XmlPlace> children(std::string_view name = {}) const;
  /// The element called `name` inside; nothing where there is none. Throws where there are several.
  [[nodiscard]] std::optional<XmlPlace> child(std::string_view name) const;
  /// The same; throws where there is none.
  [[nodiscard]] XmlPlace need(std::string_view name) const;

  /// The attribute `name`, if it is there.
  [[nodiscard]] std::optional<std::string> attribute(std::string_view name) const;
  /// The same; throws where there is none, or it is empty.
  [[nodiscard]] std::string need_attribute(std::string_view name) const;
  /// The text inside without the blanks around it.
  [[nodiscard]] std::string text() const;

  /// The attribute `name` as a finite number; throws where it is missing or none.
  [[nodiscard]] double number(std::string_view name) const;
  /// The text inside as a finite number.
  [[nodiscard]] double number() const;
  /// `count` finite numbers, apart by blanks: of the attribute `name`, or of the text inside where `name` is empty.
  [[nodiscard]] std::vector<double> numbers(std::string_view name, std::size_t count) const;
  /// Three of them.
  [[nodiscard]] Eigen::Vector3d vector(std::string_view name) const;

  /// Throws InputError "file:line: <element> of ...: `message`".
  [[noreturn]] void fail(std::string_view message) const { place().fail(message); }

 private:
  struct Node;
  explicit XmlPlace(std::shared_ptr<const Node> node);
  [[nodiscard]] XmlPlace with(const void* element) const;

  std::shared_ptr<const Node> node_;
};

}  // namespace wheelwright::files
