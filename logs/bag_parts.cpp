// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_parts.hpp>

#include <algorithm>
#include <functional>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/bag_metadata.hpp>

namespace wheelwright::bag {
namespace {

namespace fs = std::filesystem;

/// Whether "x_2" comes before "x_10".
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto number = [&](const std::string& text, std::size_t& at) {
    const std::size_t start = std::min(text.find_first_not_of('0', at), text.size());
    for (at = start; at < text.size() && digit(text[at]);) {
      ++at;
    }
    return std::string_view(text).substr(start, at - start);
  };
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      const auto x = number(a, i), y = number(b, j);
      if (x != y) {
        return x.size() != y.size() ? x.size() < y.size() : x < y;
      }
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i;
      ++j;
    }
  }
  return a.size() - i < b.size() - j || (a.size() - i == b.size() - j && a < b);
}

}  // namespace

std::string storage_ending(const fs::path& given) {
  fs::path name = given;
  if (name.extension() == ".zstd" || name.extension() == ".zst") {
    name = name.stem();
  }
  return name.extension() == ".mcap" ? "mcap" : name.extension() == ".db3" ? "db3" : "";
}

Parts parts_of(const fs::path& path) {
  Parts parts;
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    parts.files.push_back({path});
    return parts;
  }
  const fs::path metadata = path / "metadata.yaml";
  if (fs::exists(metadata, error)) {
    parts.metadata = metadata.string();
    try {
      const Metadata read = read_metadata(metadata);
      for (const std::string& name : read.files) {
        const fs::path inside = path / fs::path(name).relative_path();
        const fs::path beside = path / fs::path(name).filename();
        parts.files.push_back({fs::exists(inside, error) ? inside : beside, read.files.size() == 1});
      }
      parts.promised = read.messages;
      return parts;
    } catch (const InputError& problem) {
      parts.losses.push_back(fmt::format("{}; all files beside it are read", problem.what()));
    }
  }
  std::vector<std::string> names, kinds;
  for (fs::directory_iterator at(path, error), end; !error && at != end; at.increment(error)) {
    const std::string kind = storage_ending(at->path().filename());
    if (!kind.empty()) {
      names.push_back(at->path().filename().string());
      kinds.push_back(kind);
    }
  }
  if (error) {
    throw InputError(
        fmt::format("{}: cannot be read ({}): expected the directory of a recording", path.string(), error.message()));
  }
  if (names.empty()) {
    throw InputError(path.string() +
                     ": holds no recording: expected *.mcap or *.db3, and the metadata.yaml of rosbag2");
  }
  if (std::adjacent_find(kinds.begin(), kinds.end(), std::not_equal_to<>()) != kinds.end()) {
    throw InputError(path.string() +
                     ": holds both *.mcap and *.db3 and no metadata.yaml that says which to read: expected "
                     "the files by name");
  }
  std::sort(names.begin(), names.end(), natural_less);
  for (const std::string& name : names) {
    parts.files.push_back({path / name, names.size() == 1});
  }
  return parts;
}

}  // namespace wheelwright::bag
