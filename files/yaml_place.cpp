// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/yaml_place.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/number.hpp>
#include <wheelwright/files/words.hpp>

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
    if (std::any_of(out.begin(), out.end(), [&](const auto& before) { return before.first == name; })) {
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

double YamlPlace::positive() const {
  return number("a number > 0", [](double value) { return value > 0.0; });
}

bool YamlPlace::boolean() const { return choice({"true", "false"}) == 0; }

std::string YamlPlace::where() const { return node_->where(); }

void YamlPlace::fail(std::string_view expected) const {
  say(fmt::format("{}{}: expected {}", key_.empty() ? "" : key_ + ": ", node_->value(), expected));
}

void YamlPlace::say(std::string_view message) const {
  throw InputError(fmt::format("{}: {}", node_->where(), message));
}

}  // namespace wheelwright::files
