// SPDX-License-Identifier: Apache-2.0
// Sizes that the sums of a pose are said to show, put into a robot that rolls in closed form, with other parameters of
// the set and other errors than those of the log that was asked.
#include "detector/multiscale/pose_margins.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/model.hpp"
#include "tests/support/known_unicycle.hpp"

namespace wheelwright::detector::pose_margins_test {
namespace {

using testing_support::drive;
using testing_support::ExactUnicycle;
using testing_support::known_kinematics;
using testing_support::NamedUnicycle;
using testing_support::PoseLaw;

constexpr double kShare = 3e-3;       // of the parameters, that the set leaves
constexpr std::uint64_t kMotion = 7;  // seed

std::vector<NamedUnicycle> worlds() {
  std::vector<NamedUnicycle> all;
  const auto add = [&](const std::string& name, auto change) {
    ExactUnicycle robot;
    robot.seconds = 30.0;
    robot.rate = 50.0;
    robot.errors_seed = 1;
    change(robot);
    all.push_back({name, robot});
  };
  add("two_point", [](ExactUnicycle&) {});
  add("held_pose", [](ExactUnicycle& a) { a.hold = 5; });
  add("slow", [](ExactUnicycle& a) { a.rate = 10.0; });
  add("fast", [](ExactUnicycle& a) { a.rate = 200.0; });
  add("uneven_steps", [](ExactUnicycle& a) { a.jitter = 0.3; });
  add("biased", [](ExactUnicycle& a) { a.bias_share = 0.1; });
  add("ahead", [](ExactUnicycle& a) { a.law = PoseLaw::ahead; });
  add("together", [](ExactUnicycle& a) {
    a.law = PoseLaw::together;
    a.correlation = 0.1;
  });
  add("clothoids", [](ExactUnicycle& a) { a.clothoids = true; });
  add("coarse_wheels", [](ExactUnicycle& a) { a.count = 2e-2; });
  return all;
}

Model model_of(const ExactUnicycle& a) {
  Robot robot;
  robot.wheel_radius = a.radius_right;
  robot.track_width = a.track;
  return model::make_model(robot);
}

struct Case {
  std::string fault;
  void (*put)(ExactUnicycle& robot, double magnitude);
};

const std::vector<Case> kCases = {
    {"matched", [](ExactUnicycle& a, double size) { a.slip_along = size; }},
    {"unmatched", [](ExactUnicycle& a, double size) { a.slip_across = -size; }},
    {"wheel_radius_right", [](ExactUnicycle& a, double size) { a.radius_right_by = size; }},
    {"encoder_scale_right", [](ExactUnicycle& a, double size) { a.encoder_right_by = size; }}};

std::vector<FaultType> faults_of(const Model& model) {
  const std::vector<FaultType> catalogue =
      model::fault_catalogue(model, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())));
  std::vector<FaultType> faults;
  for (const Case& each : kCases) {
    faults.push_back(model::find_fault(catalogue, each.fault));
  }
  return faults;
}

// Time from `onset` to the first alarm after it; infinite where there is none.
double alarm_after(const LogTable& log, const KinematicModel& model, double onset) {
  PoseSumDetector detector(model);
  double first = core::kInfinity;
  testing_support::walk(log, detector, [&](std::size_t k) {
    if (detector.alarm() && log.t[k] > onset) {
      first = std::min(first, log.t[k] - onset);
    }
  });
  return first;
}

// The instants of the log's poses nearest before these times, s.
std::vector<double> onsets_of(const LogTable& log, std::size_t hold, const std::vector<double>& times) {
  std::vector<double> onsets;
  for (const double time : times) {
    const auto row = static_cast<std::size_t>(std::ranges::lower_bound(log.t, time) - log.t.begin());
    onsets.push_back(log.t[row - row % hold]);
  }
  return onsets;
}

// What is asked of a robot's log: all that margins want.
struct Asked {
  KinematicModel model;
  Model robot;
  LogTable log;
  PoseSumDrive seen;

  Asked(const ExactUnicycle& nominal, double share)
      : model(known_kinematics(nominal, share)), robot(model_of(nominal)), log(drive(nominal, kMotion)) {
    TableSource source(log);
    seen = read_pose_drive(source, model, PoseSumOptions{}.false_alarms);
  }
  [[nodiscard]] std::vector<FaultMargins> margins(const std::vector<double>& onsets,
                                                  const std::vector<double>& windows) const {
    SumMarginOptions options;
    options.windows = windows;
    return pose_margins_at_risk(seen, model, robot, faults_of(robot), onsets, options);
  }
};

class PoseMargins : public ::testing::TestWithParam<NamedUnicycle> {};

TEST_P(PoseMargins, AreSeenWithinTheirWindowWhateverTheErrors) {
  const ExactUnicycle& nominal = GetParam().robot;
  const Asked asked(nominal, kShare);
  const std::vector<double> onsets = onsets_of(asked.log, nominal.hold, {5.0, 12.0, 18.0}), windows{1.0, 3.0, 10.0};
  std::size_t tried = 0;
  for (const FaultMargins& each : asked.margins(onsets, windows)) {
    const auto which = std::ranges::find(kCases, each.fault.name, &Case::fault);
    for (std::size_t k = 0; k < onsets.size(); ++k) {
      const OnsetMargin& onset = each.onsets[k];
      ASSERT_EQ(onset.certain.size(), 3u);
      for (std::size_t w = 0; w < 3; ++w) {
        if (!std::isfinite(onset.certain[w])) {
          continue;
        }
        for (std::uint64_t seed = 2; seed < 5; ++seed) {
          ExactUnicycle other = nominal;
          other.errors_seed = seed;
          other.radius_right *= 1.0 + kShare * (seed == 3 ? -1.0 : 1.0);
          other.radius_left *= 1.0 + kShare * (seed == 4 ? -1.0 : 1.0);
          other.fault_at = onset.t;
          which->put(other, each.side * onset.certain[w] * (1.0 + 1e-6));
          EXPECT_LE(alarm_after(drive(other, kMotion), asked.model, onset.t), windows[w] + 1e-9)
              << each.fault.name << " of " << each.side * onset.certain[w] << " at " << onset.t << " s, errors "
              << seed;
          ++tried;
        }
      }
    }
  }
  std::cout << GetParam().name << ": " << tried << " runs\n";
  EXPECT_GT(tried, 60u) << "too few sizes are certain";
}

INSTANTIATE_TEST_SUITE_P(Worlds, PoseMargins, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

// The smallest size, as a share of `certain`, at which this log's detector raises an alarm in time.
double seen_from(const ExactUnicycle& nominal, const KinematicModel& model, const Case& which, const OnsetMargin& onset,
                 double side, double certain, double window) {
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 7; ++k) {
    const double middle = 0.5 * (low + high);
    ExactUnicycle other = nominal;
    other.fault_at = onset.t;
    which.put(other, side * middle * certain);
    (alarm_after(drive(other, kMotion), model, onset.t) <= window ? high : low) = middle;
  }
  return high;
}

// Where the set is a point, certain is twice the radius, and seen is one radius give or take the errors.
TEST(PoseMargins, AreNotMuchLargerThanWhatIsSeen) {
  const ExactUnicycle nominal = worlds().front().robot;
  const Asked asked(nominal, 0.0);
  for (const FaultMargins& each : asked.margins(onsets_of(asked.log, 1, {9.0}), {3.0})) {
    const OnsetMargin& onset = each.onsets.front();
    ASSERT_TRUE(std::isfinite(onset.certain.front())) << each.fault.name;
    const auto which = std::ranges::find(kCases, each.fault.name, &Case::fault);
    const double share = seen_from(nominal, asked.model, *which, onset, each.side, onset.certain.front(), 3.0);
    EXPECT_GT(share, 0.3) << each.fault.name;
    EXPECT_LT(share, 0.8) << each.fault.name;
  }
}

TEST(PoseMargins, SayNothingWhereTheLogEndsBeforeTheWindow) {
  const std::vector<double> onsets = {-5.0, 25.0, 29.5, 40.0};
  const auto margins = Asked(worlds().front().robot, 0.0).margins(onsets, {1.0, 10.0});
  const std::vector<std::size_t> fit = {2, 1, 0, 0};
  for (std::size_t k = 1; k < onsets.size(); ++k) {
    EXPECT_EQ(margins.front().onsets[k].certain.size(), fit[k]) << onsets[k];
  }
  for (const double size : margins.front().onsets.front().certain) {
    EXPECT_FALSE(std::isfinite(size)) << "before the first pose";
  }
}

}  // namespace
}  // namespace wheelwright::detector::pose_margins_test
