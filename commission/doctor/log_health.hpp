// SPDX-License-Identifier: Apache-2.0
/// \file
/// Checks of a log before any fit: time stamps, signals, motion, units.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/interval.hpp"
#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {
struct EffortTiming;
struct Fit;
struct Setting;
}  // namespace wheelwright::commission

namespace wheelwright::doctor {

/// Severity of a finding, the least first.
enum class FindingSeverity {
  fine,     ///< as it should be
  notice,   ///< worth knowing; results stay what they claim to be
  warning,  ///< results will be worse, or about less, than they could be
  fatal,    ///< nothing that is made of the log as it stands is of use, or commissioning refuses it
};

/// Name for people and files: "fine", "notice", "warning", "fatal".
[[nodiscard]] std::string_view to_string(FindingSeverity severity);

/// Topic of a finding.
enum class FindingTopic { time, signals, motion, units };

/// Name for people and files: "time", "signals", "motion", "units".
[[nodiscard]] std::string_view to_string(FindingTopic topic);

/// One finding.
struct LogFinding {
  std::string id{};  ///< e.g. "time.jitter", "signals.saturation": docs/use/doctor.md lists them
  FindingTopic topic = FindingTopic::time;
  FindingSeverity severity = FindingSeverity::fine;
  std::string sentence{};                                   ///< what was found, with its numbers
  std::string next{};                                       ///< what to do about it; empty where nothing is to be done
  std::vector<std::string> columns{};                       ///< of the log that it is about; empty: the log as a whole
  double value = std::numeric_limits<double>::quiet_NaN();  ///< the number behind it, NaN where there is none
  std::string unit{};                                       ///< of value, "1" for a share or a ratio
  std::optional<Interval> taken{};  ///< what commands take value to lie in, where the robot file declares nothing
  std::vector<Interval> when{};     ///< stretches of the log, s of log time: the first kMostStretches
  std::size_t stretches = 0;        ///< how many there are altogether; 0: everywhere, or nowhere in particular
  bool refuses = false;  ///< a fatal one: no command makes a model of the log, as for every fatal one of units

  bool hides = false;  ///< no command reads its columns, and the rest was examined without them
  std::optional<model::SpeedFilter> speed_filter{};  ///< with which every command reads the log
  std::optional<model::SpeedCut> speed_cut{};        ///< likewise
  std::optional<Interval> effort_smoothing{};        ///< likewise, s: Robot::effort_smoothing

  /// True if commands that make something of a log refuse it for this (results/sound_log.hpp).
  [[nodiscard]] bool is_refusal() const {
    return severity == FindingSeverity::fatal && (refuses || topic == FindingTopic::units);
  }
};

/// Stretches that a finding lists at most.
inline constexpr std::size_t kMostStretches = 20;

/// Verdict on the log as a whole.
enum class LogVerdict {
  commission,     ///< it can be commissioned
  identify_only,  ///< wheels and pose without efforts: `identify` finds the kinematics, nothing can be commissioned
  unusable,       ///< neither, as it stands
};

/// Name for people and files: "commission", "identify_only", "unusable".
[[nodiscard]] std::string_view to_string(LogVerdict verdict);

/// Defects that the reader of a log found and repaired. All zero where a log needed no reading.
struct ReaderCounts {
  std::size_t rows_read = 0;                     ///< rows met, those dropped included; 0: not known
  std::size_t incomplete = 0;                    ///< rows dropped: a field that is needed is empty or not finite
  std::size_t duplicates = 0;                    ///< rows dropped: the time of the row before
  std::size_t truncated = 0;                     ///< last lines cut off
  std::size_t leaps = 0;                         ///< rows left out: a value leaps away and back
  std::string first_leap = {};                   ///< where the first of them is
  std::size_t jumps = 0;                         ///< segments that begin where a wheel angle jumps as no wheel turns
  std::size_t unwrapped = 0;                     ///< jumps of a wheel angle by a turn that were undone
  std::vector<std::string> contradictions = {};  ///< why the joints are those of no differential drive, in sentences
  std::string time_remedy = {};  ///< the argument that makes s of the times where they look like another unit
};

/// The examination.
struct LogHealth {
  LogVerdict verdict = LogVerdict::unusable;
  std::string sentence;              ///< the verdict in words
  std::vector<LogFinding> findings;  ///< the gravest first; among equals in the order time, signals, motion, units
  std::size_t rows = 0;              ///< that were looked at
  std::size_t segments = 0;
  double seconds = 0.0;            ///< of driving, gaps left out
  double median_step = 0.0;        ///< s
  std::optional<EvenClock> clock;  ///< of even samples behind scattered stamps, by which the log was looked at
  std::string assumed;             ///< what was taken for granted where no robot was given, in words; else empty

  /// Number of findings of this severity.
  [[nodiscard]] std::size_t count(FindingSeverity severity) const;
  /// The first finding called `id`; nullptr where there is none.
  [[nodiscard]] const LogFinding* find(std::string_view id) const;
};

/// Looks at `log`, which must hold what a LogSource promises (finite, increasing inside a segment). `robot` (nothing:
/// a differential drive or a single axis, by the columns) tells columns, geometry, limits and the model whose
/// excitation is judged; without it, scales of units cannot be judged against radius, track and mass.
///
/// Where stamps scatter about an even clock and the motion shows that the samples do not, everything is looked at by
/// that clock (LogHealth::clock). The checks and their thresholds are in docs/use/doctor.md. Excitation is that of the
/// filtered regressor (25) as commission_robot() makes it: settle(), fit_log() and identifiability(); the delay between
/// effort and motion is that of TimeShiftedRows with its standard error. Throws nothing for what a log may hold;
/// InvalidArgument for a robot that makes no sense, a log whose columns differ in length, or segments that do not
/// ascend over its rows. The result does not depend on `threads`.
[[nodiscard]] LogHealth examine(const LogTable& log, const std::optional<Robot>& robot = std::nullopt,
                                const ReaderCounts& reader = {}, std::size_t threads = 1);

/// One joint as a log has it.
struct JointView {
  std::string angle_name, speed_name, effort_name;  ///< of the robot's columns
  const std::vector<double>* angle = nullptr;       ///< nullptr where the log has no such column
  const std::vector<double>* speed = nullptr;       ///< likewise
  const std::vector<double>* effort = nullptr;      ///< likewise, of the robot's kind of effort
  std::vector<double> smooth;  ///< speed over ten steps, rad/s or m/s: of angles where there are any, else of speeds
  double top = 0.0;            ///< 99 % quantile of |smooth|

  /// True if the log has the joint's motion.
  [[nodiscard]] bool has_motion() const { return angle != nullptr || speed != nullptr; }
  /// Name of the motion column that is used: the angle's where there is one.
  [[nodiscard]] const std::string& motion_name() const { return angle != nullptr ? angle_name : speed_name; }
};

/// A log, what robot it is taken for, and how it moves.
struct HealthView {
  const LogTable* log = nullptr;
  Robot robot;  ///< the user's, or one that stands in for it
  bool robot_given = false;
  Model model;
  double step = 0.0;                                          ///< median step, s
  std::vector<std::pair<std::size_t, std::size_t>> segments;  ///< rows [first, last)
  std::vector<JointView> joints;
  std::vector<bool> moving;  ///< per row: a joint is faster than a twentieth of its top speed

  /// Whether a column `name` is there.
  [[nodiscard]] const std::vector<double>* column(const std::string& name) const;
  /// True if all joints have their motion in one kind of column.
  [[nodiscard]] bool has_motion() const;
  /// True if all joints have an effort.
  [[nodiscard]] bool has_effort() const;
  /// True if the effort of `joint` is hardly ever negative although the joint moves backwards too.
  [[nodiscard]] bool one_sided(const JointView& joint) const;
};

/// The view of `log`, which must outlive it. Throws as examine().
[[nodiscard]] HealthView make_view(const LogTable& log, const std::optional<Robot>& robot);

/// The arguments that multiply those of these columns that the log in `view` has: `--map omega_r="*0.10472" …`.
[[nodiscard]] std::string scaling_arguments(const HealthView& view, const std::vector<std::string>& columns,
                                            double factor);
/// Names of all columns of the joints' motion.
[[nodiscard]] std::vector<std::string> motion_columns(const HealthView& view);

/// What is left of a log that is read as another robot file says.
struct OtherReading {
  bool explained = true;  ///< declared errors leave parameters; true where none are declared
  bool in_time = true;    ///< the efforts are not late or early by more than that file allows
};
/// Reads `log` as `robot` says. Costs a fit, and a feasible set where errors are declared.
[[nodiscard]] OtherReading read_as(LogSource& log, const Robot& robot);

/// Puts the stretches of rows that `flagged` marks into `finding`; marks less than `join` s apart are one stretch.
void set_stretches(LogFinding& finding, const HealthView& view, const std::vector<bool>& flagged, double join);

/// Rows that come in bursts; stamps that scatter about an even clock. Returns that clock where motion shows that the
/// samples are even, and the robot does not say how the log is to be read.
[[nodiscard]] std::optional<EvenClock> check_clock(const HealthView& view, std::vector<LogFinding>& findings);
/// Rates, jitter, what is missing between rows, stamps that are too coarse, length.
void check_time(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Columns that stand still, repeat, are coarse or noisy, or end at a limit; rest.
void check_signals(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Directions, speeds, accelerations; what the filtered regressor says of each parameter; effort against motion in
/// time. Returns whether commissioning would get as far as bounds.
bool check_motion(const HealthView& view, std::vector<LogFinding>& findings);
/// Lag of the gyro behind the yaw rate that the wheels show, and how it drifts from the first to the last third of the
/// log.
void check_gyro_delay(const HealthView& view, std::vector<LogFinding>& findings);
/// Speeds and angles without a direction of their own: at reversals they jump, or bounce off zero. Returns whether any
/// was found: nothing can be fitted to them.
bool check_direction(const HealthView& view, std::vector<LogFinding>& findings);
/// Speeds in whole multiples of a unit that no encoder makes, rounded or cut off.
void check_rounding(const HealthView& view, std::vector<LogFinding>& findings);
/// Up to three rows in which a column leaps away and back: those that the reader left out, and those that are there.
void check_spikes(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Effort against motion in time, where a shift explains the log better than none, or declared errors explain nothing
/// without one: what commands take late or smoothed efforts for, and what commissioning refuses.
void check_delay(const HealthView& view, LogSource& log, const commission::Setting& setting, const commission::Fit& fit,
                 std::vector<LogFinding>& findings);
/// Efforts that are early by `timing` because speeds passed through a low-pass filter, in this setting with its fit.
/// `refused`: commissioning makes no model of them as they are. Returns whether that, or that it cannot be told from a
/// delay, was said.
bool check_smoothing(const HealthView& view, LogSource& log, const commission::Setting& setting,
                     const commission::Fit& fit, const commission::EffortTiming& timing, bool refused,
                     std::vector<LogFinding>& findings);
/// Rows of a second source among those of a first.
void check_sources(const HealthView& view, std::vector<LogFinding>& findings);
/// Whether the log is that of a differential drive: joints as the reader met them, turning by gyro or pose against the
/// wheels' difference and the efforts', displacement against the heading.
void check_drive(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Angle from the heading to the direction in which the wheels drive, rad, where these differ: commands add it.
std::optional<double> check_heading(const HealthView& view, std::vector<LogFinding>& findings);
/// Wheel angles against speeds, wheels against pose and gyro: scales, signs, sides.
void check_odometry(const HealthView& view, std::vector<LogFinding>& findings);

/// The unit that a column which is `ratio` times too large is probably in: "deg/s" for 57.3; empty where none fits to a
/// tenth. `rates`: the quantity is an angular speed.
[[nodiscard]] std::string unit_for_ratio(double ratio, bool rates);

}  // namespace wheelwright::doctor
