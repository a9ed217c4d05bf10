// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/differential_drive.hpp"
#include "model/robot.hpp"
#include "model/single_axis.hpp"
#include "tests/support/fault_oracle.hpp"

namespace wheelwright::model::model_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const DifferentialDrive drive{.wheel_radius = 0.1, .track_width = 0.4};

Robot two_wheels(double wheel_radius, double track_width) {
  Robot robot;
  robot.wheel_radius = wheel_radius;
  robot.track_width = track_width;
  return robot;
}

std::vector<std::string> names(const Model& model) {
  std::vector<std::string> list;
  for (const Parameter& parameter : model.parameters) {
    list.push_back(parameter.name);
  }
  return list;
}

Eigen::MatrixXd regressor_at(const Model& model, std::vector<double> v, std::vector<double> a, double heading = 0.0) {
  const std::vector<double> error(v.size(), 0.0);
  return regressor(model, {.speed = v, .speed_error = error, .heading = heading}, a);
}

TEST(DifferentialDrive, WheelSpeedsAndBodySpeedsAreEachOthersInverse) {
  std::mt19937_64 generator(1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d wheels(static_cast<double>(generator() % 2001) - 1000.0,
                                 static_cast<double>(generator() % 2001) - 1000.0);
    EXPECT_LT((drive.wheel_speed(drive.body_speed(wheels)) - wheels).norm(), 1e-12 * (1.0 + wheels.norm()));
  }
  // A wheel that stands: the robot turns about it, v1 = v2·D/2.
  const Eigen::Vector2d v = drive.body_speed({2.0, 0.0});
  EXPECT_DOUBLE_EQ(v[0], 0.1);
  EXPECT_DOUBLE_EQ(v[0], v[1] * 0.2);
}

TEST(DifferentialDrive, MotionAndInputOfTheModelAreTheDrivesOwn) {
  const Model model = drive.model();
  EXPECT_NO_THROW(validate(model));
  const Eigen::Vector2d x(3.0, -1.5);
  EXPECT_LT((model.motion * x - drive.body_speed(x)).norm(), 1e-15);
  EXPECT_LT((model.input * x - drive.channels(x)).norm(), 1e-15);
}

TEST(DifferentialDrive, RegressorOfFourParametersIsThatOfThePaper) {
  const Model model = drive.model();
  EXPECT_THAT(names(model), ElementsAre("r_mass", "r_yaw_inertia", "r_viscous_linear", "r_viscous_yaw"));
  Eigen::MatrixXd y(2, 4);
  y << 3.0, 0.0, 0.5, 0.0,  //
      0.0, -4.0, 0.0, 0.7;
  EXPECT_EQ(regressor_at(model, {0.5, 0.7}, {3.0, -4.0}), y);
}

TEST(DifferentialDrive, FiveParametersAreTheProjectedWorldFriction) {
  DifferentialDrive five = drive;
  five.anisotropic_friction = true;
  const Model model = five.model();
  EXPECT_NO_THROW(validate(model));
  EXPECT_THAT(names(model), ElementsAre("r_mass", "r_yaw_inertia", "r_viscous_x", "r_viscous_y", "r_viscous_yaw"));
  EXPECT_TRUE(model.heading_used);
  const double r = drive.wheel_radius, f1 = 4.0, f2 = 7.0, f3 = 0.5, m = 20.0, inertia = 0.9;
  for (const double heading : {0.0, 0.3, 1.5, -2.4, 11.0}) {
    const Eigen::Matrix<double, 3, 2> s = kinematic_matrix(heading);
    const Eigen::Vector2d v(0.6, -0.8), a(0.2, 1.1);
    const Eigen::Vector2d expected = r * (Eigen::Vector2d(m * a[0], inertia * a[1]) +
                                          s.transpose() * Eigen::Vector3d(f1, f2, f3).asDiagonal() * s * v);
    const Eigen::VectorXd theta = r * (Eigen::VectorXd(5) << m, inertia, f1, f2, f3).finished();
    EXPECT_LT((regressor_at(model, {v[0], v[1]}, {a[0], a[1]}, heading) * theta - expected).norm(), 1e-14);
  }
}

TEST(DifferentialDrive, ErrorBoundOfTheFrictionTermsCoversEveryErrorOfHeadingAndSpeed) {
  DifferentialDrive five = drive;
  five.anisotropic_friction = true;
  const Model model = five.model();
  std::mt19937_64 generator(2);
  const auto unit = [&] { return 2.0 * static_cast<double>(generator() >> 11U) * 0x1p-53 - 1.0; };
  double tightest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double heading = 4.0 * unit(), heading_error = std::abs(unit()) * 0.3, error = std::abs(unit()) * 0.2;
    const std::vector<double> v = {unit(), unit()}, bound = {error, error}, exact_bound = {0.0, 0.0};
    const std::vector<double> exact_v = {v[0] + unit() * error, v[1]};
    for (const Term& term : model.terms) {
      if (term.kind != Term::Kind::function) {
        continue;
      }
      const TermValue value =
          term.function({.speed = v, .speed_error = bound, .heading = heading, .heading_error = heading_error});
      const TermValue exact =
          term.function({.speed = exact_v, .speed_error = exact_bound, .heading = heading + unit() * heading_error});
      EXPECT_LE(std::abs(exact.value - value.value), value.error);
      tightest = std::max(tightest, std::abs(exact.value - value.value) / value.error);
    }
  }
  EXPECT_GT(tightest, 0.8);  // and is not wasteful
}

TEST(DifferentialDrive, LeverArmOfTheTrackDoublesTheYawChannelOnly) {
  DifferentialDrive track = drive;
  track.lever_arm_is_track = true;
  const Eigen::Vector2d torque(1.3, -0.4);
  EXPECT_DOUBLE_EQ(track.channels(torque)[0], drive.channels(torque)[0]);
  EXPECT_DOUBLE_EQ(track.channels(torque)[1], 2.0 * drive.channels(torque)[1]);
}

TEST(DifferentialDrive, GeometryMustBePositive) {
  for (const double bad : {0.0, -0.1, std::nan("")}) {
    EXPECT_THROW(static_cast<void>(DifferentialDrive{.wheel_radius = bad, .track_width = 0.4}.model()),
                 InvalidArgument);
    EXPECT_THROW(static_cast<void>(DifferentialDrive{.wheel_radius = 0.1, .track_width = bad}.model()),
                 InvalidArgument);
  }
}

TEST(SingleAxis, RegressorHasWhatWasAskedFor) {
  EXPECT_THAT(names(SingleAxis{}.model()), ElementsAre("inertia", "viscous"));
  const Model model = SingleAxis{.coulomb = true, .offset = true}.model();
  EXPECT_NO_THROW(validate(model));
  EXPECT_EQ(regressor_at(model, {-0.5}, {2.0}), (Eigen::MatrixXd(1, 4) << 2.0, -0.5, -1.0, 1.0).finished());
  EXPECT_EQ(regressor_at(model, {0.0}, {2.0})(0, 2), 0.0);
}

TEST(SingleAxis, SignOfASpeedThatMayBeEitherIsBoundedSo) {
  const Model model = SingleAxis{.coulomb = true}.model();
  const Term& coulomb = model.terms[2];
  const std::vector<double> bound = {0.1};
  for (const double v : {-0.3, -0.05, 0.0, 0.05, 0.1, 0.3}) {
    const std::vector<double> speed = {v};
    const TermValue value = coulomb.function({.speed = speed, .speed_error = bound});
    for (const double exact : {v - 0.1, v + 0.1}) {
      const double sign = exact > 0.0 ? 1.0 : (exact < 0.0 ? -1.0 : 0.0);
      EXPECT_LE(std::abs(sign - value.value), value.error) << v;
    }
    EXPECT_EQ(value.error > 0.0, std::abs(v) <= 0.1) << v;
  }
}

// What reads terms as data goes by their shape.
TEST(TermShape, SaysWhatAFunctionIs) {
  const auto shapes = [](const Model& model) {
    std::vector<TermShape> list;
    for (const Term& term : model.terms) {
      if (term.kind == Term::Kind::function) {
        list.push_back(term.function.shape());
      }
    }
    return list;
  };
  DifferentialDrive all = drive;
  all.anisotropic_friction = all.coulomb = true;
  EXPECT_THAT(shapes(all.model()), ElementsAre(TermShape::along_x, TermShape::along_y, TermShape::sum_of_signs,
                                               TermShape::difference_of_signs));
  EXPECT_THAT(shapes(SingleAxis{.coulomb = true, .offset = true}.model()),
              ElementsAre(TermShape::sign_of_speed, TermShape::constant));
  EXPECT_EQ(TermFunction([](const MotionState&) { return TermValue{1.0, 0.0}; }).shape(), TermShape::own);
  EXPECT_EQ(TermFunction(TermShape::own), TermFunction());
  EXPECT_NE(TermFunction(TermShape::sum_of_signs), TermFunction(TermShape::difference_of_signs));
}

TEST(Parameter, KnowsWhatIsNeverNegativeAndWhatIsTheMovedMass) {
  Robot robot = two_wheels(0.1, 0.4);
  robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw", "coulomb"};
  robot.effects = {{"viscous_asymmetric", {{"b", {-1.0, 1.0}}}},
                   {"caster_drag", {{"c", {0.1, 0.2}}, {"p", {0.3, 0.3}}}}};
  Robot axis;
  axis.model = "single_axis";
  axis.parameters = {"inertia", "viscous", "coulomb", "offset"};
  std::vector<std::string> of_any_sign, moved;
  for (const Robot& each : {robot, axis}) {
    for (const Parameter& parameter : make_model(each).parameters) {
      if (!parameter.never_negative) {
        of_any_sign.push_back(parameter.physical);
      }
      if (parameter.moved_mass) {
        moved.push_back(parameter.physical);
      }
    }
  }
  EXPECT_THAT(of_any_sign, ElementsAre("viscous_asymmetric_b", "offset"));
  EXPECT_THAT(moved, ElementsAre("mass", "inertia"));
}

TEST(MakeModel, TakesTheParametersThatAreRequestedInTheModelsOrder) {
  Robot robot;
  robot.model = "single_axis";
  EXPECT_THAT(names(make_model(robot)), ElementsAre("inertia", "viscous"));
  robot.parameters = {"offset", "inertia", "coulomb"};
  const Model model = make_model(robot);
  EXPECT_THAT(names(model), ElementsAre("inertia", "coulomb", "offset"));
  EXPECT_EQ(regressor_at(model, {-0.5}, {2.0}), (Eigen::MatrixXd(1, 3) << 2.0, -1.0, 1.0).finished());
}

TEST(MakeModel, SaysWhatItDoesNotKnow) {
  Robot robot;
  robot.model = "hovercraft";
  EXPECT_THAT([&] { static_cast<void>(make_model(robot)); }, ThrowsMessage<InvalidArgument>(HasSubstr("hovercraft")));
  robot = two_wheels(0.1, 0.4);
  robot.nominal["mas"] = 3.0;
  EXPECT_THAT([&] { static_cast<void>(make_model(robot)); },
              ThrowsMessage<InvalidArgument>(testing::AllOf(HasSubstr("'mas'"), HasSubstr("yaw_inertia"))));
  robot.nominal.clear();
  robot.prior["viscous_x"] = {0.0, 1.0};  // of the anisotropic model
  EXPECT_THROW(static_cast<void>(make_model(robot)), InvalidArgument);
  robot.prior.clear();
  robot.parameters = {"offset"};
  EXPECT_THROW(static_cast<void>(make_model(robot)), InvalidArgument);
}

TEST(PriorBox, IsInUnitsOfThetaAndEnclosesTheDeclaredBounds) {
  Robot robot = two_wheels(0.0975, 0.381);
  robot.prior["mass"] = {5.0, 60.0};
  const Model model = make_model(robot);
  const PriorBox box = prior_box(robot, model);
  ASSERT_EQ(box.bounds.size(), 4U);
  EXPECT_THAT(box.declared, ElementsAre(true, false, false, false));
  EXPECT_LE(box.bounds[0].lower, 0.0975 * 5.0);
  EXPECT_GE(box.bounds[0].upper, 0.0975 * 60.0);
  EXPECT_NEAR(box.bounds[0].width(), 0.0975 * 55.0, 1e-12);
  for (std::size_t j = 1; j < 4; ++j) {
    EXPECT_EQ(box.bounds[j].lower, 0.0);  // no negative inertia or friction
    EXPECT_GT(box.bounds[j].upper, 1e3);
  }
}

TEST(PriorBox, CurrentNeedsTheMotorsConstantForPhysicalBounds) {
  Robot robot = two_wheels(0.03, 0.155);
  robot.effort = EffortKind::current;
  EXPECT_FALSE(prior_box(robot, make_model(robot)).declared[0]);
  robot.prior["mass"] = {1.0, 10.0};
  EXPECT_THROW(static_cast<void>(prior_box(robot, make_model(robot))), InvalidArgument);
  robot.motor.emplace().torque_constant = 0.05;
  robot.motor->gear_ratio = 10.0;
  const PriorBox box = prior_box(robot, make_model(robot));
  EXPECT_NEAR(box.bounds[0].upper, 10.0 * 0.03 / 0.5, 1e-12);  // A per m/s²: m·r/(N k_t)
}

TEST(Validate, NamesTheFieldThatIsWrong) {
  const Model good = drive.model();
  Model bad = good;
  bad.motion = Eigen::MatrixXd::Ones(2, 3);
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("Model::motion")));
  bad = good;
  bad.terms.pop_back();
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("r_viscous_yaw")));
  bad = good;
  bad.terms[1].output = 2;
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("terms[1].output")));
  bad = good;
  bad.input(0, 0) = std::nan("");
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("Model::input")));
  bad = good;
  bad.terms[0].kind = Term::Kind::function;
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("function")));
  bad = SingleAxis{}.model();
  bad.terms[0] = {.kind = Term::Kind::function, .function = TermShape::sum_of_signs};
  EXPECT_THAT([&] { validate(bad); }, ThrowsMessage<InvalidArgument>(HasSubstr("terms[0].function")));
}

// Closed forms: the mean of an odd or linear function over a symmetric interval; the share of it above zero.
TEST(Softened, IsTheMeanOverTheErrors) {
  const TermFunction sign([](const MotionState& s) { return TermValue{s.speed[0] > 0.0 ? 1.0 : -1.0, 0.0}; });
  const TermFunction line([](const MotionState& s) { return TermValue{3.0 * s.speed[0] - s.joint_speed[0], 0.0}; });
  const std::array<double, 1> error{0.5}, joint{2.0}, none{0.0};
  for (const double v : {-0.9, -0.5, -0.25, 0.0, 0.25, 0.5, 0.9}) {
    const std::array<double, 1> speed{v};
    const MotionState state{.speed = speed, .speed_error = error, .joint_speed = joint, .joint_error = none};
    EXPECT_NEAR(softened(sign, state), std::clamp(v / 0.5, -1.0, 1.0), 1e-15) << v;
    EXPECT_NEAR(softened(line, state), 3.0 * v - 2.0, 1e-14) << v;
  }
}

TEST(Regressor, RefusesTheWrongNumberOfCoordinates) {
  EXPECT_THROW(static_cast<void>(regressor_at(drive.model(), {0.5}, {1.0, 2.0})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(regressor_at(drive.model(), {0.5, 0.1}, {1.0})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::model::model_test
