// SPDX-License-Identifier: Apache-2.0
#include "formats/files/xml_text.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::files {
namespace {

// What TinyXML-2 takes for white space.
constexpr std::string_view kBlanks = " \t\r\n\v\f";

bool is_blank(char c) { return kBlanks.find(c) != std::string_view::npos; }

// The five entities of XML and ASCII characters by number; any other stays as it stands.
std::string decoded(std::string_view text) {
  constexpr std::size_t kLongestEntity = 6;
  static const std::map<std::string_view, char> known = {
      {"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}};
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const std::string_view behind = text[k] == '&' ? text.substr(k + 1, kLongestEntity + 1) : std::string_view();
    const std::size_t length = behind.find(';'), end = k + 1 + length;
    const std::string_view entity = length == std::string_view::npos ? "" : behind.substr(0, length);
    if (const auto found = known.find(entity); found != known.end()) {
      out += found->second;
      k = end;
    } else if (entity.starts_with('#') && entity.size() < 6 && to_number(entity.substr(1)) &&
               *to_number(entity.substr(1)) >= 32.0 && *to_number(entity.substr(1)) < 127.0) {
      out += static_cast<char>(*to_number(entity.substr(1)));
      k = end;
    } else {
      out += text[k];
    }
  }
  return out;
}

}  // namespace

XmlText XmlText::parse(std::string text, std::string file) {
  static_cast<void>(XmlPlace::parse(text, file));
  XmlText out;
  out.text_ = std::move(text);
  out.file_ = std::move(file);
  if (const std::size_t first = out.text_.find('\n');
      first != std::string::npos && first > 0 && out.text_[first - 1] == '\r') {
    out.line_end_ = "\r\n";
  }
  out.scan();
  return out;
}

void XmlText::fail(std::size_t at, const std::string& what) const {
  const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  throw InputError(fmt::format("{}:{}: {}: expected XML", file_, line, what));
}

void XmlText::scan() {
  const std::string_view text = text_;
  std::vector<Id> open;
  std::size_t line = 1, counted = 0;
  // Behind `word`, which has to come.
  const auto behind = [&](std::string_view word, std::size_t from) {
    const std::size_t found = text.find(word, from);
    if (found == std::string_view::npos) {
      fail(from, fmt::format("no {} follows", word));
    }
    return found + word.size();
  };
  std::size_t at = text.find('<');
  while (at != std::string_view::npos) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<!--")) {
      at = behind("-->", at + 4);
    } else if (rest.starts_with("<![CDATA[")) {
      at = behind("]]>", at);
    } else if (rest.starts_with("<?")) {
      at = behind("?>", at);
    } else if (rest.starts_with("<!")) {
      at = behind(">", at);
    } else if (rest.starts_with("</")) {
      const std::size_t end = behind(">", at);
      const std::string_view name = text.substr(at + 2, text.find_first_of(" \t\r\n\v\f>", at + 2) - at - 2);
      if (open.empty() || elements_[open.back()].name != name) {
        fail(at, "an end tag without its start");
      }
      elements_[open.back()].close_begin = at;
      elements_[open.back()].end = end;
      open.pop_back();
      at = end;
    } else {
      line += static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(counted),
                                                  text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
      counted = at;
      Element element;
      element.line = line;
      element.begin = at;
      std::size_t k = std::min(text.find_first_of(" \t\r\n\v\f/>", at + 1), text.size());
      element.name = std::string(text.substr(at + 1, k - at - 1));
      element.insert_at = k;
      if (element.name.empty()) {
        fail(at, "an element without a name");
      }
      for (;;) {
        k = text.find_first_not_of(kBlanks, k);
        if (k == std::string_view::npos) {
          fail(at, "a start tag without an end");
        }
        if (text[k] == '>' || text[k] == '/') {
          break;
        }
        const std::size_t name_end = text.find_first_of(" \t\r\n\v\f=", k);
        const std::size_t equals =
            name_end == std::string_view::npos ? name_end : text.find_first_not_of(kBlanks, name_end);
        const std::size_t quote = equals == std::string_view::npos || text[equals] != '='
                                      ? std::string_view::npos
                                      : text.find_first_not_of(kBlanks, equals + 1);
        if (quote == std::string_view::npos || (text[quote] != '"' && text[quote] != '\'')) {
          fail(k, "an attribute without a value");
        }
        const std::size_t end = text.find(text[quote], quote + 1);
        if (end == std::string_view::npos) {
          fail(k, "a value without its end");
        }
        element.attributes.push_back({std::string(text.substr(k, name_end - k)), {quote + 1, end}});
        k = element.insert_at = end + 1;
      }
      element.closed_at_once = text[k] == '/';
      k += element.closed_at_once ? 1 : 0;
      if (k >= text.size() || text[k] != '>') {
        fail(at, "a start tag without an end");
      }
      element.open_end = element.close_begin = element.end = k + 1;
      const Id id = elements_.size();
      element.parent = open.empty() ? id : open.back();
      if (!open.empty()) {
        elements_[open.back()].children.push_back(id);
      } else if (id > 0) {
        fail(at, "a second root element");
      }
      if (!element.closed_at_once) {
        open.push_back(id);
      }
      elements_.push_back(std::move(element));
      at = k + 1;
    }
    at = text.find('<', at);
  }
  if (!open.empty() || elements_.empty()) {
    fail(text.size(), elements_.empty() ? "no element" : "an element without an end tag");
  }
}

std::vector<XmlText::Id> XmlText::children(Id element, std::string_view wanted) const {
  std::vector<Id> out;
  for (const Id id : elements_[element].children) {
    if (wanted.empty() || elements_[id].name == wanted) {
      out.push_back(id);
    }
  }
  return out;
}

std::optional<XmlText::Id> XmlText::child(Id element, std::string_view wanted) const {
  const std::vector<Id> all = children(element, wanted);
  return all.empty() ? std::nullopt : std::optional(all.front());
}

std::optional<std::string> XmlText::attribute(Id element, std::string_view wanted) const {
  const Element& e = elements_[element];
  for (const Attribute& a : e.attributes) {
    if (a.name == wanted) {
      const auto edit = replaced_.find(a.value.begin);
      return edit != replaced_.end() ? edit->second.second : decoded(between(a.value));
    }
  }
  const auto fresh = std::ranges::find(e.new_attributes, wanted, &std::pair<std::string, std::string>::first);
  return fresh == e.new_attributes.end() ? std::nullopt : std::optional(fresh->second);
}

XmlText::Range XmlText::text_range(const Element& element) const {
  Range range{element.open_end, element.close_begin};
  while (range.begin < range.end && is_blank(text_[range.begin])) {
    ++range.begin;
  }
  while (range.end > range.begin && is_blank(text_[range.end - 1])) {
    --range.end;
  }
  return range;
}

std::string XmlText::text(Id element) const {
  const Element& e = elements_[element];
  if (e.new_text) {
    return *e.new_text;
  }
  return !e.children.empty() || e.fresh ? std::string() : decoded(between(text_range(e)));
}

FilePlace XmlText::place(Id element) const {
  Id there = element;
  while (elements_[there].fresh) {
    there = elements_[there].parent;
  }
  FilePlace out{fmt::format("{}:{}", file_, elements_[there].line), {}};
  if (const auto named = attribute(element, "name")) {
    out.element = fmt::format("{} {}", name(element), shown(*named));
    return out;
  }
  out.element = fmt::format("<{}>", name(element));
  for (Id up = element; up != parent(up);) {
    up = parent(up);
    const auto named = attribute(up, "name");
    if (named && name(up) != "collision" && name(up) != "visual") {
      out.element += fmt::format(" of {} {}", name(up), shown(*named));
      break;
    }
  }
  return out;
}

void XmlText::set_attribute(Id element, const std::string& wanted, const std::string& value) {
  Element& e = elements_[element];
  for (const Attribute& a : e.attributes) {
    if (a.name == wanted) {
      replaced_[a.value.begin] = {a.value.end, value};
      return;
    }
  }
  const auto fresh = std::ranges::find(e.new_attributes, wanted, &std::pair<std::string, std::string>::first);
  if (fresh != e.new_attributes.end()) {
    fresh->second = value;
  } else {
    e.new_attributes.emplace_back(wanted, value);
  }
}

void XmlText::set_text(Id element, const std::string& value) { elements_[element].new_text = value; }

XmlText::Id XmlText::add_child(Id element, const std::string& name) {
  const Id id = elements_.size();
  Element fresh;
  fresh.name = name;
  fresh.parent = element;
  fresh.fresh = true;
  elements_.push_back(std::move(fresh));
  elements_[element].children.push_back(id);
  return id;
}

XmlText::Id XmlText::child_or_new(Id element, const std::string& name) {
  const auto found = child(element, name);
  return found ? *found : add_child(element, name);
}

std::string XmlText::indent_of(std::size_t at) const {
  const std::size_t line = at == 0 ? std::string::npos : text_.rfind('\n', at - 1);
  const std::size_t begin = line == std::string::npos ? 0 : line + 1;
  const std::size_t end = std::min(text_.find_first_not_of(" \t", begin), at);
  return text_.substr(begin, end - begin);
}

std::string XmlText::written(Id fresh, const std::string& indent) const {
  const Element& e = elements_[fresh];
  std::string out = "<" + e.name;
  for (const auto& [name, value] : e.new_attributes) {
    out += fmt::format(" {}=\"{}\"", name, value);
  }
  if (e.children.empty() && !e.new_text) {
    return out + "/>";
  }
  out += ">" + e.new_text.value_or("");
  for (const Id inside : e.children) {
    out += line_end_ + indent + "  " + written(inside, indent + "  ");
  }
  return out + (e.children.empty() ? "" : line_end_ + indent) + "</" + e.name + ">";
}

std::string XmlText::edited() const {
  // What is put in at one place is put there in the order in which it stands here; begin -> end, text.
  std::multimap<std::size_t, std::pair<std::size_t, std::string>> edits(replaced_.begin(), replaced_.end());
  for (const Element& e : elements_) {
    if (e.fresh) {
      continue;
    }
    for (const auto& [name, value] : e.new_attributes) {
      edits.emplace(e.insert_at, std::pair(e.insert_at, fmt::format(" {}=\"{}\"", name, value)));
    }
    std::string inside;
    std::size_t behind = e.open_end;
    std::optional<std::string> indent;  // looked for where it is needed: a line may hold the whole file
    const Element* beside = nullptr;
    for (const Id id : e.children) {
      if (!elements_[id].fresh) {
        behind = elements_[id].end;
        beside = &elements_[id];
        indent.reset();
      } else {
        if (!indent) {
          indent = beside != nullptr ? indent_of(beside->begin) : indent_of(e.begin) + "  ";
        }
        inside += line_end_ + *indent + written(id, *indent);
      }
    }
    if (e.closed_at_once && (!inside.empty() || e.new_text)) {
      inside = e.new_text.value_or("") + inside + (inside.empty() ? "" : line_end_ + indent_of(e.begin));
      edits.emplace(e.open_end - 2, std::pair(e.open_end, ">" + inside + "</" + e.name + ">"));
      continue;
    }
    if (e.new_text) {
      const Range range = text_range(e);
      edits.emplace(range.begin, std::pair(range.end, *e.new_text));
    }
    if (!inside.empty()) {
      const bool on_the_end_tags_line = behind == e.open_end && e.close_begin == e.open_end;
      edits.emplace(behind, std::pair(behind, inside + (on_the_end_tags_line ? line_end_ + indent_of(e.begin) : "")));
    }
  }
  std::string out;
  std::size_t at = 0;
  for (const auto& [begin, edit] : edits) {
    out += text_.substr(at, begin - at) + edit.second;
    at = edit.first;
  }
  return out + text_.substr(at);
}

}  // namespace wheelwright::files
