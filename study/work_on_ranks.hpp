// SPDX-License-Identifier: Apache-2.0
/// \file
/// Independent items of work on the processes that mpirun started, with the results of one thread: the MPI session, the
/// polling interval for messages, and items that threads evaluate in the background.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "study/work.hpp"

namespace wheelwright::study {

/// MPI, started by the constructor and ended by the destructor; one per process, since MPI starts once. Every process
/// that mpirun started has to make one, and to come to its end. Only the thread that made it calls MPI.
class MpiSession {
 public:
  /// Throws Error where MPI was started before, or does not admit a thread of its own beside others
  /// (MPI_THREAD_FUNNELED).
  MpiSession();
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;

  [[nodiscard]] int rank() const { return rank_; }  ///< of this process, from 0
  [[nodiscard]] int size() const { return size_; }  ///< number of processes

 private:
  int rank_ = 0;
  int size_ = 1;
};

/// Time between two looks: short while something happens, doubled at each look that found nothing.
class LookInterval {
 public:
  /// The time to the next look, 50 to 2000 µs.
  [[nodiscard]] int next(bool busy) {
    microseconds_ = busy ? kShortest : std::min(2 * microseconds_, kLongest);
    return microseconds_;
  }

 private:
  static constexpr int kShortest = 50;
  static constexpr int kLongest = 2000;
  int microseconds_ = kShortest;
};

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

/// run_work() on all ranks; each has to call it. Rank 0 hands items out to whoever has little left, evaluates items
/// itself, and puts each result into the store as soon as it has arrived. The others send each result as soon as it is
/// done, and have an item or more waiting for each thread, so that no rank waits idle for a message. Looks for messages
/// are up to 2 ms apart and keep no processor busy. A killed rank ends all (mpirun sees to that): what rank 0 had put
/// is in the store, and what was under way or on its way is evaluated again by the next run.
///
/// \param mpi          the session of MPI
/// \param work         the same on every rank
/// \param fingerprint  what all ranks have to agree on, in lines; nothing is evaluated before they do
/// \param open         called on rank 0 alone, once: the store, which has to live until the end
/// \param options      `threads` of this rank, beside the one that sends and receives; `progress` is called on rank 0;
/// no shard
/// \returns on rank 0 what the whole run did, elsewhere what the rank evaluated.
///
/// Throws on rank 0 what an item or the store throws, as run_work() does; what comes from another rank is InputError,
/// Error or std::runtime_error again, and names the rank. InputError names the rank that has another fingerprint. The
/// other ranks return as if all were well. Throws InvalidArgument on every rank for no thread or a shard.
RunCount run_work_on_ranks(const MpiSession& mpi, const Work& work, const std::string& fingerprint,
                           const std::function<ResultStore&()>& open, const RunOptions& options = {});

}  // namespace wheelwright::study
