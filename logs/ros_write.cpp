// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/ros_write.hpp>

#include <algorithm>
#include <limits>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fmt/format.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright::logs {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr std::int64_t ros_second = 1'000'000'000;

void put(Cdr& to, const RosHeader& header) {
  check::that(header.stamp >= 0 && header.stamp / ros_second <= std::numeric_limits<std::int32_t>::max(),
              "RosHeader::stamp", "a time from 0 to 2^31 s");
  to << static_cast<std::int32_t>(header.stamp / ros_second) << static_cast<std::uint32_t>(header.stamp % ros_second)
     << header.frame_id;
}

void put(Cdr& to, const RosPose& pose) { to << pose.position << pose.orientation; }
void put(Cdr& to, const RosTwist& twist) { to << twist.linear << twist.angular; }

bool lower(char c) { return c >= 'a' && c <= 'z'; }
bool digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

struct RosEncoder::Impl {
  FastBuffer buffer;

  /// Bytes of what `fields` puts behind the encapsulation.
  template <typename Message, typename Fields>
  std::string_view encode(const Message& message, const Fields& fields) {
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    put(cdr, message.header);
    fields(cdr);
    return {buffer.getBuffer(), cdr.getSerializedDataLength()};
  }
};

RosEncoder::RosEncoder() : impl_(std::make_unique<Impl>()) {}
RosEncoder::~RosEncoder() = default;
RosEncoder::RosEncoder(RosEncoder&&) noexcept = default;
RosEncoder& RosEncoder::operator=(RosEncoder&&) noexcept = default;

std::string_view RosEncoder::encode(const RosJointState& message) {
  return impl_->encode(message,
                       [&](Cdr& to) { to << message.name << message.position << message.velocity << message.effort; });
}

std::string_view RosEncoder::encode(const RosPoseStamped& message) {
  return impl_->encode(message, [&](Cdr& to) { put(to, message.pose); });
}

std::string_view RosEncoder::encode(const RosTwistStamped& message) {
  return impl_->encode(message, [&](Cdr& to) { put(to, message.twist); });
}

std::string_view RosEncoder::encode(const RosOdometry& message) {
  return impl_->encode(message, [&](Cdr& to) {
    to << message.child_frame_id;
    put(to, message.pose);
    to << message.pose_covariance;
    put(to, message.twist);
    to << message.twist_covariance;
  });
}

std::string_view RosEncoder::encode(const RosImu& message) {
  return impl_->encode(message, [&](Cdr& to) {
    to << message.orientation << message.orientation_covariance << message.angular_velocity
       << message.angular_velocity_covariance << message.linear_acceleration << message.linear_acceleration_covariance;
  });
}

std::string_view RosEncoder::encode(const RosColumns& message) {
  return impl_->encode(message, [&](Cdr& to) {
    for (const double value : message.values) {
      to << value;
    }
  });
}

std::string columns_definition(const std::vector<std::string>& names) {
  std::string text = "std_msgs/Header header\n";
  for (auto name = names.begin(); name != names.end(); ++name) {
    check::that(ros_field_name(*name) == *name && *name != "header" && std::find(names.begin(), name, *name) == name,
                "columns_definition: '" + *name + "'", "a name that ROS accepts for a field, and not there before");
    text += "float64 " + *name + "\n";
  }
  const std::string separator = fmt::format("{:=<80}\n", "");
  return text + separator + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + separator +
         "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

std::string ros_field_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const char small = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (lower(small) || digit(small)) {
      out += small;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  if (!out.empty() && out.back() == '_') {
    out.pop_back();
  }
  return out.empty() ? "column" : lower(out.front()) ? out : "column_" + out;
}

}  // namespace wheelwright::logs
