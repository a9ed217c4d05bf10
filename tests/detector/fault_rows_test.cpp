// SPDX-License-Identifier: Apache-2.0
// Filtered signatures against the simulator, which integrates the faulty robot itself, and against logs whose columns
// were falsified as a broken sensor would.
#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "detector/faults/fault_rows.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/fault_oracle.hpp"
#include "tests/support/lost_rows.hpp"

namespace wheelwright::detector::fault_rows_test {

using model::Fault;

namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Shown;

constexpr double kOnset = 7.0;  // s, a sample of all rates that are used

FaultType find_fault(const Model& model, const std::string& name) {
  for (const FaultType& fault : fault_catalogue(model, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())))) {
    if (fault.name == name) {
      return fault;
    }
  }
  throw InvalidArgument("no fault '" + name + "'");
}

// The first instant that the fault has reached.
std::size_t onset_of(const ReferenceMotion& motion, double t) {
  return static_cast<std::size_t>(std::lower_bound(motion.instant.begin(), motion.instant.end(), t - 1e-9) -
                                  motion.instant.begin());
}

// τ_f − (y + κ g1 + κ² g2) θ − κ c over two seconds from the onset, and its regressor as seen against y + κ s; both
// over the largest size of what the fault adds. `motion` is what encoders of a healthy robot would show, `log` what was
// logged.
struct Mismatch {
  double torque = 0.0, seen = 0.0;
};

Mismatch mismatch(const FaultType& fault, double kappa, const ReferenceMotion& motion, const ReferenceMotion& log,
                  const Model& model, const FilterDesign& design, const Eigen::VectorXd& theta, double skip) {
  FaultFilter rows(fault, model, design, motion);
  const std::size_t onset = onset_of(motion, kOnset);
  rows.begin(onset);
  double torque = 0.0, torque_size = 0.0, seen = 0.0, seen_size = 0.0;
  while (rows.next() && motion.t[rows.instant()] < kOnset + 2.0) {
    if (motion.t[rows.instant()] < kOnset + skip) {
      continue;
    }
    for (std::size_t i = 0; i < model.n(); ++i) {
      const FaultRow row = rows.row(i);
      const auto at = static_cast<Eigen::Index>(rows.instant() * model.n() + i);
      double left = log.rows.y[at] - kappa * row.c, added = kappa * row.c;
      for (std::size_t j = 0; j < model.p(); ++j) {
        const auto k = static_cast<Eigen::Index>(j);
        const double signature = kappa * row.g1[j] + kappa * kappa * row.g2[j];
        left -= (row.y[j] + signature) * theta[k];
        added += signature * theta[k];
        seen = std::max(seen, std::abs(log.rows.Y(at, k) - row.y[j] - kappa * row.s[j]));
        seen_size = std::max(seen_size, std::abs(kappa * row.s[j]));
      }
      torque = std::max(torque, std::abs(left));
      torque_size = std::max(torque_size, std::abs(added));
    }
  }
  return {torque_size > 0.0 ? torque / torque_size : torque, seen_size > 0.0 ? seen / seen_size : seen};
}

struct Prepared {
  Scenario scenario;
  Model model;
  FilterDesign design;
  Eigen::VectorXd theta;
};

Prepared prepared(Shown shown, double rate, Hold hold = Hold::zero_order) {
  Prepared s;
  s.scenario = exact_drive(shown, hold);
  s.scenario.rate = rate;
  s.scenario.duration = 10.0;
  s.model = model::make_model(s.scenario.robot);
  s.design = filter_of(s.scenario).design();
  s.theta = sim::true_parameters(s.scenario, s.model);
  return s;
}

struct Simulated {
  const char* name;
  Fault::Kind kind;
  double magnitude;  // of the simulator: m, m/s, rad/s
  double kappa;
};

std::vector<Simulated> simulated(double radius) {
  return {{"wheel_radius", Fault::Kind::wheel_radius, 0.1 * radius, 0.1},
          {"wheel_radius", Fault::Kind::wheel_radius, -0.1 * radius, -0.1},
          {"wheel_radius_right", Fault::Kind::wheel_radius_right, 0.08 * radius, 0.08},
          {"wheel_radius_left", Fault::Kind::wheel_radius_left, -0.08 * radius, -0.08},
          {"matched", Fault::Kind::matched, 0.05, 0.05},
          {"unmatched", Fault::Kind::unmatched, -0.1, -0.1},
          {"slip_yaw", Fault::Kind::slip_yaw, 0.1, 0.1}};
}

double simulated_error(const Simulated& each, Shown shown, double rate, bool drift) {
  Prepared s = prepared(shown, rate);
  FaultType fault = find_fault(s.model, each.name);
  Fault simulated{.kind = each.kind, .magnitude = each.magnitude, .profile = {.onset = kOnset}};
  if (drift) {
    fault.profile = {.kind = FaultProfile::Kind::ramp, .rise = 1.0};
    simulated.profile.shape = model::TimeProfile::Shape::ramp;
    simulated.profile.rise_time = 1.0;
  }
  s.scenario.faults = {simulated};
  Simulation log(s.scenario);
  const ReferenceMotion motion = read_reference(log, filter_of(s.scenario));
  return mismatch(fault, each.kappa, motion, motion, s.model, s.design, s.theta, 0.0).torque;
}
// Without the motor's constants nothing in kg follows from a current.
TEST(FaultCatalogue, HasTheMassAsAShareWhereEffortsAreNoTorques) {
  const Model model = DifferentialDrive{.wheel_radius = 0.1, .track_width = 0.4}.model();
  const Eigen::VectorXd theta = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(model.p()), 2.0, 3.0);
  const auto in_torque = fault_catalogue(model, theta),
             in_current = fault_catalogue(model, theta, model::EffortKind::current);
  const FaultType &mass = find_fault(in_torque, "payload_lost"), &share = find_fault(in_current, "payload_lost");
  EXPECT_EQ(mass.unit, "kg");
  EXPECT_EQ(share.unit, "1");
  EXPECT_EQ(share.range.upper, 1.0);
  // All of it, either way.
  EXPECT_TRUE(
      (share.theta * share.kappa(share.range.upper)).isApprox(mass.theta * mass.kappa(mass.range.upper), 1e-12));
  EXPECT_NEAR(share.theta[0], -theta[0], 1e-12);
}

TEST(FaultRows, OfFaultsThatComeSlowlyAreTheSimulators) {
  for (const Shown shown : {Shown::angles, Shown::speeds}) {
    for (const Simulated& each : simulated(0.0975)) {
      const double coarse = simulated_error(each, shown, 100.0, true);
      EXPECT_LT(coarse, 0.05) << each.name;
      // What is left is discretisation. Angles tell of the middle of an interval: the fault comes half a step late.
      EXPECT_LT(simulated_error(each, shown, 400.0, true), coarse / (shown == Shown::angles ? 3.5 : 8.0)) << each.name;
    }
  }
}

// A step jumps somewhere in a sampling interval: an error of the first order, largest at once.
TEST(FaultRows, OfStepsAreTheSimulators) {
  for (const Simulated& each : simulated(0.0975)) {
    const double coarse = simulated_error(each, Shown::angles, 200.0, false);
    EXPECT_LT(coarse, 0.08) << each.name;
    EXPECT_LT(simulated_error(each, Shown::angles, 800.0, false), coarse / 3.0) << each.name;
  }
}

// What a broken sensor or actuator makes of the columns of a healthy log, from the onset on.
struct Falsified {
  std::string name;
  double kappa;
  std::function<void(LogTable&, std::size_t onset)> change;
};

double falsified_error(const Falsified& each, double rate) {
  const Prepared s = prepared(Shown::angles, rate);
  Simulation healthy(s.scenario);
  LogTable table = read_all(healthy);
  const ReferenceMotion motion = read_reference(healthy, filter_of(s.scenario));
  const auto onset =
      static_cast<std::size_t>(std::lower_bound(table.t.begin(), table.t.end(), kOnset - 1e-9) - table.t.begin());
  each.change(table, onset);
  TableSource source(table);
  const ReferenceMotion log = read_reference(source, filter_of(s.scenario));
  const Mismatch m = mismatch(find_fault(s.model, each.name), each.kappa, motion, log, s.model, s.design, s.theta, 0.0);
  return std::max(m.torque, m.seen);
}

std::function<void(LogTable&, std::size_t)> scale(const char* column, double factor) {
  return [=](LogTable& table, std::size_t onset) {
    std::vector<double>& values = table.column(column);
    for (std::size_t k = onset; k < values.size(); ++k) {
      values[k] *= factor;
    }
  };
}

std::function<void(LogTable&, std::size_t)> count(const char* column, double factor, double seconds) {
  return [=](LogTable& table, std::size_t onset) {
    std::vector<double>& values = table.column(column);
    std::vector<double> changed = values;
    for (std::size_t k = onset + 1; k < values.size(); ++k) {
      const bool broken = table.t[k - 1] < table.t[onset] + seconds - 1e-9;
      changed[k] = changed[k - 1] + (broken ? factor : 1.0) * (values[k] - values[k - 1]);
    }
    values = changed;
  };
}

TEST(FaultRows, OfBrokenSensorsAreThoseOfFalsifiedLogs) {
  const std::vector<Falsified> all = {{"effort_loss_right", 0.25, scale("tau_r", 1.25)},
                                      {"effort_dead_left", 1.0, scale("tau_l", 0.0)},
                                      {"effort_bias_left", 0.3,
                                       [](LogTable& table, std::size_t onset) {
                                         std::vector<double>& values = table.column("tau_l");
                                         for (std::size_t k = onset; k < values.size(); ++k) {
                                           values[k] += 0.3;
                                         }
                                       }},
                                      {"encoder_scale_right", 0.1, count("phi_r", 1.1, 1e9)},
                                      {"encoder_scale_left", -0.2, count("phi_l", 0.8, 1e9)},
                                      {"encoder_frozen_right", 1.0, count("phi_r", 0.0, 1e9)},
                                      {"encoder_dropout_left", 1.0, count("phi_l", 0.0, 0.1)}};
  for (const Falsified& each : all) {
    const double coarse = falsified_error(each, 200.0);
    EXPECT_LT(coarse, 0.1) << each.name;
    EXPECT_LT(falsified_error(each, 800.0), coarse / 3.0) << each.name;
  }
}

// The healthy log without the rows at `lost` (samples after the onset), and what encoders that count wrong make of it.
double error_beside_a_loss(Shown shown, const std::vector<int>& lost, double rate) {
  const Prepared s = prepared(shown, rate);
  Simulation simulation(s.scenario);
  const LogTable whole = read_all(simulation);
  const auto onset_in = [](const LogTable& log) {
    return std::lower_bound(log.t.begin(), log.t.end(), kOnset - 1e-9) - log.t.begin();
  };
  const auto onset = onset_in(whole);
  const LogTable table = testing_support::without_rows(whole, [&](std::size_t k) {
    return std::ranges::find(lost, static_cast<std::ptrdiff_t>(k) - onset) != lost.end();
  });
  const RegressorFilter exact = filter_of(s.scenario);
  filter::SignalErrors errors = exact.errors();
  errors.bridges = true;
  const RegressorFilter filter(s.model, s.design, exact.measurement(), errors);
  TableSource healthy(table);
  const ReferenceMotion motion = read_reference(healthy, filter);
  LogTable broken = table;
  const bool speeds = shown == Shown::speeds;
  (speeds ? scale("omega_r", 1.1) : count("phi_r", 1.1, 1e9))(broken, static_cast<std::size_t>(onset_in(table)));
  TableSource source(broken);
  const ReferenceMotion log = read_reference(source, filter);
  EXPECT_EQ(motion.segment_starts.size(), 1u);
  return mismatch(find_fault(s.model, "encoder_scale_right"), 0.1, motion, log, s.model, s.design, s.theta, 0.0).seen;
}

// A speed jumps in the step that ends at the sample of the onset, and rows hold the jump if that step is known.
TEST(FaultRows, BesideLostRowsAreThoseOfFalsifiedLogs) {
  for (const Shown shown : {Shown::speeds, Shown::angles}) {
    for (const std::vector<int>& lost : std::vector<std::vector<int>>{{}, {-1}, {1}, {-1, 1}, {2}, {-2}}) {
      const double coarse = error_beside_a_loss(shown, lost, 200.0);
      EXPECT_LT(coarse, 0.1) << testing::PrintToString(lost);
      EXPECT_LT(error_beside_a_loss(shown, lost, 800.0), coarse / 3.0 + 1e-9) << testing::PrintToString(lost);
    }
  }
}

// A reading that stands still, and mass that is lost, by closed forms at a constant speed: torque f·v·r on both wheels.
TEST(FaultRows, SettleToClosedForms) {
  const Prepared s = prepared(Shown::angles, 100.0);
  const double v1 = 0.5, v2 = 0.3, a1 = 0.2;
  const SettledRows mass = settled_rows(find_fault(s.model, "payload_lost"), s.model, s.design, Eigen::Vector2d(v1, v2),
                                        Eigen::Vector2d(a1, 0.0));
  EXPECT_NEAR(mass.signature.c[0], -0.0975 * a1 * s.design.static_gain(), 1e-12);
  EXPECT_EQ(mass.signature.c[1], 0.0);
  const SettledRows lateral = settled_rows(find_fault(s.model, "unmatched"), s.model, s.design, Eigen::Vector2d(v1, v2),
                                           Eigen::Vector2d::Zero());
  // (16): an unmatched slip ρ_U gives m ρ_U θ̇ in the sum channel.
  EXPECT_NEAR(lateral.signature.g1(0, 0), v2 * s.design.static_gain(), 1e-12);
  EXPECT_EQ(lateral.signature.g1.row(1).norm(), 0.0);
  const SettledRows radius = settled_rows(find_fault(s.model, "wheel_radius"), s.model, s.design,
                                          Eigen::Vector2d(v1, v2), Eigen::Vector2d(a1, 0.1));
  // ζ = ((1 + κ)² − 1) Yθ.
  EXPECT_LT((radius.signature.g1 - 2.0 * radius.Y).norm(), 1e-12 * radius.Y.norm());
  EXPECT_LT((radius.signature.g2 - radius.Y).norm(), 1e-12 * radius.Y.norm());
}

// ζ of (16) for every combination of speed, acceleration and radii, by the paper's own formula.
TEST(FaultRows, SettleToZetaOfThePaper) {
  const Prepared s = prepared(Shown::angles, 100.0);
  const DifferentialDrive drive = sim::drive_of(s.scenario.robot);
  const Eigen::Vector2d v(0.4, -0.7), a(0.3, 0.9);
  for (const char* name : {"wheel_radius", "wheel_radius_right", "wheel_radius_left"}) {
    const std::string right = "wheel_radius_right", left = "wheel_radius_left";
    const double x = 0.07;
    model::FaultState state;
    state.radius = x * drive.wheel_radius * Eigen::Vector2d(name != left ? 1.0 : 0.0, name != right ? 1.0 : 0.0);
    const Eigen::Vector2d expected = zeta(drive, s.scenario.parameters, state, {0.0, v, a});
    const SettledRows rows = settled_rows(find_fault(s.model, name), s.model, s.design, v, a);
    const Eigen::Vector2d found = (x * rows.signature.g1 + x * x * rows.signature.g2) * s.theta;
    EXPECT_LT((found - expected * s.design.static_gain()).norm(), 1e-12 * expected.norm()) << name;
  }
}

// v|v|, e^{−ω²} sgn ω and sgn v as further terms of the drive's first output.
Model with_term(Model model, const model::TermFunction& function) {
  model.terms.push_back({.output = 0, .parameter = 0, .kind = Term::Kind::function, .function = function});
  return model;
}
model::TermValue drag(const model::MotionState& s) { return {s.speed[0] * std::abs(s.speed[0]), 0.0}; }
model::TermValue stribeck(const model::MotionState& s) {
  return {std::exp(-s.joint_speed[0] * s.joint_speed[0]) * std::copysign(1.0, s.joint_speed[0]), 0.0};
}
model::TermValue sign_of_speed(const model::MotionState& s) {
  return {static_cast<double>((s.speed[0] > 0.0) - (s.speed[0] < 0.0)), 0.0};
}

TEST(FaultRows, ArePolynomialsWhereFunctionsOfTheMotionAre) {
  const Model plain = prepared(Shown::angles, 100.0).model;
  const auto known = [&](const Model& model, const char* fault) { return polynomial(find_fault(plain, fault), model); };
  for (const char* fault : {"wheel_radius", "wheel_slip_right", "encoder_scale_left", "payload_lost", "matched"}) {
    EXPECT_TRUE(known(plain, fault)) << fault;
  }
  const Model dragged = with_term(plain, drag);
  EXPECT_TRUE(known(dragged, "wheel_slip_right"));      // κ and κ²
  EXPECT_FALSE(known(dragged, "wheel_radius"));         // κ³: the effort's gain, too
  EXPECT_FALSE(known(dragged, "encoder_scale_right"));  // κ² of what is only seen
  EXPECT_FALSE(known(dragged, "matched"));              // |v + κ|
  EXPECT_TRUE(known(dragged, "effort_loss_right"));
  const Model sticky = with_term(plain, stribeck);
  EXPECT_FALSE(known(sticky, "encoder_scale_right"));
  EXPECT_TRUE(known(sticky, "wheel_slip_right"));  // the wheel itself turns as it is seen to
  const Model dry = with_term(plain, sign_of_speed);
  EXPECT_TRUE(known(dry, "wheel_radius"));
  EXPECT_FALSE(known(dry, "matched"));
  EXPECT_FALSE(known(plain, "effort_stuck_right"));
}

TEST(FaultRows, HoldFunctionsOfTheMotionToTheSecondOrder) {
  const Prepared s = prepared(Shown::angles, 100.0);
  const Eigen::Vector2d v(0.4, 0.0), a(0.0, 0.0);
  const FaultType radius = find_fault(s.model, "wheel_slip_right");
  const auto added = [&](const model::TermFunction& function, double kappa) {
    const SettledRows with = settled_rows(radius, with_term(s.model, function), s.design, v, a),
                      without = settled_rows(radius, s.model, s.design, v, a);
    return (kappa * (with.signature.g1 - without.signature.g1) +
            kappa * kappa * (with.signature.g2 - without.signature.g2))(0, 0) /
           s.design.static_gain();
  };
  for (const double kappa : {-0.9, 0.3, 0.8}) {
    const double moved = 0.4 * (1.0 - 0.5 * kappa);  // half of the way is the right wheel's
    EXPECT_NEAR(added(drag, kappa), moved * moved - 0.16, 1e-14) << kappa;
    EXPECT_EQ(added(sign_of_speed, kappa), 0.0) << kappa;
    EXPECT_EQ(added(stribeck, kappa), 0.0) << kappa;
  }
}

// By how much the rows of a motion read with noise leave those of the motion itself, over the bounds that they state.
double read_error(const FaultType& fault, const Model& model, const FilterDesign& design, const ReferenceMotion& motion,
                  const ReferenceMotion& noisy) {
  FaultFilter exact(fault, model, design, motion), read(fault, model, design, noisy);
  SignatureErrors errors(fault, model, design, noisy);
  const std::size_t onset = onset_of(motion, kOnset);
  errors.begin(onset);
  exact.begin(onset);
  read.begin(onset);
  double worst = 0.0, since = 0.0;
  constexpr double kRounding = 1e-12;
  while (exact.next() && read.next()) {
    since += noisy.step[read.instant()];
    for (std::size_t i = 0; i < model.n(); ++i) {
      const FaultRow a = exact.row(i), b = read.row(i);
      const SignatureErrors::Row e = errors.row(read.instant(), i, since);
      for (std::size_t j = 0; j < model.p(); ++j) {
        const auto k = static_cast<Eigen::Index>(j);
        const auto over = [&](double difference, double bound) {
          worst = std::max(worst, std::abs(difference) / (bound + kRounding));
        };
        over(a.y[j] - b.y[j], b.read[j]);
        over(a.g1[j] - b.g1[j], e.e1[k]);
        over(a.g2[j] - b.g2[j], e.e2[k]);
        over(a.s[j] - b.s[j], e.es[k]);
      }
      worst = std::max(worst, std::abs(a.c - b.c) / (e.ec + kRounding));
    }
  }
  return worst;
}

TEST(FaultRows, OfAMotionReadWithNoiseStateTheirErrors) {
  constexpr double kBound = 1e-3;  // rad, rad/s
  for (const Shown shown : {Shown::angles, Shown::speeds}) {
    for (const bool uneven : {false, true}) {
      Prepared s = prepared(shown, 200.0);
      Simulation simulation(s.scenario);
      LogTable log = read_all(simulation);
      const auto thin = [&](std::vector<double>& column) {  // steps of 5, or of 2 and 3, of the simulation's samples
        std::size_t to = 0;
        for (std::size_t k = 0; k < column.size(); ++k) {
          if (k % 5 == 0 || (uneven && k % 5 == 2)) column[to++] = column[k];
        }
        column.resize(to);
      };
      thin(log.t);
      std::for_each(log.columns.begin(), log.columns.end(), thin);
      TableSource source(log);
      const Measurement measurement = filter::find_measurement(source, s.scenario.robot, s.model, s.design.order);
      filter::SensorErrors sensors;
      sensors.motion = kBound;
      const RegressorFilter filter(s.model, s.design, measurement,
                                   filter::propagate(s.model, s.design, measurement, sensors));
      const ReferenceMotion motion = read_reference(source, filter);
      double most = 0.0;
      for (int pattern = 0; pattern < 4; ++pattern) {
        LogTable noisy = log;
        std::uint64_t random = 88172645463325252u;
        for (std::size_t k = 0; k < noisy.rows(); ++k) {
          for (std::size_t c = 0; c < 2; ++c) {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            const bool up = pattern == 0   ? (random >> 32) % 2 == 0
                            : pattern == 1 ? k % 2 == c
                            : pattern == 2 ? noisy.t[k] >= kOnset - 1e-9
                                           : std::sin(8.0 * noisy.t[k]) > 0.0;
            noisy.column(measurement.columns()[c])[k] += up ? kBound : -kBound;
          }
        }
        TableSource noisy_source(noisy);
        const ReferenceMotion read = read_reference(noisy_source, filter);
        for (const FaultType& fault : fault_catalogue(s.model, s.theta)) {
          if (fault.held_effort || fault.profile.kind == FaultProfile::Kind::bump) {
            continue;
          }
          const double error = read_error(fault, s.model, s.design, motion, read);
          EXPECT_LE(error, 1.0) << fault.name << (shown == Shown::angles ? ", angles, " : ", speeds, ")
                                << (uneven ? "uneven, " : "even, ") << pattern;
          most = std::max(most, error);
        }
      }
      // What is bounded is also reached, nearly.
      EXPECT_GT(most, 0.5);
    }
  }
}

TEST(FaultRows, RefuseFaultsThatMakeNoSense) {
  const Prepared s = prepared(Shown::angles, 100.0);
  FaultType fault = find_fault(s.model, "wheel_radius");
  fault.motion = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_THROW(validate(fault, s.model), InvalidArgument);
  fault = find_fault(s.model, "wheel_radius");
  fault.range = {0.1, 0.2};
  EXPECT_THROW(validate(fault, s.model), InvalidArgument);
  fault = find_fault(s.model, "wheel_radius");
  fault.seen = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_THROW(validate(fault, s.model), InvalidArgument);
  fault = find_fault(s.model, "wheel_radius_drift");
  fault.profile.rise = 0.0;
  EXPECT_THROW(validate(fault, s.model), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::fault_rows_test
