// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a log lacks, before anything is fitted for good: time stamps, signals, motion, units; and whether to commission.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// How much a finding matters, the least first.
enum class FindingSeverity {
  fine,     ///< as it should be
  notice,   ///< worth knowing; results stay what they claim to be
  warning,  ///< results will be worse, or about less, than they could be
  fatal,    ///< nothing that is made of the log as it stands is of use, or commissioning refuses it
};

/// Name for people and files: "fine", "notice", "warning", "fatal".
[[nodiscard]] std::string_view to_string(FindingSeverity severity);

/// What a finding is about.
enum class FindingTopic { time, signals, motion, units };

/// Name for people and files: "time", "signals", "motion", "units".
[[nodiscard]] std::string_view to_string(FindingTopic topic);

/// One finding.
struct LogFinding {
  std::string id{};  ///< e.g. "time.jitter", "signals.saturation": docs/doctor.md lists them
  FindingTopic topic = FindingTopic::time;
  FindingSeverity severity = FindingSeverity::fine;
  std::string sentence{};                                   ///< what was found, with its numbers
  std::string next{};                                       ///< what to do about it; empty where nothing is to be done
  std::vector<std::string> columns{};                       ///< of the log that it is about; empty: the log as a whole
  double value = std::numeric_limits<double>::quiet_NaN();  ///< the number behind it, NaN where there is none
  std::string unit{};                                       ///< of value, "1" for a share or a ratio
  std::vector<Interval> when{};  ///< stretches of the log, s of log time: the first kMostStretches
  std::size_t stretches = 0;     ///< how many there are altogether; 0: everywhere, or nowhere in particular
};

/// Stretches that a finding lists at most.
inline constexpr std::size_t kMostStretches = 20;

/// What is to be said of the log as a whole.
enum class LogVerdict {
  commission,     ///< it can be commissioned
  identify_only,  ///< wheels and pose without efforts: `identify` finds the kinematics, nothing can be commissioned
  unusable,       ///< neither, as it stands
};

/// Name for people and files: "commission", "identify_only", "unusable".
[[nodiscard]] std::string_view to_string(LogVerdict verdict);

/// What the reader of a log met and repaired. All zero where a log needed no reading.
struct ReaderCounts {
  std::size_t rows_read = 0;   ///< rows met, those dropped included; 0: not known
  std::size_t incomplete = 0;  ///< rows dropped: a field that is needed is empty or not finite
  std::size_t duplicates = 0;  ///< rows dropped: the time of the row before
  std::size_t truncated = 0;   ///< last lines cut off
  std::size_t unwrapped = 0;   ///< jumps of a wheel angle by a turn that were undone
};

/// The examination.
struct LogHealth {
  LogVerdict verdict = LogVerdict::unusable;
  std::string sentence;              ///< the verdict in words
  std::vector<LogFinding> findings;  ///< the gravest first; among equals in the order time, signals, motion, units
  std::size_t rows = 0;              ///< that were looked at
  std::size_t segments = 0;
  double seconds = 0.0;      ///< of driving, gaps left out
  double median_step = 0.0;  ///< s
  std::string assumed;       ///< what was taken for granted where no robot was given, in words; else empty

  /// Number of findings of this severity.
  [[nodiscard]] std::size_t count(FindingSeverity severity) const;
  /// The first finding called `id`; nullptr where there is none.
  [[nodiscard]] const LogFinding* find(std::string_view id) const;
};

/// Looks at `log`, which must hold what a LogSource promises (finite, increasing inside a segment). `robot` (nothing:
/// a differential drive or a single axis, by the columns) tells columns, geometry, limits and the model whose excitation
/// is judged; without it, scales of units cannot be judged against radius, track and mass.
///
/// What each check does, and its thresholds, is in docs/doctor.md. Excitation is that of the filtered regressor (25) as
/// commission() makes it: settle(), fit_log() and identifiability(); the delay between effort and motion is that of
/// TimeShiftedRows with its standard error. Throws nothing for what a log may hold; InvalidArgument for a robot that
/// makes no sense or a log whose columns differ in length.
[[nodiscard]] LogHealth examine(const LogTable& log, const std::optional<Robot>& robot = std::nullopt,
                                const ReaderCounts& reader = {});

}  // namespace wheelwright
