// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/repeat_noise.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <wheelwright/core/error.hpp>

#include "support/random.hpp"

namespace wheelwright::repeat_noise_test {
namespace {

using testing_support::Autoregression;
using testing_support::Random;

constexpr double kStep = 0.01;
constexpr double kSd = 0.03;

struct Run {
  std::uint64_t seed = 1;
  double clock = 0.0;  // s: the log's clock is ahead
  double phi = 0.0;
  double pace = 2.0;  // rad/s of the commanded motion
  double offset = 0.0;
  double start = 100.0;
};

LogTable log_of(const Run& run) {
  Autoregression noise(run.seed, run.phi);
  LogTable log;
  log.names = {"command_r", "omega_r"};
  log.columns.resize(2);
  for (int k = 0; k < 3000; ++k) {
    const double t = kStep * k;
    log.t.push_back(run.start + t);
    const double time = t - run.clock;
    const double command = time > 1.0 ? 4.0 * std::sin(run.pace * (time - 1.0)) + std::sin(0.7 * (time - 1.0)) : 0.0;
    log.columns[0].push_back(command);
    log.columns[1].push_back(0.95 * command + run.offset + kSd * noise.next());
  }
  return log;
}

Repeats compare(const Run& first, const Run& second, bool commands = true) {
  const LogTable a = log_of(first), b = log_of(second);
  TableSource one(a), two(b);
  RepeatOptions options;
  if (commands) {
    options.commands = {"command_r"};
  }
  return repeat_noise(one, two, {"omega_r"}, options);
}

TEST(RepeatNoise, FindsWhatWasPutInWithinItsStatedError) {
  constexpr int runs = 60;
  double sum = 0.0, squares = 0.0, stated = 0.0;
  for (int run = 0; run < runs; ++run) {
    const auto seed = static_cast<std::uint64_t>(2 * run + 10);
    const Repeats r = compare({.seed = seed}, {.seed = seed + 1, .offset = 0.2, .start = 7.0}, false);
    ASSERT_EQ(r.status, RepeatStatus::repeats);
    const RepeatNoise& n = r.columns[0];
    EXPECT_NEAR(n.offset, 0.2, 5.0 * kSd * std::sqrt(2.0 / 3000.0));
    EXPECT_NEAR(n.autocorrelation[0], 0.0, 5.0 / std::sqrt(3000.0));
    EXPECT_NEAR(n.correlation_time, kStep, 1e-9);
    const double relative = n.sd * n.sd / (kSd * kSd);
    sum += relative;
    squares += relative * relative;
    stated += n.relative_sd * n.relative_sd;
  }
  const double scatter = std::sqrt(squares / runs - std::pow(sum / runs, 2.0));
  EXPECT_NEAR(sum / runs, 1.0, 4.0 * std::sqrt(2.0 / 3000.0 / runs));
  EXPECT_NEAR(std::sqrt(stated / runs) / scatter, 1.0, 0.45);  // a scatter of 60 values is known to 9 %
}

// The clocks are off by whole steps and by parts of one; interpolation is allowed for.
TEST(RepeatNoise, AlignsByCommands) {
  for (const double clock : {0.0, 0.37, -0.52, 0.123, 0.255}) {
    const Repeats r = compare({.seed = 3}, {.seed = 4, .clock = clock});
    ASSERT_EQ(r.status, RepeatStatus::repeats) << clock;
    EXPECT_NEAR(r.shift, clock, 0.05 * kStep);
    EXPECT_NEAR(r.columns[0].sd * r.columns[0].sd / (kSd * kSd), 1.0, 0.13) << clock;
    EXPECT_GT(r.columns[0].agreement, 0.99);
  }
}

TEST(RepeatNoise, ReportsTheAutocorrelation) {
  const Repeats r = compare({.seed = 5, .phi = 0.9}, {.seed = 6, .phi = 0.9});
  const RepeatNoise& n = r.columns[0];
  for (std::size_t lag = 1; lag <= 10; ++lag) {
    EXPECT_NEAR(n.autocorrelation[lag - 1], std::pow(0.9, static_cast<double>(lag)), 0.12) << lag;
  }
  EXPECT_NEAR(n.correlation_time, kStep / -std::log(0.9), 3.0 * kStep);
  EXPECT_GT(n.relative_sd, 2.0 * std::sqrt(2.0 / 3000.0));
}

TEST(RepeatNoise, SaysWhenTheRunsAreNoRepeats) {
  EXPECT_EQ(compare({.seed = 7}, {.seed = 8, .pace = 2.3}).status, RepeatStatus::different_commands);
  EXPECT_EQ(compare({.seed = 7}, {.seed = 8, .pace = 2.3}, false).status, RepeatStatus::different_motion);
  EXPECT_EQ(compare({.seed = 7}, {.seed = 8, .clock = 0.5}, false).status, RepeatStatus::different_motion);
  const LogTable log = log_of({});
  const LogTable few = slice(log, 0, 40);
  TableSource a(log), b(few);
  EXPECT_EQ(repeat_noise(a, b, {"omega_r"}).status, RepeatStatus::too_short);
  EXPECT_THROW(static_cast<void>(repeat_noise(a, b, {"tau_r"})), InvalidArgument);
}

TEST(RepeatNoise, DoesNotReachAcrossGaps) {
  const LogTable a = log_of({.seed = 1});
  LogTable b = log_of({.seed = 2});
  b.segment_starts = {0, 1500};
  for (std::size_t k = 1500; k < b.rows(); ++k) {
    b.t[k] += 0.3 * kStep;
  }
  TableSource one(a), two(b);
  const Repeats r = repeat_noise(one, two, {"omega_r"});
  // Of the rows before the split all match, and those after it lie between two rows; the one at the split is lost.
  EXPECT_EQ(r.instants, 2999U);
}

}  // namespace
}  // namespace wheelwright::repeat_noise_test
