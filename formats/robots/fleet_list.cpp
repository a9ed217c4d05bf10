// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/fleet_list.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/words.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::robots {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kColumns = {"robot", "log", "when", "robot_file", "role"};

// A row of a list as it was read.
struct ListRow {
  std::size_t line = 0;
  fs::path log;
  std::optional<double> when;
  std::string robot_file, role;
};

std::vector<std::string> fields_of(std::string_view line, const std::string& where) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted) {
      if (c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
        fields.back() += '"';
        ++i;
      } else if (c == '"') {
        quoted = false;
      } else {
        fields.back() += c;
      }
    } else if (c == '"' && fields.back().empty()) {
      quoted = true;
    } else if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  if (quoted) {
    throw InputError(where + ": a quote that is not closed");
  }
  for (std::string& field : fields) {
    const std::size_t first = field.find_first_not_of(" \t"), last = field.find_last_not_of(" \t");
    field = first == std::string::npos ? std::string() : field.substr(first, last - first + 1);
  }
  return fields;
}

// Where each of kColumns stands in the header; npos where it is absent.
std::map<std::string, std::size_t> columns_of(const std::vector<std::string>& header, const std::string& where) {
  std::map<std::string, std::size_t> at;
  const auto known = [](const std::string& name) { return std::ranges::find(kColumns, name) != kColumns.end(); };
  if (std::ranges::none_of(header, known)) {  // another file, whose content is nobody's business
    throw InputError(where + ": no list of robots: expected a header with robot,log and any of when, robot_file, role");
  }
  for (std::size_t c = 0; c < header.size(); ++c) {
    if (!known(header[c])) {
      throw InputError(
          fmt::format("{}: unknown column {}: expected a header with robot,log and any of when, robot_file, "
                      "role{}",
                      where, files::shown(header[c]), files::did_you_mean(header[c], kColumns)));
    }
    if (!at.emplace(header[c], c).second) {
      throw InputError(where + ": the column " + header[c] + " stands twice");
    }
  }
  for (const char* needed : {"robot", "log"}) {
    if (!at.contains(needed)) {
      throw InputError(where + ": the column " + needed + " is missing: expected a header with robot,log");
    }
  }
  return at;
}

std::optional<double> when_of(const std::string& text, const std::string& where) {
  if (text.empty()) {
    return std::nullopt;
  }
  if (const auto date = days_of_date(text)) {
    return date;
  }
  const auto days = files::to_number(text);
  if (!days || !(*days > -1e9 && *days < 1e9)) {
    throw InputError(
        fmt::format("{}: when: {}: expected a date like 2026-03-01 or a number of days", where, files::shown(text)));
  }
  return days;
}

void demand_file(FleetListRobot& robot, const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    robot.findings.push_back(path.string() + ": no such file");
  }
}

// Orders the logs and deals out the roles.
FleetListRobot robot_of(const std::string& name, std::vector<ListRow> rows) {
  FleetListRobot robot{.name = name};
  std::set<fs::path> seen;
  std::vector<ListRow> kept;
  for (ListRow& row : rows) {
    if (!row.robot_file.empty() && !robot.robot_file.empty() && robot.robot_file != row.robot_file) {
      robot.findings.push_back(fmt::format("line {}: robot_file {}: the robot has {} already, which is used", row.line,
                                           files::shown(row.robot_file), robot.robot_file.string()));
    } else if (!row.robot_file.empty()) {
      robot.robot_file = row.robot_file;
    }
    if (!seen.insert(row.log.lexically_normal()).second) {
      robot.findings.push_back(fmt::format("line {}: {}: listed twice, the first is used", row.line, row.log.string()));
      continue;
    }
    demand_file(robot, row.log);
    kept.push_back(std::move(row));
  }
  const auto dated =
      static_cast<std::size_t>(std::ranges::count_if(kept, [](const ListRow& r) { return r.when.has_value(); }));
  robot.dated = !kept.empty() && dated == kept.size();
  if (dated > 0 && !robot.dated) {
    robot.findings.push_back("some of its logs have no date: they are taken in the order of the list");
  }
  if (robot.dated) {
    std::ranges::stable_sort(kept, {}, [](const ListRow& r) { return *r.when; });
  }
  const bool roles = std::ranges::any_of(kept, [](const ListRow& r) { return r.role == "commission"; });
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const FleetListLog log{kept[k].log, robot.dated ? *kept[k].when : static_cast<double>(k)};
    const bool commissions = roles ? kept[k].role == "commission" : kept[k].role.empty() && robot.commission.empty();
    (commissions ? robot.commission : robot.checks).push_back(log);
  }
  if (robot.commission.empty()) {
    robot.findings.push_back("it has no log to commission with");
  }
  return robot;
}

std::vector<FleetListRobot> read_list(const fs::path& path) {
  files::LineReader lines(files::open_bytes(path), path.string());
  std::string_view line;
  std::map<std::string, std::size_t> column;
  std::vector<std::string> header, order;
  std::map<std::string, std::vector<ListRow>> rows;
  while (lines.next(line)) {
    if (line.find_first_not_of(" \t") == std::string_view::npos || line.front() == '#') {
      continue;
    }
    const std::string where = fmt::format("{}:{}", path.string(), lines.number());
    if (files::has_commands(line)) {
      throw InputError(where + ": a control character: expected text, robot and log of a row as the header has them");
    }
    const std::vector<std::string> fields = fields_of(line, where);
    if (header.empty()) {
      header = fields;
      column = columns_of(header, where);
      continue;
    }
    if (fields.size() != header.size()) {
      throw InputError(
          fmt::format("{}: {} fields: expected {}, as the header has", where, fields.size(), header.size()));
    }
    const auto field = [&](const char* name) {
      const auto found = column.find(name);
      return found == column.end() ? std::string() : fields[found->second];
    };
    const std::string name = field("robot"), log = field("log"), role = field("role");
    if (name.empty() || log.empty()) {
      throw InputError(where + (name.empty() ? ": robot" : ": log") + " is empty: expected a name");
    }
    if (!role.empty() && role != "commission" && role != "check") {
      throw InputError(where + ": role: " + files::shown(role) + ": expected commission or check" +
                       files::did_you_mean(role, {"commission", "check"}));
    }
    const std::string file = field("robot_file");
    if (!rows.contains(name)) {
      order.push_back(name);
    }
    rows[name].push_back({lines.number(), path.parent_path() / log, when_of(field("when"), where),
                          file.empty() ? file : (path.parent_path() / file).string(), role});
  }
  if (header.empty()) {
    throw InputError(path.string() + ": empty: expected a header with robot,log");
  }
  std::vector<FleetListRobot> fleet;
  for (const std::string& name : order) {
    fleet.push_back(robot_of(name, std::move(rows[name])));
  }
  return fleet;
}

// What cannot be looked at (a link that leads to itself) is neither.
bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_bag(const fs::path& path) { return is_folder(path) && is_file(path / "metadata.yaml"); }

bool is_log(const fs::path& path) {
  static constexpr std::array<std::string_view, 7> endings = {".csv", ".csv.gz", ".csv.zst", ".mcap",
                                                              ".db3", ".h5",     ".hdf5"};
  const std::string name = path.filename().string();
  return is_bag(path) || (is_file(path) && std::ranges::any_of(endings, [&](std::string_view ending) {
                            return name.ends_with(ending) && name.size() > ending.size();
                          }));
}

std::vector<fs::path> entries_of(const fs::path& directory) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (!entry.path().filename().string().starts_with(".")) {
      entries.push_back(entry.path());
    }
  }
  std::ranges::sort(entries, [](const fs::path& a, const fs::path& b) {
    return core::natural_less(a.filename().string(), b.filename().string());
  });
  return entries;
}

// The first date in a name.
std::optional<double> date_in(const std::string& name) {
  for (std::size_t at = 0; at < name.size(); ++at) {
    if (!core::is_digit(name[at]) || (at > 0 && core::is_digit(name[at - 1]))) {
      continue;
    }
    for (const std::size_t length : {std::size_t{10}, std::size_t{8}}) {
      const bool ends = at + length >= name.size() || !core::is_digit(name[at + length]);
      if (at + length <= name.size() && ends) {
        if (const auto date = days_of_date(std::string_view(name).substr(at, length))) {
          return date;
        }
      }
    }
  }
  return std::nullopt;
}

std::vector<FleetListRobot> read_directory(const fs::path& directory) {
  std::vector<FleetListRobot> fleet;
  for (const fs::path& entry : entries_of(directory)) {
    std::vector<ListRow> rows;
    if (is_log(entry)) {
      rows.push_back({0, entry, std::nullopt, {}, {}});
    } else if (is_folder(entry)) {
      for (const fs::path& log : entries_of(entry)) {
        if (is_log(log)) {
          rows.push_back({0, log, date_in(log.filename().string()), {}, {}});
        }
      }
      const bool all = std::ranges::all_of(rows, [](const ListRow& r) { return r.when.has_value(); });
      for (ListRow& row : rows) {
        row.when = all ? row.when : std::nullopt;
      }
    } else {
      continue;
    }
    FleetListRobot robot = robot_of(files::one_line(entry.filename().string()), std::move(rows));
    if (is_folder(entry) && !is_bag(entry) && is_file(entry / "robot.yaml")) {
      robot.robot_file = entry / "robot.yaml";
    }
    fleet.push_back(std::move(robot));
  }
  return fleet;
}

// Size and time of change of a file.
std::string state_of(const fs::path& file) {
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) {
    return "absent";
  }
  const auto changed = fs::last_write_time(file, error);
  return fmt::format("{} bytes, {}", size, error ? 0 : changed.time_since_epoch().count());
}

// Which file it is, its size, and when anything of it changed.
std::string exact_state_of(const fs::path& file) {
  struct stat now {};
  if (stat(file.c_str(), &now) != 0) {
    return "absent";
  }
  return fmt::format("{} {} {} {}.{} {}.{}", now.st_dev, now.st_ino, now.st_size, now.st_mtim.tv_sec,
                     now.st_mtim.tv_nsec, now.st_ctim.tv_sec, now.st_ctim.tv_nsec);
}

// Of a file, or of the files in a directory.
std::string state_of(const fs::path& path, std::string (*of_file)(const fs::path&)) {
  if (!is_folder(path)) {
    return of_file(path);
  }
  std::string out;
  try {
    for (const fs::path& entry : entries_of(path)) {
      out += entry.filename().string() + " " + (is_folder(entry) ? "a directory" : of_file(entry)) + ";";
    }
  } catch (const fs::filesystem_error&) {
    out += "unreadable";
  }
  return out;
}

}  // namespace

std::optional<double> days_of_date(std::string_view text) {
  std::string digits;
  const bool dashes = text.size() == 10 && text[4] == '-' && text[7] == '-';
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (dashes && (i == 4 || i == 7)) {
      continue;
    }
    if (!core::is_digit(text[i])) {
      return std::nullopt;
    }
    digits += text[i];
  }
  if (digits.size() != 8 || (!dashes && text.size() != 8)) {
    return std::nullopt;
  }
  const auto number = [&](std::size_t from, std::size_t count) {
    int value = 0;
    std::from_chars(digits.data() + from, digits.data() + from + count, value);
    return value;
  };
  const std::chrono::year_month_day date{std::chrono::year{number(0, 4)},
                                         std::chrono::month{static_cast<unsigned>(number(4, 2))},
                                         std::chrono::day{static_cast<unsigned>(number(6, 2))}};
  if (!date.ok() || number(0, 4) < 1970) {
    return std::nullopt;
  }
  return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
}

std::vector<FleetListRobot> read_fleet(const std::filesystem::path& path) {
  std::error_code error;
  const bool directory = fs::is_directory(path, error);
  std::vector<FleetListRobot> fleet = directory ? read_directory(path) : read_list(path);
  if (fleet.empty()) {
    throw InputError(path.string() + (directory ? ": no log and no directory with logs in it" : ": no robot listed") +
                     ": expected a robot");
  }
  return fleet;
}

std::string key_of(const FleetListRobot& robot) {
  std::string key = robot.name;
  const auto take = [&](const char* role, const FleetListLog& log) {
    key += fmt::format("\n{} {} at {}: {}", role, log.path.string(), files::number_text(log.when),
                       state_of(log.path, state_of));
  };
  if (!robot.robot_file.empty()) {
    key += fmt::format("\nrobot file {}: {}", robot.robot_file.string(), state_of(robot.robot_file, state_of));
  }
  for (const FleetListLog& log : robot.commission) {
    take("commission", log);
  }
  for (const FleetListLog& log : robot.checks) {
    take("check", log);
  }
  key += robot.dated ? "\ndated" : "";
  for (const std::string& finding : robot.findings) {
    key += "\n" + finding;
  }
  return key;
}

std::vector<FileState> states_of(const FleetListRobot& robot) {
  std::vector<FileState> states;
  const auto take = [&](const fs::path& path) {
    const std::string state = state_of(path, exact_state_of);
    files::Xxh64 hash;
    hash.update(state.data(), state.size());
    states.push_back({path, hash.digest()});
  };
  if (!robot.robot_file.empty()) {
    take(robot.robot_file);
  }
  for (const std::vector<FleetListLog>* const logs : {&robot.commission, &robot.checks}) {
    for (const FleetListLog& log : *logs) {
      take(log.path);
    }
  }
  return states;
}

}  // namespace wheelwright::robots
