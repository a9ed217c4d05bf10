// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/suggest.hpp>
#include <wheelwright/logs/log_columns.hpp>
#include <wheelwright/logs/recorded_log.hpp>

namespace wheelwright {
namespace {

std::vector<std::string> alternatives_of(std::string_view name) {
  std::vector<std::string> out;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('|', begin), name.size());
    out.emplace_back(name.substr(begin, end - begin));
    begin = end + 1;
  }
  return out;
}

std::string with_meaning(const std::string& name) {
  const LogColumn* column = find_log_column(name);
  return column == nullptr ? name : fmt::format("{} ({}, {})", name, column->meaning, column->unit);
}

}  // namespace

void require_columns(const LogSource& source, const std::vector<std::string>& names, std::string_view file,
                     const std::vector<std::string>& header) {
  std::vector<std::string> has = header;
  if (has.empty()) {
    has = source.columns();
    has.insert(has.begin(), "t");
  }
  std::string missing, hint;
  for (const std::string& name : names) {
    const auto alternatives = alternatives_of(name);
    if (std::any_of(alternatives.begin(), alternatives.end(),
                    [&](const auto& n) { return n == "t" || source.find(n); })) {
      continue;
    }
    std::string wanted;
    for (const std::string& alternative : alternatives) {
      wanted += (wanted.empty() ? "" : " or ") + with_meaning(alternative);
    }
    missing += (missing.empty() ? "" : "; ") + wanted;
    for (const std::string& alternative : alternatives) {
      const std::string nearest = nearest_name(alternative, has);
      if (!nearest.empty() && !source.find(nearest)) {
        hint += fmt::format("; did you mean {}? Then add --map {}={}", shown(nearest), alternative, nearest);
        break;
      }
    }
  }
  if (!missing.empty()) {
    throw InputError(fmt::format("{}: no column for {}: the file has {}{}", file, missing, listed(has), hint));
  }
}

void require_columns(const RecordedLog& log, const std::vector<std::string>& names) {
  for (const LogFileReport& file : log.report().files) {
    const bool lacks = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      const auto alternatives = alternatives_of(name);
      return std::none_of(alternatives.begin(), alternatives.end(), [&](const std::string& alternative) {
        return std::any_of(file.header.begin(), file.header.end(), [&](const std::string& field) {
          const LogColumn* column = recognise_log_column(field);
          return field == alternative || (column != nullptr && column->name == alternative);
        });
      });
    });
    if (lacks) {
      require_columns(log, names, file.path, file.header);
    }
  }
  require_columns(log, names, log.report().files.front().path, log.report().files.front().header);
}

}  // namespace wheelwright
