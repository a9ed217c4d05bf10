// SPDX-License-Identifier: Apache-2.0
/// \file
/// The torque residual of a robot on two sides of wheels, watched message by message. Plain C++ on the library;
/// node.hpp connects it to ROS 2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/detector/online_model.hpp>

namespace wheelwright_diagnostics {

/// Joints of the two sides by their names in the messages. Of several a side the mean of the motion and the sum of the
/// efforts are taken.
struct Sides {
  std::vector<std::string> right;
  std::vector<std::string> left;
};

/// Options of a Monitor.
struct MonitorOptions {
  double clear_after = 10.0;  ///< s of decided driving without an alarm after which an alarm no longer stands, >= 0
  double patience = 5.0;      ///< s without a message that are silence, >= 0; 20 rows of the model where that is longer
};

/// A message of joint states. The arrays have one value for each name, or none.
struct JointMessage {
  std::int64_t stamp = 0;  ///< ns
  std::span<const std::string> names{};
  std::span<const double> position{};  ///< rad
  std::span<const double> velocity{};  ///< rad/s
  std::span<const double> effort{};    ///< as the model's efforts: N·m, or A or V
};

/// As diagnostic_msgs/msg/DiagnosticStatus numbers them.
enum class Level : unsigned char {
  ok = 0,     ///< decided, no fault
  warn = 1,   ///< nothing can be decided
  error = 2,  ///< an alarm stands
  stale = 3   ///< no message has come for the patience
};

/// What is known now.
struct Status {
  Level level = Level::warn;
  std::string message;                                      ///< one sentence
  std::vector<std::pair<std::string, std::string>> values;  ///< keys and values
};

/// Feeds a TorqueDetector and tells what it found, with the rules of `wheelwright detect --follow`: a message with a
/// value missing or not finite, or with the stamp of the one before, is left out; a stamp that goes back begins a new
/// segment, as a gap does; being undecided for one and a half times as long as the filter needs to settle, and for 20
/// messages, is blindness. Angles that wrap at a turn are unwrapped. Not for several threads at once.
class Monitor {
 public:
  /// Throws InvalidArgument, naming what was expected, unless `model` drives on a right and a left wheel without a
  /// measured heading, each side has a joint, no joint is named twice, and the options are finite and in range. `now`
  /// (s) is the time of a clock that only grows, as for the other members.
  Monitor(const wheelwright::OnlineModel& model, const Sides& sides, double now, MonitorOptions options = {});

  /// Takes a message that comes at time `now`. Returns whether an instant was decided on. A message that names no joint
  /// of either side is not for this monitor.
  bool take(const JointMessage& message, double now);

  /// The level at time `now`.
  [[nodiscard]] Level level(double now) const;
  /// The level with its reason and the numbers of the last decided instant.
  [[nodiscard]] Status status(double now) const;

 private:
  struct Joint {
    std::string name;
    std::size_t side = 0;
    // For unwrapping.
    double before = 0.0, turns = 0.0, largest_step = 0.0, least = 0.0, most = 0.0;
    std::size_t steps = 0;
  };
  struct Channel {
    double residual = 0.0, lower = 0.0, upper = 0.0, ratio = 0.0;
    bool alarm = false;
  };
  struct Alarm {
    std::int64_t since = 0;  // ns, first instant
    std::int64_t last = 0;   // ns
    std::size_t output = 0;  // these at the first instant
    Channel channel;
    std::size_t instants = 0;
  };
  // Why messages of the present spell brought no row.
  struct Causes {
    std::size_t missing = 0, no_values = 0, not_finite = 0, repeated = 0, backwards = 0, crawling = 0, gaps = 0;
    std::string missing_name, no_values_name, not_finite_name;
  };

  bool read(const JointMessage& message);
  [[nodiscard]] double unwrapped(Joint& joint, double angle, bool restarts) const;
  void decided(const JointMessage& message, const wheelwright::Decision& decision, double step);
  void undecided(std::optional<double> t);
  [[nodiscard]] bool silent(double now) const;
  [[nodiscard]] bool blind() const;
  [[nodiscard]] std::string why_blind() const;

  wheelwright::OnlineModel model_;
  wheelwright::TorqueDetector detector_;
  MonitorOptions options_;
  std::vector<Joint> joints_;
  bool angles_ = false;
  std::vector<std::size_t> place_;      // of each joint in a message, kNowhere where it is not
  std::vector<double> motion_;          // of each joint, in this message
  std::vector<double> sample_;          // right and left motion, right and left effort
  std::optional<std::int64_t> origin_;  // ns, whole second of the first stamp: t = 0
  std::optional<double> t_;             // s, of the last row
  std::optional<std::int64_t> stamp_;   // ns, of it
  double heard_;                        // now, of the last message for us; before one, of construction
  std::optional<double> foreign_;       // now, of the last one that was not
  std::string foreign_names_;

  std::vector<Channel> channels_;
  std::size_t instants_ = 0;  // decided
  std::optional<std::int64_t> decided_at_;
  std::optional<Alarm> alarm_;
  std::size_t alarm_instants_ = 0;  // since the monitor began
  double quiet_ = 0.0;              // s of decided driving since the last alarm
  std::size_t spell_ = 0;           // messages without a decision that came last
  double spell_seconds_ = 0.0;
  std::optional<double> spell_first_;
  Causes causes_;
};

}  // namespace wheelwright_diagnostics
