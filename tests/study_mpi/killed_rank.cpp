// SPDX-License-Identifier: Apache-2.0
// killed_rank FILE RANK: a run into a store in which RANK kills itself after 20 items; nobody with RANK = -1. Rank 0
// then checks every result, and prints how many items were there before. killed.cmake runs it.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "results/result_store.hpp"
#include "study/work_on_ranks.hpp"
#include "tests/study/memory_store.hpp"

int main(int argc, char** argv) {
  using namespace wheelwright;
  if (argc != 3) {
    return 2;
  }
  const study::MpiSession mpi;
  const int killed = std::atoi(argv[2]);
  int calls = 0;
  const study::Work work{300, [&](std::size_t item) {
                           if (mpi.rank() == killed && ++calls == 20) {
                             std::raise(SIGKILL);
                           }
                           // Long enough that each rank has its share.
                           std::this_thread::sleep_for(std::chrono::milliseconds(2));
                           return wheelwright::testing::text_of(item);
                         }};
  std::unique_ptr<results::SqliteResults> store;
  const study::RunCount count = study::run_work_on_ranks(mpi, work, "", [&]() -> study::ResultStore& {
    store = std::make_unique<results::SqliteResults>(
        argv[1], results::StoredPlan{},
        results::StoredItems{300, [](std::size_t item) { return std::to_string(item); }});
    return *store;
  });
  if (mpi.rank() != 0) {
    return 0;
  }
  for (std::size_t item = 0; item < 300; ++item) {
    if (store->get(item) != wheelwright::testing::text_of(item)) {
      std::printf("item %zu is wrong\n", item);
      return 1;
    }
  }
  std::printf("found %zu, evaluated %zu\n", count.found, count.evaluated);
  return 0;
}
