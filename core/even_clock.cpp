// SPDX-License-Identifier: Apache-2.0
#include "core/even_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"

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

void EvenTimes::put(double stamp, double index) {
  const double off = place_of(stamp) - index;
  ++seen_;
  phase_ += std::clamp(off, -0.5, 0.5) / static_cast<double>(std::min(seen_, kMemory));
  index_ = index;
  last_ = anchor_ + index * clock_.step;
  places_.push_back({.t = last_, .starts = false, .off = off});
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
  const auto sure = [&](double stamp) { return std::abs(place_of(stamp) - std::round(place_of(stamp))) <= kSure; };
  const double newest = std::round(place_of(kept_.back()));
  const bool full = newest - index_ == static_cast<double>(kept_.size()) && sure(kept_.back());
  bool told = full;
  if (!told && kept_.size() > 1) {
    double before = index_;
    told = newest - std::round(place_of(*(kept_.end() - 2))) == 1.0 && std::ranges::all_of(kept_, [&](double stamp) {
             const double place = std::round(place_of(stamp));
             return sure(stamp) && place > std::exchange(before, place);
           });
  }
  if (!told) {
    if (kept_.size() >= (seen_ < kPhaseKnown ? kFirstKept : kMostKept)) {
      give_up();
    }
    return;
  }
  std::vector<double> indices;  // before the phase moves
  for (const double stamp : kept_) {
    indices.push_back(full ? index_ + static_cast<double>(indices.size() + 1) : std::round(place_of(stamp)));
  }
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    put(kept_[k], indices[k]);
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

LogTable read_evenly(const LogTable& table, const EvenClock& clock) {
  EvenSource source(std::make_shared<TableSource>(table), clock);
  return read_all(source);
}

}  // namespace wheelwright::core
