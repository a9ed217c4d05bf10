// SPDX-License-Identifier: Apache-2.0
// Run by mpirun on several ranks; each of them comes by every test, and expects what its rank should see.
#include "study/work_on_ranks.hpp"

#include <atomic>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/study/memory_store.hpp"

namespace wheelwright::study {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MemoryStore;
using testing::text_of;

const MpiSession* mpi = nullptr;

// Items that take a while, so that every rank has its share.
std::string slow_text(std::size_t item) {
  volatile double x = 0.0;
  for (int k = 0; k < 30'000; ++k) {
    x = x + 1e-3 * k;
  }
  return text_of(item);
}

RunCount run(const Work& work, MemoryStore& store, const RunOptions& options = {}) {
  return run_work_on_ranks(
      *mpi, work, "the same", [&]() -> ResultStore& { return store; }, options);
}

// The message of the `Failure` that rank 0 throws; the other ranks end as if all were well.
template <typename Failure>
std::string failure_on_rank_0(const Work& work, const std::string& fingerprint, ResultStore& store) {
  try {
    run_work_on_ranks(*mpi, work, fingerprint, [&]() -> ResultStore& { return store; });
    EXPECT_NE(mpi->rank(), 0) << "nothing was thrown";
  } catch (const Failure& failure) {
    EXPECT_EQ(mpi->rank(), 0) << failure.what();
    return failure.what();
  }
  return "";
}

TEST(WorkOnRanks, SameResultsAsOneThread) {
  MemoryStore alone;
  run_work({500, text_of}, alone);
  for (const auto& evaluate : {text_of, slow_text}) {
    for (const std::size_t threads : {1U, 2U}) {
      MemoryStore store;
      std::atomic<std::size_t> here = 0;
      const Work work{500, [&](std::size_t item) {
                        ++here;
                        return evaluate(item);
                      }};
      std::size_t done = 0;
      const RunCount count = run(work, store, {threads, {}, [&](std::size_t now, std::size_t items) {
                                                 EXPECT_EQ(now, ++done);
                                                 EXPECT_EQ(items, 500U);
                                               }});
      EXPECT_GT(here, 0U);
      if (mpi->rank() == 0) {
        EXPECT_EQ(store.results, alone.results);
        EXPECT_EQ(count.evaluated, 500U);
        EXPECT_EQ(done, 500U);
      } else {
        EXPECT_TRUE(store.results.empty());
        EXPECT_EQ(count.evaluated, here);
      }
    }
  }
}

TEST(WorkOnRanks, LargeAndEmptyResults) {
  const auto text = [](std::size_t item) { return std::string(item % 2 == 0 ? 0 : 300'000, 'x'); };
  MemoryStore store;
  run({40, text}, store);
  for (const auto& [item, result] : store.results) {
    EXPECT_EQ(result, text(item));
  }
  EXPECT_EQ(store.results.size(), mpi->rank() == 0 ? 40U : 0U);
}

TEST(WorkOnRanks, FewerItemsThanRanks) {
  for (const std::size_t items : {0U, 1U}) {
    MemoryStore store;
    run({items, text_of}, store, {3, {}, {}});
    EXPECT_EQ(store.results.size(), mpi->rank() == 0 ? items : 0U);
  }
}

TEST(WorkOnRanks, WhatIsThereIsNotEvaluatedAgain) {
  MemoryStore store;
  for (std::size_t item = 0; mpi->rank() == 0 && item < 300; item += 3) {
    store.results[item] = "there";
  }
  const Work work{300, [](std::size_t item) {
                    EXPECT_NE(item % 3, 0U);
                    return text_of(item);
                  }};
  const RunCount count = run(work, store);
  if (mpi->rank() == 0) {
    EXPECT_EQ(count.found, 100U);
    EXPECT_EQ(count.evaluated, 200U);
    EXPECT_EQ(store.results.size(), 300U);
  }
}

TEST(WorkOnRanks, AFailureOnAnyRankEndsTheRun) {
  for (int failing = 0; failing < mpi->size(); ++failing) {
    MemoryStore store;
    std::atomic<int> calls = 0;
    const Work work{1'000'000'000, [&](std::size_t item) {
                      if (mpi->rank() == failing && ++calls == 5) {
                        throw InputError("bad log");
                      }
                      return slow_text(item);
                    }};
    const std::string message = failure_on_rank_0<InputError>(work, "the same", store);
    if (mpi->rank() == 0) {
      EXPECT_EQ(message, failing == 0 ? "bad log" : "rank " + std::to_string(failing) + ": bad log");
      EXPECT_FALSE(store.results.empty());
    }
    for (const auto& [item, result] : store.results) {
      EXPECT_EQ(result, text_of(item));
    }
  }
}

TEST(WorkOnRanks, AnotherExceptionKeepsItsKind) {
  const Work work{1'000, [](std::size_t item) -> std::string {
                    if (mpi->rank() == mpi->size() - 1) {
                      throw std::out_of_range("a bug");
                    }
                    return slow_text(item);
                  }};
  MemoryStore store;
  EXPECT_THAT(failure_on_rank_0<std::exception>(work, "the same", store), HasSubstr(mpi->rank() == 0 ? "a bug" : ""));
}

TEST(WorkOnRanks, AStoreThatFailsEndsTheRun) {
  struct Full : MemoryStore {
    void put(std::size_t item, std::string_view result) override {
      if (results.size() == 20) {
        throw InputError("disk full");
      }
      MemoryStore::put(item, result);
    }
  };
  Full store;
  EXPECT_EQ(failure_on_rank_0<InputError>({1'000'000'000, slow_text}, "the same", store),
            mpi->rank() == 0 ? "disk full" : "");
  EXPECT_EQ(store.results.size(), mpi->rank() == 0 ? 20U : 0U);
}

TEST(WorkOnRanks, AStoreThatCannotBeOpenedEndsTheRun) {
  try {
    run_work_on_ranks(*mpi, {100, text_of}, "", []() -> ResultStore& { throw InputError("in use"); });
    EXPECT_NE(mpi->rank(), 0);
  } catch (const InputError& error) {
    EXPECT_EQ(mpi->rank(), 0);
    EXPECT_STREQ(error.what(), "in use");
  }
}

TEST(WorkOnRanks, AllHaveToHaveTheSamePlan) {
  if (mpi->size() == 1) {
    return;  // one rank agrees with itself; two and four are asked in runs of their own
  }
  const int last = mpi->size() - 1;
  const Work work{100, [](std::size_t) -> std::string {
                    ADD_FAILURE() << "evaluated";
                    return "";
                  }};
  MemoryStore store;
  const std::string message =
      failure_on_rank_0<InputError>(work, mpi->rank() == last ? "a: 1\nb: 2\n" : "a: 1\nb: 3\n", store);
  if (mpi->rank() == 0) {
    EXPECT_THAT(message, AllOf(HasSubstr("rank " + std::to_string(last)), HasSubstr("'b: 2'"), HasSubstr("'b: 3'")));
  }
}

}  // namespace
}  // namespace wheelwright::study

int main(int argc, char** argv) {
  ::testing::InitGoogleMock(&argc, argv);
  const wheelwright::study::MpiSession session;
  wheelwright::study::mpi = &session;
  return RUN_ALL_TESTS();
}
