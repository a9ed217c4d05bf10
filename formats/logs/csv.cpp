// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/csv.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv_format.hpp"
#include "formats/logs/known_logger.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs {
namespace {

constexpr std::size_t rows_looked_at = 5000;  ///< rows at the beginning of a file, for columns with rates of their own

/// `line` with a comma in place of every run of blanks between its words.
std::string with_commas(std::string_view line) {
  std::string out;
  for (const char c : line) {
    const bool blank = c == ' ' || c == '\t' || c == '\r';
    if (!blank) {
      out += c;
    } else if (!out.empty() && out.back() != ',') {
      out += ',';
    }
  }
  if (!out.empty() && out.back() == ',') {
    out.pop_back();
  }
  return out;
}

/// Content lines of one file behind its header.
struct FileWalk {
  FileWalk(const std::filesystem::path& path, bool hashed, bool trust)
      : lines(files::open_bytes(path, hashed, trust), path.string()) {}

  bool next(std::string_view& line) {
    if (std::exchange(is_back, false)) {
      line = back;
      return true;
    }
    while (lines.next(line)) {
      if (is_csv_content(line)) {
        if (blanks) {
          squeezed = with_commas(line);
          line = squeezed;
        }
        return true;
      }
      comment = line.empty() ? comment : std::string(line);
    }
    return false;
  }

  /// Makes `line`, the last that was read, the next.
  void put_back(std::string_view line) {
    back = line;
    is_back = true;
  }

  files::LineReader lines;
  std::string back;
  std::string comment;  ///< the last line that is none of content
  std::string squeezed;
  bool is_back = false;
  bool blanks = false;  ///< blanks separate: lines come with commas in their places
};

/// Whether a header of these fields has a column of times.
bool has_time(const std::vector<std::string>& fields, const CsvOptions& options) {
  const auto mapped = options.map.find("t");
  return std::ranges::any_of(fields, [&](const std::string& field) {
    return names_time(field) || (mapped != options.map.end() && split_factor(mapped->second).first == field);
  });
}

std::vector<std::string> fields_of(std::string_view line) { return split_fields(line, separator_of(line)); }

constexpr std::size_t fewest_columns = 3;

/// Whether a line is rather a title above the header: of few fields, and none of them times.
bool is_title(std::string_view line, const CsvOptions& options) {
  return fields_of(line).size() < fewest_columns && !has_time(fields_of(line), options);
}

bool all_numbers(const std::vector<std::string>& fields) {
  return fields.size() > 1 &&
         std::ranges::all_of(fields, [](const std::string& f) { return files::to_number(f).has_value(); });
}

/// The header where it does not stand in the first line of content, which is `first`: in the comment above numbers, or
/// below titles. Nothing where it does. Settles whether blanks separate.
std::optional<std::string> header_elsewhere(FileWalk& walk, const CsvOptions& options, const std::string& first) {
  constexpr std::size_t most_titles = 20;
  const auto bare = [](std::string_view comment) {
    const std::size_t begin = comment.find_first_not_of("# \t");
    return begin == std::string_view::npos ? std::string() : std::string(comment.substr(begin));
  };
  const std::string comma = with_commas(first), names = bare(walk.comment), comma_names = with_commas(names);
  if (fields_of(first).size() < 2) {  // perhaps blanks separate
    if (all_numbers(fields_of(comma)) && fields_of(comma_names).size() == fields_of(comma).size()) {
      walk.blanks = true;
      walk.put_back(comma);
      return comma_names;
    }
    if (fields_of(comma).size() >= fewest_columns && has_time(fields_of(comma), options)) {
      walk.blanks = true;
      return comma;
    }
  }
  if (all_numbers(fields_of(first)) && split_fields(names, separator_of(first)).size() == fields_of(first).size() &&
      has_time(split_fields(names, separator_of(first)), options)) {
    walk.put_back(first);
    return names;
  }
  std::string_view line = first;
  for (std::size_t k = 0; k < most_titles && is_title(line, options); ++k) {
    if (!walk.next(line)) {
      return std::nullopt;
    }
  }
  return line != first && has_time(fields_of(line), options) ? std::optional(std::string(line)) : std::nullopt;
}

CsvHeader header_of(FileWalk& walk, const CsvOptions& options, const std::string& path) {
  std::string_view line;
  if (!walk.next(line) || (names_separator(line) && !walk.next(line))) {
    throw InputError(path + ": no header line: expected the names of the columns, then rows");
  }
  const std::string first(line), first_place = fmt::format("{}:{}", path, walk.lines.number());
  const std::optional<std::string> elsewhere = header_elsewhere(walk, options, first);
  const std::string header = elsewhere.value_or(first),
                    place = elsewhere ? fmt::format("{}:{}", path, walk.lines.number()) : first_place;
  if (!elsewhere && is_title(first, options)) {
    return read_csv_header(first, options, first_place);  // which says what it lacks
  }
  std::optional<std::vector<std::string>> units;
  if (walk.next(line)) {
    units = units_in_line(header, line);
    if (!units) {
      walk.put_back(line);
    }
  }
  return read_csv_header(header, options, place, units.value_or(std::vector<std::string>()));
}

/// Names (time apart) of what `header` has, in the order of its fields.
std::vector<std::string> names_of(const CsvHeader& header) {
  std::vector<std::pair<std::size_t, std::string>> by_field;
  for (const auto& [name, field] : header.found) {
    if (name != "t") {
      by_field.emplace_back(field, name);
    }
  }
  std::sort(by_field.begin(), by_field.end());
  std::vector<std::string> names;
  for (auto& entry : by_field) {
    names.push_back(std::move(entry.second));
  }
  return names;
}

std::vector<std::string> fields_without(const CsvHeader& header, const std::vector<std::string>& names) {
  std::vector<std::string> ignored;
  for (std::size_t k = 0; k < header.fields.size(); ++k) {
    const bool used = std::any_of(header.found.begin(), header.found.end(), [&](const auto& found) {
      return found.second == k &&
             (found.first == "t" || std::find(names.begin(), names.end(), found.first) != names.end());
    });
    if (!used) {
      ignored.push_back(header.fields[k]);
    }
  }
  return ignored;
}

/// Says that other files lack columns which this one has.
void note_left_out(const CsvHeader& header, const std::vector<std::string>& names, LogFileReport& file) {
  std::vector<std::string> left_out = names_of(header);
  std::erase_if(left_out, [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); });
  if (!left_out.empty()) {
    file.notes.push_back(fmt::format("{} {} left out: a file that was given together with this one has no such column",
                                     core::listed(left_out), left_out.size() == 1 ? "is" : "are"));
  }
}

/// What the first rows of a file tell of all.
struct FirstRows {
  std::vector<CsvStream> streams;
  TimeOrigin origin;                ///< of all files of the log
  std::optional<CountUnit> counts;  ///< unit of the times, where their steps tell another than their size
  std::string time_note;            ///< why the times may be in another unit; empty where they look like s
  std::string time_remedy;          ///< the argument that makes s of them, where one is known
};

/// FIELD*FACTOR as an argument, for a column that may have a factor already.
std::string with_factor(const CsvHeader& header, const std::string& name, double factor) {
  const auto own = header.factors.find(name);
  return map_argument(name, header.fields[header.found.at(name)],
                      (own == header.factors.end() ? 1.0 : own->second) * factor);
}

void describe_file(const FileWalk& lines, const CsvHeader& header, const std::vector<std::string>& names,
                   const FirstRows& first, const CsvRowReader& rows, LogFileReport& file) {
  file.notes.insert(file.notes.end(), header.notes.begin(), header.notes.end());
  note_left_out(header, names, file);
  if (!first.time_note.empty()) {
    file.notes.push_back(first.time_note);
  }
  file.time_remedy = first.time_remedy;
  if (rows.heading().degrees()) {
    file.notes.push_back(fmt::format("theta looks like degrees, since it jumps by nearly 360: expected rad, or {}",
                                     with_factor(header, "theta", std::numbers::pi / 180.0)));
  }
  file.time_origin = static_cast<double>(rows.clock_origin());
  file.time_zone = rows.clock_zone();
  if (rows.day_or_month()) {
    file.notes.push_back("day and month of its dates could change places: the day was taken to stand first");
  }
  if (!rows.clock_unit().empty()) {
    file.notes.push_back(fmt::format("times are counts of {}, and were read as such", rows.clock_unit()));
  }
  for (const auto& [name, factor] : header.factors) {
    const std::size_t field = header.found.at(name);
    const bool below = field < header.units.size() && !header.units[field].empty();
    file.notes.push_back(fmt::format("{} is {}{} times {:g}", name, header.fields[field],
                                     below ? fmt::format(" [{}]", header.units[field]) : "", factor));
  }
  const files::ByteSource& source = lines.lines.source();
  file.format = "csv";
  file.packing = source.packing();
  file.bytes = source.file_bytes();
  file.hash = source.hash();
  file.header = header.fields;
  file.ignored = fields_without(header, names);
}

void begin_rows(CsvRowReader& rows, const CsvHeader& header, const std::string& path, const FirstRows& first) {
  rows.share_origin(first.origin);
  rows.begin_file(header, path);
  if (first.counts) {
    rows.assume_counts(*first.counts);
  }
}

/// A table with one clock.
class CsvWalk final : public RowWalk {
 public:
  CsvWalk(const std::filesystem::path& path, const CsvOptions& options, const std::vector<std::string>& names,
          const FirstRows& first, double longest_step, LogReport* report)
      : names_(names), first_(first), rows_(names, report), lines_(path, report != nullptr, options.trust) {
    rows_.set_longest_step(longest_step);
    header_ = header_of(lines_, options, path.string());
    begin_rows(rows_, header_, path.string(), first_);
  }

  bool next(RowOutcome& outcome) override {
    std::string_view line;
    if (!lines_.next(line)) {
      return false;
    }
    outcome = rows_.read(line, lines_.lines.number(), lines_.lines.terminated());
    return true;
  }
  [[nodiscard]] double t() const override { return rows_.t(); }
  [[nodiscard]] const double* values() const override { return rows_.values(); }
  void describe(LogFileReport& file) const override { describe_file(lines_, header_, names_, first_, rows_, file); }

 private:
  const std::vector<std::string>& names_;
  FirstRows first_;
  CsvRowReader rows_;
  FileWalk lines_;
  CsvHeader header_;
};

/// A table whose columns are filled in different rows: brought to the rows of the first stream.
class MergedCsvWalk final : public RowWalk {
 public:
  MergedCsvWalk(const std::filesystem::path& path, const CsvOptions& options, const std::vector<std::string>& names,
                const FirstRows& first, double longest_step, LogReport* report)
      : names_(names),
        first_(first),
        rows_(names, report),
        cleaner_(names, report),
        lines_(path, report != nullptr, options.trust),
        row_(names.size() + 1) {
    header_ = header_of(lines_, options, path.string());
    begin_rows(rows_, header_, path.string(), first_);
    rows_.let_miss(std::vector<bool>(names.size(), true));
    cleaner_.set_longest_step(longest_step);
    cleaner_.begin_file(path.string() + ":");
    std::vector<AlignedStream> aligned;
    for (const CsvStream& stream : first_.streams) {
      AlignedStream of;
      of.columns = stream.columns;
      for (const std::size_t c : stream.columns) {
        of.angle.push_back(names[c] == "theta");
      }
      of.longest_gap = longest_gap_of(stream.median_step);
      aligned.push_back(std::move(of));
    }
    aligner_.emplace(names.size(), std::move(aligned));
  }

  bool next(RowOutcome& outcome) override {
    std::int64_t ns = 0;
    while (!aligner_->pop(ns, std::span(row_).subspan(1))) {
      std::string_view line;
      if (finished_) {
        return false;
      }
      if (!lines_.next(line)) {
        aligner_->finish();
        finished_ = true;
      } else if (!take(line)) {
        outcome = RowOutcome::dropped;
        return true;
      }
    }
    row_[0] = waiting_.front().t;
    const std::size_t number = waiting_.front().number;
    waiting_.pop_front();
    for (std::size_t c = 0; c < names_.size(); ++c) {
      if (std::isnan(row_[c + 1])) {
        cleaner_.count(&LogReport::uncovered, number, names_[c]);
        outcome = RowOutcome::dropped;
        return true;
      }
    }
    outcome = cleaner_.place(row_, number);
    return true;
  }

  [[nodiscard]] double t() const override { return cleaner_.t(); }
  [[nodiscard]] const double* values() const override { return row_.data() + 1; }
  void describe(LogFileReport& file) const override {
    describe_file(lines_, header_, names_, first_, rows_, file);
    for (std::size_t s = 1; s < first_.streams.size(); ++s) {
      for (const std::size_t c : first_.streams[s].columns) {
        file.interpolated.push_back({names_[c],
                                     fmt::format("the rows that have it (a share of {:.2g})", first_.streams[s].filled),
                                     aligner_->error()[c]});
      }
      if (const std::size_t stale = aligner_->stale(s); stale > 0) {
        file.notes.push_back(fmt::format("{} samples of {} are not later than the one before and were left out", stale,
                                         names_[first_.streams[s].columns.front()]));
      }
    }
  }

 private:
  struct Waiting {
    double t = 0.0;
    std::size_t number = 0;
  };

  /// Hands the samples of a line to the aligner; false when the line, or its part of the first stream, is dropped.
  bool take(std::string_view line) {
    const std::size_t number = lines_.lines.number();
    if (!rows_.read_numbers(line, number, lines_.lines.terminated())) {
      return false;
    }
    const std::span<const double> values = rows_.row();
    if (!(std::abs(values[0]) * 1e9 < static_cast<double>(farthest_time))) {
      throw InputError(
          fmt::format("{}: time {} s: expected one within 146 years, where columns are filled in rows apart",
                      cleaner_.at(number), values[0]));
    }
    const std::int64_t ns = std::llround(values[0] * 1e9);
    bool whole = true;
    for (std::size_t s = 0; s < first_.streams.size(); ++s) {
      sample_.clear();
      std::size_t missing = 0;
      for (const std::size_t c : first_.streams[s].columns) {
        sample_.push_back(values[c + 1]);
        missing += std::isnan(values[c + 1]) ? 1 : 0;
      }
      if (missing == 0) {
        aligner_->push(s, ns, sample_);
        if (s == 0) {
          waiting_.push_back({values[0], number});
        }
      } else if (s == 0 && missing < sample_.size()) {
        cleaner_.count(&LogReport::empty, number);
        whole = false;
      }
    }
    return whole;
  }

  const std::vector<std::string>& names_;
  FirstRows first_;
  CsvRowReader rows_;
  RowCleaner cleaner_;
  FileWalk lines_;
  CsvHeader header_;
  std::optional<StreamAligner> aligner_;
  std::deque<Waiting> waiting_;  ///< rows of the first stream that are in the aligner
  std::vector<double> row_;      ///< time, then the columns
  std::vector<double> sample_;
  bool finished_ = false;
};

/// Finds rows that begin with an index which the header does not name (pandas with index_label=False, R's write.table)
/// and whose last column is empty: they have as many separators as rows that merely end with one, and would be read
/// with all columns shifted by one. They differ by this, in every row: the first field counts up by one; the field
/// behind that of the time rises, as the time under the index does; and the time as it would be read is either that
/// count, or does not rise. A table whose rows alone end with a separator is taken for one only where its time counts
/// up by one and its second column never falls; the message says how such a one is written.
class UnnamedIndex {
 public:
  explicit UnnamedIndex(const CsvHeader& header)
      : separator_(header.separator), known_(header.fields.size()), time_(header.found.at("t")) {}

  void add(std::string_view line, std::size_t number) {
    if (!possible_) {
      return;
    }
    const std::vector<std::string> fields = split_fields(line, separator_);
    possible_ = fields.size() == known_ + 1 && fields.back().empty();
    const auto count = possible_ ? files::to_number(fields[0]) : std::nullopt;
    const auto read = possible_ ? files::to_number(fields[time_]) : std::nullopt;
    const auto meant = possible_ ? files::to_number(fields[time_ + 1]) : std::nullopt;
    possible_ = count && meant && *count == std::floor(*count);
    if (possible_ && rows_ == 0) {
      first_ = {std::string(line), number};
    } else if (possible_) {
      possible_ = *count == count_ + 1.0 && *meant > meant_;
      read_rises_ = read_rises_ && read && *read > read_;
    }
    count_ = count.value_or(0.0);
    meant_ = meant.value_or(0.0);
    read_ = read.value_or(0.0);
    ++rows_;
  }

  /// Throws InputError where the rows begin with an index.
  void refuse(const std::string& path) const {
    constexpr std::size_t few = 10;
    if (possible_ && rows_ >= few && (time_ == 0 || !read_rises_)) {
      throw InputError(
          fmt::format("{}:{}: {} fields: expected {}, as the header has ({}); the first looks like an index of the "
                      "rows: expected a "
                      "name for it in the header (or, where it is none, a separator at the end of the header, too)",
                      path, first_.second, known_ + 1, known_, files::shown(first_.first)));
    }
  }

 private:
  char separator_;
  std::size_t known_, time_;
  bool possible_ = true, read_rises_ = true;
  std::size_t rows_ = 0;
  std::pair<std::string, std::size_t> first_;  ///< line and its number
  double count_ = 0.0, meant_ = 0.0, read_ = 0.0;
};

constexpr double longest_plausible = 1.0, shortest_plausible = 1e-5;  ///< s, median steps of a robot's log
constexpr double shortest_usual = 2.5e-4;                             ///< s, from which on nobody asks for the unit

/// The ones of `units` in which a median step of `step` of them is that of a robot's log, by one clock in s.
std::vector<CountUnit> units_of_step(double step, std::span<const CountUnit> units, double least, double most) {
  std::vector<CountUnit> found;
  for (const CountUnit& unit : units) {
    if (step * unit.seconds >= least && step * unit.seconds <= most) {
      found.push_back(unit);
    }
  }
  return found;
}

/// The one that units_of_step() finds; nullopt where there is none, or two.
std::optional<CountUnit> unit_of_step(double step, std::span<const CountUnit> units) {
  const std::vector<CountUnit> found = units_of_step(step, units, 2e-4, 0.5);
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

bool is_implausible(double step) {
  return step > longest_plausible * (1.0 + 1e-9) || (step > 0.0 && step < shortest_plausible);
}

/// Whether `t`, s since 1970 by a reading as ns, is a time since 2000 in ticks of 100 ns, since 1601 (Windows) or since
/// the year 1 (.NET): as ns they are months of 1974 and 1990, in which no robot was logged to the nanosecond.
bool is_time_of_ticks(double t) { return (t > 1.26e8 && t < 1.42e8) || (t > 6.31e8 && t < 6.47e8); }

/// Sets what is wrong with the unit of times whose median step is `step`, of which one is `t` (s, counted from where
/// the rows' clock begins), and what cures it where that is known: where a unit makes the step that of a robot's log.
void note_on_times(const CsvHeader& header, const CsvRowReader& rows, double t, double step, FirstRows& first) {
  if (rows.clock_unit() == "ns" && is_time_of_ticks(static_cast<double>(rows.clock_origin()))) {
    first.time_remedy = with_factor(header, "t", 1e-7);
    first.time_note = "the times look like ticks of 100 ns, not ns since 1970: expected s, or " + first.time_remedy;
    return;
  }
  if ((!is_implausible(step) && !(step > 0.0 && step < shortest_usual)) || rows.reads_moments()) {
    return;
  }
  constexpr std::array<CountUnit, 1> days = {{{86400.0, "days, as a spreadsheet writes them"}}};
  constexpr std::array<CountUnit, 3> long_units = {{{60.0, "min"}, {3600.0, "h"}, {86400.0, "days"}}};
  const bool serial = t > 3e4 && t < 6e4;  // days since 1900, from 1982 on
  std::vector<CountUnit> units;
  if (rows.clock_unit().empty() && step > longest_plausible) {
    units = units_of_step(step, count_units, 2e-4, 0.5);
    units.resize(units.size() == 1 ? 1 : 0);
  } else if (rows.clock_unit().empty()) {
    units = serial ? units_of_step(step, days, 2e-4, 0.5) : units_of_step(step, long_units, 1e-3, 0.2);
  }
  std::vector<std::string> remedies, names;
  for (const CountUnit& unit : units) {
    names.push_back(units.size() == 1 ? std::string(unit.name)
                                      : fmt::format("{} (then {:.3g} Hz)", unit.name, 1.0 / (step * unit.seconds)));
    remedies.push_back(with_factor(header, "t", unit.seconds));
  }
  first.time_remedy = core::listed(remedies, " or ");
  if (!is_implausible(step)) {
    return;
  }
  first.time_note = fmt::format("the median step is {:.4g} s: ", step) +
                    (units.empty() ? fmt::format("expected times in s, or --map t=\"{}*FACTOR\" where FACTOR makes s "
                                                 "of them",
                                                 header.fields[header.found.at("t")])
                                   : fmt::format("the times look like {}, not s: expected s, or {}",
                                                 core::listed(names, " or "), first.time_remedy));
}

/// The unit of counts that were taken for `guessed` by their size: another where the median `step`, in s of the guess,
/// is implausible and only that one makes it plausible.
std::optional<CountUnit> unit_by_step(std::string_view guessed, double step) {
  const auto unit = std::ranges::find(count_units, guessed, &CountUnit::name);
  const bool doubtful = unit != count_units.end() && is_implausible(step);
  return doubtful ? unit_of_step(step / unit->seconds, count_units) : std::nullopt;
}

class CsvFile final : public RowFile {
 public:
  CsvFile(std::filesystem::path path, CsvOptions options, TimeOrigin origin)
      : path_(std::move(path)), options_(std::move(options)), origin_(std::move(origin)) {
    FileWalk lines(path_, false, options_.trust);
    const CsvHeader header = header_of(lines, options_, path_.string());
    names_ = names_of(header);
    if (names_.empty() && !options_.only) {
      refuse_unknown_columns(header);
    }
  }

  [[nodiscard]] std::string path() const override { return path_.string(); }
  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  [[nodiscard]] std::unique_ptr<RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                              LogReport* report) override {
    if (looked_for_ != names) {
      look_at_first_rows(names);
    }
    if (first_.streams.size() > 1) {
      return std::make_unique<MergedCsvWalk>(path_, options_, names, first_, longest_step, report);
    }
    return std::make_unique<CsvWalk>(path_, options_, names, first_, longest_step, report);
  }

 private:
  /// Throws InputError where a file has columns beside the time and none is known: nothing would be read.
  void refuse_unknown_columns(const CsvHeader& header) const {
    std::vector<std::string> known = log_column_names();
    std::erase(known, "t");
    std::string hint;
    bool others = false;
    for (const std::string& field : fields_without(header, {})) {
      others = others || !field.empty();
      const std::string nearest = files::nearest_name(field, known);
      if (hint.empty() && !nearest.empty()) {
        hint = fmt::format("; did you mean {}? Then add --map {}=\"{}\"", nearest, nearest, field);
      }
    }
    for (const std::string& note : header.notes) {
      hint += "; " + note;
    }
    if (others) {
      throw InputError(fmt::format(
          "{}: no column but the time is known: the file has {}: expected one of {}, or --map "
          "NAME=COLUMN{}{}",
          path_.string(), core::listed(header.fields), core::listed(known), hint, known_logger(header.fields)));
    }
  }

  /// Looks at the first rows. What is wrong with one of them is left to the walk, which says so.
  void look_at_first_rows(const std::vector<std::string>& names) {
    CsvRowReader rows(names, nullptr);
    FileWalk lines(path_, false, options_.trust);
    const CsvHeader header = header_of(lines, options_, path_.string());
    rows.begin_file(header, path_.string());
    rows.let_miss(std::vector<bool>(names.size(), true));
    CsvStreamFinder finder(names);
    UnnamedIndex index(header);
    std::string_view line;
    first_ = {};
    first_.origin = origin_;
    try {
      for (std::size_t k = 0; k < rows_looked_at && lines.next(line); ++k) {
        if (rows.read_numbers(line, lines.lines.number(), lines.lines.terminated())) {
          finder.add(rows.row()[0], rows.row().data() + 1);
          index.add(line, lines.lines.number());
        }
      }
      first_.streams = finder.streams();
      judge_times(header, rows);
    } catch (const InputError&) {
      first_.streams.clear();
    }
    index.refuse(path_.string());
    std::size_t found = 0;
    for (const CsvStream& stream : first_.streams) {
      found += stream.columns.size();
    }
    if (found < names.size()) {
      first_.streams.clear();
    }
    looked_for_ = names;
  }

  /// Judges the unit of the times by the median step of the stream that gives the log its rows.
  void judge_times(const CsvHeader& header, const CsvRowReader& rows) {
    if (first_.streams.empty()) {
      return;
    }
    const double step = static_cast<double>(first_.streams.front().median_step) * 1e-9;
    first_.counts = unit_by_step(rows.clock_unit(), step);
    if (!first_.counts) {
      note_on_times(header, rows, rows.row()[0], step, first_);
      return;
    }
    const double ratio =
        first_.counts->seconds / std::ranges::find(count_units, rows.clock_unit(), &CountUnit::name)->seconds;
    for (CsvStream& stream : first_.streams) {
      stream.median_step = std::llround(static_cast<double>(stream.median_step) * ratio);
    }
  }

  std::filesystem::path path_;
  CsvOptions options_;
  std::vector<std::string> names_;
  std::vector<std::string> looked_for_;
  TimeOrigin origin_;
  FirstRows first_;
};

std::vector<std::unique_ptr<RowFile>> csv_files(const std::vector<std::filesystem::path>& paths,
                                                const CsvOptions& options) {
  check::that(!paths.empty(), "paths", "at least one file");
  check::that(options.block_rows > 0, "block_rows", "at least 1");
  std::vector<std::unique_ptr<RowFile>> files;
  const auto origin = std::make_shared<std::optional<std::int64_t>>();
  for (const auto& path : paths) {
    files.push_back(csv_file(path, options, origin));
  }
  return files;
}

}  // namespace

std::unique_ptr<RowFile> csv_file(const std::filesystem::path& path, const CsvOptions& options,
                                  const TimeOrigin& origin) {
  return std::make_unique<CsvFile>(path, options, origin);
}

CsvLog::CsvLog(const std::vector<std::filesystem::path>& paths, const CsvOptions& options)
    : RowLog(csv_files(paths, options), {options.block_rows, options.min_rows}) {}

struct CsvRowParser::Impl {
  CsvHeader header;
  std::vector<std::string> names;
  LogReport report;
  std::unique_ptr<CsvRowReader> rows;
  std::vector<double> steps;  ///< the first ones, while the median step is being learnt
  bool learning = false;
  std::size_t line_number = 1;
  double start = 0.0;
  double heading_offset = 0.0;  ///< rad

  static constexpr std::size_t fewest_steps = 20;
  static constexpr std::size_t most_steps = 101;

  void learn(double step) {
    steps.push_back(step);
    if (steps.size() >= fewest_steps) {
      std::vector<double> sorted = steps;
      use_median_step(middle_of(sorted));
    }
    learning = steps.size() < most_steps;
  }

  void use_median_step(double step) {
    report.median_step = step;
    rows->set_longest_step(gap_factor * step);
  }
};

CsvRowParser::CsvRowParser(std::string_view header, const CsvOptions& options, double median_step, std::string name)
    : impl_(std::make_unique<Impl>()) {
  check::non_negative(median_step, "median_step");
  if (header.starts_with("\xEF\xBB\xBF")) {
    header.remove_prefix(3);
  }
  while (header.ends_with('\n') || header.ends_with('\r')) {
    header.remove_suffix(1);
  }
  impl_->header = read_csv_header(header, options, name + ":1");
  impl_->heading_offset = options.heading_offset;
  impl_->names = names_of(impl_->header);
  impl_->rows = std::make_unique<CsvRowReader>(impl_->names, &impl_->report);
  impl_->rows->keep_seconds();
  impl_->rows->begin_file(impl_->header, std::move(name));
  impl_->learning = median_step == 0.0;
  if (!impl_->learning) {
    impl_->use_median_step(median_step);
  }
}

CsvRowParser::~CsvRowParser() = default;
CsvRowParser::CsvRowParser(CsvRowParser&&) noexcept = default;
CsvRowParser& CsvRowParser::operator=(CsvRowParser&&) noexcept = default;

const std::vector<std::string>& CsvRowParser::columns() const { return impl_->names; }
const LogReport& CsvRowParser::report() const { return impl_->report; }

void CsvRowParser::begin_counts() {
  LogReport& r = impl_->report;
  for (Occurrences* of : {&r.empty, &r.not_finite, &r.uncovered, &r.duplicates, &r.truncated, &r.resets, &r.gaps,
                          &r.jumps, &r.wraps, &r.angle_wraps}) {
    *of = {};
  }
}

bool CsvRowParser::parse(std::string_view line, LogBlock& block) {
  Impl& own = *impl_;
  ++own.line_number;
  while (line.ends_with('\n') || line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  if (!is_csv_content(line)) {
    return false;
  }
  const double before = own.rows->t();
  const RowOutcome outcome = own.rows->read(line, own.line_number, true);
  if (outcome == RowOutcome::dropped) {
    return false;
  }
  block.first_row = own.report.rows - 1;
  block.t.assign(1, own.rows->t());
  block.columns.resize(own.names.size());
  for (std::size_t c = 0; c < own.names.size(); ++c) {
    block.columns[c].assign(1, own.rows->values()[c] + (own.names[c] == "theta" ? own.heading_offset : 0.0));
  }
  block.segment_starts.clear();
  if (outcome == RowOutcome::new_segment) {
    block.segment_starts.push_back(0);
    ++own.report.segments;
  } else {
    own.report.seconds += own.rows->t() - before;
    if (own.learning) {
      own.learn(own.rows->t() - before);
    }
  }
  return true;
}

namespace {

constexpr double rarely_missing = 0.2;

}  // namespace

CsvStreamFinder::CsvStreamFinder(std::vector<std::string> names) : names_(std::move(names)), filled_(names_.size()) {}

void CsvStreamFinder::add(double t, const double* values) {
  t_.push_back(t);
  for (std::size_t c = 0; c < filled_.size(); ++c) {
    filled_[c].push_back(!std::isnan(values[c]));
  }
}

std::vector<CsvStream> CsvStreamFinder::streams() const {
  std::vector<CsvStream> found;
  std::vector<std::vector<bool>> rows;  // of each stream
  std::optional<std::size_t> dense;
  for (std::size_t c = 0; c < filled_.size(); ++c) {
    const auto count = static_cast<double>(std::ranges::count(filled_[c], true));
    const double share = t_.empty() ? 1.0 : count / static_cast<double>(t_.size());
    if (share == 0.0) {
      continue;
    }
    const bool is_dense = share >= 1.0 - rarely_missing;
    auto stream = is_dense ? dense : std::nullopt;
    for (std::size_t s = 0; !is_dense && s < rows.size(); ++s) {
      stream = rows[s] == filled_[c] ? std::optional(s) : stream;
    }
    if (!stream) {
      stream = found.size();
      found.emplace_back();
      found.back().filled = share;
      rows.push_back(filled_[c]);
      dense = is_dense ? stream : dense;
    }
    found[*stream].columns.push_back(c);
  }
  for (std::size_t s = 0; s < found.size(); ++s) {
    std::vector<double> steps;
    std::optional<double> before;
    for (std::size_t k = 0; k < t_.size(); ++k) {
      if (rows[s][k]) {
        if (before && t_[k] > *before) {
          steps.push_back(t_[k] - *before);
        }
        before = t_[k];
      }
    }
    found[s].median_step = std::llround(std::min(middle_of(steps) * 1e9, static_cast<double>(farthest_time)));
  }
  const auto weight = [&](const CsvStream& stream) {
    int sum = 0;
    for (const std::size_t c : stream.columns) {
      sum += row_weight(names_[c]);
    }
    return sum;
  };
  std::ranges::stable_sort(found, [&](const CsvStream& a, const CsvStream& b) { return weight(a) > weight(b); });
  return found;
}

}  // namespace wheelwright::logs
