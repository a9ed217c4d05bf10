// SPDX-License-Identifier: Apache-2.0
/// \file
/// Residual, thresholds and decisions over time as a log for other programs to plot, and layouts that show them there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/interval.hpp"
#include "core/log.hpp"
#include "detector/detector_options.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::app {

/// A plot of one output: columns residual_NAME, lower_NAME, upper_NAME, rho_NAME, outside_NAME, alarm_NAME of a series.
struct SeriesPlot {
  std::string name;   ///< of the output
  std::string title;  ///< with its unit
  Interval values{};  ///< of residual and thresholds
};

/// A series that was written.
struct Series {
  std::filesystem::path path;
  std::string topic;  ///< that holds it in a bag
  Interval times{};   ///< s, as written
  std::vector<SeriesPlot> plots{};
};

/// The file beside `path` with the series of the kinematic residual: residual_kinematic.mcap of residual.mcap.
[[nodiscard]] std::filesystem::path kinematic_series(const std::filesystem::path& path);
/// The layouts beside `path`: residual.foxglove.json and residual.plotjuggler.xml of residual.mcap.
[[nodiscard]] std::vector<std::filesystem::path> layout_files(const std::filesystem::path& path);

/// Walks `log` through the detector of `model` and writes `path` (.csv, .mcap, .db3, .h5): for every instant that it
/// decides the residual, its bounds l and u, ρ, and 0 or 1 for "outside" and "alarm", of each output; then |ε| outside
/// and 0 inside the dead zone, d1_NAME of (35) where D1 decides and d2_NAME of (39) where the model has μ_o. Times of a
/// bag get `origin` added (LogWriteOptions::time_origin). Throws InputError where it cannot be written.
Series write_series(const std::filesystem::path& path, LogSource& log, const OnlineModel& model,
                    const detector::DetectorOptions& options, double origin);
/// The same of the kinematic residual.
Series write_series(const std::filesystem::path& path, LogSource& log, const detector::KinematicModel& model,
                    const detector::DetectorOptions& options, double origin);

/// A layout of Foxglove: for each output residual and thresholds, and its alarm below. The series are in bags.
[[nodiscard]] std::string foxglove_layout(const std::vector<Series>& series);
/// A layout of PlotJuggler, a tab for each series.
[[nodiscard]] std::string plotjuggler_layout(const std::vector<Series>& series);

}  // namespace wheelwright::app
