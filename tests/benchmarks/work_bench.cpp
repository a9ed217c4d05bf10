// SPDX-License-Identifier: Apache-2.0
// What sharing out costs an item that costs nothing, and what keeping a result costs against a file that is flushed
// behind each (which survives a kill, too, but finds nothing again).
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "results/result_store.hpp"
#include "study/work.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/temporary_file.hpp"

namespace wheelwright::bench::work_bench {
namespace {

constexpr std::size_t shared_items = 200'000;
constexpr std::size_t kept_items = 20'000;
constexpr int repetitions = 5;

class Counter : public study::ResultStore {
 public:
  bool has(std::size_t /*item*/) override { return false; }
  void put(std::size_t /*item*/, std::string_view result) override { bytes += result.size(); }
  std::size_t bytes = 0;
};

void sharing(Form form) {
  const study::Work work{shared_items, [](std::size_t item) { return std::string(item % 8, 'x'); }};
  for (const std::size_t threads : {1U, 2U}) {
    const auto shared = [&] {
      Counter counter;
      study::run_work(work, counter, {threads, {}, {}});
      DoNotOptimize(counter.bytes);
    };
    const auto bare = [&] {
      Counter counter;
      for (std::size_t item = 0; item < shared_items; ++item) {
        counter.put(item, work.evaluate(item));
      }
      DoNotOptimize(counter.bytes);
    };
    const auto note = [](double seconds) { return fmt::format("{:.0f} ns/item", 1e9 * seconds / shared_items); };
    compare(form, {"study/work", shared_items, 0, static_cast<int>(threads), "a loop", note}, shared, bare,
            repetitions);
  }
}

void keeping(Form form) {
  for (const std::size_t size : {300U, 5000U}) {
    const std::string result(size, 'x');
    const auto store = [&] {
      const TemporaryFile file("sqlite");
      results::SqliteResults results(file.path, {},
                                     {kept_items, [](std::size_t item) { return fmt::format("robot {}", item); }});
      for (std::size_t item = 0; item < kept_items; ++item) {
        results.put(item, result);
      }
    };
    const auto flushed = [&] {
      const TemporaryFile file("txt");
      const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(file.path.c_str(), "wb"), &std::fclose);
      if (!out) {
        throw Error(file.path.string() + ": cannot be opened");
      }
      for (std::size_t item = 0; item < kept_items; ++item) {
        std::fwrite(result.data(), 1, result.size(), out.get());
        std::fflush(out.get());
      }
    };
    const auto note = [&](double seconds) {
      return fmt::format("{} bytes, {:.1f} us/put", size, 1e6 * seconds / kept_items);
    };
    compare(form, {"results/store", kept_items, 0, 1, "flushed file", note}, store, flushed, repetitions);
  }
}

const bool registered_sharing = register_bench("study/work", sharing);
const bool registered_keeping = register_bench("results/store", keeping);

}  // namespace
}  // namespace wheelwright::bench::work_bench
