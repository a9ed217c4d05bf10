// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/bag_write.hpp>
#include <wheelwright/logs/log_write.hpp>
#include <wheelwright/logs/ros_definition.hpp>
#include <wheelwright/logs/ros_write.hpp>

namespace wheelwright {
namespace {

constexpr double ns_per_s = 1e9;

class BagLogWriter final : public LogWriter {
 public:
  BagLogWriter(std::filesystem::path path, const std::vector<std::string>& names, const LogWriteOptions& options)
      : path_(std::move(path)),
        names_(names),
        left_(names.size(), true),
        bag_(path_, {.compression = options.compression, .sqlite = false}),
        origin_(std::llround(options.time_origin * ns_per_s)) {
    plan_joints();
    plan_pose();
    plan_imu();
    for (std::size_t c = 0; c < names.size(); ++c) {
      if (left_[c]) {
        others_.push_back(c);
      }
    }
    std::vector<std::string> fields;
    for (const std::size_t c : others_) {
      fields.push_back(ros_field_name(names[c]));
    }
    if (!others_.empty()) {
      columns_topic_ = bag_.add_topic(options.columns_topic, RosColumns::type, columns_definition(fields));
    }
  }

  void write(const LogBlock& block) override {
    check_block(block, names_.size());
    for (std::size_t k = 0; k < block.rows(); ++k) {
      if (!(block.t[k] > -1.0 && block.t[k] < 2e9)) {
        throw InputError(
            fmt::format("{}: time {} s: a recording holds times from 0 to 2e9 s", path_.string(), block.t[k]));
      }
      write_row(block, k, origin_ + std::llround(block.t[k] * ns_per_s));
    }
  }

  void commit() override { bag_.commit(); }

 private:
  std::optional<std::size_t> find(const std::string& name) {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) {
      return std::nullopt;
    }
    return static_cast<std::size_t>(found - names_.begin());
  }

  /// All of `names` as columns that are dealt with, or none of them.
  std::vector<std::size_t> take_all(const std::vector<std::string>& names) {
    std::vector<std::size_t> columns;
    for (const std::string& name : names) {
      if (const auto column = find(name)) {
        columns.push_back(*column);
      }
    }
    if (columns.size() != names.size()) {
      return {};
    }
    for (const std::size_t column : columns) {
      left_[column] = false;
    }
    return columns;
  }

  std::size_t add(const std::string& topic, const std::string& type) {
    return bag_.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
  }

  void plan_joints() {
    const bool axis = find("position") || find("velocity");
    const std::vector<std::vector<std::string>> arrays =
        axis ? std::vector<std::vector<std::string>>{{"position"}, {"velocity"}, {"effort"}}
             : std::vector<std::vector<std::string>>{{"phi_r", "phi_l"}, {"omega_r", "omega_l"}, {"tau_r", "tau_l"}};
    position_ = take_all(arrays[0]);
    velocity_ = take_all(arrays[1]);
    effort_ = take_all(arrays[2]);
    if (!position_.empty() || !velocity_.empty() || !effort_.empty()) {
      joints_topic_ = add("/joint_states", RosJointState::type);
      joints_.name = axis ? std::vector<std::string>{"axis"} : std::vector<std::string>{"right_wheel", "left_wheel"};
    }
  }

  void plan_pose() {
    pose_ = take_all({"x", "y", "theta"});
    if (!pose_.empty()) {
      pose_topic_ = add("/pose", RosPoseStamped::type);
      pose_message_.header.frame_id = "world";
    }
  }

  void plan_imu() {
    imu_ = take_all({"gyro_z", "accel_x"});
    if (!imu_.empty()) {
      imu_topic_ = add("/imu", RosImu::type);
      imu_message_.header.frame_id = "base_link";
    }
  }

  void write_row(const LogBlock& block, std::size_t row, std::int64_t time) {
    const auto value = [&](std::size_t column) { return block.columns[column][row]; };
    const auto fill = [&](const std::vector<std::size_t>& columns, std::vector<double>& to) {
      to.clear();
      for (const std::size_t column : columns) {
        to.push_back(value(column));
      }
    };
    if (joints_topic_) {
      joints_.header.stamp = time;
      fill(position_, joints_.position);
      fill(velocity_, joints_.velocity);
      fill(effort_, joints_.effort);
      bag_.write(*joints_topic_, time, encoder_.encode(joints_));
    }
    if (pose_topic_) {
      pose_message_.header.stamp = time;
      pose_message_.pose.position = {value(pose_[0]), value(pose_[1]), 0.0};
      const double half = 0.5 * value(pose_[2]);
      pose_message_.pose.orientation = {0.0, 0.0, std::sin(half), std::cos(half)};
      bag_.write(*pose_topic_, time, encoder_.encode(pose_message_));
    }
    if (imu_topic_) {
      imu_message_.header.stamp = time;
      imu_message_.angular_velocity[2] = value(imu_[0]);
      imu_message_.linear_acceleration[0] = value(imu_[1]);
      bag_.write(*imu_topic_, time, encoder_.encode(imu_message_));
    }
    if (columns_topic_) {
      columns_.header.stamp = time;
      fill(others_, columns_.values);
      bag_.write(*columns_topic_, time, encoder_.encode(columns_));
    }
  }

  std::filesystem::path path_;
  std::vector<std::string> names_;
  std::vector<bool> left_;  ///< columns that no message has yet
  BagWriter bag_;
  RosEncoder encoder_;
  std::int64_t origin_;
  std::optional<std::size_t> joints_topic_, pose_topic_, imu_topic_, columns_topic_;
  std::vector<std::size_t> position_, velocity_, effort_, pose_, imu_, others_;
  RosJointState joints_;
  RosPoseStamped pose_message_;
  RosImu imu_message_;
  RosColumns columns_;
};

}  // namespace

std::unique_ptr<LogWriter> create_bag(const std::filesystem::path& path, const std::vector<std::string>& names,
                                      const LogWriteOptions& options) {
  check_column_names(names);
  return std::make_unique<BagLogWriter>(path, names, options);
}

}  // namespace wheelwright
