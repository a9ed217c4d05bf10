// SPDX-License-Identifier: Apache-2.0
// The likeliest fault is the one whose course of size fits what all residuals show; faults that grow are one incident.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/event_isolation.hpp"
#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "core/limits.hpp"
#include "detector/faults/course_fit.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::detector::course_fit_test {
namespace {

using testing_support::random_robot;

FaultType fault_named(const std::string& name) {
  FaultType fault;
  fault.name = name;
  fault.unit = "1";
  fault.range = {-0.9, 0.9};
  return fault;
}

// Rows of two outputs, 0.1 s apart from 0 to 20 s, that show two faults by signals of their own with a memory of
// `memory` s.
struct Rows {
  CourseGrid grid = course_grid({0.0, 20.0}, 8.0);
  std::vector<FaultType> faults{fault_named("a"), fault_named("b")};
  CourseRows rows;
  std::vector<double> t;

  // What fault k does to output i at a time.
  static double signal(std::size_t k, Eigen::Index i, double at) {
    return k == 0 ? (i == 0 ? 1.0 + 0.4 * std::sin(at) : 0.5 * std::cos(1.3 * at))
                  : (i == 0 ? std::cos(0.7 * at) : 1.0);
  }
  // ∫ signal over [from, to] with the weights e^(−(at − τ)), by small steps.
  static double response(std::size_t k, Eigen::Index i, double from, double at,
                         const std::function<double(double)>& of) {
    constexpr double h = 0.02;
    double sum = 0.0;
    for (double tau = std::max(from, at - 9.0) + 0.5 * h; tau < at; tau += h) {
      sum += h * std::exp(tau - at) * signal(k, i, tau) * of(tau);
    }
    return sum;
  }

  Rows(std::size_t truth, const std::function<double(double)>& size) {
    for (int r = 0; r <= 200; ++r) {
      t.push_back(0.1 * r);
    }
    const auto count = static_cast<Eigen::Index>(t.size());
    rows.outputs = 2;
    rows.independent = 40.0;
    rows.scale = Eigen::Vector2d(0.05, 0.05);
    rows.residual.resize(2 * count);
    for (std::size_t k = 0; k < 2; ++k) {
      rows.responses.emplace_back(2 * count, static_cast<Eigen::Index>(1 + grid.times.size()));
    }
    const auto one = [](double) { return 1.0; };
    for (Eigen::Index r = 0; r < count; ++r) {
      const double at = t[static_cast<std::size_t>(r)];
      for (Eigen::Index i = 0; i < 2; ++i) {
        rows.residual[2 * r + i] = response(truth, i, -100.0, at, size) + 1e-3 * std::sin(37.0 * at + double(i));
        for (std::size_t k = 0; k < 2; ++k) {
          rows.responses[k](2 * r + i, 0) = response(k, i, -100.0, at, one);
          for (std::size_t c = 0; c < grid.times.size(); ++c) {
            rows.responses[k](2 * r + i, static_cast<Eigen::Index>(c + 1)) = response(k, i, grid.times[c], at, one);
          }
        }
      }
    }
  }
};

TEST(CourseFit, TheFaultWhoseCourseFitsCostsLeastAndItsSizeIsFound) {
  const std::vector<std::pair<std::string, std::function<double(double)>>> courses = {
      {"step", [](double t) { return t < 8.0 ? 0.0 : 0.3; }},
      {"ramp", [](double t) { return 0.3 * std::clamp((t - 8.0) / 5.0, 0.0, 1.0); }},
      {"falling step", [](double t) { return t < 8.0 ? 0.0 : -0.3; }},
      {"from before", [](double) { return 0.3; }}};
  for (const auto& [name, course] : courses) {
    for (std::size_t truth = 0; truth < 2; ++truth) {
      const Rows in(truth, course);
      const std::vector<CourseFit> fits = fit_courses(in.faults, in.grid, std::span(&in.rows, 1));
      ASSERT_TRUE(fits[0].known && fits[1].known);
      EXPECT_LT(fits[truth].cost + 3.0, fits[1 - truth].cost) << name << ", " << truth;
      EXPECT_TRUE(fits[truth].grows) << name << ", " << truth;
      EXPECT_NEAR(fits[truth].size, course(20.0), 0.02) << name << ", " << truth;
      EXPECT_LT(fits[truth].left, 0.1) << name << ", " << truth;
      if (name == "ramp") {
        EXPECT_NEAR(fits[truth].rise, 4.0, 1.0) << truth;
      } else {
        EXPECT_LT(fits[truth].rise, 0.5) << name << ", " << truth;
      }
      EXPECT_GT(fits[1 - truth].left, 2.0 * fits[truth].left) << name << ", " << truth;
    }
  }
}

TEST(CourseFit, ACourseThatRoseAndFellIsNoGrowingOne) {
  const Rows in(0, [](double t) { return t < 8.0 || t > 12.0 ? 0.0 : 0.4; });
  const std::vector<CourseFit> fits = fit_courses(in.faults, in.grid, std::span(&in.rows, 1));
  EXPECT_FALSE(fits[0].grows);
  EXPECT_LT(fits[0].cost, fits[1].cost);
}

TEST(CourseFit, WhatAResidualDoesNotShowSpeaks) {
  // Both faults explain the first residual alike; one of them would show in a second one, which shows nothing.
  Rows in(0, [](double t) { return t < 8.0 ? 0.0 : 0.3; });
  in.rows.responses[1] = in.rows.responses[0];
  std::vector<CourseFit> fits = fit_courses(in.faults, in.grid, std::span(&in.rows, 1));
  EXPECT_NEAR(fits[0].cost, fits[1].cost, 1e-6);
  CourseRows quiet = in.rows;
  quiet.residual.setZero();
  quiet.responses[0].setZero();
  const std::vector<CourseRows> both{in.rows, quiet};
  fits = fit_courses(in.faults, in.grid, both);
  EXPECT_LT(fits[0].cost + 3.0, fits[1].cost);
}

// Incidents of a robot with a pose, of a drive of another seed whose log is changed; cut in two at `cut` (s) where that
// is within one, before their courses are asked for.
std::vector<Incident> incidents_of(std::uint64_t seed, const std::function<void(LogTable&)>& change,
                                   double cut = core::kInfinity) {
  Scenario s = testing_support::with_pose(random_robot(seed));
  s.duration = 24.0;
  Simulation learning(s);
  const Commissioning result = commission_robot(learning, s.robot);
  if (result.status != Commissioning::Status::done) {
    throw InvalidArgument("seed " + std::to_string(seed) + ": " + result.message);
  }
  s.trajectory.kind = sim::Trajectory::Kind::multi_sine;
  s.trajectory.period = 9.0;
  s.duration = 40.0;
  s.seed = seed + 1000;
  Simulation driven(s);
  LogTable table = read_all(driven);
  change(table);
  TableSource log(table);
  const Detection detection = detect(log, make_detector(result.model));
  const commission::KinematicWatch kinematic = commission::watch_kinematics(log, result.model, {});
  std::vector<Incident> incidents = commission::join_events(
      log, result.model, detection, commission::isolate_events(log, result.model, detection), kinematic);
  for (std::size_t k = 0; k < incidents.size(); ++k) {
    if (incidents[k].start < cut && cut < incidents[k].end) {
      Incident later = incidents[k];
      later.start = later.alarm = cut;
      incidents[k].end = cut - 1.0;
      incidents.insert(incidents.begin() + static_cast<std::ptrdiff_t>(k) + 1, later);
      break;
    }
  }
  commission::explain_courses(log, result.model, detection, kinematic, incidents);
  return incidents;
}

TEST(CourseFit, AFaultThatGrowsIsOneIncidentThatNamesItFirst) {
  // An effort that delivers ever less, up to half, over 6 s.
  const auto lost = [](double t) { return 0.5 * std::clamp((t - 10.0) / 6.0, 0.0, 1.0); };
  for (const std::uint64_t seed : {2ULL, 3ULL}) {
    for (const char* side : {seed == 2 ? "_r" : "_l"}) {
      const std::vector<Incident> incidents = incidents_of(seed, [&](LogTable& log) {
        std::vector<double>& effort = log.column(std::string("tau") + side);
        for (std::size_t k = 0; k < log.rows(); ++k) {
          effort[k] /= 1.0 - lost(log.t[k]);
        }
      });
      const std::string what = "seed " + std::to_string(seed) + side;
      ASSERT_EQ(incidents.size(), 1U) << what;
      const std::vector<IncidentCandidate>& candidates = incidents.front().candidates;
      ASSERT_FALSE(candidates.empty()) << what;
      const IncidentCandidate& first = candidates.front();
      EXPECT_EQ(first.finding.fault.name, std::string("effort_loss") + (side[1] == 'r' ? "_right" : "_left")) << what;
      EXPECT_EQ(first.course, CourseClass::growing) << what;
      EXPECT_TRUE(first.finding.magnitude->contains(0.5)) << what;
      EXPECT_NEAR(*first.guess, 0.5, 0.1) << what;
      EXPECT_TRUE(std::ranges::is_sorted(candidates, {}, [](const IncidentCandidate& c) {
        return c.behind.value_or(core::kInfinity);
      })) << what;
    }
  }
}

TEST(CourseFit, IncidentsOfOneGrowingFaultAreJoinedThoseOfTwoFaultsAreNot) {
  const auto spoil = [](LogTable& log, bool both) {
    std::vector<double>&left = log.column("tau_l"), &right = log.column("tau_r");
    double largest = 0.0;
    for (const double value : right) {
      largest = std::max(largest, std::abs(value));
    }
    for (std::size_t k = 0; k < log.rows(); ++k) {
      left[k] /= 1.0 - (both ? (log.t[k] < 10.0 ? 0.0 : 0.4) : 0.4 * std::clamp((log.t[k] - 10.0) / 20.0, 0.0, 1.0));
      right[k] += both && log.t[k] >= 24.0 ? 0.8 * largest : 0.0;
    }
  };
  const std::vector<Incident> one = incidents_of(
      2, [&](LogTable& log) { spoil(log, false); }, 24.0);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_FALSE(one.front().stays);
  EXPECT_LT(one.front().start, 24.0);
  EXPECT_GT(one.front().end, 30.0);
  EXPECT_EQ(one.front().candidates.front().finding.fault.name, "effort_loss_left");
  const std::vector<Incident> two = incidents_of(
      2, [&](LogTable& log) { spoil(log, true); }, 24.0);
  ASSERT_GE(two.size(), 2U);
  EXPECT_EQ(two.front().candidates.front().finding.fault.name, "effort_loss_left");
}

TEST(CourseFit, AReadingThatGoesOnDoesNotStandStill) {
  // A bias: what is left of an effort that "stays at its value" is excluded by the reading itself.
  const std::vector<Incident> incidents = incidents_of(2, [](LogTable& log) {
    std::vector<double>& effort = log.column("tau_r");
    double largest = 0.0;
    for (const double value : effort) {
      largest = std::max(largest, std::abs(value));
    }
    for (std::size_t k = 0; k < log.rows(); ++k) {
      effort[k] += log.t[k] < 10.0 ? 0.0 : 0.5 * largest;
    }
  });
  ASSERT_FALSE(incidents.empty());
  EXPECT_EQ(incidents.front().candidates.front().finding.fault.name, "effort_bias_right");
  for (const IncidentCandidate& candidate : incidents.front().candidates) {
    EXPECT_FALSE(candidate.finding.fault.held_effort) << candidate.finding.fault.name;
  }
}

}  // namespace
}  // namespace wheelwright::detector::course_fit_test
