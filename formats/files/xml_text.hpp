// SPDX-License-Identifier: Apache-2.0
/// \file
/// XML as text that is edited in place: every element and attribute knows its bytes, and what is not edited stays byte
/// for byte as it was.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/files/place.hpp"

namespace wheelwright::files {

/// An XML document that is edited. Elements are numbered in the order of the text, the root is 0; new ones follow.
class XmlText {
 public:
  /// Number of an element.
  using Id = std::size_t;

  /// Reads `text`; `file` is for messages. Throws InputError as XmlPlace::parse does.
  static XmlText parse(std::string text, std::string file);

  /// Name of the element.
  [[nodiscard]] const std::string& name(Id element) const { return elements_[element].name; }
  /// The element that holds it; the root is held by itself.
  [[nodiscard]] Id parent(Id element) const { return elements_[element].parent; }
  /// The elements inside, in the order of the text, new ones last: all, or those called `wanted`.
  [[nodiscard]] std::vector<Id> children(Id element, std::string_view wanted = {}) const;
  /// The first element called `wanted` inside; nothing where there is none.
  [[nodiscard]] std::optional<Id> child(Id element, std::string_view wanted) const;
  /// The attribute `wanted` as it is edited, its entities replaced; nothing where it is not there.
  [[nodiscard]] std::optional<std::string> attribute(Id element, std::string_view wanted) const;
  /// The text inside as it is edited, without the blanks around it; empty for an element that holds elements.
  [[nodiscard]] std::string text(Id element) const;
  /// "robot.xml:12" and "joint 'left'", as XmlPlace::place() has them; a new element stands where its parent does.
  [[nodiscard]] FilePlace place(Id element) const;

  /// Sets an attribute: its value alone is replaced, or it is put behind the last one. `value` holds none of <&".
  void set_attribute(Id element, const std::string& wanted, const std::string& value);
  /// Replaces the text inside of an element that holds no elements, the blanks around it apart.
  void set_text(Id element, const std::string& value);
  /// A new element, without attributes, behind the last one inside `element`, indented as that one is.
  Id add_child(Id element, const std::string& name);
  /// The first element called `name` inside, or a new one.
  Id child_or_new(Id element, const std::string& name);

  /// The text with all edits.
  [[nodiscard]] std::string edited() const;

 private:
  struct Range {
    std::size_t begin = 0, end = 0;
  };
  struct Attribute {
    std::string name;
    Range value;
  };
  struct Element {
    std::string name;
    Id parent = 0;
    bool fresh = false;
    std::size_t line = 0;
    std::size_t begin = 0;        // of its '<'
    std::size_t insert_at = 0;    // behind its last attribute, or its name
    std::size_t open_end = 0;     // behind the '>' of its start tag
    std::size_t close_begin = 0;  // of its end tag; open_end for <a/>
    std::size_t end = 0;          // behind it
    bool closed_at_once = false;  // <a/>
    std::vector<Attribute> attributes;
    std::vector<std::pair<std::string, std::string>> new_attributes;
    std::optional<std::string> new_text;
    std::vector<Id> children;
  };

  void scan();
  [[noreturn]] void fail(std::size_t at, const std::string& what) const;
  [[nodiscard]] std::string_view between(Range range) const {
    return std::string_view(text_).substr(range.begin, range.end - range.begin);
  }
  [[nodiscard]] Range text_range(const Element& element) const;
  [[nodiscard]] std::string indent_of(std::size_t at) const;
  [[nodiscard]] std::string written(Id fresh, const std::string& indent) const;

  std::string text_;
  std::string file_;
  std::string line_end_ = "\n";
  std::vector<Element> elements_;
  std::map<std::size_t, std::pair<std::size_t, std::string>> replaced_;  // begin -> end, new text
};

}  // namespace wheelwright::files
