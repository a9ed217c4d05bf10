// SPDX-License-Identifier: Apache-2.0
#include "series.hpp"

#include <string>
#include <vector>

#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/logs/log_file.hpp>

namespace wheelwright::app {
namespace {

constexpr std::size_t kRowsAtOnce = 4096;
constexpr const char* kQuantities[] = {"residual", "lower", "upper", "rho", "outside", "alarm"};

}  // namespace

void write_series(const std::filesystem::path& path, LogSource& log, const OnlineModel& model,
                  const detector::DetectorOptions& options, double origin) {
  std::vector<std::string> names;
  for (const std::string& output : model.model.outputs) {
    for (const char* quantity : kQuantities) {
      names.push_back(std::string(quantity) + "_" + output);
    }
  }
  logs::LogWriteOptions how;
  how.time_origin = origin;
  how.columns_topic = "/residual";
  const auto writer = logs::create_log(path, names, how);
  Detector detector = make_detector(model, options);
  LogBlock out;
  out.columns.resize(names.size());
  const auto flush = [&] {
    writer->write(out);
    out.t.clear();
    for (auto& column : out.columns) {
      column.clear();
    }
  };
  commission::walk_detector(log, detector, [&](std::size_t, double t, bool, const Decision& decision) {
    out.t.push_back(t);
    std::size_t column = 0;
    for (const detector::ChannelDecision& of : decision.channels) {
      for (const double value : {of.residual, of.threshold.lower, of.threshold.upper, of.threshold.rho(),
                                 static_cast<double>(of.outside), static_cast<double>(of.alarm)}) {
        out.columns[column++].push_back(value);
      }
    }
    if (out.rows() == kRowsAtOnce) {
      flush();
    }
  });
  flush();
  writer->commit();
}

}  // namespace wheelwright::app
