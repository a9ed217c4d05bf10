// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/log_file.hpp>

#include <optional>
#include <string>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/bag.hpp>
#include <wheelwright/logs/bag_log.hpp>
#include <wheelwright/logs/csv.hpp>
#include <wheelwright/logs/hdf5_log.hpp>

namespace wheelwright {

std::unique_ptr<RecordedLog> open_log(const std::vector<std::filesystem::path>& paths, const LogOptions& options) {
  check::that(!paths.empty(), "paths", "at least one file");
  const auto origin = std::make_shared<std::optional<std::int64_t>>();
  std::vector<std::unique_ptr<RowFile>> files;
  for (const std::filesystem::path& path : paths) {
    if (is_bag(path)) {
      files.push_back(bag_file(path, options, origin));
    } else if (std::filesystem::is_directory(path)) {
      throw InputError(path.string() +
                       ": is a directory: expected a file, or a directory with a recording "
                       "(metadata.yaml, *.mcap or *.db3)");
    } else {
      files.push_back(is_hdf5(path) ? hdf5_file(path, options) : csv_file(path, options));
    }
  }
  return std::make_unique<RowLog>(std::move(files), RowLogOptions{options.block_rows, options.min_rows});
}

}  // namespace wheelwright
