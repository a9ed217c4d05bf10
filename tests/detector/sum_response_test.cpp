// SPDX-License-Identifier: Apache-2.0
// What faults do to the weighted sums of the detector at a stated risk: rows against simulated logs of broken robots,
// and that margins at the stated risk are kept.
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/multiscale/sum_kernel.hpp"
#include "detector/multiscale/sum_margins.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/lost_rows.hpp"

namespace wheelwright::detector::sum_response_test {
namespace {

using core::kInfinity;
using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::commissioned_at_risk;
using testing_support::FaultyRun;
using testing_support::log_of;
using testing_support::Random;
using testing_support::random_run;

FaultyRun run_of(const Commissioned& robot, std::uint64_t seed, const Breakage& breakage) {
  FaultyRun run = random_run(robot, seed, breakage);
  run.drive.duration = 20.0;
  run.drive.robot.effort_changes = model::EffortChanges::at_samples;
  return run;
}

ReferenceMotion motion_of(const LogTable& table, const OnlineModel& m) {
  TableSource log(table);
  return read_reference(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
}

// The last instant before a fault.
std::size_t onset_of(const ReferenceMotion& motion, double onset) {
  return static_cast<std::size_t>(std::ranges::upper_bound(motion.instant, onset) - motion.instant.begin()) - 1;
}

std::vector<SumState> looks_of(const LogTable& table, const OnlineModel& model) {
  ScaleDetector detector(model);
  std::vector<std::size_t> pick;
  TableSource log(table);
  for (const auto& name : model.measurement.columns()) {
    pick.push_back(log.find(name).value());
  }
  std::vector<double> sample(pick.size());
  std::vector<SumState> looks;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = table.columns[pick[c]][k];
    }
    detector.step(table.t[k], sample);
    looks.insert(looks.end(), detector.looks().begin(), detector.looks().end());
  }
  return looks;
}

// Where the fault is in what the sensors show: held efforts, from the first falsified sample on.
std::size_t first_instant(const FaultyRun& run, const ReferenceMotion& motion) {
  const bool effort = run.fault.name.starts_with("effort");
  return onset_of(motion, run.onset) + (effort ? 1 : 0);
}

// Of one sum, largest over its looks: what its value has beside what the rows say, the response that they say, and what
// errors can do.
struct Agreement {
  double radius = 0.0, difference = 0.0, response = 0.0;
};

using Agreements = std::map<std::pair<std::size_t, std::size_t>, Agreement>;

// `kappa` of `fault` from instant `onset` on; without the sensors' errors.
Agreements compare(const OnlineModel& model, const Eigen::VectorXd& truth, const LogTable& healthy,
                   const LogTable& faulty, const model::FaultType& fault, double kappa, std::size_t onset) {
  const ReferenceMotion motion = motion_of(healthy, model);
  TableSource source(healthy);
  const auto drive = read_sum_drive(source, model, motion, {.any_log = false});
  EXPECT_TRUE(drive);
  const std::vector<SumState> looks = looks_of(faulty, model);
  EXPECT_EQ(looks.size(), drive->looks.size());
  const Eigen::VectorXd estimate = model.estimate;
  Agreements all;
  const std::vector<std::size_t> onsets{onset};
  SumResponse response(fault, model, motion, *drive);
  std::size_t visited = 0;
  response.walk(onsets, 12.0, [&](const SumResponse::At& at) {
    const SumRow row = at.row();
    const SumState& look = looks[at.look];
    const double healthy_value = row.y.dot(truth - estimate);
    const double moved = kappa * (row.g1.dot(truth) + row.c - row.s.dot(estimate)) + kappa * kappa * row.g2.dot(truth);
    Agreement& own = all[{look.weight, look.scale}];
    own.difference = std::max(own.difference, std::abs(look.value - healthy_value - moved));
    own.response = std::max(own.response, std::abs(moved));
    own.radius = std::max(own.radius, look.radius);
    EXPECT_NEAR(at.once, (row.g1 - row.s).dot(estimate) + row.c, 1e-9 * (1.0 + std::abs(at.once)));
    EXPECT_NEAR(at.twice, row.g2.dot(estimate), 1e-9 * (1.0 + std::abs(at.twice)));
    ++visited;
  });
  EXPECT_GT(visited, 100U);
  return all;
}

Agreements compare(const FaultyRun& run, double magnitude) {
  OnlineModel model = run.robot->model;
  model.measurement.count = 0.0;  // nothing is rounded here
  const LogTable faulty = log_of(run, magnitude, false);
  const LogTable healthy = run.simulated ? faulty : log_of(run, 0.0, false);
  return compare(model, sim::true_parameters(run.drive, model.model), healthy, faulty, run.fault,
                 run.fault.kappa(magnitude), first_instant(run, motion_of(healthy, model)));
}

double size_of(const FaultyRun& run) {
  return run.fault.unit == "1" ? 0.1 : run.fault.name.starts_with("effort") ? 0.3 : 0.2;
}

// The oracle: robots that break in the simulator, logs that a broken sensor writes.
TEST(SumResponse, IsWhatFaultsDoToTheSums) {
  for (const std::uint64_t seed : {1, 2}) {
    const Commissioned robot = commissioned_at_risk(seed);
    for (const Breakage& breakage : breakages()) {
      const FaultyRun run = run_of(robot, 100 + seed, breakage);
      for (const auto& [sum, agreement] : compare(run, run.side * size_of(run))) {
        EXPECT_LE(agreement.difference, 0.02 * agreement.response + 0.02 * agreement.radius)
            << breakage.fault << ", weight " << sum.first << ", scale " << sum.second << ", seed " << seed << ": "
            << agreement.response;
      }
    }
  }
}

// Speeds that jump beside a lost row: the sums hold the jump where the step that ends at its sample is known.
TEST(SumResponse, OfSpeedsThatJumpBesideLostRows) {
  Commissioned robot{testing_support::random_robot(3), {}};
  Scenario& s = robot.scenario;
  s.duration = 30.0;
  s.rate = 100.0;
  s.robot.effort_changes = model::EffortChanges::at_samples;
  s.robot.noise.effort.bias = 0.0;
  s.robot.encoder_counts_per_turn.reset();
  s.sensors.encoder_counts_per_turn.reset();
  s.sensors.angles = false;
  s.sensors.speeds = true;
  s.sensors.wheel_speed = 0.002;
  s.robot.noise.wheel_speed.value = 0.002;
  Simulation learned(s);
  const Commissioning result = commission_robot(learned, s.robot);
  ASSERT_TRUE(result.model.at_risk) << result.message;
  const OnlineModel& model = result.model;
  s.sensors.wheel_speed = s.sensors.effort = 0.0;
  s.duration = 20.0;
  Simulation exact(s);
  const LogTable whole = read_all(exact);
  const model::FaultType fault =
      model::find_fault(model::fault_catalogue(model.model, model.estimate), "encoder_scale_right");
  for (const std::vector<std::size_t>& lost : std::vector<std::vector<std::size_t>>{{}, {999}, {1001}, {999, 1001}}) {
    const LogTable healthy = testing_support::without_rows(whole, lost);
    const auto onset = static_cast<std::size_t>(std::ranges::lower_bound(healthy.t, whole.t[1000]) - healthy.t.begin());
    LogTable faulty = healthy;
    std::vector<double>& speed = faulty.column("omega_r");
    std::for_each(speed.begin() + static_cast<std::ptrdiff_t>(onset), speed.end(), [](double& x) { x *= 1.1; });
    const Eigen::VectorXd truth = sim::true_parameters(s, model.model);
    for (const auto& [sum, agreement] : compare(model, truth, healthy, faulty, fault, fault.kappa(0.1), onset)) {
      EXPECT_LE(agreement.difference, 0.002 * agreement.response + 0.002 * agreement.radius)
          << "weight " << sum.first << ", scale " << sum.second << ", lost " << testing::PrintToString(lost) << ": "
          << agreement.response;
    }
  }
}

// A robot that was broken before it begins to move differs from one that breaks while it stands in no sum; where a
// fault moves the wheels at once (slip), the onset has an impulse that the other has not.
TEST(SumResponse, WhatWasBrokenBeforeHasNoOnset) {
  const Commissioned robot = commissioned_at_risk(1);
  const FaultyRun run = run_of(robot, 101, breakages().front());
  const OnlineModel& model = run.robot->model;
  const LogTable healthy = log_of(run, 0.0, false);
  const ReferenceMotion motion = motion_of(healthy, model);
  TableSource source(healthy);
  const auto drive = read_sum_drive(source, model, motion);
  ASSERT_TRUE(drive);
  const auto catalogue = model::fault_catalogue(model.model, model.estimate);
  for (const char* name : {"effort_loss_right", "effort_bias_right", "payload_lost", "matched"}) {
    SumResponse response(model::find_fault(catalogue, name), model, motion, *drive);
    std::map<std::size_t, double> set_in;
    const std::vector<std::size_t> onsets{0};
    response.walk(onsets, kInfinity, [&](const SumResponse::At& at) { set_in[at.look] = at.once; });
    std::size_t visited = 0;
    double most = 0.0, apart = 0.0;
    response.walk_broken([&](const SumResponse::At& at) {
      EXPECT_EQ(at.onset, 0U);
      ASSERT_TRUE(set_in.contains(at.look));
      most = std::max(most, std::abs(at.once));
      apart = std::max(apart, std::abs(at.once - set_in[at.look]));
      ++visited;
    });
    EXPECT_EQ(visited, set_in.size()) << name;
    ASSERT_GT(most, 0.0) << name;
    if (std::string(name) == "matched") {
      // Weights rise from the beginning on: what an impulse there adds is small.
      EXPECT_LE(apart, 0.5 * most);
    } else {
      EXPECT_LE(apart, 1e-9 * most) << name;
    }
  }
  SumResponse drifting(model::find_fault(catalogue, "wheel_radius_drift"), model, motion, *drive);
  EXPECT_THROW(drifting.walk_broken([](const SumResponse::At&) {}), InvalidArgument);
}

// Rows of a rounded reading and of the motion itself: they are apart by what is allowed for.
TEST(SumResponse, AllowsForAMeasuredMotionsErrors) {
  const Commissioned robot = commissioned_at_risk(3);
  const OnlineModel& model = robot.model;
  double nearest = 0.0;
  for (const Breakage& breakage : breakages()) {
    const FaultyRun run = run_of(robot, 303, breakage);
    FaultyRun rounded = run;
    rounded.drive.sensors.effort = 0.0;
    std::map<std::size_t, SumRow> rows;
    for (const bool noisy : {false, true}) {
      OnlineModel read = model;
      read.measurement.count = noisy ? model.measurement.count : 0.0;
      const LogTable log = log_of(rounded, 0.0, noisy);
      const ReferenceMotion motion = motion_of(log, read);
      TableSource source(log);
      const auto drive = read_sum_drive(source, read, motion, {.any_log = false});
      ASSERT_TRUE(drive);
      SumResponse response(run.fault, read, motion, *drive);
      const std::vector<std::size_t> onsets{onset_of(motion, run.onset)};
      response.walk(onsets, 5.0, [&](const SumResponse::At& at) {
        if (drive->weights[drive->looks[at.look].weight].shape != SumWeight::Shape::constant) {
          return;  // the weights themselves are read
        }
        const SumRow row = at.row();
        const auto [exact, first] = rows.try_emplace(at.look, row);
        if (first) {
          return;
        }
        const Eigen::VectorXd& theta = model.estimate;
        const auto part = [&](const SumRow& r) { return (r.g1 - r.s).dot(theta) + r.c; };
        const double apart = std::abs(part(row) - part(exact->second));
        const double allowed = row.doubt + row.range.dot(theta.cwiseAbs());
        EXPECT_LE(apart, allowed * (1.0 + 1e-9) + 1e-12) << breakage.fault << ", look " << at.look;
        nearest = allowed > 0.0 ? std::max(nearest, apart / allowed) : nearest;
      });
    }
  }
  EXPECT_GT(nearest, 0.01);  // what is allowed for is not beyond all measure
}

// The smallest size that is certain at the stated risk within `window`, for the motion of this magnitude.
double certain_at_risk(const FaultyRun& run, double magnitude, double window) {
  const OnlineModel& model = run.robot->model;
  const LogTable table = log_of(run, run.simulated ? magnitude : 0.0, false);
  const ReferenceMotion motion = motion_of(table, model);
  TableSource log(table);
  const auto drive = read_sum_drive(log, model, motion);
  EXPECT_TRUE(drive);
  const std::vector<std::size_t> onsets{first_instant(run, motion)};
  const std::vector<FaultType> faults{run.fault};
  for (const FaultMargins& each : margins_at_risk(*drive, model, motion, faults, onsets, {.windows = {window}})) {
    if (each.side == run.side) {
      return each.onsets[0].certain.at(0);
    }
  }
  throw InvalidArgument("no such side");
}

// The same for the motion that a fault of that size leaves the robot.
std::optional<double> certain_on_its_own_motion(const FaultyRun& run, double window) {
  double size = certain_at_risk(run, 0.0, window);
  const double largest = run.side > 0.0 ? run.fault.range.upper : -run.fault.range.lower;
  for (int turn = 0; turn < 8 && size <= largest; ++turn) {
    const double needed = run.simulated ? certain_at_risk(run, run.side * size, window) : size;
    if (needed <= size) {
      return size;
    }
    size = needed * 1.001;
  }
  return std::nullopt;
}

// How many of `runs` had a certain size; it was seen in all of them.
int seen_in_time(std::uint64_t robot_seed, int runs) {
  const Commissioned robot = commissioned_at_risk(robot_seed);
  int certain = 0;
  for (int k = 0; k < runs; ++k) {
    const std::uint64_t seed = 1000 * robot_seed + static_cast<std::uint64_t>(k);
    const Breakage& breakage = breakages()[static_cast<std::size_t>(k) % breakages().size()];
    const FaultyRun run = run_of(robot, seed, breakage);
    const double window = std::vector<double>{0.5, 2.0, 8.0}[seed % 3];
    const auto size = certain_on_its_own_motion(run, window);
    if (!size) {
      continue;
    }
    ++certain;
    const LogTable log = log_of(run, run.side * *size, true);
    ScaleDetector detector(run.robot->model);
    std::vector<std::size_t> pick;
    TableSource source(log);
    for (const auto& name : run.robot->model.measurement.columns()) {
      pick.push_back(source.find(name).value());
    }
    double first = kInfinity;
    std::vector<double> sample(pick.size());
    for (std::size_t i = 0; i < log.rows(); ++i) {
      for (std::size_t c = 0; c < pick.size(); ++c) {
        sample[c] = log.columns[pick[c]][i];
      }
      if (detector.step(log.t[i], sample) && detector.alarm()) {
        first = std::min(first, log.t[i]);
      }
    }
    EXPECT_GE(first, run.onset) << breakage.fault << ", seed " << seed;
    EXPECT_LE(first, run.onset + window + 1.0 / run.drive.rate)
        << breakage.fault << " of " << run.side * *size << ", seed " << seed;
  }
  return certain;
}

TEST(MarginsAtRisk, AreKept) { EXPECT_GE(seen_in_time(1, 10) + seen_in_time(2, 10), 10); }

// Robots and drives by the hundred.
TEST(SlowMarginsAtRisk, AreKept) {
  int certain = 0;
  for (std::uint64_t seed = 10; seed < 30; ++seed) {
    certain += seen_in_time(seed, 20);
  }
  EXPECT_GE(certain, 200);
  RecordProperty("certain", certain);
}

TEST(MarginsAtRisk, LongerWindowsPromiseSmallerSizes) {
  const Commissioned robot = commissioned_at_risk(1);
  const LogTable table = log_of(run_of(robot, 7, breakages().front()), 0.0, true);
  const ReferenceMotion motion = motion_of(table, robot.model);
  TableSource log(table);
  const auto drive = read_sum_drive(log, robot.model, motion);
  ASSERT_TRUE(drive);
  EXPECT_GE(drive->miss, robot.model.at_risk->risk);
  EXPECT_LT(drive->miss, 1e-8);
  const std::vector<std::size_t> onsets{motion.instants() / 3, motion.instants() / 2};
  const auto faults = fault_catalogue(robot.model.model, robot.model.estimate);
  const auto all = margins_at_risk(*drive, robot.model, motion, faults, onsets);
  const auto again = margins_at_risk(*drive, robot.model, motion, faults, onsets, {.threads = 2});
  std::size_t certain = 0;
  for (std::size_t f = 0; f < all.size(); ++f) {
    for (std::size_t k = 0; k < onsets.size(); ++k) {
      const std::vector<double>& sizes = all[f].onsets[k].certain;
      EXPECT_TRUE(std::ranges::is_sorted(sizes, std::greater<>())) << all[f].fault.name;
      EXPECT_EQ(sizes, again[f].onsets[k].certain);
      certain += !sizes.empty() && sizes.back() < kInfinity ? 1 : 0;
      EXPECT_TRUE(!all[f].fault.held_effort || sizes.back() == kInfinity);  // what it stands at is not known
    }
  }
  EXPECT_GT(certain, all.size());
}

// The recursion over uneven steps, and what came after a point in time, against the kernel itself.
TEST(SumKernel, SumsAreTheKernelsOwn) {
  Random random(5);
  KernelSums sums(1, 1), then(1, 1);
  std::vector<std::pair<double, double>> added;
  double now = 0.0, mark = 0.0;
  for (int k = 0; k < 200; ++k) {
    const double x = 0.1 * random.unit(), q = random.unit() - 0.5;
    sums.advance(x, std::exp(-x));
    now += x;
    sums.add(Eigen::ArrayXXd::Constant(1, 1, q));
    added.emplace_back(now, q);
    if (k == 120) {
      then = sums;
      mark = now;
    }
  }
  double all = 0.0, late = 0.0;
  for (const auto& [at, q] : added) {
    const double value = q * SumKernel::at(SumKernel::kShape, now - at, std::exp(at - now));
    all += value;
    late += at > mark ? value : 0.0;
  }
  EXPECT_NEAR(sums.value(0, 0, SumKernel::kShape), all, 1e-12);
  EXPECT_NEAR(sums.since(0, 0, then, now - mark, std::exp(mark - now)), late, 1e-12);
  for (double x = 0.0; x < 12.0; x += 0.01) {
    const auto at = [](double y) { return SumKernel::at(SumKernel::kShape, y, std::exp(-y)); };
    constexpr double kStep = 1e-4;
    EXPECT_LE(std::abs(at(x + kStep) - at(x)) / kStep, SumKernel::at(SumKernel::slope(), x, std::exp(-x)) + 1e-3);
    EXPECT_LE(std::abs(at(x + 2.0 * kStep) - 2.0 * at(x + kStep) + at(x)) / (kStep * kStep),
              SumKernel::at(SumKernel::curvature(), x, std::exp(-x)) + 1e-3);
  }
}

}  // namespace
}  // namespace wheelwright::detector::sum_response_test
