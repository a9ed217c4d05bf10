// SPDX-License-Identifier: Apache-2.0
// From causes that were fitted to a robot file that a simulator takes.
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/improved_robot.hpp"
#include "model/effect_law.hpp"
#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::improved_robot_test {

using model::effect_value;

namespace {

using gap_example::drive_of_log;
using gap_example::effect_called;
using gap_example::fit_effects;
using gap_example::fitted;
using gap_example::plain_drive;
using gap_example::plain_robot;
using gap_example::simulated_drive;

Robot improved(const std::vector<FittedEffect>& causes, const std::vector<std::vector<Interval>>& intervals = {}) {
  std::string why_not;
  const auto robot = improved_robot(plain_robot(), plain_drive(), plain_drive().theta, causes, intervals, why_not);
  EXPECT_TRUE(robot.has_value()) << why_not;
  return robot.value_or(Robot{});
}

struct Case {
  std::string name;
  std::map<std::string, double> truth;
  std::vector<double> shape;
  double tolerance = 0.02;  // share of the truth: the columns' signs are smoothed, or the columns of first order
  double larger = 0.0;      // share by which the wheels of the world are larger
};

class EffectOfASimulator : public testing::TestWithParam<Case> {};

// A log of a robot with an effect; the effect fitted to it; the robot file that comes of it has the effect's numbers
// and the truth's nominal values.
TEST_P(EffectOfASimulator, ComesBackInTheRobotFile) {
  const Case& c = GetParam();
  Robot world = plain_robot();
  world.effects.push_back({c.name, {}});
  for (const auto& [name, value] : c.truth) {
    world.effects.front().parameters[name.empty() ? model::effect_law(c.name).parameters.front().name : name] = {value,
                                                                                                                 value};
  }
  world.wheel_radius *= 1.0 + c.larger;
  const Drive drive = drive_of_log(sim::simulate(simulated_drive(world)), plain_robot());
  const auto [theta, causes] = fit_effects(drive, {{effect_called(c.name), c.shape, {}}}, true);
  std::string why_not;
  const auto robot = improved_robot(plain_robot(), drive, theta, causes, {}, why_not);
  ASSERT_TRUE(robot) << why_not;
  const model::DriveGeometry true_geometry = model::drive_geometry(world), geometry = model::drive_geometry(*robot);
  EXPECT_LT((geometry.radius - true_geometry.radius).norm(), 2e-4 * world.wheel_radius);
  EXPECT_LT((geometry.encoder_scale - true_geometry.encoder_scale).norm(), 4e-4);
  for (const auto& [name, value] : c.truth) {
    if (model::effect_law(c.name).mechanism != model::EffectMechanism::geometry) {
      EXPECT_NEAR(effect_value(*robot, c.name, name), value, c.tolerance * std::abs(value)) << name;
    }
  }
  EXPECT_NEAR(robot->nominal.at("mass"), 21.0, 0.02 * 21.0);
  EXPECT_NEAR(robot->nominal.at("yaw_inertia"), 0.9, 0.02 * 0.9);
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, EffectOfASimulator,
    testing::Values(Case{"coulomb", {{"c", 0.4}}, {}}, Case{"coulomb_asymmetric", {{"c_R", 0.5}, {"c_L", 0.3}}, {}},
                    Case{"stribeck", {{"c_s", 0.5}, {"omega_s", 2.0}}, {2.0}, 0.05},
                    Case{"viscous_asymmetric", {{"b", 0.03}}, {0.0}}, Case{"viscous_asymmetric", {{"b", -0.03}}, {1.0}},
                    Case{"viscous_asymmetric", {{"b", -0.03}}, {2.0}},
                    Case{"quadratic_drag", {{"c", 0.8}, {"c2", 0.05}}, {}}, Case{"com_longitudinal", {{"a", 0.04}}, {}},
                    Case{"com_lateral", {{"b", 0.02}}, {}}, Case{"torque_gain_asymmetric", {{"g", 0.08}}, {1.0}},
                    Case{"torque_gain_asymmetric", {{"g", -0.08}}, {0.0}},
                    Case{"torque_gain_asymmetric", {{"g", 0.08}}, {2.0}},
                    Case{"torque_bias", {{"b_R", 0.1}, {"b_L", -0.05}}, {}},
                    Case{"slope", {{"g_x", 0.2}, {"g_y", -0.1}}, {}}, Case{"actuator_lag", {{"T", 0.06}}, {0.06}},
                    Case{"delay", {{"T_d", 0.04}}, {0.04}}, Case{"sensor_time_offset", {{"dt", 0.03}}, {0.03}},
                    Case{"torque_deadzone", {{"b", 0.15}}, {0.1}, 0.05}, Case{"load_friction", {{"k", 0.2}}, {}, 0.05},
                    Case{"battery_sag", {{"k", 0.001}, {"R_b", 0.005}}, {}, 0.05},
                    Case{"friction_drift", {{"k", 0.5}, {"T", 8.0}}, {8.0}, 0.06},
                    Case{"caster_drag", {{"c", 0.3}, {"p", 0.3}}, {0.3, 1e-3}, 0.08},
                    Case{"lateral_scrub", {{"mu", 0.08}}, {0.01}, 0.08},
                    Case{"wheel_out_of_round", {{"A_R", 0.1}, {"B_R", -0.05}, {"A_L", 0.03}, {"B_L", 0.08}}, {}, 0.05},
                    Case{"longitudinal_slip", {{"stiffness", 2000.0}}, {2000.0, 0.2}, 0.06},
                    Case{"wheel_radius_asymmetric", {{"", 0.01 / 1.01}}, {0.0, 1.0}, 0.0, 0.01},
                    Case{"wheel_radius_asymmetric", {{"", -0.01 / 1.01}}, {1.0, 1.0}, 0.0, 0.01},
                    Case{"wheel_radius_asymmetric", {{"", 0.01}}, {2.0, 1.0}},
                    Case{"encoder_scale", {{"s_R", 0.0}, {"s_L", -0.03}}, {1.0}}),
    [](const auto& test) { return test.param.name + "_" + std::to_string(test.index); });

// (1 + g) u_R = κ a_R and (1 − g) u_L = κ a_L for u_R = (1 + e) a_R, u_L = a_L, exactly.
TEST(ImprovedRobot, AGainAtOneSideBecomesACommonAndAnAntisymmetricOne) {
  for (const double e : {0.3, -0.2}) {
    for (const double side : {0.0, 1.0}) {
      const Robot robot = improved({fitted("torque_gain_asymmetric", {e}, {side})});
      const double g = effect_value(robot, "torque_gain_asymmetric", "g");
      const double gained = side == 0.0 ? (1.0 + g) * (1.0 + e) : (1.0 - g) * (1.0 + e);
      const double plain = side == 0.0 ? 1.0 - g : 1.0 + g;
      EXPECT_NEAR(gained, plain, 1e-12);
      EXPECT_NEAR(robot.nominal.at("mass"), plain * 21.0, 1e-9);
    }
  }
}

TEST(ImprovedRobot, OneLargerWheelIsThatWheelOnly) {
  const Robot right = improved({fitted("wheel_radius_asymmetric", {0.05, 0.0}, {0.0, 0.0})});
  const model::DriveGeometry geometry = model::drive_geometry(right);
  EXPECT_NEAR(geometry.radius[0], 0.0975 * 1.05, 1e-12);
  EXPECT_NEAR(geometry.radius[1], 0.0975, 1e-12);
  // b = r² f1/2 at each joint, through unequal radii: the cross term of Σ b ω_j/r_j to first order.
  EXPECT_NEAR(effect_value(right, "viscous_asymmetric", "b"), -0.0975 * 0.0975 * 4.0 * 0.05, 0.06 * 0.0019);
  // J at the right joint asks for J/r² (D/2) v̇1 about the yaw axis: as −m b v̇1 does.
  const Robot geared = improved({fitted("wheel_radius_asymmetric", {0.0, 0.002}, {0.0, 0.0})});
  EXPECT_NEAR(-geared.nominal.at("mass") * effect_value(geared, "com_lateral", "b"), 0.002 / (0.0975 * 0.0975) * 0.1905,
              1e-9);
  EXPECT_NEAR(geared.nominal.at("mass"), 21.0 + 0.002 / (0.0975 * 0.0975), 1e-9);
  // Friction on the body is what it was, and none of the joints is to be kept.
  const Robot of_body = improved({fitted("wheel_radius_asymmetric", {0.05, 0.0}, {0.0, 1.0})});
  ASSERT_EQ(of_body.effects.size(), 1U);
  EXPECT_NEAR(of_body.nominal.at("viscous_linear"), 4.0, 1e-9);
  EXPECT_NEAR(improved({fitted("track_width", {-0.1, 0.0}, {1.0})}).nominal.at("viscous_yaw"),
              gap_example::kYawFriction, 1e-9);
  EXPECT_NEAR(improved({fitted("track_width", {-0.1, 0.0}, {0.0})}).nominal.at("viscous_yaw"),
              0.81 * gap_example::kYawFriction, 1e-9);
  const Robot both = improved({fitted("wheel_radius", {0.05, 0.0}, {0.0})});
  EXPECT_NEAR(both.wheel_radius, 0.0975 * 1.05, 1e-12);
  EXPECT_TRUE(both.effects.empty());
  EXPECT_NEAR(improved({fitted("track_width", {-0.1, 0.0}, {0.0})}).track_width, 0.9 * 0.381, 1e-12);
}

TEST(ImprovedRobot, ParametricCausesAreNominalValues) {
  const Robot loaded = improved({fitted("payload", {3.0, 0.2})});
  EXPECT_NEAR(loaded.nominal.at("mass"), 24.0, 1e-9);
  EXPECT_NEAR(loaded.nominal.at("yaw_inertia"), 1.1, 1e-9);
  EXPECT_NEAR(loaded.nominal.at("viscous_linear"), 4.0, 1e-9);
  // J at each joint: 2J/r² of mass, and of yaw inertia that at half the track.
  const Robot geared = improved({fitted("armature", {0.01})});
  const double mass = 2.0 * 0.01 / (0.0975 * 0.0975);
  EXPECT_NEAR(geared.nominal.at("mass"), 21.0 + mass, 1e-9);
  EXPECT_NEAR(geared.nominal.at("yaw_inertia"), 0.9 + mass * 0.1905 * 0.1905, 1e-9);
  EXPECT_NEAR(improved({fitted("torque_gain", {0.1})}).nominal.at("viscous_yaw"), 1.1 * gap_example::kYawFriction,
              1e-9);
  // The force of gravity that was seen belongs to the mass that there is now.
  const Robot uphill = improved({fitted("payload", {21.0, 0.0}), fitted("slope", {0.3, 0.1})});
  EXPECT_NEAR(effect_value(uphill, "slope", "g_x"), 0.15, 1e-12);
}

TEST(ImprovedRobot, IntervalsAreWiderThanFoundAndCentred) {
  const Robot robot = improved({fitted("torque_bias", {0.1, -0.02})}, {{{0.09, 0.11}, {-0.08, 0.04}}});
  const auto& p = robot.effects.front().parameters;
  EXPECT_NEAR(p.at("b_R").lower, 0.05, 1e-12);
  EXPECT_NEAR(p.at("b_R").upper, 0.15, 1e-12);
  EXPECT_NEAR(p.at("b_L").lower, -0.2, 1e-12);
  EXPECT_NEAR(p.at("b_L").upper, 0.16, 1e-12);
  const Robot dry = improved({fitted("coulomb", {0.1})}, {{{0.0, 0.2}}});
  EXPECT_NEAR(dry.effects.front().parameters.at("c").lower, 0.0, 1e-12);
  EXPECT_NEAR(effect_value(dry, "coulomb", "c"), 0.1, 1e-12);
}

TEST(ImprovedRobot, TheSameFrictionTwiceAddsUp) {
  const Robot robot = improved({fitted("coulomb", {0.2}), fitted("coulomb_asymmetric", {0.1, 0.3})});
  ASSERT_EQ(robot.effects.size(), 1u);
  EXPECT_NEAR(effect_value(robot, "coulomb_asymmetric", "c_R"), 0.3, 1e-12);
  EXPECT_NEAR(effect_value(robot, "coulomb_asymmetric", "c_L"), 0.5, 1e-12);
}

TEST(ImprovedRobot, SaysWhyARobotFileCannotCarryACause) {
  const auto refused = [](const FittedEffect& cause) {
    std::string why_not;
    EXPECT_FALSE(improved_robot(plain_robot(), plain_drive(), plain_drive().theta, {cause}, {}, why_not));
    return why_not;
  };
  EXPECT_NE(refused(fitted("sensor_time_offset", {}, {-0.02})).find("early"), std::string::npos);
  EXPECT_NE(refused(fitted("payload", {-30.0, 0.0})).find("mass"), std::string::npos);
  std::size_t free_forms = 0;
  for (const Effect& effect : effect_catalogue()) {
    if (effect.free_form) {
      const std::vector<double> shape = shape_grid(effect, plain_drive()).front();
      EXPECT_NE(refused({effect, shape, Eigen::VectorXd::Ones(std::ssize(effect.parameters))}).find(effect.name),
                std::string::npos);
      ++free_forms;
    }
  }
  EXPECT_GT(free_forms, 5U);
  FittedEffect own = fitted("coulomb", {0.1});
  own.effect.name = "tether";
  EXPECT_NE(refused(own).find("tether"), std::string::npos);
  own.coefficients.resize(0);
  std::string why_not;
  EXPECT_THROW(static_cast<void>(improved_robot(plain_robot(), plain_drive(), plain_drive().theta, {own}, {}, why_not)),
               InvalidArgument);
}

TEST(WithNominal, TakesThetaAndWidensAPriorThatExcludesIt) {
  Robot robot = plain_robot();
  robot.prior["mass"] = {20.0, 22.0};
  const Model model = model::make_model(robot);
  Eigen::VectorXd theta = plain_drive().theta;
  theta[0] *= 2.0;
  theta[2] = -0.1;
  const Robot changed = with_nominal(robot, model, theta);
  EXPECT_NEAR(changed.nominal.at("mass"), 42.0, 1e-9);
  EXPECT_EQ(changed.nominal.at("viscous_linear"), 0.0);
  EXPECT_EQ(changed.prior.at("mass").lower, 20.0);
  EXPECT_GE(changed.prior.at("mass").upper, 42.0);
  EXPECT_THROW(static_cast<void>(with_nominal(robot, model, theta.head(2))), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::gap::improved_robot_test
