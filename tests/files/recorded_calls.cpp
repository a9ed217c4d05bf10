// SPDX-License-Identifier: Apache-2.0
// Loaded into a program by LD_PRELOAD: appends what it brings to disk, what it renames, and that it listens on the
// network to the file that RECORDED_CALLS names, a line for each that was done,
//
//     sync	PATH	BYTES
//     move	FROM	TO	BYTES
//     listen
//
// RECORDED_CALLS_KILL=N kills the program at the Nth of the first two, RECORDED_CALLS_FAIL=N lets it fail with EIO.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

bool is_now(const char* name, long count) {
  const char* const number = std::getenv(name);
  return number != nullptr && std::strtol(number, nullptr, 10) == count;
}

// Whether this call is to fail.
bool disturbed() {
  static std::atomic<long> count{0};
  const long now = ++count;
  if (is_now("RECORDED_CALLS_KILL", now)) {
    kill(getpid(), SIGKILL);
  }
  errno = EIO;
  return is_now("RECORDED_CALLS_FAIL", now);
}

void record(const std::string& line) {
  const char* const name = std::getenv("RECORDED_CALLS");
  const int file = name == nullptr ? -1 : open(name, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (file >= 0) {
    if (write(file, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      std::abort();
    }
    close(file);
  }
}

std::string whole_path(const char* path) {
  char whole[PATH_MAX];
  return realpath(path, whole) == nullptr ? "" : whole;
}

int synced(const char* name, int descriptor) {
  if (disturbed()) {
    return -1;
  }
  const int result = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, name))(descriptor);
  const int why = errno;
  struct stat now {};
  if (result == 0 && fstat(descriptor, &now) == 0) {
    record("sync\t" + whole_path(("/proc/self/fd/" + std::to_string(descriptor)).c_str()) + "\t" +
           std::to_string(now.st_size) + "\n");
  }
  errno = why;
  return result;
}

}  // namespace

extern "C" {

int fsync(int descriptor) { return synced("fsync", descriptor); }

int fdatasync(int descriptor) { return synced("fdatasync", descriptor); }

int rename(const char* from, const char* to) noexcept {
  if (disturbed()) {
    return -1;
  }
  struct stat before {};
  const bool seen = stat(from, &before) == 0;
  const std::string whole_from = whole_path(from);
  const int result = reinterpret_cast<int (*)(const char*, const char*)>(dlsym(RTLD_NEXT, "rename"))(from, to);
  const int why = errno;
  if (result == 0 && seen) {
    record("move\t" + whole_from + "\t" + whole_path(to) + "\t" + std::to_string(before.st_size) + "\n");
  }
  errno = why;
  return result;
}

int listen(int socket, int backlog) noexcept {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 && address.ss_family != AF_UNIX) {
    record("listen\n");
  }
  return reinterpret_cast<int (*)(int, int)>(dlsym(RTLD_NEXT, "listen"))(socket, backlog);
}
}
