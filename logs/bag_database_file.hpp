// SPDX-License-Identifier: Apache-2.0
/// \file
/// What to open of a database that a recorder may not have closed, or that was cut off.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <wheelwright/logs/bag_temporary.hpp>

namespace wheelwright::bag {

/// The file of a database, or a copy of it where SQLite would have to write to it, or would read more than is there: with
/// its journal beside it, which is then played back; up to its last whole page where the file ends inside one. The copy
/// lives as long as this.
class DatabaseFile {
 public:
  /// Looks at `path`; `shown` is its name in sentences. Throws InputError when it cannot be read or copied, or ends inside
  /// its header.
  DatabaseFile(const std::filesystem::path& path, const std::string& shown);

  /// What to open.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Whether a journal is beside it.
  [[nodiscard]] bool has_journal() const { return journal_; }
  /// "at byte 5000: the file ends here, …" where it is shorter than its header says; empty otherwise.
  [[nodiscard]] const std::string& defect() const { return defect_; }

 private:
  void find_journals(const std::filesystem::path& original);
  void find_end(const std::filesystem::path& original, const std::string& shown);
  void copy(const std::filesystem::path& from, const char* name);

  std::filesystem::path path_;
  std::unique_ptr<TemporaryDirectory> directory_;
  bool journal_ = false;
  std::string defect_;
};

}  // namespace wheelwright::bag
