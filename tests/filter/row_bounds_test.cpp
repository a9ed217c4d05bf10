// SPDX-License-Identifier: Apache-2.0
// Rows against a plant that is solved exactly between the events of its efforts: |y − Yθ| <= dy + dY|θ|, every row.
#include "model/filter/regressor_filter.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/single_axis.hpp"

namespace wheelwright::filter::row_bounds_test {
namespace {

// m v̇ + f v + c sgn v = τ with τ linear between events (constant where there is dry friction).
struct Plant {
  double m = 1.0, f = 1.0, c = 0.0;
  double x = 0.0, v = 0.0;

  // Over `h` with the effort going from `a` to `b`.
  void run(double h, double a, double b) {
    if (c <= 0.0) {
      slide(h, a, b, 0.0);
      return;
    }
    for (int turns = 0; h > 0.0 && turns < 8; ++turns) {
      if (v == 0.0 && std::abs(a) <= c) {
        return;
      }
      const double s = v != 0.0 ? (v > 0.0 ? 1.0 : -1.0) : (a > 0.0 ? 1.0 : -1.0);
      const double end = (a - s * c) / f;  // the speed this tends to
      double until = h;
      if (v != 0.0 && end * s < 0.0) {
        until = std::min(h, -std::log(-end / (v - end)) * m / f);
      }
      slide(until, a, a, s);
      if (until < h) {
        v = 0.0;
      }
      h -= until;
    }
  }

 private:
  void slide(double h, double a, double b, double s) {
    if (h <= 0.0) return;
    const double l = f / m, k = (b - a) / h, e = -std::expm1(-l * h) / l;  // e = ∫ e^{−ls}
    const double p = (a - s * c) / f - k / (f * l), q = k / f;             // v = p + q t + (v0 − p)e^{−lt}
    x += p * h + 0.5 * q * h * h + (v - p) * e;
    v = p + q * h + (v - p) * std::exp(-l * h);
  }
};

enum class Commands { at_samples, between, linear };
enum class Clock { even, jittered, ticks, lossy };

struct Case {
  MotionKind motion = MotionKind::angle;
  Commands commands = Commands::at_samples;
  Clock clock = Clock::even;
  double h = 0.01;
  double time_constant = 5.0;  // m/f, s
  double period = 2.0;         // of the efforts, s
  double dry = 0.0;            // share of the effort
  int order = 2;
  double beta = 20.0;
  double noise = 1.0;  // share of its bound
  double lost = 0.0;   // share of rows that begin a run of lost ones ...
  int run = 1;         // ... of this length
  long only_lost = 0;  // this row is lost
};

std::string words(const Case& c) {
  return "motion " + std::to_string(static_cast<int>(c.motion)) + " commands " +
         std::to_string(static_cast<int>(c.commands)) + " clock " + std::to_string(static_cast<int>(c.clock)) + " h " +
         std::to_string(c.h) + " m/f " + std::to_string(c.time_constant) + " period " + std::to_string(c.period) +
         " dry " + std::to_string(c.dry) + " order " + std::to_string(c.order) + " lost " + std::to_string(c.lost) +
         " in runs of " + std::to_string(c.run);
}

struct Outcome {
  long given = 0, rows = 0, beyond = 0;
  double worst = 0.0;                 // largest error over bound
  std::vector<double> times, bounds;  // of the rows
};

Outcome watch(const Case& c, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double m = 3.0, f = m / c.time_constant, amplitude = 2.0;
  Plant plant{m, f, c.dry * amplitude};
  model::SingleAxis axis{.coulomb = c.dry > 0.0};
  Measurement measurement;
  measurement.motion = c.motion;
  measurement.motion_columns = {"position"};
  measurement.effort_columns = {"effort"};
  measurement.nominal_step = c.h;
  measurement.shortest_step = c.lost > 0.0 && c.clock == Clock::jittered ? 0.7 * c.h : 0.0;
  measurement.hold = c.commands == Commands::linear ? Hold::first_order : Hold::zero_order;
  measurement.changes =
      c.commands == Commands::between ? model::EffortChanges::between : model::EffortChanges::at_samples;
  const Model model = axis.model();
  const FilterDesign design{.order = c.order, .alpha = c.beta, .beta = c.beta};
  SensorErrors sensors{.motion = 1e-6, .effort = 1e-4};
  SignalErrors errors = propagate(model, design, measurement, sensors);
  std::vector<Interval> sides = {{0.9 * m, 1.1 * m}, {0.9 * f, 1.1 * f}};
  Eigen::VectorXd theta(2);
  theta << m, f;
  if (c.dry > 0.0) {
    sides.push_back({0.9 * plant.c, 1.1 * plant.c});
    theta.conservativeResize(3);
    theta[2] = plant.c;
  }
  const Eigen::VectorXd effort_error = errors.motion.effort;
  errors.motion = motion_bound(model, sides);
  errors.motion.effort = effort_error;
  RegressorFilter filter(model, design, measurement, errors);

  const auto command = [&](double t) {
    return amplitude * (std::sin(2.0 * std::numbers::pi * t / c.period) +
                        0.5 * std::sin(2.0 * std::numbers::pi * t / (0.37 * c.period) + 1.0));
  };
  const auto noise = [&](double bound) { return c.noise * bound * (rng() % 2 == 0 ? 1.0 : -1.0); };
  Outcome outcome;
  double t = 0.0, effort = command(0.0), before = 0.0;
  long tick = 0;
  const auto next_step = [&]() {
    ++tick;
    switch (c.clock) {
      case Clock::even: return c.h;
      case Clock::jittered: return c.h * (1.0 + 0.3 * unit(rng));
      case Clock::ticks: return c.h * (tick % 2 == 0 ? 0.8 : 1.2);
      case Clock::lossy: return c.h * (rng() % 97 == 0 ? 2.0 : 1.0);
    }
    return c.h;
  };
  if (c.motion == MotionKind::mean_speed) {
    plant.run(0.5 * c.h, effort, effort);
    before = plant.x;
  }
  long taken = 0;
  int missing = 0;
  const auto is_lost = [&] {
    if (missing == 0 && taken > 3 && c.lost > 0.0 && 0.5 + 0.5 * unit(rng) < c.lost) {
      missing = c.run;
    }
    return (missing > 0 && missing-- > 0) || (c.only_lost > 0 && taken == c.only_lost);
  };
  const auto give = [&](double motion, double acting) {
    const std::array<double, 2> sample{motion, acting + noise(sensors.effort)};
    ++taken;
    if (is_lost()) {
      return;
    }
    ++outcome.given;
    if (!filter.step(t, sample)) {
      return;
    }
    const FilteredRow& row = filter.row();
    const double error = std::abs(row.y[0] - row.Y.row(0).dot(theta));
    const double bound = row.dy[0] + row.dY.row(0).dot(theta);
    outcome.beyond += error > bound ? 1 : 0;
    outcome.worst = std::max(outcome.worst, error / bound);
    ++outcome.rows;
    outcome.times.push_back(t);
    outcome.bounds.push_back(bound);
  };
  double error_before = 0.0;
  for (int k = 0; k < 3000; ++k) {
    if (c.motion == MotionKind::mean_speed) {
      // Stamp t in the middle; the effort of the stamp acts over [t, t + h), or changes to it a moment after.
      const double next = command(t + c.h);
      // From t + h/2 to t + h with the old effort, then to t + 3h/2 with the new one.
      const double switch_at = c.commands == Commands::between ? 0.5 * c.h * (0.5 + 0.5 * unit(rng)) : 0.5 * c.h;
      if (c.commands == Commands::linear) {
        const double middle = 0.5 * (effort + next);
        plant.run(0.5 * c.h, middle, next);
      } else {
        plant.run(switch_at, effort, effort);
        plant.run(0.5 * c.h - switch_at, next, next);
      }
      const double then = command(t + 2.0 * c.h);
      if (c.commands == Commands::linear) {
        plant.run(0.5 * c.h, next, 0.5 * (next + then));
      } else {
        plant.run(0.5 * c.h, next, next);
      }
      t += c.h;
      const double error = noise(sensors.motion);
      const double speed = (plant.x + error - before - error_before) / c.h;
      before = plant.x;
      error_before = error;
      effort = next;
      give(speed, effort);
      continue;
    }
    give((c.motion == MotionKind::angle ? plant.x : plant.v) + noise(sensors.motion), effort);
    const double h = next_step();
    const double next = command(t + h);
    switch (c.commands) {
      case Commands::at_samples: plant.run(h, effort, effort); break;
      case Commands::between: {
        const double until = h * (0.5 + 0.5 * unit(rng));
        plant.run(until, effort, effort);
        plant.run(h - until, next, next);
        break;
      }
      case Commands::linear: plant.run(h, effort, next); break;
    }
    t += h;
    effort = next;
  }
  return outcome;
}

class RowBounds : public testing::TestWithParam<Case> {};

TEST_P(RowBounds, HoldInEveryRow) {
  const Case c = GetParam();
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Outcome outcome = watch(c, seed);
    EXPECT_GT(outcome.rows, c.clock == Clock::lossy ? 500 : 2500) << words(c);
    EXPECT_EQ(outcome.beyond, 0) << words(c) << ": " << outcome.worst << " times the bound in the worst row of "
                                 << outcome.rows;
  }
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const MotionKind motion : {MotionKind::angle, MotionKind::mean_speed, MotionKind::speed}) {
    for (const Commands commands : {Commands::at_samples, Commands::between, Commands::linear}) {
      for (const double constant : {5.0, 0.5, 0.05, 0.015}) {
        for (const Clock clock : {Clock::even, Clock::jittered, Clock::ticks, Clock::lossy}) {
          if (motion == MotionKind::mean_speed && clock != Clock::even) {
            continue;
          }
          all.push_back({.motion = motion, .commands = commands, .clock = clock, .time_constant = constant});
          all.push_back(
              {.motion = motion, .commands = commands, .clock = clock, .time_constant = constant, .period = 0.15});
          if (commands != Commands::linear) {
            all.push_back({.motion = motion,
                           .commands = commands,
                           .clock = clock,
                           .time_constant = constant,
                           .period = 0.4,
                           .dry = 0.3});
          }
          if (motion == MotionKind::speed) {
            all.push_back({.motion = motion,
                           .commands = commands,
                           .clock = clock,
                           .time_constant = constant,
                           .period = 0.4,
                           .order = 1});
          }
        }
      }
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Everywhere, RowBounds, testing::ValuesIn(cases()));

class LostRows : public testing::TestWithParam<Case> {};

// Commands that were to come with rows that are lost were executed all the same.
TEST_P(LostRows, ArePassedOverAndNoRowIsWrong) {
  const Case c = GetParam();
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const Outcome outcome = watch(c, seed);
    const auto settling =
        c.motion == MotionKind::speed ? 2L : static_cast<long>(1.05 * std::ceil(12.0 / (c.beta * c.h))) + 3;
    EXPECT_GE(outcome.rows, outcome.given - settling) << words(c);
    EXPECT_EQ(outcome.beyond, 0) << words(c) << ": " << outcome.worst << " times the bound in the worst row of "
                                 << outcome.rows;
  }
}

std::vector<Case> with_lost_rows() {
  std::vector<Case> all;
  for (const MotionKind motion : {MotionKind::angle, MotionKind::mean_speed, MotionKind::speed}) {
    for (const Commands commands : {Commands::at_samples, Commands::between, Commands::linear}) {
      for (const double rate : {10.0, 50.0, 100.0, 500.0}) {
        for (const double lost : {0.001, 0.01, 0.03, 0.1}) {
          const int run = lost < 0.02 ? 1 : rate < 60.0 ? 2 : 4;
          Case c{.motion = motion,
                 .commands = commands,
                 .h = 1.0 / rate,
                 .period = 20.0 / rate,
                 .beta = std::min(20.0, 0.5 * rate),
                 .lost = lost / run,
                 .run = run};
          all.push_back(c);
          if (motion == MotionKind::speed) {
            c.order = 1;
            all.push_back(c);
          } else if (motion == MotionKind::angle) {
            c.clock = Clock::jittered;
            all.push_back(c);
          }
          c.clock = Clock::even;
          c.order = 2;
          if (commands != Commands::linear) {
            c.dry = 0.3;
            all.push_back(c);
          }
        }
      }
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Everywhere, LostRows, testing::ValuesIn(with_lost_rows()));

TEST(LostRow, WidensBoundsForAWhile) {
  for (const MotionKind motion : {MotionKind::angle, MotionKind::mean_speed, MotionKind::speed}) {
    Case c{.motion = motion};
    const Outcome whole = watch(c, 1);
    c.only_lost = 1500;
    const Outcome lossy = watch(c, 1);
    ASSERT_EQ(whole.rows, lossy.rows + 1);
    const double instant = 15.0, forgotten = instant + 40.0 / c.beta;
    std::size_t before = 0, wider = 0, after = 0;
    for (std::size_t k = 0, w = 0; k < lossy.times.size(); ++k, ++w) {
      w += whole.times[w] != lossy.times[k] ? 1 : 0;
      ASSERT_EQ(whole.times[w], lossy.times[k]);
      if (lossy.times[k] < instant - 0.02) {
        ++before;
        ASSERT_EQ(whole.bounds[w], lossy.bounds[k]) << "what comes later";
      } else if (lossy.times[k] > forgotten) {
        ++after;
        ASSERT_NEAR(lossy.bounds[k] / whole.bounds[w], 1.0, 1e-9) << "what was long ago";
      } else {
        wider += lossy.bounds[k] > whole.bounds[w] ? 1 : 0;
      }
    }
    EXPECT_GT(before, 1000u);
    EXPECT_GT(wider, 20u);
    EXPECT_GT(after, 1000u);
  }
}

}  // namespace
}  // namespace wheelwright::filter::row_bounds_test
