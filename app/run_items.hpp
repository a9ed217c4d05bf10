// SPDX-License-Identifier: Apache-2.0
/// \file
/// The many items of a command: on threads, as one shard of several, or on the processes that mpirun or srun started
/// together, with results that outlive the process.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "formats/files/temporary.hpp"
#include "results/result_store.hpp"
#include "study/work.hpp"

namespace wheelwright::app {

struct CommonOptions;

/// Distribution of the items of a command.
struct ScaleOptions {
  std::optional<study::Shard> shard = {};  ///< --shard I/N is index I - 1 of N
  bool merge = false;
  bool fresh = false;
};

/// "I/N" with 1 <= I <= N as a shard; nothing for anything else.
[[nodiscard]] std::optional<study::Shard> shard_of(std::string_view text);

/// The items to evaluate.
struct ItemsToRun {
  study::Work work;
  /// StoredItems::key of each item. Messages name items by the beginning of their keys: begin with a name.
  std::function<std::string(std::size_t item)> key;
  /// What every result depends on; run_items() adds the program's version. No option that changes no result (threads,
  /// shard).
  results::StoredPlan plan;
  /// StoredItems::passing.
  std::function<bool(std::size_t item, std::string_view result)> passing = {};
  /// What processes under mpirun have to agree on of an item. May be empty: its key.
  std::function<std::string(std::size_t item)> agreed = {};
};

/// Outcome of a run.
struct ItemsRun {
  /// All results, to be read in the order of items; null where this process has nothing more to do: it then ends with
  /// kDone, and prints nothing.
  std::unique_ptr<results::SqliteResults> results = nullptr;
  study::RunCount count = {};
};

/// Evaluates the items that are not in OUT/results.sqlite yet, on `common.threads` threads, and where mpirun started
/// the program, on all its processes: rank 0 has the results. With --shard only the shard's, into
/// OUT/shard-I-of-N.sqlite; says on standard output what was done. With --merge none: takes over all
/// OUT/shard-*-of-*.sqlite. Without --out the results are gone with the process.
///
/// Throws what an item throws; InputError as SqliteResults does, for options that do not go together, and where --merge
/// leaves items missing: the message names them and the shards that evaluate them.
[[nodiscard]] ItemsRun run_items(const ItemsToRun& items, const CommonOptions& common, const ScaleOptions& scale,
                                 const std::function<void(std::size_t done, std::size_t items)>& progress = {});

/// How `out` is locked (make_directory()): shards and processes of one mpirun share it.
[[nodiscard]] files::PathLock::Kind lock_for(const ScaleOptions& scale);

/// True if this process is one of several that mpirun or srun started together, by the environment they set; MPI itself
/// is not asked, so that a plain run never starts it. False where that says that there is one alone.
[[nodiscard]] bool launched_by_mpi();

/// Evaluates `work` on all these processes (run_work_on_ranks()); each has to call it, once. `fingerprint` is what all
/// have to agree on; `open` is called on rank 0, and what it opens has the results there. Returns what was done on rank
/// 0, nothing on the others, whose part is over. Throws InputError where the program was built without MPI.
[[nodiscard]] std::optional<study::RunCount> run_on_ranks(const study::Work& work, const std::string& fingerprint,
                                                          const std::function<study::ResultStore&()>& open,
                                                          const study::RunOptions& options);

}  // namespace wheelwright::app
