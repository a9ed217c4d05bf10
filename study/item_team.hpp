// SPDX-License-Identifier: Apache-2.0
/// \file
/// Items that threads evaluate while the thread that gave them does something else.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace wheelwright {

/// Threads beside the calling one (oneTBB's). One thread calls the members.
class ItemTeam {
 public:
  /// What came of an item: its result, or what was thrown.
  struct Outcome {
    std::size_t item = 0;
    std::string result = {};
    std::exception_ptr failure = {};
  };

  /// `evaluate` as Work::evaluate; it outlives the team.
  ItemTeam(const std::function<std::string(std::size_t)>& evaluate, std::size_t threads);
  /// Drops the items that wait, and waits for those under way.
  ~ItemTeam();
  ItemTeam(const ItemTeam&) = delete;
  ItemTeam& operator=(const ItemTeam&) = delete;

  /// Lets `item` be evaluated, behind those given before.
  void give(std::size_t item);
  /// Forgets the items that no thread has begun.
  void drop();
  /// The next outcome, where there is one.
  [[nodiscard]] std::optional<Outcome> take();
  /// Items given and neither dropped nor taken.
  [[nodiscard]] std::size_t held();
  /// Sleeps until an outcome can be taken, or `microseconds` have passed.
  void wait(int microseconds);

 private:
  class Threads;
  void evaluate_one();

  const std::function<std::string(std::size_t)>& evaluate_;
  std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  std::deque<std::size_t> waiting_;
  std::deque<Outcome> outcomes_;
  std::size_t under_way_ = 0;
  std::size_t tasks_ = 0;  // enqueued and not ended
  std::unique_ptr<Threads> threads_;
};

}  // namespace wheelwright
