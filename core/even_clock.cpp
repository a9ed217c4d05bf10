// SPDX-License-Identifier: Apache-2.0
#include "core/even_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace wheelwright::core {
namespace {

constexpr double kSure = 0.3;           // of a step: a stamp this near to a place belongs to it
constexpr std::size_t kMemory = 200;    // rows of the running mean
constexpr std::size_t kMostKept = 32;   // rows that wait for a later one
constexpr std::size_t kFirstKept = 8;   // the same before the phase is known
constexpr std::size_t kPhaseKnown = 8;  // rows
constexpr double kApart = 1e-3;         // of a step, between rows of which nothing is known

}  // namespace

EvenTimes::EvenTimes(const EvenClock& clock) : clock_(clock) {
  check::positive(clock.step, "clock step");
  check::that(clock.drift >= 0.0 && clock.drift < 0.1, "clock drift", "a number inside [0, 0.1)");
}

void EvenTimes::restart() {
  kept_.clear();
  places_.clear();
  seen_ = 0;
}

void EvenTimes::begin(double stamp) {
  anchor_ = last_ = stamp;
  phase_ = index_ = 0.0;
  seen_ = 1;
  places_.push_back({.t = stamp, .starts = true});
}

void EvenTimes::put(double stamp, double index, bool starts) {
  const double off = place_of(stamp) - index;
  ++seen_;
  if (std::abs(off) <= kSure) {  // of rows that came together the others tell when they were sent
    phase_ += off / static_cast<double>(std::min(seen_, kMemory));
  }
  index_ = index;
  last_ = anchor_ + index * clock_.step;
  places_.push_back({.t = last_, .starts = starts, .off = off});
}

void EvenTimes::take(double stamp, bool starts) {
  if (starts || seen_ == 0) {
    finish();
    begin(stamp);
    return;
  }
  kept_.push_back(stamp);
  settle();
}

void EvenTimes::settle() {
  const std::size_t n = kept_.size();
  // Places next to the stamps, but each before that of the row after it; those that a stamp and its neighbours agree
  // on.
  std::vector<double> places(n);
  std::vector<bool> agreed(n);
  for (std::size_t k = n; k-- > 0;) {
    const double at = place_of(kept_[k]), near = std::round(at);
    places[k] = k + 1 < n ? std::min(near, places[k + 1] - 1.0) : near;
    agreed[k] = std::abs(at - near) <= kSure && places[k] == near;
  }
  const bool full = agreed.back() && places.back() - index_ == static_cast<double>(n);
  const bool beside = n > 1 && agreed[n - 1] && agreed[n - 2] && places[n - 1] - places[n - 2] == 1.0;
  if (!full && (!beside || places.front() <= index_)) {
    if (n >= (seen_ < kPhaseKnown ? kFirstKept : kMostKept)) {
      give_up();
    }
    return;
  }
  for (std::size_t k = 0; full && k < n; ++k) {
    places[k] = index_ + static_cast<double>(k + 1);
    agreed[k] = true;
  }
  for (std::size_t k = 0, next = 0; k < n; k = next + 1) {
    next = k;
    while (!agreed[next]) {
      ++next;
    }
    // As many rows as places up to the next agreed one, or nobody knows which.
    const bool all = places[next] - index_ == static_cast<double>(next - k + 1);
    for (std::size_t i = k; i <= next; ++i) {
      put(kept_[i], places[i], !all && next > k);
    }
  }
  kept_.clear();
}

void EvenTimes::give_up() {
  const double newest = kept_.back();
  kept_.pop_back();
  finish();
  begin(std::max(newest, last_ + kApart * clock_.step));
}

void EvenTimes::finish() {
  for (const double stamp : kept_) {
    last_ = std::max(stamp, last_ + kApart * clock_.step);
    places_.push_back({.t = last_, .starts = true});
  }
  kept_.clear();
  seen_ = 0;
}

std::optional<EvenTimes::Place> EvenTimes::next() {
  if (places_.empty()) {
    return std::nullopt;
  }
  const Place place = places_.front();
  places_.pop_front();
  return place;
}

EvenSource::EvenSource(std::shared_ptr<LogSource> log, const EvenClock& clock)
    : log_(std::move(log)), clock_(clock), times_(clock) {
  check::that(log_ != nullptr, "log", "one");
  log_->rewind();
}

void EvenSource::rewind() {
  log_->rewind();
  times_.restart();
  rows_.clear();
  first_row_ = 0;
  ended_ = false;
}

bool EvenSource::next(LogBlock& block) {
  block.first_row = first_row_;
  block.t.clear();
  block.segment_starts.clear();
  block.columns.resize(columns().size());
  for (std::vector<double>& column : block.columns) {
    column.clear();
  }
  while (block.rows() == 0 && !ended_) {
    if (log_->next(read_)) {
      std::size_t segment = 0;
      for (std::size_t k = 0; k < read_.rows(); ++k) {
        const bool starts = segment < read_.segment_starts.size() && read_.segment_starts[segment] == k;
        segment += starts ? 1 : 0;
        times_.take(read_.t[k], starts);
        std::vector<double>& row = rows_.emplace_back();
        for (const std::vector<double>& column : read_.columns) {
          row.push_back(column[k]);
        }
      }
    } else {
      ended_ = true;
      times_.finish();
    }
    while (const auto place = times_.next()) {
      if (place->starts) {
        block.segment_starts.push_back(block.rows());
      }
      block.t.push_back(place->t);
      for (std::size_t c = 0; c < block.columns.size(); ++c) {
        block.columns[c].push_back(rows_.front()[c]);
      }
      rows_.pop_front();
    }
  }
  first_row_ += block.rows();
  return block.rows() > 0;
}

std::unique_ptr<LogSource> EvenSource::another_walk() const {
  std::shared_ptr<LogSource> walk = log_->another_walk();
  return walk ? std::make_unique<EvenSource>(std::move(walk), clock_) : nullptr;
}

double step_of_bursts(const std::vector<double>& t) {
  constexpr std::size_t kSpan = 30, kFewest = 200;
  std::vector<double> spans;
  for (std::size_t k = 0; t.size() >= kFewest && k + kSpan < t.size(); ++k) {
    spans.push_back((t[k + kSpan] - t[k]) / static_cast<double>(kSpan));
  }
  return spans.empty() ? 0.0 : median(std::move(spans));
}

LogTable read_evenly(const LogTable& table, const EvenClock& clock) {
  EvenSource source(std::make_shared<TableSource>(table), clock);
  return read_all(source);
}

}  // namespace wheelwright::core
