// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "core/statistics.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kLeastCounts = 10.0;   // that the top speed makes in the span of a difference
constexpr double kLeastSpan = 0.02;     // s, of a difference of angles
constexpr double kSlowest = 0.1;        // of the top speed: slower is a reversal or rest
constexpr double kLongestDip = 0.6;     // s of a touch, between two stretches of a drive that goes on
constexpr double kShortestPiece = 0.2;  // s
constexpr double kDip = 0.25;           // of the top speed: slower is a touch of zero
constexpr double kTimesLess = 3.0;      // unexplained without these signs over unexplained with them
constexpr double kExplained = 0.8;      // share of the efforts that motion with a sign for each stretch must explain
constexpr std::size_t kLeastReversals = 3;  // reversals
constexpr double kUsualChange = 0.95;       // quantile of changes from row to row
constexpr double kJump = 2.0;               // of the usual change, on both sides of zero
constexpr double kTimesTheEffort = 3.0;     // what a jump would take, over the largest effort about it

double rank_of(std::vector<double> values, double q) {
  if (values.empty()) {
    return 0.0;
  }
  const auto rank = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1));
  return core::order_statistic(std::move(values), rank);
}

// Mean speed of `joint` over `span` rows before row k and over as many from it on, by column; of one segment.
struct Sides {
  double before = 0.0, after = 0.0;
};
Sides sides_of(const HealthView& view, const std::vector<double>& column, bool angle, std::size_t k, std::size_t span) {
  const std::vector<double>& t = view.log->t;
  if (angle) {
    return {(column[k] - column[k - span]) / (t[k] - t[k - span]),
            (column[k + span] - column[k]) / (t[k + span] - t[k])};
  }
  Sides s;
  for (std::size_t i = 0; i < span; ++i) {
    s.before += column[k - 1 - i] / static_cast<double>(span);
    s.after += column[k + i] / static_cast<double>(span);
  }
  return s;
}

// Rows over which a count of an angle is no more than a tenth of the top speed.
std::size_t span_of(const HealthView& view, const JointView& joint, const std::vector<double>& column, bool angle) {
  if (!angle || !(joint.top > 0.0)) {
    return 1;
  }
  double count = 0.0;
  for (std::size_t k = 1; k < column.size(); ++k) {
    const double step = std::abs(column[k] - column[k - 1]);
    count = step > 1e-9 && (count == 0.0 || step < count) ? step : count;
  }
  const double seconds = std::max(kLeastSpan, kLeastCounts * count / joint.top);
  return static_cast<std::size_t>(std::max(1.0, std::ceil(seconds / view.step)));
}

// Rows at which the speed jumps from one value to its opposite, as nothing that the efforts could do, and keeps its
// sign before and after as a drive does, and noise does not.
std::vector<std::size_t> jumps_of_sign(const HealthView& view, const JointView& joint,
                                       const std::vector<double>& column, bool angle, std::size_t& crossings) {
  const std::size_t span = span_of(view, joint, column, angle);
  const auto each = [&](auto&& visit) {
    for (const auto& [first, last] : view.segments) {
      for (std::size_t k = first + span; k + span < last; ++k) {
        visit(k, sides_of(view, column, angle, k, span));
      }
    }
  };
  std::vector<double> changes;
  each([&](std::size_t, const Sides& s) { changes.push_back(std::abs(std::abs(s.after) - std::abs(s.before))); });
  const double usual = rank_of(std::move(changes), kUsualChange);
  const auto jumps = [&](const Sides& s) {
    return s.before * s.after < 0.0 && std::min(std::abs(s.before), std::abs(s.after)) > kJump * usual &&
           std::abs(std::abs(s.after) - std::abs(s.before)) < kJump * usual;
  };
  double ea = 0.0, aa = 0.0;
  each([&](std::size_t k, const Sides& s) {
    if (s.before * s.after > 0.0) {
      const double change = s.after - s.before;
      ea += (*joint.effort)[k] * change;
      aa += change * change;
    }
  });
  const double per_change = aa > 0.0 ? ea / aa : 0.0;  // effort that changes the speed by one unit from row to row
  std::vector<std::size_t> found;
  double side = 0.0;  // of the last speed that was not slow
  std::vector<std::size_t> turns;
  each([&](std::size_t k, const Sides& s) {
    if (std::abs(s.after) > kSlowest * joint.top) {
      if (side * s.after < 0.0) {
        turns.push_back(k);
      }
      side = s.after;
    }
    if (!jumps(s)) {
      return;
    }
    double largest = 0.0;
    for (std::size_t i = k - span; i <= k + span; ++i) {
      largest = std::max(largest, std::abs((*joint.effort)[i]));
    }
    const bool taken = std::abs(per_change * (s.after - s.before)) < kTimesTheEffort * largest;
    if (!taken && (found.empty() || k > found.back() + 2 * span)) {
      found.push_back(k);
    }
  });
  crossings = turns.size();
  std::erase_if(found, [&](std::size_t k) {
    return std::ranges::any_of(turns, [&](std::size_t turn) {
      const std::size_t apart = turn > k ? turn - k : k - turn;
      return apart > 2 * span && static_cast<double>(apart) * view.step < kShortestPiece;
    });
  });
  return found;
}

// Speed of each row: of angles, of lines between the rows in which they change, since a count lasts for rows.
std::vector<double> steady_speed(const HealthView& view, const std::vector<double>& column, bool angle) {
  const std::vector<double>& t = view.log->t;
  std::vector<double> values = column, out(column.size(), 0.0);
  const auto span =
      static_cast<std::size_t>(std::max(angle ? 1.0 : 0.0, std::round((angle ? 0.05 : 0.03) / view.step)));
  for (const auto& [first, last] : view.segments) {
    std::size_t changed = first;
    for (std::size_t k = first + 1; angle && k < last; ++k) {
      if (column[k] == column[k - 1] && k + 1 < last) {
        continue;
      }
      for (std::size_t i = changed + 1; i < k; ++i) {
        values[i] = column[changed] + (column[k] - column[changed]) * (t[i] - t[changed]) / (t[k] - t[changed]);
      }
      changed = k;
    }
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t from = k < first + span ? first : k - span, to = std::min(k + span, last - 1);
      if (angle) {
        out[k] = to > from ? (values[to] - values[from]) / (t[to] - t[from]) : 0.0;
      } else {
        for (std::size_t i = from; i <= to; ++i) {
          out[k] += values[i] / static_cast<double>(to - from + 1);
        }
      }
    }
  }
  return out;
}

// A stretch between two touches of zero, and one half of it, up to its fastest row or from there on: what its effort
// adds up to, by how much its speed changes, how far it goes, over the root of how long it takes.
struct Piece {
  std::size_t first = 0, last = 0;
  double sign = 1.0;
};
struct Half {
  std::size_t piece = 0;
  double effort = 0.0, change = 0.0, way = 0.0;
};

void add_half(const HealthView& view, const std::vector<double>& speed, const std::vector<double>& effort,
              std::size_t piece, std::size_t from, std::size_t to, std::vector<Half>& halves) {
  constexpr std::size_t kLeastRows = 3;
  if (to < from + kLeastRows) {
    return;
  }
  const std::vector<double>& t = view.log->t;
  Half half{.piece = piece, .change = speed[to] - speed[from]};
  for (std::size_t k = from; k < to; ++k) {
    half.effort += effort[k] * (t[k + 1] - t[k]);
    half.way += speed[k] * (t[k + 1] - t[k]);
  }
  const double root = std::sqrt(t[to] - t[from]);
  half.effort /= root;
  half.change /= root;
  half.way /= root;
  halves.push_back(half);
}

// effort = s (A change + F way) with one sign s a piece: the share of the efforts that is explained.
double fit_signs(const std::vector<Half>& halves, std::vector<Piece>& pieces, bool free) {
  std::vector<double> sums(pieces.size(), 0.0);
  const auto settle_signs = [&] {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      pieces[i].sign = free && sums[i] < 0.0 ? -1.0 : 1.0;
    }
    std::ranges::fill(sums, 0.0);
  };
  double ee = 0.0, cc = 0.0, cw = 0.0, ww = 0.0;
  for (const Half& h : halves) {
    sums[h.piece] += h.effort * h.change;
    ee += h.effort * h.effort;
    cc += h.change * h.change;
    cw += h.change * h.way;
    ww += h.way * h.way;
  }
  settle_signs();
  const double det = cc * ww - cw * cw;
  if (!(det > 0.0) || !(ee > 0.0)) {
    return 0.0;
  }
  double explained = 0.0;
  for (int pass = 0; pass < (free ? 20 : 1); ++pass) {
    double ec = 0.0, ew = 0.0;
    for (const Half& h : halves) {
      ec += pieces[h.piece].sign * h.effort * h.change;
      ew += pieces[h.piece].sign * h.effort * h.way;
    }
    const double A = (ec * ww - ew * cw) / det, F = (ew * cc - ec * cw) / det;
    explained = (A * ec + F * ew) / ee;
    for (const Half& h : halves) {
      sums[h.piece] += h.effort * (A * h.change + F * h.way);
    }
    settle_signs();
  }
  return explained;
}

// Rows at which a speed that is never negative bounces off zero while its effort goes on as through a reversal.
std::vector<std::size_t> bounces(const HealthView& view, const JointView& joint, const std::vector<double>& column,
                                 bool angle) {
  const std::vector<double> speed = steady_speed(view, column, angle);
  std::vector<double> sizes(speed.size());
  std::ranges::transform(speed, sizes.begin(), [](double v) { return std::abs(v); });
  const double top = rank_of(std::move(sizes), 0.99);
  const auto back = static_cast<std::size_t>(std::ranges::count_if(speed, [&](double v) { return v < -0.05 * top; }));
  if (!(top > 0.0) || 200 * back > speed.size()) {
    return {};
  }
  const std::vector<double>& t = view.log->t;
  std::vector<Piece> pieces;
  std::vector<Half> halves;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t from = k;
      while (k < last && speed[k] >= kDip * top) {
        ++k;
      }
      if (k == from || t[k - 1] - t[from] < kShortestPiece) {
        continue;
      }
      const auto begin = speed.begin() + static_cast<std::ptrdiff_t>(from);
      const auto end = speed.begin() + static_cast<std::ptrdiff_t>(k);
      const auto fastest = static_cast<std::size_t>(std::max_element(begin, end) - speed.begin());
      add_half(view, speed, *joint.effort, pieces.size(), from, fastest, halves);
      add_half(view, speed, *joint.effort, pieces.size(), fastest, k - 1, halves);
      pieces.push_back({.first = from, .last = k - 1});
    }
  }
  const double as_logged = fit_signs(halves, pieces, false), with_signs = fit_signs(halves, pieces, true);
  if (with_signs < kExplained || 1.0 - as_logged < kTimesLess * (1.0 - with_signs)) {
    return {};
  }
  std::vector<std::size_t> found;
  std::size_t same = 0;
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    if (t[pieces[i].first] - t[pieces[i - 1].last] > kLongestDip) {
      continue;
    }
    if (pieces[i].sign != pieces[i - 1].sign) {
      found.push_back((pieces[i].first + pieces[i - 1].last) / 2);
    } else {
      ++same;
    }
  }
  return found.size() >= kLeastReversals && found.size() > same ? found : std::vector<std::size_t>{};
}

}  // namespace

bool check_direction(const HealthView& view, std::vector<LogFinding>& findings) {
  if (!view.has_motion() || !view.has_effort() || view.robot.effort_unsigned || !(view.step > 0.0)) {
    return false;
  }
  bool any = false;
  for (const JointView& joint : view.joints) {
    const bool angle = joint.angle != nullptr;
    const std::vector<double>& column = angle ? *joint.angle : *joint.speed;
    std::size_t crossings = 0;
    std::vector<std::size_t> rows = bounces(view, joint, column, angle);
    std::string what =
        fmt::format("bounces off zero {} times while its effort goes on as through a reversal", rows.size());
    if (rows.empty()) {
      rows = jumps_of_sign(view, joint, column, angle, crossings);
      if (rows.size() < kLeastReversals || 5 * rows.size() < crossings) {
        continue;
      }
      what =
          fmt::format("jumps from one speed to its opposite {} times, as no effort of the log could do", rows.size());
    }
    LogFinding f{.id = "signals.no_direction",
                 .topic = FindingTopic::signals,
                 .severity = FindingSeverity::fatal,
                 .sentence = fmt::format("{} {}: its sensor does not see the direction, and the sign is {}.",
                                         joint.motion_name(), what, crossings > 0 ? "that of the command" : "missing"),
                 .next =
                     "Count both channels of the encoder, or log a sensor that sees the direction; else record a "
                     "drive in which no wheel reverses (no turning on the spot), where no sign is needed.",
                 .columns = {joint.motion_name()},
                 .value = static_cast<double>(rows.size()),
                 .unit = "1",
                 .refuses = true};
    std::vector<bool> flagged(view.log->rows(), false);
    for (const std::size_t row : rows) {
      flagged[row] = true;
    }
    set_stretches(f, view, flagged, view.step);
    findings.push_back(std::move(f));
    any = true;
  }
  return any;
}

}  // namespace wheelwright::doctor
