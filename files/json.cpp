// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/bytes.hpp>
#include <wheelwright/files/words.hpp>

namespace wheelwright::files {
namespace {

constexpr std::size_t longest_json = std::size_t{1} << 30;
constexpr int deepest = 200;

/// Counts depth while parsing: what is nested deeper than any result of ours is not read.
class DepthCheck {
 public:
  explicit DepthCheck(const std::string& file) : file_(file) {}
  bool operator()(int depth, Json::parse_event_t, Json&) const {
    if (depth > deepest) {
      throw InputError(fmt::format("{}: nested more than {} deep: expected a result file", file_, deepest));
    }
    return true;
  }

 private:
  const std::string& file_;
};

}  // namespace

std::string json_text(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

void write_json(const std::filesystem::path& path, const Json& value) { atomic_write(path, json_text(value) + "\n"); }

Json parse_json(std::string_view text, const std::string& file) {
  try {
    return Json::parse(text.begin(), text.end(), DepthCheck(file));
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
