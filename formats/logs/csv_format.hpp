// SPDX-License-Identifier: Apache-2.0
/// \file
/// The CSV format: header line (separator, columns) and rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/logs/row_log.hpp"

namespace wheelwright::logs {

/// Options for reading a CSV log.
struct CsvOptions {
  /// Contract name (or a name in `extra`) -> column of the file (of a bag TOPIC.PATH, of an HDF5 file a dataset), for
  /// headers that no spelling covers (`--map name=column`). It goes before everything else. COLUMN*FACTOR multiplies
  /// what stands in COLUMN, for logs in other units, where no column is called so; *FACTOR alone the column that is
  /// found without an entry. Of a bag also velocity[JOINT] or
  /// effort[JOINT,JOINT] without a topic: what has no such joints is read as if there were no such entry.
  std::map<std::string, std::string> map;
  /// Names in `map` that a file may lack the column of, where it has one called by the name itself: a robot file's
  /// `columns:` also takes what `convert` has written under the names of the contract.
  std::vector<std::string> or_by_name;
  /// Further columns to read under their own names; a file that lacks one is an error.
  std::vector<std::string> extra;
  /// Where given, only these contract columns are read (and those in `map` and `extra`), as far as the files have them;
  /// otherwise every contract column that all files have. A defect in a column that is not read does no harm.
  std::optional<std::vector<std::string>> only;
  std::size_t block_rows = 4096;  ///< rows of a block, at least 1
  std::size_t min_rows = 20;      ///< usable rows that a log must have
  double heading_offset = 0.0;    ///< rad, added to `theta` (Robot::heading_offset)
  bool leaps = true;              ///< whether rows are read in which a speed, rate or angle leaps away and back
  /// Whether a file may reach for others, and unpack without limit. Otherwise a log reads itself, the files of its
  /// directory that its metadata name, and the journal beside it: no path out of the directory, no link that leads out
  /// of it, no HDF5 dataset whose values stand in another file, no copy of a journal of more than 4 GiB or of a
  /// database of more than 16 GiB, no file that consists of holes, and what is packed may have no more than
  /// files::most_unpacked() bytes.
  bool trust = false;
};

/// A header, understood.
struct CsvHeader {
  char separator = ',';
  std::vector<std::string> fields;           ///< the columns as written, quotes and surrounding blanks removed
  std::map<std::string, std::size_t> found;  ///< wanted name (`t` among them) -> field
  std::map<std::string, double> factors;     ///< wanted name -> FACTOR of its field, where it has one
  std::vector<std::string> notes;            ///< fields called like a column and not taken for their unit, and why
  std::vector<std::string> units;            ///< of a second line, without brackets, one for each field; else empty
};

/// A unit in which clocks count.
struct CountUnit {
  double seconds = 1.0;
  std::string_view name;
};
inline constexpr std::array<CountUnit, 3> count_units = {{{1e-9, "ns"}, {1e-6, "µs"}, {1e-3, "ms"}}};

/// Tells a heading in degrees from one in radians, in which an angle never jumps by nearly 360.
class HeadingUnit {
 public:
  void add(double theta);
  /// True where all values lie in [-180, 180] or [0, 360] with jumps from one end to the other.
  [[nodiscard]] bool degrees() const;

 private:
  double before_ = std::numeric_limits<double>::quiet_NaN();
  double least_ = std::numeric_limits<double>::infinity(), most_ = -least_;
  bool jumps_ = false;
};

/// `--map NAME="FIELD*FACTOR"`, as an argument of the program.
[[nodiscard]] std::string map_argument(std::string_view name, std::string_view field, double factor);

/// Says of CsvOptions::or_by_name that a file has the column `name` instead of `field`.
[[nodiscard]] std::string by_its_own_name(std::string_view field, std::string_view name);

/// Whether a field of a header is called like the times of a log, in whichever unit.
[[nodiscard]] bool names_time(const std::string& field);

/// The character that separates the fields of a header line: the one of , ; tab and | that occurs most often outside
/// quotes; the comma where none does.
[[nodiscard]] char separator_of(std::string_view line);

/// COLUMN and FACTOR of COLUMN*FACTOR; the whole and 1 where it is none.
[[nodiscard]] std::pair<std::string, double> split_factor(const std::string& text);

/// FACTOR of "*FACTOR", which multiplies the column that is found without it; nothing where `text` names a column.
[[nodiscard]] std::optional<double> factor_alone(const std::string& text);

/// Splits `line` at `separator`; quotes around a field are removed ("" inside them is one quote), and blanks around it.
[[nodiscard]] std::vector<std::string> split_fields(std::string_view line, char separator);

/// Reads the header `line`; `units` are those of a second line. Where a field's unit is a known one that is not the
/// contract's own, it gets the factor that converts it. `place` is "file:line" for messages. Throws InputError when it
/// is binary or begins with numbers, a name of `map` or `extra` is not there, two fields mean the same column, or there
/// is no time.
[[nodiscard]] CsvHeader read_csv_header(std::string_view line, const CsvOptions& options, const std::string& place,
                                        std::vector<std::string> units = {});

/// The units that `line`, the second of a table whose first is `header`, gives instead of numbers: one for each field,
/// without brackets, empty where none is. Nothing where it is no such line.
[[nodiscard]] std::optional<std::vector<std::string>> units_in_line(std::string_view header, std::string_view line);

/// Whether `line` is "sep=;" or the like, which Excel puts before the header.
[[nodiscard]] bool names_separator(std::string_view line);

/// True if `line` is neither blank nor a comment (#).
[[nodiscard]] bool is_csv_content(std::string_view line);

/// The cleaning of a log, row by row; the same for whole files and for a live stream.
class CsvRowReader {
 public:
  /// `names` are the columns to read, time apart. What is met is counted in `report` where that is not null.
  CsvRowReader(std::vector<std::string> names, LogReport* report);

  /// Begins a file (and with it a segment) with this header. Throws InputError when two of the columns are one field,
  /// or a name is not in the header.
  void begin_file(const CsvHeader& header, std::string path);

  /// Unit of the times that were read where they are whole counts of a wall clock: "ms", "µs", "ns"; else nothing.
  [[nodiscard]] std::string_view clock_unit() const { return clock_.unit; }
  /// What times are counted from, s: whole seconds where they are those of a wall clock, else 0.
  [[nodiscard]] std::int64_t clock_origin() const { return clock_.origin; }
  /// "UTC" where the times say so, or count from 1970; empty where they are of a zone that is not told, or no dates.
  [[nodiscard]] std::string_view clock_zone() const { return clock_.zone; }
  /// True where the times are dates, times of the day or durations; with a date of which day and month could change
  /// places.
  [[nodiscard]] bool reads_moments() const { return clock_.kind == Clock::Kind::moments; }
  [[nodiscard]] bool day_or_month() const { return clock_.day_or_month; }

  /// Takes the origin of the times from `origin` (ns) where it has one that is less than ten years away, and sets it
  /// where it has none. Without it each file begins with its own.
  void share_origin(TimeOrigin origin) { shared_origin_ = std::move(origin); }
  /// Leaves times that are s since 1970 as they are.
  void keep_seconds() { keep_seconds_ = true; }

  /// Takes times of the file just begun that lie beyond LogColumn::limit for counts of `unit`, whatever their size.
  void assume_counts(const CountUnit& unit) { clock_.assumed = unit; }

  /// What the headings met tell of their unit.
  [[nodiscard]] const HeadingUnit& heading() const { return heading_; }

  /// Steps longer than `seconds` are gaps.
  void set_longest_step(double seconds) { cleaner_.set_longest_step(seconds); }

  /// Reads one line that has content. A line that is not `terminated` may be cut off: it is then dropped where
  /// otherwise it would be an error. Throws InputError (and keeps the state of before) for text instead of a number, a
  /// wrong number of fields, and a value beyond LogColumn::limit.
  RowOutcome read(std::string_view line, std::size_t line_number, bool terminated);

  /// Columns (marks in the order of `names`) that may be missing: an empty, NaN or infinite field of theirs is then
  /// NaN, and no reason to drop the row. For read_numbers().
  void let_miss(std::vector<bool> columns);

  /// The first half of read(): false where the row was dropped (and counted); else row() has its numbers as they are
  /// written, neither sorted into segments nor unwrapped, and it is not counted.
  bool read_numbers(std::string_view line, std::size_t line_number, bool terminated);
  /// Time and values of the last line.
  [[nodiscard]] std::span<const double> row() const { return values_; }

  /// Time of the last row, s.
  [[nodiscard]] double t() const { return cleaner_.t(); }
  /// Values of the last row, in the order of `names`.
  [[nodiscard]] const double* values() const { return values_.data() + 1; }

 private:
  enum class Fault { none, empty, not_finite, limit, text };
  struct Defect {
    Fault fault = Fault::none;
    std::size_t field = 0;
    std::string_view text;
  };

  /// How the times of a file are written, as the first of them tells. A double does not hold nanoseconds since 1970:
  /// times of a wall clock are counted from a whole second.
  struct Clock {
    enum class Kind {
      unknown,  ///< no time was read yet
      plain,    ///< numbers, times factor_
      counts,   ///< whole counts of `seconds`
      epoch,    ///< s since 1970, times factor_
      moments,  ///< dates, times of the day, durations
    };
    Kind kind = Kind::unknown;
    double seconds = 1.0;     ///< of a count
    std::string_view unit{};  ///< of counts whose size told their unit
    std::int64_t origin = 0;  ///< s
    std::string_view zone{};
    bool since_1970 = false;  ///< of moments
    bool day_or_month = false;
    std::optional<CountUnit> assumed{};
  };
  void begin_clock(std::optional<std::int64_t> count);
  void convert_time(std::string_view text);
  bool read_moment(std::string_view text, double& t);

  std::size_t read_fields(std::string_view line, Defect& defect);
  const char* read_odd_field(const char* p, const char* end, std::size_t field, double& value, Defect& defect);
  [[nodiscard]] std::string describe(const Defect& defect) const;
  [[nodiscard]] bool may_miss(std::size_t value) const { return !missable_.empty() && missable_[value]; }

  std::vector<std::string> names_;
  RowCleaner cleaner_;

  std::string path_;
  std::vector<std::string> fields_;
  Clock clock_;
  double time_factor_ = 1.0;
  TimeOrigin shared_origin_;
  bool keep_seconds_ = false;
  bool points_ = false, commas_ = false;  ///< whether numbers with a decimal point, with a comma were met
  HeadingUnit heading_;
  std::size_t theta_ = 0;   ///< index of the heading in values_, 0 where there is none
  std::vector<int> slots_;  ///< field -> index in values_, or −1
  char separator_ = ',';
  std::vector<double> values_;                           ///< time, then the columns
  std::vector<double> limits_;                           ///< of the numbers as written
  std::vector<std::pair<std::size_t, double>> factors_;  ///< of values_
  std::vector<bool> missable_;                           ///< of each value; empty: none
};

}  // namespace wheelwright::logs
