// SPDX-License-Identifier: Apache-2.0
#include "results/report/signals.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;
namespace {

// Every four neighbours within a segment become two: the smallest and the largest value of each column, at the first
// time and at the middle one. Rows that are pairs already become pairs of twice the length.
void halve(LogTable& table) {
  std::vector<std::size_t> starts;
  std::size_t segment = 0, out = 0;
  for (std::size_t first = 0; first < table.rows();) {
    while (segment < table.segment_starts.size() && table.segment_starts[segment] <= first) {
      if (table.segment_starts[segment++] == first) {
        starts.push_back(out);
      }
    }
    const std::size_t limit = segment < table.segment_starts.size() ? table.segment_starts[segment] : table.rows();
    const std::size_t last = std::min(first + 4, limit), n = last - first;
    const double middle = table.t[first + n / 2];
    table.t[out] = table.t[first];
    if (n > 1) {
      table.t[out + 1] = middle;
    }
    for (std::vector<double>& column : table.columns) {
      const auto at = column.begin() + static_cast<std::ptrdiff_t>(first);
      const auto [low, high] = std::minmax_element(at, at + static_cast<std::ptrdiff_t>(n));
      const double smallest = *low, largest = *high;
      column[out] = smallest;
      if (n > 1) {
        column[out + 1] = largest;
      }
    }
    out += std::min<std::size_t>(n, 2);
    first = last;
  }
  table.t.resize(out);
  for (std::vector<double>& column : table.columns) {
    column.resize(out);
  }
  table.segment_starts = std::move(starts);
}

// A table that is halved whenever it is full; then what follows is joined as far as what it holds.
class Recorder {
 public:
  Recorder(const std::vector<std::string>& names, std::size_t most) : most_(std::max<std::size_t>(most, 16)) {
    table_.names = names;
    table_.columns.resize(names.size());
    low_.resize(names.size());
    high_.resize(names.size());
  }

  void add(const LogBlock& block, std::size_t row, bool starts) {
    if (starts || in_bin_ == length_) {
      flush();
    }
    if (in_bin_ == 0) {
      first_ = block.t[row];
      starts_ = starts;
    }
    if (2 * in_bin_ <= length_) {
      middle_ = block.t[row];
    }
    for (std::size_t c = 0; c < low_.size(); ++c) {
      const double value = block.columns[c][row];
      low_[c] = in_bin_ == 0 ? value : std::min(low_[c], value);
      high_[c] = in_bin_ == 0 ? value : std::max(high_[c], value);
    }
    ++in_bin_;
  }

  LogTable finish() {
    flush();
    return std::move(table_);
  }

 private:
  void flush() {
    if (in_bin_ == 0) {
      return;
    }
    if (table_.rows() + std::min<std::size_t>(in_bin_, 2) > most_) {
      const std::size_t before = table_.rows();
      halve(table_);
      length_ = length_ == 1 ? 4 : 2 * length_;
      if (4 * table_.rows() > 3 * before) {
        most_ *= 2;  // nearly one segment a bin: little can be joined
      }
    }
    if (starts_) {
      table_.segment_starts.push_back(table_.rows());
    }
    append(first_, low_);
    if (in_bin_ > 1) {
      append(middle_, high_);
    }
    in_bin_ = 0;
  }

  void append(double t, const std::vector<double>& values) {
    table_.t.push_back(t);
    for (std::size_t c = 0; c < values.size(); ++c) {
      table_.columns[c].push_back(values[c]);
    }
  }

  LogTable table_;
  std::size_t most_;
  std::size_t length_ = 1;  // rows of the log in a bin
  std::size_t in_bin_ = 0;
  double first_ = 0.0, middle_ = 0.0;
  bool starts_ = false;
  std::vector<double> low_, high_;
};

}  // namespace

LogTable raw_signals(LogSource& log, std::size_t most) {
  Recorder recorder(log.columns(), most);
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) { recorder.add(block, k, starts); });
  return recorder.finish();
}

namespace {

struct Group {
  std::string_view title;
  std::string_view unit;
  std::vector<std::string_view> columns;
};

const std::vector<Group>& groups() {
  static const std::vector<Group> all = {
      {"Wheel speeds", "rad/s", {"omega_r", "omega_l"}},
      {"Commanded wheel speeds", "rad/s", {"command_r", "command_l"}},
      {"Wheel angles", "rad", {"phi_r", "phi_l"}},
      {"Torques", "N·m", {"tau_r", "tau_l"}},
      {"Currents", "A", {"current_r", "current_l"}},
      {"Voltages", "V", {"voltage_r", "voltage_l"}},
      {"Position", "m", {"x", "y"}},
      {"Heading", "rad", {"theta"}},
      {"Gyroscope", "rad/s", {"gyro_z"}},
      {"Accelerometer", "m/s²", {"accel_x"}},
      {"Position of the axis", "m (rotary: rad)", {"position"}},
      {"Velocity of the axis", "m/s (rotary: rad/s)", {"velocity"}},
      {"Effort of the axis", "N (rotary: N·m)", {"effort"}},
  };
  return all;
}

// Start of the bin after the one that starts at `first`: `rows` on, or at the next segment.
std::size_t bin_end(const LogTable& table, std::size_t first, std::size_t rows) {
  const auto next = std::upper_bound(table.segment_starts.begin(), table.segment_starts.end(), first);
  const std::size_t limit = next == table.segment_starts.end() ? table.rows() : *next;
  return std::min(first + rows, limit);
}

// Smallest and largest of values [first, last) in the order of their occurrence. What is not finite is passed over.
std::pair<double, double> extremes(const std::vector<double>& values, std::size_t first, std::size_t last) {
  std::size_t low = last, high = last;
  for (std::size_t i = first; i < last; ++i) {
    if (std::isfinite(values[i])) {
      low = low == last || values[i] < values[low] ? i : low;
      high = high == last || values[i] > values[high] ? i : high;
    }
  }
  if (low == last) {
    return {std::nan(""), std::nan("")};
  }
  return {values[std::min(low, high)], values[std::max(low, high)]};
}

// From the smallest of `lower` to the largest of `upper`; 0 where there are none.
double extent(const std::vector<double>& lower, const std::vector<double>& upper) {
  return lower.empty() || upper.empty()
             ? 0.0
             : *std::max_element(upper.begin(), upper.end()) - *std::min_element(lower.begin(), lower.end());
}

Chart signal_chart(const LogTable& table, const Group& group, const std::vector<std::size_t>& columns,
                   const std::vector<ChartMark>& marks) {
  Chart chart{.title = std::string(group.title),
              .unit = std::string(group.unit),
              .clock = "signals",
              .series = {},
              .bands = {},
              .marks = marks};
  constexpr Line lines[] = {Line::first, Line::second, Line::third};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    chart.series.push_back({table.names[columns[i]], table.columns[columns[i]], lines[i % 3]});
  }
  return chart;
}

}  // namespace

LogTable thinned(const LogTable& table, std::size_t most) {
  if (table.rows() <= most || most < 2) {
    return table;
  }
  const std::size_t bin = (2 * table.rows() + most - 1) / most;
  LogTable out;
  out.names = table.names;
  out.columns.resize(table.columns.size());
  for (std::size_t first = 0; first < table.rows();) {
    const std::size_t last = bin_end(table, first, bin);
    if (std::binary_search(table.segment_starts.begin(), table.segment_starts.end(), first)) {
      out.segment_starts.push_back(out.t.size());
    }
    const std::size_t middle = first + (last - first) / 2;
    const bool single = middle == first;
    out.t.push_back(table.t[first]);
    if (!single) {
      out.t.push_back(table.t[middle]);
    }
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      const auto [a, b] = extremes(table.columns[c], first, last);
      out.columns[c].push_back(a);
      if (!single) {
        out.columns[c].push_back(b);
      }
    }
    first = last;
  }
  return out;
}

std::string signal_charts(const LogTable& signals, const std::vector<ChartMark>& marks, const TimeAxis& axis,
                          std::size_t rows) {
  LogTable thin;
  if (signals.rows() > most_chart_points) {
    thin = thinned(signals, most_chart_points);
  }
  const LogTable& table = thin.rows() > 0 ? thin : signals;
  std::vector<bool> used(table.names.size(), false);
  std::string out = clock("signals", table.t, table.segment_starts, axis);
  if (out.empty()) {
    return paragraph("The raw signals were not handed to this page.");
  }
  for (const Group& group : groups()) {
    std::vector<std::size_t> columns;
    for (const std::string_view wanted : group.columns) {
      for (std::size_t c = 0; c < table.names.size(); ++c) {
        if (table.names[c] == wanted && !used[c]) {
          used[c] = true;
          columns.push_back(c);
        }
      }
    }
    if (!columns.empty()) {
      out += figure(signal_chart(table, group, columns, marks), axis);
    }
  }
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    if (!used[c]) {
      out += figure(signal_chart(table, {table.names[c], "", {}}, {c}, marks), axis);
    }
  }
  out += thinning_note(std::max(rows, signals.rows()), table.rows(), "rows");
  if (const std::string path = driven_path(table); !path.empty()) {
    out +=
        "<figure><figcaption>Driven path <span class=\"unit\">x to the right, y up, one scale; the ring is the "
        "start</span></figcaption>" +
        path + "</figure>\n";
  }
  return out;
}

std::string residual_charts(const commission::Trace& trace, const Robot& robot, const Model& model,
                            const std::vector<std::vector<ChartMark>>& marks, const TimeAxis& axis,
                            const std::string& clock_id) {
  std::string out = clock(clock_id, trace.t, trace.breaks, axis);
  for (std::size_t i = 0; i < trace.outputs.size(); ++i) {
    const commission::OutputTrace& o = trace.outputs[i];
    const double span = extent(o.lower, o.upper);
    Chart chart{.title = "Residual of the output " + output_name(model, i),
                .unit = output_unit_of(robot, model, i),
                .clock = clock_id,
                .series = {{"u (upper threshold)", o.upper, Line::bound, span},
                           {"l (lower threshold)", o.lower, Line::bound, span}},
                .bands = {{0, 1, true}},
                .marks = i < marks.size() ? marks[i] : std::vector<ChartMark>{}};
    if (o.residual_high == o.residual_low) {
      chart.series.push_back({"residual ε", o.residual_high, Line::first, span});
    } else {
      chart.series.push_back({"ε, largest", o.residual_high, Line::first, span});
      chart.series.push_back({"ε, smallest", o.residual_low, Line::first, span});
      chart.bands.push_back({2, 3, false});
    }
    out += figure(chart, axis);
  }
  return out;
}

std::string torque_charts(const commission::Trace& trace, const Robot& robot, const Model& model, const TimeAxis& axis,
                          const std::string& clock_id) {
  std::string out;
  for (std::size_t i = 0; i < trace.outputs.size(); ++i) {
    const commission::OutputTrace& o = trace.outputs[i];
    const Chart chart{
        .title = "Filtered effort of the output " + output_name(model, i),
        .unit = output_unit_of(robot, model, i),
        .clock = clock_id,
        .series = {{"measured τ_f", o.torque, Line::first}, {"predicted Y_f θ̂", o.predicted, Line::second}},
        .bands = {},
        .marks = {}};
    out += figure(chart, axis);
  }
  return out;
}

std::string thinning_note(std::size_t all, std::size_t drawn, const char* what) {
  return drawn >= all ? std::string()
                      : paragraph(fmt::format("<span class=\"note\">{} {} of the log are drawn as {} points, the "
                                              "smallest and the largest value of each short stretch: peaks are "
                                              "kept, single samples are not.</span>",
                                              count(all), what, count(drawn)));
}

}  // namespace wheelwright::report
