// SPDX-License-Identifier: Apache-2.0
#include "app/common.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <mutex>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/bag_files.hpp"

namespace wheelwright::app {

namespace {

// errno of the first failure of standard output, of which a process has one
int output_error = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

void put(std::FILE* stream, std::string_view text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stream) != text.size() && stream == stdout && output_error == 0) {
    output_error = errno;
  }
}

}  // namespace

void write_text(std::FILE* stream, std::string_view text) { put(stream, files::printable(text)); }

namespace {

bool& standard_output_is_taken() {
  static bool taken = false;
  return taken;
}

}  // namespace

std::FILE* stream_of_words() { return standard_output_is_taken() ? stderr : stdout; }

void say_lines(std::string_view text) { write_text(stream_of_words(), text); }

void tell_error(std::string_view message) {
  std::string text = "wheelwright: ";
  for (std::size_t end = 0; !message.empty(); message.remove_prefix(end)) {
    end = message.find("\n ", 1);
    end = end == std::string_view::npos ? message.size() : end;
    const bool own = message.starts_with("\n ");
    text += (own ? "\n" : "") + files::one_line(message.substr(own ? 1 : 0, end - (own ? 1 : 0)));
  }
  write_text(stderr, text + "\n");
}

void say_json(const Json& result) { put(stdout, files::json_text(result) + "\n"); }

void say_line(std::string_view line) {
  put(stdout, line);
  put(stdout, "\n");
  errno = 0;
  if (std::fflush(stdout) != 0 && output_error == 0) {
    output_error = errno;
  }
  if (std::ferror(stdout) != 0) {
    throw OutputLost();
  }
}

int finished(int code) {
  std::cout.flush();
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int error = output_error != 0 ? output_error : errno;
  if (flushed && std::ferror(stdout) == 0 && std::cout.good()) {
    return code;
  }
  tell("wheelwright: standard output: cannot be written ({}): what stands there is not whole; expected room there\n",
       std::strerror(error));
  return kBadInput;
}

namespace {

std::vector<std::filesystem::path>& made_directories() {
  static std::vector<std::filesystem::path> made;  // the innermost first
  return made;
}

std::mutex& made_mutex() {
  static std::mutex mutex;
  return mutex;
}

constexpr std::string_view kPage = "report.html";
constexpr std::string_view kGathered = ".wheelwright-part";
constexpr std::string_view kHead = "<head>\n";
constexpr std::chrono::seconds kOneRun(10);  // between files that one run writes, when a directory is copied, too

constexpr std::string_view kGenerator = "<meta name=\"generator\" content=\"wheelwright ";

// What the program was started with: "/dev/stdout".
bool is_own_stream(const std::filesystem::path& out) {
  std::error_code none;
  const std::filesystem::path parent = out.parent_path();
  return parent == "/dev/fd" || parent == "/proc/self/fd" ||
         std::filesystem::read_symlink(out, none).native().starts_with("/proc/self/fd/");
}

bool is_there(const std::filesystem::path& out) {
  std::error_code none;
  return std::filesystem::exists(out, none) && !is_stream(out);
}

std::string beginning(const std::filesystem::path& file) {
  constexpr std::streamsize kMarked = 1024;
  std::string text(kMarked, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), kMarked);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

// Where the result may stand by which the files in `out` are known: in its place, and, of runs that were killed when
// they had put some files in place, where they had gathered them.
std::vector<std::filesystem::path> results_of(const CommonOptions& options, const std::string& result) {
  std::vector<std::filesystem::path> all = {options.out / result};
  std::error_code none;
  for (auto entry = std::filesystem::directory_iterator(options.out, none);
       !none && entry != std::filesystem::directory_iterator(); entry.increment(none)) {
    if (entry->path().filename().native().starts_with(kGathered)) {
      all.push_back(entry->path() / result);
    }
  }
  return all;
}

// Empty where this command may replace the file `name` of its results, the first of which is `result`; else whose the
// file is.
std::string whose(const CommonOptions& options, const std::string& result, const std::string& name) {
  const std::filesystem::path place = options.out / name;
  const std::string text = beginning(place);
  const std::string command = "`wheelwright " + options.command + "`";
  if (name == kPage) {
    if (const std::size_t at = text.find(kGenerator); at != std::string::npos) {
      const std::size_t from = at + kGenerator.size();
      const std::string of = text.substr(from, text.find('"', from) - from);
      return of == options.command ? "" : "the page of `wheelwright " + of + "`";
    }
  }
  const auto made_here = [&](const std::string& of_result) {
    const std::string kind = std::filesystem::path(result).stem().string();
    return of_result.find("\"schema\": \"wheelwright/" + kind + "/") != std::string::npos;
  };
  if (name == result) {
    return made_here(text) ? "" : "no result of " + command;
  }
  std::string other = "not written by " + command;
  for (const std::filesystem::path& told : results_of(options, result)) {
    if (made_here(beginning(told))) {
      std::error_code error;
      const auto written = std::filesystem::last_write_time(told, error);
      if (std::filesystem::last_write_time(place, error) <= written + kOneRun) {
        return "";
      }
      other = "changed since " + command + " wrote it";
    }
  }
  return other;
}

}  // namespace

void remove_empty_directories() {
  std::error_code none;
  const std::lock_guard<std::mutex> lock(made_mutex());
  for (const std::filesystem::path& made : made_directories()) {
    if (std::filesystem::is_directory(made, none)) {
      std::filesystem::remove(made, none);  // fails where something is in it
    }
  }
}

void keep_existing(const CommonOptions& options, const std::filesystem::path& out, std::string_view mark) {
  if (!options.force && is_there(out) && (mark.empty() || beginning(out).find(mark) == std::string::npos)) {
    throw InputError(out.string() + ": is there already: expected a new name, or --force");
  }
}

bool is_stream(const std::filesystem::path& out) {
  std::error_code none;
  const std::filesystem::file_status there = std::filesystem::status(out, none);
  return std::filesystem::exists(there) && (std::filesystem::is_other(there) || is_own_stream(out));
}

void leave_standard_output(const CommonOptions& options, const std::filesystem::path& out) {
  struct stat there {
  }, ours{};
  if (!is_own_stream(out) || stat(out.c_str(), &there) != 0 || fstat(STDOUT_FILENO, &ours) != 0 ||
      there.st_dev != ours.st_dev || there.st_ino != ours.st_ino) {
    return;
  }
  if (options.json) {
    throw InputError(out.string() + ": is the standard output, where --json prints: expected one of them");
  }
  standard_output_is_taken() = true;
}

namespace {

// Whether `path` is one of the files of the recording in `directory`, or its metadata.yaml.
bool is_of_recording(const std::filesystem::path& path, const std::filesystem::path& directory) {
  std::error_code none;
  if (!std::filesystem::is_directory(directory, none) || !std::filesystem::exists(path, none)) {
    return false;
  }
  try {
    const logs::bag::Parts parts = logs::bag::parts_of(directory, true);
    return std::filesystem::equivalent(path, parts.metadata, none) ||
           std::ranges::any_of(parts.files, [&](const logs::bag::Part& part) {
             return std::filesystem::equivalent(path, part.path, none);
           });
  } catch (const InputError&) {  // no recording
    return false;
  }
}

// Whether a file `path` that is not there yet would be read with the recording in `directory`.
bool would_be_of_recording(const std::filesystem::path& path, const std::filesystem::path& directory) {
  std::error_code none;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  return !logs::bag::storage_ending(path).empty() && std::filesystem::is_directory(directory, none) &&
         std::filesystem::equivalent(folder, directory, none);
}

}  // namespace

bool is_read(const std::filesystem::path& path, const std::vector<std::filesystem::path>& read) {
  return std::ranges::any_of(read, [&](const std::filesystem::path& each) {
    std::error_code neither;
    return std::filesystem::equivalent(path, each, neither) || is_of_recording(path, each);
  });
}

void keep_inputs(const std::filesystem::path& out, const std::vector<std::filesystem::path>& read) {
  if (is_read(out, read)) {
    throw InputError(out.string() + ": is what is read: expected another name");
  }
  if (std::ranges::any_of(read, [&](const std::filesystem::path& each) { return would_be_of_recording(out, each); })) {
    throw InputError(out.string() +
                     ": would be one of the files of the recording that is read: expected another directory");
  }
}

void keep_inputs(const CommonOptions& options, const std::vector<std::string>& files,
                 const std::vector<std::filesystem::path>& read) {
  std::vector<std::string> names = files;
  names.emplace_back(kPage);
  for (const std::string& name : names) {
    if (!options.out.empty() && is_read(options.out / name, read)) {
      throw InputError((options.out / name).string() + ": is what is read: expected another directory");
    }
  }
}

namespace {

// A directory that results go into.
struct ResultPlace {
  std::filesystem::path out;
  std::string result;             // name of the command's result
  std::vector<std::string> left;  // names of what an earlier run of the command left
  std::unique_ptr<files::PathLock> lock;
};

std::vector<ResultPlace>& result_places() {
  static std::vector<ResultPlace> all;
  return all;
}

// Null where it was not made by make_directory() with names of results.
ResultPlace* place_of(const CommonOptions& options) {
  const auto place = std::ranges::find(result_places(), options.out, &ResultPlace::out);
  return place == result_places().end() ? nullptr : &*place;
}

void create_out(const CommonOptions& options) {
  std::error_code error;
  std::vector<std::filesystem::path> made;
  for (std::filesystem::path at = options.out; !at.empty() && !std::filesystem::exists(at, error);
       at = at.parent_path()) {
    made.push_back(at);
  }
  made_directories().insert(made_directories().begin(), made.begin(), made.end());
  error.clear();
  std::filesystem::create_directories(options.out, error);
  if (error || !std::filesystem::is_directory(options.out)) {
    throw InputError("--out " + options.out.string() + ": cannot make this directory" +
                     (error ? " (" + error.message() + ")" : "") + ": expected a place where files can be written");
  }
}

std::unique_ptr<files::PathLock> locked(const CommonOptions& options, files::PathLock::Kind kind) {
  const std::string shown = "--out " + options.out.string();
  auto lock = lock_or_refuse(options.out, kind, shown);
  while (lock->gone()) {  // a run that failed removed what it had made
    create_out(options);
    lock = lock_or_refuse(options.out, kind, shown);
  }
  return lock;
}

}  // namespace

std::unique_ptr<files::PathLock> lock_or_refuse(const std::filesystem::path& path, files::PathLock::Kind kind,
                                                const std::string& shown) {
  auto lock = std::make_unique<files::PathLock>(path, kind);
  if (lock->taken() && !lock->gone()) {
    throw InputError(shown + ": another run is writing into it: wait until that has ended, or choose another --out");
  }
  return lock;
}

void make_directory(const CommonOptions& options, const std::vector<std::string>& files, files::PathLock::Kind lock) {
  if (options.out.empty()) {
    return;
  }
  keep_inputs(options, files, options.read);
  const std::lock_guard<std::mutex> guard(made_mutex());
  create_out(options);
  if (files.empty() || place_of(options) != nullptr) {
    return;
  }
  ResultPlace place{options.out, files.front(), {}, locked(options, lock)};
  std::vector<std::string> names = files;
  names.emplace_back(kPage);
  for (const std::string& name : names) {
    files::check_destination(options.out / name);
    if (const std::filesystem::path file = options.out / name; is_there(file)) {
      const std::string other = whose(options, files.front(), name);
      if (!other.empty() && !options.force) {
        throw InputError(fmt::format("{}: is there already, {}: expected another --out, or --force to replace it",
                                     file.string(), other));
      }
      if (other.empty() && std::ranges::count(place.left, name) == 0) {
        place.left.push_back(name);
      }
    }
  }
  result_places().push_back(std::move(place));
}

namespace {

// What a run writes into `out`, all of it before any of it is put there.
struct Gathering {
  explicit Gathering(const std::filesystem::path& place)
      : out(place),
        directory(place / kGathered, files::Temporary::Kind::directory, place.string(),
                  "a writable place with room on the disk") {}

  std::filesystem::path out;
  files::Temporary directory;
};

std::unique_ptr<Gathering>& gathering() {
  static std::unique_ptr<Gathering> now;
  return now;
}

Gathering& gathering_for(const CommonOptions& options) {
  std::unique_ptr<Gathering>& now = gathering();
  if (!now || now->out != options.out) {
    now = std::make_unique<Gathering>(options.out);
  }
  return *now;
}

std::string named_page(const CommonOptions& options, std::string page) {
  if (const std::size_t head = page.find(kHead); head != std::string::npos) {
    page.insert(head + kHead.size(), fmt::format("{}{}\">\n", kGenerator, options.command));
  }
  return files::valid_utf8(page);
}

// Links stay what they are, and pipes and devices are written to.
bool is_to_be_renamed(const std::filesystem::path& to) {
  const std::filesystem::file_status there = std::filesystem::symlink_status(to);
  return !std::filesystem::exists(there) || std::filesystem::is_regular_file(there);
}

void write_to(const std::filesystem::path& to, const std::filesystem::path& from) {
  std::ifstream in(from, std::ios::binary);
  files::AtomicFile out(to);
  std::string piece(std::size_t{1} << 16, '\0');
  while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())), in.gcount() > 0) {
    out.write(std::string_view(piece).substr(0, static_cast<std::size_t>(in.gcount())));
  }
  out.commit();
}

}  // namespace

void write_failure_page(const CommonOptions& options, std::string page) {
  const ResultPlace* const place = place_of(options);
  if (!options.out.empty() && (place == nullptr || std::ranges::count(place->left, place->result) == 0)) {
    files::atomic_write(options.out / kPage, named_page(options, std::move(page)));
  }
}

std::filesystem::path gathered(const CommonOptions& options) { return gathering_for(options).directory.path(); }

void discard_gathered() { gathering().reset(); }

void publish(const CommonOptions& options, const Json& result, const std::string& name, const std::string& report) {
  if (!options.out.empty()) {
    const Gathering& all = gathering_for(options);
    const std::filesystem::path& from = all.directory.path();
    if (!report.empty()) {
      files::atomic_write(from / kPage, named_page(options, report));
    }
    files::write_json(from / name, result);
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(from)) {
      names.push_back(entry.path().filename().string());
    }
    std::ranges::sort(names, {}, [&](const std::string& each) { return std::pair(each == name, each); });
    const ResultPlace* const place = place_of(options);
    std::vector<std::string> gone = place != nullptr ? place->left : std::vector<std::string>();
    std::erase_if(gone, [&](const std::string& each) { return std::ranges::count(names, each) > 0; });
    // Files one after another and without a break; before them what is written to as it is, which may wait for a
    // reader.
    const auto renamed = std::stable_partition(
        names.begin(), names.end(), [&](const std::string& each) { return !is_to_be_renamed(options.out / each); });
    std::for_each(names.begin(), renamed, [&](const std::string& each) { write_to(options.out / each, from / each); });
    if (const std::string why = files::move_together(from, options.out, {renamed, names.end()}, gone); !why.empty()) {
      throw InputError(why + ": expected a writable place");
    }
    discard_gathered();
  }
  if (options.json) {
    say_json(result);
  }
}

namespace {

constexpr double first_line = 0.5;      // s
constexpr double between_lines = 0.1;   // s
constexpr double earliest_guess = 2.0;  // s
constexpr double least_share = 0.05;

bool rewrites_lines() {
  const char* const terminal = std::getenv("TERM");
  return isatty(STDERR_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

std::string duration(double seconds) {
  const double whole = std::round(seconds);
  if (whole < 60.0) {
    return fmt::format("{:.0f} s", whole);
  }
  const double minutes = std::round(seconds / 60.0);
  return minutes < 60.0 ? fmt::format("{:.0f} min", minutes)
                        : fmt::format("{:.0f} h {:.0f} min", std::floor(minutes / 60.0), std::fmod(minutes, 60.0));
}

}  // namespace

std::string progress_line(std::string_view stage, double share, double seconds) {
  const double done = std::clamp(share, 0.0, 1.0);
  std::string left;
  if (done >= least_share && done < 1.0 && seconds >= earliest_guess) {
    left = fmt::format(", about {} left", duration(seconds * (1.0 - done) / done));
  }
  return fmt::format("{:3.0f} %  {} ({}{})", 100.0 * done, stage, duration(seconds), left);
}

Progress::Progress(bool quiet) : active_(!quiet && rewrites_lines()) {}

Progress::~Progress() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
  }
}

void Progress::tell(std::string_view stage, double share) {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  if (!active_ || seconds < first_line || (stage == stage_ && seconds < last_ + between_lines)) {
    return;
  }
  shown_ = true;
  stage_ = stage;
  last_ = seconds;
  fmt::print(stderr, "\r\033[K{}", progress_line(stage, share, seconds));
  std::fflush(stderr);
}

}  // namespace wheelwright::app
