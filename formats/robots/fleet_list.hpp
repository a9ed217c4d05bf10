// SPDX-License-Identifier: Apache-2.0
/// \file
/// The robots of a fleet and the places of their logs, from a list or a directory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wheelwright::robots {

/// A log of a fleet.
struct FleetListLog {
  std::filesystem::path path;
  double when = 0.0;  ///< days since 1970-01-01 or days, where the robot is dated; else its order
};

/// A robot of a fleet: an item of work.
struct FleetListRobot {
  std::string name;
  std::filesystem::path robot_file{};  ///< empty: the fleet's
  bool dated = false;
  std::vector<FleetListLog> commission{};  ///< taken together; none where a finding says why
  std::vector<FleetListLog> checks{};      ///< in order of time
  std::vector<std::string> findings{};     ///< what is wrong with its entry
};

/// Reads a fleet.
///
/// A file is a list: CSV with the header `robot,log` and any of `when`, `robot_file`, `role`, in any order; a robot may
/// have several rows, paths are relative to the list, `when` is an ISO date (2026-03-01) or a number of days, `role` is
/// commission or check. Where none of a robot's rows says commission, its earliest log does. Logs are in order of
/// `when` where all of a robot's have one, else in that of the list.
///
/// A directory holds robots: each directory in it (with its own robot.yaml where it has one), and each log beside
/// those. Logs are CSV (.gz, .zst), .mcap, .db3, .h5, .hdf5 and bag directories, in natural order of their names (2
/// before 10); they are dated where every name of a robot holds YYYY-MM-DD or YYYYMMDD. The first commissions.
///
/// Robots are in the order of the list, or of names. A log that is listed twice, one that is not there, or two robot
/// files for one robot are findings of that robot. Throws InputError, naming file and line, for a list that is none: an
/// unknown or missing column, a wrong number of fields, an empty name, a date that is none, another role; and where
/// there is no robot at all.
[[nodiscard]] std::vector<FleetListRobot> read_fleet(const std::filesystem::path& path);

/// All that the robot's results depend on beside the fleet's options: its name first, then paths, sizes and times of
/// change of its files, roles and dates.
[[nodiscard]] std::string key_of(const FleetListRobot& robot);

/// A file, and a hash of what is another where it was written to, moved, or replaced by one of the same size and time.
struct FileState {
  std::filesystem::path path;
  std::uint64_t state = 0;
};

/// The robot file and the logs of a robot as they are now, in a fixed order.
[[nodiscard]] std::vector<FileState> states_of(const FleetListRobot& robot);

/// Days from 1970-01-01 to a date of the Gregorian calendar, "2026-03-01" or "20260301"; nothing for what is none.
[[nodiscard]] std::optional<double> days_of_date(std::string_view text);

}  // namespace wheelwright::robots
