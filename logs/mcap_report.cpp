// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_report.hpp>

#include <fmt/format.h>

namespace wheelwright {
namespace {

std::string counted(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

std::vector<std::string> sentences(const McapReport& report) {
  std::vector<std::string> lines;
  for (const McapDamage& damage : report.damages) {
    std::string line = fmt::format("{}: at byte {}: {}", report.path, damage.offset, damage.why);
    if (damage.bytes > 0 || damage.messages) {
      line += fmt::format(" ({}", counted(damage.bytes, "byte"));
      line += damage.messages ? ", " + counted(*damage.messages, "message") + " lost)" : " not used)";
    }
    lines.push_back(std::move(line));
  }
  if (report.damage_count > report.damages.size()) {
    lines.push_back(fmt::format("{}: {} more damaged places, {} in all", report.path,
                                report.damage_count - report.damages.size(), counted(report.damaged_bytes, "byte")));
  }
  if (report.unknown.count > 0) {
    lines.push_back(fmt::format("{}: at byte {}: {} of an unknown kind skipped ({})", report.path, report.unknown.first,
                                counted(report.unknown.count, "record"), counted(report.unknown.bytes, "byte")));
  }
  if (report.finished && report.promised && *report.promised != report.messages) {
    lines.push_back(fmt::format("{}: {} read; its statistics say {}", report.path, counted(report.messages, "message"),
                                *report.promised));
  }
  return lines;
}

}  // namespace wheelwright
