// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/log_file.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "core/even_clock.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/bag_log.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/csv_write.hpp"
#include "formats/logs/hdf5_log.hpp"
#include "formats/logs/joint_states.hpp"

namespace wheelwright::logs {

namespace {

// Another text when the file, or one of the directory, has been written to or replaced.
std::string state_of(const std::filesystem::path& path) {
  std::string state;
  const auto add = [&](const std::filesystem::path& file) {
    struct stat now {};
    if (stat(file.c_str(), &now) == 0) {
      state += fmt::format("{} {} {} {} {}\n", file.string(), now.st_ino, now.st_size, now.st_mtim.tv_sec,
                           now.st_mtim.tv_nsec);
    }
  };
  std::error_code none;
  if (!std::filesystem::is_directory(path, none)) {
    add(path);
  }
  for (auto entry = std::filesystem::directory_iterator(path, none);
       !none && entry != std::filesystem::directory_iterator(); entry.increment(none)) {
    add(entry->path());
  }
  return state;
}

class EvenLog final : public RecordedLog {
 public:
  EvenLog(std::shared_ptr<RecordedLog> log, const EvenClock& clock) : log_(log), even_(std::move(log), clock) {}
  [[nodiscard]] const std::vector<std::string>& columns() const override { return even_.columns(); }
  bool next(LogBlock& block) override { return even_.next(block); }
  void rewind() override { even_.rewind(); }
  [[nodiscard]] double median_step() const override { return even_.median_step(); }
  [[nodiscard]] std::unique_ptr<LogSource> another_walk() const override { return even_.another_walk(); }
  [[nodiscard]] const LogReport& report() const override { return log_->report(); }

 private:
  std::shared_ptr<RecordedLog> log_;
  core::EvenSource even_;
};

// A ROS 1 bag in `directory`; empty where there is none.
std::filesystem::path ros1_bag_in(const std::filesystem::path& directory) {
  std::error_code none;
  for (auto entry = std::filesystem::directory_iterator(directory, none);
       !none && entry != std::filesystem::directory_iterator(); entry.increment(none)) {
    std::string head(files::ros1_bag_magic.size(), '\0');
    std::error_code ignored;
    if (std::filesystem::is_regular_file(entry->path(), ignored) &&
        std::ifstream(entry->path(), std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size())) &&
        head == files::ros1_bag_magic) {
      return entry->path();
    }
  }
  return {};
}

}  // namespace

std::unique_ptr<RecordedLog> read_evenly(std::unique_ptr<RecordedLog> log, const EvenClock& clock) {
  return std::make_unique<EvenLog>(std::move(log), clock);
}

std::unique_ptr<RecordedLog> open_log(const std::vector<std::filesystem::path>& paths, const LogOptions& options) {
  check::that(!paths.empty(), "paths", "at least one file");
  const auto origin = std::make_shared<std::optional<std::int64_t>>();
  LogOptions of_tables = options;  // which name no joints
  std::erase_if(of_tables.map,
                [](const auto& entry) { return joint_place(split_factor(entry.second).first).has_value(); });
  std::vector<std::unique_ptr<RowFile>> files;
  std::vector<std::string> states;
  for (const std::filesystem::path& path : paths) {
    states.push_back(state_of(path));
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_other(status)) {
      throw InputError(path.string() +
                       ": is a pipe or a device: expected a file, which can be read twice; rows of CSV "
                       "as they come are read by `wheelwright detect --follow`");
    }
    if (is_bag(path)) {
      files.push_back(bag_file(path, options, origin));
    } else if (std::filesystem::is_directory(status)) {
      const std::filesystem::path old = ros1_bag_in(path);
      throw InputError(old.empty() ? path.string() +
                                         ": is a directory: expected a file, or a directory with a recording "
                                         "(metadata.yaml, *.mcap or *.db3)"
                                   : old.string() + ": " + files::ros1_bag(old));
    } else {
      files.push_back(is_hdf5(path) ? hdf5_file(path, of_tables, origin) : csv_file(path, options, origin));
    }
  }
  auto log = std::make_unique<RowLog>(std::move(files), RowLogOptions{.block_rows = options.block_rows,
                                                                      .min_rows = options.min_rows,
                                                                      .heading_offset = options.heading_offset,
                                                                      .leaps = options.leaps});
  for (std::size_t k = 0; k < paths.size(); ++k) {
    if (state_of(paths[k]) != states[k]) {
      throw InputError(paths[k].string() + ": was written to while it was read: expected a log that is complete");
    }
  }
  const std::vector<LogFileReport>& read = log->report().files;
  for (std::size_t k = 1; k < read.size(); ++k) {
    const auto same = std::find_if(read.begin(), read.begin() + static_cast<std::ptrdiff_t>(k),
                                   [&](const LogFileReport& file) { return file.hash == read[k].hash; });
    if (same != read.begin() + static_cast<std::ptrdiff_t>(k) && !same->hash.empty()) {
      throw InputError(
          fmt::format("{}: has the bytes of {}: expected each log once, since the errors of what is read "
                      "twice count as new ones",
                      read[k].path, same->path));
    }
  }
  if (options.clock && options.clock->step > 0.0) {
    return read_evenly(std::move(log), *options.clock);
  }
  return log;
}

void check_column_names(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    check::that(!name.empty() && name.find_first_of(",;\t\"\r\n#") == std::string::npos, "log column '" + name + "'",
                "a name without separators, quotes, # and line ends");
    check::that(std::ranges::count(names, name) == 1, "log column '" + name + "'", "each name once");
  }
}

void check_block(const LogBlock& block, std::size_t columns) {
  check::that(block.columns.size() == columns, "log", "one name for each column");
  for (const double t : block.t) {
    check::finite(t, "log time");
  }
  for (const auto& column : block.columns) {
    check::that(column.size() == block.rows(), "log column", "as many values as there are times");
    for (const double value : column) {
      check::finite(value, "log column");
    }
  }
}

std::unique_ptr<LogWriter> create_log(const std::filesystem::path& path, const std::vector<std::string>& names,
                                      const LogWriteOptions& options) {
  check_column_names(names);
  std::filesystem::path name = path;
  if (name.extension() == ".gz" || name.extension() == ".zst") {
    name.replace_extension();
  }
  const std::string ending = name.extension().string();
  const bool packed = name != path;
  if (ending == ".csv" || (packed && ending.empty())) {
    return create_csv_since(path, names, static_cast<std::int64_t>(options.time_origin));
  }
  if (!packed && (ending == ".h5" || ending == ".hdf5")) {
    return create_hdf5(path, names);
  }
  if (!packed && (ending == ".mcap" || ending == ".db3" || ending.empty())) {
    return create_bag(path, names, options);
  }
  throw InputError(path.string() +
                   ": unknown ending: expected .csv, .csv.gz, .csv.zst, .mcap, .db3, .h5, or a name "
                   "without one for a bag directory");
}

}  // namespace wheelwright::logs
