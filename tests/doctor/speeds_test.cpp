// SPDX-License-Identifier: Apache-2.0
// What drivers do to wheel speeds, each put into the log of a robot that is integrated exactly, and named.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/doctor/log_health.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/doctor/as_found.hpp"

namespace wheelwright::doctor::speeds_test {
namespace {

constexpr double kMass = 24.0, kInertia = 1.3, kDrag = 6.0, kYawDrag = 0.7, kRadius = 0.085, kTrack = 0.4;

struct Drive {
  double rate = 100.0, seconds = 120.0, noise = 0.01, effort_noise = 0.05;
  unsigned seed = 1;
};

// A body with viscous friction under torques that are held from row to row: both coordinates exactly.
LogTable drive(const Drive& d) {
  std::mt19937_64 random(d.seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> frequency(5), phase(10);
  std::ranges::generate(frequency, [&] { return 0.265 + 0.235 * unit(random); });
  std::ranges::generate(phase, [&] { return std::numbers::pi * unit(random); });
  const double h = 1.0 / d.rate;
  const auto rows = static_cast<std::size_t>(d.seconds * d.rate);
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "gyro_z", "phi_r", "phi_l"};
  log.columns.resize(log.names.size());
  double v = 0.0, w = 0.0, turned_r = 0.0, turned_l = 0.0, sum_r = 0.0, sum_l = 0.0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) * h;
    double ahead = 0.0, turning = 0.0;
    for (std::size_t i = 0; i < 5; ++i) {
      ahead += std::sin(2.0 * std::numbers::pi * frequency[i] * t + phase[i]) * 0.6 / 3.2;
      turning += std::sin(2.0 * std::numbers::pi * frequency[4 - i] * 1.31 * t + phase[5 + i]) * 1.2 / 3.2;
    }
    const double fade = std::clamp(t - 2.0, 0.0, 1.0) * std::clamp(d.seconds - 2.0 - t, 0.0, 1.0);
    const double right = (v + 0.5 * kTrack * w) / kRadius, left = (v - 0.5 * kTrack * w) / kRadius;
    const double off_r = fade * (ahead + 0.5 * kTrack * turning) / kRadius - right;
    const double off_l = fade * (ahead - 0.5 * kTrack * turning) / kRadius - left;
    sum_r += off_r * h;
    sum_l += off_l * h;
    const double tau_r = 1.2 * off_r + 4.0 * sum_r, tau_l = 1.2 * off_l + 4.0 * sum_l;
    log.t.push_back(t);
    const double row[] = {right + d.noise * unit(random),
                          left + d.noise * unit(random),
                          tau_r + d.effort_noise * unit(random),
                          tau_l + d.effort_noise * unit(random),
                          w + 0.002 * unit(random),
                          turned_r,
                          turned_l};
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      log.columns[c].push_back(row[c]);
    }
    const auto follow = [h](double& x, double force, double inertia, double drag) {
      const double end = force / drag, before = x, decay = std::exp(-drag / inertia * h);
      x = end + (x - end) * decay;
      return end * h + (before - end) * (1.0 - decay) * inertia / drag;  // way
    };
    const double way = follow(v, (tau_r + tau_l) / kRadius, kMass, kDrag);
    const double angle = follow(w, 0.5 * kTrack * (tau_r - tau_l) / kRadius, kInertia, kYawDrag);
    turned_r += (way + 0.5 * kTrack * angle) / kRadius;
    turned_l += (way - 0.5 * kTrack * angle) / kRadius;
  }
  return log;
}

LogTable without_angles(LogTable log) {
  log.names.resize(5);
  log.columns.resize(5);
  return log;
}

Robot robot() {
  return robots::parse_robot(
      "model: differential_drive\nwheel_radius: 0.085\ntrack_width: 0.4\n"
      "effort: {kind: torque, hold: zero_order, changes: at_samples}\nnoise: estimate\n",
      "robot.yaml");
}

template <typename Change>
void change_speeds(LogTable& log, Change change) {
  for (const char* name : {"omega_r", "omega_l"}) {
    change(log.column(name));
  }
}

void smooth(std::vector<double>& values, const model::SpeedFilter& filter, double rate) {
  const double time = filter.middle();
  if (filter.kind == model::SpeedFilterKind::mean) {
    const auto rows = static_cast<std::size_t>(std::lround(time * rate));
    std::vector<double> out = values;
    for (std::size_t k = 0; k < values.size(); ++k) {
      double sum = 0.0;
      for (std::size_t i = 0; i < rows; ++i) {
        sum += values[k >= i ? k - i : 0];
      }
      out[k] = sum / static_cast<double>(rows);
    }
    values = out;
    return;
  }
  for (int i = 0; i < filter.order; ++i) {
    double y = values.front();
    for (double& value : values) {
      y += (1.0 - std::exp(-1.0 / rate / time)) * (value - y);
      value = y;
    }
  }
}

std::string told(const LogHealth& health) {
  std::string text;
  for (const LogFinding& f : health.findings) {
    if (f.severity > FindingSeverity::fine) {
      text += f.id + ": " + f.sentence + "\n";
    }
  }
  return text;
}

struct Smoothed {
  model::SpeedFilter filter;
  double rate;
  friend void PrintTo(const Smoothed& s, std::ostream* out) {
    *out << to_string(s.filter.kind) << s.filter.order << ' ' << s.filter.middle() << " s at " << s.rate << " Hz";
  }
};

class SmoothedSpeeds : public testing::TestWithParam<Smoothed> {};

TEST_P(SmoothedSpeeds, AreNamedWithTheirTimeConstantAndReadAlike) {
  const auto& [filter, rate] = GetParam();
  LogTable log = without_angles(drive({.rate = rate, .seed = 7}));
  change_speeds(log, [&](auto& values) { smooth(values, filter, rate); });
  const LogHealth health = examine(log, robot());
  const LogFinding* found = health.find("signals.speed_filter");
  ASSERT_NE(found, nullptr) << told(health);
  ASSERT_TRUE(found->speed_filter) << found->sentence << found->next;
  EXPECT_EQ(health.find("time.effort_delay"), nullptr);
  EXPECT_EQ(health.verdict, LogVerdict::commission) << told(health);
  Robot read = robot();
  read.speed_filter = found->speed_filter;
  TableSource source(log);
  const commission::Commissioning result = commission::commission_robot(source, read);
  ASSERT_EQ(result.status, commission::Commissioning::Status::done) << result.message;
  const double truth[] = {kMass, kInertia, kDrag, kYawDrag};
  for (std::size_t j = 0; j < 4; ++j) {
    const Interval found_interval{result.parameters[j].lower, result.parameters[j].upper};
    EXPECT_TRUE(found_interval.contains(kRadius * truth[j]))
        << j << ": " << found_interval.lower / kRadius << " to " << found_interval.upper / kRadius << '\n'
        << found->sentence;
    EXPECT_EQ(result.parameters[j].warrant, core::Warrant::extrapolated);
  }
}

constexpr auto kExponential = model::SpeedFilterKind::exponential;
INSTANTIATE_TEST_SUITE_P(Filters, SmoothedSpeeds,
                         testing::Values(Smoothed{{.kind = kExponential, .time = {0.02, 0.02}}, 100.0},
                                         Smoothed{{.kind = kExponential, .time = {0.05, 0.05}}, 100.0},
                                         Smoothed{{.kind = kExponential, .time = {0.1, 0.1}}, 50.0},
                                         Smoothed{{.kind = kExponential, .time = {0.05, 0.05}}, 200.0},
                                         Smoothed{{.kind = model::SpeedFilterKind::mean, .time = {0.1, 0.1}}, 100.0}));

// With and without a model, and never guaranteed without the truth: bounds that hold, or are too small for the filter.
TEST(Speeds, ThatAreSmoothedBesideDeclaredNoiseAreTheSameToDoctorAndCommission) {
  const double truth[] = {kMass, kInertia, kDrag, kYawDrag};
  std::size_t models = 0, refusals = 0;
  for (const double rate : {50.0, 100.0}) {
    for (const double time : {0.0, 0.005, 0.01, 0.03}) {
      for (const double declared : {0.011, 0.05, 0.2}) {
        for (const Interval& delay : {Interval{}, Interval{0.0, 1e-4}}) {
          LogTable log = without_angles(drive({.rate = rate, .seconds = 40.0, .seed = 9}));
          if (time > 0.0) {
            change_speeds(log, [&](auto& values) {
              smooth(values, {.kind = model::SpeedFilterKind::exponential, .time = {time, time}}, rate);
            });
          }
          Robot read = robot();
          read.noise.wheel_speed.value = declared;
          read.noise.effort.value = 0.051;
          read.effort_delay = delay;
          const LogHealth health = examine(log, read);
          const commission::Commissioning result = testing_support::commissioned_as_found(log, read, health);
          const std::string what = std::to_string(rate) + " Hz, " + std::to_string(time) + " s, ± " +
                                   std::to_string(declared) + '\n' + told(health) + result.message;
          EXPECT_EQ(health.verdict == LogVerdict::commission, result.has_model()) << what;
          (result.has_model() ? models : refusals) += 1;
          for (std::size_t j = 0; j < 4 && result.has_model(); ++j) {
            const Interval found{result.parameters[j].lower, result.parameters[j].upper};
            EXPECT_TRUE(found.contains(kRadius * truth[j])) << j << ' ' << what;
          }
          EXPECT_TRUE(time > 0.0 || result.model.warrant == core::Warrant::guaranteed) << what;
        }
      }
    }
  }
  EXPECT_GT(models, 0U);
  EXPECT_GT(refusals, 0U);
}

TEST(Speeds, OfAnOrdinaryLogHaveNoneOfThis) {
  for (const double rate : {20.0, 100.0, 250.0}) {
    for (const unsigned seed : {1U, 2U}) {
      const LogTable log = drive({.rate = rate, .seed = seed});
      for (const LogTable& each : {log, without_angles(log)}) {
        const LogHealth health = examine(each, robot());
        for (const char* id : {"signals.speed_filter", "signals.no_direction", "signals.rounded",
                               "signals.position_zero", "signals.speed_zero", "signals.spikes"}) {
          EXPECT_EQ(health.find(id), nullptr) << told(health);
        }
      }
    }
  }
}

// Speeds that come late as a whole are not smoothed.
TEST(Speeds, OfAnotherClockAreLateAndNotSmoothed) {
  LogTable log = without_angles(drive({}));
  change_speeds(log, [](auto& values) {
    for (std::size_t k = values.size() - 1; k >= 5; --k) {
      values[k] = values[k - 5];
    }
  });
  const LogHealth health = examine(log, robot());
  const LogFinding* smoothed = health.find("signals.speed_filter");
  EXPECT_TRUE(smoothed == nullptr || !smoothed->speed_filter) << told(health);
  EXPECT_EQ(health.verdict, LogVerdict::unusable);
}

TEST(Speeds, WithTheSignOfTheCommandOrNoneAreRefused) {
  const LogTable good = drive({});
  for (const bool command : {true, false}) {
    LogTable log = good;
    for (const char side : {'r', 'l'}) {
      std::vector<double>& speed = log.column(std::string("omega_") + side);
      std::vector<double>& angle = log.column(std::string("phi_") + side);
      std::vector<double> turned(angle.size(), 0.0);
      const std::vector<double> before = speed;
      for (std::size_t k = 0; k < speed.size(); ++k) {
        const double sign = !command ? 1.0 : std::copysign(1.0, before[std::min(k + 10, speed.size() - 1)]);
        speed[k] = sign * std::abs(speed[k]);
        turned[k] = k == 0 ? 0.0 : turned[k - 1] + sign * std::abs(angle[k] - angle[k - 1]);
      }
      angle = turned;
    }
    for (const LogTable& each : {log, without_angles(log)}) {
      const LogHealth health = examine(each, robot());
      const LogFinding* found = health.find("signals.no_direction");
      ASSERT_NE(found, nullptr) << command << '\n' << told(health);
      EXPECT_TRUE(found->is_refusal());
      EXPECT_EQ(health.find("time.effort_delay"), nullptr);
    }
  }
}

TEST(Speeds, CutOffOrRoundedToAUnitAreToldByTheAngles) {
  constexpr double kUnit = 2.0 * std::numbers::pi / 60.0;  // rpm
  struct Kind {
    double (*round)(double);
    const char* word;
    bool cut, down;
  };
  for (const auto& [round, word, cut, down] :
       {Kind{[](double x) { return std::round(x); }, "rounded, wrong by half", false, false},
        Kind{[](double x) { return std::trunc(x); }, "towards zero", true, false},
        Kind{[](double x) { return std::floor(x); }, "downwards", true, true}}) {
    LogTable log = drive({});
    change_speeds(log, [&](auto& values) {
      std::ranges::transform(values, values.begin(), [&](double v) { return kUnit * round(v / kUnit); });
    });
    const LogHealth health = examine(log, robot());
    const LogFinding* found = health.find("signals.rounded");
    ASSERT_NE(found, nullptr) << told(health);
    EXPECT_NE(found->sentence.find(word), std::string::npos) << found->sentence;
    EXPECT_NE(found->sentence.find("1 rpm"), std::string::npos) << found->sentence;
    ASSERT_EQ(found->speed_cut.has_value(), cut);
    if (cut) {
      EXPECT_NEAR(found->speed_cut->unit, kUnit, 1e-6);
      EXPECT_EQ(found->speed_cut->down, down);
    }
    const LogHealth alone = examine(without_angles(log), robot());
    ASSERT_NE(alone.find("signals.rounded"), nullptr) << told(alone);
    EXPECT_EQ(alone.find("signals.rounded")->speed_cut.has_value(), cut && !down) << told(alone);
  }
}

TEST(Speeds, SingleImpossibleSamplesAreNamedWithTheirPlace) {
  for (const char* name : {"omega_r", "phi_l", "tau_r", "gyro_z"}) {
    for (const std::size_t rows : {1U, 2U}) {
      LogTable log = drive({});
      for (std::size_t i = 0; i < rows; ++i) {
        log.column(name)[5000 + i] += 30.0;
      }
      const LogHealth health = examine(log, robot());
      const LogFinding* found = health.find("signals.spikes");
      ASSERT_NE(found, nullptr) << name << '\n' << told(health);
      EXPECT_EQ(found->value, static_cast<double>(rows));
      ASSERT_EQ(found->when.size(), 1U);
      EXPECT_DOUBLE_EQ(found->when[0].lower, log.t[5000]);
    }
  }
}

TEST(Speeds, AnglesThatStayZeroAreLeftOut) {
  for (const bool angles : {true, false}) {
    LogTable log = drive({});
    for (const char* name : {angles ? "phi_r" : "omega_r", angles ? "phi_l" : "omega_l"}) {
      std::ranges::fill(log.column(name), 0.0);
    }
    const LogHealth health = examine(log, robot());
    const LogFinding* found = health.find(angles ? "signals.position_zero" : "signals.speed_zero");
    ASSERT_NE(found, nullptr) << told(health);
    EXPECT_TRUE(found->hides);
    EXPECT_EQ(health.verdict, LogVerdict::commission) << told(health);
  }
}

TEST(Speeds, AnglesThatStopForAWhileAreLeftOut) {
  for (const char* name : {"phi_r", "phi_l"}) {
    for (const double seconds : {8.0, 30.0}) {
      LogTable log = drive({});
      std::vector<double>& angle = log.column(name);
      const auto last = std::min(log.rows(), static_cast<std::size_t>(2000.0 + 100.0 * seconds));
      for (std::size_t k = 2000; k < last; ++k) {
        angle[k] = angle[1999];
      }
      const LogHealth health = examine(log, robot());
      const LogFinding* found = health.find("signals.position_zero");
      ASSERT_NE(found, nullptr) << told(health);
      EXPECT_TRUE(found->hides);
      EXPECT_THAT(found->columns, ::testing::UnorderedElementsAre("phi_r", "phi_l"));
      EXPECT_EQ(health.verdict, LogVerdict::commission) << told(health);
    }
  }
}

// Whole numbers beside nothing that measures the motion may be rpm; a robot file that bounds their error settles it.
TEST(Speeds, InWholeNumbersAreRefusedWhereNothingTellsTheirUnit) {
  LogTable log = drive({});
  for (const char* name : {"omega_r", "omega_l"}) {
    std::ranges::transform(log.column(name), log.column(name).begin(),
                           [](double v) { return std::round(v * 30.0 / std::numbers::pi); });
  }
  for (const char* name : {"phi_r", "phi_l", "gyro_z"}) {
    const auto at = std::ranges::find(log.names, name);
    if (at != log.names.end()) {
      log.columns.erase(log.columns.begin() + (at - log.names.begin()));
      log.names.erase(at);
    }
  }
  Robot declared = robot();
  declared.noise.wheel_speed.value.reset();
  const LogHealth health = examine(log, declared);
  ASSERT_NE(health.find("units.wheel_speed"), nullptr) << told(health);
  EXPECT_TRUE(health.find("units.wheel_speed")->is_refusal());
  EXPECT_THAT(health.find("units.wheel_speed")->next, ::testing::HasSubstr("--map omega_r=\"*0.10472\""));
  declared.noise.wheel_speed.value = 1.0;
  EXPECT_EQ(examine(log, declared).find("units.wheel_speed"), nullptr);
}

}  // namespace
}  // namespace wheelwright::doctor::speeds_test
