// SPDX-License-Identifier: Apache-2.0
// Sizes over time hold the true size for every course of their class: weighted means for any bounded one, pointwise
// bounds for one that only grows. The true means are summed up here, from the course and the drive.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bounds/polytope.hpp"
#include "detector/faults/odometry_faults.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/faults/size_over_time.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::detector::size_over_time_test {
namespace {

using testing_support::random_robot;

using Course = std::function<double(double)>;  // size over time
using Shape = model::TimeProfile::Shape;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kOnset = 8.0;

// A commissioned robot with a pose, and its drive of another seed.
struct Subject {
  Scenario drive;
  OnlineModel model;
};

Subject subject_of(std::uint64_t seed) {
  Subject out{testing_support::with_pose(random_robot(seed)), {}};
  Scenario& s = out.drive;
  s.duration = 24.0;
  Simulation learning(s);
  const Commissioning result = commission_robot(learning, s.robot);
  if (result.status != Commissioning::Status::done || !result.model.kinematic) {
    throw InvalidArgument("seed " + std::to_string(seed) + ": " + result.message + result.kinematic.message);
  }
  out.model = result.model;
  s.trajectory.kind = sim::Trajectory::Kind::multi_sine;
  s.trajectory.period = 9.0;
  s.duration = 30.0;
  s.seed = seed + 1000;
  return out;
}

LogTable driven(const Subject& of, std::vector<model::Fault> faults = {}) {
  Scenario s = of.drive;
  s.faults = std::move(faults);
  Simulation log(s);
  return read_all(log);
}

struct Evidence {
  std::vector<FaultType> faults;
  ReferenceMotion motion;
  OdometryReference odometry;
  std::vector<SizeEvidence> torque, kinematic;

  [[nodiscard]] std::size_t at(const std::string& fault) const {
    const auto found = std::ranges::find(faults, fault, &FaultType::name);
    if (found == faults.end()) {
      throw InvalidArgument("no fault '" + fault + "'");
    }
    return static_cast<std::size_t>(found - faults.begin());
  }
  [[nodiscard]] SizeOverTime size(const std::string& fault) const {
    const std::size_t k = at(fault);
    return size_over_time(faults[k], std::vector<SizeEvidence>{torque[k], kinematic[k]});
  }
};

Evidence evidence_of(const Subject& of, const LogTable& table, std::size_t threads = 1) {
  const OnlineModel& m = of.model;
  TableSource log(table);
  const RegressorFilter filter(m.model, m.filter, m.measurement, m.errors);
  Evidence out{.faults = fault_catalogue(m.model, m.estimate, m.robot.effort),
               .motion = read_reference(log, filter),
               .odometry = read_odometry(log, make_filter(*m.kinematic), m.model),
               .torque = {},
               .kinematic = {}};
  Eigen::MatrixXd efforts(2, static_cast<Eigen::Index>(out.motion.instants()));
  for (std::size_t k = 0; k < out.motion.instants(); ++k) {
    efforts(0, static_cast<Eigen::Index>(k)) = table.column("tau_r")[out.motion.sample[k]];
    efforts(1, static_cast<Eigen::Index>(k)) = table.column("tau_l")[out.motion.sample[k]];
  }
  const Interval all{table.t.front(), table.t.back()};
  out.torque = size_evidence(out.motion, filter, efforts, Polytope(m.facets, m.box), out.faults, all,
                             {.most_rows = 150, .threads = threads});
  out.kinematic = size_evidence_by_odometry(out.odometry, m.model, m.kinematic->measurement, m.kinematic->errors,
                                            Polytope(m.kinematic->facets, m.kinematic->box), out.faults, all,
                                            {.most_rows = 150, .threads = threads});
  return out;
}

// The log with what `change` makes of an effort: (t, effort) → effort.
LogTable with_effort(LogTable log, const std::string& column, const std::function<double(double, double)>& change) {
  std::vector<double>& effort = log.column(column);
  for (std::size_t k = 0; k < log.rows(); ++k) {
    effort[k] = change(log.t[k], effort[k]);
  }
  return log;
}

// Weight at the age x of what went into the filter, of angles: f₂ smoothed with γ e^{−γx}.
double weight(double x, const FilterDesign& design, double step) {
  const double gamma = std::max(2.0 / step, 4.0 * design.beta), apart = gamma - design.beta;
  return design.alpha * design.alpha * gamma / apart *
         (x * std::exp(-design.beta * x) - (std::exp(-design.beta * x) - std::exp(-gamma * x)) / apart);
}

// The mean of `course` over [from, to] with the weights of the filter at `to`, times |effort| where there is one. Both
// are constant from a sample on.
double mean_by_filter(const Subject& of, const LogTable& log, const Course& course, double from, double to,
                      const std::vector<double>* effort) {
  double sum = 0.0, total = 0.0;
  for (std::size_t k = 0; k + 1 < log.rows(); ++k) {
    if (log.t[k] < from - 1e-9 || log.t[k] > to - 1e-9) {
      continue;
    }
    // The kernel goes linearly from one sample to the next.
    const double h = log.t[k + 1] - log.t[k];
    const double mean =
        0.5 * (weight(to - log.t[k], of.model.filter, of.model.measurement.nominal_step) +
               (log.t[k + 1] < to - 1e-9 ? weight(to - log.t[k + 1], of.model.filter, of.model.measurement.nominal_step)
                                         : 0.0));
    const double w = h * mean * (effort != nullptr ? std::abs((*effort)[k]) : 1.0);
    sum += w * course(log.t[k]);
    total += w;
  }
  return total > 0.0 ? sum / total : std::nan("");
}

const std::vector<std::pair<std::string, Course>>& courses() {
  static const std::vector<std::pair<std::string, Course>> all = {
      {"step", [](double t) { return t < kOnset ? 0.0 : 1.0; }},
      {"ramp", [](double t) { return std::clamp((t - kOnset) / 5.0, 0.0, 1.0); }},
      {"creeping", [](double t) { return std::clamp(t / 25.0, 0.0, 1.0); }},
      {"pulse", [](double t) { return t < kOnset || t > kOnset + 2.0 ? 0.0 : 1.0; }},
      {"wandering", [](double t) { return 0.5 + 0.5 * std::sin(1.7 * t) * std::sin(0.6 * t * t); }},
      {"from before", [](double) { return 1.0; }}};
  return all;
}

bool only_grows(const std::string& course) { return course != "pulse" && course != "wandering"; }

struct Tally {
  std::size_t means = 0, told = 0, sizes = 0;
};

void holds_growing(const SizeOverTime& size, const Course& course, const std::string& what, Tally& tally) {
  ASSERT_FALSE(size.growing_excluded) << what;
  for (const SizeAt& at : size.growing) {
    ++tally.sizes;
    // At a jump both sides are meant.
    const double before = course(at.t - 1e-3), after = course(at.t + 1e-3);
    ASSERT_LE(at.size.lower, std::max(before, after)) << what << " at " << at.t << " s";
    ASSERT_GE(at.size.upper, std::min(before, after)) << what << " at " << at.t << " s";
  }
}

class SizesOfEfforts : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SizesOfEfforts, HoldTheTrueMeansAndSizes) {
  const Subject subject = subject_of(GetParam());
  const LogTable healthy = driven(subject);
  const bool held = subject.drive.robot.hold == Hold::zero_order;
  Tally loss, bias;
  for (const auto& [name, course] : courses()) {
    const Course lost = [&](double t) { return 0.4 * course(t); };
    const LogTable said =
        with_effort(healthy, "tau_l", [&](double t, double effort) { return effort / (1.0 - lost(t)); });
    const Evidence of_loss = evidence_of(subject, said);
    const SizeOverTime size = of_loss.size("effort_loss_left");
    ASSERT_FALSE(size.excluded) << name;
    for (const MeanSize& mean : size.means) {
      // Between samples a changing effort is not the log's own: only of a held one are the weights known here.
      if (held) {
        const double truth = mean_by_filter(subject, said, lost, mean.from, mean.to, &said.column("tau_l"));
        ++loss.means;
        loss.told += mean.size.lower > 0.0 ? 1 : 0;
        ASSERT_LE(mean.size.lower, truth) << name << " at " << mean.to << " s";
        ASSERT_GE(mean.size.upper, truth) << name << " at " << mean.to << " s";
      }
    }
    const Course added = [&](double t) { return -0.6 * course(t); };
    const Evidence of_bias =
        evidence_of(subject, with_effort(healthy, "tau_r", [&](double t, double effort) { return effort + added(t); }));
    const SizeOverTime off = of_bias.size("effort_bias_right");
    ASSERT_FALSE(off.excluded) << name;
    for (const MeanSize& mean : off.means) {
      const double truth = mean_by_filter(subject, healthy, added, mean.from, mean.to, nullptr);
      // Of a size that changes while the log's efforts are linear between samples, too, within half a step's change.
      const double slack = held ? 0.0 : 0.6 * 0.5 * subject.model.measurement.nominal_step * 4.0;
      ++bias.means;
      bias.told += mean.size.upper < 0.0 ? 1 : 0;
      ASSERT_LE(mean.size.lower, truth + slack) << name << " at " << mean.to << " s";
      ASSERT_GE(mean.size.upper, truth - slack) << name << " at " << mean.to << " s";
    }
    if (only_grows(name)) {
      holds_growing(size, lost, "loss, " + name, loss);
      holds_growing(off, added, "bias, " + name, bias);
    }
  }
  EXPECT_GT(bias.means, 100U);
  EXPECT_GT(bias.told, 20U);
  EXPECT_GT(loss.sizes, 100U);
  EXPECT_GT(bias.sizes, 100U);
}

INSTANTIATE_TEST_SUITE_P(Robots, SizesOfEfforts, ::testing::Values(1, 2, 4));

// The mean of `course` with the way of a wheel as its weight.
double mean_by_way(const OdometryReference& odometry, std::size_t wheel, const Course& course, double from, double to) {
  const ReferenceMotion& motion = odometry.motion;
  double sum = 0.0, total = 0.0;
  for (std::size_t k = 0; k + 1 < motion.instants(); ++k) {
    if (motion.t[k] < from - 1e-9 || motion.t[k + 1] > to + 1e-9) {
      continue;
    }
    const auto a = static_cast<Eigen::Index>(k), w = static_cast<Eigen::Index>(wheel);
    const double way = std::abs(motion.joint_angle(w, a + 1) - motion.joint_angle(w, a));
    sum += way * course(0.5 * (motion.t[k] + motion.t[k + 1]));
    total += way;
  }
  return total > 0.0 ? sum / total : std::nan("");
}

// The way of a wheel over [from, to], and the longest of one step, rad.
std::pair<double, double> way_of(const OdometryReference& odometry, Eigen::Index wheel, double from, double to) {
  const ReferenceMotion& motion = odometry.motion;
  double total = 0.0, longest = 0.0;
  for (std::size_t k = 0; k + 1 < motion.instants(); ++k) {
    if (motion.t[k] >= from - 1e-9 && motion.t[k + 1] <= to + 1e-9) {
      const auto a = static_cast<Eigen::Index>(k);
      const double way = std::abs(motion.joint_angle(wheel, a + 1) - motion.joint_angle(wheel, a));
      total += way;
      longest = std::max(longest, way);
    }
  }
  return {total, longest};
}

struct Made {
  std::string name;
  model::TimeProfile profile;
};

const std::vector<Made>& profiles() {
  static const std::vector<Made> all = {
      {"step", {.shape = Shape::step, .onset = kOnset, .rise_time = 0.0, .end = kInf}},
      {"smooth, 2 s", {.shape = Shape::smooth, .onset = kOnset, .rise_time = 2.0, .end = kInf}},
      {"ramp, 12 s", {.shape = Shape::ramp, .onset = kOnset, .rise_time = 12.0, .end = kInf}},
      {"ramp and back", {.shape = Shape::ramp, .onset = kOnset, .rise_time = 1.0, .end = kOnset + 4.0}}};
  return all;
}

class SizesOfRadii : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SizesOfRadii, HoldTheTrueMeansAndSizes) {
  const Subject subject = subject_of(GetParam());
  const double r = subject.drive.robot.wheel_radius;
  Tally kinematic, torque;
  for (const Made& made : profiles()) {
    for (const double size : {-0.15, 0.12}) {
      const Course course = [&](double t) { return size * made.profile.value(t); };
      const LogTable log = driven(
          subject, {{.kind = model::Fault::Kind::wheel_radius_left, .magnitude = size * r, .profile = made.profile}});
      const Evidence evidence = evidence_of(subject, log);
      const std::size_t at = evidence.at("wheel_radius_left");
      const SizeEvidence& by_way = evidence.kinematic[at];
      ASSERT_FALSE(by_way.excluded) << made.name;
      for (const MeanSize& mean : by_way.means) {
        const double truth = mean_by_way(evidence.odometry, 1, course, mean.from, mean.to);
        const auto [way, longest] = way_of(evidence.odometry, 1, mean.from, mean.to);
        if (!(way > 0.0)) {
          continue;
        }
        // The weights of the sum here are read from counted angles, two errors at each end; and within a step the size
        // may change.
        const double slack = std::abs(size) * (4.0 * subject.model.kinematic->errors.motion + longest) / way;
        ++kinematic.means;
        kinematic.told += mean.size.lower > 0.0 || mean.size.upper < 0.0 ? 1 : 0;
        ASSERT_LE(mean.size.lower, truth + slack) << made.name << " at " << mean.to << " s";
        ASSERT_GE(mean.size.upper, truth - slack) << made.name << " at " << mean.to << " s";
      }
      if (made.profile.end == kInf) {
        holds_growing(evidence.size("wheel_radius_left"), course, "both, " + made.name, kinematic);
        holds_growing(size_over_time(evidence.faults[at], std::vector<SizeEvidence>{evidence.torque[at]}), course,
                      "torque alone, " + made.name, torque);
      }
    }
  }
  EXPECT_GT(kinematic.means, 100U);
  EXPECT_GT(kinematic.told, 50U);
  EXPECT_GT(torque.sizes, 300U);
}

INSTANTIATE_TEST_SUITE_P(Robots, SizesOfRadii, ::testing::Values(1, 2, 3));

TEST(SizeOverTime, TellsTheSizeOfASmoothFaultByTorqueAlone) {
  Scenario s = testing_support::posed_drive(5, 20.0);
  s.robot.encoder_counts_per_turn = 32768.0;
  s.sensors.encoder_counts_per_turn = 65536.0;
  s.robot.noise.effort.value = 0.005;
  s.sensors.effort = 0.0025;
  Simulation learning(s);
  const Commissioning result = commission_robot(learning, s.robot);
  ASSERT_TRUE(result.model.kinematic) << result.kinematic.message;
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  s.trajectory.kind = sim::Trajectory::Kind::multi_sine;
  s.seed = 6;
  const Subject subject{s, result.model};
  const LogTable log = driven(subject, {{.kind = model::Fault::Kind::wheel_radius_left,
                                         .magnitude = -0.2 * s.robot.wheel_radius,
                                         .profile = {.shape = Shape::smooth, .onset = kOnset, .rise_time = 2.0}}});
  const Evidence evidence = evidence_of(subject, log);
  const std::size_t left = evidence.at("wheel_radius_left"), right = evidence.at("wheel_radius_right");
  const SizeOverTime size = size_over_time(evidence.faults[left], std::vector<SizeEvidence>{evidence.torque[left]});
  ASSERT_FALSE(size.growing.empty());
  EXPECT_LE(size.growing.back().size.upper, -0.12);
  EXPECT_GE(size.growing.back().size.upper, -0.2);
  // The other wheel is told apart.
  EXPECT_TRUE(
      size_over_time(evidence.faults[right], std::vector<SizeEvidence>{evidence.torque[right]}).growing_excluded);
}

TEST(SizeOverTime, DoesNotDependOnThreads) {
  const Subject subject = subject_of(2);
  const LogTable log = with_effort(driven(subject), "tau_l", [](double t, double x) { return t < 8.0 ? x : 1.3 * x; });
  const Evidence one = evidence_of(subject, log), three = evidence_of(subject, log, 3);
  for (std::size_t k = 0; k < one.faults.size(); ++k) {
    const SizeOverTime a = one.size(one.faults[k].name), b = three.size(one.faults[k].name);
    ASSERT_EQ(a.growing.size(), b.growing.size());
    for (std::size_t i = 0; i < a.growing.size(); ++i) {
      EXPECT_EQ(a.growing[i].size, b.growing[i].size);
    }
  }
}

// Bounds of a fault that grows: those below hold ever after, those above ever before.
TEST(SizeOverTime, CarriesBoundsThroughTime) {
  FaultType fault;
  fault.name = "made_up";
  fault.range = {-1.0, 1.0};
  SizeEvidence evidence;
  evidence.sides[1].excluded = true;
  evidence.sides[0].links = {{1.0, 1.0, 0.1, 0.0, true},
                             {2.0, 2.0, 0.8, 0.0, false},
                             {3.0, 1.0, 0.25, 0.5, true},
                             {3.5, 4.0, 0.1, 0.5, false},
                             {4.0, 4.0, 0.75, 0.0, false}};
  const SizeOverTime size = size_over_time(fault, std::vector<SizeEvidence>{evidence});
  ASSERT_EQ(size.growing.size(), 5U);
  const std::vector<Interval> expected = {{0.1, 0.475}, {0.1, 0.475}, {0.3, 0.475}, {0.3, 0.475}, {0.3, 0.75}};
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(size.growing[k].size.lower, expected[k].lower, 1e-12) << k;
    EXPECT_NEAR(size.growing[k].size.upper, expected[k].upper, 1e-12) << k;
    EXPECT_LE(size.growing[k].size.lower, expected[k].lower) << k;
    EXPECT_GE(size.growing[k].size.upper, expected[k].upper) << k;
  }
  evidence.sides[0].links.push_back({2.5, 2.5, 0.6, 0.0, true});
  EXPECT_TRUE(size_over_time(fault, std::vector<SizeEvidence>{evidence}).growing_excluded);
  // Where either sign is possible, both are in the interval.
  SizeEvidence open;
  open.sides[0].links = {{1.0, 1.0, 0.2, 0.0, false}};
  open.sides[1].links = {{1.0, 1.0, 0.4, 0.0, false}};
  const Interval both = size_over_time(fault, std::vector<SizeEvidence>{open}).growing.front().size;
  EXPECT_NEAR(both.lower, -0.4, 1e-12);
  EXPECT_NEAR(both.upper, 0.2, 1e-12);
}

// Sizes and amounts are each other's inverse, for every fault that has a size.
TEST(SizeOverTime, AmountsAreSizes) {
  const Subject subject = subject_of(1);
  for (const FaultType& fault : fault_catalogue(subject.model.model, subject.model.estimate)) {
    for (const double share : {-0.9, -0.3, 0.2, 0.8}) {
      const double size = share * (share > 0.0 ? fault.range.upper : -fault.range.lower);
      EXPECT_NEAR(size_of(fault, share, amount_of(fault, size)), size, 1e-9 * std::abs(size)) << fault.name;
    }
  }
}

TEST(SizeOverTime, RefusesEffortsOfAnotherLog) {
  const Subject subject = subject_of(1);
  const LogTable table = driven(subject);
  TableSource log(table);
  const OnlineModel& m = subject.model;
  const RegressorFilter filter(m.model, m.filter, m.measurement, m.errors);
  const ReferenceMotion motion = read_reference(log, filter);
  EXPECT_THROW((void)size_evidence(motion, filter, Eigen::MatrixXd::Zero(2, 3), Polytope(m.facets, m.box), {}, {0, 1}),
               InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::size_over_time_test
