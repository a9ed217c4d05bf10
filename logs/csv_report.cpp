// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/csv_report.hpp>

#include <fmt/format.h>

namespace wheelwright {

std::vector<std::string> sentences(const LogReport& report) {
  std::vector<std::string> out;
  const auto say = [&](const Occurrences& met, std::string_view one, std::string_view many, std::string_view rest) {
    if (met.count > 0) {
      out.push_back(fmt::format("{} {} {} (first at {})", met.count, met.count == 1 ? one : many, rest, met.first));
    }
  };
  say(report.empty, "row", "rows", "dropped: a field that is needed is empty");
  say(report.not_finite, "row", "rows", "dropped: a value that is needed is NaN or infinite");
  say(report.uncovered, "row", "rows", "dropped: another topic that is used has no samples around their time");
  say(report.duplicates, "row", "rows", "dropped: the same time stamp as the row before");
  say(report.truncated, "row", "rows", "dropped: the last line of the file is cut off");
  say(report.resets, "new segment", "new segments", "where time goes backwards");
  say(report.gaps, "new segment", "new segments",
      fmt::format("at gaps longer than 5 x the median step of {:.6g} s", report.median_step));
  say(report.angle_wraps, "jump", "jumps", "of a wheel angle by a whole turn undone: it was wrapped at 2π");
  for (const LogFileReport& file : report.files) {
    if (file.time_origin != 0.0) {
      out.push_back(fmt::format("{}: times are counted from {:.0f} s of its own clock", file.path, file.time_origin));
    }
    for (const Interpolation& of : file.interpolated) {
      out.push_back(fmt::format("{}: {} was interpolated between the samples of {}, with an error of at most {:.3g}{}",
                                file.path, of.column, of.topic, of.error,
                                of.error > 0.0 ? ", which is added to a noise bound that the robot file gives" : ""));
    }
    for (const std::string& note : file.notes) {
      out.push_back(note.starts_with(file.path) ? note : fmt::format("{}: {}", file.path, note));
    }
  }
  return out;
}

}  // namespace wheelwright
