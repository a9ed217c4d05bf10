// SPDX-License-Identifier: Apache-2.0
// detect() over a whole log, against the detector stepped by hand.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/error.hpp"
#include "detector/online_model.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::trace_test {
namespace {

using testing_support::noisy_drive;

struct World {
  Commissioning learned;
  Scenario faulty = noisy_drive(2, 24.0);
  LogTable table;

  World() {
    const Scenario healthy = noisy_drive(1, 15.0);
    Simulation log(healthy);
    learned = commission_robot(log, healthy.robot);
    faulty.faults = {{.kind = model::Fault::Kind::wheel_radius_left, .magnitude = -0.03, .profile = {.onset = 16.0}}};
    faulty.gaps = {{9.0, 9.7}};
    table = sim::simulate(faulty);
  }
};

TEST(Detect, GivesTheDecisionsOfTheStreamBitForBit) {
  const World world;
  TableSource log(world.table, 333);
  const Detection all = detect(log, make_detector(world.learned.model), {.most_points = world.table.rows()});

  Detector detector = make_detector(world.learned.model);
  std::vector<double> sample(detector.filter().measurement().columns().size());
  std::size_t instants = 0;
  std::vector<std::size_t> outside(2, 0);
  std::vector<double> peak(2, 0.0);
  double first_alarm = INFINITY;
  for (std::size_t k = 0; k < world.table.rows(); ++k) {
    for (std::size_t c = 0; c < sample.size(); ++c) {
      sample[c] = world.table.column(detector.filter().measurement().columns()[c])[k];
    }
    const Decision& d = detector.step(world.table.t[k], sample);
    if (!d.valid) {
      continue;
    }
    ASSERT_LT(instants, all.trace.t.size());
    ASSERT_EQ(all.trace.t[instants], world.table.t[k]);
    for (std::size_t i = 0; i < 2; ++i) {
      const detector::ChannelDecision& c = d.channels[i];
      const OutputTrace& trace = all.trace.outputs[i];
      ASSERT_EQ(trace.residual_low[instants], c.residual);
      ASSERT_EQ(trace.residual_high[instants], c.residual);
      ASSERT_EQ(trace.lower[instants], c.threshold.lower);
      ASSERT_EQ(trace.upper[instants], c.threshold.upper);
      ASSERT_EQ(trace.predicted[instants], c.predicted);
      outside[i] += c.outside ? 1 : 0;
    }
    first_alarm = d.fault ? std::min(first_alarm, world.table.t[k]) : first_alarm;
    ++instants;
  }
  EXPECT_EQ(all.rows, world.table.rows());
  EXPECT_EQ(all.instants, instants);
  EXPECT_EQ(all.outside, outside);
  ASSERT_FALSE(all.events.empty());
  EXPECT_EQ(all.events.front().alarm, first_alarm);
  EXPECT_GE(first_alarm, 16.0);  // none before the fault
  EXPECT_LT(first_alarm, 24.0);
  EXPECT_EQ(all.trace.breaks.size(), 1u);
}

TEST(Detect, BlockSizesDoNotMatter) {
  const World world;
  TableSource small(world.table, 1), large(world.table, 100000);
  const Detection a = detect(small, make_detector(world.learned.model));
  const Detection b = detect(large, make_detector(world.learned.model));
  EXPECT_EQ(a.outside, b.outside);
  EXPECT_EQ(a.utilisation, b.utilisation);
  EXPECT_EQ(a.trace.t, b.trace.t);
  ASSERT_EQ(a.events.size(), b.events.size());
  for (std::size_t k = 0; k < a.events.size(); ++k) {
    EXPECT_EQ(a.events[k].start, b.events[k].start);
    EXPECT_EQ(a.events[k].end, b.events[k].end);
    EXPECT_EQ(a.events[k].peak_ratio, b.events[k].peak_ratio);
  }
}

// However few the bins, one in which ε leaves [l, u] shows it.
TEST(Detect, AThinnedTraceKeepsThePeaks) {
  const World world;
  TableSource log(world.table);
  const Detection whole = detect(log, make_detector(world.learned.model), {.most_points = world.table.rows()});
  const Detection thin = detect(log, make_detector(world.learned.model), {.most_points = 64});
  EXPECT_LE(thin.trace.t.size(), 64u);
  EXPECT_GE(thin.trace.t.size(), 32u);
  for (std::size_t i = 0; i < 2; ++i) {
    const OutputTrace &a = whole.trace.outputs[i], &b = thin.trace.outputs[i];
    EXPECT_EQ(std::ranges::max(a.residual_high), std::ranges::max(b.residual_high));
    EXPECT_EQ(std::ranges::min(a.residual_low), std::ranges::min(b.residual_low));
    const auto leaves = [](const OutputTrace& o, std::size_t k) {
      return o.residual_high[k] > o.upper[k] || o.residual_low[k] < o.lower[k];
    };
    std::size_t bins = 0;
    for (std::size_t k = 0; k < thin.trace.t.size(); ++k) {
      bins += leaves(b, k) ? 1 : 0;
    }
    EXPECT_EQ(bins > 0, whole.outside[i] > 0);
  }
}

TEST(Detect, ALogWithoutTheColumnsIsRefused) {
  const World world;
  LogTable table = world.table;
  table.names[0] = "other";
  TableSource log(table);
  EXPECT_THROW(static_cast<void>(detect(log, make_detector(world.learned.model))), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::commission::trace_test
