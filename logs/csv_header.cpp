// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/csv_header.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/number.hpp>
#include <wheelwright/files/suggest.hpp>
#include <wheelwright/logs/log_columns.hpp>

namespace wheelwright {
namespace {

std::string_view trimmed_field(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == std::string_view::npos ? std::string_view()
                                         : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// The one of , ; and tab that occurs most often outside quotes; the comma where none does.
char find_separator(std::string_view line) {
  constexpr std::string_view candidates = ",;\t";
  std::size_t counts[3] = {0, 0, 0};
  bool in_quotes = false;
  for (const char c : line) {
    in_quotes ^= c == '"';
    const std::size_t k = candidates.find(c);
    if (!in_quotes && k != std::string_view::npos) {
      ++counts[k];
    }
  }
  return candidates[static_cast<std::size_t>(std::max_element(counts, counts + 3) - counts)];
}

void check_is_text(std::string_view line, const std::string& place) {
  const bool binary = std::any_of(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\r'; });
  if (binary) {
    throw InputError(place + ": binary data: expected a header line with the names of the columns");
  }
}

void check_has_names(const std::vector<std::string>& fields, const std::string& place) {
  const bool numbers = std::all_of(fields.begin(), fields.end(),
                                   [](const std::string& f) { return f.empty() || to_number(f).has_value(); });
  if (numbers) {
    throw InputError(fmt::format("{}: {}: expected a header line with the names of the columns (t, omega_r, ...)",
                                 place, shown(listed(fields))));
  }
}

/// The field called `name`: exactly, else the only one whose plain name is the same.
std::optional<std::size_t> find_field(const std::vector<std::string>& fields, std::string_view name) {
  const auto exact = std::find(fields.begin(), fields.end(), name);
  if (exact != fields.end()) {
    return static_cast<std::size_t>(exact - fields.begin());
  }
  std::optional<std::size_t> found;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    if (plain_name(fields[k]) == plain_name(name)) {
      if (found) {
        return std::nullopt;
      }
      found = k;
    }
  }
  return found;
}

std::size_t demand_field(const std::vector<std::string>& fields, const std::string& name, const std::string& why,
                         const std::string& place) {
  if (const auto field = find_field(fields, name)) {
    if (std::count(fields.begin(), fields.end(), name) > 1) {
      throw InputError(fmt::format("{}: column {} stands there twice: expected one", place, shown(name)));
    }
    return *field;
  }
  throw InputError(fmt::format("{}: no column {} ({}): expected one of {}{}", place, shown(name), why, listed(fields),
                               did_you_mean(name, fields)));
}

void recognise(CsvHeader& header, const CsvOptions& options, const std::string& place) {
  std::map<std::string, std::vector<std::size_t>> candidates;
  for (std::size_t k = 0; k < header.fields.size(); ++k) {
    const bool taken =
        std::any_of(header.found.begin(), header.found.end(), [&](const auto& f) { return f.second == k; });
    const LogColumn* column = recognise_log_column(header.fields[k]);
    if (taken || column == nullptr || header.found.contains(column->name)) {
      continue;
    }
    if (column->name != "t" && options.only &&
        std::find(options.only->begin(), options.only->end(), column->name) == options.only->end()) {
      continue;
    }
    candidates[column->name].push_back(k);
  }
  for (auto& [name, fields] : candidates) {
    const auto exact = [&, &wanted = name](std::size_t k) { return header.fields[k] == wanted; };
    if (std::count_if(fields.begin(), fields.end(), exact) == 1) {
      fields = {*std::find_if(fields.begin(), fields.end(), exact)};
    }
    if (fields.size() > 1) {
      const std::string first = header.fields[fields[0]], second = header.fields[fields[1]];
      throw InputError(fmt::format("{}: columns {} and {} both mean {}: expected one, or a choice by --map {}=COLUMN",
                                   place, shown(first), shown(second), name, name));
    }
    header.found[name] = fields.front();
  }
}

}  // namespace

std::vector<std::string> split_fields(std::string_view line, char separator) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (const char c : line) {
    if (c == '"') {
      in_quotes = !in_quotes;
    }
    if (c == separator && !in_quotes) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  for (std::string& field : fields) {
    field = trimmed_field(field);
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
      std::string inner;
      for (std::size_t k = 1; k + 1 < field.size(); ++k) {
        inner += field[k];
        k += field[k] == '"' && field[k + 1] == '"' && k + 2 < field.size() ? 1 : 0;
      }
      field = trimmed_field(inner);
    }
  }
  return fields;
}

CsvHeader read_csv_header(std::string_view line, const CsvOptions& options, const std::string& place) {
  check_is_text(line, place);
  CsvHeader header;
  header.separator = find_separator(line);
  header.fields = split_fields(line, header.separator);
  check_has_names(header.fields, place);
  for (const auto& [name, column] : options.map) {
    header.found[name] = demand_field(header.fields, column, "which --map " + name + "=" + column + " names", place);
  }
  for (const std::string& name : options.extra) {
    if (!header.found.contains(name)) {
      header.found[name] = demand_field(header.fields, name, "which was asked for", place);
    }
  }
  recognise(header, options, place);
  if (!header.found.contains("t")) {
    throw InputError(fmt::format("{}: no column for t (time, s): expected one of {}{}; see --map t=COLUMN", place,
                                 listed(header.fields), did_you_mean("time", header.fields)));
  }
  return header;
}

bool is_csv_content(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first != std::string_view::npos && line[first] != '#';
}

}  // namespace wheelwright
