// SPDX-License-Identifier: Apache-2.0
/// \file
/// Writes recordings that rosbag2, Foxglove and PlotJuggler read: messages of ROS 2 as bytes (CDR, little endian,
/// behind its 4 bytes, by Fast-CDR), and bags of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs {

/// std_msgs/msg/Header.
struct RosHeader {
  std::int64_t stamp = 0;  ///< ns, from 0 to 2^31 s
  std::string frame_id;
};

/// sensor_msgs/msg/JointState. Lists other than `name` may be empty.
struct RosJointState {
  static constexpr const char* type = "sensor_msgs/msg/JointState";
  RosHeader header;
  std::vector<std::string> name;
  std::vector<double> position;  ///< rad or m
  std::vector<double> velocity;  ///< rad/s or m/s
  std::vector<double> effort;    ///< N m or N
};

/// geometry_msgs/msg/Pose: x, y, z in m, and a unit quaternion x, y, z, w.
struct RosPose {
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0.0, 0.0, 0.0, 1.0};
};

/// geometry_msgs/msg/Twist: x, y, z in m/s and in rad/s.
struct RosTwist {
  static constexpr const char* type = "geometry_msgs/msg/Twist";
  std::array<double, 3> linear{};
  std::array<double, 3> angular{};
};

/// geometry_msgs/msg/PoseStamped.
struct RosPoseStamped {
  static constexpr const char* type = "geometry_msgs/msg/PoseStamped";
  RosHeader header;
  RosPose pose;
};

/// geometry_msgs/msg/TwistStamped.
struct RosTwistStamped {
  static constexpr const char* type = "geometry_msgs/msg/TwistStamped";
  RosHeader header;
  RosTwist twist;
};

/// nav_msgs/msg/Odometry. Covariances are 6 x 6 in rows, over x, y, z and the rotations about them.
struct RosOdometry {
  static constexpr const char* type = "nav_msgs/msg/Odometry";
  RosHeader header;
  std::string child_frame_id;
  RosPose pose;
  std::array<double, 36> pose_covariance{};
  RosTwist twist;  ///< in the child frame
  std::array<double, 36> twist_covariance{};
};

/// sensor_msgs/msg/Imu. Covariances are 3 x 3 in rows; one that begins with -1 says that its quantity is not measured.
struct RosImu {
  static constexpr const char* type = "sensor_msgs/msg/Imu";
  RosHeader header;
  std::array<double, 4> orientation{0.0, 0.0, 0.0, 1.0};
  std::array<double, 9> orientation_covariance{-1.0};
  std::array<double, 3> angular_velocity{};  ///< rad/s
  std::array<double, 9> angular_velocity_covariance{};
  std::array<double, 3> linear_acceleration{};  ///< m/s²
  std::array<double, 9> linear_acceleration_covariance{};
};

/// A row of a table: a header and float64 fields that columns_definition() names.
struct RosColumns {
  static constexpr const char* type = "wheelwright_msgs/msg/Columns";
  RosHeader header;
  std::vector<double> values;
};

/// The definition of a RosColumns with fields of these names, to be kept in the recording. Throws InvalidArgument
/// unless they are names that ROS accepts (ros_field_name), each once, and none is "header".
[[nodiscard]] std::string columns_definition(const std::vector<std::string>& names);

/// `name` as ROS accepts it for a field: lower-case letters, digits and single '_', a letter first and no '_' last.
/// Any other character becomes '_'; "column_" is put in front where no letter is first.
[[nodiscard]] std::string ros_field_name(std::string_view name);

/// Puts messages into bytes, one after the other with the same memory.
class RosEncoder {
 public:
  RosEncoder();
  ~RosEncoder();
  RosEncoder(RosEncoder&&) noexcept;
  RosEncoder& operator=(RosEncoder&&) noexcept;

  /// The message in CDR, until the next call. Throws InvalidArgument when its stamp is negative or beyond 2^31 s.
  std::string_view encode(const RosJointState& message);
  std::string_view encode(const RosPoseStamped& message);
  std::string_view encode(const RosTwist& message);
  std::string_view encode(const RosTwistStamped& message);
  std::string_view encode(const RosOdometry& message);
  std::string_view encode(const RosImu& message);
  std::string_view encode(const RosColumns& message);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Options for writing a recording.
struct BagWriterOptions {
  McapCompression compression = McapCompression::zstd;  ///< of an MCAP file; a database is not packed
  bool sqlite = false;  ///< whether a directory gets a database rather than an MCAP file
};

/// A writer of one recording, which appears whole at commit() or not at all.
class BagWriter {
 public:
  /// Begins a recording at `path`: an MCAP file (profile "ros2") or a database of rosbag2 by its ending, .mcap or .db3;
  /// otherwise a directory that is not there yet, with one such file and a metadata.yaml. Throws InputError, naming it,
  /// when it cannot be written, and when the directory is there and is not empty.
  explicit BagWriter(const std::filesystem::path& path, BagWriterOptions options = {});
  ~BagWriter();
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;

  /// Adds a topic and returns its number (0, 1, …). `type` is "pkg/msg/Type", `definition` its text
  /// (ros_definition_text), which is kept in the recording. Throws InvalidArgument from the 65 536th on.
  std::size_t add_topic(const std::string& name, const std::string& type, const std::string& definition);
  /// Appends a message in CDR; `log_time` in ns, >= 0. Throws InvalidArgument unless the topic has been added and the
  /// time is not negative; InputError when the disk is full.
  void write(std::size_t topic, std::int64_t log_time, std::string_view cdr);
  /// Puts the recording in its place. To be called once, last. Throws InputError when that fails.
  void commit();

  /// What writes one file.
  class Sink;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::logs
