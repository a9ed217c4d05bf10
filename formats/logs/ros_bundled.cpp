// SPDX-License-Identifier: Apache-2.0
// Field names and types of the usual message types in ROS 2 Humble (rcl_interfaces, common_interfaces, geometry2,
// control_msgs); VelocityStamped is younger.
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {
namespace {

struct Entry {
  std::string_view type;
  std::string_view fields;  ///< separated by ';'
};

constexpr Entry humble[] = {
    {"builtin_interfaces/msg/Time", "int32 sec;uint32 nanosec"},
    {"builtin_interfaces/msg/Duration", "int32 sec;uint32 nanosec"},
    {"rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock"},
    {"std_msgs/msg/Header", "builtin_interfaces/Time stamp;string frame_id"},
    {"std_msgs/msg/Bool", "bool data"},
    {"std_msgs/msg/Byte", "byte data"},
    {"std_msgs/msg/Char", "char data"},
    {"std_msgs/msg/Int8", "int8 data"},
    {"std_msgs/msg/UInt8", "uint8 data"},
    {"std_msgs/msg/Int16", "int16 data"},
    {"std_msgs/msg/UInt16", "uint16 data"},
    {"std_msgs/msg/Int32", "int32 data"},
    {"std_msgs/msg/UInt32", "uint32 data"},
    {"std_msgs/msg/Int64", "int64 data"},
    {"std_msgs/msg/UInt64", "uint64 data"},
    {"std_msgs/msg/Float32", "float32 data"},
    {"std_msgs/msg/Float64", "float64 data"},
    {"std_msgs/msg/String", "string data"},
    {"std_msgs/msg/Empty", ""},
    {"std_msgs/msg/ColorRGBA", "float32 r;float32 g;float32 b;float32 a"},
    {"std_msgs/msg/MultiArrayDimension", "string label;uint32 size;uint32 stride"},
    {"std_msgs/msg/MultiArrayLayout", "MultiArrayDimension[] dim;uint32 data_offset"},
    {"std_msgs/msg/ByteMultiArray", "MultiArrayLayout layout;byte[] data"},
    {"std_msgs/msg/Int8MultiArray", "MultiArrayLayout layout;int8[] data"},
    {"std_msgs/msg/UInt8MultiArray", "MultiArrayLayout layout;uint8[] data"},
    {"std_msgs/msg/Int16MultiArray", "MultiArrayLayout layout;int16[] data"},
    {"std_msgs/msg/UInt16MultiArray", "MultiArrayLayout layout;uint16[] data"},
    {"std_msgs/msg/Int32MultiArray", "MultiArrayLayout layout;int32[] data"},
    {"std_msgs/msg/UInt32MultiArray", "MultiArrayLayout layout;uint32[] data"},
    {"std_msgs/msg/Int64MultiArray", "MultiArrayLayout layout;int64[] data"},
    {"std_msgs/msg/UInt64MultiArray", "MultiArrayLayout layout;uint64[] data"},
    {"std_msgs/msg/Float32MultiArray", "MultiArrayLayout layout;float32[] data"},
    {"std_msgs/msg/Float64MultiArray", "MultiArrayLayout layout;float64[] data"},
    {"geometry_msgs/msg/Vector3", "float64 x;float64 y;float64 z"},
    {"geometry_msgs/msg/Vector3Stamped", "std_msgs/Header header;Vector3 vector"},
    {"geometry_msgs/msg/Point", "float64 x;float64 y;float64 z"},
    {"geometry_msgs/msg/Point32", "float32 x;float32 y;float32 z"},
    {"geometry_msgs/msg/PointStamped", "std_msgs/Header header;Point point"},
    {"geometry_msgs/msg/Quaternion", "float64 x;float64 y;float64 z;float64 w"},
    {"geometry_msgs/msg/QuaternionStamped", "std_msgs/Header header;Quaternion quaternion"},
    {"geometry_msgs/msg/Pose", "Point position;Quaternion orientation"},
    {"geometry_msgs/msg/Pose2D", "float64 x;float64 y;float64 theta"},
    {"geometry_msgs/msg/PoseArray", "std_msgs/Header header;Pose[] poses"},
    {"geometry_msgs/msg/PoseStamped", "std_msgs/Header header;Pose pose"},
    {"geometry_msgs/msg/PoseWithCovariance", "Pose pose;float64[36] covariance"},
    {"geometry_msgs/msg/PoseWithCovarianceStamped", "std_msgs/Header header;PoseWithCovariance pose"},
    {"geometry_msgs/msg/Twist", "Vector3 linear;Vector3 angular"},
    {"geometry_msgs/msg/TwistStamped", "std_msgs/Header header;Twist twist"},
    {"geometry_msgs/msg/TwistWithCovariance", "Twist twist;float64[36] covariance"},
    {"geometry_msgs/msg/TwistWithCovarianceStamped", "std_msgs/Header header;TwistWithCovariance twist"},
    {"geometry_msgs/msg/Accel", "Vector3 linear;Vector3 angular"},
    {"geometry_msgs/msg/AccelStamped", "std_msgs/Header header;Accel accel"},
    {"geometry_msgs/msg/AccelWithCovariance", "Accel accel;float64[36] covariance"},
    {"geometry_msgs/msg/AccelWithCovarianceStamped", "std_msgs/Header header;AccelWithCovariance accel"},
    {"geometry_msgs/msg/Wrench", "Vector3 force;Vector3 torque"},
    {"geometry_msgs/msg/WrenchStamped", "std_msgs/Header header;Wrench wrench"},
    {"geometry_msgs/msg/Inertia",
     "float64 m;Vector3 com;float64 ixx;float64 ixy;float64 ixz;float64 iyy;float64 iyz;float64 izz"},
    {"geometry_msgs/msg/InertiaStamped", "std_msgs/Header header;Inertia inertia"},
    {"geometry_msgs/msg/Polygon", "Point32[] points"},
    {"geometry_msgs/msg/PolygonStamped", "std_msgs/Header header;Polygon polygon"},
    {"geometry_msgs/msg/Transform", "Vector3 translation;Quaternion rotation"},
    {"geometry_msgs/msg/TransformStamped", "std_msgs/Header header;string child_frame_id;Transform transform"},
    {"geometry_msgs/msg/VelocityStamped",
     "std_msgs/Header header;string body_frame_id;string reference_frame_id;Twist velocity"},
    {"sensor_msgs/msg/JointState",
     "std_msgs/Header header;string[] name;float64[] position;float64[] velocity;float64[] effort"},
    {"sensor_msgs/msg/MultiDOFJointState",
     "std_msgs/Header header;string[] joint_names;geometry_msgs/Transform[] transforms"
     ";geometry_msgs/Twist[] twist;geometry_msgs/Wrench[] wrench"},
    {"sensor_msgs/msg/Imu",
     "std_msgs/Header header;geometry_msgs/Quaternion orientation;float64[9] orientation_covariance"
     ";geometry_msgs/Vector3 angular_velocity;float64[9] angular_velocity_covariance"
     ";geometry_msgs/Vector3 linear_acceleration;float64[9] linear_acceleration_covariance"},
    {"sensor_msgs/msg/BatteryState",
     "std_msgs/Header header;float32 voltage;float32 temperature;float32 current;float32 charge"
     ";float32 capacity;float32 design_capacity;float32 percentage;uint8 power_supply_status"
     ";uint8 power_supply_health;uint8 power_supply_technology;bool present;float32[] cell_voltage"
     ";float32[] cell_temperature;string location;string serial_number"},
    {"sensor_msgs/msg/Range",
     "std_msgs/Header header;uint8 radiation_type;float32 field_of_view;float32 min_range"
     ";float32 max_range;float32 range"},
    {"sensor_msgs/msg/NavSatStatus", "int8 status;uint16 service"},
    {"sensor_msgs/msg/NavSatFix",
     "std_msgs/Header header;NavSatStatus status;float64 latitude;float64 longitude;float64 altitude"
     ";float64[9] position_covariance;uint8 position_covariance_type"},
    {"sensor_msgs/msg/MagneticField",
     "std_msgs/Header header;geometry_msgs/Vector3 magnetic_field;float64[9] magnetic_field_covariance"},
    {"sensor_msgs/msg/Temperature", "std_msgs/Header header;float64 temperature;float64 variance"},
    {"sensor_msgs/msg/FluidPressure", "std_msgs/Header header;float64 fluid_pressure;float64 variance"},
    {"sensor_msgs/msg/RelativeHumidity", "std_msgs/Header header;float64 relative_humidity;float64 variance"},
    {"sensor_msgs/msg/Illuminance", "std_msgs/Header header;float64 illuminance;float64 variance"},
    {"sensor_msgs/msg/Joy", "std_msgs/Header header;float32[] axes;int32[] buttons"},
    {"sensor_msgs/msg/JoyFeedback", "uint8 type;uint8 id;float32 intensity"},
    {"sensor_msgs/msg/LaserScan",
     "std_msgs/Header header;float32 angle_min;float32 angle_max;float32 angle_increment"
     ";float32 time_increment;float32 scan_time;float32 range_min;float32 range_max;float32[] ranges"
     ";float32[] intensities"},
    {"sensor_msgs/msg/TimeReference", "std_msgs/Header header;builtin_interfaces/Time time_ref;string source"},
    {"nav_msgs/msg/MapMetaData",
     "builtin_interfaces/Time map_load_time;float32 resolution;uint32 width;uint32 height"
     ";geometry_msgs/Pose origin"},
    {"nav_msgs/msg/Odometry",
     "std_msgs/Header header;string child_frame_id;geometry_msgs/PoseWithCovariance pose"
     ";geometry_msgs/TwistWithCovariance twist"},
    {"nav_msgs/msg/Path", "std_msgs/Header header;geometry_msgs/PoseStamped[] poses"},
    {"tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms"},
    {"trajectory_msgs/msg/JointTrajectoryPoint",
     "float64[] positions;float64[] velocities;float64[] accelerations;float64[] effort"
     ";builtin_interfaces/Duration time_from_start"},
    {"trajectory_msgs/msg/JointTrajectory",
     "std_msgs/Header header;string[] joint_names;JointTrajectoryPoint[] points"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
     "geometry_msgs/Transform[] transforms;geometry_msgs/Twist[] velocities"
     ";geometry_msgs/Twist[] accelerations;builtin_interfaces/Duration time_from_start"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectory",
     "std_msgs/Header header;string[] joint_names;MultiDOFJointTrajectoryPoint[] points"},
    {"control_msgs/msg/InterfaceValue", "string[] interface_names;float64[] values"},
    {"control_msgs/msg/DynamicJointState",
     "std_msgs/Header header;string[] joint_names;InterfaceValue[] interface_values"},
    {"control_msgs/msg/JointTrajectoryControllerState",
     "std_msgs/Header header;string[] joint_names;trajectory_msgs/JointTrajectoryPoint reference"
     ";trajectory_msgs/JointTrajectoryPoint feedback;trajectory_msgs/JointTrajectoryPoint error"
     ";trajectory_msgs/JointTrajectoryPoint output;trajectory_msgs/JointTrajectoryPoint desired"
     ";trajectory_msgs/JointTrajectoryPoint actual;string[] multi_dof_joint_names"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_reference"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_feedback"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_output"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual"},
    {"control_msgs/msg/JointControllerState",
     "std_msgs/Header header;float64 set_point;float64 process_value;float64 process_value_dot"
     ";float64 error;float64 time_step;float64 command;float64 p;float64 i;float64 d;float64 i_clamp"
     ";bool antiwindup"},
    {"control_msgs/msg/JointJog",
     "std_msgs/Header header;string[] joint_names;float64[] displacements;float64[] velocities"
     ";float64 duration"},
    {"diagnostic_msgs/msg/KeyValue", "string key;string value"},
    {"diagnostic_msgs/msg/DiagnosticStatus",
     "byte level;string name;string message;string hardware_id;KeyValue[] values"},
    {"diagnostic_msgs/msg/DiagnosticArray", "std_msgs/Header header;DiagnosticStatus[] status"},
};

struct OtherForm {
  std::string_view type;
  std::string_view distribution;
  std::string_view fields;
};

/// JointTrajectoryControllerState also lost its deprecated fields, which Humble got in an update.
constexpr OtherForm others[] = {
    {"sensor_msgs/msg/Range", "Jazzy",
     "std_msgs/Header header;uint8 radiation_type;float32 field_of_view;float32 min_range"
     ";float32 max_range;float32 range;float32 variance"},
    {"control_msgs/msg/JointTrajectoryControllerState", "Foxy",
     "std_msgs/Header header;string[] joint_names;trajectory_msgs/JointTrajectoryPoint desired"
     ";trajectory_msgs/JointTrajectoryPoint actual;trajectory_msgs/JointTrajectoryPoint error"},
    {"control_msgs/msg/JointTrajectoryControllerState", "Jazzy",
     "std_msgs/Header header;string[] joint_names;trajectory_msgs/JointTrajectoryPoint reference"
     ";trajectory_msgs/JointTrajectoryPoint feedback;trajectory_msgs/JointTrajectoryPoint error"
     ";trajectory_msgs/JointTrajectoryPoint output;string[] multi_dof_joint_names"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_reference"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_feedback"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error"
     ";trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_output"},
};

ros::TextMessage message_of(std::string_view type, std::string_view fields) {
  std::string text(fields);
  for (char& c : text) {
    c = c == ';' ? '\n' : c;
  }
  const std::string name(type);
  return std::move(ros::read_messages(name, text, name + " (bundled)").at(name));
}

}  // namespace

const ros::TextMessage* ros::bundled_message(const std::string& type_name) {
  static const ros::TextMessages bundled = [] {
    ros::TextMessages all;
    for (const Entry& entry : humble) {
      all.emplace(entry.type, message_of(entry.type, entry.fields));
    }
    return all;
  }();
  const auto found = bundled.find(type_name);
  return found == bundled.end() ? nullptr : &found->second;
}

std::vector<RosDefinition> bundled_ros_forms(const std::string& type_name) {
  const std::string name = full_ros_name(type_name);
  std::vector<RosDefinition> forms;
  if (ros::bundled_message(name) == nullptr) {
    return forms;
  }
  forms.push_back(ros::assemble(name, {}, ros::bundled_message));
  forms.back().origin = "bundled (Humble)";
  for (const OtherForm& other : others) {
    if (other.type == name) {
      forms.push_back(ros::assemble(name, {{name, message_of(other.type, other.fields)}}, ros::bundled_message));
      forms.back().origin = "bundled (" + std::string(other.distribution) + ")";
    }
  }
  return forms;
}

std::optional<RosDefinition> bundled_ros_definition(const std::string& type_name) {
  auto forms = bundled_ros_forms(type_name);
  return forms.empty() ? std::nullopt : std::optional(std::move(forms.front()));
}

}  // namespace wheelwright::logs
