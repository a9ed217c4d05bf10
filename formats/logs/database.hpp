// SPDX-License-Identifier: Apache-2.0
/// \file
/// SQLite databases and statements that close themselves; databases that a recorder did not close or that were cut off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "formats/logs/bag_files.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace wheelwright::logs::bag {

/// A statement and the row that it is at. It must not outlive its database.
class Statement {
 public:
  enum class Result { row, done, failed };

  Statement() = default;
  Statement(sqlite3* database, std::string_view sql);

  /// True if it could be prepared.
  [[nodiscard]] bool ok() const { return statement_ != nullptr; }
  /// Sets parameter `place` (from 1).
  void set(int place, std::int64_t value);
  void set(int place, std::string_view bytes, bool text);
  /// The next row.
  Result step();
  /// To be stepped again, from the start.
  void reset();

  /// Columns (from 0) of the row. Texts and bytes are borrowed until the next call of another member.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] std::optional<std::string_view> blob(int column) const;  ///< nothing where it is of another type
  [[nodiscard]] bool is_integer(int column) const;

 private:
  struct Close {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Close> statement_;
};

/// A database.
class Database {
 public:
  /// How to open one: `unchanging` reads a file that nobody writes, without a lock, and without looking for a journal;
  /// `recovering` may play a journal back into it; `writing` begins an empty one; `keeping` goes on with one of ours,
  /// or begins it where there is none, and keeps everybody else out until it is closed.
  enum class Mode { unchanging, recovering, writing, keeping };

  /// With `keeping`, an empty path is a database that is gone when it is closed. Throws InputError, beginning with
  /// `shown`, when it cannot be opened; with every mode but `unchanging`, naming the journal, where one beside it is a
  /// link or no file, or names a super-journal, which SQLite would delete.
  Database(const std::filesystem::path& path, const std::string& shown, Mode mode);

  [[nodiscard]] Statement prepare(std::string_view sql) const { return {database_.get(), sql}; }
  /// Runs statements without results; false when one fails.
  bool run(const std::string& sql);
  /// Forgets pages that were read: SQLite examines a page when it reads it, and takes it for good from then on. No
  /// statement may be at a row.
  void forget();
  /// From here on statements may take `steps` of SQLite's machine together; then they fail.
  void bound(std::uint64_t steps);
  /// What went wrong last, in words.
  [[nodiscard]] std::string error() const;
  /// True if that was another process that has it open.
  [[nodiscard]] bool in_use() const;
  /// Closes it; false when that fails.
  bool close();

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::unique_ptr<std::uint64_t> left_;  ///< steps in units of `steps_at_once`; outlives the database, which counts it
  std::unique_ptr<sqlite3, Close> database_;
};

/// The file of a database, or a copy of it where SQLite would have to write to it, or would read more than is there:
/// with its journal beside it, which is then played back; up to its last whole page where the file ends inside one. The
/// copy lives as long as this.
class DatabaseFile {
 public:
  /// Looks at `path`; `shown` is its name in sentences. Throws InputError when it cannot be read or copied, ends inside
  /// its header, or, without `trust`, where a journal is a link, larger than `largest_journal` or made of holes, and
  /// where the copy of the database would be larger than `largest_copy`. A rollback journal names the super-journal
  /// of its transaction, which SQLite deletes when it has played the journal back: the copy names none.
  DatabaseFile(const std::filesystem::path& path, const std::string& shown, bool trust = false);

  /// What to open.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// True if a journal is beside it.
  [[nodiscard]] bool has_journal() const { return journal_; }
  /// "at byte 5000: the file ends here, …" where it is shorter than its header says; empty otherwise.
  [[nodiscard]] const std::string& defect() const { return defect_; }

 private:
  void find_journals(const std::filesystem::path& original, bool trust);
  void find_end(const std::filesystem::path& original, const std::string& shown, bool trust);
  void copy_database(const std::filesystem::path& from, bool trust);
  void copy(const std::filesystem::path& from, const char* name);

  std::filesystem::path path_;
  std::unique_ptr<files::Temporary> directory_;
  bool journal_ = false;
  std::string defect_;
};

}  // namespace wheelwright::logs::bag
