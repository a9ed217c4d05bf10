// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/faults.hpp"
#include "tests/support/fault_oracle.hpp"

namespace wheelwright::model::faults_test {
namespace {

using Kind = Fault::Kind;
using Shape = TimeProfile::Shape;

constexpr std::array all_kinds = {
    Kind::wheel_radius, Kind::wheel_radius_right, Kind::wheel_radius_left, Kind::slip_x,
    Kind::slip_y,       Kind::slip_yaw,           Kind::matched,           Kind::unmatched};
const DifferentialDrive drive{.wheel_radius = 0.1, .track_width = 0.4};
const DriveParameters body{.mass = 20.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
const DriveParameters anisotropic{
    .mass = 20.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 9.0, .viscous_yaw = 0.5};
const DriveMotion motion{.heading = 0.7, .speed = {0.5, -0.8}, .acceleration = {1.5, 2.5}};

FaultState at(std::vector<Fault> faults, double t = 0.0) { return fault_state(faults, t); }

// r(M̄ v̇ + F̄ v), written out.
Eigen::Vector2d healthy_torque(const DriveParameters& p, const DriveMotion& m) {
  const double c = std::cos(m.heading), s = std::sin(m.heading);
  const double f = p.viscous_x * c * c + p.viscous_y * s * s;
  return drive.wheel_radius * Eigen::Vector2d(p.mass * m.acceleration[0] + f * m.speed[0],
                                              p.yaw_inertia * m.acceleration[1] + p.viscous_yaw * m.speed[1]);
}

TEST(FaultKind, EachHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (std::size_t k = 0; k < fault_kinds; ++k) {
    names.insert(to_string(static_cast<FaultKind>(k)));
  }
  EXPECT_EQ(names.size(), fault_kinds);
  EXPECT_FALSE(names.contains(""));
  EXPECT_THROW(static_cast<void>(to_string(static_cast<FaultKind>(fault_kinds))), InvalidArgument);
}

TEST(FaultKind, IsSimulatedOrHasASignatureOrBoth) {
  const Model model = drive.model();
  std::set<std::string> without_signature;
  for (std::size_t k = 0; k < fault_kinds; ++k) {
    without_signature.insert(std::string(to_string(static_cast<FaultKind>(k))));
  }
  for (const FaultType& fault : fault_catalogue(model, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())))) {
    EXPECT_NO_THROW(validate(fault, model)) << fault.name;
    EXPECT_FALSE(fault.sentence.empty() || fault.unit.empty()) << fault.name;
    without_signature.erase(fault.name);
    without_signature.erase(fault.name.substr(0, fault.name.rfind('_')));  // of each joint
  }
  EXPECT_EQ(without_signature, (std::set<std::string>{"slip_x", "slip_y"}));  // they turn with the heading
  EXPECT_EQ(simulated_faults(), std::vector(all_kinds.begin(), all_kinds.end()));
}

TEST(TimeProfile, IsNothingBeforeItsOnsetAndAllAfterItsRise) {
  for (const Shape shape : {Shape::step, Shape::ramp, Shape::smooth}) {
    const TimeProfile profile{shape, 2.0, 0.5, 6.0};
    EXPECT_EQ(profile.value(1.999), 0.0);
    EXPECT_EQ(profile.value(2.5), 1.0);
    EXPECT_EQ(profile.value(5.999), 1.0);
    EXPECT_EQ(profile.value(6.5), 0.0);
  }
  EXPECT_EQ((TimeProfile{Shape::step, 2.0}).value(2.0), 1.0);
  EXPECT_DOUBLE_EQ((TimeProfile{Shape::ramp, 2.0, 0.5}).value(2.125), 0.25);
  EXPECT_DOUBLE_EQ((TimeProfile{Shape::smooth, 2.0, 0.5}).value(2.25), 0.5);
}

TEST(TimeProfile, RateIntegratesToTheValue) {
  for (const Shape shape : {Shape::ramp, Shape::smooth}) {
    const TimeProfile profile{shape, 2.0, 0.5, 6.0};
    constexpr int steps = 80000;
    constexpr double h = 8.0 / steps;
    double integral = 0.0, worst = 0.0;
    for (int i = 0; i < steps; ++i) {
      integral += h * profile.rate((i + 0.5) * h);
      worst = std::max(worst, std::abs(integral - profile.value((i + 1) * h)));
    }
    EXPECT_LT(worst, h * 2.0);  // one step of the steepest rate of the ramp
  }
}

TEST(Delta, RadiusFaultIsEquationSix) {
  const double d1 = -0.01, c = std::cos(motion.heading), s = std::sin(motion.heading);
  const Eigen::Vector2d w = drive.wheel_speed(motion.speed);
  const Eigen::Vector3d six =
      d1 / 2.0 * Eigen::Vector3d((w[0] + w[1]) * c, (w[0] + w[1]) * s, 2.0 * (w[0] - w[1]) / drive.track_width);
  EXPECT_LT((delta(drive, at({{Kind::wheel_radius, d1, {}}}), motion) - six).norm(), 1e-15);
}

TEST(Delta, OneWheelEachIsBothWheels) {
  const FaultState both = at({{Kind::wheel_radius, 0.01, {}}});
  const FaultState each = at({{Kind::wheel_radius_right, 0.01, {}}, {Kind::wheel_radius_left, 0.01, {}}});
  EXPECT_LT((delta(drive, both, motion) - delta(drive, each, motion)).norm(), 1e-16);
  EXPECT_LT((zeta(drive, body, both, motion) - zeta(drive, body, each, motion)).norm(), 1e-14);
}

TEST(Delta, OneWheelMovesTheRobotAsItsOwnRadiusSays) {
  const FaultState right = at({{Kind::wheel_radius_right, 0.02, {}}});
  const Eigen::Vector2d w = drive.wheel_speed(motion.speed);
  const Eigen::Vector3d q_rate = kinematic_matrix(motion.heading) * motion.speed + delta(drive, right, motion);
  const double forward = (0.12 * w[0] + 0.1 * w[1]) / 2.0, yaw = (0.12 * w[0] - 0.1 * w[1]) / 0.4;
  EXPECT_NEAR(q_rate[0], forward * std::cos(motion.heading), 1e-15);
  EXPECT_NEAR(q_rate[1], forward * std::sin(motion.heading), 1e-15);
  EXPECT_NEAR(q_rate[2], yaw, 1e-15);
}

// The rate of delta against central differences of delta along a motion that satisfies θ̇ = v2 + δ_θ.
TEST(DeltaRate, IsTheDerivativeOfDeltaForEveryFault) {
  for (const Kind kind : all_kinds) {
    const std::vector<Fault> faults = {{kind, 0.02, {Shape::smooth, 1.0, 0.8}}, {kind, 0.03, {}}};
    const double t = 1.3, h = 1e-5;
    const FaultState now = fault_state(faults, t);
    const Eigen::Vector3d d = delta(drive, now, motion);
    const double yaw_rate = motion.speed[1] + d[2];
    const double yaw_acceleration = motion.acceleration[1] + delta_rate(drive, now, motion)[2];
    const auto moved = [&](double by) {
      return DriveMotion{motion.heading + by * yaw_rate + 0.5 * by * by * yaw_acceleration,
                         motion.speed + by * motion.acceleration, motion.acceleration};
    };
    const Eigen::Vector3d difference =
        (delta(drive, fault_state(faults, t + h), moved(h)) - delta(drive, fault_state(faults, t - h), moved(-h))) /
        (2.0 * h);
    const Eigen::Vector3d rate = delta_rate(drive, now, motion);
    EXPECT_GT(rate.norm(), 0.0) << to_string(kind);
    EXPECT_LT((difference - rate).norm(), 1e-8 * (1.0 + rate.norm())) << to_string(kind);
  }
}

TEST(Zeta, ConstantRadiusFaultScalesTheTorqueEquation) {
  for (const double d1 : {-0.03, -0.001, 0.001, 0.05}) {
    for (const DriveParameters& p : {body, anisotropic}) {
      const double kappa = std::pow(1.0 + d1 / drive.wheel_radius, 2) - 1.0;
      const Eigen::Vector2d expected = kappa * healthy_torque(p, motion);
      const Eigen::Vector2d computed = zeta(drive, p, at({{Kind::wheel_radius, d1, {}}}), motion);
      EXPECT_LT((computed - expected).norm(), 1e-14 * (1.0 + expected.norm()) + 1e-15) << d1;
    }
  }
}

TEST(Zeta, UnmatchedSlipShowsOnlyInTurns) {
  const FaultState fault = at({{Kind::unmatched, 0.2, {}}});
  const DriveMotion straight{.heading = 0.7, .speed = {0.5, 0.0}, .acceleration = {1.0, 0.0}};
  EXPECT_LT(zeta(drive, body, fault, straight).norm(), 1e-15);
  // In a turn m ρ_U θ̇ (times r), in the sum channel alone.
  const Eigen::Vector2d turning = zeta(drive, body, fault, motion);
  EXPECT_NEAR(turning[0], drive.wheel_radius * body.mass * 0.2 * motion.speed[1], 1e-14);
  EXPECT_NEAR(turning[1], 0.0, 1e-15);
}

TEST(Zeta, MatchedSlipShowsAsItsInertiaAndFriction) {
  const std::vector<Fault> faults = {{Kind::matched, 0.2, {Shape::ramp, 0.0, 2.0}}};
  const Eigen::Vector2d z = zeta(drive, body, fault_state(faults, 1.0), motion);
  EXPECT_NEAR(z[0], drive.wheel_radius * (body.mass * 0.1 + body.viscous_x * 0.1), 1e-14);
  EXPECT_NEAR(z[1], 0.0, 1e-15);
}

TEST(Zeta, MatchedAlongTheXAxisIsSlipAlongTheXAxis) {
  const DriveMotion along_x{.heading = 0.0, .speed = {0.5, 0.0}, .acceleration = {1.0, 0.0}};
  EXPECT_LT((zeta(drive, anisotropic, at({{Kind::matched, 0.2, {}}}), along_x) -
             zeta(drive, anisotropic, at({{Kind::slip_x, 0.2, {}}}), along_x))
                .norm(),
            1e-15);
}

TEST(Zeta, YawSlipIsFrictionInTheDifferenceChannel) {
  const Eigen::Vector2d z = zeta(drive, body, at({{Kind::slip_yaw, 0.3, {}}}), motion);
  EXPECT_NEAR(z[0], 0.0, 1e-15);
  EXPECT_NEAR(z[1], drive.wheel_radius * body.viscous_yaw * 0.3, 1e-15);
}

TEST(Zeta, IsNothingWithoutAFault) {
  for (const Kind kind : all_kinds) {
    const std::vector<Fault> later = {{kind, 0.02, {Shape::step, 10.0}}};
    EXPECT_EQ(zeta(drive, body, fault_state(later, 9.99), motion), Eigen::Vector2d::Zero());
    EXPECT_EQ(delta(drive, fault_state(later, 9.99), motion), Eigen::Vector3d::Zero());
  }
}

TEST(ValidateFaults, RadiiStayPositive) {
  const auto check = [](std::vector<Fault> faults) { validate(faults, drive); };
  EXPECT_NO_THROW(check({{Kind::wheel_radius, -0.099, {}}}));
  EXPECT_THROW(check({{Kind::wheel_radius, -0.1, {}}}), InvalidArgument);
  EXPECT_THROW(check({{Kind::wheel_radius, -0.06, {}}, {Kind::wheel_radius_left, -0.05, {}}}), InvalidArgument);
  EXPECT_NO_THROW(check({{Kind::wheel_radius_right, -0.06, {}}, {Kind::wheel_radius_left, -0.05, {}}}));
}

TEST(ValidateFaults, RefusesWhatIsNoProfile) {
  const double nan = std::nan("");
  const auto check = [](Fault fault) { validate(std::vector<Fault>{fault}, drive); };
  EXPECT_THROW(check({Kind::effort_loss, 0.1, {}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, 0.1, {Shape::pulse, 1.0, 2.0}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, nan, {}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, 0.1, {Shape::step, nan}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, 0.1, {Shape::ramp, 1.0, 0.0}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, 0.1, {Shape::ramp, 1.0, 2.0, 2.5}}), InvalidArgument);
  EXPECT_THROW(check({Kind::slip_x, 0.1, {Shape::step, 1.0, 0.0, nan}}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::model::faults_test
