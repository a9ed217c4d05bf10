// SPDX-License-Identifier: Apache-2.0
#include "raw_signals.hpp"

#include <algorithm>

namespace wheelwright::app {
namespace {

struct Bin {
  double first = 0.0, last = 0.0;
  bool starts = false;
  std::vector<double> low, high;

  void absorb(const Bin& other) {
    last = other.last;
    for (std::size_t c = 0; c < low.size(); ++c) {
      low[c] = std::min(low[c], other.low[c]);
      high[c] = std::max(high[c], other.high[c]);
    }
  }
};

// Joins neighbours within a segment.
void halve(std::vector<Bin>& bins) {
  std::vector<Bin> joined;
  joined.reserve(bins.size() / 2 + 1);
  for (std::size_t k = 0; k < bins.size();) {
    joined.push_back(std::move(bins[k++]));
    if (k < bins.size() && !bins[k].starts) {
      joined.back().absorb(bins[k++]);
    }
  }
  bins.swap(joined);
}

}  // namespace

LogTable raw_signals(LogSource& log, std::size_t most) {
  std::size_t most_bins = std::max<std::size_t>(most / 2, 8);
  std::vector<Bin> bins;
  std::size_t length = 1;
  std::size_t in_last = 0;
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      Bin bin{block.t[k], block.t[k], false, {}, {}};
      if (segment < block.segment_starts.size() && block.segment_starts[segment] == k) {
        bin.starts = true;
        ++segment;
      }
      for (const auto& column : block.columns) {
        bin.low.push_back(column[k]);
        bin.high.push_back(column[k]);
      }
      if (!bins.empty() && !bin.starts && in_last < length) {
        bins.back().absorb(bin);
        ++in_last;
        continue;
      }
      if (bins.size() >= most_bins) {
        const std::size_t before = bins.size();
        halve(bins);
        length *= 2;
        if (2 * bins.size() > before + before / 2) {
          most_bins *= 2;  // nearly one segment a bin: little can be joined
        }
      }
      bins.push_back(std::move(bin));
      in_last = 1;
    }
  }
  log.rewind();
  LogTable table;
  table.names = log.columns();
  table.columns.resize(table.names.size());
  for (const Bin& bin : bins) {
    if (bin.starts) {
      table.segment_starts.push_back(table.t.size());
    }
    const bool two = bin.last > bin.first;
    table.t.push_back(bin.first);
    if (two) {
      table.t.push_back(0.5 * (bin.first + bin.last));
    }
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      table.columns[c].push_back(bin.low[c]);
      if (two) {
        table.columns[c].push_back(bin.high[c]);
      }
    }
  }
  return table;
}

}  // namespace wheelwright::app
