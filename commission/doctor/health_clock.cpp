// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "core/even_clock.hpp"
#include "core/statistics.hpp"

namespace wheelwright::doctor {
namespace {

constexpr std::size_t kClockRows = 200;
constexpr double kClockScatters = 2e-4;      // of a step, standard deviation: stamps of less are even
constexpr double kClockScattersMuch = 0.05;  // the same, above which it is said that nothing can be told
constexpr double kClockUnplaced = 0.02;      // share of rows that find no place
constexpr double kClockSure = 6.0;           // standard errors
constexpr double kClockMoved = 0.05;         // share of the scatter that even samples may show
constexpr double kClockTold = 0.15;          // standard error of that share, above which nothing is told
constexpr std::size_t kClockBlock = 20;      // rows whose errors may depend on each other
constexpr std::size_t kClockRateRows = 500;  // of a stretch by which the rate is known
constexpr double kBurstTogether = 0.3;       // of the mean step: rows nearer than that come together

// Rows of a log on the places of an even clock.
struct ClockGrid {
  double step = 0.0;
  std::vector<double> t;     // s, of each row
  std::vector<double> off;   // of a step: the stamp against it
  std::vector<bool> starts;  // a stretch starts here
  std::size_t unplaced = 0;  // rows that begin a stretch where the log goes on
};

ClockGrid place_rows(const HealthView& view, double step) {
  ClockGrid grid{.step = step, .t = {}, .off = {}, .starts = {}};
  core::EvenTimes times({.step = step, .drift = 0.0});
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      times.take(view.log->t[k], k == first);
    }
  }
  times.finish();
  while (const auto place = times.next()) {
    grid.t.push_back(place->t);
    grid.off.push_back(place->off);
    grid.starts.push_back(place->starts);
    grid.unplaced += place->starts ? 1 : 0;
  }
  grid.unplaced -= std::min(grid.unplaced, view.segments.size());
  return grid;
}

// visit(first, last) for each stretch of rows on places.
template <typename Visit>
void each_stretch(const ClockGrid& grid, Visit visit) {
  for (std::size_t first = 0; first < grid.t.size();) {
    std::size_t last = first + 1;
    while (last < grid.t.size() && !grid.starts[last]) {
      ++last;
    }
    visit(first, last);
    first = last;
  }
}

// Rate of the stamps by the grid's, less 1, over rows [first, last), with its standard error.
struct ClockRate {
  double off = 0.0, error = 0.0;
};

ClockRate rate_of(const HealthView& view, const ClockGrid& grid, std::size_t first, std::size_t last) {
  const auto n = static_cast<double>(last - first);
  double at = 0.0, late = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    at += grid.t[k] / n;
    late += (view.log->t[k] - grid.t[k]) / n;
  }
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    const double x = grid.t[k] - at, y = view.log->t[k] - grid.t[k] - late;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  ClockRate rate;
  if (xx > 0.0) {
    rate.off = xy / xx;
    rate.error = std::sqrt(std::max(0.0, yy - xy * rate.off) / std::max(n - 2.0, 1.0) / xx);
  }
  return rate;
}

// The step by which rows far apart are a whole number of steps apart, from what they are by a shorter distance.
double even_step(const HealthView& view) {
  const std::vector<double>& t = view.log->t;
  double step = view.step;
  std::size_t longest = 0;
  for (const auto& [first, last] : view.segments) {
    longest = std::max(longest, last - first);
  }
  for (std::size_t apart = 1; 3 * apart <= longest; apart *= 10) {
    std::vector<double> each;
    double sum = 0.0;
    for (const auto& [first, last] : view.segments) {
      for (std::size_t k = first; k + apart < last; ++k) {
        const double span = t[k + apart] - t[k], steps = std::round(span / step);
        if (steps >= 1.0 && (apart > 1 || (span > 0.5 * step && span < 1.5 * step))) {
          each.push_back(span / steps);
          sum += each.back();
        }
      }
    }
    if (each.size() < kClockRows / 2) {
      break;
    }
    step = apart == 1 ? sum / static_cast<double>(each.size()) : core::median(std::move(each));
  }
  return step;
}

double refined_step(const HealthView& view, const ClockGrid& grid) {
  double off = 0.0, weights = 0.0;
  each_stretch(grid, [&](std::size_t first, std::size_t last) {
    const double weight = std::pow(static_cast<double>(last - first), 3.0);
    off += last - first > kClockBlock ? weight * rate_of(view, grid, first, last).off : 0.0;
    weights += last - first > kClockBlock ? weight : 0.0;
  });
  return grid.step * (1.0 + (weights > 0.0 ? off / weights : 0.0));
}

// Bound of |true rate/rate − 1|, stretch by stretch.
double drift_of(const HealthView& view, const ClockGrid& grid) {
  double drift = 0.0;
  std::size_t longest = 0;
  each_stretch(grid, [&](std::size_t first, std::size_t last) { longest = std::max(longest, last - first); });
  const std::size_t rows = std::min(std::max(kClockRateRows, longest / 8), longest);
  each_stretch(grid, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k + rows <= last; k += rows) {
      const ClockRate rate = rate_of(view, grid, k, k + rows);
      drift = std::max(drift, std::abs(rate.off) + 3.0 * rate.error);
    }
  });
  return drift;
}

// Standard deviation of the stamps about their places, in steps.
double stamp_scatter(const ClockGrid& grid) {
  double squares = 0.0, rows = 0.0;
  for (std::size_t k = 0; k < grid.off.size(); ++k) {
    squares += grid.off[k] * grid.off[k];
    rows += grid.starts[k] ? 0.0 : 1.0;
  }
  return rows > 0.0 ? std::sqrt(squares / rows) : 0.0;
}

// Share of the stamps' scatter that the motion shows: a sample against the middle of its neighbours, which are as far
// apart by the even clock, against where the stamps would have it. 1: samples are where their stamps say, 0: they are
// even.
struct MovedShare {
  double share = 0.0, error = 1.0;
};

MovedShare moved_share(const HealthView& view, const ClockGrid& grid) {
  const bool angles = std::ranges::all_of(view.joints, [](const JointView& j) { return j.angle != nullptr; });
  double xx_all = 0.0, xc_all = 0.0, variance = 0.0;
  for (const JointView& joint : view.joints) {
    const std::vector<double>& value = angles ? *joint.angle : *joint.speed;
    std::vector<std::array<double, 2>> pairs;  // where the stamps have it, where it is; zeros where it cannot be told
    for (std::size_t k = 1; k + 1 < grid.t.size(); ++k) {
      const double before = view.log->t[k] - view.log->t[k - 1], after = view.log->t[k + 1] - view.log->t[k];
      const bool beside = !grid.starts[k] && !grid.starts[k + 1] && before + after > 0.0 &&
                          std::abs(grid.t[k + 1] - grid.t[k - 1] - 2.0 * grid.step) < 0.5 * grid.step;
      pairs.push_back({0.0, 0.0});
      if (beside) {
        pairs.back() = {(value[k + 1] - value[k - 1]) / (before + after) * 0.5 * (before - after),
                        value[k] - 0.5 * (value[k - 1] + value[k + 1])};
      }
    }
    double xx = 0.0, xc = 0.0, cc = 0.0;
    for (const auto& [x, c] : pairs) {
      xx += x * x;
      xc += x * c;
      cc += c * c;
    }
    if (!(cc > 0.0) || !(xx > 0.0)) {
      continue;
    }
    double errors = 0.0;
    for (std::size_t k = 0; k < pairs.size(); k += kClockBlock) {
      double sum = 0.0;
      for (std::size_t i = k; i < std::min(k + kClockBlock, pairs.size()); ++i) {
        sum += pairs[i][0] * (pairs[i][1] - xc / xx * pairs[i][0]);
      }
      errors += sum * sum;
    }
    const double weight = 1.0 / cc;  // joints of different resolution
    xx_all += weight * xx;
    xc_all += weight * xc;
    variance += weight * weight * errors;
  }
  return xx_all > 0.0 ? MovedShare{xc_all / xx_all, std::sqrt(variance) / xx_all} : MovedShare{};
}

std::string clock_line(const EvenClock& clock) {
  return fmt::format("`clock: {{step: {:.9g}, drift: {:.2g}}}`", clock.step, 1.1 * clock.drift);
}

// Whether the motion changes by as much between rows that are close in time as between others: rows of even samples
// that were sent together do, pieces of a recording do not.
bool moves_evenly(const HealthView& view, double close) {
  constexpr double kAlikeChanges = 3.0;
  const std::vector<double>& t = view.log->t;
  for (const JointView& joint : view.joints) {
    const std::vector<double>* motion = joint.angle != nullptr ? joint.angle : joint.speed;
    double near = 0.0, far = 0.0;
    std::size_t nears = 0, fars = 0;
    for (std::size_t k = 1; motion != nullptr && k < t.size(); ++k) {
      const double square = std::pow((*motion)[k] - (*motion)[k - 1], 2);
      const bool is_near = t[k] - t[k - 1] < close;
      (is_near ? near : far) += square;
      ++(is_near ? nears : fars);
    }
    if (nears > 0 && fars > 0 && near > 0.0) {
      const double ratio = std::sqrt(far / static_cast<double>(fars) * static_cast<double>(nears) / near);
      return ratio < kAlikeChanges && ratio > 1.0 / kAlikeChanges;
    }
  }
  return true;
}

// Rows that are sent together have no times of their own: what is said of them.
std::optional<LogFinding> find_bursts(const HealthView& view) {
  const std::vector<double>& t = view.log->t;
  const double mean = core::step_of_bursts(t);
  std::size_t close = 0;
  for (std::size_t k = 1; k < t.size(); ++k) {
    close += t[k] >= t[k - 1] && t[k] - t[k - 1] < kBurstTogether * mean ? 1 : 0;
  }
  const double share = static_cast<double>(close) / static_cast<double>(std::max<std::size_t>(t.size(), 2) - 1);
  if (!(mean > 0.0) || share < 0.4 || !moves_evenly(view, kBurstTogether * mean)) {
    return std::nullopt;
  }
  return LogFinding{.id = "time.bursts",
                    .topic = FindingTopic::time,
                    .severity = FindingSeverity::fatal,
                    .sentence = fmt::format("Rows come in bursts of about {:.3g}: {:.0f} % of them follow the row "
                                            "before within {:.0f} % of the mean step of {:.4g} s. The stamps are those "
                                            "of arrival; when the samples were taken they do not say.",
                                            1.0 / (1.0 - share), 100.0 * share, 100.0 * kBurstTogether, mean),
                    .next = fmt::format("Stamp samples where they are taken (header.stamp set by the driver), or, "
                                        "where the sensor samples evenly and no row is lost, number them: t = row × "
                                        "{:.6g}.",
                                        mean),
                    .columns = {"t"},
                    .value = share,
                    .unit = "1",
                    .refuses = true};
}

// The step by which the rows that begin bursts are numbered, where no row is lost.
double step_between_bursts(const HealthView& view) {
  const std::vector<double>& t = view.log->t;
  const double close = kBurstTogether * core::step_of_bursts(t);
  double rows = 0.0, seconds = 0.0;
  for (const auto& [first, last] : view.segments) {
    double n = 0.0, row = 0.0, time = 0.0;
    const auto visit = [&](auto&& take) {
      for (std::size_t k = first + 1; k < last; ++k) {
        if (t[k] - t[k - 1] >= close) {
          take(static_cast<double>(k - first), t[k] - t[first]);
        }
      }
    };
    visit([&](double k, double at) {
      n += 1.0;
      row += k;
      time += at;
    });
    visit([&](double k, double at) {
      rows += (k - row / n) * (k - row / n);
      seconds += (k - row / n) * (at - time / n);
    });
  }
  return rows > 0.0 ? seconds / rows : 0.0;
}

}  // namespace

std::optional<EvenClock> check_clock(const HealthView& view, std::vector<LogFinding>& findings) {
  std::optional<LogFinding> bursts = find_bursts(view);
  const auto by_stamps = [&]() -> std::optional<EvenClock> {
    if (bursts) {
      findings.push_back(std::move(*bursts));
    }
    return std::nullopt;
  };
  const double step = bursts ? step_between_bursts(view) : even_step(view);
  if (view.robot.clock || view.log->rows() < kClockRows || !(step > 0.0) || !view.has_motion()) {
    return by_stamps();
  }
  ClockGrid grid = place_rows(view, step);
  for (int pass = bursts ? 2 : 0; pass < 2; ++pass) {  // what begins bursts tells more than all stamps do
    grid = place_rows(view, refined_step(view, grid));
  }
  const double scatter = stamp_scatter(grid);
  if (static_cast<double>(grid.unplaced) > kClockUnplaced * static_cast<double>(grid.t.size()) ||
      !(scatter > kClockScatters)) {
    return by_stamps();
  }
  const EvenClock clock{.step = grid.step, .drift = drift_of(view, grid)};
  const MovedShare moved = moved_share(view, grid);
  const bool told = moved.error < kClockTold;
  const bool may_be_true = 1.0 - moved.share < kClockSure * moved.error;
  const bool may_be_even = moved.share < std::max(kClockMoved, 3.0 * moved.error);  // below 0 by chance
  const bool even = told && may_be_even && !may_be_true;
  const bool follow = told && may_be_true && !may_be_even;  // samples are where their stamps say
  if (!even && (bursts || follow || scatter < kClockScattersMuch)) {
    return by_stamps();
  }
  const std::string scatters =
      fmt::format("{} scatter by {:.2g} s ({:.{}f} % of a step) about an even clock of {:.6g} s",
                  bursts ? "Stamps of rows that come in bursts" : "Stamps", scatter * clock.step, 100.0 * scatter,
                  scatter < 0.1 ? 1 : 0, clock.step);
  LogFinding finding{.id = "time.even_clock",
                     .topic = FindingTopic::time,
                     .severity = FindingSeverity::notice,
                     .columns = {"t"},
                     .value = moved.share,
                     .unit = "1"};
  if (even) {
    finding.sentence = fmt::format(
        "{}, and the motion shows {:.2g} ± {:.1g} of that scatter: the samples are even, and "
        "are read by that clock.",
        scatters, moved.share, 2.0 * moved.error);
    finding.next = fmt::format(
        "{} in the robot file makes this part of it; `clock: stamps` reads the stamps as they are.", clock_line(clock));
  } else {
    finding.sentence =
        fmt::format("{}; whether the samples do, the motion does not tell ({:.2g} ± {:.1g} of the scatter).", scatters,
                    moved.share, 2.0 * moved.error);
    finding.next = fmt::format("Where the sensor samples evenly, write {} into the robot file.", clock_line(clock));
  }
  findings.push_back(std::move(finding));
  return even ? std::optional(clock) : std::nullopt;
}

}  // namespace wheelwright::doctor
