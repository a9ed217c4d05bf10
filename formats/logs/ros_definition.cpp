// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/ros_messages.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <memory>
#include <string>
#include <system_error>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::logs {
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

/// What a type without fields has on the wire.
RosField stand_in() { return {.name = "structure_needs_at_least_one_member"}; }

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
  if (text.size() > longest_definition) {
    throw InputError(fmt::format("{}: a definition of {} bytes: expected at most {}", files::shown(type_name),
                                 text.size(), longest_definition));
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
    if (message.fields == std::vector<RosField>{stand_in()}) {
      continue;
    }
    for (const RosField& field : message.fields) {
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
    std::error_code error;
    const bool empty = std::filesystem::is_regular_file(file->second, error) && !error &&
                       std::filesystem::is_empty(file->second, error);
    const std::string text = empty ? "" : files::read_bytes(file->second, longest_definition);
    auto messages = ros::read_messages(name, text, source);
    return &read.emplace(name, std::move(messages[name])).first->second;
  };
  RosDefinition definition = ros::assemble(root, {}, more);
  definition.origin = files_.at(root).string();
  return definition;
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

}  // namespace wheelwright::logs

namespace wheelwright::logs::ros {
namespace {

constexpr std::array<std::pair<std::string_view, RosKind>, 15> primitives = {{{"bool", RosKind::boolean},
                                                                              {"byte", RosKind::uint8},
                                                                              {"char", RosKind::uint8},
                                                                              {"int8", RosKind::int8},
                                                                              {"uint8", RosKind::uint8},
                                                                              {"int16", RosKind::int16},
                                                                              {"uint16", RosKind::uint16},
                                                                              {"int32", RosKind::int32},
                                                                              {"uint32", RosKind::uint32},
                                                                              {"int64", RosKind::int64},
                                                                              {"uint64", RosKind::uint64},
                                                                              {"float32", RosKind::float32},
                                                                              {"float64", RosKind::float64},
                                                                              {"string", RosKind::string},
                                                                              {"wstring", RosKind::wstring}}};

constexpr std::size_t longest_name = 255;

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && blank(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && blank(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

/// What stands before the next blank; `text` is left with what is behind.
std::string_view take_word(std::string_view& text) {
  const auto end = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), blank) - text.begin());
  const std::string_view word = text.substr(0, end);
  text = trimmed(text.substr(end));
  return word;
}

bool is_name(std::string_view text) {
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0 &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return (std::isalnum(c) != 0 && c < 128) || c == '_'; });
}

std::optional<std::uint32_t> whole(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value > 0 ? std::optional(value) : std::nullopt;
}

/// Reads the lines of one type.
struct LineReader {
  const std::string& source;
  std::string package;
  std::size_t line = 0;
  std::string_view text{};
  std::unordered_set<std::string> names{};  ///< of the fields of the type so far

  [[noreturn]] void fail(std::string_view expected) const {
    throw InputError(fmt::format("{}: line {}: {}: expected {}", source, line, files::shown(text), expected));
  }

  /// Fills kind, shape and counts from "float64[<=3]", and the name of a message's type.
  void type(std::string_view word, TextField& to) const {
    RosField& field = to.field;
    const std::size_t bracket = word.find('[');
    const std::string_view base = word.substr(0, bracket);
    if (bracket != std::string_view::npos) {
      std::string_view inside = word.substr(bracket + 1);
      if (inside.empty() || inside.back() != ']') {
        fail("a ']' at the end of the type");
      }
      inside.remove_suffix(1);
      const bool bounded = inside.starts_with("<=");
      field.shape = inside.empty() || bounded ? RosShape::sequence : RosShape::array;
      if (!inside.empty()) {
        const auto count = whole(inside.substr(bounded ? 2 : 0));
        if (!count) {
          fail("a number of elements from 1 to 4294967295 between '[' and ']'");
        }
        field.count = *count;
      }
    }
    const std::size_t bound = base.find("<=");
    const std::string_view name = base.substr(0, bound);
    const auto* const primitive =
        std::find_if(primitives.begin(), primitives.end(), [&](const auto& known) { return known.first == name; });
    if (bound != std::string_view::npos) {
      const auto longest = whole(base.substr(bound + 2));
      if (!longest || (name != "string" && name != "wstring")) {
        fail("string<=N or wstring<=N with a number of characters from 1 to 4294967295");
      }
      field.longest = *longest;
    }
    if (primitive != primitives.end()) {
      field.kind = primitive->second;
      return;
    }
    field.kind = RosKind::message;
    std::string_view rest = name;
    std::size_t parts = 1;
    for (std::size_t slash = rest.find('/'); slash != std::string_view::npos; slash = rest.find('/'), ++parts) {
      if (!is_name(rest.substr(0, slash))) {
        fail("a type such as float64, string or geometry_msgs/Pose");
      }
      rest.remove_prefix(slash + 1);
    }
    if (!is_name(rest) || parts > 3) {
      fail("a type such as float64, string or geometry_msgs/Pose");
    }
    to.type = parts > 1 ? full_ros_name(name) : package + "/msg/" + std::string(name);
  }

  /// Appends the field of a line, where it has one.
  void read(TextMessage& message) {
    std::string_view rest = trimmed(text.substr(0, text.find('#')));
    if (rest.empty()) {
      return;
    }
    TextField item;
    item.line = line;
    item.text = std::string(text.substr(0, 200));
    type(take_word(rest), item);
    const auto end = static_cast<std::size_t>(
        std::find_if(rest.begin(), rest.end(), [](char c) { return blank(c) || c == '='; }) - rest.begin());
    const std::string_view name = rest.substr(0, end);
    if (!is_name(name) || name.size() > longest_name) {
      fail(fmt::format("a type and a name of letters, digits and '_', at most {} of them", longest_name));
    }
    rest = trimmed(rest.substr(end));
    if (rest.starts_with("=")) {
      if (item.field.kind == RosKind::message || item.field.shape != RosShape::single) {
        fail("a constant of a number or string type");
      }
      return;
    }
    item.field.name = std::string(name);
    if (!names.insert(item.field.name).second) {
      fail("a name that is not there twice");
    }
    message.fields.push_back(std::move(item));
  }
};

bool is_separator(std::string_view line) {
  return line.size() >= 3 && line.find_first_not_of('=') == std::string_view::npos;
}

std::string package_of(std::string_view type_name) { return std::string(type_name.substr(0, type_name.find('/'))); }

}  // namespace

TextMessages read_messages(const std::string& type_name, std::string_view text, const std::string& source) {
  TextMessages messages;
  std::string name = type_name;
  bool idl = false;
  bool named = false;  // by a line "MSG: …"
  bool expect_head = false;
  LineReader reader{source, package_of(type_name)};
  TextMessage message{source, {}};
  const auto close = [&] {
    // The first part may be empty, and the type defined behind a separator of its own.
    if (!idl && (named || !message.fields.empty() || !text.starts_with("==="))) {
      messages.try_emplace(name, std::move(message));
    }
    message = {source, {}};
    reader.names.clear();
  };
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = trimmed(text.substr(at, end - at));
    at = end + 1;
    ++reader.line;
    reader.text = line;
    if (expect_head) {
      const std::size_t colon = line.find(':');
      const std::string_view word = line.substr(0, colon);
      if (colon == std::string_view::npos || (word != "MSG" && word != "IDL")) {
        reader.fail("'MSG: pkg/Type' behind a line of '='");
      }
      idl = word == "IDL";
      name = full_ros_name(trimmed(line.substr(colon + 1)));
      if (name.find('/') == std::string::npos) {
        reader.fail("'MSG: pkg/Type' behind a line of '='");
      }
      reader.package = package_of(name);
      expect_head = false;
      named = true;
    } else if (is_separator(line)) {
      close();
      expect_head = true;
    } else if (!idl) {
      reader.read(message);
    }
  }
  if (expect_head) {
    reader.fail("'MSG: pkg/Type' behind a line of '='");
  }
  close();
  return messages;
}

namespace {

/// Follows the names from type to type.
struct Assembler {
  const TextMessages& known;
  const std::function<const TextMessage*(const std::string&)>& more;
  RosDefinition definition{};
  std::map<std::string, std::size_t> places{};
  std::vector<std::string> open{};  ///< types inside which we are

  const TextMessage* text_of(const std::string& name) const {
    const auto found = known.find(name);
    return found != known.end() ? &found->second : more(name);
  }

  /// Adds a type and what it uses; its place.
  std::size_t add(const std::string& name, const TextMessage& text) {
    const std::size_t place = definition.messages.size();
    places[name] = place;
    definition.messages.push_back({name, {}});
    open.push_back(name);
    std::vector<RosField> fields;
    for (const TextField& item : text.fields) {
      const auto fail = [&](const std::string& why) {
        throw InputError(fmt::format("{}: line {}: {}: {}", text.source, item.line, files::shown(item.text), why));
      };
      RosField field = item.field;
      if (field.kind == RosKind::message) {
        std::string type = item.type;
        const TextMessage* used = text_of(type);
        if (used == nullptr && type.ends_with("/Header")) {
          type = "std_msgs/msg/Header";  // ROS 1 has it in every package
          used = text_of(type);
        }
        if (used == nullptr) {
          fail(fmt::format("the definition of {} is neither there nor bundled", type));
        }
        if (std::find(open.begin(), open.end(), type) != open.end()) {
          fail(fmt::format("{} would contain itself", type));
        }
        if (open.size() >= RosDefinition::deepest) {
          fail(fmt::format("types within types more than {} deep", RosDefinition::deepest));
        }
        const auto place_of = places.find(type);
        field.message = place_of != places.end() ? place_of->second : add(type, *used);
      }
      fields.push_back(std::move(field));
    }
    if (fields.empty()) {
      fields.push_back(stand_in());
    }
    open.pop_back();
    definition.messages[place].fields = std::move(fields);
    return place;
  }
};

/// Types within types from `place` on, itself counted; `known` has those that are counted already, 0 for others.
std::size_t depth_of(const RosDefinition& definition, std::size_t place, std::vector<std::size_t>& known) {
  if (known[place] == 0) {
    std::size_t below = 0;
    for (const RosField& field : definition.messages[place].fields) {
      if (field.kind == RosKind::message) {
        below = std::max(below, depth_of(definition, field.message, known));
      }
    }
    known[place] = below + 1;
  }
  return known[place];
}

}  // namespace

RosDefinition assemble(const std::string& type_name, const TextMessages& known,
                       const std::function<const TextMessage*(const std::string&)>& more) {
  Assembler assembler{known, more};
  const TextMessage* const text = assembler.text_of(type_name);
  if (text == nullptr) {
    throw InputError(type_name + ": its definition is neither there nor bundled");
  }
  assembler.add(type_name, *text);
  std::vector<std::size_t> depths(assembler.definition.messages.size());
  if (depth_of(assembler.definition, 0, depths) > RosDefinition::deepest) {
    throw InputError(fmt::format("{}: types within types more than {} deep", type_name, RosDefinition::deepest));
  }
  return std::move(assembler.definition);
}

}  // namespace wheelwright::logs::ros
