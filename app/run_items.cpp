// SPDX-License-Identifier: Apache-2.0
#include "app/run_items.hpp"

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <regex>
#include <set>
#include <stop_token>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "app/common.hpp"
#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "results/software.hpp"

namespace wheelwright::app {

bool launched_by_mpi() {
  // Open MPI's mpirun; MPICH's and Intel's, and srun with PMI or PMI2.
  for (const char* const name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    if (const char* const size = std::getenv(name); size != nullptr) {
      const std::string_view text = size;
      int processes = 0;
      std::from_chars(text.data(), text.data() + text.size(), processes);
      return processes > 1;
    }
  }
  // srun with PMIx, which does not tell the number: Slurm does.
  if (std::getenv("PMIX_RANK") != nullptr) {
    const char* const tasks = std::getenv("SLURM_STEP_NUM_TASKS");
    return tasks == nullptr || std::string_view(tasks) != "1";
  }
  return false;
}

namespace {

namespace fs = std::filesystem;
using Opening = results::SqliteResults::Opening;

constexpr const char* kResults = "results.sqlite";
constexpr std::size_t kNamed = 5;  // items that a message names

void check_together(const CommonOptions& common, const ScaleOptions& scale) {
  const char* const given = scale.shard ? "--shard" : scale.merge ? "--merge" : scale.fresh ? "--fresh" : nullptr;
  if (given != nullptr && common.out.empty()) {
    throw InputError(fmt::format("{}: expected --out DIR, where the results are kept", given));
  }
  if (scale.shard && scale.merge) {
    throw InputError("--shard and --merge: expected one of them; --merge comes when all shards are done");
  }
  if ((scale.shard || scale.merge) && launched_by_mpi()) {
    throw InputError(fmt::format("{} under mpirun: expected one of them, both share the items out", given));
  }
}

// Throws std::system_error where so many threads cannot be started: oneTBB ends the program then.
void check_room_for(std::size_t threads) {
  std::vector<std::jthread> all;
  while (all.size() < threads) {
    all.emplace_back([](const std::stop_token& stop) {
      std::mutex own;
      std::unique_lock lock(own);
      std::condition_variable_any().wait(lock, stop, [] { return false; });
    });
  }
}

// What every process that takes part has to agree on.
std::string fingerprint(const results::StoredPlan& plan, const ItemsToRun& items) {
  std::string text;
  for (const auto& [name, value] : plan) {
    text += fmt::format("{}: {}\n", name, value);
  }
  files::Xxh64 keys;
  for (std::size_t item = 0; item < items.work.items; ++item) {
    const std::string key = (items.agreed ? items.agreed(item) : items.key(item)) + '\n';
    keys.update(key.data(), key.size());
  }
  return text + fmt::format("{} items {}\n", items.work.items, keys.text());
}

// Shards in `directory`, by file name.
std::vector<std::pair<fs::path, study::Shard>> shards_in(const fs::path& directory) {
  static const std::regex pattern("shard-([0-9]+)-of-([0-9]+)\\.sqlite");
  std::vector<std::pair<fs::path, study::Shard>> shards;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    std::smatch match;
    if (std::regex_match(name, match, pattern)) {
      if (const std::optional<study::Shard> shard = shard_of(match[1].str() + "/" + match[2].str())) {
        shards.emplace_back(entry.path(), *shard);
      }
    }
  }
  std::ranges::sort(shards, {}, [](const auto& entry) { return std::pair(entry.second.count, entry.second.index); });
  return shards;
}

// Throws unless nothing is missing.
void check_complete(results::SqliteResults& results, const std::vector<std::pair<fs::path, study::Shard>>& shards) {
  std::size_t missing = 0;
  std::vector<std::string> names;
  const std::size_t count = shards.back().second.count;
  std::set<std::size_t> of;
  results.each_missing([&](std::size_t item) {
    ++missing;
    of.insert(item % count + 1);
    if (names.size() < kNamed) {
      names.push_back(files::shown(results.items().key(item)));
    }
  });
  if (missing == 0) {
    return;
  }
  std::vector<std::string> again;
  for (const std::size_t index : of) {
    again.push_back(again.size() < kNamed ? fmt::format("--shard {}/{}", index, count) : "…");
    if (again.size() > kNamed) {
      break;
    }
  }
  throw InputError(
      fmt::format("{}: {} of {} items are missing ({}{}): expected all; evaluate them with {} instead of --merge and "
                  "merge again, or "
                  "without --merge, which evaluates what is missing",
                  results.file().string(), missing, results.items().count, core::listed(names),
                  missing > kNamed ? ", …" : "", core::listed(again)));
}

// Of the items whose results are not kept: the first ones.
std::vector<std::string> names_of_passing(const results::SqliteResults& results) {
  std::vector<std::string> names;
  for (const auto& [item, result] : results.passing()) {
    names.push_back(names.size() < kNamed ? files::shown(results.items().key(item)) : "…");
    if (names.size() > kNamed) {
      break;
    }
  }
  return names;
}

}  // namespace

std::optional<study::Shard> shard_of(std::string_view text) {
  const char* const end = text.data() + text.size();
  study::Shard shard;
  const auto i = std::from_chars(text.data(), end, shard.index);
  const bool slash = i.ec == std::errc() && i.ptr != end && *i.ptr == '/';
  const auto n = std::from_chars(slash ? i.ptr + 1 : end, end, shard.count);
  if (!slash || n.ec != std::errc() || n.ptr != end || shard.index < 1 || shard.index > shard.count) {
    return std::nullopt;
  }
  --shard.index;
  return shard;
}

files::PathLock::Kind lock_for(const ScaleOptions& scale) {
  using enum files::PathLock::Kind;
  return scale.shard || launched_by_mpi() ? shared : alone;
}

ItemsRun run_items(const ItemsToRun& items, const CommonOptions& common, const ScaleOptions& scale,
                   const std::function<void(std::size_t, std::size_t)>& progress) {
  check_together(common, scale);
  if (common.threads > 1 && !scale.merge) {
    check_room_for(static_cast<std::size_t>(common.threads));
  }
  make_directory(common);
  results::StoredPlan plan = items.plan;
  plan.emplace_back("the program", results::software());
  const results::StoredItems stored{items.work.items, items.key, items.passing};
  const Opening opening = scale.fresh ? Opening::fresh : Opening::resume;
  const auto open = [&](const std::string& name) {
    keep_inputs(common.out / name, common.read);
    return std::make_unique<results::SqliteResults>(common.out.empty() ? fs::path() : common.out / name, plan, stored,
                                                    opening);
  };
  study::RunOptions options{static_cast<std::size_t>(common.threads), {}, progress};
  ItemsRun run;
  if (scale.shard) {
    const study::Shard shard = *scale.shard;
    const auto results = open(fmt::format("shard-{}-of-{}.sqlite", shard.index + 1, shard.count));
    options.shard = shard;
    run.count = study::run_work(items.work, *results, options);
    if (!common.quiet && !common.json) {
      say("shard {} of {}: {} items evaluated, {} were there; {}\nwhen all are done: the same with --merge\n",
          shard.index + 1, shard.count, run.count.evaluated, run.count.found, results->file().string());
      if (!results->passing().empty()) {
        say("not kept: {}: changed while they were read; run this shard again\n",
            core::listed(names_of_passing(*results)));
      }
    }
    return run;
  }
  if (scale.merge) {
    const auto shards = shards_in(common.out);
    if (shards.empty()) {
      throw InputError(common.out.string() + ": no shard-I-of-N.sqlite: expected what --shard I/N leaves there");
    }
    std::vector<fs::path> files;
    for (const auto& [file, shard] : shards) {
      files.push_back(file);
    }
    run.results = open(kResults);
    run.results->merge(files);
    check_complete(*run.results, shards);
    run.count.found = stored.count;
    return run;
  }
  if (launched_by_mpi()) {
    std::unique_ptr<results::SqliteResults> results;
    const std::optional<study::RunCount> count = run_on_ranks(
        items.work, fingerprint(plan, items),
        [&]() -> study::ResultStore& {
          results = open(kResults);
          return *results;
        },
        options);
    if (count) {
      run.results = std::move(results);
      run.count = *count;
    }
    return run;
  }
  run.results = open(kResults);
  run.count = study::run_work(items.work, *run.results, options);
  return run;
}

}  // namespace wheelwright::app
