// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <string>

#include "formats/logs/database.hpp"
#include "results/result_store.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

constexpr std::size_t kItems = 4;

using Results = std::map<std::size_t, std::string>;

/// Whether SQLite finds pages, rows and indexes in order. Where an index leads to a row of another key, nothing holds.
bool is_sound(const std::filesystem::path& path) {
  bool sound = false;
  fuzz::clean([&] {
    logs::bag::Database database(path, path.string(), logs::bag::Database::Mode::unchanging);
    logs::bag::Statement check = database.prepare("PRAGMA integrity_check(1)");
    sound = check.ok() && check.step() == logs::bag::Statement::Result::row && check.text(0) == "ok";
  });
  return sound;
}

Results results_of(results::SqliteResults& store) {
  Results found;
  store.each([&](std::size_t item, std::string_view result) { found[item] = result; });
  return found;
}

}  // namespace

// Results of a store that is gone on with: those that are there, and those that are put, are there when it is opened
// again; a store that takes them over has the same. Where the file is damaged that is not asked.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const results::StoredPlan plan = {{"--beta", "40"}};
  const results::StoredItems items{.count = kItems,
                                   .key = [](std::size_t item) { return "item " + std::to_string(item); }};
  const auto path = fuzz::on_disk(fuzz::text_of(data, size), ".store");
  for (const char* const ending : {"-wal", "-shm", "-journal"}) {
    std::filesystem::remove(path.string() + ending);
  }
  const bool sound = is_sound(path);
  return fuzz::clean([&] {
    Results found;
    {
      results::SqliteResults store(path, plan, items);
      found = results_of(store);
      store.each_missing([&](std::size_t item) {
        fuzz::require(!found.contains(item) || !sound);
        store.put(item, "new");
        found[item] = "new";
      });
      fuzz::require(!sound || (found.size() == kItems && results_of(store) == found));
    }
    results::SqliteResults other({}, plan, items);
    other.merge({path});
    fuzz::require(!sound || results_of(other) == found);
  });
}
