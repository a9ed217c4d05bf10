// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/csv_rows.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/io/log_columns.hpp>
#include <wheelwright/io/number.hpp>
#include <wheelwright/io/suggest.hpp>

namespace wheelwright {
namespace {

/// Nothing, or one of the words NA, N/A, null and none in any case.
bool means_missing(std::string_view text) {
  constexpr std::array<std::string_view, 5> words = {"", "na", "n/a", "null", "none"};
  return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
    return std::equal(word.begin(), word.end(), text.begin(), text.end(),
                      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  });
}

bool is_blank(char c) { return c == ' ' || c == '\t'; }

}  // namespace

CsvRowReader::CsvRowReader(std::vector<std::string> names, LogReport* report)
    : names_(std::move(names)), report_(report), values_(names_.size() + 1) {
  limits_.push_back(find_log_column("t")->limit);
  for (const std::string& name : names_) {
    const LogColumn* column = find_log_column(name);
    limits_.push_back(column != nullptr ? column->limit : std::numeric_limits<double>::max());
    if (name == "theta") {
      theta_ = limits_.size() - 1;
    }
  }
}

void CsvRowReader::begin_file(const CsvHeader& header, std::string path) {
  path_ = std::move(path);
  fields_ = header.fields;
  separator_ = header.separator;
  slots_.assign(fields_.size(), -1);
  const auto take = [&](const std::string& name, int slot) {
    const auto found = header.found.find(name);
    if (found == header.found.end()) {
      throw InputError(fmt::format("{}: no column for {}: expected one of {}", path_, name, listed(fields_)));
    }
    int& of_field = slots_[found->second];
    if (of_field >= 0) {
      throw InputError(fmt::format("{}: column {} is taken for {} and for {}: expected a column for each", path_,
                                   shown(fields_[found->second]),
                                   of_field == 0 ? "t" : names_[static_cast<std::size_t>(of_field) - 1], name));
    }
    of_field = slot;
  };
  take("t", 0);
  for (std::size_t c = 0; c < names_.size(); ++c) {
    take(names_[c], static_cast<int>(c) + 1);
  }
  fresh_ = true;
}

/// Reads the numbers of a line into values_; returns the number of fields. The first and gravest defect is kept.
std::size_t CsvRowReader::read_fields(std::string_view line, Defect& defect) {
  const char* p = line.data();
  const char* const end = p + line.size();
  const char separator = separator_;
  const std::size_t known = slots_.size();
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
      const char* q = parse_number(p, end, value);
      if (q == nullptr || (q != end && *q != separator)) {
        q = read_odd_field(p, end, field, value, defect);
      } else if (!(std::abs(value) <= limits_[index])) {
        const Fault fault = std::isfinite(value) ? Fault::limit : Fault::not_finite;
        if (fault > defect.fault) {
          defect = {fault, field, std::string_view(p, static_cast<std::size_t>(q - p))};
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
  Fault fault = Fault::none;
  if (p == last || parse_number(p, last, value) != last) {
    fault = means_missing(text) ? Fault::empty : Fault::text;
  } else if (!std::isfinite(value)) {
    fault = Fault::not_finite;
  } else if (!(std::abs(value) <= limits_[static_cast<std::size_t>(slots_[field])])) {
    fault = Fault::limit;
  }
  if (fault > defect.fault) {
    defect = {fault, field, text};
  }
  return stop;
}

CsvRowReader::Outcome CsvRowReader::read(std::string_view line, std::size_t line_number, bool terminated) {
  Defect defect;
  const std::size_t fields = read_fields(line, defect);
  const std::size_t known = slots_.size();
  const bool extra_separator = fields == known + 1 && line.ends_with(separator_);
  const bool nameless_last = fields + 1 == known && fields_.back().empty();
  const bool countable = fields == known || extra_separator || nameless_last;
  if (!terminated && ((!countable && fields < known) || defect.fault == Fault::text)) {
    count(&LogReport::truncated, line_number);
    return Outcome::dropped;
  }
  if (!countable) {
    throw InputError(
        fmt::format("{}: {} fields: expected {}, as the header has ({})", at(line_number), fields, known, shown(line)));
  }
  if (defect.fault == Fault::text || defect.fault == Fault::limit) {
    throw InputError(at(line_number) + ": " + describe(defect));
  }
  if (defect.fault != Fault::none) {
    count(defect.fault == Fault::empty ? &LogReport::empty : &LogReport::not_finite, line_number,
          fields_[defect.field]);
    return Outcome::dropped;
  }
  return place_row(line_number);
}

/// Decides by the time stamp what a row of finite numbers is.
CsvRowReader::Outcome CsvRowReader::place_row(std::size_t line_number) {
  const double t = values_[0];
  bool starts = fresh_;
  if (!fresh_) {
    const double step = t - t_;
    if (step == 0.0) {
      count(&LogReport::duplicates, line_number);
      return Outcome::dropped;
    }
    if (step < 0.0) {
      count(&LogReport::resets, line_number);
      starts = true;
    } else if (step > longest_step_) {
      count(&LogReport::gaps, line_number);
      starts = true;
    }
  }
  t_ = t;
  fresh_ = false;
  if (report_ != nullptr) {
    ++report_->rows_read;
    ++report_->rows;
  }
  if (theta_ != 0) {
    unwrap(starts, line_number);
  }
  return starts ? Outcome::new_segment : Outcome::row;
}

void CsvRowReader::unwrap(bool new_segment, std::size_t line_number) {
  double& theta = values_[theta_];
  if (new_segment) {
    turns_ = 0.0;
  } else if (std::abs(theta - theta_before_) > std::numbers::pi) {
    turns_ -= std::round((theta - theta_before_) / (2.0 * std::numbers::pi));
    if (report_ != nullptr && report_->wraps.count++ == 0) {
      report_->wraps.first = at(line_number);
    }
  }
  theta_before_ = theta;
  theta += turns_ * 2.0 * std::numbers::pi;
}

void CsvRowReader::count(Occurrences LogReport::*what, std::size_t line_number, std::string_view detail) {
  if (report_ == nullptr) {
    return;
  }
  Occurrences& met = report_->*what;
  if (met.count++ == 0) {
    met.first = at(line_number) + (detail.empty() ? "" : fmt::format(", column {}", detail));
  }
  const bool row_lost = what != &LogReport::resets && what != &LogReport::gaps;
  report_->rows_read += row_lost ? 1 : 0;
}

std::string CsvRowReader::at(std::size_t line_number) const { return fmt::format("{}:{}", path_, line_number); }

std::string CsvRowReader::describe(const Defect& defect) const {
  const std::string where = fmt::format("column {}: {}", shown(fields_[defect.field]), shown(defect.text));
  const auto slot = static_cast<std::size_t>(slots_[defect.field]);
  const LogColumn* column = find_log_column(slot == 0 ? "t" : names_[slot - 1]);
  if (defect.fault == Fault::text) {
    const bool comma = defect.text.find(',') != std::string_view::npos;
    return fmt::format("{}: expected a number{}", where, comma ? " with a decimal point" : "");
  }
  if (column == nullptr) {
    return where + ": expected a finite number";
  }
  return fmt::format("{}: expected {} in {}, of magnitude at most {:g}", where, column->meaning, column->unit,
                     column->limit);
}

}  // namespace wheelwright
