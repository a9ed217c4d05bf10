// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/sim/plant.hpp"
#include "tests/support/fault_oracle.hpp"

namespace wheelwright::sim::plant_test {
namespace {

using Kind = model::Fault::Kind;
using Shape = model::TimeProfile::Shape;

const DifferentialDrive drive{.wheel_radius = 0.1, .track_width = 0.4};
const model::DriveParameters body{
    .mass = 20.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};

DriveState moving() {
  DriveState state;
  state.forward_speed = 0.4;
  state.yaw_rate = -0.7;
  state.pose = {1.0, 2.0, 0.3};
  return state;
}

TEST(Plant, ConstantTorqueGivesTheExponentialApproach) {
  Plant plant(drive, body, {});
  plant.reset(moving(), 0.0);
  const Eigen::Vector2d torque(0.3, 0.1);
  const double force = 0.4 / 0.1, moment = 0.2 * 0.2 / 0.1;
  double t = 0.0;
  for (const double h : {0.01, 0.1, 1e-6, 0.5, 5.0, 40.0}) {
    plant.advance(torque, torque, h);
    t += h;
    const double e1 = std::exp(-4.0 / 20.0 * t), e2 = std::exp(-0.5 / 0.9 * t);
    EXPECT_NEAR(plant.state().forward_speed, force / 4.0 + (0.4 - force / 4.0) * e1, 1e-14);
    EXPECT_NEAR(plant.state().yaw_rate, moment / 0.5 + (-0.7 - moment / 0.5) * e2, 1e-14);
    const double turn = moment / 0.5 * t + (-0.7 - moment / 0.5) * (1.0 - e2) * 0.9 / 0.5;
    EXPECT_NEAR(plant.state().pose[2], 0.3 + turn, 1e-12);
  }
}

TEST(Plant, WithoutFrictionSpeedIsLinearInTime) {
  model::DriveParameters free = body;
  free.viscous_x = free.viscous_y = free.viscous_yaw = 0.0;
  Plant plant(drive, free, {});
  plant.advance({0.5, 0.5}, {0.5, 0.5}, 2.0);
  EXPECT_DOUBLE_EQ(plant.state().forward_speed, 10.0 / 20.0 * 2.0);
  EXPECT_DOUBLE_EQ(plant.state().pose[0], 0.5 * 10.0 / 20.0 * 4.0);
  EXPECT_DOUBLE_EQ(plant.state().wheel_angle[0], plant.state().pose[0] / 0.1);
}

TEST(Plant, SteadyCircleHasTheRadiusOfItsTwist) {
  Plant plant(drive, body, {});
  DriveState state;
  state.forward_speed = 0.5;
  state.yaw_rate = 0.8;
  plant.reset(state, 0.0);
  // Torques that balance friction: u and θ̇ stay.
  const double half_sum = 0.5 * 0.1 * 4.0 * 0.5, half_difference = 0.5 * 0.1 * 0.5 * 0.8 / 0.2;
  const Eigen::Vector2d torque(half_sum + half_difference, half_sum - half_difference);
  for (int i = 0; i < 1000; ++i) {
    plant.advance(torque, torque, 0.01);
    const double angle = 0.8 * 0.01 * (i + 1);
    EXPECT_NEAR(plant.state().pose[0], 0.5 / 0.8 * std::sin(angle), 1e-12);
    EXPECT_NEAR(plant.state().pose[1], 0.5 / 0.8 * (1.0 - std::cos(angle)), 1e-12);
  }
}

TEST(Plant, LinearTorqueSatisfiesTheEquationOfMotion) {
  // Solution of m u̇ + f u = F0 + F1 t with u(0) = 0: particular F1/f t + (F0 − m F1/f)/f plus a decay.
  Plant plant(drive, body, {});
  plant.advance({0.1, 0.1}, {0.4, 0.4}, 3.0);
  const double f0 = 2.0, f1 = 2.0, f = 4.0, m = 20.0;
  const double at0 = (f0 - m * f1 / f) / f;
  EXPECT_NEAR(plant.state().forward_speed, f1 / f * 3.0 + at0 - at0 * std::exp(-f / m * 3.0), 1e-14);
}

TEST(Plant, PowerOfTheMotorsIsKineticEnergyAndFriction) {
  // Simpson's rule on the dissipation, fine enough to be exact to 1e-10.
  Plant plant(drive, body, {});
  plant.reset(moving(), 0.0);
  const auto energy = [&] {
    return 0.5 * body.mass * std::pow(plant.state().forward_speed, 2) +
           0.5 * body.yaw_inertia * std::pow(plant.state().yaw_rate, 2);
  };
  const auto friction = [&] {
    return body.viscous_x * std::pow(plant.state().forward_speed, 2) +
           body.viscous_yaw * std::pow(plant.state().yaw_rate, 2);
  };
  const double before = energy();
  const Eigen::Vector2d torque(0.6, -0.2);
  double lost = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double first = friction();
    plant.advance(torque, torque, 5e-4);
    const double middle = friction();
    plant.advance(torque, torque, 5e-4);
    lost += 1e-3 / 6.0 * (first + 4.0 * middle + friction());
  }
  EXPECT_NEAR(torque.dot(plant.state().wheel_angle), energy() - before + lost, 1e-12);
}

TEST(Plant, OneStepIsAsGoodAsMany) {
  const std::vector<model::Fault> none, radius = {{Kind::wheel_radius_right, -0.02, {}}};
  for (const std::vector<model::Fault>& faults : {none, radius}) {
    Plant one(drive, body, faults), many(drive, body, faults);
    one.reset(moving(), 0.0);
    many.reset(moving(), 0.0);
    one.advance({0.5, 0.1}, {0.5, 0.1}, 0.02);
    for (int i = 0; i < 100; ++i) {
      many.advance({0.5, 0.1}, {0.5, 0.1}, 0.0002);
    }
    EXPECT_LT((one.state().pose - many.state().pose).norm(), 1e-13);
    EXPECT_LT((one.state().wheel_angle - many.state().wheel_angle).norm(), 1e-13);
  }
}

TEST(Plant, RungeKuttaAgreesWithTheClosedForm) {
  // A slip of nothing sends the plant down the general path.
  Plant exact(drive, body, {}), general(drive, body, {{Kind::slip_x, 1e-300, {}}});
  exact.reset(moving(), 0.0);
  general.reset(moving(), 0.0);
  for (int i = 0; i < 100; ++i) {
    exact.advance({0.5, 0.1}, {0.3, 0.2}, 0.01);
    general.advance({0.5, 0.1}, {0.3, 0.2}, 0.01);
  }
  // Fourth order: step⁴ · 1 s = 1.6e-11, times derivatives of order one (per radius for the wheels).
  EXPECT_LT((exact.state().pose - general.state().pose).norm(), 1.6e-11);
  EXPECT_LT((exact.state().wheel_angle - general.state().wheel_angle).norm(), 1.6e-11 / 0.1);
  EXPECT_NEAR(exact.state().forward_speed, general.state().forward_speed, 1.6e-11);
}

// The plant integrates Newton's law in body speeds; ζ is written in encoder speeds. Both must tell the same torque:
// [1 1; ℓ −ℓ]τ = r (M̄ v̇ + F̄ v) + ζ with v̇ from central differences of what the encoders see.
TEST(Plant, EncoderSpeedsSatisfyEquationFifteenUnderEveryFault) {
  model::DriveParameters anisotropic = body;
  anisotropic.viscous_y = 9.0;
  for (const model::DriveParameters& p : {body, anisotropic}) {
    for (const Kind kind : {Kind::wheel_radius, Kind::wheel_radius_right, Kind::wheel_radius_left, Kind::slip_x,
                            Kind::slip_y, Kind::slip_yaw, Kind::matched, Kind::unmatched}) {
      for (const Shape shape : {Shape::step, Shape::ramp, Shape::smooth}) {
        const std::vector<model::Fault> faults = {{kind, 0.03, {shape, 0.1, 0.8}}};
        Plant plant(drive, p, faults);
        plant.reset(moving(), 0.0);
        const Eigen::Vector2d torque(0.7, 0.2);
        plant.advance(torque, torque, 0.4);
        constexpr double h = 1e-4;
        const Eigen::Vector2d before = plant.encoder_speed();
        plant.advance(torque, torque, h);
        DriveMotion motion{plant.state().pose[2], plant.encoder_speed(), {}};
        const model::FaultState fault = model::fault_state(faults, plant.time());
        plant.advance(torque, torque, h);
        motion.acceleration = (plant.encoder_speed() - before) / (2.0 * h);

        const Eigen::Matrix<double, 3, 2> s = kinematic_matrix(motion.heading);
        const Eigen::Vector3d friction(p.viscous_x, p.viscous_y, p.viscous_yaw);
        const Eigen::Vector2d healthy =
            drive.wheel_radius * (Eigen::Vector2d(p.mass, p.yaw_inertia).cwiseProduct(motion.acceleration) +
                                  (s.transpose() * friction.asDiagonal() * s * motion.speed));
        const Eigen::Vector2d z = zeta(drive, p, fault, motion);
        EXPECT_LT((drive.channels(torque) - healthy - z).norm(), 1e-7)  // h² times the third derivative
            << model::to_string(kind) << ' ' << static_cast<int>(shape);
      }
    }
  }
}

TEST(Plant, PoseFollowsEquationFourUnderEveryFault) {
  for (const Kind kind : {Kind::wheel_radius, Kind::wheel_radius_right, Kind::slip_x, Kind::slip_y, Kind::slip_yaw,
                          Kind::matched, Kind::unmatched}) {
    const std::vector<model::Fault> faults = {{kind, 0.03, {Shape::smooth, 0.1, 0.8}}};
    Plant plant(drive, body, faults);
    plant.reset(moving(), 0.0);
    plant.advance({0.7, 0.2}, {0.7, 0.2}, 0.4);
    constexpr double h = 1e-4;
    const Eigen::Vector3d before = plant.state().pose;
    plant.advance({0.7, 0.2}, {0.7, 0.2}, h);
    const DriveMotion motion{plant.state().pose[2], plant.encoder_speed(), {}};
    const Eigen::Vector3d q_rate = kinematic_matrix(motion.heading) * motion.speed +
                                   delta(drive, model::fault_state(faults, plant.time()), motion);
    plant.advance({0.7, 0.2}, {0.7, 0.2}, h);
    EXPECT_LT(((plant.state().pose - before) / (2.0 * h) - q_rate).norm(), 1e-8) << model::to_string(kind);
  }
}

TEST(Plant, AFaultSetsInAtItsOnsetInsideAStep) {
  Plant long_steps(drive, body, {{Kind::matched, 0.1, {Shape::ramp, 0.0137, 0.5}}});
  Plant cut(drive, body, {{Kind::matched, 0.1, {Shape::ramp, 0.0137, 0.5}}});
  for (Plant* plant : {&long_steps, &cut}) {
    plant->reset(moving(), 0.0);
  }
  long_steps.advance({0.5, 0.1}, {0.5, 0.1}, 0.02);
  cut.advance({0.5, 0.1}, {0.5, 0.1}, 0.0137);
  cut.advance({0.5, 0.1}, {0.5, 0.1}, 0.02 - 0.0137);
  EXPECT_LT((long_steps.state().wheel_angle - cut.state().wheel_angle).norm(), 1e-14);
}

TEST(Plant, MomentumIsContinuousWhenAStepFaultMakesTheEncodersJump) {
  Plant plant(drive, body, {{Kind::wheel_radius, -0.02, {Shape::step, 1.0}}});
  plant.reset(moving(), 0.999999);
  const double before = plant.encoder_speed()[0], momentum = plant.state().forward_speed;
  plant.advance({0.1, 0.1}, {0.1, 0.1}, 2e-6);
  EXPECT_NEAR(plant.state().forward_speed, momentum, 1e-5);
  EXPECT_NEAR(plant.encoder_speed()[0], before / 0.8, 1e-5);
}

TEST(Plant, RefusesParametersAndFaultsThatAreNone) {
  EXPECT_THROW(Plant(drive, model::DriveParameters{}, {}), InvalidArgument);
  EXPECT_THROW(Plant(drive, body, {{Kind::wheel_radius, -0.2, {}}}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::sim::plant_test
