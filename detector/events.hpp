// SPDX-License-Identifier: Apache-2.0
/// \file
/// Events from decisions: start, end, channel, peak; k-of-n persistence.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace wheelwright::detector {

/// One fault event in one channel.
struct Event {
  std::size_t output = 0;        ///< channel
  double start = 0.0;            ///< time of the first instant outside the threshold, s
  double alarm = 0.0;            ///< time at which the persistence rule was satisfied, s
  double end = 0.0;              ///< time of the last instant outside the threshold, s
  double peak_time = 0.0;        ///< where the residual was furthest outside, s
  double peak_residual = 0.0;    ///< ε there
  double peak_ratio = 0.0;       ///< distance of ε from the middle of [l, u] over half its width there, > 1
  std::size_t instants = 0;      ///< number of instants outside
  std::size_t start_sample = 0;  ///< row of the log of the first one
};

/// Persistence: an alarm is raised when at least `k` of the last `n` instants lie outside the threshold.
struct Persistence {
  std::size_t k = 1;  ///< >= 1
  std::size_t n = 1;  ///< >= k, at most 64
};

/// Persistence of one channel. No allocation.
class PersistenceCounter {
 public:
  /// Throws InvalidArgument unless 1 <= k <= n <= 64.
  explicit PersistenceCounter(Persistence rule = {});
  /// Takes whether the next instant lies outside; returns whether an alarm stands.
  bool step(bool outside) noexcept;
  /// Forgets all instants.
  void reset() noexcept { window_ = 0; }

 private:
  Persistence rule_;
  unsigned long long window_ = 0;
};

/// Gathers events of one detector; instants outside that are less than `merge` seconds apart belong to one event.
class EventRecorder {
 public:
  /// For `outputs` channels.
  EventRecorder(std::size_t outputs, double merge);
  /// One instant of a channel. `outside`: ε outside its threshold; `alarm`: the persistence rule is satisfied. Returns
  /// true when this instant opens an event (its alarm is new).
  bool add(std::size_t output, std::size_t sample, double t, double residual, double lower, double upper, bool outside,
           bool alarm);
  /// All events so far, in order of their alarms; an open event ends at its last instant outside.
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }

 private:
  struct Channel {
    Event candidate;
    bool any = false;     // the candidate holds an instant
    bool raised = false;  // it has become events_[index]
    std::size_t index = 0;
  };
  double merge_;
  std::vector<Channel> channels_;
  std::vector<Event> events_;
};

/// The k-th smallest of the last n sizes: what an alarm under a rule "k of n" needs.
class Lasting {
 public:
  /// For the rule `persistence`.
  explicit Lasting(Persistence persistence) : persistence_(persistence) {}

  /// Takes the smallest size that the next instant shows (infinite: none); returns the smallest that k of the last n
  /// instants show, infinite where there is none.
  double add(double size) {
    last_.push_back(size);
    if (last_.size() > persistence_.n) {
      last_.erase(last_.begin());
    }
    if (last_.size() < persistence_.k) {
      return std::numeric_limits<double>::infinity();
    }
    std::vector<double> sorted = last_;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(persistence_.k - 1);
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }

 private:
  Persistence persistence_;
  std::vector<double> last_;
};

}  // namespace wheelwright::detector
