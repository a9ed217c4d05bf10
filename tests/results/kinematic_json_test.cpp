// SPDX-License-Identifier: Apache-2.0
// The kinematic section of model.json gives back the detector that was commissioned, bit for bit.
#include "detector/detector.hpp"
#include "detector/online_model.hpp"
#include "results/model_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "detector/multiscale/pose_sums.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_file.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::results::kinematic_json_test {
namespace {

using ::testing::HasSubstr;
using testing_support::posed_drive;

Commissioning commissioned(const Scenario& s) {
  Simulation log(s);
  commission::CommissionOptions options;
  options.persistence = {2, 3};
  return commission_robot(log, s.robot, options);
}

OnlineModel there_and_back(const Commissioning& result) {
  return robots::model_from_json(files::parse_json(files::json_text(to_json(result, {}, "test")), "model.json"),
                                 "model.json");
}

void expect_same_decisions(const detector::KinematicModel& a, const detector::KinematicModel& b, const LogTable& log) {
  detector::KinematicDetector one = make_detector(a), other = make_detector(b);
  std::size_t valid = 0;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    std::vector<double> sample;
    for (const std::string& name : a.measurement.columns()) {
      sample.push_back(log.column(name)[k]);
    }
    const Decision &d = one.step(log.t[k], sample), &e = other.step(log.t[k], sample);
    ASSERT_EQ(d.valid, e.valid);
    for (std::size_t i = 0; d.valid && i < d.channels.size(); ++i) {
      ASSERT_EQ(d.channels[i].residual, e.channels[i].residual);
      ASSERT_EQ(d.channels[i].threshold.lower, e.channels[i].threshold.lower);
      ASSERT_EQ(d.channels[i].threshold.upper, e.channels[i].threshold.upper);
    }
    valid += d.valid ? 1 : 0;
  }
  EXPECT_GT(valid, 100u);
}

TEST(KinematicJson, GivesTheDetectorAtAStatedRiskBackBitForBit) {
  Scenario s = posed_drive(3, 20.0);
  s.robot.noise.position = {.value = 0.002, .bias = 1e-4, .correlation = 0.02, .deviation = 0.0015};
  s.robot.noise.heading.bias = 1e-4;
  const Commissioning result = commissioned(s);
  ASSERT_TRUE(result.model.kinematic && result.model.kinematic->at_risk) << ::testing::PrintToString(result.notes);
  const OnlineModel back = there_and_back(result);
  ASSERT_TRUE(back.kinematic && back.kinematic->at_risk);
  EXPECT_EQ(back.robot.noise.position.bias, 1e-4);
  EXPECT_EQ(back.robot.noise.position.deviation, 0.0015);
  EXPECT_EQ(back.robot.noise.heading.bias, 1e-4);
  detector::PoseSumDetector one(*result.model.kinematic), other(*back.kinematic);
  const LogTable log = sim::simulate(s);
  std::size_t looks = 0;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    std::vector<double> sample;
    for (const std::string& name : back.kinematic->measurement.columns()) {
      sample.push_back(log.column(name)[k]);
    }
    ASSERT_EQ(one.step(log.t[k], sample), other.step(log.t[k], sample));
    for (std::size_t i = 0; i < one.looks().size(); ++i) {
      ++looks;
      ASSERT_EQ(one.looks()[i].value, other.looks()[i].value);
      ASSERT_EQ(one.looks()[i].threshold, other.looks()[i].threshold);
    }
  }
  EXPECT_GT(looks, 100U);
}

TEST(KinematicJson, GivesTheDetectorBackBitForBit) {
  for (const bool declared : {true, false}) {
    Scenario s = posed_drive(3, 12.0);
    if (!declared) {
      s.robot.noise.heading.value.reset();
    }
    const Commissioning result = commissioned(s);
    ASSERT_TRUE(result.model.kinematic.has_value()) << result.kinematic.message;
    const OnlineModel back = there_and_back(result);
    ASSERT_TRUE(back.kinematic.has_value());
    EXPECT_EQ(back.kinematic->window, result.model.kinematic->window);
    EXPECT_EQ(back.kinematic->persistence.k, 2u);
    EXPECT_EQ(back.kinematic->persistence.n, 3u);
    expect_same_decisions(*result.model.kinematic, *back.kinematic, sim::simulate(s));
  }
}

void expect_same_thresholds(const std::optional<detector::ConstantThresholds>& a,
                            const std::optional<detector::ConstantThresholds>& b) {
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->block, b->block);
  EXPECT_EQ(a->blocks, b->blocks);
  EXPECT_EQ(a->learning, b->learning);
  ASSERT_EQ(a->outputs.size(), b->outputs.size());
  for (std::size_t i = 0; i < a->outputs.size(); ++i) {
    EXPECT_EQ(a->outputs[i].value, b->outputs[i].value);
    EXPECT_EQ(a->outputs[i].stated, b->outputs[i].stated);
    EXPECT_EQ(a->outputs[i].held_out, b->outputs[i].held_out);
    EXPECT_EQ(a->outputs[i].exceeded, b->outputs[i].exceeded);
    EXPECT_EQ(a->outputs[i].chance, b->outputs[i].chance);
  }
}

TEST(KinematicJson, GivesConstantThresholdsOfBothResidualsBack) {
  Scenario s = posed_drive(3, 40.0);
  s.robot.thresholds = {{"difference", 0.7}};
  const Commissioning result = commissioned(s);
  const OnlineModel back = there_and_back(result);
  ASSERT_TRUE(result.model.kinematic && back.kinematic);
  expect_same_thresholds(result.model.constant, back.constant);
  expect_same_thresholds(result.model.kinematic->constant, back.kinematic->constant);
  expect_same_thresholds(result.kinematic.model->constant, back.kinematic->constant);
  EXPECT_EQ(back.robot.thresholds, s.robot.thresholds);
  EXPECT_EQ(back.constant->outputs[1].value, 0.7);
  EXPECT_TRUE(back.constant->outputs[1].stated);
  EXPECT_FALSE(back.constant->outputs[0].stated);
  EXPECT_GT(back.constant->outputs[0].value, 0.0);
  // What it decides by is |ε| > μ_o, and D1 is what it was.
  const LogTable log = sim::simulate(s);
  TorqueDetector d1 = make_detector(back), d2 = make_detector(back, {.residual = detector::Residual::d2});
  for (std::size_t k = 0; k < log.rows(); ++k) {
    std::vector<double> sample;
    for (const std::string& name : back.measurement.columns()) {
      sample.push_back(log.column(name)[k]);
    }
    const Decision &one = d1.step(log.t[k], sample), &other = d2.step(log.t[k], sample);
    for (std::size_t i = 0; one.valid && i < 2; ++i) {
      const double size = std::abs(one.channels[i].residual), mu = back.constant->outputs[i].value;
      ASSERT_EQ(other.channels[i].residual, one.channels[i].residual);
      ASSERT_EQ(other.channels[i].dead_zone, size > mu ? size : 0.0);
      ASSERT_EQ(other.channels[i].outside, size > mu);
    }
  }
}

TEST(KinematicJson, IsNotThereWithoutAPose) {
  Scenario s = posed_drive(3, 12.0);
  s.sensors.pose = false;
  const Commissioning result = commissioned(s);
  EXPECT_FALSE(to_json(result, {}, "test").contains("kinematic"));
  EXPECT_FALSE(there_and_back(result).kinematic.has_value());
}

TEST(KinematicJson, SaysWhyThereIsNoModel) {
  Scenario s = posed_drive(3, 12.0);
  s.robot.kinematic_window = 50.0;
  const Commissioning result = commissioned(s);
  const Json json = to_json(result, {}, "test");
  EXPECT_EQ(json.at("kinematic").at("status"), "nothing");
  EXPECT_THAT(json.at("kinematic").at("message").get<std::string>(), HasSubstr("too few windows"));
  EXPECT_FALSE(there_and_back(result).kinematic.has_value());
}

TEST(KinematicJson, RefusesWhatIsImpossible) {
  const Commissioning result = commissioned(posed_drive(3, 20.0));
  const Json good = to_json(result, {}, "test");
  const auto expect_refused = [&](const char* pointer, const Json& value, const char* word) {
    Json json = good;
    json.at("kinematic")[Json::json_pointer(pointer)] = value;
    try {
      static_cast<void>(robots::model_from_json(json, "model.json"));
      ADD_FAILURE() << pointer << " was taken";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(word));
    }
  };
  expect_refused("/window", -1.0, "window");
  expect_refused("/window", "long", "/kinematic/window");
  expect_refused("/detector/error_bounds/heading", -0.1, "heading");
  expect_refused("/detector/error_bounds/estimated/0", -0.1, "estimated");
  expect_refused("/measurement/nominal_step", -0.01, "nominal_step");
  expect_refused("/detector/estimate", Json::array({1.0}), "4 numbers");
  expect_refused("/measurement/motion", "steps", "mean_speed");
  expect_refused("/measurement/heading", false, "kinematic");
  expect_refused("/detector/constant_thresholds/outputs/0/value", -0.1, "a number >= 0");
  expect_refused("/detector/constant_thresholds/outputs/0/output", "yaw", "longitudinal");
  expect_refused("/detector/constant_thresholds/outputs", Json::array(), "one threshold for each of the outputs");
  expect_refused("/feasible_set/hull/0", Json::array({2.0, 1.0}), "lower <= upper");
}

TEST(KinematicJson, TheRobotFileMayGiveTheWindow) {
  const Robot robot = robots::parse_robot(
      "model: differential_drive\nwheel_radius: 0.1\ntrack_width: 0.4\nkinematic: {window: 0.7}\n", "robot.yaml");
  EXPECT_EQ(robot.kinematic_window, 0.7);
  EXPECT_EQ(robots::robot_from_json(robots::to_json(robot), "robot").kinematic_window, 0.7);
  EXPECT_THROW(static_cast<void>(robots::parse_robot("model: differential_drive\nwheel_radius: 0.1\ntrack_width: 0.4\n"
                                                     "kinematic: {window: 0}\n",
                                                     "robot.yaml")),
               InputError);
}

}  // namespace
}  // namespace wheelwright::results::kinematic_json_test
