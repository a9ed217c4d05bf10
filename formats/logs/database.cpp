// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/database.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <sqlite3.h>

#include "core/error.hpp"
#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs::bag {
namespace {

namespace fs = std::filesystem;

/// What ends a rollback journal that names a super-journal (SQLite, "Database File Format", section 3).
constexpr std::string_view journal_magic("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);

/// True if a journal names a super-journal, as far as SQLite is concerned: it looks at the end only.
bool names_super_journal(std::istream& journal) {
  std::string end(journal_magic.size(), '\0');
  return journal.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end) &&
         journal.read(end.data(), static_cast<std::streamsize>(end.size())) && end == journal_magic;
}

/// Throws unless SQLite may do with the journals beside a database what it does: play them back, empty and delete them,
/// and delete the super-journal that a rollback journal names. A database of this program is never part of a
/// transaction over several, so its journal names none.
void check_journals(const fs::path& database) {
  for (const char* const ending : {"-journal", "-wal"}) {
    fs::path beside = database;
    beside += ending;
    std::error_code error;
    const fs::file_status status = fs::symlink_status(beside, error);
    if (!fs::exists(status)) {
      continue;
    }
    if (!fs::is_regular_file(status) || fs::hard_link_count(beside, error) > 1) {
      throw InputError(
          fmt::format("{}: is a link, or no file: expected a journal beside its database; remove it, or "
                      "give another place",
                      beside.string()));
    }
    std::ifstream journal(beside, std::ios::binary);
    if (std::string_view(ending) == "-journal" && names_super_journal(journal)) {
      throw InputError(
          fmt::format("{}: names another file, which SQLite would delete: expected the journal of a "
                      "database that this program wrote, which names none; remove it, or give another "
                      "place",
                      beside.string()));
    }
  }
}

/// What reading a foreign file takes: rows and what its tables are like. No function, no attached file, no change.
int only_reading(void* /*data*/, int action, const char* what, const char* /*argument*/, const char* /*schema*/,
                 const char* /*inner*/) {
  const std::string_view name = what == nullptr ? "" : what;
  const bool allowed = action == SQLITE_SELECT || action == SQLITE_READ ||
                       (action == SQLITE_PRAGMA && (name == "table_list" || name == "table_xinfo"));
  return allowed ? SQLITE_OK : SQLITE_DENY;
}

constexpr int steps_at_once = 10'000;

/// What a file says is data, also where it may be one of ours.
void distrust(sqlite3* database) {
  sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
}

/// `path` as SQLite's "file:" address.
std::string address(const std::filesystem::path& path) {
  std::string text = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    text += std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '_' || c == '-' ? std::string(1, c)
                                                                                    : fmt::format("%{:02X}", byte);
  }
  return text;
}

}  // namespace

void Statement::Close::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement::Statement(sqlite3* database, std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
  statement_.reset(statement);
}

void Statement::set(int place, std::int64_t value) { sqlite3_bind_int64(statement_.get(), place, value); }

void Statement::set(int place, std::string_view bytes, bool text) {
  if (text) {
    sqlite3_bind_text64(statement_.get(), place, bytes.data(), bytes.size(), SQLITE_STATIC, SQLITE_UTF8);
  } else {
    sqlite3_bind_blob64(statement_.get(), place, bytes.empty() ? "" : bytes.data(), bytes.size(), SQLITE_STATIC);
  }
}

Statement::Result Statement::step() {
  switch (sqlite3_step(statement_.get())) {
    case SQLITE_ROW: return Result::row;
    case SQLITE_DONE: return Result::done;
    default: return Result::failed;
  }
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

std::string_view Statement::text(int column) const {
  const auto* const bytes = sqlite3_column_text(statement_.get(), column);
  return bytes == nullptr ? std::string_view()
                          : std::string_view(reinterpret_cast<const char*>(bytes),
                                             static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)));
}

std::optional<std::string_view> Statement::blob(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_BLOB) {
    return std::nullopt;
  }
  const auto* const bytes = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return bytes == nullptr ? std::string_view() : std::string_view(bytes, size);
}

bool Statement::is_integer(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_INTEGER; }

void Database::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

Database::Database(const std::filesystem::path& path, const std::string& shown, Mode mode) {
  const int flags = mode == Mode::unchanging ? SQLITE_OPEN_READONLY
                    : mode == Mode::keeping  ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE
                                             : SQLITE_OPEN_READWRITE;
  const std::string name = path.empty() ? "" : address(path) + (mode == Mode::unchanging ? "?immutable=1" : "");
  sqlite3* database = nullptr;
  const int result = sqlite3_open_v2(name.c_str(), &database, flags | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (result != SQLITE_OK) {
    throw InputError(fmt::format("{}: cannot be opened as an SQLite database ({})", shown, error()));
  }
  if (mode != Mode::unchanging) {
    // SQLite follows links to the database, and looks for its journals there.
    const char* const real = sqlite3_db_filename(database, "main");
    if (real != nullptr && *real != '\0') {
      check_journals(real);
    }
  }
  distrust(database);
  if (mode == Mode::writing) {
    return;
  }
  if (mode == Mode::keeping) {
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    // Before the first look at the file: its write-ahead log then needs no memory shared between processes, which file
    // systems of clusters lack.
    run("PRAGMA locking_mode=EXCLUSIVE; PRAGMA cell_size_check=ON;");
    return;
  }
  // With a writable schema SQLite reads files that are cut off up to their last whole page; nothing is written.
  // Defensive mode would take that back.
  run("PRAGMA writable_schema=ON; PRAGMA cell_size_check=ON; PRAGMA temp_store=MEMORY;");
  sqlite3_set_authorizer(database, only_reading, nullptr);
}

bool Database::run(const std::string& sql) {
  return sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
}

void Database::bound(std::uint64_t steps) {
  if (left_ == nullptr) {
    left_ = std::make_unique<std::uint64_t>();
    sqlite3_progress_handler(
        database_.get(), steps_at_once,
        [](void* left) {
          auto& units = *static_cast<std::uint64_t*>(left);
          units -= units > 0 ? 1 : 0;
          return units == 0 ? 1 : 0;
        },
        left_.get());
  }
  *left_ = steps / steps_at_once + 1;
}

void Database::forget() { sqlite3_db_release_memory(database_.get()); }

std::string Database::error() const {
  return sqlite3_errcode(database_.get()) == SQLITE_INTERRUPT
             ? "reading takes more steps than a sound table of this size: its pages lead to each other again and again"
             : sqlite3_errmsg(database_.get());
}

bool Database::in_use() const {
  const int code = sqlite3_errcode(database_.get());
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

bool Database::close() { return sqlite3_close(database_.release()) == SQLITE_OK; }

namespace {

/// Bytes of the header of a database (SQLite, "Database File Format", section 1.3).
constexpr std::size_t header_bytes = 100;

/// A number of the header, which is big-endian.
std::uint64_t number_at(const std::string& header, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = at; k < at + size; ++k) {
    value = value << 8 | static_cast<unsigned char>(header[k]);
  }
  return value;
}

/// Takes the name of a super-journal off a copy of a journal: without its magic number it is none. What the journal
/// holds is played back as if the transaction had not been finished, which leaves the database whole.
void forget_super_journal(const fs::path& journal) {
  std::fstream file(journal, std::ios::in | std::ios::out | std::ios::binary);
  if (names_super_journal(file)) {
    const std::string none(journal_magic.size(), '\0');
    file.seekp(-static_cast<std::streamoff>(none.size()), std::ios::end);
    file.write(none.data(), static_cast<std::streamsize>(none.size()));
    file.flush();
    if (!file) {
      throw InputError(fmt::format("{}: cannot be written: expected room there", journal.string()));
    }
  }
}

}  // namespace

DatabaseFile::DatabaseFile(const fs::path& path, const std::string& shown, bool trust) : path_(path) {
  find_end(path, shown, trust);
  find_journals(path, trust);
}

void DatabaseFile::find_end(const fs::path& original, const std::string& shown, bool trust) {
  mcap::WindowedFile file(original, false);
  const std::uint64_t size = file.size();
  const std::string header = file.peek(0, static_cast<std::size_t>(std::min<std::uint64_t>(header_bytes, size)));
  if (header.size() < header_bytes) {
    throw InputError(fmt::format(
        "{}: at byte {}: the file ends inside the header of its database: nothing of it can be read", shown, size));
  }
  const std::uint64_t page = number_at(header, 16, 2) == 1 ? 65536 : number_at(header, 16, 2);
  const std::uint64_t expected = number_at(header, 28, 4) * page;
  const bool counted = number_at(header, 24, 4) == number_at(header, 92, 4);
  if (page < 512 || (page & (page - 1)) != 0) {
    return;  // SQLite will say that it is none
  }
  if (counted && expected > size) {
    defect_ = fmt::format("at byte {}: the file ends here, and should have {} bytes: it was cut off", size, expected);
  } else if (size % page != 0) {
    defect_ = fmt::format("at byte {}: the file ends inside a page: it was cut off, or something follows it", size);
  }
  if (size % page != 0) {
    copy_database(original, trust);
    std::error_code error;
    fs::resize_file(path_, size - size % page, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be cut to whole pages ({})", path_.string(), error.message()));
    }
  }
}

void DatabaseFile::find_journals(const fs::path& original, bool trust) {
  for (const char* const ending : {"-wal", "-journal"}) {
    fs::path beside = original;
    beside += ending;
    std::error_code error;
    const auto size = fs::file_size(beside, error);
    if (!error && size > 0) {
      if (!trust && !fs::is_regular_file(fs::symlink_status(beside, error))) {
        throw InputError(
            fmt::format("{}: is a link: expected a journal beside its database, or --trust", beside.string()));
      }
      if (!trust && size > largest_journal) {
        throw InputError(fmt::format("{}: has {} bytes, and would be copied: expected at most {}, or --trust",
                                     beside.string(), size, largest_journal));
      }
      if (!trust) {
        refuse_holes(beside);
      }
      if (!directory_) {
        copy_database(original, trust);
      }
      const fs::path database = path_;
      copy(beside, (std::string("bag.db3") + ending).c_str());
      if (std::string_view(ending) == "-journal") {
        forget_super_journal(path_);
      }
      path_ = database;
      journal_ = true;
      defect_.clear();  // what is missing may be in the journal
    }
  }
}

void DatabaseFile::copy_database(const fs::path& from, bool trust) {
  std::error_code error;
  const auto size = fs::file_size(from, error);
  if (!trust && !error && size > largest_copy) {
    throw InputError(
        fmt::format("{}: has {} bytes, and would be copied, since it was cut off or not closed: expected at most {}, "
                    "or --trust",
                    from.string(), size, largest_copy));
  }
  copy(from, "bag.db3");
}

void DatabaseFile::copy(const fs::path& from, const char* name) {
  if (!directory_) {
    directory_ = temporary_directory();
  }
  path_ = directory_->path() / name;
  std::error_code error;
  fs::copy_file(from, path_, error);
  if (error) {
    throw InputError(
        fmt::format("{}: cannot be copied to {} ({}): a recording that was not closed, or was cut off, is read "
                    "from a copy; expected room there, or TMPDIR to name another directory",
                    from.string(), path_.string(), error.message()));
  }
  fs::permissions(path_, fs::perms::owner_read | fs::perms::owner_write, fs::perm_options::add, error);
}

}  // namespace wheelwright::logs::bag
