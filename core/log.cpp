// SPDX-License-Identifier: Apache-2.0
#include "core/log.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace wheelwright::core {

std::optional<std::size_t> LogSource::find(std::string_view name) const {
  const auto& names = columns();
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(it - names.begin());
}

const std::vector<double>* LogTable::find(std::string_view name) const {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? nullptr : &columns[static_cast<std::size_t>(at - names.begin())];
}

const std::vector<double>& LogTable::column(std::string_view name) const {
  if (const std::vector<double>* found = find(name)) {
    return *found;
  }
  throw InvalidArgument("log: no column '" + std::string(name) + "'");
}

std::vector<double>& LogTable::column(std::string_view name) {
  return const_cast<std::vector<double>&>(std::as_const(*this).column(name));
}

std::vector<std::size_t> positions_of(const LogSource& log, const std::vector<std::string>& columns,
                                      const std::string& why) {
  std::vector<std::size_t> positions;
  for (const std::string& name : columns) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'" + why);
    positions.push_back(*column);
  }
  return positions;
}

double median_step(const std::vector<double>& t) {
  if (t.size() < 2) {
    return 0.0;
  }
  std::vector<double> steps(t.size() - 1);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    steps[k] = t[k + 1] - t[k];
  }
  return median(std::move(steps));
}

void check_segments(const LogTable& table) {
  const std::vector<std::size_t>& starts = table.segment_starts;
  check::that(std::ranges::adjacent_find(starts, std::greater_equal()) == starts.end() &&
                  (starts.empty() || starts.back() < std::max<std::size_t>(table.rows(), 1)),
              "log", "segments that begin at rows of it, in ascending order, each once");
}

LogTable slice(const LogTable& table, std::size_t first, std::size_t last) {
  check::that(first <= last && last <= table.rows(), "slice", "first <= last <= rows of the table");
  const auto part = [&](const std::vector<double>& from) {
    return std::vector<double>(from.begin() + static_cast<std::ptrdiff_t>(first),
                               from.begin() + static_cast<std::ptrdiff_t>(last));
  };
  LogTable out;
  out.names = table.names;
  out.t = part(table.t);
  for (const auto& column : table.columns) {
    out.columns.push_back(part(column));
  }
  if (first < last) {
    out.segment_starts.push_back(0);
  }
  for (const std::size_t start : table.segment_starts) {
    if (start > first && start < last) {
      out.segment_starts.push_back(start - first);
    }
  }
  return out;
}

TableSource::TableSource(const LogTable& table, std::size_t block_rows)
    : table_(&table), block_rows_(block_rows), median_step_(wheelwright::core::median_step(table.t)) {
  check::that(block_rows > 0, "block_rows", "at least 1");
  check::that(table.names.size() == table.columns.size(), "log", "one name for each column");
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    check::that(table.columns[c].size() == table.rows(), "log column '" + table.names[c] + "'",
                "as many values as there are times");
    for (const double value : table.columns[c]) {
      check::finite(value, "log column '" + table.names[c] + "'");
    }
  }
  check_segments(table);
  for (std::size_t k = 0; k < table.rows(); ++k) {
    check::finite(table.t[k], "log time");
    const bool starts = k == 0 || std::binary_search(table.segment_starts.begin(), table.segment_starts.end(), k);
    check::that(starts || table.t[k] > table.t[k - 1], "log time", "strictly increasing inside a segment");
  }
}

const std::vector<std::string>& TableSource::columns() const { return table_->names; }

void TableSource::rewind() { position_ = 0; }

double TableSource::median_step() const { return median_step_; }

bool TableSource::next(LogBlock& block) {
  const std::size_t rows = std::min(block_rows_, table_->rows() - position_);
  const auto copy = [&](const std::vector<double>& from, std::vector<double>& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(position_),
              from.begin() + static_cast<std::ptrdiff_t>(position_ + rows));
  };
  block.first_row = position_;
  block.columns.resize(table_->columns.size());
  copy(table_->t, block.t);
  for (std::size_t c = 0; c < table_->columns.size(); ++c) {
    copy(table_->columns[c], block.columns[c]);
  }
  block.segment_starts.clear();
  if (position_ == 0 && rows > 0) {
    block.segment_starts.push_back(0);
  }
  const auto& starts = table_->segment_starts;
  for (auto it = std::lower_bound(starts.begin(), starts.end(), std::max<std::size_t>(position_, 1));
       it != starts.end() && *it < position_ + rows; ++it) {
    block.segment_starts.push_back(*it - position_);
  }
  position_ += rows;
  return rows > 0;
}

std::unique_ptr<LogSource> TableSource::another_walk() const {
  auto walk = std::make_unique<TableSource>(*this);
  walk->position_ = 0;
  return walk;
}

LogTable read_all(LogSource& source, std::size_t most) {
  source.rewind();
  LogTable table;
  table.names = source.columns();
  table.columns.resize(table.names.size());
  LogBlock block;
  while (table.rows() < most && source.next(block)) {
    const std::size_t rows = std::min(block.rows(), most - table.rows());
    for (const std::size_t start : block.segment_starts) {
      if (start < rows) {
        table.segment_starts.push_back(table.rows() + start);
      }
    }
    const auto append = [rows](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(rows));
    };
    append(table.t, block.t);
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      append(table.columns[c], block.columns[c]);
    }
  }
  source.rewind();
  return table;
}

}  // namespace wheelwright::core
