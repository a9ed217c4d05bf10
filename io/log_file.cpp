// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/log_file.hpp>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/io/bag.hpp>
#include <wheelwright/io/bag_log.hpp>
#include <wheelwright/io/csv.hpp>
#include <wheelwright/io/hdf5_log.hpp>

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

Robot with_interpolation_errors(Robot robot, const LogReport& report) {
  const SensorNoise declared = robot.noise;
  for (const LogFileReport& file : report.files) {
    for (const Interpolation& of : file.interpolated) {
      const auto widen = [&](NoiseBound SensorNoise::*kind) {
        if (const std::optional<double> bound = (declared.*kind).value) {
          double& widened = *(robot.noise.*kind).value;
          widened = std::max(widened, *bound + of.error);
        }
      };
      const std::string& name = of.column;
      if (name.starts_with("omega") || name == "velocity") {
        widen(&SensorNoise::wheel_speed);
      } else if (name.starts_with("phi")) {
        widen(&SensorNoise::wheel_angle);
      } else if (name.starts_with("tau") || name.starts_with("current") || name.starts_with("voltage") ||
                 name == "effort") {
        widen(&SensorNoise::effort);
      } else if (name == "x" || name == "y" || name == "position") {
        widen(&SensorNoise::position);
      } else if (name == "theta") {
        widen(&SensorNoise::heading);
      }
    }
  }
  return robot;
}

}  // namespace wheelwright
