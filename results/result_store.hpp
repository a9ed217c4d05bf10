// SPDX-License-Identifier: Apache-2.0
/// \file
/// Results of long runs in one SQLite file, which may be killed at any moment and gone on with later.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "study/work.hpp"

namespace wheelwright::results {

/// Inputs that every result of a run depends on, beside the item itself: names and values, e.g. {"--beta", "40"}. Names
/// differ.
using StoredPlan = std::vector<std::pair<std::string, std::string>>;

/// "--beta is 40 there and 30 here; …": where two plans differ; empty where they do not. Their order does not count.
[[nodiscard]] std::string difference(const StoredPlan& there, const StoredPlan& here);

/// The items of a run.
struct StoredItems {
  std::size_t count = 0;
  /// A text that stands for all that the item alone depends on, and no other item has, e.g. name and hashes of its
  /// logs. An item whose key changed is evaluated anew; one that moved in the list is not.
  std::function<std::string(std::size_t item)> key;
  /// True for a result that is none of what the key stands for: it is gone with the object, never in the file. May be
  /// empty: none is.
  std::function<bool(std::size_t item, std::string_view result)> passing = {};
};

/// A store in an SQLite file.
///
/// **Killed** at any moment (SIGKILL, out of memory, a job's time limit): every result whose put() had returned is
/// there. Each is a transaction of its own in the write-ahead log, which the system has when put() returns. **Power
/// loss**: the file stays sound and may lack what was put since SQLite last flushed its log, about 4 MB of results;
/// they are evaluated again. Only one process has a store open; a file system without locks cannot promise that.
class SqliteResults final : public study::ResultStore {
 public:
  enum class Opening {
    resume,  ///< goes on with the results that are there
    fresh,   ///< throws away what an earlier run left, whatever its plan
  };

  /// Opens or begins the store in `file`; an empty path is one that is gone with the object. Throws InputError, naming
  /// the file and what to do, where it cannot be opened, is in use, is no store of results or one of another version of
  /// the format, or holds results of another plan. InvalidArgument for a plan with a name twice.
  SqliteResults(const std::filesystem::path& file, const StoredPlan& plan, StoredItems items,
                Opening opening = Opening::resume);
  ~SqliteResults() override;
  SqliteResults(const SqliteResults&) = delete;
  SqliteResults& operator=(const SqliteResults&) = delete;

  [[nodiscard]] bool has(std::size_t item) override;
  /// Throws InputError where the disk is full, and where another result is there already under the item's key.
  void put(std::size_t item, std::string_view result) override;

  /// The result of an item, where it is there.
  [[nodiscard]] std::optional<std::string> get(std::size_t item);
  /// Hands every result that is there to `take`, in the order of the items; one at a time is in memory.
  void each(const std::function<void(std::size_t item, std::string_view result)>& take);
  /// Hands every item without a result to `take`, in their order.
  void each_missing(const std::function<void(std::size_t item)>& take);

  /// Takes over what the stores `files` hold, such as those of shards; all or, where it throws, nothing. Throws
  /// InputError, naming the file, as opening one of them does, and where it has another result under a key than is
  /// there.
  void merge(const std::vector<std::filesystem::path>& files);

  /// The file.
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  /// The items.
  [[nodiscard]] const StoredItems& items() const { return items_; }
  /// Results that are not in the file (StoredItems::passing), by item.
  [[nodiscard]] const std::map<std::size_t, std::string>& passing() const { return passing_; }

 private:
  class Tables;
  std::filesystem::path file_;
  StoredPlan plan_;
  StoredItems items_;
  std::map<std::size_t, std::string> passing_;
  std::unique_ptr<Tables> tables_;
};

}  // namespace wheelwright::results
