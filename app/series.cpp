// SPDX-License-Identifier: Apache-2.0
#include "app/series.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/common.hpp"
#include "app/log_files.hpp"
#include "commission/physical.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/limits.hpp"
#include "detector/online_model.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/log_file.hpp"
#include "results/words/text.hpp"

namespace wheelwright::app {
namespace {

constexpr std::size_t kRowsAtOnce = 4096;
constexpr const char* kQuantities[] = {"residual", "lower", "upper", "rho", "outside", "alarm"};

struct Curve {
  const char* quantity;
  const char* label;
  const char* colour;
};
constexpr Curve kResidual[] = {{"residual", "residual", "#1f77b4"},
                               {"upper", "upper threshold", "#d62728"},
                               {"lower", "lower threshold", "#ff7f0e"}};

// D1 of (35) where it decides, and D2 of (39) where there is μ_o.
template <typename Filter>
Series write(Series series, LogSource& log, Detector<Filter> detector,
             const std::optional<detector::ConstantThresholds>& constant, double origin) {
  const bool d1 = detector.options().residual == detector::Residual::d1;
  std::vector<std::string> names;
  for (const SeriesPlot& plot : series.plots) {
    for (const char* quantity : kQuantities) {
      names.push_back(std::string(quantity) + "_" + plot.name);
    }
  }
  for (const SeriesPlot& plot : series.plots) {
    if (d1) {
      names.push_back("d1_" + plot.name);
    }
    if (constant) {
      names.push_back("d2_" + plot.name);
    }
  }
  logs::LogWriteOptions how;
  how.time_origin = origin;
  how.columns_topic = series.topic;
  const auto writer = create_output(series.path, names, how);
  LogBlock out;
  out.columns.resize(names.size());
  const auto flush = [&] {
    writer->write(out);
    out.t.clear();
    for (auto& column : out.columns) {
      column.clear();
    }
  };
  const auto widen = [](Interval& x, double value) { x = {std::min(x.lower, value), std::max(x.upper, value)}; };
  constexpr Interval nothing{core::kInfinity, -core::kInfinity};
  series.times = nothing;
  for (SeriesPlot& plot : series.plots) {
    plot.values = nothing;
  }
  commission::walk_detector(log, detector, [&](std::size_t, double t, bool, const Decision& decision) {
    out.t.push_back(t);
    widen(series.times, t);
    std::size_t column = 0;
    for (std::size_t output = 0; output < decision.channels.size(); ++output) {
      const detector::ChannelDecision& of = decision.channels[output];
      for (const double value : {of.residual, of.threshold.lower, of.threshold.upper, of.threshold.rho(),
                                 static_cast<double>(of.outside), static_cast<double>(of.alarm)}) {
        out.columns[column++].push_back(value);
      }
      for (const double value : {of.residual, of.threshold.lower, of.threshold.upper}) {
        widen(series.plots[output].values, value);
      }
    }
    for (std::size_t output = 0; output < decision.channels.size(); ++output) {
      const detector::ChannelDecision& of = decision.channels[output];
      if (d1) {
        out.columns[column++].push_back(of.dead_zone);
      }
      if (constant) {
        out.columns[column++].push_back(detector::dead_zone(of.residual, constant->outputs[output].value));
      }
    }
    if (out.rows() == kRowsAtOnce) {
      flush();
    }
  });
  flush();
  writer->commit();
  return series;
}

SeriesPlot plot_of(const std::string& output, const std::string& unit, const char* residual) {
  return {
      output, words::with_unit(fmt::format("{} {}", residual, words::spaced(output)) + ",", words::unit_of(unit)), {}};
}

bool in_a_bag(const Series& series) {
  const std::filesystem::path ending = series.path.extension();
  return ending == ".mcap" || ending == ".db3";
}

Json foxglove_plot(const std::string& title, std::vector<Json> paths) {
  return {{"title", title},
          {"paths", std::move(paths)},
          {"showXAxisLabels", true},
          {"showYAxisLabels", true},
          {"showLegend", true},
          {"legendDisplay", "floating"},
          {"showPlotValuesInLegend", true},
          {"isSynced", true},
          {"xAxisVal", "timestamp"},
          {"sidebarDimension", 240}};
}

// The panels one below the other, each as high as the others.
Json column_of(const std::vector<std::string>& panels, std::size_t first = 0) {
  if (first + 1 == panels.size()) {
    return panels[first];
  }
  return {{"direction", "column"},
          {"first", panels[first]},
          {"second", column_of(panels, first + 1)},
          {"splitPercentage", 100.0 / static_cast<double>(panels.size() - first)}};
}

std::string curve_name(const Series& series, const std::string& column) {
  return in_a_bag(series) ? series.topic + "/" + column : column;
}

std::string plotjuggler_plot(const std::string& title, const Interval& times, Interval values,
                             const std::vector<std::pair<std::string, std::string>>& curves) {
  const double margin = values.upper > values.lower ? 0.05 * (values.upper - values.lower) : 1.0;
  std::string text = fmt::format(
      "     <DockArea name=\"{}\">\n      <plot mode=\"TimeSeries\" style=\"Lines\" flip_x=\"false\" "
      "flip_y=\"false\">\n       <range left=\"{:.6f}\" right=\"{:.6f}\" bottom=\"{:.6g}\" top=\"{:.6g}\"/>\n"
      "       <limitY/>\n",
      words::escape(title), times.lower, times.upper, values.lower - margin, values.upper + margin);
  for (const auto& [name, colour] : curves) {
    text += fmt::format("       <curve name=\"{}\" color=\"{}\"/>\n", words::escape(name), colour);
  }
  return text + "      </plot>\n     </DockArea>\n";
}

}  // namespace

namespace {

// A name without its whole ending (.csv.gz), and the ending; of a directory its own name.
std::pair<std::filesystem::path, std::string> split_ending(const std::filesystem::path& path) {
  std::filesystem::path name = path.has_filename() ? path : path.parent_path();
  std::string ending;
  if (const auto packing = name.extension(); packing == ".gz" || packing == ".zst" || packing == ".zstd") {
    ending = packing.string();
    name.replace_extension();
  }
  ending.insert(0, name.extension().string());
  return {name.replace_extension(), ending};
}

}  // namespace

std::filesystem::path kinematic_series(const std::filesystem::path& path) {
  const auto [stem, ending] = split_ending(path);
  return stem.string() + "_kinematic" + ending;
}

std::vector<std::filesystem::path> layout_files(const std::filesystem::path& path) {
  const std::string stem = split_ending(path).first.string();
  return {stem + ".plotjuggler.xml", stem + ".foxglove.json"};
}

Series write_series(const std::filesystem::path& path, LogSource& log, const OnlineModel& model,
                    const detector::DetectorOptions& options, double origin) {
  Series series{.path = path, .topic = "/residual"};
  for (std::size_t output = 0; output < model.model.n(); ++output) {
    series.plots.push_back(plot_of(model.model.outputs[output],
                                   commission::output_unit(model.robot, model.model.output_units[output]),
                                   "torque residual"));
  }
  return write(std::move(series), log, make_detector(model, options), model.constant, origin);
}

Series write_series(const std::filesystem::path& path, LogSource& log, const detector::KinematicModel& model,
                    const detector::DetectorOptions& options, double origin) {
  Series series{.path = path, .topic = "/residual_kinematic"};
  const Model outputs = detector::kinematic_outputs(model);
  for (std::size_t output = 0; output < outputs.n(); ++output) {
    series.plots.push_back(plot_of(outputs.outputs[output], outputs.output_units[output], "kinematic residual"));
  }
  return write(std::move(series), log, make_detector(model, options), model.constant, origin);
}

std::string foxglove_layout(const std::vector<Series>& series) {
  Json panels = Json::object();
  std::vector<std::string> order;
  for (const Series& each : series) {
    std::vector<Json> alarms;
    const auto path = [&](const std::string& column, const std::string& label) -> Json {
      return {{"value", each.topic + "." + column},
              {"label", label},
              {"enabled", true},
              {"timestampMethod", "headerStamp"}};
    };
    const auto add = [&](const std::string& title, std::vector<Json> paths) {
      const std::string id = fmt::format("Plot!wheelwright{}", order.size() + 1);
      panels[id] = foxglove_plot(title, std::move(paths));
      order.push_back(id);
    };
    for (const SeriesPlot& plot : each.plots) {
      std::vector<Json> paths;
      for (const Curve& curve : kResidual) {
        paths.push_back(path(std::string(curve.quantity) + "_" + plot.name, curve.label));
      }
      alarms.push_back(path("alarm_" + plot.name, plot.name));
      add(plot.title, std::move(paths));
    }
    add("alarms of " + each.topic.substr(1), std::move(alarms));
  }
  return files::json_text({{"configById", std::move(panels)},
                           {"globalVariables", Json::object()},
                           {"userNodes", Json::object()},
                           {"playbackConfig", {{"speed", 1}}},
                           {"layout", column_of(order)}}) +
         "\n";
}

std::string plotjuggler_layout(const std::vector<Series>& series) {
  constexpr const char* colours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd"};
  std::string text =
      "<?xml version='1.0' encoding='UTF-8'?>\n<root>\n <tabbed_widget parent=\"main_window\" name=\"Main Window\">\n";
  // Its clock counts from the earliest sample of all that is loaded.
  double earliest = core::kInfinity;
  for (const Series& each : series) {
    earliest = std::min(earliest, each.times.lower);
  }
  for (const Series& each : series) {
    const Interval times{each.times.lower - earliest, each.times.upper - earliest};
    const std::size_t count = each.plots.size() + 1;
    text += fmt::format(
        "  <Tab containers=\"1\" tab_name=\"{}\">\n   <Container>\n    <DockSplitter orientation=\"-\" "
        "sizes=\"{:.6f}",
        words::spaced(each.topic.substr(1)), 1.0 / static_cast<double>(count));
    for (std::size_t k = 1; k < count; ++k) {
      text += fmt::format(";{:.6f}", 1.0 / static_cast<double>(count));
    }
    text += fmt::format("\" count=\"{}\">\n", count);
    std::vector<std::pair<std::string, std::string>> alarms;
    for (const SeriesPlot& plot : each.plots) {
      std::vector<std::pair<std::string, std::string>> curves;
      for (const Curve& curve : kResidual) {
        curves.emplace_back(curve_name(each, std::string(curve.quantity) + "_" + plot.name), curve.colour);
      }
      alarms.emplace_back(curve_name(each, "alarm_" + plot.name), colours[alarms.size() % std::size(colours)]);
      text += plotjuggler_plot(plot.title, times, plot.values, curves);
    }
    text += plotjuggler_plot("alarms", times, {0.0, 1.0}, alarms);
    text += "    </DockSplitter>\n   </Container>\n  </Tab>\n";
  }
  return text +
         "  <currentTabIndex index=\"0\"/>\n </tabbed_widget>\n <use_relative_time_offset enabled=\"1\"/>\n"
         " <Plugins/>\n <customMathEquations/>\n <snippets/>\n</root>\n";
}

}  // namespace wheelwright::app
