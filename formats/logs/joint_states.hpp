// SPDX-License-Identifier: Apache-2.0
/// \file
/// sensor_msgs/JointState as it lies in a recording: who publishes it, how long its arrays are, how its joints move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {

/// Arrays of a JointState beside its names.
inline constexpr std::array<const char*, 3> joint_arrays = {"position", "velocity", "effort"};

/// One message.
struct JointMessage {
  std::int64_t stamp = 0;  ///< ns
  std::string frame;
  std::vector<std::string> names;
  std::array<std::vector<double>, 3> numbers;  ///< in the order of joint_arrays

  /// Which arrays have numbers.
  [[nodiscard]] std::array<bool, 3> filled() const;
};

/// True if `definition` is that of ROS, which read_joint_message() reads.
[[nodiscard]] bool is_joint_state(const RosDefinition& definition);

/// Reads a message into `message`, whose storage is used again; false where the bytes are no JointState.
[[nodiscard]] bool read_joint_message(std::string_view cdr, JointMessage& message);

/// Messages of a topic that have one frame, one list of names, and numbers in the same arrays: as far as they tell,
/// those of one publisher.
struct JointPublisher {
  std::string frame;
  std::vector<std::string> names;
  std::array<bool, 3> filled{};
  std::vector<std::size_t> order;               ///< of its messages among those of the topic, from 0
  std::vector<double> times;                    ///< s, of each
  std::vector<std::vector<double>> series;      ///< of array a and joint j at [a · names + j]; NaN where it has none
  std::array<std::size_t, 3> uneven{};          ///< messages whose array is neither empty nor as long as the names
  std::array<std::size_t, 3> uneven_length{};   ///< of the first such array
  std::array<std::size_t, 3> uneven_message{};  ///< its message, counted from 1 in the topic

  /// Numbers of `joint` in array `array`; nullptr where it is not one of its joints.
  [[nodiscard]] const std::vector<double>* numbers(std::size_t array, const std::string& joint) const;
};

/// Motion of a joint in these messages.
struct JointMotion {
  bool angle_moves = false, speed_moves = false, effort_varies = false;
  bool has_effort = false;  ///< a number that is not NaN
  double quantum = 0.0;     ///< smallest step of angles that move, rad
  double travel = 0.0;      ///< between its extreme angles, rad: of positions that move, else of the integral of speeds
  std::vector<double> turned;  ///< in each stretch of half a second, rad
};

/// The first messages of a topic.
struct JointSurvey {
  std::vector<JointPublisher> publishers;
  std::size_t messages = 0;
  std::size_t unnamed = 0;                       ///< messages with numbers and without names
  std::array<std::size_t, 3> unnamed_lengths{};  ///< of the first of these

  /// Adds a message of time `time` s.
  void add(const JointMessage& message, double time);
  /// The publisher with most messages among those that name all of `joints`; nullptr where there is none.
  [[nodiscard]] const JointPublisher* publisher_of(const std::vector<std::string>& joints) const;
};

/// Motion of `joint` as `publisher` has it.
[[nodiscard]] JointMotion motion_of(const JointPublisher& publisher, const std::string& joint);

/// Joints that turn as one: the root mean square of their differences over stretches of half a second, over that of
/// their mean motion, beyond what a count of their encoders makes of it; 0 where they turn by less than half a turn.
[[nodiscard]] double apart_in_motion(const JointMotion& a, const JointMotion& b);

/// Whether two joints of one message have the same numbers to the last digit, motion and, where both have one, effort.
[[nodiscard]] bool is_copy(const JointPublisher& publisher, const std::string& a, const std::string& b);

/// Messages that are left out: of another publisher, or of one constant content.
struct JointExclusion {
  std::string frame;
  std::vector<std::string> names;
  std::array<bool, 3> filled{};
  std::optional<std::array<std::vector<double>, 3>> numbers{};  ///< nothing: all of that publisher

  /// Whether `message` is one of them.
  [[nodiscard]] bool holds(const JointMessage& message) const;
};

/// Array and joints of "velocity[right_wheel]" or "velocity[front,rear]", a column's place that names no topic; nothing
/// for other texts.
[[nodiscard]] std::optional<std::pair<std::string, std::vector<std::string>>> joint_place(std::string_view text);

/// "velocity[front,rear]" of an array and joints.
[[nodiscard]] std::string joint_place_text(std::string_view array, const std::vector<std::string>& joints);

}  // namespace wheelwright::logs
