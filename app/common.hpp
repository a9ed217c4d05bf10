// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parts that all commands share: exit codes, common options, output directory, progress on standard error.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "core/error.hpp"
#include "formats/files/json.hpp"
#include "formats/files/temporary.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"

namespace wheelwright::app {

/// Exit codes of the program.
enum ExitCode : int {
  kDone = 0,      ///< done
  kNo = 1,        ///< the answer to the question is no: a fault found, a model invalidated
  kBadInput = 2,  ///< bad usage or input
  kInternal = 3,  ///< internal failure
};

/// Options that every command has.
struct CommonOptions {
  std::string command;                          ///< its name
  std::filesystem::path out;                    ///< directory of results; empty: none
  bool force = false;                           ///< what is in the way of results is replaced, whose it may be
  bool json = false;                            ///< the result on standard output, and nothing else there
  bool quiet = false;                           ///< no progress, no summary
  int threads = 1;                              ///< most threads; by default the machine's (add_common())
  std::uint64_t seed = 1;                       ///< of everything random
  std::vector<std::string> map;                 ///< name=column
  robots::ColumnMap columns;                    ///< of the robot file or model.json; `map` goes before
  std::vector<std::filesystem::path> msg_path;  ///< directories with definitions of messages
  bool trust = false;                           ///< a log may reach for files beside it
  std::vector<std::string> despite;             ///< the doctor's findings that are passed over
  std::string command_line;                     ///< as the user gave it
  std::vector<std::filesystem::path> read;      ///< what the command line names to be read
};

/// Where say() prints: standard output, but for leave_standard_output().
[[nodiscard]] std::FILE* stream_of_words();
/// Leaves standard output to the result `out` where that is it, by any name: what is said goes to standard error from
/// then on. Throws InputError with --json, which prints there, too.
void leave_standard_output(const CommonOptions& options, const std::filesystem::path& out);

/// Writes a text on a stream, fit for a terminal (files::printable). What goes wrong is found by finished().
void write_text(std::FILE* stream, std::string_view text);
/// A value of write_values(): a text stays on its line (files::one_line).
template <typename Value>
auto in_line(const Value& value) {
  if constexpr (std::is_convertible_v<const Value&, std::string_view>) {
    return files::one_line(value);
  } else {
    return value;
  }
}
/// write_text() of `text` with `values` in it, each in_line(): what a file or an argument says makes no line of its
/// own.
template <typename... Values>
void write_values(std::FILE* stream, fmt::string_view text, const Values&... values) {
  const auto write = [&](const auto&... fit) { write_text(stream, fmt::vformat(text, fmt::make_format_args(fit...))); };
  write(in_line(values)...);
}
/// Prints on stream_of_words() with write_values().
template <typename... Values>
void say(fmt::format_string<Values...> text, Values&&... values) {
  write_values(stream_of_words(), text, values...);
}
/// Prints a text of several lines on stream_of_words() with write_text().
void say_lines(std::string_view text);
/// Prints a result and a line end on standard output.
void say_json(const Json& result);
/// Prints on standard error with write_values().
template <typename... Values>
void tell(fmt::format_string<Values...> text, Values&&... values) {
  write_values(stderr, text, values...);
}
/// Prints an error on standard error. Lines of its own begin with a blank: other line ends come from files and
/// arguments, and are shown.
void tell_error(std::string_view message);
/// Standard output takes no more: finished() says so, and why.
class OutputLost : public Error {
 public:
  OutputLost() : Error("standard output cannot be written") {}
};
/// Writes a line on standard output as it is, at once. Throws OutputLost where it cannot be written.
void say_line(std::string_view line);
/// Ends a run that would have exited with `code`: that, or kBadInput, and a word why, where standard output could not
/// take all of the result.
[[nodiscard]] int finished(int code);

/// Throws InputError where a file `out` is there already, unless --force is given or the file begins (its first KiB)
/// with a text that holds `mark`, which what the command itself writes there has. Pipes and devices are written to.
void keep_existing(const CommonOptions& options, const std::filesystem::path& out, std::string_view mark = {});

/// Whether `path` is one of the files `read`, or of the recordings among them that are directories.
[[nodiscard]] bool is_read(const std::filesystem::path& path, const std::vector<std::filesystem::path>& read);
/// Throws InputError where writing `out` would replace what is_read().
void keep_inputs(const std::filesystem::path& out, const std::vector<std::filesystem::path>& read);
/// keep_inputs() for what a command may write into --out: `files` and report.html.
void keep_inputs(const CommonOptions& options, const std::vector<std::string>& files,
                 const std::vector<std::filesystem::path>& read);

/// Whether `out` is no file but a stream, which is written to as it is: a pipe, a device, /dev/stdout.
[[nodiscard]] bool is_stream(const std::filesystem::path& out);

/// Makes the result directory `out` where it is wanted. Throws InputError when that is impossible, where a result would
/// replace what the command line names to be read, and, unless --force is given, where something else would be replaced
/// than the command's own earlier result. `files` are the names that it may write beside report.html: first the result,
/// KIND.json of the schema wheelwright/KIND, by which it knows itself, then what else it writes, which is its own where
/// it is not younger than that. Where there are any, `out` is locked until the program ends: InputError where another
/// one writes results into it, unless both share it.
void make_directory(const CommonOptions& options, const std::vector<std::string>& files = {},
                    files::PathLock::Kind lock = files::PathLock::Kind::alone);
/// The lock of `path`, which may have been removed (PathLock::gone()); InputError, calling it `shown`, where another
/// run has what is there.
[[nodiscard]] std::unique_ptr<files::PathLock> lock_or_refuse(const std::filesystem::path& path,
                                                              files::PathLock::Kind kind, const std::string& shown);
/// Removes what make_directory() made and nothing was put into: a run that failed leaves no empty directories.
void remove_empty_directories();

/// Writes out/report.html where a directory is wanted, with the name of the command in its head; nothing where an
/// earlier result of the command stands there, whose page stays beside it.
void write_failure_page(const CommonOptions& options, std::string page);

/// Directory inside of `out` (not empty) for the files of a result that stand beside its JSON: publish() moves them out
/// of it, a run that fails leaves none of them, and replaces none of an earlier one's.
[[nodiscard]] std::filesystem::path gathered(const CommonOptions& options);
/// Removes what is gathered and was not published.
void discard_gathered();

/// Writes `result` to out/name and `report`, unless it is empty, to out/report.html where a directory is wanted, with
/// what was gathered(), in place of all that make_directory() found of an earlier run; all of it or nothing. Writes the
/// result to standard output with --json.
void publish(const CommonOptions& options, const Json& result, const std::string& name, const std::string& report);

/// "  40 %  identifying (12 s, about 18 s left)": `seconds` have passed at the share [0, 1] of the work. What is left
/// is told from a twentieth of the work and 2 s on: seconds·(1 − share)/share.
[[nodiscard]] std::string progress_line(std::string_view stage, double share, double seconds);

/// One line that is rewritten, without colours; nothing where standard error is no terminal that can rewrite a line
/// (TERM=dumb), or `quiet` is set. The first line appears after half a second: short work stays silent.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Tells that `stage` began, at the share [0, 1] of the work. At most ten lines a second are written.
  void tell(std::string_view stage, double share);

 private:
  bool shown_ = false;
  bool active_;
  std::string stage_;
  double last_ = 0.0;  // s
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace wheelwright::app
