// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/recorded_log.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/logs/log_columns.hpp>

namespace wheelwright::logs {

std::vector<core::ColumnError> interpolation_errors(const LogReport& report) {
  std::vector<core::ColumnError> errors;
  for (const LogFileReport& file : report.files) {
    for (const Interpolation& of : file.interpolated) {
      errors.push_back({of.column, of.error});
    }
  }
  return errors;
}

std::vector<std::string> sentences(const LogReport& report) {
  std::vector<std::string> out;
  const auto say = [&](const Occurrences& met, std::string_view one, std::string_view many, std::string_view rest) {
    if (met.count > 0) {
      out.push_back(fmt::format("{} {} {} (first at {})", met.count, met.count == 1 ? one : many, rest, met.first));
    }
  };
  say(report.empty, "row", "rows", "dropped: a field that is needed is empty");
  say(report.not_finite, "row", "rows", "dropped: a value that is needed is NaN or infinite");
  say(report.uncovered, "row", "rows", "dropped: another topic that is used has no samples around their time");
  say(report.duplicates, "row", "rows", "dropped: the same time stamp as the row before");
  say(report.truncated, "row", "rows", "dropped: the last line of the file is cut off");
  say(report.resets, "new segment", "new segments", "where time goes backwards");
  say(report.gaps, "new segment", "new segments",
      fmt::format("at gaps longer than 5 x the median step of {:.6g} s", report.median_step));
  say(report.angle_wraps, "jump", "jumps", "of a wheel angle by a whole turn undone: it was wrapped at 2π");
  for (const LogFileReport& file : report.files) {
    if (file.time_origin != 0.0) {
      out.push_back(fmt::format("{}: times are counted from {:.0f} s of its own clock", file.path, file.time_origin));
    }
    for (const Interpolation& of : file.interpolated) {
      out.push_back(fmt::format("{}: {} was interpolated between the samples of {}, with an error of at most {:.3g}{}",
                                file.path, of.column, of.topic, of.error,
                                of.error > 0.0 ? ", which is added to a noise bound that the robot file gives" : ""));
    }
    for (const std::string& note : file.notes) {
      out.push_back(note.starts_with(file.path) ? note : fmt::format("{}: {}", file.path, note));
    }
  }
  return out;
}

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
      const std::string nearest = files::nearest_name(alternative, has);
      if (!nearest.empty() && !source.find(nearest)) {
        hint += fmt::format("; did you mean {}? Then add --map {}={}", files::shown(nearest), alternative, nearest);
        break;
      }
    }
  }
  if (!missing.empty()) {
    throw InputError(fmt::format("{}: no column for {}: the file has {}{}", file, missing, core::listed(has), hint));
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

}  // namespace wheelwright::logs
