// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "commission/contradiction_search.hpp"
#include "commission/setting.hpp"
#include "core/limits.hpp"

namespace wheelwright::commission {

namespace {

using Kind = LogContradiction::Kind;

// A column of the log over all rows.
struct ColumnRange {
  double least = core::kInfinity;
  double most = -core::kInfinity;
  [[nodiscard]] bool constant() const { return least == most; }
};

std::vector<ColumnRange> ranges_of(LogSource& log, const std::vector<std::string>& columns) {
  std::vector<ColumnRange> ranges(columns.size());
  core::for_each_sample(log, columns, [&](const core::LogSample& sample) {
    for (std::size_t c = 0; c < ranges.size(); ++c) {
      ranges[c] = {std::min(ranges[c].least, sample.values[c]), std::max(ranges[c].most, sample.values[c])};
    }
  });
  return ranges;
}

void find_constant_efforts(LogSource& log, const Setting& s, const std::vector<ColumnRange>& motions,
                           std::vector<LogContradiction>& out) {
  const std::vector<ColumnRange> efforts = ranges_of(log, s.measurement.effort_columns);
  for (std::size_t j = 0; j < efforts.size(); ++j) {
    if (efforts[j].constant() && !motions[j].constant()) {
      const std::string& name = s.measurement.effort_columns[j];
      out.push_back({.kind = Kind::effort_constant,
                     .subject = name,
                     .value = efforts[j].least,
                     .sentence = fmt::format("{} is {:.6g} in every row although {} changes: no force is measured",
                                             name, efforts[j].least, s.measurement.motion_columns[j]),
                     .next = "check that the sensor is connected and that the right column is read (--map)"});
    }
  }
}

void find_wrapped_angles(LogSource& log, const Setting& s, const std::vector<ColumnRange>& ranges,
                         std::vector<LogContradiction>& out) {
  constexpr double kHalfTurn = std::numbers::pi;
  constexpr double kMoves = 0.25;  // of a half turn: at most this much otherwise between two rows
  if (s.measurement.motion != MotionKind::angle) {
    return;
  }
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    const std::string& name = s.measurement.motion_columns[j];
    if (ranges[j].most - ranges[j].least > 2.0 * kHalfTurn * (1.0 + 1e-6)) {
      continue;
    }
    double last = std::numeric_limits<double>::quiet_NaN(), least_jump = core::kInfinity, most_move = 0.0;
    std::size_t jumps = 0;
    core::for_each_sample(log, {name}, [&](const core::LogSample& sample) {
      const double moved = std::abs(sample.values[0] - last);
      if (moved > kHalfTurn) {
        ++jumps;
        least_jump = std::min(least_jump, moved);
      } else if (moved <= kHalfTurn) {
        most_move = std::max(most_move, moved);
      }
      last = sample.values[0];
    });
    if (jumps > 0 && most_move < kMoves * kHalfTurn) {
      out.push_back({.kind = Kind::angle_wrapped,
                     .subject = name,
                     .value = least_jump,
                     .limit = kHalfTurn,
                     .sentence = fmt::format("{} stays within one turn and jumps by {:.3g} rad and more between two "
                                             "rows, {} times: it is wrapped",
                                             name, least_jump, jumps),
                     .next = "unwrap the angle (numpy.unwrap) before commissioning; files are unwrapped on reading"});
    }
  }
}

// A sample against the line through its neighbours, drawn over the stamps and over row numbers. Of angles: the speed of
// a motor that follows its controller at once may well be a function of the controller's cycle.
void find_scattered_stamps(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
  constexpr double kEven = 0.02;     // relative: steps that differ by less are even
  constexpr double kSmoother = 0.5;  // rms over row numbers over that over stamps
  if (s.measurement.motion != MotionKind::angle) {
    return;
  }
  const std::size_t joints = s.measurement.motion_columns.size();
  const double longest = s.measurement.longest_step();
  std::vector<double> before(joints), middle(joints);
  double t_before = 0.0, t_middle = 0.0, by_stamp = 0.0, by_row = 0.0;
  std::size_t known = 0, looked = 0;
  core::for_each_sample(log, s.measurement.motion_columns, [&](const core::LogSample& sample) {
    const double t = sample.t;
    const bool starts = sample.starts || (known > 0 && longest > 0.0 && t - t_middle > longest);
    known = starts ? 0 : known;
    if (known >= 2) {
      const double a = t_middle - t_before, b = t - t_middle;
      if (std::abs(a - b) > kEven * (a + b)) {
        ++looked;
        for (std::size_t c = 0; c < joints; ++c) {
          const double value = sample.values[c];
          const double stamp = middle[c] - (before[c] * b + value * a) / (a + b);
          const double row = middle[c] - 0.5 * (before[c] + value);
          by_stamp += stamp * stamp;
          by_row += row * row;
        }
      }
    }
    before = middle;
    middle.assign(sample.values.begin(), sample.values.end());
    t_before = t_middle;
    t_middle = t;
    ++known;
  });
  const double ratio = by_stamp > 0.0 ? std::sqrt(by_row / by_stamp) : 1.0;
  if (looked >= kFewestInstants && ratio < kSmoother) {
    out.push_back(
        {.kind = Kind::stamps_scatter,
         .subject = "t",
         .value = ratio,
         .limit = kSmoother,
         .sentence = fmt::format("the motion is {:.2g} times as rough over the stamps as over the row numbers: "
                                 "the samples are even, their stamps scatter",
                                 1.0 / std::max(ratio, std::numeric_limits<double>::min())),
         .next = "stamp samples where they are taken, or give the cycle's length: `clock: {step: s}` in the robot file "
                 "reads even samples by it"});
  }
}

}  // namespace

void find_raw_contradictions(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
  const std::vector<ColumnRange> motions = ranges_of(log, s.measurement.motion_columns);
  find_wrapped_angles(log, s, motions, out);
  find_scattered_stamps(log, s, out);
  find_constant_efforts(log, s, motions, out);
}

}  // namespace wheelwright::commission
