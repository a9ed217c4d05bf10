// SPDX-License-Identifier: Apache-2.0
/// \file
/// A bag as a file of a log: columns from fields of topics, rows at the times of one topic, other topics brought to
/// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/logs/bag.hpp"
#include "formats/logs/csv_format.hpp"
#include "formats/logs/joint_states.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs {

/// Clock of a topic, from its first messages.
struct TopicTimes {
  std::string topic;
  std::vector<std::int64_t> log_times;              ///< ns, when each was recorded
  std::vector<std::optional<std::int64_t>> stamps;  ///< ns, of its header; nothing where it has none
};

/// The time of a topic's messages: its stamp or the time it was recorded, plus `shift`.
struct TopicClock {
  bool stamped = false;          ///< whether the header's stamp is used: where every message has one
  bool zero_is_time = false;     ///< whether a stamp of zero is one (of a clock that begins there), not a missing one
  std::int64_t shift = 0;        ///< ns, to the clock of the first topic
  std::int64_t median_step = 0;  ///< ns
  std::int64_t jitter = 0;       ///< ns; of a time of recording: 99 % of its steps are as close to the median step
};

/// The clocks of `topics`, of which the first gives the rows their times, and what was decided, in words:
/// - the header's stamp goes before the time of recording; zero counts as a stamp in the first message of a topic whose
///   second stamp is within a minute of it;
/// - stamps of a topic that lie, in the median and against their times of recording, within 1 s of those of the first
///   topic are taken as the same clock; others are shifted by the difference of these medians;
/// - a topic without stamps has its times of recording, shifted by that median of the first topic where it has stamps.
struct BagClocks {
  std::vector<TopicClock> clocks;
  std::vector<std::string> notes;
};
[[nodiscard]] BagClocks bag_clocks(const std::vector<TopicTimes>& topics);

/// One column of a log and where a message has it.
struct BagColumn {
  /// What is made of the fields.
  enum class Rule {
    value,  ///< one field as it is
    yaw,    ///< of the quaternion x, y, z, w
    mean,   ///< of all: motion of the wheels of one side
    sum,    ///< of all: efforts of the wheels of one side
  };
  std::string name;                 ///< of the contract
  std::vector<std::string> fields;  ///< paths for RosExtractor
  Rule rule = Rule::value;
  double factor = 1.0;  ///< of all of it
  [[nodiscard]] bool is_yaw() const { return rule == Rule::yaw; }
  bool operator==(const BagColumn&) const = default;
};

/// Where messages of `type` have their pose: "pose" or "pose.pose"; empty for a type without one.
[[nodiscard]] std::string_view pose_of(std::string_view type);
/// Paths of the x, y, z and w of the quaternion at `orientation`.
[[nodiscard]] std::vector<std::string> quaternion_fields(const std::string& orientation);

/// Columns that are read from one topic.
struct BagSource {
  std::size_t topic = 0;  ///< index in BagReader::topics()
  std::vector<BagColumn> columns;
  std::vector<JointExclusion> without = {};  ///< messages of the topic that are left out
};

/// The columns of a bag.
struct BagChoice {
  std::vector<BagSource> sources;                ///< the first gives the rows their times; empty where nothing is known
  std::vector<std::string> header;               ///< all numeric fields there are, "topic.path"
  std::vector<std::string> notes;                ///< what was taken or left although one might have thought otherwise
  std::vector<std::string> contradictions = {};  ///< LogFileReport::contradictions
};

/// A topic and, of a type that names its elements (JointState), the names in its first messages.
struct BagTopicView {
  const BagTopic* topic = nullptr;
  bool silent = false;  ///< has no messages: nothing is taken from it unasked
  std::vector<std::string> names;
  std::vector<std::string> filled;  ///< arrays beside `names` that had numbers in one of these messages
  /// "effort[left]" and the like that had one; where this is empty any element of a filled array counts as having one
  std::vector<std::string> elements = {};
  /// What the first message says is not measured: "angular_velocity", "linear_acceleration" of an Imu, "orientation" of
  /// a pose.
  std::vector<std::string> unmeasured = {};
  std::string unreadable = {};  ///< why none of the first messages could be read; empty where one could
  JointSurvey joints = {};      ///< of a JointState, what its first messages say of its joints
};

/// Chooses columns. What `options.map` says goes first: NAME=TOPIC.PATH, e.g.
/// omega_r=/joint_states.velocity[right_wheel], the PATH as RosExtractor takes it, or ending in `.yaw` behind a
/// quaternion; *FACTOR behind it multiplies it. Else:
/// - sensor_msgs/JointState: the joints that are named right and left (of those named wheel, where there are any; no
///   casters) give phi, omega and tau; of several wheels a side the mean of the motion and the sum of the efforts,
///   without those that stand still while others turn, have no effort beside others that have one, or repeat another to
///   the last digit; wheels of a side that do not turn as one, and steering joints that move, are contradictions; an
///   angle or speed that stands still beside the other is left out; of two publishers of the same wheels the one whose
///   wheels move, or alone have efforts; a
///   topic with one joint gives position, velocity and effort, too, and its own name may tell the side; where others
///   give columns of right and left wheels, and none is asked for by name, those of an axis are left out and reported,
///   as are joints named neither wheel, motor nor drive; a side of more wheels than the other is left out where a wheel
///   has no side by its name;
/// - geometry_msgs/PoseStamped and PoseWithCovarianceStamped, else nav_msgs/Odometry, give x, y and theta; an Odometry
///   topic whose name says that it comes from the wheels is left out, since that is no independent measurement;
/// - a topic of joints or poses whose name says that they are wished for (goal, target, command) is left out;
/// - sensor_msgs/Imu gives gyro_z and accel_x, but for what it says it does not measure;
/// - types of other packages than ROS's own give the columns that fields of theirs are named after;
/// - a topic whose first messages cannot be read is left out and reported.
/// Where two topics could give a column it is left out and reported. The rows' times are those of the topic with the
/// efforts. Throws InputError for entries of the map that name no topic, and as RosExtractor for their fields; for
/// efforts whose array is not as long as the names, joints that are named twice, and publishers that cannot be told
/// apart, unless the map says which elements are meant. An entry NAME=velocity[JOINT] or NAME=effort[JOINT,JOINT] names
/// no topic: it is that of the JointState that has these joints, and is passed over, and said, where none has them.
[[nodiscard]] BagChoice choose_bag_columns(const std::vector<BagTopicView>& topics, const CsvOptions& options,
                                           const std::string& path);

/// A bag (file or directory) as a file of a log. Columns are those of choose_bag_columns(), clocks those of
/// bag_clocks(), and values of other topics are interpolated as StreamAligner does, over at most 5 of their median
/// steps; rows where that cannot be are dropped and counted. Times that begin later than 10⁸ s (stamps of a wall clock)
/// are counted from the first whole second, since a double does not hold them to the nanosecond;
/// LogFileReport::time_origin has it. Throws InputError as open_bag and choose_bag_columns do, and where no topic has a
/// column that is wanted.
[[nodiscard]] std::unique_ptr<RowFile> bag_file(const std::filesystem::path& path, const LogOptions& options,
                                                const TimeOrigin& origin);

}  // namespace wheelwright::logs
