// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: what does a robot need that the toolkit has never heard of?
///
/// One small type that fills a Model. Here: an unbalanced wheel on a horizontal axle,
///     τ = J φ̈ + b φ̇ + w sin φ,
/// with gravity on its eccentric mass as a function of the angle. Filter, least squares and feasible set take it as it
/// is. The claim: both the estimate and the bounds agree with the truth that the log was made of.
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

#include <fmt/format.h>

#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/model/filter/row_stream.hpp>

using namespace wheelwright;

namespace {

constexpr std::array kTruth = {0.02, 0.01, 0.3};           // J (kg·m²), b (N·m·s/rad), w (N·m)
constexpr double kAngleNoise = 2e-4, kTorqueNoise = 5e-3;  // bounds |n| <=, rad and N·m
constexpr double kStep = 0.005;                            // s

struct UnbalancedWheel {
  /// The model; column `phi` serves as joint angle and, for the gravity term, as heading.
  [[nodiscard]] static Model model() {
    Model m;
    m.name = "unbalanced_wheel";
    m.parameters = {{"inertia", "kg·m²", "inertia", "kg·m²", 1.0, {0.0, 1.0}, "change speed"},
                    {"viscous", "N·m·s/rad", "viscous", "N·m·s/rad", 1.0, {0.0, 1.0}, "turn at several speeds"},
                    {"imbalance", "N·m", "imbalance", "N·m", 1.0, {0.0, 10.0}, "turn slowly"}};
    m.outputs = {"axle"};
    m.output_units = {"N·m"};
    m.coordinates = {"phi"};
    m.joints = {{.angle = "phi", .speed = "omega", .torque = "tau", .current = "", .voltage = "", .command = ""}};
    m.motion = m.input = Eigen::MatrixXd::Identity(1, 1);
    // |sin φ − sin φ'| <= |φ − φ'|: the error of the angle bounds that of the term.
    const auto gravity = [](const model::MotionState& s) {
      return model::TermValue{std::sin(s.heading), s.heading_error};
    };
    m.terms = {{.output = 0, .parameter = 0, .kind = Term::Kind::acceleration},
               {.output = 0, .parameter = 1, .kind = Term::Kind::speed},
               {.output = 0, .parameter = 2, .kind = Term::Kind::function, .function = gravity}};
    m.heading_coordinate = 0;
    m.heading_used = true;
    return m;
  }
};

/// Two minutes of a motion that is known in closed form, with the torque that it takes.
LogTable drive() {
  std::mt19937_64 generator(1);
  const auto noise = [&](double bound) {
    return bound * (2.0 * static_cast<double>(generator() >> 11) * 0x1p-53 - 1.0);
  };
  LogTable log{{"phi", "tau"}, {}, {{}, {}}, {}};
  for (int k = 0; k < 24000; ++k) {
    const double t = kStep * k;
    const double angle = 2.0 * std::sin(1.1 * t) + 3.0 * std::sin(0.4 * t);
    const double speed = 2.2 * std::cos(1.1 * t) + 1.2 * std::cos(0.4 * t);
    const double acceleration = -2.42 * std::sin(1.1 * t) - 0.48 * std::sin(0.4 * t);
    const double torque = kTruth[0] * acceleration + kTruth[1] * speed + kTruth[2] * std::sin(angle);
    log.t.push_back(t);
    log.columns[0].push_back(angle + noise(kAngleNoise));
    log.columns[1].push_back(torque + noise(kTorqueNoise));
  }
  return log;
}

}  // namespace

int main() {
  const Model model = UnbalancedWheel::model();
  const LogTable log = drive();
  TableSource source(log);
  const Measurement measurement{MotionKind::angle, {"phi"}, {"tau"}, "phi", Hold::first_order, false, 0.0, kStep};
  const FilterDesign filter{.order = 2, .alpha = 5.0, .beta = 5.0};
  // Taking signals as linear between samples adds |ẍ| h²/8: to φ 1e-5 rad, to τ 2e-5 N·m, to sin φ 5e-5.
  const filter::SensorErrors sensors{kAngleNoise + 1e-5, kTorqueNoise + 2e-5, kAngleNoise + 6e-5};
  TorqueRows rows(source,
                  RegressorFilter(model, filter, measurement, filter::propagate(model, filter, measurement, sensors)));

  const identify::LeastSquaresFit fit = least_squares(rows);
  const FeasibleSet set = feasible_set(rows, Box{{{0.0, 1.0}, {0.0, 1.0}, {0.0, 10.0}}});
  bool good = set.status == FeasibleSet::Status::nonempty && set.polytope->contains(kTruth);
  for (std::size_t j = 0; j < kTruth.size(); ++j) {
    const double estimate = fit.estimate[static_cast<Eigen::Index>(j)];
    good = good && set.hull.sides[j].contains(kTruth[j]) && std::abs(estimate - kTruth[j]) < 0.02 * kTruth[j];
    fmt::print("{:<10} {:.5f} in [{:.5f}, {:.5f}] {:<10}  truth {:.5f}\n", model.parameters[j].name, estimate,
               set.hull.sides[j].lower, set.hull.sides[j].upper, model.parameters[j].unit, kTruth[j]);
  }
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
