// SPDX-License-Identifier: Apache-2.0
/// \file
/// Independent items of work: on the threads of one machine, as one shard of many, or on the ranks of MPI
/// (work_on_ranks.hpp), always with the same results.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace wheelwright::study {

/// Items of work, numbered from 0.
struct Work {
  std::size_t items = 0;
  /// The result of one item, as text. Called from several threads at once; an item gives the same text whenever and
  /// wherever it is evaluated. What it throws ends the run: a failure that is a result has to be returned.
  std::function<std::string(std::size_t item)> evaluate;
};

/// Results that are there already, and the place for new ones. Called from one thread at a time.
class ResultStore {
 public:
  virtual ~ResultStore() = default;
  /// True if the item's result is there.
  [[nodiscard]] virtual bool has(std::size_t item) = 0;
  /// Keeps the result of an item.
  virtual void put(std::size_t item, std::string_view result) = 0;
};

/// One of `count` parts of the work: the items i with i mod count = index.
struct Shard {
  std::size_t index = 0;  ///< below `count`
  std::size_t count = 1;
};

/// Number of items, of `items`, that a shard has. Throws InvalidArgument unless index < count.
[[nodiscard]] std::size_t items_of(const Shard& shard, std::size_t items);

/// Options of run_work().
struct RunOptions {
  std::size_t threads = 1;
  Shard shard = {};
  /// How many items of the shard are there, behind each; `done` only grows. Called from one thread at a time; may be
  /// empty.
  std::function<void(std::size_t done, std::size_t items)> progress = {};
};

/// Counts of a run.
struct RunCount {
  std::size_t found = 0;      ///< items of the shard whose result was there already
  std::size_t evaluated = 0;  ///< items that were evaluated now
};

/// Evaluates the items of the shard that `store` does not have, and puts each into it as soon as it is done, in any
/// order; memory does not grow with the number of items. The first that an item, the store or the progress throws is
/// thrown when the items under way have ended; their results are in the store. Throws InvalidArgument for no thread or
/// a shard that is none.
RunCount run_work(const Work& work, ResultStore& store, const RunOptions& options = {});

}  // namespace wheelwright::study
