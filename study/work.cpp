// SPDX-License-Identifier: Apache-2.0
#include "study/work.hpp"

#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include "core/check.hpp"

namespace wheelwright::study {
namespace {

/// Items of a shard on their way from the work to the store; several threads take and hand back at once.
class Flow {
 public:
  Flow(const Work& work, ResultStore& store, const RunOptions& options)
      : work_(work), store_(store), options_(options), next_(options.shard.index) {}

  /// Evaluates until nothing is left or something failed.
  void drain() noexcept {
    try {
      while (const std::optional<std::size_t> item = take()) {
        const std::string result = work_.evaluate(*item);
        const std::lock_guard lock(mutex_);
        store_.put(*item, result);
        ++count_.evaluated;
        tell();
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) {
        failure_ = std::current_exception();
      }
    }
  }

  RunCount finish() const {
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    return count_;
  }

 private:
  std::optional<std::size_t> take() {
    const std::lock_guard lock(mutex_);
    while (!failure_ && next_ < work_.items) {
      const std::size_t item = next_;
      next_ = work_.items - item > options_.shard.count ? item + options_.shard.count : work_.items;
      if (!store_.has(item)) {
        return item;
      }
      ++count_.found;
      tell();
    }
    return std::nullopt;
  }

  void tell() const {
    if (options_.progress) {
      options_.progress(count_.found + count_.evaluated, items_of(options_.shard, work_.items));
    }
  }

  const Work& work_;
  ResultStore& store_;
  const RunOptions& options_;
  std::mutex mutex_;  // of all below, and of calls of the store
  std::size_t next_;
  RunCount count_;
  std::exception_ptr failure_;
};

}  // namespace

std::size_t items_of(const Shard& shard, std::size_t items) {
  check::that(shard.index < shard.count, "shard " + std::to_string(shard.index) + " of " + std::to_string(shard.count),
              "an index below the count");
  return shard.index < items ? (items - shard.index - 1) / shard.count + 1 : 0;
}

RunCount run_work(const Work& work, ResultStore& store, const RunOptions& options) {
  check::that(options.threads >= 1, "threads", "at least 1");
  check::that(work.items == 0 || work.evaluate != nullptr, "evaluate", "a function");
  static_cast<void>(items_of(options.shard, work.items));
  Flow flow(work, store, options);
  if (options.threads == 1) {
    flow.drain();
    return flow.finish();
  }
  // As many as were asked for, whatever the processors.
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
  oneapi::tbb::task_arena arena(static_cast<int>(options.threads));
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        std::size_t{0}, options.threads, [&](std::size_t) { flow.drain(); }, oneapi::tbb::simple_partitioner());
  });
  return flow.finish();
}

}  // namespace wheelwright::study
