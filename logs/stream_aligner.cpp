// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/stream_aligner.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright::logs {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;
constexpr double unseen = 9.0 / 8.0;

}  // namespace

StreamAligner::StreamAligner(std::size_t width, std::vector<AlignedStream> streams, std::int64_t patience)
    : width_(width), patience_(patience), newest_(std::numeric_limits<std::int64_t>::min()), error_(width, 0.0) {
  check::that(!streams.empty(), "streams", "at least one");
  std::vector<bool> taken(width, false);
  for (AlignedStream& layout : streams) {
    check::that(layout.columns.size() == layout.angle.size(), "stream", "one mark of an angle for each column");
    for (const std::size_t column : layout.columns) {
      check::that(column < width && !taken[column], "stream", "columns of the row, each in one stream");
      taken[column] = true;
    }
    streams_.push_back({std::move(layout), {}, {}, 0});
  }
}

void StreamAligner::push(std::size_t stream, std::int64_t time, std::span<const double> values) {
  Stream& own = streams_[stream];
  check::that(values.size() == own.layout.columns.size(), "values", "one for each column of the stream");
  if (stream > 0 && !own.samples.empty() && time <= own.samples.back().time) {
    ++own.stale;
    return;
  }
  Sample sample;
  if (!own.spare.empty()) {
    sample = std::move(own.spare.back());
    own.spare.pop_back();
  }
  sample.time = time;
  sample.values.assign(values.begin(), values.end());
  if (stream > 0 && !own.samples.empty()) {
    const std::vector<double>& before = own.samples.back().values;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (own.layout.angle[k] && std::isfinite(before[k])) {
        sample.values[k] -= turn * std::round((sample.values[k] - before[k]) / turn);
      }
    }
  }
  own.samples.push_back(std::move(sample));
  newest_ = std::max(newest_, time);
}

void StreamAligner::finish() { finished_ = true; }

bool StreamAligner::ready(std::int64_t time) const {
  return finished_ || newest_ - time > patience_ ||
         std::all_of(streams_.begin() + 1, streams_.end(), [&](const Stream& stream) {
           return !stream.samples.empty() && stream.samples.back().time >= time;
         });
}

bool StreamAligner::pop(std::int64_t& time, std::span<double> row) {
  Stream& first = streams_.front();
  if (first.samples.empty() || !ready(first.samples.front().time)) {
    return false;
  }
  Sample& sample = first.samples.front();
  time = sample.time;
  std::fill(row.begin(), row.end(), core::kNan);
  for (std::size_t k = 0; k < sample.values.size(); ++k) {
    row[first.layout.columns[k]] = sample.values[k];
  }
  first.spare.push_back(std::move(sample));
  first.samples.pop_front();
  for (std::size_t s = 1; s < streams_.size(); ++s) {
    interpolate(streams_[s], time, row);
  }
  return true;
}

void StreamAligner::interpolate(Stream& stream, std::int64_t time, std::span<double> row) {
  // Two samples before the time are enough: one to interpolate from and one to see how the signal bends.
  while (stream.samples.size() > 2 && stream.samples[2].time <= time) {
    stream.spare.push_back(std::move(stream.samples.front()));
    stream.samples.pop_front();
  }
  const auto& samples = stream.samples;
  std::size_t right = 0;
  while (right < samples.size() && samples[right].time < time) {
    ++right;
  }
  if (right == samples.size()) {
    return;
  }
  const Sample& after = samples[right];
  const bool exact = after.time == time;
  if (!exact && (right == 0 || after.time - samples[right - 1].time > stream.layout.longest_gap)) {
    return;
  }
  for (std::size_t k = 0; k < after.values.size(); ++k) {
    const std::size_t column = stream.layout.columns[k];
    if (exact) {
      row[column] = after.values[k];
      continue;
    }
    const Sample& before = samples[right - 1];
    const double h = static_cast<double>(after.time - before.time);
    const double share = static_cast<double>(time - before.time) / h;
    const double slope = (after.values[k] - before.values[k]) / h;
    row[column] = before.values[k] + share * (after.values[k] - before.values[k]);
    double bend = 0.0;
    const auto widen = [&](double other_slope, std::int64_t span) {
      const double second = 2.0 * std::abs(other_slope - slope) / static_cast<double>(span);
      bend = std::isfinite(second) ? std::max(bend, second) : bend;
    };
    if (right >= 2) {
      const Sample& far = samples[right - 2];
      widen((before.values[k] - far.values[k]) / static_cast<double>(before.time - far.time), after.time - far.time);
    }
    if (right + 1 < samples.size()) {
      const Sample& far = samples[right + 1];
      widen((far.values[k] - after.values[k]) / static_cast<double>(far.time - after.time), far.time - before.time);
    }
    const double late = std::abs(slope) * static_cast<double>(stream.layout.time_error);
    error_[column] = std::max(error_[column], unseen * 0.5 * share * (1.0 - share) * h * h * bend + late);
  }
}

}  // namespace wheelwright::logs
