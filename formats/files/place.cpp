// SPDX-License-Identifier: Apache-2.0
#include "formats/files/place.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_set>

#include <fmt/format.h>
#include <tinyxml2.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::files {

struct YamlPlace::Node {
  YAML::Node node;
  std::shared_ptr<const std::string> file;
  bool lines = true;

  [[nodiscard]] std::string where() const {
    return lines && node.Mark().line >= 0 ? fmt::format("{}:{}", *file, node.Mark().line + 1) : *file;
  }
  [[nodiscard]] std::shared_ptr<const Node> with(const YAML::Node& other) const {
    return std::make_shared<const Node>(Node{other, file, lines});
  }
  [[nodiscard]] std::string value() const {
    switch (node.Type()) {
      case YAML::NodeType::Scalar: return shown(node.Scalar());
      case YAML::NodeType::Sequence: return fmt::format("a list of {}", node.size());
      case YAML::NodeType::Map: return "a mapping";
      default: return "nothing";
    }
  }
};

namespace {

/// What stands in a document: whether there is anything, and where it begins.
class Contents final : public YAML::EventHandler {
 public:
  [[nodiscard]] bool empty() const { return empty_; }
  [[nodiscard]] const YAML::Mark& begin() const { return begin_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    begin_ = mark;
    empty_ = true;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { meet(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override { meet(mark); }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    meet(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    meet(mark);
  }
  void OnMapEnd() override {}

 private:
  void meet(const YAML::Mark& mark) {
    begin_ = empty_ ? mark : begin_;
    empty_ = false;
  }

  YAML::Mark begin_ = YAML::Mark::null_mark();
  bool empty_ = true;
};

/// Where something stands behind the first document, which YAML::Load() takes alone; none where there is nothing.
YAML::Mark behind_first_document(std::string_view text) {
  std::istringstream stream{std::string(text)};
  YAML::Parser parser(stream);
  Contents contents;
  if (!parser.HandleNextDocument(contents)) {
    return YAML::Mark::null_mark();
  }
  for (int before = -1; parser.HandleNextDocument(contents); before = contents.begin().pos) {
    if (!contents.empty() || contents.begin().pos == before) {  // at the same place again: what no document begins with
      return contents.begin();
    }
  }
  return YAML::Mark::null_mark();
}

}  // namespace

YamlPlace::YamlPlace(std::shared_ptr<const Node> node, std::string key)
    : node_(std::move(node)), key_(std::move(key)) {}

YamlPlace YamlPlace::parse(std::string_view text, std::string file, bool lines) {
  if (text.find('\0') != std::string_view::npos) {
    throw InputError(file + ": binary data: expected YAML");
  }
  try {
    const auto shared = std::make_shared<const std::string>(std::move(file));
    YAML::Node root;
    try {
      root.reset(YAML::Load(std::string(text)));
      if (const YAML::Mark more = behind_first_document(text); !more.is_null()) {
        throw InputError((lines ? fmt::format("{}:{}", *shared, more.line + 1) : *shared) +
                         ": more than one document: expected one, with all keys");
      }
    } catch (const YAML::Exception& error) {
      const std::string where =
          lines && !error.mark.is_null() ? fmt::format("{}:{}", *shared, error.mark.line + 1) : *shared;
      throw InputError(fmt::format("{}: {}: expected YAML", where, error.msg));
    }
    YamlPlace place(std::make_shared<const Node>(Node{root, shared, lines}), "");
    if (!root.IsMap()) {
      throw InputError(
          fmt::format("{}: {}: expected keys with values (name: my_robot, ...)", *shared, place.node_->value()));
    }
    return place;
  } catch (const YAML::Exception& error) {
    throw InputError(fmt::format("{}: expected YAML", error.what()));
  }
}

std::vector<std::pair<std::string, YamlPlace>> YamlPlace::members(const std::vector<std::string>& known) const {
  return members_of(&known);
}

std::vector<std::pair<std::string, YamlPlace>> YamlPlace::members() const { return members_of(nullptr); }

std::vector<std::pair<std::string, YamlPlace>> YamlPlace::members_of(const std::vector<std::string>* known) const {
  const std::string of = known == nullptr ? "" : ", of " + core::listed(*known);
  if (!node_->node.IsMap()) {
    fail("keys with values" + of);
  }
  std::vector<std::pair<std::string, YamlPlace>> out;
  std::unordered_set<std::string> names;
  for (const auto& member : node_->node) {
    const YamlPlace at_key(node_->with(member.first), key_);
    if (!member.first.IsScalar()) {
      at_key.fail(known == nullptr ? "a key" : "a key, one of " + core::listed(*known));
    }
    const std::string name = member.first.Scalar();
    if (known != nullptr && std::find(known->begin(), known->end(), name) == known->end()) {
      at_key.say(fmt::format("{}unknown key {}: expected one of {}{}", key_.empty() ? "" : key_ + ": ", shown(name),
                             core::listed(*known), did_you_mean(name, *known)));
    }
    const std::string full = key_.empty() ? name : key_ + "." + name;
    if (!names.insert(name).second) {
      at_key.say(full + " stands there twice: expected it once");
    }
    out.emplace_back(name, YamlPlace(node_->with(member.second), full));
  }
  return out;
}

bool YamlPlace::is_mapping() const { return node_->node.IsMap(); }

bool YamlPlace::is_scalar() const { return node_->node.IsScalar(); }

std::vector<YamlPlace> YamlPlace::elements(std::string_view expected) const {
  if (!node_->node.IsSequence()) {
    fail(expected);
  }
  std::vector<YamlPlace> out;
  for (const auto& element : node_->node) {
    out.push_back(YamlPlace(node_->with(element), key_));
  }
  return out;
}

std::string YamlPlace::text(std::string_view expected) const {
  if (!is_scalar()) {
    fail(expected);
  }
  if (!is_utf8(node_->node.Scalar())) {
    fail(std::string(expected) + " in UTF-8");
  }
  return node_->node.Scalar();
}

std::size_t YamlPlace::choice(const std::vector<std::string>& words) const {
  const std::string expected = (words.size() > 1 ? "one of " : "") + core::listed(words);
  const std::string word = text(expected);
  const auto it = std::find(words.begin(), words.end(), word);
  if (it == words.end()) {
    fail(expected + did_you_mean(word, words));
  }
  return static_cast<std::size_t>(it - words.begin());
}

void YamlPlace::demand(const std::string& word) const { static_cast<void>(choice({word})); }

double YamlPlace::number(std::string_view expected, const std::function<bool(double)>& accepted) const {
  const bool quotes = node_->node.Tag() == "!";
  const auto value = is_scalar() && !quotes ? to_number(node_->node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value) || !accepted(*value)) {
    fail(std::string(expected) + (quotes ? " without quotes" : ""));
  }
  return *value;
}

double YamlPlace::number() const {
  return number("a number", [](double) { return true; });
}

double YamlPlace::positive() const {
  return number("a number > 0", [](double value) { return value > 0.0; });
}

std::uint64_t YamlPlace::whole(std::uint64_t least, std::uint64_t most) const {
  return static_cast<std::uint64_t>(number(fmt::format("a whole number from {} to {}", least, most), [&](double value) {
    return value >= static_cast<double>(least) && value <= static_cast<double>(most) && value == std::floor(value);
  }));
}

bool YamlPlace::boolean() const { return choice({"true", "false"}) == 0; }

std::string YamlPlace::where() const { return node_->where(); }

void YamlPlace::fail(std::string_view expected) const {
  say(fmt::format("{}{}: expected {}", key_.empty() ? "" : key_ + ": ", node_->value(), expected));
}

void YamlPlace::say(std::string_view message) const {
  throw InputError(fmt::format("{}: {}", node_->where(), message));
}

namespace {

constexpr std::string_view blanks = " \t\r\n";

std::string_view without_blanks(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(blanks);
  return begin == std::string_view::npos ? "" : text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

// The parser compares each attribute of a tag with all before it: tags that no file has are refused before it begins.
void refuse_long_tags(std::string_view text, const std::string& file) {
  constexpr std::size_t most_attributes = 1000;
  const auto behind = [&](std::size_t from, std::string_view end) {
    const std::size_t at = text.find(end, from);
    return at == std::string_view::npos ? text.size() : at + end.size();
  };
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::string_view tag = text.substr(at);
    if (tag.starts_with("<!--")) {
      at = behind(at + 4, "-->");
    } else if (tag.starts_with("<![CDATA[")) {
      at = behind(at, "]]>");
    } else if (tag.starts_with("<?")) {
      at = behind(at, "?>");
    } else {
      const std::size_t begin = at;
      std::size_t attributes = 0;
      for (++at; at < text.size() && text[at] != '>'; ++at) {
        if (text[at] == '"' || text[at] == '\'') {
          at = behind(at + 1, text.substr(at, 1)) - 1;
        } else if (text[at] == '=' && ++attributes > most_attributes) {
          throw InputError(fmt::format(
              "{}:{}: an element with more than {} attributes: expected a robot description", file,
              1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(begin), '\n'), most_attributes));
        }
      }
    }
  }
}

void refuse_xacro(const tinyxml2::XMLElement& element, const std::string& file) {
  const auto refuse = [&](int line, const std::string& what) {
    throw InputError(fmt::format("{}:{}: {} is xacro, which has to be expanded first: xacro {} > robot.urdf", file,
                                 line, what, file));
  };
  if (std::string_view(element.Name()).starts_with("xacro:")) {
    refuse(element.GetLineNum(), fmt::format("<{}>", element.Name()));
  }
  for (const auto* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    if (std::string_view(a->Value()).find("${") != std::string_view::npos) {
      refuse(a->GetLineNum(), shown(a->Value()));
    }
  }
  for (const auto* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    refuse_xacro(*e, file);
  }
}

}  // namespace

struct XmlPlace::Node {
  std::shared_ptr<const tinyxml2::XMLDocument> document;
  std::shared_ptr<const std::string> file;
  const tinyxml2::XMLElement* element = nullptr;
};

XmlPlace::XmlPlace(std::shared_ptr<const Node> node) : node_(std::move(node)) {}

XmlPlace XmlPlace::with(const void* element) const {
  return XmlPlace(std::make_shared<const Node>(
      Node{node_->document, node_->file, static_cast<const tinyxml2::XMLElement*>(element)}));
}

XmlPlace XmlPlace::parse(std::string_view text, const std::string& file) {
  if (text.find('\0') != std::string_view::npos) {
    throw InputError(file + ": binary data: expected XML");
  }
  refuse_long_tags(text, file);
  const auto document = std::make_shared<tinyxml2::XMLDocument>();
  if (document->Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(
        fmt::format("{}:{}: {}: expected XML", file, std::max(document->ErrorLineNum(), 1), document->ErrorName()));
  }
  const tinyxml2::XMLElement* root = document->RootElement();
  if (root == nullptr) {
    throw InputError(file + ":1: no element: expected XML");
  }
  if (const auto* second = root->NextSiblingElement()) {
    throw InputError(fmt::format("{}:{}: <{}>: a second root element: expected <{}> alone", file, second->GetLineNum(),
                                 shown(second->Name()), shown(root->Name())));
  }
  refuse_xacro(*root, file);
  return XmlPlace(std::make_shared<const Node>(Node{document, std::make_shared<const std::string>(file), root}));
}

std::string XmlPlace::name() const { return node_->element->Name(); }

FilePlace XmlPlace::place() const {
  const auto quoted = [](const tinyxml2::XMLElement& e) {
    return fmt::format("{} {}", e.Name(), shown(e.Attribute("name")));
  };
  const tinyxml2::XMLElement* element = node_->element;
  FilePlace out{fmt::format("{}:{}", *node_->file, element->GetLineNum()), {}};
  if (element->Attribute("name") != nullptr) {
    out.element = quoted(*element);
    return out;
  }
  out.element = fmt::format("<{}>", element->Name());
  for (const auto* up = element->Parent(); up != nullptr && up->ToElement() != nullptr; up = up->Parent()) {
    const tinyxml2::XMLElement& e = *up->ToElement();
    const std::string_view kind = e.Name();
    if (e.Attribute("name") != nullptr && kind != "collision" && kind != "visual") {
      out.element += " of " + quoted(e);
      break;
    }
  }
  return out;
}

std::vector<XmlPlace> XmlPlace::children(std::string_view name) const {
  std::vector<XmlPlace> out;
  for (const auto* e = node_->element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (name.empty() || name == e->Name()) {
      out.push_back(with(e));
    }
  }
  return out;
}

std::optional<XmlPlace> XmlPlace::child(std::string_view name) const {
  const std::vector<XmlPlace> all = children(name);
  if (all.size() > 1) {
    all[1].fail("stands there twice: expected it once");
  }
  return all.empty() ? std::nullopt : std::optional(all.front());
}

XmlPlace XmlPlace::need(std::string_view name) const {
  const auto found = child(name);
  if (!found) {
    fail(fmt::format("holds no <{}>: expected one", name));
  }
  return *found;
}

std::optional<std::string> XmlPlace::attribute(std::string_view name) const {
  const char* value = node_->element->Attribute(std::string(name).c_str());
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

std::string XmlPlace::need_attribute(std::string_view name) const {
  const auto value = attribute(name);
  if (!value || value->empty()) {
    fail(fmt::format("has no attribute {}: expected one", name));
  }
  return *value;
}

std::string XmlPlace::text() const {
  const char* value = node_->element->GetText();
  return std::string(without_blanks(value == nullptr ? "" : value));
}

double XmlPlace::number(std::string_view name) const { return numbers(name, 1).front(); }

double XmlPlace::number() const { return numbers({}, 1).front(); }

std::vector<double> XmlPlace::numbers(std::string_view name, std::size_t count) const {
  const std::string all = name.empty() ? text() : need_attribute(name);
  std::vector<double> out;
  std::string_view rest = without_blanks(all);
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find_first_of(blanks));
    const auto value = to_number(word);
    if (!value || !std::isfinite(*value)) {
      break;
    }
    out.push_back(*value);
    rest = without_blanks(rest.substr(word.size()));
  }
  if (!rest.empty() || out.size() != count) {
    fail(fmt::format("{}{}: expected {}", name.empty() ? "" : std::string(name) + " ", shown(all),
                     count == 1 ? "a finite number" : fmt::format("{} finite numbers", count)));
  }
  return out;
}

Eigen::Vector3d XmlPlace::vector(std::string_view name) const {
  const std::vector<double> v = numbers(name, 3);
  return {v[0], v[1], v[2]};
}

}  // namespace wheelwright::files
