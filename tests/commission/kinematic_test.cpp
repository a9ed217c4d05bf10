// SPDX-License-Identifier: Apache-2.0
// The kinematic residual from log to decision, on simulated drives whose truth is known.
#include "commission/kinematic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/watch/detector_walk.hpp"
#include "detector/online_model.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::commission::kinematic_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing_support::posed_drive;
using testing_support::straight_drive;
using testing_support::true_kinematics;
using Status = KinematicCommissioning::Status;

KinematicCommissioning commissioned(const Scenario& s) {
  Simulation log(s);
  return commission_robot(log, s.robot).kinematic;
}

TEST(Kinematic, TheTruthIsInTheSetUnderDeclaredNoise) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Scenario s = posed_drive(seed);
    const KinematicCommissioning result = commissioned(s);
    ASSERT_EQ(result.status, Status::done) << result.message;
    ASSERT_FALSE(result.declared_too_small);
    for (const OutputNoise& o : result.noise) {
      ASSERT_EQ(o.origin, core::NoiseOrigin::declared);
    }
    const Eigen::VectorXd truth = true_kinematics(s.robot);
    for (std::size_t j = 0; j < 4; ++j) {
      const KinematicParameter& p = result.parameters[j];
      const double value = truth[static_cast<Eigen::Index>(j)];
      EXPECT_LE(p.lower, value) << p.name;
      EXPECT_GE(p.upper, value) << p.name;
      EXPECT_LT(p.upper - p.lower, 0.2 * value) << p.name;  // the prior alone is three times as wide
      ASSERT_TRUE(p.estimate.has_value());
      EXPECT_NEAR(*p.estimate, value, 0.01 * value) << p.name;
    }
    for (const bounds::HalfSpace& facet : result.model->facets) {
      EXPECT_LE(facet.a.dot(truth), facet.b);
    }
    ASSERT_EQ(result.validation.size(), 3u);
    for (const OutputValidation& v : result.validation) {
      EXPECT_GT(v.instants, 100u);
      EXPECT_EQ(v.outside, 0u);
    }
  }
}

TEST(Kinematic, BoundsAreEstimatedWhereNoiseIsNotDeclared) {
  Scenario s = posed_drive(4);
  s.robot.noise.position.value.reset();
  const KinematicCommissioning heading_only = commissioned(s);
  ASSERT_EQ(heading_only.status, Status::done) << heading_only.message;
  EXPECT_EQ(heading_only.noise[0].origin, core::NoiseOrigin::estimated);
  EXPECT_EQ(heading_only.noise[1].origin, core::NoiseOrigin::estimated);
  EXPECT_EQ(heading_only.noise[2].origin, core::NoiseOrigin::declared);
  s.robot.noise.heading.value.reset();
  const KinematicCommissioning none = commissioned(s);
  ASSERT_EQ(none.status, Status::done) << none.message;
  const Eigen::VectorXd truth = true_kinematics(s.robot);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(none.noise[i].origin, core::NoiseOrigin::estimated);
    EXPECT_GE(none.noise[i].bound, none.noise[i].learning);
  }
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_LE(none.parameters[j].lower, truth[static_cast<Eigen::Index>(j)]);
    EXPECT_GE(none.parameters[j].upper, truth[static_cast<Eigen::Index>(j)]);
  }
}

// A heading that comes late, which no yaw gain explains.
TEST(Kinematic, SaysWhenTheDeclaredNoiseIsTooSmall) {
  Scenario s = posed_drive(5);
  LogTable log = sim::simulate(s);
  double late = 0.0;
  for (double& heading : log.column("theta")) {  // by 0.3 s
    late += 0.03 * (heading - late);
    heading = late;
  }
  TableSource source(log);
  const KinematicCommissioning result = commission_robot(source, s.robot).kinematic;
  ASSERT_EQ(result.status, Status::done) << result.message;
  EXPECT_TRUE(result.declared_too_small);
  EXPECT_NE(result.message.find("declared noise"), std::string::npos);
  for (const OutputNoise& o : result.noise) {
    EXPECT_EQ(o.origin, core::NoiseOrigin::estimated);
    EXPECT_GT(o.bound, 0.0);
  }
}

// Every interval of a model that calls itself explained by declared noise must hold the truth, whatever the lag is.
TEST(Kinematic, APoseAtAnotherTimeThanTheWheelsTakesTheDeclaredNoiseAway) {
  int told = 0;
  for (const double lag : {-0.12, -0.05, 0.05, 0.12}) {
    const Scenario s = posed_drive(11);
    LogTable log = sim::simulate(s);
    const double step = log.t[1] - log.t[0];
    const auto shift = static_cast<std::ptrdiff_t>(std::lround(lag / step));
    for (const char* name : {"x", "y", "theta"}) {
      const std::vector<double> on_time = log.column(name);
      std::vector<double>& moved = log.column(name);
      for (std::size_t k = 0; k < moved.size(); ++k) {
        moved[k] = on_time[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
            static_cast<std::ptrdiff_t>(k) - shift, 0, static_cast<std::ptrdiff_t>(moved.size()) - 1))];
      }
    }
    TableSource source(log);
    const KinematicCommissioning result = commission_robot(source, s.robot).kinematic;
    ASSERT_EQ(result.status, Status::done) << result.message;
    EXPECT_TRUE(result.declared_too_small);
    if (result.delay) {
      ++told;
      EXPECT_NEAR(*result.delay, lag, 0.3 * std::abs(lag));
      EXPECT_THAT(result.message, HasSubstr(lag > 0.0 ? "s after them" : "s before them"));
    }
  }
  EXPECT_GT(told, 0);
}

// Half a unit that is cut off in every second makes wheels look smaller in speed, and so larger in radius.
TEST(Kinematic, IntervalsHoldTheTruthOfSpeedsThatAreRoundedOrCutOff) {
  for (const bool cut_off : {false, true}) {
    Scenario s = posed_drive(12, 30.0);
    s.robot.noise = {};
    s.robot.encoder_counts_per_turn.reset();
    s.robot.speed_source = model::SpeedSource::measured;
    s.sensors.angles = false;
    s.sensors.speeds = true;
    LogTable log = sim::simulate(s);
    double top = 0.0;
    for (const char* name : {"omega_r", "omega_l"}) {
      for (const double speed : log.column(name)) {
        top = std::max(top, std::abs(speed));
      }
    }
    const double unit = top / 60.0;
    for (const char* name : {"omega_r", "omega_l"}) {
      for (double& speed : log.column(name)) {
        speed = unit * (cut_off ? std::trunc(speed / unit) : std::round(speed / unit));
      }
    }
    TableSource source(log);
    const KinematicCommissioning result = commission_robot(source, s.robot).kinematic;
    ASSERT_EQ(result.status, Status::done) << result.message;
    EXPECT_THAT(result.message, HasSubstr("rounded or cut off"));
    const Eigen::VectorXd truth = true_kinematics(s.robot);
    for (std::size_t j = 0; j < 4; ++j) {
      EXPECT_LE(result.parameters[j].lower, truth[static_cast<Eigen::Index>(j)]) << result.parameters[j].name;
      EXPECT_GE(result.parameters[j].upper, truth[static_cast<Eigen::Index>(j)]) << result.parameters[j].name;
    }
  }
}

TEST(Kinematic, IsAbsentWithoutAPose) {
  Scenario s = posed_drive(6);
  s.sensors.pose = false;
  Simulation log(s);
  const Commissioning result = commission_robot(log, s.robot);
  EXPECT_EQ(result.kinematic.status, Status::absent);
  EXPECT_FALSE(result.model.kinematic.has_value());
  EXPECT_NE(result.kinematic.message.find("gyro_z"), std::string::npos);
  EXPECT_NE(std::ranges::find(result.notes, result.kinematic.message), result.notes.end());
}

// A heading that is measured by itself, beside encoders of all kinds: it is never said to be the wheels'; where nothing
// shows that it is not, this is said, with the way out (Try.TurtleBotByItsOdometryWhichIsNoPose sees it).
TEST(Kinematic, AHeadingOfItsOwnIsNeverSaidToBeTheWheels) {
  std::uint64_t seed = 30;
  int hidden = 0;
  for (const double rate : {50.0, 200.0}) {
    for (const double counts : {256.0, 2048.0, 8192.0}) {
      for (const double heading : {0.00002, 0.0002, 0.0007, 0.003}) {
        Scenario s = posed_drive(++seed);
        s.rate = rate;
        s.robot.encoder_counts_per_turn = s.sensors.encoder_counts_per_turn = counts;
        s.robot.noise.heading.value = s.sensors.heading = heading;
        Simulation log(s);
        const KinematicCommissioning result = commission_robot(log, s.robot).kinematic;
        if (result.status != Status::done) {
          EXPECT_THAT(result.message, AllOf(HasSubstr("cannot be told"), HasSubstr("pose_source: independent")));
          s.robot.pose_source = model::PoseSource::independent;
          Simulation again(s);
          EXPECT_EQ(commission_robot(again, s.robot).kinematic.status, Status::done);
          ++hidden;
        }
      }
    }
  }
  EXPECT_LT(hidden, 12);
}

// Odometry as a base driver publishes it, from the same encoder: margins on it would be those of a perfect sensor.
TEST(Kinematic, APoseFromTheWheelsIsNoMeasurementOfItsOwn) {
  const Scenario s = posed_drive(11);
  LogTable log = sim::simulate(s);
  const double r = s.robot.wheel_radius, gain = r / s.robot.track_width;
  const std::vector<double>&right = log.column("phi_r"), &left = log.column("phi_l");
  std::vector<double>&x = log.column("x"), &y = log.column("y"), &theta = log.column("theta");
  const std::vector<double> independent = theta;
  const auto integrate = [&](bool heading) {
    for (std::size_t k = 1; k < log.rows(); ++k) {
      const double a = right[k] - right[k - 1], b = left[k] - left[k - 1];
      theta[k] = heading ? theta[k - 1] + gain * (a - b) : independent[k];
      x[k] = x[k - 1] + 0.5 * r * (a + b) * std::cos(0.5 * (theta[k] + theta[k - 1]));
      y[k] = y[k - 1] + 0.5 * r * (a + b) * std::sin(0.5 * (theta[k] + theta[k - 1]));
    }
    TableSource source(log);
    return commission_robot(source, s.robot);
  };
  const Commissioning all = integrate(true);
  EXPECT_EQ(all.kinematic.status, Status::absent);
  EXPECT_FALSE(all.model.kinematic.has_value());
  EXPECT_NE(all.kinematic.message.find("wheel odometry over again"), std::string::npos) << all.kinematic.message;
  EXPECT_EQ(all.status, Commissioning::Status::done) << "the torque residual needs no pose";
  // Positions of the wheels under a heading of its own, as a filter of wheels and gyro makes them.
  const Commissioning positions = integrate(false);
  ASSERT_TRUE(positions.model.kinematic.has_value()) << positions.kinematic.message;
  EXPECT_FALSE(positions.model.kinematic->measurement.position);
  EXPECT_TRUE(positions.model.kinematic->measurement.heading);
  EXPECT_NE(positions.kinematic.message.find("x and y"), std::string::npos);
}

TEST(Kinematic, StraightDrivingLeavesTheTurnToThePrior) {
  const KinematicCommissioning result = commissioned(straight_drive(7, 20.0));
  ASSERT_TRUE(result.model.has_value()) << result.message;
  const Eigen::VectorXd truth = true_kinematics(straight_drive(7, 20.0).robot);
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_LE(result.parameters[j].lower, truth[static_cast<Eigen::Index>(j)]);
    EXPECT_GE(result.parameters[j].upper, truth[static_cast<Eigen::Index>(j)]);
  }
  EXPECT_GT(result.parameters[2].upper - result.parameters[2].lower, 0.2 * truth[2]);
}

TEST(Kinematic, AHealthyRobotRaisesNoAlarm) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Scenario s = posed_drive(seed);
    const KinematicCommissioning result = commissioned(s);
    s.seed = 100 + seed;
    s.trajectory.kind = sim::Trajectory::Kind::multi_sine;
    Simulation drive(s);
    const Detection d = detect(drive, make_detector(*result.model));
    EXPECT_GT(d.instants, 500u);
    EXPECT_TRUE(d.events.empty());
  }
}

// An unmatched slip reaches the torque equation through m ρ_U θ̇ alone: on a straight line it is invisible there.
TEST(Kinematic, SeesLateralSlipThatTheTorqueCannot) {
  Scenario learn = posed_drive(8);
  Simulation learning(learn);
  const Commissioning result = commission_robot(learning, learn.robot);
  ASSERT_TRUE(result.model.kinematic.has_value());

  Scenario slip = straight_drive(9, 20.0);
  const double onset = 10.0, window = result.model.kinematic->window;
  slip.faults = {{.kind = model::Fault::Kind::unmatched, .magnitude = 0.05, .profile = {.onset = onset}}};
  Simulation log(slip);
  const Detection torque = detect(log, make_detector(result.model));
  EXPECT_TRUE(torque.events.empty());
  const Detection kinematic = detect(log, make_detector(*result.model.kinematic));
  ASSERT_FALSE(kinematic.events.empty());
  const detector::Event& first = kinematic.events.front();
  EXPECT_EQ(first.output, 1u);  // lateral
  EXPECT_GT(first.start, onset);
  // |ρ_U| W = 5 cm exceeds the width of the threshold.
  const OutputTrace& lateral = kinematic.trace.outputs[1];
  double widest = 0.0;
  for (std::size_t k = 0; k < lateral.upper.size(); ++k) {
    widest = std::max(widest, lateral.upper[k] - lateral.lower[k]);
  }
  ASSERT_LT(widest, 0.05 * window);
  EXPECT_LE(first.alarm, onset + window + 0.02);
}

TEST(Kinematic, SaysHowLongTheWindowIs) {
  Scenario s = posed_drive(10);
  s.robot.kinematic_window = 0.5;
  const KinematicCommissioning result = commissioned(s);
  ASSERT_TRUE(result.model.has_value());
  EXPECT_EQ(result.model->window, 0.5);
  s.robot.kinematic_window = 100.0;
  EXPECT_EQ(commissioned(s).status, Status::nothing);
}

}  // namespace
}  // namespace wheelwright::commission::kinematic_test
