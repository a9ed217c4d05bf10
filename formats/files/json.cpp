// SPDX-License-Identifier: Apache-2.0
#include "formats/files/json.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::files {
namespace {

constexpr std::size_t longest_json = std::size_t{1} << 26;
constexpr std::size_t deepest = 200;
constexpr std::size_t most_values = 2'000'000;
constexpr std::size_t most_members = 10'000;  // of one object

/// Builds a document event by event. What no result of ours is (too deep, too many values, a key twice) is refused
/// where it is met: work and memory are bounded by the limits, and are linear in the text below them.
class DocumentBuilder final : public nlohmann::json_sax<Json> {
 public:
  explicit DocumentBuilder(const std::string& file) : file_(file) {}

  [[nodiscard]] Json take() { return std::move(root_); }

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(std::int64_t value) override { return put(value); }
  bool number_unsigned(std::uint64_t value) override { return put(value); }
  bool number_float(double value, const std::string&) override { return put(value); }
  bool string(std::string& value) override { return put(std::move(value)); }
  bool binary(Json::binary_t& value) override { return put(std::move(value)); }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(std::string& name) override {
    Level& level = levels_.back();
    if (level.keys.size() == most_members) {
      refuse(fmt::format("more than {} members: expected a result file", most_members));
    }
    level.key = name;
    if (!level.keys.insert(name).second) {
      refuse("stands there twice: expected it once");
    }
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) override {
    if (const auto* const syntax = dynamic_cast<const Json::parse_error*>(&error)) {
      throw *syntax;
    }
    throw InputError(fmt::format("{}: {}: expected JSON", file_, error.what()));
  }

 private:
  struct Level {
    Json* container = nullptr;
    std::string key{};                       // of the member that is being read
    std::unordered_set<std::string> keys{};  // of an object so far
  };

  template <typename Value>
  Json* placed(Value&& value) {
    if (++values_ > most_values) {
      refuse(fmt::format("more than {} values: expected a result file", most_values));
    }
    if (levels_.empty()) {
      root_ = std::forward<Value>(value);
      return &root_;
    }
    Level& level = levels_.back();
    if (level.container->is_array()) {
      return &level.container->get_ref<Json::array_t&>().emplace_back(std::forward<Value>(value));
    }
    // As a plain list: the object itself would look through all its members for the key.
    Json::object_t::Container& members = level.container->get_ref<Json::object_t&>();
    members.emplace_back(level.key, std::forward<Value>(value));
    return &members.back().second;
  }
  template <typename Value>
  bool put(Value&& value) {
    placed(std::forward<Value>(value));
    return true;
  }
  bool open(Json container) {
    if (levels_.size() == deepest) {
      refuse(fmt::format("nested more than {} deep: expected a result file", deepest));
    }
    Json* const at = placed(std::move(container));
    levels_.push_back({.container = at});
    return true;
  }
  bool close() {
    levels_.pop_back();
    return true;
  }
  [[noreturn]] void refuse(const std::string& why) const {
    std::string pointer;
    for (const Level& level : levels_) {
      const std::size_t index = level.container->size() - (&level == &levels_.back() ? 0 : 1);
      pointer += "/" + (level.container->is_array() ? std::to_string(index) : level.key);
      if (pointer.size() > longest_pointer) {
        pointer = pointer.substr(0, longest_pointer) + "...";
        break;
      }
    }
    throw InputError(fmt::format("{}: {}: {}", file_, pointer.empty() ? "/" : pointer, why));
  }

  static constexpr std::size_t longest_pointer = 200;

  const std::string& file_;
  Json root_;
  std::vector<Level> levels_;
  std::size_t values_ = 0;
};

}  // namespace

std::string json_text(const Json& value, int indent) {
  return printable_json(value.dump(indent, ' ', false, Json::error_handler_t::replace));
}

void write_json(const std::filesystem::path& path, const Json& value) { atomic_write(path, json_text(value) + "\n"); }

Json parse_json(std::string_view text, const std::string& file) {
  if (text.find('\0') != std::string_view::npos) {  // the end, to the library
    throw InputError(file + ": binary data: expected JSON");
  }
  try {
    DocumentBuilder builder(file);
    Json::sax_parse(text.begin(), text.end(), &builder);
    return builder.take();
  } catch (const Json::parse_error& error) {
    const std::size_t byte = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
    const std::string_view before = text.substr(0, byte);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t newline = before.rfind('\n');
    const std::size_t column = newline == std::string_view::npos ? byte + 1 : byte - newline;
    throw InputError(fmt::format("{}:{}:{}: {}: expected JSON", file, line, column, shown(text.substr(byte, 20))));
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: {}: expected JSON", file, error.what()));
  }
}

bool is_json_object(std::string_view text) {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  text.remove_prefix(text.starts_with(mark) ? mark.size() : 0);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

Json read_json(const std::filesystem::path& path) { return parse_json(read_bytes(path, longest_json), path.string()); }

JsonPlace::JsonPlace(const Json& value, std::string file) : JsonPlace(value, std::move(file), "") {}

JsonPlace::JsonPlace(const Json& value, std::string file, std::string pointer)
    : value_(&value), file_(std::move(file)), pointer_(std::move(pointer)) {}

std::string JsonPlace::where() const { return file_ + ": " + (pointer_.empty() ? "/" : pointer_); }

void JsonPlace::fail(std::string_view expected) const {
  throw InputError(fmt::format("{}: {}: expected {}", where(), shown(json_text(*value_, -1)), expected));
}

JsonPlace JsonPlace::at(std::string_view key) const {
  if (!value_->is_object()) {
    fail(fmt::format("an object with the member {}", shown(key)));
  }
  const auto member = value_->find(std::string(key));
  if (member == value_->end()) {
    throw InputError(fmt::format("{}: no member {}: expected it beside {}{}", where(), shown(key), core::listed(keys()),
                                 did_you_mean(key, keys())));
  }
  return {*member, file_, pointer_ + "/" + std::string(key)};
}

JsonPlace JsonPlace::at(std::size_t index) const {
  if (!value_->is_array() || index >= value_->size()) {
    fail(fmt::format("an array of at least {} elements", index + 1));
  }
  return {(*value_)[index], file_, fmt::format("{}/{}", pointer_, index)};
}

bool JsonPlace::has(std::string_view key) const {
  if (!value_->is_object()) {
    return false;
  }
  const auto member = value_->find(std::string(key));
  return member != value_->end() && !member->is_null();
}

std::size_t JsonPlace::size() const {
  if (!value_->is_array()) {
    fail("an array");
  }
  return value_->size();
}

std::vector<std::string> JsonPlace::keys() const {
  if (!value_->is_object()) {
    fail("an object");
  }
  std::vector<std::string> names;
  for (const auto& member : value_->items()) {
    names.push_back(member.key());
  }
  return names;
}

double JsonPlace::number() const {
  if (!value_->is_number() || !std::isfinite(value_->get<double>())) {
    fail("a number");
  }
  return value_->get<double>();
}

std::size_t JsonPlace::count(std::size_t most) const {
  const bool whole = value_->is_number_unsigned() || (value_->is_number_integer() && value_->get<std::int64_t>() >= 0);
  if (!whole || value_->get<std::size_t>() > most) {
    fail(most == std::numeric_limits<std::size_t>::max() ? "an integer >= 0"
                                                         : fmt::format("an integer from 0 to {}", most));
  }
  return value_->get<std::size_t>();
}

bool JsonPlace::boolean() const {
  if (!value_->is_boolean()) {
    fail("true or false");
  }
  return value_->get<bool>();
}

std::string JsonPlace::text() const {
  if (!value_->is_string()) {
    fail("a string");
  }
  return value_->get<std::string>();
}

std::vector<double> JsonPlace::numbers() const {
  std::vector<double> out(size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k] = at(k).number();
  }
  return out;
}

std::vector<std::string> JsonPlace::texts() const {
  std::vector<std::string> out(size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k] = at(k).text();
  }
  return out;
}

}  // namespace wheelwright::files
