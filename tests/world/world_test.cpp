// SPDX-License-Identifier: Apache-2.0
// The other world against closed forms: what it drives is the nominal model, and each effect adds what it should.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "tests/world/case.hpp"

namespace {

using namespace wheelwright;
using namespace wheelwright::reality;

constexpr double beta = 20.0;

struct World {
  explicit World(std::uint64_t seed) {
    Random draws(seed, 0, 1);
    robot = draw_robot(draws, Lot());
    drive = draw_drive(robot, draws, 40.0);
  }

  [[nodiscard]] Signals healthy() const {
    std::vector<reality::Effect> none;
    return signals_of(robot, run_world(robot, none, drive));
  }
  [[nodiscard]] Signals with(std::string_view name, std::vector<std::pair<std::string, double>>& parameters) const {
    std::vector<reality::Effect> effects;
    effects.push_back(find_entry(name).make(robot, Random(5, 0, 9), 1.0));
    parameters = effects[0].parameters;
    return signals_of(robot, run_world(robot, effects, drive));
  }

  RobotDesign robot;
  Drive drive;
};

/// The torque beyond the healthy model's, low-passed: s, then d = τ_R − τ_L.
Eigen::VectorXd additional(const RobotDesign& robot, const Signals& g) {
  const double r = robot.radius;
  const double arm = robot.half_track;
  const Eigen::VectorXd s = g.s - r * (robot.mass * g.a1 + 2.0 * robot.damping / (r * r) * g.v1);
  const Eigen::VectorXd d =
      g.d - r / arm * (robot.yaw_inertia * g.a2 + 2.0 * robot.damping * arm * arm / (r * r) * g.v2);
  Eigen::VectorXd both(2 * g.rows());
  both << low_pass(s, g.period, beta), low_pass(d, g.period, beta);
  return both;
}

Eigen::VectorXd expected(const Signals& g, const Eigen::VectorXd& s, const Eigen::VectorXd& d) {
  Eigen::VectorXd both(2 * g.rows());
  both << low_pass(s, g.period, beta), low_pass(d, g.period, beta);
  return both;
}

TEST(World, HealthyRobotIsTheNominalModelToAThousandth) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const World world(seed);
    const Gap gap = measure_gap(world.robot, world.healthy(), beta);
    EXPECT_LT(gap.before, 0.1) << "per cent of the torque, with the lumped mass and inertia";
    EXPECT_LE(gap.after, gap.before);
    EXPECT_NEAR(gap.fitted[0] / world.robot.mass, 1.0, 2e-3);
    EXPECT_NEAR(gap.fitted[2] / world.robot.yaw_inertia, 1.0, 2e-3);
  }
}

TEST(World, OffsetCentreOfMassAddsThePowerNeutralPair) {
  const World world(1);
  std::vector<std::pair<std::string, double>> parameters;
  const Signals g = world.with("com_longitudinal", parameters);
  ASSERT_EQ(parameters[0].first, "a");
  const double scale = world.robot.radius * world.robot.mass * parameters[0].second;
  // The chassis' own inertia about the axle has grown by m x²: a change of the nominal parameters.
  const double shift = parameters[1].second;
  const double grown = world.robot.body.chassis_mass * shift * shift * world.robot.radius / world.robot.half_track;
  const Eigen::VectorXd form = expected(g, -scale * g.v2.cwiseProduct(g.v2),
                                        scale / world.robot.half_track * g.v1.cwiseProduct(g.v2) + grown * g.a2);
  EXPECT_LT((additional(world.robot, g) - form).norm(), 0.02 * form.norm());
}

TEST(World, SlopeAddsWeightByHeading) {
  const World world(2);
  std::vector<std::pair<std::string, double>> parameters;
  const Signals g = world.with("slope", parameters);
  const double scale = world.robot.radius * world.robot.mass;
  const Eigen::VectorXd form = expected(
      g,
      scale *
          (parameters[0].second * g.heading.array().cos() + parameters[1].second * g.heading.array().sin()).matrix(),
      Eigen::VectorXd::Zero(g.rows()));
  EXPECT_LT((additional(world.robot, g) - form).norm(), 0.02 * form.norm());
}

TEST(World, DryFrictionOfTheJointsAddsItsTorqueBySign) {
  const World world(1);
  std::vector<std::pair<std::string, double>> parameters;
  const Signals g = world.with("coulomb_asymmetric", parameters);
  const Eigen::VectorXd r = parameters[0].second * (g.speed[right] / 0.02).array().tanh().matrix();
  const Eigen::VectorXd l = parameters[1].second * (g.speed[left] / 0.02).array().tanh().matrix();
  const Eigen::VectorXd form = expected(g, r + l, r - l);
  const Eigen::VectorXd real = additional(world.robot, g);
  // At rest dry friction takes any value up to its limit: the form holds where wheels turn.
  EXPECT_GT(real.dot(form) / (real.norm() * form.norm()), 0.97);
  EXPECT_NEAR(real.dot(form) / form.squaredNorm(), 1.0, 0.05);
}

TEST(World, EveryEffectHasANameOfItsOwn) {
  for (const Entry& entry : catalogue()) {
    EXPECT_EQ(&find_entry(entry.name), &entry);
  }
  EXPECT_THROW(static_cast<void>(find_entry("gremlin")), InvalidArgument);
}

TEST(Logger, LosesItsShareInItsBurstsAndKeepsTheRest) {
  constexpr std::size_t rows = 200000;
  constexpr double period = 0.01;
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r"};
  log.columns.assign(3, {});
  for (std::size_t k = 0; k < rows; ++k) {
    log.t.push_back(period * static_cast<double>(k));
    for (std::vector<double>& column : log.columns) {
      column.push_back(static_cast<double>(k));
    }
  }
  const LogTable written = write_down({0.2, 0.02, 4.0, 3}, log, period, Random(1, 2, 3));
  EXPECT_NEAR(1.0 - static_cast<double>(written.rows()) / rows, 0.02, 0.002);
  std::size_t bursts = 0;
  double jitter = 0.0;
  for (std::size_t k = 1; k < written.rows(); ++k) {
    const double row = written.columns[2][k];
    bursts += row > written.columns[2][k - 1] + 1.5 ? 1 : 0;
    jitter = std::max(jitter, std::abs(written.t[k] - period * row));
    ASSERT_GT(written.t[k], written.t[k - 1]);
    // The mean of a straight line over three rows is a row late.
    ASSERT_NEAR(written.columns[0][k], std::max(row - 1.0, 0.5 * row), 1e-6);
  }
  EXPECT_NEAR(static_cast<double>(rows - written.rows()) / static_cast<double>(bursts), 4.0, 0.4);
  EXPECT_NEAR(jitter, 0.2 * period, 0.01 * period);

  const LogTable same = write_down({}, log, period, Random(1, 2, 3));
  EXPECT_EQ(same.columns, log.columns);
  EXPECT_EQ(same.rows(), log.rows());
}

TEST(Case, AnOrdinaryLogChangesNothingButTheLog) {
  Request request;
  request.seed = 9;
  request.duration = 50.0;
  request.kind = Kind::triple;
  const Case plain = make_case(request, 1);
  request.ordinary = true;
  const Case ordinary = make_case(request, 1);
  ASSERT_EQ(plain.causes.size(), 3U);
  std::vector<std::string_view> names;
  for (std::size_t k = 0; k < 3; ++k) {
    names.push_back(plain.causes[k].of.entry->name);
    EXPECT_EQ(plain.causes[k].parameters, ordinary.causes[k].parameters);
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end()) << "three different ones";
  EXPECT_EQ(plain.gap.after, ordinary.gap.after);
  EXPECT_LT(ordinary.real.rows(), plain.real.rows());
  EXPECT_GT(static_cast<double>(ordinary.real.rows()), 0.95 * static_cast<double>(plain.real.rows()));
}

TEST(Case, OneSeedOneCase) {
  Request request;
  request.seed = 7;
  request.duration = 50.0;
  request.effect = "torque_bias";
  const Case first = make_case(request, 3);
  const Case again = make_case(request, 3);
  EXPECT_EQ(first.real.columns, again.real.columns);
  EXPECT_EQ(first.fresh.columns, again.fresh.columns);
  EXPECT_EQ(first.causes[0].parameters, again.causes[0].parameters);
  EXPECT_NE(first.real.columns, first.fresh.columns);
  EXPECT_GT(first.gap.after, 3.0 * first.oracle.floor_percent * 0.8);
}

}  // namespace
