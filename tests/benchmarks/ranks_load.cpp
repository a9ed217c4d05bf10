// SPDX-License-Identifier: Apache-2.0
// mpirun -n RANKS wheelwright-ranks-load ITEMS BYTES MICROSECONDS THREADS [FILE]
//
// The load of the coordinator of run_work_on_ranks(): ITEMS items that sleep MICROSECONDS and have results of BYTES
// bytes, on THREADS threads a rank, into memory or a store in FILE. Since items sleep, the processor time of a rank is
// that of sharing out; rank 0's per item says how many items a second it can serve.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include <sys/resource.h>

#include "results/result_store.hpp"
#include "study/work_on_ranks.hpp"

namespace {

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

class Nowhere : public wheelwright::study::ResultStore {
 public:
  bool has(std::size_t /*item*/) override { return false; }
  void put(std::size_t /*item*/, std::string_view /*result*/) override {}
};

}  // namespace

int main(int argc, char** argv) {
  using namespace wheelwright;
  if (argc != 5 && argc != 6) {
    std::fputs("usage: mpirun -n RANKS wheelwright-ranks-load ITEMS BYTES MICROSECONDS THREADS [FILE]\n", stderr);
    return 2;
  }
  const study::MpiSession mpi;
  const auto items = static_cast<std::size_t>(std::atoll(argv[1]));
  const auto bytes = static_cast<std::size_t>(std::atoll(argv[2]));
  const std::chrono::microseconds sleep(std::atoll(argv[3]));
  const auto threads = static_cast<std::size_t>(std::atoll(argv[4]));
  const study::Work work{items, [&](std::size_t) {
                           if (sleep.count() > 0) {
                             std::this_thread::sleep_for(sleep);
                           }
                           return std::string(bytes, 'x');
                         }};
  std::unique_ptr<study::ResultStore> store;
  const double before = processor_seconds();
  const auto begin = std::chrono::steady_clock::now();
  const study::RunCount count = study::run_work_on_ranks(
      mpi, work, "",
      [&]() -> study::ResultStore& {
        if (argc == 6) {
          store = std::make_unique<results::SqliteResults>(
              argv[5], results::StoredPlan{},
              results::StoredItems{items, [](std::size_t item) { return "robot " + std::to_string(item); }},
              results::SqliteResults::Opening::fresh);
        } else {
          store = std::make_unique<Nowhere>();
        }
        return *store;
      },
      {threads, {}, {}});
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double processor = processor_seconds() - before;
  std::printf("rank %d of %d, %zu threads: %zu items, %.3f s, %.0f items/s, processor %.3f s, %.2f us/item, %.2f %%\n",
              mpi.rank(), mpi.size(), threads, count.evaluated, wall, static_cast<double>(items) / wall, processor,
              1e6 * processor / static_cast<double>(items), 100.0 * processor / wall);
  return 0;
}
