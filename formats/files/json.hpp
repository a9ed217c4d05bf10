// SPDX-License-Identifier: Apache-2.0
/// \file
/// JSON files: written whole, read with messages that name file and key; numbers and vectors in them.
#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>

namespace wheelwright::files {

/// JSON whose objects keep the order in which they were filled.
using Json = nlohmann::ordered_json;

/// `value` as text: numbers are the shortest that read back exactly, NaN and ±infinity become null, bytes that are no
/// UTF-8 become U+FFFD, and what a terminal obeys is "\\u009b". `indent` blanks a level; −1 puts all on one line.
[[nodiscard]] std::string json_text(const Json& value, int indent = 2);

/// Writes json_text(value) and a line end to `path`, whole or not at all. Throws InputError as AtomicFile does.
void write_json(const std::filesystem::path& path, const Json& value);

/// Reads `text`; `file` is for messages. Throws InputError, naming file, line and column, when it is no JSON, and,
/// naming file and key, for a key that stands twice in an object, more than 2'000'000 values, 10'000 members of one
/// object or 200 levels.
[[nodiscard]] Json parse_json(std::string_view text, const std::string& file);

/// Whether `text` begins as a JSON object does, behind white space or a byte order mark.
[[nodiscard]] bool is_json_object(std::string_view text);

/// Reads the JSON file `path` (plain, gzip or zstd; up to 64 MiB). Throws InputError as open_bytes and parse_json do.
[[nodiscard]] Json read_json(const std::filesystem::path& path);

/// A place in a JSON document, which must outlive it. What is missing or of another kind throws InputError
/// "model.json: /parameters/0/lower: 'abc': expected a number".
class JsonPlace {
 public:
  /// The root of `value`; `file` is for messages.
  JsonPlace(const Json& value, std::string file);

  /// The member `key` of an object; throws, with the nearest name, where there is none.
  [[nodiscard]] JsonPlace at(std::string_view key) const;
  /// The element `index` of an array.
  [[nodiscard]] JsonPlace at(std::size_t index) const;
  /// True if this is an object with a member `key` that is not null.
  [[nodiscard]] bool has(std::string_view key) const;
  /// Number of elements of an array.
  [[nodiscard]] std::size_t size() const;
  /// Names of the members of an object, in the order of the file.
  [[nodiscard]] std::vector<std::string> keys() const;

  /// A finite number.
  [[nodiscard]] double number() const;
  /// An integer from 0 to `most`.
  [[nodiscard]] std::size_t count(std::size_t most = std::numeric_limits<std::size_t>::max()) const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] std::string text() const;
  /// An array of finite numbers.
  [[nodiscard]] std::vector<double> numbers() const;
  /// An array of strings.
  [[nodiscard]] std::vector<std::string> texts() const;

  /// Where this is: "file: /pointer".
  [[nodiscard]] std::string where() const;
  /// The value itself.
  [[nodiscard]] const Json& value() const { return *value_; }
  /// Throws InputError "where: value: expected `expected`".
  [[noreturn]] void fail(std::string_view expected) const;

 private:
  JsonPlace(const Json& value, std::string file, std::string pointer);

  const Json* value_;
  std::string file_;
  std::string pointer_;
};

/// `value`, or null where it is NaN or infinite.
[[nodiscard]] inline Json or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The same of what may be absent.
[[nodiscard]] inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// The array of numbers at `place`; InputError where it is none.
[[nodiscard]] inline Eigen::VectorXd vector_at(const JsonPlace& place) {
  const std::vector<double> values = place.numbers();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The same; InputError where there are not `size` numbers.
[[nodiscard]] inline Eigen::VectorXd vector_at(const JsonPlace& place, std::size_t size) {
  Eigen::VectorXd values = vector_at(place);
  if (static_cast<std::size_t>(values.size()) != size) {
    place.fail("an array of " + std::to_string(size) + " numbers");
  }
  return values;
}

}  // namespace wheelwright::files

namespace wheelwright {
using files::Json;
}  // namespace wheelwright
