// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/csv_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/csv_write.hpp"
#include "formats/logs/joint_states.hpp"
#include "formats/logs/known_logger.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/wall_clock.hpp"

namespace wheelwright::logs {

using files::shown;

namespace {

std::string_view trimmed_field(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == std::string_view::npos ? std::string_view()
                                         : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// The one of , ; tab and | that occurs most often outside quotes; the comma where none does.
char find_separator(std::string_view line) {
  constexpr std::string_view candidates = ",;\t|";
  std::size_t counts[4] = {0, 0, 0, 0};
  bool in_quotes = false;
  for (const char c : line) {
    in_quotes ^= c == '"';
    const std::size_t k = candidates.find(c);
    if (!in_quotes && k != std::string_view::npos) {
      ++counts[k];
    }
  }
  return candidates[static_cast<std::size_t>(std::max_element(counts, counts + 4) - counts)];
}

/// What makes a table of binary data that begins so; empty where that is not known.
std::string maker_of(std::string_view line) {
  return line.starts_with("PAR1") ? "; this is Parquet: python3 -c \"import pandas; "
                                    "pandas.read_parquet('LOG').to_csv('log.csv', index=False)\" makes a table of it"
         : line.starts_with("MATLAB")
             ? "; this is a MATLAB file: writetable(TABLE, 'log.csv') in MATLAB makes a table, and "
               "save -v7.3 a file that is read as HDF5"
         : line.starts_with("ULog")    ? "; this is a ULog of PX4: ulog2csv (pip install pyulog) makes tables of it"
         : line.starts_with("#ROSBAG") ? "; this is a packed ROS 1 bag: unpack it first"
                                       : "";
}

void check_is_text(std::string_view line, const std::string& place) {
  const bool binary = std::any_of(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\r'; });
  if (binary) {
    throw InputError(place + ": binary data: expected a header line with the names of the columns" + maker_of(line));
  }
}

void check_has_names(const std::vector<std::string>& fields, const std::string& place) {
  const auto is_number = [](const std::string& f) { return files::to_number(f).has_value(); };
  const bool numbers =
      std::all_of(fields.begin(), fields.end(), [&](const std::string& f) { return f.empty() || is_number(f); });
  const bool echoed = fields.size() > 2 && is_number(fields[0]) && is_number(fields[1]);
  if (numbers || echoed) {
    throw InputError(fmt::format("{}: {}: expected a header line with the names of the columns (t, omega_r, ...){}",
                                 place, shown(core::listed(fields)),
                                 echoed ? headerless_logger(fields, place.substr(0, place.rfind(':'))) : ""));
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
  throw InputError(fmt::format("{}: no column {} ({}): expected one of {}{}", place, shown(name), why,
                               core::listed(fields), files::did_you_mean(name, fields)));
}

/// A unit that tables are written in, in small letters and without blanks and points, and what makes `own` of it.
struct ForeignUnit {
  std::string_view written, own;
  double factor;
};

constexpr double per_rpm = std::numbers::pi / 30.0, per_degree = std::numbers::pi / 180.0,
                 per_turn = 2.0 * std::numbers::pi;
constexpr ForeignUnit foreign_units[] = {
    {"rpm", "rad/s", per_rpm},
    {"rev/min", "rad/s", per_rpm},
    {"1/min", "rad/s", per_rpm},
    {"u/min", "rad/s", per_rpm},
    {"tr/min", "rad/s", per_rpm},
    {"r/min", "rad/s", per_rpm},
    {"min-1", "rad/s", per_rpm},
    {"rps", "rad/s", per_turn},
    {"rev/s", "rad/s", per_turn},
    {"turns/s", "rad/s", per_turn},
    {"dps", "rad/s", per_degree},
    {"deg/s", "rad/s", per_degree},
    {"°/s", "rad/s", per_degree},
    {"deg/sec", "rad/s", per_degree},
    {"degrees/s", "rad/s", per_degree},
    {"mrad/s", "rad/s", 1e-3},
    {"rad/sec", "rad/s", 1.0},
    {"radians/s", "rad/s", 1.0},
    {"rads/s", "rad/s", 1.0},
    {"deg", "rad", per_degree},
    {"degree", "rad", per_degree},
    {"degrees", "rad", per_degree},
    {"radian", "rad", 1.0},
    {"radians", "rad", 1.0},
    {"rads", "rad", 1.0},
    {"°", "rad", per_degree},
    {"rev", "rad", per_turn},
    {"turns", "rad", per_turn},
    {"mrad", "rad", 1e-3},
    {"ma", "A", 1e-3},
    {"amp", "A", 1.0},
    {"amps", "A", 1.0},
    {"mv", "V", 1e-3},
    {"volt", "V", 1.0},
    {"volts", "V", 1.0},
    {"mnm", "N·m", 1e-3},
    {"nmm", "N·m", 1e-3},
    {"ncm", "N·m", 1e-2},
    {"n-m", "N·m", 1.0},
    {"kgfcm", "N·m", 9.80665e-2},
    {"kgcm", "N·m", 9.80665e-2},
    {"kg-cm", "N·m", 9.80665e-2},
    {"ozin", "N·m", 7.0615518e-3},
    {"oz-in", "N·m", 7.0615518e-3},
    {"mm", "m", 1e-3},
    {"cm", "m", 1e-2},
    {"km", "m", 1e3},
    {"ms", "s", 1e-3},
    {"us", "s", 1e-6},
    {"µs", "s", 1e-6},
    {"μs", "s", 1e-6},
    {"ns", "s", 1e-9},
    {"sec", "s", 1.0},
    {"secs", "s", 1.0},
    {"seconds", "s", 1.0},
    {"msec", "s", 1e-3},
    {"milliseconds", "s", 1e-3},
    {"usec", "s", 1e-6},
    {"microseconds", "s", 1e-6},
    {"nsec", "s", 1e-9},
    {"nanoseconds", "s", 1e-9},
    {"min", "s", 60.0},
    {"minutes", "s", 60.0},
    {"h", "s", 3600.0},
    {"hr", "s", 3600.0},
    {"hours", "s", 3600.0},
    {"d", "s", 86400.0},
    {"days", "s", 86400.0},
    {"g", "m/s²", 9.80665},
    {"mm/s", "m/s", 1e-3},
    {"km/h", "m/s", 1.0 / 3.6},
};

/// The entry for what is `written` of a column whose units are `own` ("m or rad"); nullptr where there is none.
const ForeignUnit* find_foreign_unit(std::string_view written, std::string_view own) {
  std::string plain;
  for (const char c : written) {
    if (std::string_view(" *.^").find(c) == std::string_view::npos) {
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  if (const std::size_t dot = plain.find("·"); dot != std::string::npos) {
    plain.erase(dot, std::string_view("·").size());
  }
  const std::string list = fmt::format(" {} ", own);
  const auto found = std::ranges::find_if(foreign_units, [&](const ForeignUnit& unit) {
    return unit.written == plain && list.find(fmt::format(" {} ", unit.own)) != std::string::npos;
  });
  return found == std::end(foreign_units) ? nullptr : found;
}

/// A field cut into a name and a unit.
struct NameWithUnit {
  std::string_view name, unit;
  bool marked = true;     ///< by brackets or " / ": whatever stands there is meant as a unit
  bool own_taken = true;  ///< whether the contract's own unit may stand so
};

/// The ways to cut "omega_r [rpm]" (in brackets of any kind), "omega_r / rpm", "omega_r/rpm" and "omega_r_rpm".
std::vector<NameWithUnit> cut_units(std::string_view field) {
  constexpr std::string_view opening = "[({<", closing = "])}>";
  std::vector<NameWithUnit> cuts;
  const auto cut = [&](std::size_t at, std::size_t length, std::size_t behind, bool marked, bool own_taken) {
    if (at != std::string_view::npos && at > 0 && at + length + behind < field.size()) {
      const std::string_view unit = field.substr(at + length, field.size() - at - length - behind);
      cuts.push_back({trimmed_field(field.substr(0, at)), trimmed_field(unit), marked, own_taken});
    }
  };
  const std::size_t kind = field.empty() ? std::string_view::npos : closing.find(field.back());
  if (kind != std::string_view::npos) {
    cut(field.rfind(opening[kind]), 1, 1, true, true);
  }
  cut(field.find(" / "), 3, 0, true, true);
  cut(field.find('/'), 1, 0, false, true);
  cut(field.rfind('_'), 1, 0, false, false);
  return cuts;
}

/// recognise_log_column(), with units behind a slash and in any brackets.
const LogColumn* column_of_field(const std::string& field) {
  if (const LogColumn* column = recognise_log_column(field)) {
    return column;
  }
  for (const NameWithUnit& cut : cut_units(field)) {
    const LogColumn* column =
        cut.own_taken ? recognise_log_column(fmt::format("{} [{}]", cut.name, cut.unit)) : nullptr;
    if (column != nullptr) {
      return column;
    }
  }
  return nullptr;
}

/// Field `k` with the unit that the second line gives it.
std::string meant(const CsvHeader& header, std::size_t k) {
  const bool unit = k < header.units.size() && !header.units[k].empty();
  return unit ? fmt::format("{} [{}]", header.fields[k], header.units[k]) : header.fields[k];
}

/// The column that `field` is called like, in a unit that is known and not the contract's own, and what makes its own
/// of it; nullptr where it is none. A unit that merely stands behind a '_' is not taken for min, h or d: t_min may be
/// the least.
std::pair<const LogColumn*, double> foreign_column_of(std::string_view field) {
  for (const auto& [name, unit, marked, own_taken] : cut_units(field)) {
    const LogColumn* column = recognise_log_column(name);
    const ForeignUnit* known = column == nullptr ? nullptr : find_foreign_unit(unit, column->unit);
    if (known != nullptr && (marked || column->name != "t" || known->factor <= 1.0)) {
      return {column, known->factor};
    }
  }
  return {nullptr, 1.0};
}

/// Whether `unit` is one of any column.
bool is_known_unit(std::string_view unit) {
  return std::ranges::any_of(log_columns(), [&](const LogColumn& column) {
    return find_foreign_unit(unit, column.unit) != nullptr ||
           recognise_log_column(fmt::format("{} [{}]", column.name, unit)) != nullptr;
  });
}

/// Whether field `k` is one of the columns that were found.
bool is_taken(const CsvHeader& header, std::size_t k) {
  return std::ranges::any_of(header.found, [&](const auto& found) { return found.second == k; });
}

bool is_wanted(const CsvOptions& options, const std::string& name) {
  return name == "t" || !options.only || std::ranges::find(*options.only, name) != options.only->end();
}

/// Why `field`, which is `with_unit`, is not taken for the column that it is called like: a unit of its own. Nothing
/// where that is not so, or the column is not `missing`.
template <typename Missing>
std::string unit_note(const std::string& field, const std::string& with_unit, const Missing& missing) {
  for (const auto& [name, unit, marked, own_taken] : cut_units(with_unit)) {
    const LogColumn* column = recognise_log_column(name);
    if (column == nullptr || unit.empty() || files::to_number(unit) || !missing(column->name)) {
      continue;
    }
    const ForeignUnit* known = find_foreign_unit(unit, column->unit);
    if (known != nullptr || marked) {
      return fmt::format("{} was not taken as {}: its unit is '{}', expected {}; {}", files::one_line(field),
                         column->name, files::one_line(unit), column->unit,
                         known != nullptr ? map_argument(column->name, field, known->factor)
                                          : fmt::format("--map {}=\"{}*FACTOR\"", column->name, field));
    }
  }
  return {};
}

/// Says of each field that is left and called like a column that is missing why it was not taken.
void note_units(CsvHeader& header, const CsvOptions& options) {
  for (std::size_t k = 0; k < header.fields.size(); ++k) {
    if (is_taken(header, k)) {
      continue;
    }
    std::string note = unit_note(header.fields[k], meant(header, k), [&](const std::string& name) {
      return !header.found.contains(name) && is_wanted(options, name);
    });
    if (!note.empty()) {
      header.notes.push_back(std::move(note));
    }
  }
}

/// Finds the columns that `column_of` sees in fields, with the factors that it gives.
template <typename ColumnOf>
void recognise(CsvHeader& header, const CsvOptions& options, const std::string& place, const ColumnOf& column_of) {
  std::map<std::string, std::vector<std::size_t>> candidates;
  for (std::size_t k = 0; k < header.fields.size(); ++k) {
    const LogColumn* column = column_of(k).first;
    if (is_taken(header, k) || column == nullptr || header.found.contains(column->name) ||
        !is_wanted(options, column->name)) {
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
      throw InputError(
          first == second
              ? fmt::format(
                    "{}: two columns are called {}: expected names that differ; give one of them another in the "
                    "header",
                    place, shown(first))
              : fmt::format("{}: columns {} and {} both mean {}: expected one, or a choice by --map {}=COLUMN", place,
                            shown(first), shown(second), name, name));
    }
    header.found[name] = fields.front();
    if (const double factor = column_of(fields.front()).second; factor != 1.0) {
      header.factors[name] = factor;
    }
  }
}

std::string without_brackets(std::string_view unit) {
  unit = trimmed_field(unit);
  constexpr std::string_view opening = "[({<", closing = "])}>";
  const std::size_t kind = unit.size() < 2 ? std::string_view::npos : opening.find(unit.front());
  if (kind != std::string_view::npos && unit.back() == closing[kind]) {
    unit = trimmed_field(unit.substr(1, unit.size() - 2));
  }
  return unit == "-" || unit == "1" ? std::string() : std::string(unit);
}

}  // namespace

bool names_time(const std::string& field) {
  const LogColumn* column = column_of_field(field);
  column = column != nullptr ? column : foreign_column_of(field).first;
  return column != nullptr && column->name == "t";
}

char separator_of(std::string_view line) { return find_separator(line); }

bool names_separator(std::string_view line) {
  line = trimmed_field(line);
  line = line.size() > 2 && line.front() == '"' && line.back() == '"' ? line.substr(1, line.size() - 2) : line;
  return line.size() <= 5 && (line.starts_with("sep=") || line.starts_with("SEP="));
}

std::optional<std::vector<std::string>> units_in_line(std::string_view header, std::string_view line) {
  const char separator = find_separator(header);
  const std::size_t columns = split_fields(header, separator).size();
  std::vector<std::string> units = split_fields(line, separator);
  if (units.size() == columns + 1 && units.back().empty()) {
    units.pop_back();
  }
  std::size_t texts = 0, known = 0;
  for (std::string& unit : units) {
    if (unit.empty()) {
      continue;
    }
    if (files::to_number(unit) && unit != "1") {
      return std::nullopt;
    }
    unit = without_brackets(unit);
    texts += unit.empty() ? 0 : 1;
    known += !unit.empty() && is_known_unit(unit) ? 1 : 0;
  }
  return units.size() == columns && known > 0 && 2 * known >= texts ? std::optional(std::move(units)) : std::nullopt;
}

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

std::pair<std::string, double> split_factor(const std::string& text) {
  const std::size_t star = text.rfind('*');
  if (star == std::string::npos) {
    return {text, 1.0};
  }
  const auto factor = files::to_number(trimmed_field(std::string_view(text).substr(star + 1)));
  return factor && std::isfinite(*factor) && *factor != 0.0
             ? std::pair{std::string(trimmed_field(std::string_view(text).substr(0, star))), *factor}
             : std::pair{text, 1.0};
}

std::optional<double> factor_alone(const std::string& text) {
  const auto [field, factor] = split_factor(text);
  return field.empty() && !text.empty() ? std::optional(factor) : std::nullopt;
}

namespace {

/// Where the times of a table may be that has no column for them, and what makes one of it; empty where nothing tells.
std::string times_in_other_columns(const CsvHeader& header) {
  const auto ending = [&](std::initializer_list<std::string_view> names) {
    return static_cast<std::size_t>(
        std::ranges::find_if(header.fields,
                             [&](const std::string& field) {
                               const std::string plain = plain_name(field);
                               return std::ranges::any_of(names, [&](std::string_view name) {
                                 return plain == name || plain.ends_with(fmt::format("_{}", name));
                               });
                             }) -
        header.fields.begin());
  };
  const std::string_view separator = header.separator == '\t' ? "'\\t'" : header.separator == ';' ? "';'" : ",";
  const std::size_t seconds = ending({"sec", "secs", "seconds"}),
                    rest = ending({"nanosec", "nsec", "nsecs", "nanoseconds"});
  if (seconds < header.fields.size() && rest < header.fields.size()) {
    return fmt::format(
        "; its times are in two columns, s and ns: awk -F{0} -v OFS={0} 'NR==1{{print \"t\",$0;next}} {{print "
        "sprintf(\"%d.%09d\",${1},${2}),$0}}' LOG > with_t.csv makes one of them",
        separator, seconds + 1, rest + 1);
  }
  if (!header.fields.empty() && header.fields.front().empty()) {
    return "; its first column has no name, as pandas writes an index: if it is the time, sed '1s/^/t/' LOG > "
           "named.csv "
           "names it";
  }
  if (const std::size_t index = ending({"index", "row", "sample", "frame", "seq", "no", "nr", "i", "n", "k"});
      index < header.fields.size()) {
    return fmt::format("; where {0} counts rows that are 0.01 s apart, --map t=\"{0}*0.01\" makes times of it",
                       header.fields[index]);
  }
  return fmt::format(
      "; rows that are 0.01 s apart get times by awk -F{0} -v OFS={0} 'NR==1{{print \"t\",$0;next}} "
      "{{print (NR-2)*0.01,$0}}' LOG > with_t.csv",
      separator);
}

/// Multiplies the columns of which the map gives no more than a factor.
void scale_found(CsvHeader& header, const CsvOptions& options, const std::string& place) {
  for (const auto& [name, column] : options.map) {
    const std::optional<double> factor = factor_alone(column);
    if (!factor || !is_wanted(options, name)) {
      continue;
    }
    if (!header.found.contains(name)) {
      throw InputError(fmt::format("{}: no column for {}, which --map {}={} multiplies: expected one of {}", place,
                                   name, name, column, core::listed(header.fields)));
    }
    const auto own = header.factors.emplace(name, 1.0).first;
    own->second *= *factor;
  }
}

}  // namespace

CsvHeader read_csv_header(std::string_view line, const CsvOptions& options, const std::string& place,
                          std::vector<std::string> units) {
  check_is_text(line, place);
  CsvHeader header;
  header.units = std::move(units);
  header.separator = find_separator(line);
  header.fields = split_fields(line, header.separator);
  check_has_names(header.fields, place);
  for (const auto& [name, column] : options.map) {
    if (factor_alone(column)) {
      continue;
    }
    const auto [field, factor] = find_field(header.fields, column) ? std::pair{column, 1.0} : split_factor(column);
    if (joint_place(field) && !find_field(header.fields, field)) {
      continue;  // joints of a JointState: a table has the columns under their own names
    }
    if (!find_field(header.fields, field) && std::ranges::count(header.fields, name) == 1 &&
        std::ranges::count(options.or_by_name, name) > 0) {
      header.found[name] = *find_field(header.fields, name);
      header.notes.push_back(by_its_own_name(field, name));
      continue;
    }
    header.found[name] = demand_field(header.fields, field, "which --map " + name + "=" + column + " names", place);
    if (factor != 1.0) {
      header.factors[name] = factor;
    }
  }
  for (const std::string& name : options.extra) {
    if (!header.found.contains(name)) {
      header.found[name] = demand_field(header.fields, name, "which was asked for", place);
    }
  }
  recognise(header, options, place, [&](std::size_t k) { return std::pair(column_of_field(meant(header, k)), 1.0); });
  recognise(header, options, place, [&](std::size_t k) { return foreign_column_of(meant(header, k)); });
  note_units(header, options);
  if (header.found.contains("t")) {
    scale_found(header, options, place);
  } else {
    std::string notes;
    for (const std::string& note : header.notes) {
      notes += "; " + note;
    }
    throw InputError(fmt::format("{}: no column for t (time, s): expected one of {}{}; see --map t=COLUMN{}{}{}", place,
                                 core::listed(header.fields), files::did_you_mean("time", header.fields), notes,
                                 times_in_other_columns(header), known_logger(header.fields)));
  }
  return header;
}

std::string map_argument(std::string_view name, std::string_view field, double factor) {
  return fmt::format("--map {}=\"{}*{:g}\"", name, field, factor);
}

std::string by_its_own_name(std::string_view field, std::string_view name) {
  return fmt::format("there is no {}, which `columns:` names: {} was read by its own name", files::one_line(field),
                     name);
}

void HeadingUnit::add(double theta) {
  constexpr double nearly = 300.0;
  jumps_ = jumps_ || (std::abs(theta - before_) > nearly && std::abs(theta - before_) <= 360.0);
  least_ = std::min(least_, theta);
  most_ = std::max(most_, theta);
  before_ = std::isnan(theta) ? before_ : theta;
}

bool HeadingUnit::degrees() const {
  return jumps_ && ((least_ >= -180.0 && most_ <= 180.0) || (least_ >= 0.0 && most_ <= 360.0));
}

bool is_csv_content(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first != std::string_view::npos && line[first] != '#';
}

namespace {

/// Nothing, a dash, or one of the words NA, N/A, #N/A, null and none in any case.
bool means_missing(std::string_view text) {
  constexpr std::array<std::string_view, 8> words = {"", "na", "n/a", "null", "none", "#n/a", "-", "--"};
  return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
    return std::equal(word.begin(), word.end(), text.begin(), text.end(),
                      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  });
}

bool is_blank(char c) { return c == ' ' || c == '\t'; }

}  // namespace

CsvRowReader::CsvRowReader(std::vector<std::string> names, LogReport* report)
    : names_(std::move(names)), cleaner_(names_, report), values_(names_.size() + 1) {}

void CsvRowReader::begin_file(const CsvHeader& header, std::string path) {
  cleaner_.begin_file(path + ":");
  path_ = std::move(path);
  fields_ = header.fields;
  separator_ = header.separator;
  clock_ = {};
  points_ = commas_ = false;
  heading_ = {};
  slots_.assign(fields_.size(), -1);
  const auto take = [&](const std::string& name, int slot) {
    const auto found = header.found.find(name);
    if (found == header.found.end()) {
      throw InputError(fmt::format("{}: no column for {}: expected one of {}", path_, name, core::listed(fields_)));
    }
    int& of_field = slots_[found->second];
    if (of_field >= 0) {
      throw InputError(fmt::format("{}: column {} is taken for {} and for {}: expected a column for each", path_,
                                   shown(fields_[found->second]),
                                   of_field == 0 ? "t" : names_[static_cast<std::size_t>(of_field) - 1], name));
    }
    of_field = slot;
  };
  limits_ = cleaner_.limits();
  factors_.clear();
  take("t", 0);
  for (std::size_t c = 0; c < names_.size(); ++c) {
    take(names_[c], static_cast<int>(c) + 1);
    theta_ = names_[c] == "theta" ? c + 1 : theta_;
  }
  time_factor_ = header.factors.contains("t") ? header.factors.at("t") : 1.0;
  for (const auto& [name, factor] : header.factors) {
    const auto at = std::ranges::find(names_, name);
    if (at != names_.end()) {
      const std::size_t index = static_cast<std::size_t>(at - names_.begin()) + 1;
      factors_.emplace_back(index, factor);
      limits_[index] /= std::abs(factor);
    }
  }
}

/// Reads the numbers of a line into values_; returns the number of fields. The first and gravest defect is kept.
std::size_t CsvRowReader::read_fields(std::string_view line, Defect& defect) {
  const char* p = line.data();
  const char* const end = p + line.size();
  const char separator = separator_;
  const std::size_t known = slots_.size();
  const std::vector<double>& limits = limits_;
  for (std::size_t field = 0;; ++field) {
    const int slot = field < known ? slots_[field] : -1;
    if (slot < 0) {
      if (p != end && *p == '"') {
        for (++p; p != end && *p != '"'; ++p) {
        }
      }
      while (p != end && *p != separator) {
        ++p;
      }
    } else {
      while (p != end && *p == ' ') {
        ++p;
      }
      const auto index = static_cast<std::size_t>(slot);
      double& value = values_[index];
      const char* q = files::parse_number(p, end, value);
      if (q == nullptr || (q != end && *q != separator)) {
        q = read_odd_field(p, end, field, value, defect);
      } else {
        const std::string_view text(p, static_cast<std::size_t>(q - p));
        const bool point = (!points_ || commas_) && text.find('.') != std::string_view::npos;
        points_ = points_ || point;
        if (slot == 0 && (clock_.kind != Clock::Kind::plain || time_factor_ != 1.0)) {
          convert_time(text);
        }
        if ((point && commas_) || (slot == 0 && reads_moments() && std::isfinite(value))) {
          defect = defect.fault == Fault::text ? defect : Defect{Fault::text, field, text};
        } else if (!(std::abs(value) <= limits[index])) {
          const Fault fault = std::isfinite(value) ? Fault::limit : Fault::not_finite;
          if (fault == Fault::not_finite && may_miss(index)) {
            value = std::numeric_limits<double>::quiet_NaN();
          } else if (fault > defect.fault) {
            defect = {fault, field, text};
          }
        }
      }
      p = q;
    }
    if (p == end) {
      return field + 1;
    }
    ++p;
  }
}

namespace {

constexpr double a_day = 86400.0;
constexpr double day_of_1970 = 25569.0;  // of a spreadsheet, from 30 December 1899, of a zone that it does not tell

}  // namespace

namespace {

/// The unit in which `t` is a time since 1970; nullptr where it is in none that is shorter than s.
const CountUnit* unit_since_1970(double t) {
  const auto unit =
      std::ranges::find_if(count_units, [&](const CountUnit& of) { return is_since_1970(t * of.seconds); });
  return unit == count_units.end() ? nullptr : &*unit;
}

}  // namespace

/// Settles how times are written by the first of them: values_[0], and `count` where it is a whole number.
void CsvRowReader::begin_clock(std::optional<std::int64_t> count) {
  constexpr double a_year = 3.2e7;  // s: later than 1971, whichever unit
  const double t = values_[0];
  clock_.kind = Clock::Kind::plain;
  const CountUnit* unit = nullptr;
  if (count && time_factor_ == 1.0 && t > limits_[0]) {
    unit = std::ranges::find_if(count_units, [&](const CountUnit& of) {
      return clock_.assumed ? clock_.assumed->name == of.name
                            : t * of.seconds > a_year && t * of.seconds < 1e3 * a_year;
    });
    unit = unit == count_units.end() ? nullptr : unit;
    clock_.unit = unit == nullptr ? std::string_view() : unit->name;
  } else if (count) {
    unit = std::ranges::find(count_units, time_factor_, &CountUnit::seconds);
    unit = unit == count_units.end() ? nullptr : unit;
  }
  if (unit != nullptr) {
    clock_.kind = Clock::Kind::counts;
    clock_.seconds = unit->seconds;
    const std::int64_t second = *count / std::llround(1.0 / unit->seconds);
    const bool since_1970 = is_since_1970(static_cast<double>(second));
    clock_.zone = since_1970 ? "UTC" : "";
    if (since_1970 || !clock_.unit.empty()) {
      clock_.origin = common_origin(shared_origin_, second);
    }
  } else if (!keep_seconds_) {
    const bool serial = time_factor_ == a_day;
    const double seconds = (t - (serial ? day_of_1970 : 0.0)) * time_factor_;
    if ((serial || time_factor_ <= 1.0) && is_since_1970(seconds)) {
      clock_.kind = Clock::Kind::epoch;
      clock_.zone = serial ? "" : "UTC";
      clock_.origin = common_origin(shared_origin_, static_cast<std::int64_t>(std::floor(seconds)));
    }
  }
}

/// Makes s since the clock's origin of values_[0], which is written as `text`.
void CsvRowReader::convert_time(std::string_view text) {
  double& t = values_[0];
  if (!std::isfinite(t)) {
    return;
  }
  std::int64_t count = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, count);
  const bool begins_whole = error == std::errc() && count >= 0;
  const bool whole = begins_whole && end == last;
  if (clock_.kind == Clock::Kind::unknown) {
    begin_clock(whole ? std::optional(count) : std::nullopt);
    const bool decimals = begins_whole && !whole && *end == '.';
    const CountUnit* const unit = decimals && time_factor_ == 1.0 && t > limits_[0] ? unit_since_1970(t) : nullptr;
    if (unit != nullptr && clock_.kind == Clock::Kind::plain) {
      clock_.unit = unit->name;
      time_factor_ = unit->seconds;
      clock_.kind = Clock::Kind::epoch;
      clock_.zone = "UTC";
      clock_.origin = common_origin(shared_origin_, static_cast<std::int64_t>(std::floor(t * unit->seconds)));
    }
  }
  const auto origin = static_cast<double>(clock_.origin);
  switch (clock_.kind) {
    case Clock::Kind::counts: {
      const std::int64_t from = clock_.origin * std::llround(1.0 / clock_.seconds);
      t = (whole ? static_cast<double>(count - from) : t - static_cast<double>(from)) * clock_.seconds;
      break;
    }
    case Clock::Kind::epoch: {
      // The digits behind the point are those of a number of less digits before it.
      const bool fraction = begins_whole && !whole && *end == '.' && count >= clock_.origin && time_factor_ == 1.0 &&
                            std::all_of(end + 1, last, [](char c) { return c >= '0' && c <= '9'; });
      const std::string less = fraction ? fmt::format("{}{}", count - clock_.origin,
                                                      std::string_view(end, static_cast<std::size_t>(last - end)))
                                        : std::string();
      if (!fraction || files::parse_number(less.data(), less.data() + less.size(), t) == nullptr) {
        t = (t - (time_factor_ == a_day ? day_of_1970 : 0.0)) * time_factor_ - origin;
      }
      break;
    }
    case Clock::Kind::plain: t *= time_factor_; break;
    case Clock::Kind::moments:
    case Clock::Kind::unknown: break;
  }
}

/// Reads a time that is a date or the like; false where it is none, or the first of the file was not.
bool CsvRowReader::read_moment(std::string_view text, double& t) {
  if (clock_.kind != Clock::Kind::unknown && clock_.kind != Clock::Kind::moments) {
    return false;
  }
  const std::optional<Moment> moment = parse_moment(text);
  if (!moment || time_factor_ != 1.0 ||
      (clock_.kind == Clock::Kind::moments && moment->since_1970 != clock_.since_1970)) {
    return false;
  }
  constexpr std::int64_t ns = 1'000'000'000;
  if (clock_.kind == Clock::Kind::unknown) {
    clock_.kind = Clock::Kind::moments;
    clock_.since_1970 = moment->since_1970;
    clock_.zone = moment->utc ? "UTC" : "";
    clock_.day_or_month = moment->day_or_month;
    if (moment->since_1970) {
      clock_.origin = common_origin(shared_origin_, moment->ns / ns);
    }
  }
  t = static_cast<double>(moment->ns - clock_.origin * ns) * 1e-9;
  return true;
}

namespace {

/// `text` as a plain number would be written: a true minus sign as '-', a Fortran exponent as e, and no marks between
/// groups of three digits, where a decimal mark (`point` or comma) or the mark itself tells them from one.
std::string plainly(std::string_view text) {
  std::string out(text);
  const auto replace = [&](std::string_view from, std::string_view to) {
    for (std::size_t at = out.find(from); at != std::string::npos; at = out.find(from)) {
      out.replace(at, from.size(), to);
    }
  };
  replace("\u2212", "-");
  for (const std::string_view mark : {"\u202f", "\u00a0", "'", "\u2019"}) {
    replace(mark, "");
  }
  if (const std::size_t d = out.find_first_of("dD"); d != std::string::npos && d > 0 && d + 1 < out.size()) {
    out[d] = 'e';
  }
  const std::size_t comma = out.rfind(','), point = out.rfind('.');
  if (comma != std::string::npos && point != std::string::npos) {
    const char group = comma < point ? ',' : '.';
    const std::size_t decimal = std::max(comma, point);
    std::size_t digits = 0;
    for (std::size_t k = decimal; k-- > 0;) {
      if (out[k] == group) {
        if (digits != 3) {
          return out;
        }
        digits = 0;
      } else {
        ++digits;
      }
    }
    if (digits >= 1 && digits <= 3) {
      out.erase(std::remove(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(decimal), group),
                out.begin() + static_cast<std::ptrdiff_t>(decimal));
    }
  }
  return out;
}

/// Reads a number with one decimal comma, which is all of `text`; false where it is none.
bool parse_decimal_comma(std::string_view text, double& value) {
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos || text.find('.') != std::string_view::npos) {
    return false;
  }
  std::string point(text);
  point[comma] = '.';
  const char* const end = point.data() + point.size();
  return files::parse_number(point.data(), end, value) == end;
}

}  // namespace

/// A field that is not plainly a number between separators: blanks, quotes, nothing, or text. Returns its end.
const char* CsvRowReader::read_odd_field(const char* p, const char* end, std::size_t field, double& value,
                                         Defect& defect) {
  const char* stop = p;
  bool in_quotes = false;
  for (; stop != end && (in_quotes || *stop != separator_); ++stop) {
    in_quotes ^= *stop == '"';
  }
  const char* last = stop;
  const auto trim = [&] {
    while (p != last && is_blank(*p)) {
      ++p;
    }
    while (p != last && is_blank(*(last - 1))) {
      --last;
    }
  };
  trim();
  if (last - p >= 2 && *p == '"' && *(last - 1) == '"') {
    ++p;
    --last;
    trim();
  }
  const std::string_view text(p, static_cast<std::size_t>(last - p));
  const bool is_time = slots_[field] == 0;
  std::string number(text);
  bool point = p != last && files::parse_number(p, last, value) == last;
  bool comma = p != last && !point && !points_ && parse_decimal_comma(text, value);
  if (!point && !comma && text.find(':') == std::string_view::npos) {
    number = plainly(text);
    const char* const number_end = number.data() + number.size();
    point = !number.empty() && number != text && files::parse_number(number.data(), number_end, value) == number_end;
    comma = !point && !points_ && number != text && parse_decimal_comma(number, value);
  }
  Fault fault = Fault::none;
  if (is_time && !point && !comma && read_moment(text, value)) {
    fault = Fault::none;
  } else if (!point && !comma) {
    fault = means_missing(text) ? Fault::empty : Fault::text;
  } else if (!std::isfinite(value)) {
    fault = Fault::not_finite;
  } else if (is_time && reads_moments()) {
    fault = Fault::text;
  } else {
    commas_ = commas_ || comma;
    points_ = points_ || (point && number.find('.') != std::string::npos);
    if (is_time && (clock_.kind != Clock::Kind::plain || time_factor_ != 1.0)) {
      std::ranges::replace(number, ',', '.');
      convert_time(number);
    }
    if (!(std::abs(value) <= limits_[static_cast<std::size_t>(slots_[field])])) {
      fault = Fault::limit;
    }
  }
  if ((fault == Fault::empty || fault == Fault::not_finite) && may_miss(static_cast<std::size_t>(slots_[field]))) {
    value = std::numeric_limits<double>::quiet_NaN();
    return stop;
  }
  if (fault > defect.fault) {
    defect = {fault, field, text};
  }
  return stop;
}

void CsvRowReader::let_miss(std::vector<bool> columns) {
  missable_ = std::move(columns);
  missable_.insert(missable_.begin(), false);
}

RowOutcome CsvRowReader::read(std::string_view line, std::size_t line_number, bool terminated) {
  return read_numbers(line, line_number, terminated) ? cleaner_.place(values_, line_number) : RowOutcome::dropped;
}

bool CsvRowReader::read_numbers(std::string_view line, std::size_t line_number, bool terminated) {
  Defect defect;
  const std::size_t fields = read_fields(line, defect);
  const std::size_t known = slots_.size();
  const bool extra_separator = fields == known + 1 && line.ends_with(separator_);
  const bool nameless_last = fields + 1 == known && fields_.back().empty();
  const bool countable = fields == known || extra_separator || nameless_last;
  if (!terminated && ((!countable && fields < known) || defect.fault == Fault::text)) {
    cleaner_.count(&LogReport::truncated, line_number);
    return false;
  }
  if (!countable) {
    throw InputError(fmt::format(
        "{}: {} fields: expected {}, as the header has ({}){}", cleaner_.at(line_number), fields, known, shown(line),
        separator_ == ',' && fields > known + 1 ? "; where numbers have decimal commas, write ; or tabs between them"
                                                : ""));
  }
  if (defect.fault == Fault::text && split_fields(line, separator_) == fields_) {
    return false;  // tables that were joined, each with its header
  }
  if (defect.fault == Fault::text || defect.fault == Fault::limit) {
    throw InputError(cleaner_.at(line_number) + ": " + describe(defect));
  }
  if (defect.fault != Fault::none) {
    cleaner_.count(defect.fault == Fault::empty ? &LogReport::empty : &LogReport::not_finite, line_number,
                   fields_[defect.field]);
    return false;
  }
  for (const auto& [index, factor] : factors_) {
    values_[index] *= factor;
  }
  if (theta_ != 0) {
    heading_.add(values_[theta_]);
  }
  return true;
}

std::string CsvRowReader::describe(const Defect& defect) const {
  const std::string where = fmt::format("column {}: {}", shown(fields_[defect.field]), shown(defect.text));
  if (defect.fault == Fault::text) {
    const bool is_time = slots_[defect.field] == 0;
    const bool comma = defect.text.find(',') != std::string_view::npos;
    if (is_time && reads_moments()) {
      return where + ": expected a time that is written as those above it";
    }
    return fmt::format("{}: expected a number{}", where,
                       comma && points_ ? " with a decimal point, as those above it have"
                       : commas_        ? " with a decimal comma, as those above it have"
                       : is_time && clock_.kind == Clock::Kind::unknown
                           ? " of s, or a time like 2026-11-29 08:40:00.123 or 08:40:00.123"
                           : "");
  }
  return fmt::format("{}: {}", where, cleaner_.expectation(static_cast<std::size_t>(slots_[defect.field])));
}

namespace {

constexpr std::size_t rows_written_at_once = 4096;

/// Takes text, puts bytes into a file.
class Packer {
 public:
  explicit Packer(files::AtomicFile& file) : file_(file) {}
  virtual ~Packer() = default;
  virtual void write(std::string_view text, bool last) = 0;

 protected:
  files::AtomicFile& file_;
};

class PlainPacker final : public Packer {
 public:
  using Packer::Packer;
  void write(std::string_view text, bool) override { file_.write(text); }
};

class GzipPacker final : public Packer {
 public:
  explicit GzipPacker(files::AtomicFile& file) : Packer(file) {
    if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
      throw Error("zlib cannot start");
    }
  }
  ~GzipPacker() override { deflateEnd(&stream_); }
  GzipPacker(const GzipPacker&) = delete;
  GzipPacker& operator=(const GzipPacker&) = delete;

  void write(std::string_view text, bool last) override {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream_.avail_in = static_cast<uInt>(text.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, last ? Z_FINISH : Z_NO_FLUSH);
      file_.write({buffer_.data(), buffer_.size() - stream_.avail_out});
    } while (stream_.avail_out == 0);
  }

 private:
  z_stream stream_{};
  std::array<char, 1 << 16> buffer_;
};

class ZstdPacker final : public Packer {
 public:
  explicit ZstdPacker(files::AtomicFile& file) : Packer(file), context_(ZSTD_createCCtx()) {
    if (!context_) {
      throw Error("zstd cannot start");
    }
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_checksumFlag, 1);
  }
  void write(std::string_view text, bool last) override {
    ZSTD_inBuffer in{text.data(), text.size(), 0};
    std::size_t rest = 1;
    while (rest > 0) {
      ZSTD_outBuffer out{buffer_.data(), buffer_.size(), 0};
      rest = ZSTD_compressStream2(context_.get(), &out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(rest) != 0) {
        throw Error(std::string("zstd: ") + ZSTD_getErrorName(rest));
      }
      file_.write({buffer_.data(), out.pos});
      rest = last ? rest : in.size - in.pos;
    }
  }

 private:
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> context_;
  std::array<char, 1 << 16> buffer_;
};

std::unique_ptr<Packer> packer_for(const std::filesystem::path& path, files::AtomicFile& file) {
  if (path.extension() == ".gz") {
    return std::make_unique<GzipPacker>(file);
  }
  if (path.extension() == ".zst") {
    return std::make_unique<ZstdPacker>(file);
  }
  return std::make_unique<PlainPacker>(file);
}

void append_number(std::string& text, double value) {
  std::array<char, 32> digits;
  char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

/// Appends `t` s after `origin`: whole seconds are added to whole seconds, and no digit is lost.
void append_time(std::string& text, double t, std::int64_t origin) {
  if (origin == 0 || !(t >= 0.0 && t < 1e15)) {
    append_number(text, t + static_cast<double>(origin));
    return;
  }
  std::array<char, 400> digits;
  char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), t, std::chars_format::fixed).ptr;
  char* const point = std::find(digits.data(), end, '.');
  text += std::to_string(origin + static_cast<std::int64_t>(std::floor(t)));
  text.append(point, end);
}

class CsvWriter final : public LogWriter {
 public:
  CsvWriter(const std::filesystem::path& path, const std::vector<std::string>& names, std::int64_t origin)
      : file_(path), packer_(packer_for(path, file_)), columns_(names.size()), origin_(origin), text_("t") {
    for (const std::string& name : names) {
      text_ += "," + name;
    }
    text_ += '\n';
  }

  void write(const LogBlock& block) override {
    check_block(block, columns_);
    for (std::size_t k = 0; k < block.rows(); ++k) {
      append_time(text_, block.t[k], origin_);
      for (const auto& column : block.columns) {
        text_ += ',';
        append_number(text_, column[k]);
      }
      text_ += '\n';
      if (text_.size() > (std::size_t{1} << 16)) {
        packer_->write(text_, false);
        text_.clear();
      }
    }
  }

  void commit() override {
    packer_->write(text_, true);
    file_.commit();
  }

 private:
  files::AtomicFile file_;
  std::unique_ptr<Packer> packer_;
  std::size_t columns_;
  std::int64_t origin_;  ///< s that is added to every time
  std::string text_;
};

}  // namespace

std::unique_ptr<LogWriter> create_csv(const std::filesystem::path& path, const std::vector<std::string>& names) {
  return create_csv_since(path, names, 0);
}

std::unique_ptr<LogWriter> create_csv_since(const std::filesystem::path& path, const std::vector<std::string>& names,
                                            std::int64_t origin) {
  check_column_names(names);
  return std::make_unique<CsvWriter>(path, names, origin);
}

void write_csv(const std::filesystem::path& path, const LogTable& table) {
  check::that(table.names.size() == table.columns.size(), "log", "one name for each column");
  const auto writer = create_csv(path, table.names);
  LogBlock block;
  block.columns.resize(table.columns.size());
  for (std::size_t first = 0; first < table.rows(); first += rows_written_at_once) {
    const std::size_t last = std::min(table.rows(), first + rows_written_at_once);
    const auto part = [&](const std::vector<double>& column, std::vector<double>& to) {
      check::that(column.size() == table.rows(), "log column", "as many values as there are times");
      to.assign(column.begin() + static_cast<std::ptrdiff_t>(first),
                column.begin() + static_cast<std::ptrdiff_t>(last));
    };
    part(table.t, block.t);
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      part(table.columns[c], block.columns[c]);
    }
    writer->write(block);
  }
  writer->commit();
}

}  // namespace wheelwright::logs
