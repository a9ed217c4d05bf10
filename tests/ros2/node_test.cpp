// SPDX-License-Identifier: Apache-2.0
/// \file
/// The node of examples/ros2, compiled against the headers in stubs/, not against ROS. Oracle of the alarms: the
/// detector over the same log, as `wheelwright detect` runs it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "examples/ros2/src/node.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/online_model_file.hpp"
#include "model/sim/simulation.hpp"
#include "results/model_file.hpp"
#include "results/scenario_file.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright {
namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;
using sensor_msgs::msg::JointState;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using wheelwright_diagnostics::DiagnosticsNode;

constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;  // ns
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string examples() { return std::string(WHEELWRIGHT_SOURCE_DIR) + "/examples/"; }

LogTable drive(const std::string& scenario) {
  return sim::simulate(read_scenario(examples() + "scenarios/" + scenario));
}

// The text of model.json, commissioned once.
const std::string& model_text() {
  static const std::string text = [] {
    Simulation healthy(read_scenario(examples() + "scenarios/commissioning.yaml"));
    const Commissioning done = commission_robot(healthy, healthy.scenario().robot);
    return files::json_text(results::to_json(done, logs::LogReport{}, "test"), 1);
  }();
  return text;
}

// Rows of the log at whose sample an alarm stands, and of all that were decided.
struct Batch {
  std::vector<std::size_t> alarms;
  std::size_t decided = 0;
  std::vector<double> residuals;  // last, of the outputs
};

Batch batch(const OnlineModel& model, const LogTable& log) {
  TorqueDetector detector = make_detector(model);
  Batch out;
  std::vector<double> sample;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    sample.clear();
    for (const std::string& name : model.measurement.columns()) {
      sample.push_back(log.column(name)[k]);
    }
    const Decision& decision = detector.step(log.t[k], sample);
    out.decided += decision.valid ? 1 : 0;
    out.residuals = {decision.channels.at(0).residual, decision.channels.at(1).residual};
    if (decision.valid && decision.fault) {
      out.alarms.push_back(k);
    }
  }
  return out;
}

class RosNode : public testing::ScratchTest {
 protected:
  void SetUp() override {
    rclcpp::stand_in::now = kEpoch;
    model_ = put("model.json", model_text());
  }

  void start(std::vector<rclcpp::Parameter> parameters = {}) {
    parameters.emplace_back("model", model_.string());
    node_ = std::make_unique<DiagnosticsNode>(rclcpp::NodeOptions().parameter_overrides(parameters));
  }

  static std::int64_t stamp(double t) { return kEpoch + std::llround(1e9 * t); }

  static JointState row(const LogTable& log, std::size_t k) {
    JointState message;
    const std::int64_t ns = stamp(log.t[k]);
    message.header.stamp = rclcpp::Time(ns);
    message.name = {"right_wheel_joint", "left_wheel_joint"};
    message.position = {log.column("phi_r")[k], log.column("phi_l")[k]};
    message.velocity = {log.column("omega_r")[k], log.column("omega_l")[k]};
    message.effort = {log.column("tau_r")[k], log.column("tau_l")[k]};
    return message;
  }

  // Delivers at the instant of the stamp, unless time stands still or goes back.
  void send(const JointState& message) {
    const std::int64_t ns = std::int64_t{message.header.stamp.sec} * 1'000'000'000 + message.header.stamp.nanosec;
    rclcpp::stand_in::now = std::max(rclcpp::stand_in::now, ns);
    node_->ends().subscription<JointState>("joint_states").call(message);
  }

  const DiagnosticStatus& tick() {
    node_->ends().timers.at(0)->fire();
    return published().back().status.at(0);
  }
  const std::vector<DiagnosticArray>& published() {
    return node_->ends().publisher<DiagnosticArray>("/diagnostics").published;
  }
  // Levels in the order of publication.
  std::vector<int> levels() {
    std::vector<int> out;
    for (const DiagnosticArray& array : published()) {
      out.push_back(array.status.at(0).level);
    }
    return out;
  }
  static std::string value(const DiagnosticStatus& status, const std::string& key) {
    const auto found = std::ranges::find(status.values, key, &diagnostic_msgs::msg::KeyValue::key);
    return found == status.values.end() ? "" : found->value;
  }

  // Sends the whole log, with `change` applied to each message, and returns the rows at which the keys say alarm.
  template <typename Change>
  std::vector<std::size_t> alarms(const LogTable& log, const Change& change) {
    std::vector<std::size_t> out;
    std::string decided = "0";
    for (std::size_t k = 0; k < log.rows(); ++k) {
      JointState message = row(log, k);
      change(message);
      send(message);
      const DiagnosticStatus& status = tick();
      const std::string now = value(status, "instants decided");
      if (now != decided && (value(status, "sum alarm") == "yes" || value(status, "difference alarm") == "yes")) {
        out.push_back(k);
      }
      decided = now;
    }
    return out;
  }
  void healthy_until(const LogTable& log, std::size_t rows) {
    for (std::size_t k = 0; k < rows; ++k) {
      send(row(log, k));
    }
    ASSERT_EQ(tick().level, DiagnosticStatus::OK);
  }

  std::filesystem::path model_;
  std::unique_ptr<DiagnosticsNode> node_;
};

constexpr auto kUnchanged = [](JointState&) {};

TEST_F(RosNode, HealthyDriveIsOkFromTheFirstDecisionOn) {
  start();
  const LogTable log = drive("healthy.yaml");
  EXPECT_TRUE(alarms(log, kUnchanged).empty());
  const std::vector<int> seen = levels();
  const auto first = std::ranges::find(seen, int{DiagnosticStatus::OK});
  EXPECT_THAT(std::vector<int>(seen.begin(), first), Each(int{DiagnosticStatus::WARN}));
  EXPECT_THAT(std::vector<int>(first, seen.end()), Each(int{DiagnosticStatus::OK}));
  const DiagnosticStatus& last = tick();
  EXPECT_EQ(last.message, "no fault");
  EXPECT_EQ(last.hardware_id, "example");
  EXPECT_EQ(value(last, "instants decided"), std::to_string(batch(read_model(model_), log).decided));
  EXPECT_EQ(value(last, "last stamp"), "1700000060.000");
  EXPECT_EQ(value(last, "warrant"), "guaranteed");
}

TEST_F(RosNode, FaultIsAnErrorAtTheInstantsOfTheBatchDetector) {
  start();
  const LogTable log = drive("wheel_radius_fault.yaml");
  const Batch expected = batch(read_model(model_), log);
  ASSERT_FALSE(expected.alarms.empty());
  EXPECT_EQ(alarms(log, kUnchanged), expected.alarms);
  const auto first = std::ranges::find_if(
      published(), [](const DiagnosticArray& array) { return array.status.at(0).level == DiagnosticStatus::ERROR; });
  ASSERT_NE(first, published().end());
  const double at = first->header.stamp.sec - 1.7e9 + 1e-9 * first->header.stamp.nanosec;
  EXPECT_NEAR(at, log.t[expected.alarms.front()], 1e-6);
  EXPECT_THAT(first->status.at(0).message,
              AllOf(HasSubstr("fault in the sum channel since 1700000030.030 s: residual "), HasSubstr("outside [")));
  const DiagnosticStatus& last = tick();
  EXPECT_EQ(value(last, "instants with an alarm"), std::to_string(expected.alarms.size()));
  EXPECT_THAT(last.message, HasSubstr("since 1700000030.030 s"));
  // A robot whose sides are exchanged has the difference with the other sign.
  EXPECT_EQ(value(last, "sum residual"), fmt::format("{:.6g}", expected.residuals[0]));
  EXPECT_EQ(value(last, "difference residual"), fmt::format("{:.6g}", expected.residuals[1]));
}

TEST_F(RosNode, ChangeOfLevelIsPublishedAtOnce) {
  start();
  const LogTable log = drive("wheel_radius_fault.yaml");
  std::size_t k = 0;
  while (published().empty() || published().back().status.at(0).level != DiagnosticStatus::ERROR) {
    ASSERT_LT(k, log.rows());
    send(row(log, k++));
  }
  EXPECT_EQ(k - 1, batch(read_model(model_), log).alarms.front());
  EXPECT_EQ(levels(), (std::vector<int>{DiagnosticStatus::OK, DiagnosticStatus::ERROR}));
}

TEST_F(RosNode, AlarmStandsUntilDrivingWithoutOneWasDecided) {
  start({{"clear_after", 2.0}});
  const LogTable faulty = drive("wheel_radius_fault.yaml");
  const std::size_t onset = batch(read_model(model_), faulty).alarms.front();
  for (std::size_t k = 0; k <= onset; ++k) {
    send(row(faulty, k));
  }
  ASSERT_EQ(tick().level, DiagnosticStatus::ERROR);
  const LogTable log = drive("healthy.yaml");
  for (std::size_t k = 0; k < 1000; ++k) {
    JointState message = row(log, k);
    message.header.stamp = rclcpp::Time(stamp(100.0 + log.t[k]));
    message.effort[0] = kNan;
    send(message);
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::ERROR);
  EXPECT_THAT(tick().message, HasSubstr("since then nothing is known of faults: 1000 messages"));
  for (std::size_t k = 0; k < 1000; ++k) {
    JointState message = row(log, k);
    message.header.stamp = rclcpp::Time(stamp(200.0 + log.t[k]));
    send(message);
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::OK);
}

TEST_F(RosNode, OrderOfTheJointsAndOtherJointsDoNotMatter) {
  start();
  const LogTable log = drive("wheel_radius_fault.yaml");
  std::size_t turn = 0;
  const auto shuffle = [&](JointState& m) {
    m.name = {"arm", m.name[1], m.name[0]};
    for (std::vector<double>* values : {&m.position, &m.velocity, &m.effort}) {
      *values = {kNan, (*values)[1], (*values)[0]};
      std::rotate(values->begin(), values->begin() + turn % 3, values->end());
    }
    std::rotate(m.name.begin(), m.name.begin() + turn++ % 3, m.name.end());
  };
  EXPECT_EQ(alarms(log, shuffle), batch(read_model(model_), log).alarms);
}

TEST_F(RosNode, WheelsOfASideAreAveragedAndTheirEffortsAdded) {
  start(
      {{"right_joints", std::vector<std::string>{"r1", "r2"}}, {"left_joints", std::vector<std::string>{"l1", "l2"}}});
  const LogTable log = drive("wheel_radius_fault.yaml");
  const auto split = [](JointState& m) {  // powers of two: exact
    m.name = {"l2", "r1", "l1", "r2"};
    m.position = {m.position[1] + 0.5, m.position[0] - 0.25, m.position[1] - 0.5, m.position[0] + 0.25};
    m.velocity = {m.velocity[1], m.velocity[0], m.velocity[1], m.velocity[0]};
    m.effort = {0.25 * m.effort[1], 0.5 * m.effort[0], 0.75 * m.effort[1], 0.5 * m.effort[0]};
  };
  EXPECT_EQ(alarms(log, split), batch(read_model(model_), log).alarms);
}

TEST_F(RosNode, AnglesThatWrapAreUnwrapped) {
  start();
  const LogTable log = drive("healthy.yaml");
  const auto wrap = [](JointState& m) {
    for (double& angle : m.position) {
      angle = std::remainder(angle, 2.0 * std::numbers::pi);
    }
  };
  EXPECT_TRUE(alarms(log, wrap).empty());
  EXPECT_EQ(value(tick(), "instants decided"), std::to_string(batch(read_model(model_), log).decided));
}

TEST_F(RosNode, WithoutEffortsNothingIsKnown) {
  const LogTable log = drive("healthy.yaml");
  struct Case {
    std::string why;
    void (*change)(JointState&);
  };
  for (const Case& broken :
       {Case{"with a motion or effort of left_wheel_joint that is no finite number",
             [](JointState& m) { m.effort[1] = kNan; }},
        Case{"with a motion or effort of right_wheel_joint that is no finite number",
             [](JointState& m) { m.position[0] = 1e300; }},
        Case{"without one effort for each name", [](JointState& m) { m.effort.clear(); }},
        Case{"without the joint left_wheel_joint", [](JointState& m) { m.name[1] = "other"; }},
        Case{"with the stamp of the one before", [](JointState& m) { m.header.stamp = rclcpp::Time(stamp(20.0)); }}}) {
    rclcpp::stand_in::now = kEpoch;
    start();
    healthy_until(log, 2000);
    std::size_t k = 2000;
    while (tick().level == DiagnosticStatus::OK) {
      ASSERT_LT(k, 2500U) << broken.why;
      JointState message = row(log, k++);
      rclcpp::stand_in::now = stamp(log.t[k]);
      broken.change(message);
      send(message);
    }
    EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
    EXPECT_THAT(tick().message, AllOf(HasSubstr("nothing is known of faults: "), HasSubstr(broken.why)));
    for (; k < 4000; ++k) {
      send(row(log, k));
    }
    EXPECT_EQ(tick().level, DiagnosticStatus::OK) << broken.why;
    EXPECT_EQ(value(tick(), "instants with an alarm"), "0") << broken.why;
  }
}

TEST_F(RosNode, OneLostValueIsNoBlindness) {
  start();
  const LogTable log = drive("healthy.yaml");
  for (std::size_t k = 0; k < log.rows(); ++k) {
    JointState message = row(log, k);
    if (k % 1000 == 999) {
      message.effort[0] = kNan;
    }
    send(message);
  }
  EXPECT_EQ(levels(), std::vector<int>{DiagnosticStatus::OK});
}

TEST_F(RosNode, SilenceIsStale) {
  start();
  EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
  rclcpp::stand_in::now += 6'000'000'000;
  EXPECT_EQ(tick().level, DiagnosticStatus::STALE);
  const LogTable log = drive("healthy.yaml");
  healthy_until(log, 2000);
  rclcpp::stand_in::now += 4'900'000'000;
  EXPECT_EQ(tick().level, DiagnosticStatus::OK);
  rclcpp::stand_in::now += 200'000'000;
  EXPECT_EQ(tick().level, DiagnosticStatus::STALE);
  EXPECT_EQ(tick().message,
            "nothing is known of faults: no message with a joint of the wheels for 5.1 s, the last row at "
            "1700000019.990 s");
  JointState arm = row(log, 2000);
  arm.name = {"arm", "hand"};
  node_->ends().subscription<JointState>("joint_states").call(arm);
  EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
  EXPECT_THAT(tick().message, HasSubstr("; others name arm, hand"));
}

TEST_F(RosNode, TimeThatGoesBackBeginsAnew) {
  start();
  const LogTable log = drive("healthy.yaml");
  for (std::size_t k = 0; k < 3000; ++k) {
    send(row(log, k));
  }
  for (std::size_t k = 1000; k < 4000; ++k) {
    send(row(log, k));
    EXPECT_NE(tick().level, DiagnosticStatus::ERROR);
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::OK);
  // For ever back: never an alarm, and soon blind.
  for (std::size_t k = 4000; k-- > 3000;) {
    send(row(log, k));
    EXPECT_NE(tick().level, DiagnosticStatus::ERROR);
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
  EXPECT_THAT(tick().message, HasSubstr("with a stamp that goes back"));
}

// Decisions about no time are none.
TEST_F(RosNode, AClockThatHardlyGoesOnIsBlindness) {
  start();
  const LogTable log = drive("healthy.yaml");
  const auto creeping = [&](std::size_t k) {
    auto message = row(log, k);
    const auto since = static_cast<std::uint32_t>(50'000 * (k - 3000));
    message.header.stamp = row(log, 3000).header.stamp;
    message.header.stamp.nanosec += since;
    return message;
  };
  for (std::size_t k = 0; k < 3000; ++k) {
    send(row(log, k));
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::OK);
  for (std::size_t k = 3000; k < 4000; ++k) {
    send(creeping(k));
  }
  EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
  EXPECT_THAT(tick().message, HasSubstr("less than a hundredth of the model's step"));
}

TEST_F(RosNode, ParametersThatMakeNoSenseAreRefused) {
  const auto message = [&](std::vector<rclcpp::Parameter> parameters) -> std::string {
    try {
      start(std::move(parameters));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message({{"rate", 0.0}}), HasSubstr("rate: "));
  EXPECT_THAT(message({{"patience", kNan}}), HasSubstr("patience"));
  EXPECT_THAT(message({{"clear_after", -1.0}}), HasSubstr("clear_after"));
  EXPECT_THAT(message({{"left_joints", std::vector<std::string>{}}}), HasSubstr("left_joints: empty"));
  EXPECT_THAT(message({{"left_joints", std::vector<std::string>{"right_wheel_joint"}}}),
              HasSubstr("left_joints: 'right_wheel_joint': expected each joint once"));
  EXPECT_THAT(message({{"model", path("none.json").string()}}), HasSubstr("none.json"));
  EXPECT_THAT(message({{"model", std::string()}}), HasSubstr("model: empty"));
}

TEST_F(RosNode, ParametersReachWhatTheyName) {
  start({{"rate", 4.0}, {"best_effort", true}, {"hardware_id", std::string("r7")}, {"patience", 60.0}});
  EXPECT_EQ(node_->ends().timers.at(0)->period, std::chrono::milliseconds(250));
  EXPECT_FALSE(node_->ends().subscription<JointState>("joint_states").qos.reliable());
  rclcpp::stand_in::now += 59'000'000'000;
  EXPECT_EQ(tick().level, DiagnosticStatus::WARN);
  EXPECT_EQ(tick().hardware_id, "r7");
}

}  // namespace
}  // namespace wheelwright
