// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/raw_signals.hpp>

#include <algorithm>

namespace wheelwright::report {
namespace {

// Every four neighbours within a segment become two: the smallest and the largest value of each column, at the first time
// and at the middle one. Rows that are pairs already become pairs of twice the length.
void halve(LogTable& table) {
  std::vector<std::size_t> starts;
  std::size_t segment = 0, out = 0;
  for (std::size_t first = 0; first < table.rows();) {
    while (segment < table.segment_starts.size() && table.segment_starts[segment] <= first) {
      if (table.segment_starts[segment++] == first) {
        starts.push_back(out);
      }
    }
    const std::size_t limit = segment < table.segment_starts.size() ? table.segment_starts[segment] : table.rows();
    const std::size_t last = std::min(first + 4, limit), n = last - first;
    const double middle = table.t[first + n / 2];
    table.t[out] = table.t[first];
    if (n > 1) {
      table.t[out + 1] = middle;
    }
    for (std::vector<double>& column : table.columns) {
      const auto at = column.begin() + static_cast<std::ptrdiff_t>(first);
      const auto [low, high] = std::minmax_element(at, at + static_cast<std::ptrdiff_t>(n));
      const double smallest = *low, largest = *high;
      column[out] = smallest;
      if (n > 1) {
        column[out + 1] = largest;
      }
    }
    out += std::min<std::size_t>(n, 2);
    first = last;
  }
  table.t.resize(out);
  for (std::vector<double>& column : table.columns) {
    column.resize(out);
  }
  table.segment_starts = std::move(starts);
}

// A table that is halved whenever it is full; then what follows is joined as far as what it holds.
class Recorder {
 public:
  Recorder(const std::vector<std::string>& names, std::size_t most) : most_(std::max<std::size_t>(most, 16)) {
    table_.names = names;
    table_.columns.resize(names.size());
    low_.resize(names.size());
    high_.resize(names.size());
  }

  void add(const LogBlock& block, std::size_t row, bool starts) {
    if (starts || in_bin_ == length_) {
      flush();
    }
    if (in_bin_ == 0) {
      first_ = block.t[row];
      starts_ = starts;
    }
    if (2 * in_bin_ <= length_) {
      middle_ = block.t[row];
    }
    for (std::size_t c = 0; c < low_.size(); ++c) {
      const double value = block.columns[c][row];
      low_[c] = in_bin_ == 0 ? value : std::min(low_[c], value);
      high_[c] = in_bin_ == 0 ? value : std::max(high_[c], value);
    }
    ++in_bin_;
  }

  LogTable finish() {
    flush();
    return std::move(table_);
  }

 private:
  void flush() {
    if (in_bin_ == 0) {
      return;
    }
    if (table_.rows() + std::min<std::size_t>(in_bin_, 2) > most_) {
      const std::size_t before = table_.rows();
      halve(table_);
      length_ = length_ == 1 ? 4 : 2 * length_;
      if (4 * table_.rows() > 3 * before) {
        most_ *= 2;  // nearly one segment a bin: little can be joined
      }
    }
    if (starts_) {
      table_.segment_starts.push_back(table_.rows());
    }
    append(first_, low_);
    if (in_bin_ > 1) {
      append(middle_, high_);
    }
    in_bin_ = 0;
  }

  void append(double t, const std::vector<double>& values) {
    table_.t.push_back(t);
    for (std::size_t c = 0; c < values.size(); ++c) {
      table_.columns[c].push_back(values[c]);
    }
  }

  LogTable table_;
  std::size_t most_;
  std::size_t length_ = 1;  // rows of the log in a bin
  std::size_t in_bin_ = 0;
  double first_ = 0.0, middle_ = 0.0;
  bool starts_ = false;
  std::vector<double> low_, high_;
};

}  // namespace

LogTable raw_signals(LogSource& log, std::size_t most) {
  Recorder recorder(log.columns(), most);
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const bool starts = segment < block.segment_starts.size() && block.segment_starts[segment] == k;
      segment += starts ? 1 : 0;
      recorder.add(block, k, starts);
    }
  }
  log.rewind();
  return recorder.finish();
}

}  // namespace wheelwright::report
