// SPDX-License-Identifier: Apache-2.0
#include "study/work_on_ranks.hpp"

#include <chrono>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include <mpi.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "study/rank_coordinator.hpp"

namespace wheelwright::study {

MpiSession::MpiSession() {
  int begun = 0;
  MPI_Initialized(&begun);
  if (begun != 0) {
    throw Error("MPI was started before in this process: expected one session");
  }
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  if (provided < MPI_THREAD_FUNNELED) {
    MPI_Finalize();
    throw Error("this MPI admits no threads: expected MPI_THREAD_FUNNELED");
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiSession::~MpiSession() { MPI_Finalize(); }

class ItemTeam::Threads {
 public:
  // The calling thread counts among oneTBB's, and evaluates nothing.
  explicit Threads(std::size_t threads)
      : limit_(oneapi::tbb::global_control::max_allowed_parallelism, threads + 1),
        arena_(static_cast<int>(threads), 0) {}

  template <typename Task>
  void enqueue(Task task) {
    arena_.enqueue(std::move(task));
  }

 private:
  oneapi::tbb::global_control limit_;
  oneapi::tbb::task_arena arena_;
};

ItemTeam::ItemTeam(const std::function<std::string(std::size_t)>& evaluate, std::size_t threads)
    : evaluate_(evaluate), threads_(std::make_unique<Threads>(threads)) {}

ItemTeam::~ItemTeam() {
  drop();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return tasks_ == 0; });
}

void ItemTeam::give(std::size_t item) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(item);
    ++tasks_;
  }
  threads_->enqueue([this] { evaluate_one(); });
}

void ItemTeam::drop() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
}

std::optional<ItemTeam::Outcome> ItemTeam::take() {
  const std::lock_guard lock(mutex_);
  if (outcomes_.empty()) {
    return std::nullopt;
  }
  Outcome outcome = std::move(outcomes_.front());
  outcomes_.pop_front();
  return outcome;
}

std::size_t ItemTeam::held() {
  const std::lock_guard lock(mutex_);
  return waiting_.size() + under_way_ + outcomes_.size();
}

void ItemTeam::wait(int microseconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::microseconds(microseconds), [this] { return !outcomes_.empty(); });
}

void ItemTeam::evaluate_one() {
  std::unique_lock lock(mutex_);
  if (!waiting_.empty()) {
    Outcome outcome{waiting_.front()};
    waiting_.pop_front();
    ++under_way_;
    lock.unlock();
    try {
      outcome.result = evaluate_(outcome.item);
    } catch (...) {
      outcome.failure = std::current_exception();
    }
    lock.lock();
    --under_way_;
    outcomes_.push_back(std::move(outcome));
  }
  --tasks_;
  changed_.notify_all();  // with the lock: the destructor goes on behind it
}

namespace {

constexpr std::size_t kBytesAMessage = std::size_t{1} << 20U;

// The part of the ranks behind 0.
class Helper {
 public:
  Helper(const Work& work, const std::string& fingerprint, std::size_t threads) : team_(work.evaluate, threads) {
    std::string hello;
    append(hello, threads);
    messages_.send(0, RankWord::hello, hello + fingerprint);
  }

  RunCount run() {
    LookInterval interval;
    while (!stopping_ || team_.held() != 0) {
      const bool busy = listen();
      const bool sent = send_outcomes();
      team_.wait(interval.next(busy || sent || messages_.sending()));
    }
    send_outcomes();
    messages_.send(0, RankWord::ended);
    while (!left_) {
      team_.wait(interval.next(listen() || messages_.sending()));
    }
    return count_;
  }

 private:
  bool listen() {
    const std::optional<RankMessage> message = messages_.receive();
    if (!message) {
      return false;
    }
    std::string_view bytes = message->bytes;
    if (message->word == RankWord::stop) {
      stopping_ = true;
      team_.drop();
    }
    left_ = message->word == RankWord::leave;
    while (message->word == RankWord::items && !failed_ && !stopping_ && !bytes.empty()) {
      team_.give(taken_number(bytes));
    }
    return true;
  }

  bool send_outcomes() {
    bool sent = false;
    std::string results;
    while (std::optional<ItemTeam::Outcome> outcome = team_.take()) {
      sent = true;
      if (outcome->failure) {
        fail(outcome->failure);
        continue;
      }
      ++count_.evaluated;
      append(results, outcome->item, outcome->result);
      if (results.size() >= kBytesAMessage) {
        send(std::exchange(results, {}));
      }
    }
    if (!results.empty()) {
      send(std::move(results));
    }
    return sent;
  }

  void send(std::string results) {
    try {
      messages_.send(0, RankWord::results, std::move(results));
    } catch (...) {
      fail(std::current_exception());
    }
  }

  // Rank 0 answers with `stop`.
  void fail(const std::exception_ptr& failure) {
    failed_ = true;
    team_.drop();
    messages_.send(0, RankWord::failure, packed(failure));
  }

  bool stopping_ = false;
  bool failed_ = false;
  bool left_ = false;
  RunCount count_;
  RankMessages messages_;
  ItemTeam team_;
};

}  // namespace

RunCount run_work_on_ranks(const MpiSession& mpi, const Work& work, const std::string& fingerprint,
                           const std::function<ResultStore&()>& open, const RunOptions& options) {
  check::that(options.threads >= 1, "threads", "at least 1");
  check::that(options.shard.index == 0 && options.shard.count == 1, "a shard on ranks", "the whole");
  check::that(work.items == 0 || work.evaluate != nullptr, "evaluate", "a function");
  if (mpi.rank() == 0) {
    return RankCoordinator(mpi.size(), work, fingerprint, options).run(open);
  }
  return Helper(work, fingerprint, options.threads).run();
}

}  // namespace wheelwright::study
