// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/csv.hpp>

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/io/csv_rows.hpp>
#include <wheelwright/io/line_reader.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t steps_for_median = 100001;
constexpr double gap_factor = 5.0;
using Outcome = CsvRowReader::Outcome;

double middle_of(std::vector<double>& steps) {
  if (steps.empty()) {
    return 0.0;
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Content lines of one file behind its header.
struct FileWalk {
  FileWalk(const std::filesystem::path& path, bool hashed) : lines(open_bytes(path, hashed), path.string()) {}

  bool next(std::string_view& line) {
    while (lines.next(line)) {
      if (is_csv_content(line)) {
        return true;
      }
    }
    return false;
  }

  LineReader lines;
};

CsvHeader header_of(FileWalk& walk, const CsvOptions& options, const std::string& path) {
  std::string_view line;
  if (!walk.next(line)) {
    throw InputError(path + ": no header line: expected the names of the columns, then rows");
  }
  return read_csv_header(line, options, fmt::format("{}:{}", path, walk.lines.number()));
}

/// Names (time apart) that all of `headers` have, in the order of the first one's fields.
std::vector<std::string> shared_names(const std::vector<CsvHeader>& headers) {
  std::vector<std::pair<std::size_t, std::string>> by_field;
  for (const auto& [name, field] : headers.front().found) {
    const bool everywhere = std::all_of(headers.begin(), headers.end(),
                                        [&, &wanted = name](const CsvHeader& h) { return h.found.contains(wanted); });
    if (name != "t" && everywhere) {
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

}  // namespace

struct CsvLog::Impl {
  std::vector<std::filesystem::path> paths;
  CsvOptions options;
  std::vector<CsvHeader> headers;
  std::vector<std::string> names;
  LogReport report;

  std::size_t file = 0;
  std::unique_ptr<FileWalk> walk;
  std::unique_ptr<CsvRowReader> rows;
  std::size_t first_row = 0;

  /// Opens file `k` behind its header, for `reader`.
  std::unique_ptr<FileWalk> begin(std::size_t k, CsvRowReader& reader, bool hashed) {
    auto opened = std::make_unique<FileWalk>(paths[k], hashed);
    reader.begin_file(header_of(*opened, options, paths[k].string()), paths[k].string());
    return opened;
  }

  void read_headers() {
    for (const auto& path : paths) {
      FileWalk opened(path, false);
      headers.push_back(header_of(opened, options, path.string()));
    }
    names = shared_names(headers);
  }

  /// Median over the first steps > 0, from a reading that counts nothing.
  void find_median_step() {
    std::vector<double> steps;
    CsvRowReader reader(names, nullptr);
    for (std::size_t k = 0; k < paths.size() && steps.size() < steps_for_median; ++k) {
      const auto opened = begin(k, reader, false);
      std::string_view line;
      double before = 0.0;
      while (steps.size() < steps_for_median && opened->next(line)) {
        const Outcome outcome = reader.read(line, opened->lines.number(), opened->lines.terminated());
        if (outcome == Outcome::row) {
          steps.push_back(reader.t() - before);
        }
        before = reader.t();
      }
    }
    report.median_step = middle_of(steps);
  }

  /// Reads everything once and fills the report.
  void survey() {
    CsvRowReader reader(names, &report);
    reader.set_longest_step(longest_step());
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const std::size_t rows_before = report.rows;
      auto& file_report = report.files.emplace_back();
      const auto opened = begin(k, reader, true);
      std::string_view line;
      double start = 0.0, last = 0.0;
      while (opened->next(line)) {
        const Outcome outcome = reader.read(line, opened->lines.number(), opened->lines.terminated());
        if (outcome == Outcome::new_segment) {
          ++file_report.segments;
          file_report.seconds += last - start;
          start = reader.t();
        }
        last = outcome == Outcome::dropped ? last : reader.t();
      }
      file_report.path = paths[k].string();
      file_report.packing = opened->lines.source().packing();
      file_report.bytes = opened->lines.source().file_bytes();
      file_report.hash = opened->lines.source().hash();
      file_report.header = headers[k].fields;
      file_report.ignored = fields_without(headers[k], names);
      file_report.rows = report.rows - rows_before;
      file_report.seconds += last - start;
      report.segments += file_report.segments;
      report.seconds += file_report.seconds;
    }
  }

  void judge() const {
    const std::string where = paths.front().string() + (paths.size() > 1 ? " and the other files" : "");
    if (report.rows < std::max<std::size_t>(options.min_rows, 1)) {
      std::string message = fmt::format("{}: {} usable rows of {}: expected at least {}", where, report.rows,
                                        report.rows_read, options.min_rows);
      for (const std::string& sentence : sentences(report)) {
        message += "; " + sentence;
      }
      throw InputError(message);
    }
    if (report.rows > 1 && !(report.median_step > 0.0) && report.resets.count > 0) {
      throw InputError(where + ": column t never increases: expected times in seconds, one row after the other");
    }
  }

  [[nodiscard]] double longest_step() const {
    return report.median_step > 0.0 ? gap_factor * report.median_step : std::numeric_limits<double>::infinity();
  }

  void rewind() {
    file = 0;
    first_row = 0;
    walk.reset();
    rows = std::make_unique<CsvRowReader>(names, nullptr);
    rows->set_longest_step(longest_step());
  }

  bool next(LogBlock& block) {
    const std::size_t limit = options.block_rows;
    block.first_row = first_row;
    block.segment_starts.clear();
    block.t.resize(limit);
    block.columns.resize(names.size());
    for (auto& column : block.columns) {
      column.resize(limit);
    }
    std::size_t count = 0;
    std::string_view line;
    while (count < limit && file < paths.size()) {
      if (!walk) {
        walk = begin(file, *rows, false);
      }
      if (!walk->next(line)) {
        walk.reset();
        ++file;
        continue;
      }
      const Outcome outcome = rows->read(line, walk->lines.number(), walk->lines.terminated());
      if (outcome == Outcome::dropped) {
        continue;
      }
      if (outcome == Outcome::new_segment) {
        block.segment_starts.push_back(count);
      }
      block.t[count] = rows->t();
      for (std::size_t c = 0; c < names.size(); ++c) {
        block.columns[c][count] = rows->values()[c];
      }
      ++count;
    }
    block.t.resize(count);
    for (auto& column : block.columns) {
      column.resize(count);
    }
    first_row += count;
    return count > 0;
  }
};

CsvLog::CsvLog(std::vector<std::filesystem::path> paths, CsvOptions options) : impl_(std::make_unique<Impl>()) {
  check::that(!paths.empty(), "paths", "at least one file");
  check::that(options.block_rows > 0, "block_rows", "at least 1");
  impl_->paths = std::move(paths);
  impl_->options = std::move(options);
  impl_->read_headers();
  impl_->find_median_step();
  impl_->survey();
  impl_->judge();
  impl_->rewind();
}

CsvLog::~CsvLog() = default;
CsvLog::CsvLog(CsvLog&&) noexcept = default;
CsvLog& CsvLog::operator=(CsvLog&&) noexcept = default;

const std::vector<std::string>& CsvLog::columns() const { return impl_->names; }
bool CsvLog::next(LogBlock& block) { return impl_->next(block); }
void CsvLog::rewind() { impl_->rewind(); }
double CsvLog::median_step() const { return impl_->report.median_step; }
const LogReport& CsvLog::report() const { return impl_->report; }

struct CsvRowParser::Impl {
  CsvHeader header;
  std::vector<std::string> names;
  LogReport report;
  std::unique_ptr<CsvRowReader> rows;
  std::vector<double> steps;  ///< the first ones, while the median step is being learnt
  bool learning = false;
  std::size_t line_number = 1;
  double start = 0.0;

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
  impl_->names = shared_names({impl_->header});
  impl_->rows = std::make_unique<CsvRowReader>(impl_->names, &impl_->report);
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
  const Outcome outcome = own.rows->read(line, own.line_number, true);
  if (outcome == Outcome::dropped) {
    return false;
  }
  block.first_row = own.report.rows - 1;
  block.t.assign(1, own.rows->t());
  block.columns.resize(own.names.size());
  for (std::size_t c = 0; c < own.names.size(); ++c) {
    block.columns[c].assign(1, own.rows->values()[c]);
  }
  block.segment_starts.clear();
  if (outcome == Outcome::new_segment) {
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

}  // namespace wheelwright
