// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_database_file.hpp>

#include <algorithm>
#include <cstdint>
#include <system_error>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/mcap_file.hpp>

namespace wheelwright::bag {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

DatabaseFile::DatabaseFile(const fs::path& path, const std::string& shown) : path_(path) {
  find_end(path, shown);
  find_journals(path);
}

void DatabaseFile::find_end(const fs::path& original, const std::string& shown) {
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
    copy(original, "bag.db3");
    std::error_code error;
    fs::resize_file(path_, size - size % page, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be cut to whole pages ({})", path_.string(), error.message()));
    }
  }
}

void DatabaseFile::find_journals(const fs::path& original) {
  for (const char* const ending : {"-wal", "-journal"}) {
    fs::path beside = original;
    beside += ending;
    std::error_code error;
    const auto size = fs::file_size(beside, error);
    if (!error && size > 0) {
      if (!directory_) {
        copy(original, "bag.db3");
      }
      const fs::path database = path_;
      copy(beside, (std::string("bag.db3") + ending).c_str());
      path_ = database;
      journal_ = true;
      defect_.clear();  // what is missing may be in the journal
    }
  }
}

void DatabaseFile::copy(const fs::path& from, const char* name) {
  if (!directory_) {
    directory_ = std::make_unique<TemporaryDirectory>();
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

}  // namespace wheelwright::bag
