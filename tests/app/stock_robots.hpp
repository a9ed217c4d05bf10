// SPDX-License-Identifier: Apache-2.0
/// \file
/// Recordings of stock robots, after their published geometry, as their own drivers write them: MCAP by its bytes.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/logs/ros_cdr.hpp"

namespace wheelwright::testing {

/// A robot with wheels of radius r on both sides that turns like one with the track D.
struct StockRobot {
  double r = 0.0, D = 0.0;               // m
  double mass = 0.0, yaw_inertia = 0.0;  // kg, kg·m²; the wheels' spin included
};

/// One row of a drive; the efforts are commands that are held until the next row.
struct StockRow {
  double t = 0.0;
  double angle[2] = {}, speed[2] = {}, effort[2] = {};  // right, left
};

/// A drive of `seconds` at 50 Hz, from rest, in curves to both sides. Speeds have an error of ±0.002 rad/s, efforts of
/// ±0.2 % of what accelerates the robot at 1 m/s².
inline std::vector<StockRow> stock_drive(const StockRobot& robot, double seconds, std::uint32_t seed = 1) {
  constexpr double step = 0.02;
  constexpr int parts = 20;
  const double fast = 5.0 * robot.r, damping = 0.3 * robot.mass, yaw_damping = 0.5 * robot.yaw_inertia;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> error(-1.0, 1.0);
  std::vector<StockRow> rows;
  double v = 0.0, w = 0.0, angle[2] = {0.0, 0.0};
  for (double t = 0.0; t < seconds; t += step) {
    const double wish = t < 2.0 ? 0.0 : fast * (0.5 * std::sin(0.6 * t) + 0.4 * std::sin(1.7 * t));
    const double turn = t < 2.0 ? 0.0 : fast / robot.D * (0.5 * std::sin(0.9 * t) + 0.4 * std::sin(2.3 * t));
    const double force = robot.mass * 4.0 * (wish - v) + damping * v;
    const double moment = robot.yaw_inertia * 4.0 * (turn - w) + yaw_damping * w;
    const double torque[2] = {robot.r * (0.5 * force + moment / robot.D), robot.r * (0.5 * force - moment / robot.D)};
    StockRow row{.t = t};
    for (int j = 0; j < 2; ++j) {
      row.angle[j] = angle[j];
      row.speed[j] = (v + (j == 0 ? 0.5 : -0.5) * w * robot.D) / robot.r + 0.002 * error(generator);
      row.effort[j] = torque[j] + 0.002 * robot.mass * robot.r * error(generator);
    }
    rows.push_back(row);
    for (int k = 0; k < parts; ++k) {
      const double h = step / parts, v0 = v, w0 = w;
      v += h * ((torque[0] + torque[1]) / robot.r - damping * v) / robot.mass;
      w += h * ((torque[0] - torque[1]) * 0.5 * robot.D / robot.r - yaw_damping * w) / robot.yaw_inertia;
      for (int j = 0; j < 2; ++j) {
        angle[j] += h * 0.5 * (v + v0 + (j == 0 ? 0.5 : -0.5) * (w + w0) * robot.D) / robot.r;
      }
    }
  }
  return rows;
}

/// A recording that is being made. Types are known to every reader by their names.
class StockBag {
 public:
  void add(const std::string& topic, const std::string& type, double t, const std::string& data) {
    messages_.push_back({topic, type, nanoseconds(t) + 300'000, data});
  }

  /// A JointState with the joints of `wheels` (right or left by "right" in their names) of `row`; NaN as efforts where
  /// they are not `known`. Each wheel of a side of n has an n-th of its effort.
  void add_joints(const std::string& topic, const StockRow& row, const std::vector<std::string>& wheels,
                  bool known = true) {
    HandCdr cdr(true);
    head(cdr, row.t, "");
    std::vector<double> position, velocity, effort;
    for (const std::string& wheel : wheels) {
      const int j = wheel.find("right") != std::string::npos ? 0 : 1;
      position.push_back(row.angle[j]);
      velocity.push_back(row.speed[j]);
      effort.push_back(known ? row.effort[j] * 2.0 / static_cast<double>(wheels.size())
                             : std::numeric_limits<double>::quiet_NaN());
    }
    cdr.list(wheels).list(position).list(velocity).list(effort);
    add(topic, "sensor_msgs/msg/JointState", row.t, cdr.str());
  }

  void add_odometry(const std::string& topic, double t, double x, double y, double theta) {
    HandCdr cdr(true);
    head(cdr, t, "odom");
    cdr.put("base_link").put(x).put(y).put(0.0);
    cdr.put(0.0).put(0.0).put(std::sin(0.5 * theta)).put(std::cos(0.5 * theta));
    for (int k = 0; k < 36 + 6 + 36; ++k) {
      cdr.put(0.0);
    }
    add(topic, "nav_msgs/msg/Odometry", t, cdr.str());
  }

  void add_text(const std::string& topic, const std::string& text) {
    HandCdr cdr(true);
    cdr.put(text);
    add(topic, "std_msgs/msg/String", 0.0, cdr.str());
  }

  /// The bytes of the file.
  [[nodiscard]] std::string bytes() const {
    std::string out = "\x89MCAP0\r\n";
    record(out, 1, text("ros2") + text("hand"));
    std::map<std::string, std::uint16_t> channels;
    for (const Message& message : messages_) {
      if (!channels.contains(message.topic)) {
        const auto id = static_cast<std::uint16_t>(channels.size() + 1);
        channels[message.topic] = id;
        record(out, 3, number(id) + text(message.type) + text("ros2msg") + number(std::uint32_t{0}));
        record(out, 4, number(id) + number(id) + text(message.topic) + text("cdr") + number(std::uint32_t{0}));
      }
      record(out, 5,
             number(channels[message.topic]) + number(std::uint32_t{0}) + number(message.time) + number(message.time) +
                 message.data);
    }
    record(out, 15, number(std::uint32_t{0}));
    record(out, 2, number(std::uint64_t{0}) + number(std::uint64_t{0}) + number(std::uint32_t{0}));
    return out + "\x89MCAP0\r\n";
  }

 private:
  struct Message {
    std::string topic, type;
    std::uint64_t time = 0;
    std::string data;
  };

  static std::uint64_t nanoseconds(double t) {
    return 1'764'000'000'000'000'000U + static_cast<std::uint64_t>(std::llround(1e9 * t));
  }
  static void head(HandCdr& cdr, double t, const char* frame) {
    const std::uint64_t ns = nanoseconds(t);
    cdr.put(static_cast<std::int32_t>(ns / 1'000'000'000)).put(static_cast<std::uint32_t>(ns % 1'000'000'000));
    cdr.put(frame);
  }
  template <typename Number>
  static std::string number(Number value) {
    std::string out(sizeof value, '\0');
    std::memcpy(out.data(), &value, sizeof value);
    return out;
  }
  static std::string text(const std::string& of) { return number(static_cast<std::uint32_t>(of.size())) + of; }
  static void record(std::string& out, char kind, const std::string& body) {
    out += kind;
    out += number(static_cast<std::uint64_t>(body.size())) + body;
  }

  std::vector<Message> messages_;
};

/// Wheel odometry of a drive at rows `every` apart, stamped `late` s after them: interpolated between rows.
inline void add_wheel_odometry(StockBag& bag, const std::string& topic, const StockRobot& robot,
                               const std::vector<StockRow>& rows, double period, double late) {
  std::vector<double> x(rows.size()), y(rows.size()), theta(rows.size());
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const double right = rows[k].angle[0] - rows[k - 1].angle[0], left = rows[k].angle[1] - rows[k - 1].angle[1];
    theta[k] = theta[k - 1] + robot.r * (right - left) / robot.D;
    const double way = 0.5 * robot.r * (right + left), middle = 0.5 * (theta[k] + theta[k - 1]);
    x[k] = x[k - 1] + way * std::cos(middle);
    y[k] = y[k - 1] + way * std::sin(middle);
  }
  const double step = rows[1].t - rows[0].t;
  for (double t = late; t < rows.back().t - step; t += period) {
    const auto k = static_cast<std::size_t>(t / step);
    const double part = (t - rows[k].t) / step;
    const auto at = [&](const std::vector<double>& of) { return (1.0 - part) * of[k] + part * of[k + 1]; };
    bag.add_odometry(topic, t, at(x), at(y), at(theta));
  }
}

/// A description: a body and wheels (x, half the track) on the ground.
inline std::string stock_urdf(const std::string& name, double body_mass, double body_inertia, double radius,
                              double wheel_mass,
                              const std::vector<std::pair<std::string, std::pair<double, double>>>& wheels) {
  std::string out = fmt::format(
      "<robot name=\"{0}\"><link name=\"base_link\"><inertial><mass value=\"{1}\"/><inertia ixx=\"{2}\" iyy=\"{2}\" "
      "izz=\"{2}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>",
      name, body_mass, body_inertia);
  const double spin = 0.5 * wheel_mass * radius * radius;
  for (const auto& [wheel, at] : wheels) {
    out += fmt::format(
        "<link name=\"{0}_link\"><inertial><mass value=\"{1}\"/><inertia ixx=\"{2}\" iyy=\"{3}\" izz=\"{2}\" "
        "ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial><collision><origin rpy=\"1.5707963267949 0 0\"/><geometry><cylinder "
        "radius=\"{4}\" length=\"0.04\"/></geometry></collision></link><joint name=\"{0}\" type=\"continuous\"><parent "
        "link=\"base_link\"/><child link=\"{0}_link\"/><origin xyz=\"{5} {6} {4}\"/><axis xyz=\"0 1 0\"/></joint>",
        wheel, wheel_mass, 0.6 * spin, spin, radius, at.first, at.second);
  }
  return out + "</robot>";
}

}  // namespace wheelwright::testing
