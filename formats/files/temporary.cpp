// SPDX-License-Identifier: Apache-2.0
#include "formats/files/temporary.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/error.hpp"

namespace wheelwright::files {
namespace {

namespace fs = std::filesystem;

constexpr int most_numbers = 1000;
constexpr off_t beyond_all_locks = off_t{1} << 62;  // libraries lock bytes of what they write, none so far behind

struct Living {
  std::mutex mutex;
  std::set<fs::path> paths;
};

Living& living() {
  static Living all;
  return all;
}

// Held while renames that belong together are made.
std::mutex& together() {
  static std::mutex mutex;
  return mutex;
}

bool holds_lock(int descriptor, bool directory) {
  if (directory) {
    return flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  }
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = beyond_all_locks;
  lock.l_len = 1;
  return fcntl(descriptor, F_OFD_SETLK, &lock) == 0;
}

int opened(const fs::path& path, bool directory) {
  return open(path.c_str(), (directory ? O_RDONLY | O_DIRECTORY : O_RDWR | O_NONBLOCK) | O_NOFOLLOW | O_CLOEXEC);
}

// Removes what a program of this user left that was killed; false where it is anything else.
bool bury(const fs::path& path, bool directory) {
  const int descriptor = opened(path, directory);
  struct stat here {
  }, there{};
  const bool dead = descriptor >= 0 && fstat(descriptor, &here) == 0 && here.st_uid == geteuid() &&
                    (directory || S_ISREG(here.st_mode)) && holds_lock(descriptor, directory) &&
                    lstat(path.c_str(), &there) == 0 && there.st_ino == here.st_ino && there.st_dev == here.st_dev;
  std::error_code error;
  if (dead) {
    fs::remove_all(path, error);
  }
  if (descriptor >= 0) {
    close(descriptor);
  }
  return dead && !error;
}

// A new one with its lock; −1 and errno where there is none.
int made(const fs::path& path, Temporary::Kind kind) {
  const bool directory = kind != Temporary::Kind::file;
  int descriptor = -1;
  if (!directory) {
    descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } else if (mkdir(path.c_str(), kind == Temporary::Kind::private_directory ? 0700 : 0777) == 0) {
    descriptor = opened(path, true);
    errno = descriptor < 0 && errno == ENOENT ? EEXIST : errno;  // somebody took it for a dead one before it had a lock
  }
  if (descriptor < 0) {
    return -1;
  }
  // Not on every file system: then nobody can tell that this one is dead.
  const bool taken = !holds_lock(descriptor, directory) && (errno == EWOULDBLOCK || errno == EACCES);
  struct stat here {};
  if (taken ||
      (fstat(descriptor, &here) == 0 && here.st_nlink == 0)) {  // somebody was faster, and took it for a dead one
    close(descriptor);
    errno = EEXIST;
    return -1;
  }
  return descriptor;
}

// Brings to disk what is open. Returns why not; file systems that cannot be asked are none's fault.
std::string synced(int descriptor) {
  return fsync(descriptor) == 0 || errno == EINVAL || errno == ENOSYS ? "" : std::strerror(errno);
}

// Gives `part` the mode of the file `place` that it is to replace. Returns why that may not be replaced.
std::string keep_mode(const fs::path& part, const fs::path& place) {
  struct stat there {};
  if (lstat(place.c_str(), &there) != 0 || !S_ISREG(there.st_mode)) {
    return "";
  }
  if (faccessat(AT_FDCWD, place.c_str(), W_OK, AT_EACCESS) != 0) {
    return std::strerror(errno);
  }
  return chmod(part.c_str(), there.st_mode & 07777U) == 0 || errno == EPERM ? "" : std::strerror(errno);
}

constexpr std::string_view part = ".wheelwright-part";

// What killed programs left in a directory under other names of their results, which nobody may write again. Once for a
// directory: it may hold much.
void bury_parts(const fs::path& stem) {
  static std::set<fs::path> done;
  if (!stem.filename().native().ends_with(part) || !done.insert(stem.parent_path()).second) {
    return;
  }
  std::error_code error;
  const fs::path folder = stem.has_parent_path() ? stem.parent_path() : fs::path(".");
  for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename().native();
    const std::size_t digits = name.find_last_not_of("0123456789") + 1;
    if (digits < name.size() && std::string_view(name).substr(0, digits).ends_with(part) &&
        !living().paths.contains(entry->path())) {
      std::error_code gone;
      bury(entry->path(), entry->symlink_status(gone).type() == fs::file_type::directory);
    }
  }
}

}  // namespace

Temporary::Temporary(const fs::path& stem, Kind kind, const std::string& shown, const std::string& expected) {
  const std::scoped_lock guard(living().mutex);
  bury_parts(stem);
  for (int number = 0, tries = 0; number < most_numbers && lock_ < 0 && tries < 2 * most_numbers; ++tries) {
    path_ = stem;
    path_ += std::to_string(number);
    lock_ = made(path_, kind);
    if (lock_ < 0 && errno != EEXIST) {
      break;
    }
    number += lock_ < 0 && !bury(path_, kind != Kind::file) ? 1 : 0;
  }
  if (lock_ < 0) {
    throw InputError(shown + (kind == Kind::file ? ": cannot be written (" : ": cannot be made (") +
                     std::strerror(errno) + "): expected " + expected);
  }
  living().paths.insert(path_);
}

Temporary::~Temporary() {
  if (!path_.empty()) {
    const std::scoped_lock guard(living().mutex);
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    living().paths.erase(path_);
  }
  close(lock_);
}

std::string Temporary::move_to(const fs::path& place) {
  const std::scoped_lock guard(living().mutex);
  if (std::string why = keep_mode(path_, place); !why.empty()) {
    return why;
  }
  if (std::string why = synced(lock_); !why.empty()) {
    return why;
  }
  std::error_code error;
  fs::rename(path_, place, error);
  if (error) {
    return error.message();
  }
  living().paths.erase(std::exchange(path_, {}));
  return sync_directory(place.parent_path());
}

PathLock::PathLock(const fs::path& path, Kind kind) {
  std::error_code none;
  if (!fs::is_directory(path, none) && !fs::is_regular_file(path, none)) {
    return;  // to open a pipe or a device can do something
  }
  descriptor_ = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  taken_ = descriptor_ >= 0 && flock(descriptor_, (kind == Kind::alone ? LOCK_EX : LOCK_SH) | LOCK_NB) != 0 &&
           errno == EWOULDBLOCK;
}

PathLock::~PathLock() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

bool PathLock::gone() const {
  struct stat here {};
  return descriptor_ >= 0 && fstat(descriptor_, &here) == 0 && here.st_nlink == 0;
}

std::string sync_directory(const fs::path& directory) {
  const int descriptor = open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) {
    return errno == EACCES ? "" : std::strerror(errno);
  }
  std::string why = synced(descriptor);
  close(descriptor);
  return why;
}

std::string move_together(const fs::path& from, const fs::path& to, const std::vector<std::string>& names,
                          const std::vector<std::string>& gone) {
  const std::scoped_lock guard(together());
  const fs::path earlier = from / "earlier";  // second names of what is replaced
  std::error_code error, ignored;
  fs::create_directory(earlier, ignored);
  std::vector<std::string> done;
  const auto replace = [&](const std::string& name, bool by_nothing) {
    if (const std::string kept = by_nothing ? "" : keep_mode(from / name, to / name); !kept.empty()) {
      return (to / name).string() + ": cannot be written (" + kept + ")";
    }
    const bool there = fs::exists(fs::symlink_status(to / name, ignored));
    std::error_code unkept;
    if (there) {
      fs::create_hard_link(to / name, earlier / name, unkept);
    }
    by_nothing ? static_cast<void>(fs::remove(to / name, error)) : fs::rename(from / name, to / name, error);
    if (!error && !unkept) {
      done.push_back(name);
    }
    return error ? (to / name).string() + ": cannot be written (" + error.message() + ")" : std::string();
  };
  std::string why;
  for (auto name = gone.begin(); why.empty() && name != gone.end(); ++name) {
    why = replace(*name, true);
  }
  for (auto name = names.begin(); why.empty() && name != names.end(); ++name) {
    why = replace(*name, false);
  }
  if (why.empty()) {
    why = sync_directory(to);
    return why.empty() ? why : to.string() + ": cannot be brought to disk (" + why + ")";
  }
  for (const std::string& name : done) {
    fs::exists(earlier / name, ignored) ? fs::rename(earlier / name, to / name, ignored)
                                        : static_cast<void>(fs::remove(to / name, ignored));
  }
  return why;
}

void remove_temporaries() {
  together().lock();  // and never given back
  living().mutex.lock();
  for (const fs::path& path : living().paths) {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
}

}  // namespace wheelwright::files
