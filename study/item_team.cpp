// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/item_team.hpp>

#include <chrono>
#include <utility>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

namespace wheelwright {

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

}  // namespace wheelwright
