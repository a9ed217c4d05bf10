// SPDX-License-Identifier: Apache-2.0
/// \file
/// Residuals that are made to live in one place are found there, and noise is found nowhere.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/rows/drive.hpp"
#include "gap/where.hpp"
#include "tests/gap/made_up_drive.hpp"

namespace wheelwright::gap::where_test {
namespace {

using gap_example::made_up_drive;
using gap_example::noise_like;

constexpr double kBeta = 10.0;

ResidualSeries series_of(const Drive& drive, Eigen::VectorXd refitted, double floor) {
  ResidualSeries s;
  s.channel = "sum";
  s.unit = "N·m";
  s.t = drive.t;
  s.refitted = std::move(refitted);
  s.floor = floor;
  return s;
}

WhereOptions options(std::uint64_t seed = 1, std::size_t permutations = 999) {
  WhereOptions o;
  o.beta = kBeta;
  o.seed = seed;
  o.permutations = permutations;
  return o;
}

// Noise of the floor, and beside it a second noise of three times its size where `regime` was 2/β ago.
ResidualSeries living_in(const Drive& drive, const Mask& regime, std::uint64_t seed) {
  const double floor = 0.1;
  Eigen::VectorXd r = noise_like(drive, kBeta, floor, seed);
  const Eigen::VectorXd structure = noise_like(drive, kBeta, 3.0 * floor, seed + 1000);
  const auto delay = static_cast<Eigen::Index>(std::lround(2.0 / kBeta / drive.step));
  for (Eigen::Index k = delay; k < r.size(); ++k) {
    r[k] += regime[k - delay] ? structure[k] : 0.0;
  }
  return series_of(drive, std::move(r), floor);
}

// First entry that is neither a channel nor a band: those do not compete with regimes of the drive.
const GapShare* first_regime(const std::vector<GapShare>& shares) {
  const auto found = std::find_if(shares.begin(), shares.end(),
                                  [](const GapShare& s) { return s.kind != "channel" && s.kind != "frequency"; });
  return found == shares.end() ? nullptr : &*found;
}

TEST(Where, FindsTheRegimeInWhichAResidualLives) {
  const Drive drive = made_up_drive(120.0);
  std::size_t tried = 0;
  for (const Regime& regime : regimes(drive)) {
    // One regime of each kind.
    if (regime.name != "reversal of the right wheel" && regime.name != "right wheel braking" &&
        regime.name != "standstill" && regime.name != "fast turn to the left" && regime.name != "slowing down" &&
        regime.name != "heading 90 to 135°" && regime.name != "left wheel at 0 to 45°" && regime.kind != "time") {
      continue;
    }
    ++tried;
    const auto shares = locate_gap(drive, {living_in(drive, regime.instants, 7)}, options());
    const GapShare* first = first_regime(shares);
    ASSERT_NE(first, nullptr);
    EXPECT_EQ(first->regime, regime.name);
    EXPECT_GT(first->share, 0.9) << regime.name;
    EXPECT_TRUE(is_finding(*first)) << regime.name << " p = " << first->p_value;
  }
  EXPECT_EQ(tried, 17U);
}

TEST(Where, FindsTheBandOfASine) {
  const Drive drive = made_up_drive(120.0);
  for (const auto& [frequency, name] : std::vector<std::pair<double, std::string>>{{0.12, "below 0.2 Hz"},
                                                                                   {0.35, "0.2 to 0.5 Hz"},
                                                                                   {0.75, "0.5 to 1 Hz"},
                                                                                   {1.5, "1 to 2 Hz"},
                                                                                   {3.5, "2 to 5 Hz"}}) {
    Eigen::VectorXd r = noise_like(drive, kBeta, 0.1, 3);
    r.array() += 0.2 * (2.0 * std::numbers::pi * frequency * drive.t.array()).sin();
    const auto shares = locate_gap(drive, {series_of(drive, r, 0.1)}, options());
    const auto band =
        std::find_if(shares.begin(), shares.end(), [](const GapShare& s) { return s.kind == "frequency"; });
    ASSERT_NE(band, shares.end());
    EXPECT_EQ(band->regime, name);
    EXPECT_GT(band->share, 0.9);
    EXPECT_TRUE(is_finding(*band));
  }
}

TEST(Where, NoiseIsFoundNowhere) {
  // Family-wise: a trial counts where any p < 0.05. At most 5 % of 300; 4 standard errors of the count above that would
  // be 30, but the procedure is conservative and the bare 15 must hold.
  const Drive drive = made_up_drive(60.0, 0.04);
  int alarms = 0;
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const auto shares =
        locate_gap(drive, {series_of(drive, noise_like(drive, kBeta, 0.1, 5000 + trial), 0.1)}, options(trial, 199));
    alarms += std::any_of(shares.begin(), shares.end(), [](const GapShare& s) { return s.p_value < 0.05; });
  }
  EXPECT_LE(alarms, 15);
}

TEST(Where, SharesOfWhatDivideTheLogAddUp) {
  const Drive drive = made_up_drive(120.0);
  const auto all = regimes(drive);
  const auto shares = locate_gap(drive, {living_in(drive, all.front().instants, 11)}, options());
  for (const std::string kind : {"time", "heading", "position", "yaw rate", "frequency"}) {
    double share = 0.0, presence = 0.0;
    int parts = 0;
    for (const GapShare& s : shares) {
      if (s.kind == kind) {
        share += s.share;
        presence += s.presence;
        ++parts;
      }
    }
    // Each part is rounded to 0.01; parts with a slightly negative excess count as nothing; standstill has no yaw rate.
    EXPECT_GT(parts, 2) << kind;
    if (kind != "yaw rate") {
      EXPECT_NEAR(share, 1.0, 0.005 * parts + 0.03) << kind;
      EXPECT_NEAR(presence, 1.0, 0.005 * parts + 1e-9) << kind;
    }
  }
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end(),
                             [](const GapShare& a, const GapShare& b) { return a.share > b.share; }));
}

TEST(Where, DividesBetweenChannelsInUnitsOfTheirFloors) {
  const Drive drive = made_up_drive(60.0, 0.02);
  ResidualSeries a = series_of(drive, noise_like(drive, kBeta, 2.0, 1), 1.0);
  ResidualSeries b = series_of(drive, noise_like(drive, kBeta, 0.02, 2), 0.01);
  b.channel = "difference";
  const auto shares = locate_gap(drive, {a, b}, options());
  for (const GapShare& s : shares) {
    if (s.kind == "channel") {
      EXPECT_NEAR(s.share, 0.5, 0.1) << s.channel;  // both have four times their floor's mean square
      EXPECT_LT(s.p_value, 0.05) << s.channel;
    }
  }
}

TEST(Where, FindsTheRegimeOfAPoseResidual) {
  const Drive drive = made_up_drive(240.0);
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal(0.0, 0.001);
  ResidualSeries s;
  s.space = GapSpace::kinematic;
  s.channel = "yaw";
  s.floor = 0.001;
  const Eigen::Index every = 50;
  s.t.resize(drive.rows() / every);
  s.refitted.resize(s.t.size());
  for (Eigen::Index k = 0; k < s.t.size(); ++k) {
    const Eigen::Index row = k * every;
    s.t[k] = drive.t[row];
    s.refitted[k] = normal(generator) + (drive.coordinates[1].smooth_speed[row] < -0.3 ? 5.0 * normal(generator) : 0.0);
  }
  const GapShare* first = nullptr;
  const auto shares = locate_gap(drive, {s}, options());
  first = first_regime(shares);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->kind, "yaw rate");
  EXPECT_NE(first->regime.find("right"), std::string::npos) << first->regime;
  EXPECT_EQ(first->space, GapSpace::kinematic);
}

TEST(Where, RefusesWhatMakesNoSense) {
  const Drive drive = made_up_drive(10.0);
  ResidualSeries s = series_of(drive, noise_like(drive, kBeta, 0.1, 1), 0.1);
  EXPECT_TRUE(locate_gap(drive, {}).empty());
  WhereOptions bad = options();
  bad.beta = 0.0;
  EXPECT_THROW((void)locate_gap(drive, {s}, bad), InvalidArgument);
  s.refitted.conservativeResize(5);
  EXPECT_THROW((void)locate_gap(drive, {s}, options()), InvalidArgument);
  s.t.conservativeResize(5);
  EXPECT_TRUE(locate_gap(drive, {s}, options()).empty());  // too few rows
}

}  // namespace
}  // namespace wheelwright::gap::where_test
