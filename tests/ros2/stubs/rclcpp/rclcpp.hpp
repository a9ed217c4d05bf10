// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had: what examples/ros2 calls, with the
/// signatures of Humble and later. Nothing leaves the process; namespace stand_in is the test's hand on it.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <builtin_interfaces/msg/time.hpp>

enum rcl_clock_type_e { RCL_CLOCK_UNINITIALIZED = 0, RCL_ROS_TIME, RCL_SYSTEM_TIME, RCL_STEADY_TIME };
using rcl_clock_type_t = rcl_clock_type_e;

namespace rclcpp {

namespace stand_in {

/// ns that every clock shows.
inline std::int64_t now = 0;

}  // namespace stand_in

class Time {
 public:
  explicit Time(std::int64_t nanoseconds = 0, rcl_clock_type_t = RCL_SYSTEM_TIME) : nanoseconds_(nanoseconds) {}
  [[nodiscard]] std::int64_t nanoseconds() const { return nanoseconds_; }
  [[nodiscard]] double seconds() const { return 1e-9 * static_cast<double>(nanoseconds_); }
  operator builtin_interfaces::msg::Time() const {
    return {static_cast<std::int32_t>(nanoseconds_ / 1'000'000'000),
            static_cast<std::uint32_t>(nanoseconds_ % 1'000'000'000)};
  }

 private:
  std::int64_t nanoseconds_;
};

class Clock {
 public:
  explicit Clock(rcl_clock_type_t type = RCL_SYSTEM_TIME) : type_(type) {}
  [[nodiscard]] Time now() const { return Time(stand_in::now, type_); }

 private:
  rcl_clock_type_t type_;
};

class QoS {
 public:
  QoS(std::size_t depth) : depth_(depth) {}
  QoS& best_effort() {
    reliable_ = false;
    return *this;
  }
  [[nodiscard]] std::size_t depth() const { return depth_; }
  [[nodiscard]] bool reliable() const { return reliable_; }

 private:
  std::size_t depth_;
  bool reliable_ = true;
};

class Parameter {
 public:
  using Value = std::variant<bool, std::int64_t, double, std::string, std::vector<std::string>>;
  template <typename T>
  Parameter(std::string name, T value) : name_(std::move(name)), value_(std::move(value)) {}
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const Value& value() const { return value_; }

 private:
  std::string name_;
  Value value_;
};

class NodeOptions {
 public:
  NodeOptions& parameter_overrides(const std::vector<Parameter>& parameters) {
    parameters_ = parameters;
    return *this;
  }
  [[nodiscard]] const std::vector<Parameter>& parameter_overrides() const { return parameters_; }

 private:
  std::vector<Parameter> parameters_;
};

/// Keeps what is published.
template <typename Message>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const Message& message) { published.push_back(message); }

  std::vector<Message> published;
};

/// Is called by the test.
template <typename Message>
class Subscription {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;
  Subscription(QoS quality, std::function<void(const Message&)> callback)
      : qos(std::move(quality)), call(std::move(callback)) {}

  QoS qos;
  std::function<void(const Message&)> call;
};

/// Fires when the test says so.
class TimerBase {
 public:
  using SharedPtr = std::shared_ptr<TimerBase>;
  TimerBase(std::chrono::nanoseconds every, std::function<void()> callback)
      : period(every), fire(std::move(callback)) {}

  std::chrono::nanoseconds period;
  std::function<void()> fire;
};

class Logger {
 public:
  explicit Logger(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] const char* get_name() const { return name_.c_str(); }

 private:
  std::string name_;
};

inline Logger get_logger(const std::string& name) { return Logger(name); }

namespace stand_in {

/// What a node has opened: Publisher<T> and Subscription<T> by topic, timers in order.
struct Ends {
  std::map<std::string, std::shared_ptr<void>> publishers, subscriptions;
  std::vector<TimerBase::SharedPtr> timers;

  template <typename Message>
  Publisher<Message>& publisher(const std::string& topic) const {
    return *static_cast<Publisher<Message>*>(publishers.at(topic).get());
  }
  template <typename Message>
  Subscription<Message>& subscription(const std::string& topic) const {
    return *static_cast<Subscription<Message>*>(subscriptions.at(topic).get());
  }
};

}  // namespace stand_in

class Node {
 public:
  explicit Node(const std::string& name, const NodeOptions& options = NodeOptions()) : name_(name), options_(options) {}
  virtual ~Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] const char* get_name() const { return name_.c_str(); }
  [[nodiscard]] Logger get_logger() const { return Logger(name_); }
  [[nodiscard]] Time now() const { return Clock(RCL_ROS_TIME).now(); }

  /// Throws std::invalid_argument where an override has another type.
  template <typename T>
  T declare_parameter(const std::string& name, const T& fallback) {
    for (const Parameter& parameter : options_.parameter_overrides()) {
      if (parameter.name() == name) {
        if (!std::holds_alternative<T>(parameter.value())) {
          throw std::invalid_argument("parameter '" + name + "' has another type");
        }
        return std::get<T>(parameter.value());
      }
    }
    return fallback;
  }
  template <typename Message>
  typename Publisher<Message>::SharedPtr create_publisher(const std::string& topic, const QoS&) {
    auto publisher = std::make_shared<Publisher<Message>>();
    ends_.publishers[topic] = publisher;
    return publisher;
  }
  template <typename Message, typename Callback>
  typename Subscription<Message>::SharedPtr create_subscription(const std::string& topic, const QoS& qos,
                                                                Callback&& callback) {
    auto subscription = std::make_shared<Subscription<Message>>(qos, std::forward<Callback>(callback));
    ends_.subscriptions[topic] = subscription;
    return subscription;
  }
  template <typename Rep, typename Ratio, typename Callback>
  TimerBase::SharedPtr create_wall_timer(std::chrono::duration<Rep, Ratio> period, Callback callback) {
    ends_.timers.push_back(std::make_shared<TimerBase>(period, std::move(callback)));
    return ends_.timers.back();
  }

  [[nodiscard]] const stand_in::Ends& ends() const { return ends_; }

 private:
  std::string name_;
  NodeOptions options_;
  stand_in::Ends ends_;
};

inline void init(int, char const* const*) {}
inline bool shutdown() { return true; }
inline void spin(const std::shared_ptr<Node>&) {}

}  // namespace rclcpp

#define RCLCPP_FATAL(logger, form, ...) std::fprintf(stderr, "%s: " form "\n", (logger).get_name(), __VA_ARGS__)
