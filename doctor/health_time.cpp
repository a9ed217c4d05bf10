// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include <wheelwright/doctor/log_health.hpp>

namespace wheelwright::doctor {
namespace {

constexpr double kMissing = 1.5;  // median steps from which on a sample is missing

LogFinding about_time(const char* id, FindingSeverity severity, std::string sentence, std::string next, double value,
                      const char* unit) {
  return {.id = id,
          .topic = FindingTopic::time,
          .severity = severity,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .value = value,
          .unit = unit};
}

FindingSeverity graded(double value, double notice, double warning) {
  return value > warning ? FindingSeverity::warning : value > notice ? FindingSeverity::notice : FindingSeverity::fine;
}

// Steps inside segments, each with the row that it ends at.
struct Steps {
  std::vector<double> length;
  std::vector<std::size_t> row;
};

Steps steps_of(const HealthView& view) {
  Steps steps;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + 1; k < last; ++k) {
      steps.length.push_back(view.log->t[k] - view.log->t[k - 1]);
      steps.row.push_back(k);
    }
  }
  return steps;
}

// The largest decimal quantum of which all steps are multiples; 0 where there is none.
double decimal_quantum(const std::vector<double>& steps, double median) {
  for (double decade = std::pow(10.0, std::floor(std::log10(median))); decade > 1e-7; decade /= 10.0) {
    for (const double q : {5.0 * decade, 2.0 * decade, decade}) {
      if (q <= median * 1.0001 &&
          std::ranges::all_of(steps, [&](double h) { return std::abs(h / q - std::round(h / q)) < 1e-3; })) {
        return q;
      }
    }
  }
  return 0.0;
}

std::string time_unit(double step) {
  for (const auto& [factor, unit] : {std::pair{1e-3, "ms"}, std::pair{1e-6, "µs"}, std::pair{1e-9, "ns"}}) {
    if (step * factor >= 2e-4 && step * factor < 0.3) {
      return unit;
    }
  }
  return {};
}

void check_rate(const HealthView& view, double seconds, std::vector<LogFinding>& out) {
  const double rate = view.step > 0.0 ? 1.0 / view.step : 0.0;
  const std::string unit = view.step >= 1.0 ? time_unit(view.step) : "";
  if (!unit.empty()) {
    out.push_back(
        about_time("units.time", FindingSeverity::fatal,
                   fmt::format("The median step is {:.4g} s: the time stamps look like {}, not s.", view.step, unit),
                   "Convert the column t to seconds.", view.step, "s"));
    out.back().topic = FindingTopic::units;
    return;
  }
  const FindingSeverity severity = rate < 10.0   ? FindingSeverity::warning
                                   : rate < 40.0 ? FindingSeverity::notice
                                                 : FindingSeverity::fine;
  out.push_back(about_time("time.rate", severity,
                           fmt::format("{} rows at {:.4g} Hz: {:.4g} s of driving in {} segment{}.", view.log->rows(),
                                       rate, seconds, view.segments.size(), view.segments.size() == 1 ? "" : "s"),
                           severity == FindingSeverity::fine
                               ? ""
                               : "Log at 50 Hz or more: what happens between two rows must be interpolated, and that "
                                 "widens every bound.",
                           rate, "Hz"));
}

void check_length(const HealthView& view, double seconds, std::vector<LogFinding>& out) {
  const std::size_t rows = view.log->rows();
  if (rows < 50) {
    out.push_back(about_time("time.length", FindingSeverity::fatal,
                             fmt::format("{} rows are left: nothing can be fitted to fewer than 50.", rows),
                             "Record a minute of driving.", seconds, "s"));
  } else if (seconds < 30.0) {
    out.push_back(about_time("time.length", seconds < 10.0 ? FindingSeverity::warning : FindingSeverity::notice,
                             fmt::format("{:.3g} s of driving is little to learn from and to hold some of it back for "
                                         "validation.",
                                         seconds),
                             "Drive for a minute or more, or give several logs together.", seconds, "s"));
  }
}

void check_segments(const HealthView& view, double seconds, std::vector<LogFinding>& out) {
  const std::vector<double>& t = view.log->t;
  LogFinding gaps = about_time("time.gaps", FindingSeverity::notice, "", "", 0.0, "s");
  std::size_t resets = 0;
  double lost = 0.0;
  for (std::size_t s = 1; s < view.segments.size(); ++s) {
    const double before = t[view.segments[s].first - 1], after = t[view.segments[s].first];
    if (after <= before) {
      ++resets;
      continue;
    }
    lost += after - before;
    if (++gaps.stretches <= kMostStretches) {
      gaps.when.push_back({before, after});
    }
  }
  if (gaps.stretches > 0) {
    const double mean = seconds / static_cast<double>(view.segments.size());
    const double share = lost / (lost + seconds);
    gaps.value = lost;
    gaps.severity = share > 0.1 || mean < 5.0 ? FindingSeverity::warning : FindingSeverity::notice;
    gaps.sentence = fmt::format(
        "{} gap{} of together {:.3g} s ({:.2g} % of the time); segments last {:.3g} s on "
        "average.",
        gaps.stretches, gaps.stretches == 1 ? "" : "s", lost, 100.0 * share, mean);
    gaps.next =
        "Nothing is filtered across a gap, and each segment loses its beginning while the filter settles: look "
        "for a recorder that stalls, or for logs cut apart on purpose.";
    out.push_back(gaps);
  }
  if (resets > 0) {
    out.push_back(about_time("time.resets", FindingSeverity::notice,
                             fmt::format("Time goes back {} time{}: several recordings in one log, or a clock that was "
                                         "set.",
                                         resets, resets == 1 ? "" : "s"),
                             "Fine where recordings were joined; otherwise stamp with a monotonic clock.",
                             static_cast<double>(resets), "1"));
  }
}

void check_reader(const ReaderCounts& reader, std::vector<LogFinding>& out) {
  const double read = static_cast<double>(std::max<std::size_t>(reader.rows_read, 1));
  const auto tell = [&](const char* id, std::size_t count, const char* what, const char* next) {
    if (count > 0) {
      const double share = static_cast<double>(count) / read;
      out.push_back(about_time(id, share > 0.01 ? FindingSeverity::warning : FindingSeverity::notice,
                               fmt::format("{} of {} rows were dropped: {}.", count, reader.rows_read, what), next,
                               share, "1"));
    }
  };
  tell(
      "time.incomplete_rows", reader.incomplete, "a field that is used is empty, NaN or infinite",
      "See which sensor leaves fields empty; topics of different rates have to be brought together first (`convert`).");
  tell("time.duplicates", reader.duplicates, "the same time as the row before",
       "Log more decimals of time, and each message once.");
  tell("time.cut_off", reader.truncated, "the last line is cut off", "The recorder was stopped while it wrote.");
}

void check_steps(const HealthView& view, std::vector<LogFinding>& out) {
  const Steps steps = steps_of(view);
  if (steps.length.size() < 10) {
    return;
  }
  const double median = view.step;
  std::vector<bool> late(view.log->rows(), false);
  std::size_t missing = 0;
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (std::size_t i = 0; i < steps.length.size(); ++i) {
    if (steps.length[i] > kMissing * median) {
      late[steps.row[i]] = late[steps.row[i] - 1] = true;
      missing += static_cast<std::size_t>(std::max(1.0, std::round(steps.length[i] / median) - 1.0));
    } else {
      sum += steps.length[i];
      squares += (steps.length[i] - median) * (steps.length[i] - median);
      n += 1.0;
    }
  }
  const double jitter = n > 0.0 ? std::sqrt(std::max(0.0, squares / n)) / median : 0.0;
  if (missing > 0) {
    const double share = static_cast<double>(missing) / static_cast<double>(view.log->rows() + missing);
    LogFinding f = about_time("time.missing_samples", graded(share, 0.0, 0.01),
                              fmt::format("About {} samples are missing between rows ({:.2g} %): steps longer than "
                                          "{:.3g} s.",
                                          missing, 100.0 * share, kMissing * median),
                              "What happens in long steps is interpolated; look for a bus or a recorder that drops "
                              "messages.",
                              share, "1");
    set_stretches(f, view, late, 5.0 * median);
    out.push_back(f);
  }
  const double quantum = decimal_quantum(steps.length, median);
  const bool coarse = quantum > 0.05 * median && jitter > 0.01;
  if (coarse) {
    out.push_back(about_time("time.coarse_stamps", graded(quantum / median, 0.0, 0.3),
                             fmt::format("Time stamps are whole multiples of {:.3g} s, {:.0f} % of a step: steps "
                                         "scatter by {:.2g} %.",
                                         quantum, 100.0 * quantum / median, 100.0 * jitter),
                             "Log time with more decimals: an error in time counts like speed times that error.",
                             quantum, "s"));
  }
  const FindingSeverity severity = coarse ? FindingSeverity::fine : graded(jitter, 0.05, 0.2);
  out.push_back(
      about_time("time.jitter", severity,
                 fmt::format("Steps scatter by {:.2g} % (standard deviation) about {:.4g} s.", 100.0 * jitter, median),
                 severity == FindingSeverity::fine
                     ? ""
                     : "Stamp where the sample is taken, not where the message arrives; steps of different "
                       "length are filtered exactly, but wrong stamps are not known to be wrong.",
                 jitter, "1"));
}

}  // namespace

void check_time(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings) {
  double seconds = 0.0;
  for (const auto& [first, last] : view.segments) {
    seconds += last > first ? view.log->t[last - 1] - view.log->t[first] : 0.0;
  }
  check_rate(view, seconds, findings);
  check_length(view, seconds, findings);
  check_segments(view, seconds, findings);
  check_reader(reader, findings);
  check_steps(view, findings);
}

}  // namespace wheelwright::doctor
