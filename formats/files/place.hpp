// SPDX-License-Identifier: Apache-2.0
/// \file
/// Places in YAML files and elements of XML files that know their line and their key or parents: all readers of such
/// files use them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/error.hpp"

namespace wheelwright::files {

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

/// A node of a YAML document. What is of another kind than asked for throws InputError
/// "robot.yaml:4: wheel_radius: 'abc': expected a number > 0".
class YamlPlace {
 public:
  /// Parses `text`; `file` is for messages, and `lines` says whether they name lines. Throws InputError, naming file
  /// and line, when it is no YAML or holds no mapping.
  static YamlPlace parse(std::string_view text, std::string file, bool lines = true);

  /// Members of a mapping in the order of the file. Throws for a node that is none, for keys that are not plain names,
  /// for repeated keys, and for keys not in `known` (with the nearest that is).
  [[nodiscard]] std::vector<std::pair<std::string, YamlPlace>> members(const std::vector<std::string>& known) const;

  /// All members, whatever their keys; throws as members() does.
  [[nodiscard]] std::vector<std::pair<std::string, YamlPlace>> members() const;

  /// True if this is a mapping.
  [[nodiscard]] bool is_mapping() const;
  /// True if this is a single value (neither a list nor a mapping, nor nothing).
  [[nodiscard]] bool is_scalar() const;
  /// Elements of a list.
  [[nodiscard]] std::vector<YamlPlace> elements(std::string_view expected) const;
  /// A single value as text.
  [[nodiscard]] std::string text(std::string_view expected = "a name") const;
  /// Index of the word that this is among `words`.
  [[nodiscard]] std::size_t choice(const std::vector<std::string>& words) const;
  /// Throws unless this is `word`.
  void demand(const std::string& word) const;
  /// A finite number (not in quotes) for which `accepted` holds.
  [[nodiscard]] double number(std::string_view expected, const std::function<bool(double)>& accepted) const;
  /// A finite number.
  [[nodiscard]] double number() const;
  /// A number > 0.
  [[nodiscard]] double positive() const;
  /// A whole number from `least` to `most`, which is at most 2⁵³: whole numbers beyond it are not all doubles.
  [[nodiscard]] std::uint64_t whole(std::uint64_t least, std::uint64_t most) const;
  /// true or false.
  [[nodiscard]] bool boolean() const;

  /// "robot.yaml:4".
  [[nodiscard]] std::string where() const;
  /// Throws InputError "file:line: key: value: expected `expected`".
  [[noreturn]] void fail(std::string_view expected) const;
  /// Throws InputError "file:line: `message`".
  [[noreturn]] void say(std::string_view message) const;

 private:
  struct Node;
  YamlPlace(std::shared_ptr<const Node> node, std::string key);
  [[nodiscard]] std::vector<std::pair<std::string, YamlPlace>> members_of(const std::vector<std::string>* known) const;

  std::shared_ptr<const Node> node_;
  std::string key_;
};

/// An element of an XML document. What is not as asked for throws InputError
/// "robot.urdf:12: <mass> of link 'base': value '-3': expected a number > 0".
class XmlPlace {
 public:
  /// Parses `text` and gives its root element; `file` is for messages. Throws InputError, naming file and line, when it
  /// is no XML, holds more than one root element, an element with more than 1,000 attributes, or an <xacro:...> that
  /// should have been expanded.
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
