// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/row_log.hpp>

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t steps_for_median = 100001;

}  // namespace

double middle_of(std::vector<double>& steps) {
  if (steps.empty()) {
    return 0.0;
  }
  return median(std::move(steps));
}

RowLog::RowLog(std::vector<std::unique_ptr<RowFile>> files, RowLogOptions options)
    : files_(std::move(files)), options_(options) {
  check::that(!files_.empty(), "files", "at least one");
  check::that(options_.block_rows > 0, "block_rows", "at least 1");
  for (const std::string& name : files_.front()->columns()) {
    if (std::ranges::all_of(files_, [&](const auto& file) {
          return std::ranges::find(file->columns(), name) != file->columns().end();
        })) {
      names_.push_back(name);
    }
  }
  find_median_step();
  survey();
  judge();
}

std::unique_ptr<RowWalk> RowLog::open(std::size_t file, LogReport* report) {
  return files_[file]->open(names_, longest_step(), report);
}

/// Median over the first steps > 0, from a reading that counts nothing.
void RowLog::find_median_step() {
  std::vector<double> steps;
  for (std::size_t k = 0; k < files_.size() && steps.size() < steps_for_median; ++k) {
    const auto walk = open(k, nullptr);
    RowOutcome outcome{};
    double before = 0.0;
    while (steps.size() < steps_for_median && walk->next(outcome)) {
      if (outcome == RowOutcome::row) {
        steps.push_back(walk->t() - before);
      }
      before = walk->t();
    }
  }
  report_.median_step = middle_of(steps);
}

void RowLog::survey() {
  for (std::size_t k = 0; k < files_.size(); ++k) {
    const std::size_t rows_before = report_.rows;
    report_.files.emplace_back();
    const auto walk = open(k, &report_);
    LogFileReport& file = report_.files.back();
    RowOutcome outcome{};
    double start = 0.0, last = 0.0;
    while (walk->next(outcome)) {
      if (outcome == RowOutcome::new_segment) {
        ++file.segments;
        file.seconds += last - start;
        start = walk->t();
      }
      last = outcome == RowOutcome::dropped ? last : walk->t();
    }
    file.path = files_[k]->path();
    walk->describe(file);
    file.rows = report_.rows - rows_before;
    file.seconds += last - start;
    report_.segments += file.segments;
    report_.seconds += file.seconds;
  }
}

void RowLog::judge() const {
  const std::string where = files_[0]->path() + (files_.size() > 1 ? " and the other files" : "");
  if (report_.rows < std::max<std::size_t>(options_.min_rows, 1)) {
    std::string message = fmt::format("{}: {} usable rows of {}: expected at least {}", where, report_.rows,
                                      report_.rows_read, options_.min_rows);
    for (const std::string& sentence : sentences(report_)) {
      message += "; " + sentence;
    }
    throw InputError(message);
  }
  if (report_.rows > 1 && !(report_.median_step > 0.0) && report_.resets.count > 0) {
    throw InputError(where + ": column t never increases: expected times in seconds, one row after the other");
  }
}

double RowLog::longest_step() const {
  return report_.median_step > 0.0 ? gap_factor * report_.median_step : std::numeric_limits<double>::infinity();
}

void RowLog::rewind() {
  file_ = 0;
  first_row_ = 0;
  walk_.reset();
}

bool RowLog::next(LogBlock& block) {
  const std::size_t limit = options_.block_rows;
  const std::size_t width = names_.size();
  block.first_row = first_row_;
  block.segment_starts.clear();
  block.t.resize(limit);
  block.columns.resize(width);
  for (auto& column : block.columns) {
    column.resize(limit);
  }
  std::size_t count = 0;
  RowOutcome outcome{};
  while (count < limit && file_ < files_.size()) {
    if (!walk_) {
      walk_ = open(file_, nullptr);
    }
    if (!walk_->next(outcome)) {
      walk_.reset();
      ++file_;
      continue;
    }
    if (outcome == RowOutcome::dropped) {
      continue;
    }
    if (outcome == RowOutcome::new_segment) {
      block.segment_starts.push_back(count);
    }
    block.t[count] = walk_->t();
    for (std::size_t c = 0; c < width; ++c) {
      block.columns[c][count] = walk_->values()[c];
    }
    ++count;
  }
  block.t.resize(count);
  for (auto& column : block.columns) {
    column.resize(count);
  }
  first_row_ += count;
  return count > 0;
}

}  // namespace wheelwright
