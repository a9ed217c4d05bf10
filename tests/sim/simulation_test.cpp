// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "core/error.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::sim::simulation_test {
namespace {

using Kind = Trajectory::Kind;

constexpr std::array all_trajectories = {Kind::straight, Kind::circle, Kind::figure_eight, Kind::multi_sine,
                                         Kind::spin,     Kind::stops,  Kind::commissioning};

Scenario scenario() {
  Scenario s;
  s.robot.wheel_radius = 0.0975;
  s.robot.track_width = 0.381;
  s.robot.hold = Hold::zero_order;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  s.duration = 60.0;
  return s;
}

Scenario noisy() {
  Scenario s = scenario();
  s.sensors.wheel_speed = 0.05;
  s.sensors.wheel_angle = 0.001;
  s.sensors.effort = 0.02;
  s.sensors.position = 0.002;
  s.sensors.heading = 0.003;
  s.sensors.noise = NoiseShape::truncated_gaussian;
  return s;
}

double largest_difference(const LogTable& a, const LogTable& b, std::string_view column) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.rows(); ++i) {
    largest = std::max(largest, std::abs(a.column(column)[i] - b.column(column)[i]));
  }
  return largest;
}

// Largest violation of the model over one sampling period, integrated exactly for torque held (or linear) between
// stamps: with f = F̄11, ∫ of (15) is  ∫[1 1; ℓ −ℓ]τ = r (M̄ Δv + F̄ Δq)  where Δq is made of wheel angles.
double integrated_violation(const Scenario& s, const LogTable& log) {
  const Model model = model::make_model(s.robot);
  const Eigen::VectorXd theta = true_parameters(s, model);
  const bool held = s.robot.hold == Hold::zero_order;
  double worst = 0.0;
  for (std::size_t i = 0; i + 1 < log.rows(); ++i) {
    const auto pair = [&](const char* right, const char* left, std::size_t row) {
      return Eigen::Vector2d(log.column(right)[row], log.column(left)[row]);
    };
    const Eigen::Vector2d dv = model.motion * (pair("omega_r", "omega_l", i + 1) - pair("omega_r", "omega_l", i));
    const Eigen::Vector2d dq = model.motion * (pair("phi_r", "phi_l", i + 1) - pair("phi_r", "phi_l", i));
    const Eigen::Vector2d torque =
        held ? pair("tau_r", "tau_l", i)
             : Eigen::Vector2d(0.5 * (pair("tau_r", "tau_l", i) + pair("tau_r", "tau_l", i + 1)));
    const Eigen::Vector2d left = (log.t[i + 1] - log.t[i]) * (model.input * torque);
    const Eigen::Vector2d right(theta[0] * dv[0] + theta[2] * dq[0], theta[1] * dv[1] + theta[3] * dq[1]);
    worst = std::max(worst, (left - right).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(Simulation, NoiseFreeLogSatisfiesTheModelExactlyInBothHoldsAndConventions) {
  for (const Kind kind : all_trajectories) {
    for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
      for (const bool track : {false, true}) {
        Scenario s = scenario();
        s.trajectory.kind = kind;
        s.robot.hold = hold;
        s.robot.lever_arm_is_track = track;
        s.time_jitter = 0.3;
        // Rounding: angles of some hundred rad carry 1e-13, times r θ.
        EXPECT_LT(integrated_violation(s, simulate(s)), 1e-12) << static_cast<int>(kind);
      }
    }
  }
}

TEST(Simulation, LeverArmOfTheTrackDoublesTheTrueYawParameters) {
  Scenario s = scenario();
  const Eigen::VectorXd half = true_parameters(s, model::make_model(s.robot));
  s.robot.lever_arm_is_track = true;
  const Eigen::VectorXd full = true_parameters(s, model::make_model(s.robot));
  EXPECT_LT((full - half.cwiseProduct(Eigen::Vector4d(1.0, 2.0, 1.0, 2.0))).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(half[0], 0.0975 * 21.0);
}

// Five parameters from an exact log by least squares on (15) averaged over a few periods: inertia columns exactly, from
// speeds, friction columns by the trapezoidal rule.
TEST(Simulation, AnisotropicFrictionIsFoundInTheRegressorOfFiveParameters) {
  Scenario s = scenario();
  s.robot.anisotropic_friction = true;
  s.parameters.viscous_y = 9.0;
  s.trajectory.kind = Kind::figure_eight;
  const LogTable log = simulate(s);
  const Model model = model::make_model(s.robot);
  ASSERT_EQ(model.p(), 5U);
  const auto error_with = [&](std::size_t stride) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(5, 5);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(5);
    const auto wheels = [&](std::size_t i) {
      return Eigen::Vector2d(log.column("omega_r")[i], log.column("omega_l")[i]);
    };
    const auto instant = [&](std::size_t i, const Eigen::Vector2d& acceleration) {
      const Eigen::Vector2d v = model.motion * wheels(i);
      const std::array<double, 2> speed = {v[0], v[1]}, error = {0.0, 0.0}, rate = {acceleration[0], acceleration[1]};
      return model::regressor(model, {.speed = speed, .speed_error = error, .heading = log.column("theta")[i]}, rate);
    };
    for (std::size_t i = 0; i + stride < log.rows(); i += stride) {
      const double h = log.t[i + stride] - log.t[i];
      const Eigen::Vector2d mean_acceleration = model.motion * (wheels(i + stride) - wheels(i)) / h;
      const Eigen::MatrixXd y = 0.5 * (instant(i, mean_acceleration) + instant(i + stride, mean_acceleration));
      Eigen::Vector2d torque = Eigen::Vector2d::Zero();
      for (std::size_t k = i; k < i + stride; ++k) {
        torque += Eigen::Vector2d(log.column("tau_r")[k], log.column("tau_l")[k]) / static_cast<double>(stride);
      }
      normal += y.transpose() * y;
      right += y.transpose() * (model.input * torque);
    }
    const Eigen::VectorXd found = normal.ldlt().solve(right), truth = true_parameters(s, model);
    return ((found - truth).array() / truth.array()).abs().maxCoeff();
  };
  // The trapezoidal rule is of second order: four times the period, sixteen times the error (and a margin of a third).
  EXPECT_LT(error_with(1), 1e-3);
  EXPECT_GT(error_with(8), 0.66 * 16.0 * error_with(2));
}

TEST(Simulation, SpeedsAreTheDerivativeOfAnglesAndPoseIsTheirOdometry) {
  Scenario s = scenario();
  s.rate = 1000.0;
  s.duration = 20.0;
  s.robot.hold = Hold::first_order;
  const LogTable log = simulate(s);
  const double h = 1e-3;
  for (std::size_t i = 1; i + 1 < log.rows(); ++i) {
    // h² times the third derivative of the angle: below 300 rad/s³ here (torque ramps), a sixth of that, and slack 2.
    EXPECT_NEAR((log.column("phi_r")[i + 1] - log.column("phi_r")[i - 1]) / (2.0 * h), log.column("omega_r")[i], 1e-4);
    const double turn = 0.0975 / 0.381 * (log.column("phi_r")[i] - log.column("phi_l")[i]);
    EXPECT_NEAR(log.column("theta")[i], turn, 1e-11);
  }
}

TEST(Simulation, TrackingErrorFallsOnEveryTrajectory) {
  for (const Kind kind : all_trajectories) {
    Scenario s = scenario();
    s.trajectory.kind = kind;
    s.initial_pose_error = kind == Kind::spin ? Eigen::Vector3d(0.2, 0.0, 0.5) : Eigen::Vector3d(-0.2, 0.3, 0.5);
    const auto error_after = [&](double duration) {
      s.duration = duration;
      Simulation simulation(s);
      LogBlock block;
      while (simulation.next(block)) {
      }
      return (simulation.plant().state().pose - simulation.reference_pose()).norm();
    };
    const double start = s.initial_pose_error.norm();
    // Turning on the spot cannot take away an error along the wheel axis at once: half is enough there.
    EXPECT_LT(error_after(60.0), (kind == Kind::spin ? 0.5 : 0.02) * start) << static_cast<int>(kind);
  }
}

TEST(Simulation, TrackingErrorVanishesWithThePeriod) {
  const auto error_at = [](double rate) {
    Scenario s = scenario();
    s.trajectory.kind = Kind::figure_eight;
    s.rate = rate;
    s.duration = 30.0;
    Simulation simulation(s);
    LogBlock block;
    while (simulation.next(block)) {
    }
    return (simulation.plant().state().pose - simulation.reference_pose()).norm();
  };
  EXPECT_LT(error_at(400.0), 0.6 * error_at(200.0));  // first order in the period
  EXPECT_LT(error_at(200.0), 1e-2);
}

TEST(Simulation, WrongNominalParametersStillTrack) {
  Scenario s = scenario();
  s.robot.nominal = {{"mass", 16.0}, {"yaw_inertia", 1.2}, {"viscous_linear", 2.0}};
  EXPECT_EQ(nominal_parameters(s).mass, 16.0);
  EXPECT_EQ(nominal_parameters(s).viscous_y, 2.0);
  EXPECT_EQ(nominal_parameters(s).viscous_yaw, 0.5);
  Simulation simulation(s);
  LogBlock block;
  double worst = 0.0;
  while (simulation.next(block)) {
    worst = std::max(worst, (simulation.plant().state().pose - simulation.reference_pose()).norm());
  }
  EXPECT_LT(worst, 0.1);
}

TEST(Simulation, CommissioningMovesEverythingBothWays) {
  const LogTable log = simulate(scenario());
  const DifferentialDrive drive = drive_of(scenario().robot);
  Eigen::Vector2d lowest = Eigen::Vector2d::Zero(), highest = Eigen::Vector2d::Zero();
  std::size_t standing = 0;
  for (std::size_t i = 0; i < log.rows(); ++i) {
    const Eigen::Vector2d v = drive.body_speed({log.column("omega_r")[i], log.column("omega_l")[i]});
    lowest = lowest.cwiseMin(v);
    highest = highest.cwiseMax(v);
    standing += v.cwiseAbs().maxCoeff() < 0.01 ? 1 : 0;
  }
  EXPECT_LT(lowest[0], -0.2);
  EXPECT_GT(highest[0], 0.4);
  EXPECT_LT(lowest[1], -0.4);
  EXPECT_GT(highest[1], 0.4);
  EXPECT_GT(standing, log.rows() / 50);
}

TEST(Simulation, NoiseStaysInsideItsBoundsAndDoesNotChangeTheMotion) {
  Scenario s = noisy();
  s.duration = 2000.0;
  const LogTable clean = simulate([&] {
    Scenario quiet = s;
    quiet.sensors = {};
    return quiet;
  }());
  const LogTable log = simulate(s);
  ASSERT_EQ(log.rows(), 200001U);
  for (const auto& [bound, columns] :
       {std::pair{s.sensors.wheel_speed, std::vector{"omega_r", "omega_l"}},
        std::pair{s.sensors.wheel_angle, std::vector{"phi_r", "phi_l"}},
        std::pair{s.sensors.effort, std::vector{"tau_r", "tau_l"}},
        std::pair{s.sensors.position, std::vector{"x", "y"}}, std::pair{s.sensors.heading, std::vector{"theta"}}}) {
    for (const char* column : columns) {
      const double largest = largest_difference(clean, log, column);
      EXPECT_LE(largest, bound) << column;
      EXPECT_GT(largest, 0.99 * bound) << column;
    }
  }
  EXPECT_EQ(largest_difference(clean, log, "command_r"), 0.0);
}

TEST(Simulation, EncoderErrsByHalfACountAndSpeedsAreItsDifferences) {
  Scenario s = scenario();
  s.sensors.sampling = Sampling::interval;
  s.sensors.encoder_counts_per_turn = 512.0;
  const LogTable log = simulate(s);
  Scenario exact = s;
  exact.sensors.encoder_counts_per_turn.reset();
  const LogTable truth = simulate(exact);
  const double count = 2.0 * std::numbers::pi / 512.0, h = 0.01;
  EXPECT_LE(largest_difference(log, truth, "phi_r"), 0.5 * count * (1.0 + 1e-12));
  EXPECT_GT(largest_difference(log, truth, "phi_r"), 0.49 * count);
  EXPECT_LE(largest_difference(log, truth, "omega_l"), count / h * (1.0 + 1e-12));
  double counts = 0.0;
  for (std::size_t i = 0; i < log.rows(); ++i) {
    EXPECT_NEAR(log.t[i], (static_cast<double>(i) + 0.5) * h, 1e-12);
    const double whole = log.column("omega_r")[i] * h / count;
    EXPECT_NEAR(whole, std::round(whole), 1e-8);
    counts += whole;
  }
  // The sum of the differences is the angle: the error does not add up.
  EXPECT_NEAR(counts * count, truth.column("phi_r").back() + 0.5 * h * truth.column("omega_r").back(), 2.0 * count);
}

TEST(Simulation, IntervalTorqueIsTheMeanOverTheInterval) {
  Scenario s = scenario();
  s.robot.hold = Hold::first_order;
  const LogTable instants = simulate(s);
  s.sensors.sampling = Sampling::interval;
  const LogTable intervals = simulate(s);
  ASSERT_EQ(intervals.rows() + 1, instants.rows());
  for (std::size_t i = 0; i < intervals.rows(); ++i) {
    const double mean = 0.5 * (instants.column("tau_l")[i] + instants.column("tau_l")[i + 1]);
    EXPECT_NEAR(intervals.column("tau_l")[i], mean, 1e-11);
    const double difference = (instants.column("phi_l")[i + 1] - instants.column("phi_l")[i]) / 0.01;
    EXPECT_NEAR(intervals.column("omega_l")[i], difference, 1e-9);
  }
}

TEST(Simulation, SameSeedSameLogInBlocksOfAnySize) {
  Scenario s = noisy();
  s.time_jitter = 0.2;
  s.gaps = {{5.0, 6.0}};
  const LogTable whole = simulate(s);
  for (const std::size_t rows : {1UL, 7UL, 100000UL}) {
    Simulation simulation(s, rows);
    for (int pass = 0; pass < 2; ++pass) {  // rewound, too
      const LogTable again = read_all(simulation);
      EXPECT_EQ(again.t, whole.t);
      EXPECT_EQ(again.columns, whole.columns);
      EXPECT_EQ(again.segment_starts, whole.segment_starts);
    }
  }
  s.seed = 2;
  EXPECT_NE(simulate(s).columns, whole.columns);
}

TEST(Simulation, JitterKeepsTheOrderAndItsBound) {
  Scenario s = scenario();
  s.time_jitter = 0.4;
  const LogTable log = simulate(s);
  double largest = 0.0;
  for (std::size_t i = 1; i < log.rows(); ++i) {
    EXPECT_GT(log.t[i], log.t[i - 1]);
    largest = std::max(largest, std::abs(log.t[i] * 100.0 - static_cast<double>(i)));
  }
  EXPECT_LE(largest, 0.4 + 1e-9);
  EXPECT_GT(largest, 0.39);
}

TEST(Simulation, GapsSplitTheLogAndTheRobotDrivesOn) {
  Scenario s = scenario();
  const LogTable whole = simulate(s);
  s.gaps = {{10.0, 12.0}, {30.0, 30.5}};
  const LogTable log = simulate(s);
  EXPECT_EQ(log.rows(), whole.rows() - 200 - 50);
  ASSERT_THAT(log.segment_starts, ::testing::ElementsAre(0U, 1000U, 2800U));
  EXPECT_EQ(log.t[1000], 12.0);
  EXPECT_EQ(log.column("phi_r").back(), whole.column("phi_r").back());
}

TEST(Simulation, FaultyLogIsTheHealthyOneUntilTheOnset) {
  Scenario s = scenario();
  const LogTable healthy = simulate(s);
  s.faults = {{model::Fault::Kind::wheel_radius_left, -0.01, {model::TimeProfile::Shape::step, 20.0}}};
  const LogTable faulty = simulate(s);
  const auto& a = healthy.column("omega_l");
  const auto& b = faulty.column("omega_l");
  EXPECT_TRUE(std::equal(a.begin(), a.begin() + 2000, b.begin()));
  EXPECT_NEAR(b[2000], a[2000] * 0.0975 / 0.0875, 1e-9);  // the same motion on a smaller wheel
}

TEST(Simulation, CurrentIsTorqueOverTheMotorsConstant) {
  Scenario s = scenario();
  const LogTable torque = simulate(s);
  s.robot.effort = model::EffortKind::current;
  s.robot.motor.emplace().torque_constant = 0.05;
  s.robot.motor->gear_ratio = 20.0;
  s.robot.effort_unsigned = true;
  const LogTable current = simulate(s);
  for (std::size_t i = 0; i < torque.rows(); ++i) {
    EXPECT_NEAR(current.column("current_r")[i], std::abs(torque.column("tau_r")[i]) / 1.0, 1e-15);
  }
}

TEST(Simulation, TorqueSaturatesOnlyWhenAsked) {
  Scenario s = scenario();
  const auto largest = [&] {
    const LogTable log = simulate(s);
    double most = 0.0;
    for (const double tau : log.column("tau_r")) {
      most = std::max(most, std::abs(tau));
    }
    return most;
  };
  const double free = largest();
  EXPECT_GT(free, 0.4);
  s.robot.limits["effort"] = 0.3;
  EXPECT_EQ(largest(), free);
  s.torque_limit = 0.3;
  EXPECT_EQ(largest(), 0.3);
}

TEST(Simulation, RefusesAScenarioThatMakesNoSense) {
  const auto refused = [](auto change, const char* field) {
    Scenario s = scenario();
    change(s);
    EXPECT_THAT([&] { Simulation simulation(s); },
                ::testing::ThrowsMessage<InvalidArgument>(::testing::HasSubstr(field)));
  };
  refused([](Scenario& s) { s.rate = 0.0; }, "rate");
  refused([](Scenario& s) { s.duration = std::nan(""); }, "duration");
  refused([](Scenario& s) { s.time_jitter = 0.5; }, "time_jitter");
  refused([](Scenario& s) { s.parameters.mass = 0.0; }, "mass");
  refused([](Scenario& s) { s.robot.wheel_radius = -1.0; }, "wheel_radius");
  refused([](Scenario& s) { s.robot.model = "single_axis"; }, "robot.model");
  refused([](Scenario& s) { s.sensors.effort = -0.1; }, "sensors.effort");
  refused([](Scenario& s) { s.sensors.angles = s.sensors.speeds = false; }, "sensors");
  refused([](Scenario& s) { s.gaps = {{1.0, 1.02}}; }, "gaps[0]");
  refused([](Scenario& s) { s.gaps = {{1.0, 2.0}, {1.5, 3.0}}; }, "gaps[1]");
  refused([](Scenario& s) { s.robot.effort = model::EffortKind::voltage; }, "robot.effort");
  refused([](Scenario& s) { s.robot.effort = model::EffortKind::current; }, "torque_constant");
  refused([](Scenario& s) { s.trajectory.period = 0.0; }, "trajectory.period");
  refused([](Scenario& s) { s.faults = {{model::Fault::Kind::wheel_radius, -0.1, {}}}; }, "faults");
  EXPECT_THROW(Simulation(scenario(), 0), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::sim::simulation_test
