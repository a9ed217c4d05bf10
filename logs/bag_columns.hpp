// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which fields of which topics of a bag are the columns of a log.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/logs/bag.hpp>
#include <wheelwright/logs/csv_header.hpp>

namespace wheelwright {

/// One column of a log and where a message has it.
struct BagColumn {
  std::string name;                 ///< of the contract
  std::vector<std::string> fields;  ///< paths for RosExtractor: one, or the quaternion x, y, z, w that it is the yaw of
  [[nodiscard]] bool is_yaw() const { return fields.size() == 4; }
  bool operator==(const BagColumn&) const = default;
};

/// What is read from one topic.
struct BagSource {
  std::size_t topic = 0;  ///< index in BagReader::topics()
  std::vector<BagColumn> columns;
};

/// The columns of a bag.
struct BagChoice {
  std::vector<BagSource> sources;   ///< the first gives the rows their times; empty where nothing is known
  std::vector<std::string> header;  ///< all numeric fields there are, "topic.path"
  std::vector<std::string> notes;   ///< what was taken or left although one might have thought otherwise
};

/// A topic and, of a type that names its elements (JointState), the names in its first message.
struct BagTopicView {
  const BagTopic* topic = nullptr;
  bool silent = false;  ///< has no messages: nothing is taken from it unasked
  std::vector<std::string> names;
  std::vector<std::string> filled;  ///< arrays beside `names` that had elements in that message
};

/// Chooses columns. What `options.map` says goes first: NAME=TOPIC.PATH, e.g.
/// omega_r=/joint_states.velocity[right_wheel], the PATH as RosExtractor takes it, or ending in `.yaw` behind a
/// quaternion. Else:
/// - sensor_msgs/JointState: the joints that alone are named right and left (of those named wheel, where there are any)
///   give phi, omega and tau; a topic with one joint gives position, velocity and effort;
/// - geometry_msgs/PoseStamped and PoseWithCovarianceStamped, else nav_msgs/Odometry, give x, y and theta; an Odometry
///   topic whose name says that it comes from the wheels is left out, since that is no independent measurement;
/// - sensor_msgs/Imu gives gyro_z and accel_x;
/// - types of other packages than ROS's own give the columns that fields of theirs are named after.
/// Where two topics could give a column it is left out and said. The rows' times are those of the topic with the efforts.
/// Throws InputError for entries of the map that name no topic, and as RosExtractor for their fields.
[[nodiscard]] BagChoice choose_bag_columns(const std::vector<BagTopicView>& topics, const CsvOptions& options,
                                           const std::string& path);

/// The sides that `name` of a joint tells: "r", "l" or nothing.
[[nodiscard]] std::string side_of_joint(const std::string& name);

}  // namespace wheelwright
