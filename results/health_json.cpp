// SPDX-License-Identifier: Apache-2.0
#include "results/health_json.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace wheelwright::results {
namespace {

Json finding_json(const doctor::LogFinding& finding) {
  Json when = Json::array();
  for (const Interval& stretch : finding.when) {
    when.push_back({stretch.lower, stretch.upper});
  }
  return {{"id", finding.id},
          {"topic", doctor::to_string(finding.topic)},
          {"severity", doctor::to_string(finding.severity)},
          {"sentence", finding.sentence},
          {"next", finding.next},
          {"columns", finding.columns},
          {"value", std::isfinite(finding.value) ? Json(finding.value) : Json(nullptr)},
          {"unit", finding.unit},
          {"when", std::move(when)},
          {"stretches", finding.stretches}};
}

}  // namespace

doctor::ReaderCounts reader_counts(const logs::LogReport& report) {
  std::vector<std::string> contradictions;
  for (const logs::LogFileReport& file : report.files) {
    for (const std::string& sentence : file.contradictions) {
      if (std::ranges::find(contradictions, sentence) == contradictions.end()) {
        contradictions.push_back(sentence);
      }
    }
  }
  return {.rows_read = report.rows_read,
          .incomplete = report.empty.count + report.not_finite.count,
          .duplicates = report.duplicates.count,
          .truncated = report.truncated.count,
          .leaps = report.leaps.count,
          .first_leap = report.leaps.first,
          .jumps = report.jumps.count,
          .unwrapped = report.angle_wraps.count,
          .contradictions = std::move(contradictions),
          .time_remedy = report.files.empty() ? std::string() : report.files.front().time_remedy};
}

doctor::LogHealth examine_first(logs::RecordedLog& log, const std::optional<Robot>& robot, std::size_t most,
                                std::size_t threads) {
  const LogTable table = read_all(log, most);
  doctor::LogHealth health = doctor::examine(table, robot, reader_counts(log.report()), threads);
  if (table.rows() < log.report().rows) {
    health.findings.push_back(
        {.id = "time.first_rows_only",
         .severity = doctor::FindingSeverity::notice,
         .sentence = fmt::format("Only the first {} of {} rows were looked at.", table.rows(), log.report().rows),
         .next = "--rows N looks at more.",
         .value = static_cast<double>(table.rows())});
  }
  return health;
}

Json to_json(const doctor::LogHealth& health, const HealthFiles& files) {
  Json findings = Json::array();
  for (const doctor::LogFinding& finding : health.findings) {
    findings.push_back(finding_json(finding));
  }
  return {{"schema", kHealthSchema},
          {"software", files.software},
          {"robot", files.robot.empty() ? Json(nullptr) : Json(files.robot)},
          {"logs", files.logs},
          {"verdict", doctor::to_string(health.verdict)},
          {"sentence", health.sentence},
          {"assumed", health.assumed},
          {"rows", health.rows},
          {"segments", health.segments},
          {"seconds", health.seconds},
          {"median_step", health.median_step},
          {"findings", std::move(findings)}};
}

}  // namespace wheelwright::results
