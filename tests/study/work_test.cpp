// SPDX-License-Identifier: Apache-2.0
#include "study/work.hpp"

#include <atomic>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/study/memory_store.hpp"

namespace wheelwright::study::work_test {
namespace {

using testing::MemoryStore;
using testing::text_of;

TEST(Work, EveryItemOnceOnAnyNumberOfThreads) {
  MemoryStore alone;
  run_work({200, text_of}, alone);
  ASSERT_EQ(alone.results.size(), 200U);
  for (const auto& [item, text] : alone.results) {
    EXPECT_EQ(text, text_of(item));
  }
  for (const std::size_t threads : {2U, 4U, 16U}) {
    std::vector<std::atomic<int>> calls(200);
    const Work work{200, [&](std::size_t item) {
                      ++calls[item];
                      return text_of(item);
                    }};
    MemoryStore store;
    const RunCount count = run_work(work, store, {threads, {}, {}});
    EXPECT_EQ(store.results, alone.results) << threads;
    EXPECT_EQ(count.evaluated, 200U);
    EXPECT_EQ(count.found, 0U);
    for (const std::atomic<int>& times : calls) {
      EXPECT_EQ(times, 1);
    }
  }
}

TEST(Work, NothingToDo) {
  MemoryStore store;
  EXPECT_EQ(run_work({}, store, {4, {}, {}}).evaluated, 0U);
  EXPECT_TRUE(store.results.empty());
}

TEST(Work, WhatIsThereIsNotEvaluatedAgain) {
  for (const std::size_t threads : {1U, 3U}) {
    MemoryStore store;
    std::set<std::size_t> there;
    for (std::size_t item = 0; item < 100; item += 3) {
      store.results[item] = "there";
      there.insert(item);
    }
    const RunCount count = run_work({100, text_of}, store, {threads, {}, {}});
    EXPECT_EQ(count.found, there.size());
    EXPECT_EQ(count.evaluated, 100 - there.size());
    for (const auto& [item, text] : store.results) {
      EXPECT_EQ(text, there.contains(item) ? "there" : text_of(item));
    }
    EXPECT_EQ(run_work({100, text_of}, store, {threads, {}, {}}).evaluated, 0U);
  }
}

TEST(Work, ShardsArePartsThatMakeTheWhole) {
  for (const std::size_t items : {0U, 1U, 6U, 7U, 50U}) {
    MemoryStore store;  // fails where two shards share an item
    std::size_t sum = 0;
    for (std::size_t index = 0; index < 7; ++index) {
      const Shard shard{index, 7};
      const std::size_t before = store.results.size();
      run_work({items, text_of}, store, {2, shard, {}});
      EXPECT_EQ(store.results.size() - before, items_of(shard, items));
      sum += items_of(shard, items);
    }
    EXPECT_EQ(store.results.size(), items);
    EXPECT_EQ(sum, items);
  }
}

TEST(Work, ProgressGrowsToTheNumberOfItems) {
  for (const std::size_t threads : {1U, 2U}) {
    MemoryStore store;
    store.results[4] = "there";
    std::vector<std::size_t> told;
    run_work({60, text_of}, store, {threads, {1, 3}, [&](std::size_t done, std::size_t items) {
                                      EXPECT_EQ(items, 20U);
                                      told.push_back(done);
                                    }});
    std::vector<std::size_t> expected(20);
    for (std::size_t k = 0; k < 20; ++k) {
      expected[k] = k + 1;
    }
    EXPECT_EQ(told, expected);
  }
}

TEST(Work, AFailureEndsTheRunAndKeepsWhatIsDone) {
  for (const std::size_t threads : {1U, 4U}) {
    std::atomic<std::size_t> ended = 0;
    const Work work{1'000'000'000, [&](std::size_t item) {
                      if (item == 50) {
                        throw InputError("item 50");
                      }
                      ++ended;
                      return text_of(item);
                    }};
    MemoryStore store;
    try {
      run_work(work, store, {threads, {}, {}});
      ADD_FAILURE() << "nothing was thrown";
    } catch (const InputError& error) {
      EXPECT_STREQ(error.what(), "item 50");
    }
    EXPECT_EQ(store.results.size(), ended);
    EXPECT_GE(ended, 50U);  // items are taken in order
    EXPECT_FALSE(store.results.contains(50));
  }
}

TEST(Work, AStoreThatFailsEndsTheRun) {
  struct Full : MemoryStore {
    void put(std::size_t item, std::string_view result) override {
      if (results.size() == 10) {
        throw std::runtime_error("disk full");
      }
      MemoryStore::put(item, result);
    }
  };
  for (const std::size_t threads : {1U, 4U}) {
    Full store;
    EXPECT_THROW(run_work({1'000'000'000, text_of}, store, {threads, {}, {}}), std::runtime_error);
    EXPECT_EQ(store.results.size(), 10U);
  }
}

TEST(Work, RefusesWhatMakesNoSense) {
  MemoryStore store;
  EXPECT_THROW(run_work({1, text_of}, store, {0, {}, {}}), InvalidArgument);
  EXPECT_THROW(run_work({1, text_of}, store, {1, {1, 1}, {}}), InvalidArgument);
  EXPECT_THROW(run_work({1, text_of}, store, {1, {0, 0}, {}}), InvalidArgument);
  EXPECT_THROW(run_work({1, {}}, store), InvalidArgument);
  EXPECT_TRUE(store.results.empty());
}

}  // namespace
}  // namespace wheelwright::study::work_test
