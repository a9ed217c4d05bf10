// SPDX-License-Identifier: Apache-2.0
/// \file
/// Question: what does a robot with a steered front axle and one driven axle need?
///
/// While its steering stands still at a curvature κ = tan(δ)/L, the yaw rate is κv, and the driven axle has to move
///     τ = r (m + I κ²) v̇ + r (b + c κ²) v,
/// with I the yaw inertia about the middle of the rear axle and c the scrub of the tyres in a turn. So rows of a model
/// of one joint, filtered from stretch to stretch of constant steering, times [1, κ², 1, κ²], are rows in m, I, b and
/// c: the regressor of a robot that the toolkit does not have, with the bounds of one that it has. What happens while
/// the steering moves, I κ κ̇ v among it, is left out, and with it no fault is looked for there.
///
/// The claims: truth inside the bounds, all of which are narrower than their prior; and a log whose steering never
/// stands still for long says nothing rather than something wrong.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/model/filter/row_stream.hpp>

using namespace wheelwright;

namespace {

constexpr double kRadius = 0.1, kWheelbase = 0.6;                                 // m
constexpr std::array kTruth = {28.0, 4.5, 6.0, 2.5};                              // m, I, b, c
constexpr double kAngleNoise = 2e-4, kTorqueNoise = 0.02, kSteeringNoise = 2e-3;  // bounds |n| <=, rad, N·m, rad
constexpr double kStep = 0.01;                                                    // s
constexpr std::array kPrior = {Interval{1.0, 200.0}, Interval{0.0, 50.0}, Interval{0.0, 100.0}, Interval{0.0, 50.0}};

double curvature(double steering) { return std::tan(steering) / kWheelbase; }

/// One joint: speed of the driven axle, with the moved mass and the viscous friction as it has them at κ = 0.
Model straight() {
  Model m;
  m.name = "driven_axle";
  m.parameters = {{"r_mass", "kg·m", "mass", "kg", kRadius, {0.0, 1e3}, "accelerate and brake"},
                  {"r_viscous", "N·s", "viscous", "N·s/m", kRadius, {0.0, 1e3}, "drive at several speeds"}};
  m.outputs = {"axle"};
  m.output_units = {"N·m"};
  m.coordinates = {"v"};
  m.joints = {{.angle = "phi", .speed = "omega", .torque = "tau", .current = "", .voltage = "", .command = ""}};
  m.motion = Eigen::MatrixXd::Constant(1, 1, kRadius);
  m.input = Eigen::MatrixXd::Identity(1, 1);
  m.terms = {{.output = 0, .parameter = 0, .kind = Term::Kind::acceleration},
             {.output = 0, .parameter = 1, .kind = Term::Kind::speed}};
  return m;
}

/// The robot driven with a torque that follows a speed; `steering_at` says how it steers.
template <typename Steering>
LogTable drive(const Steering& steering_at, double duration) {
  std::mt19937_64 generator(7);
  const auto noise = [&](double bound) {
    return bound * (2.0 * static_cast<double>(generator() >> 11) * 0x1p-53 - 1.0);
  };
  const auto [m, i, b, c] = kTruth;
  LogTable log{{"phi", "tau", "steering"}, {}, {{}, {}, {}}, {0}};
  double angle = 0.0, v = 0.0;
  for (int k = 0; kStep * k < duration; ++k) {
    const double t = kStep * k;
    const double wanted = 1.2 + 0.5 * std::sin(1.3 * t) + 0.4 * std::sin(0.37 * t);
    const double torque = kRadius * 60.0 * (wanted - v);  // held until the next sample
    log.t.push_back(t);
    log.columns[0].push_back(angle + noise(kAngleNoise));
    log.columns[1].push_back(torque + noise(kTorqueNoise));
    log.columns[2].push_back(steering_at(t) + noise(kSteeringNoise));
    constexpr int parts = 20;
    for (int n = 0; n < parts; ++n) {
      const double h = kStep / parts, at = t + h * n;
      const double kappa = curvature(steering_at(at));
      const double bending = (curvature(steering_at(at + 1e-6)) - curvature(steering_at(at - 1e-6))) / 2e-6;
      const double acceleration =
          (torque / kRadius - (b + c * kappa * kappa) * v - i * kappa * bending * v) / (m + i * kappa * kappa);
      angle += h * (v + 0.5 * h * acceleration) / kRadius;
      v += h * acceleration;
    }
  }
  return log;
}

/// A stretch of the log in which the steering stood still as far as its sensor tells, with all that κ² may be.
struct Stretch {
  double begin = 0.0, end = 0.0;  // s
  Interval squared;               // 1/m²
};

/// Cuts the log where the steering leaves its noise about where a stretch began, and marks the cuts as segments.
std::vector<Stretch> cut(LogTable& log) {
  std::vector<Stretch> stretches;
  const std::vector<double>& steering = log.columns[2];
  log.segment_starts.clear();
  Interval seen;
  for (std::size_t k = 0; k < log.t.size(); ++k) {
    const Interval wider{std::min(seen.lower, steering[k]), std::max(seen.upper, steering[k])};
    if (k == 0 || wider.upper - wider.lower > 2.0 * kSteeringNoise) {
      log.segment_starts.push_back(k);
      stretches.push_back({log.t[k], log.t[k], {}});
      seen = core::point(steering[k]);
    } else {
      seen = wider;
    }
    // The true angle is within the noise of all readings.
    const double low = curvature(seen.upper - kSteeringNoise), high = curvature(seen.lower + kSteeringNoise);
    const double least = low > 0.0 ? low : high < 0.0 ? -high : 0.0;
    stretches.back().end = log.t[k];
    stretches.back().squared = {least * least, std::pow(std::max(std::abs(low), std::abs(high)), 2)};
  }
  return stretches;
}

/// Rows of the straight model as rows in m, I, b and c.
class SteeredRows final : public core::RegressionSource {
 public:
  SteeredRows(core::RegressionSource& rows, std::vector<Stretch> stretches)
      : rows_(&rows), stretches_(std::move(stretches)) {}
  [[nodiscard]] std::size_t outputs() const override { return 1; }
  [[nodiscard]] std::size_t parameters() const override { return kTruth.size(); }
  void rewind() override { rows_->rewind(); }
  bool next(RegressionBlock& block) override {
    if (!rows_->next(straight_)) {
      return false;
    }
    block.resize(straight_.instants(), 1, kTruth.size());
    block.sample = straight_.sample;
    block.t = straight_.t;
    block.y = straight_.y;
    block.dy = straight_.dy;
    for (Eigen::Index k = 0; k < straight_.rows(); ++k) {
      const double t = straight_.t[static_cast<std::size_t>(k)];
      const Stretch& at =
          *std::find_if(stretches_.begin(), stretches_.end(), [&](const Stretch& s) { return t <= s.end; });
      const double half = 0.5 * at.squared.width();
      for (Eigen::Index j = 0; j < 2; ++j) {
        const double Y = kRadius * straight_.Y(k, j), dY = kRadius * straight_.dY(k, j);
        block.Y(k, 2 * j) = Y;
        block.dY(k, 2 * j) = dY;
        block.Y(k, 2 * j + 1) = at.squared.centre() * Y;
        block.dY(k, 2 * j + 1) = at.squared.upper * dY + half * std::abs(Y);
      }
    }
    return true;
  }

 private:
  core::RegressionSource* rows_;
  std::vector<Stretch> stretches_;
  RegressionBlock straight_;
};

struct Answer {
  std::size_t rows = 0;
  identify::LeastSquaresFit fit;
  FeasibleSet set;
};

Answer bound(LogTable log) {
  const std::vector<Stretch> stretches = cut(log);
  TableSource source(log);
  const Model model = straight();
  const Measurement measurement{MotionKind::angle, {"phi"}, {"tau"}, "", Hold::zero_order, false, 0.0, kStep};
  const FilterDesign filter{.order = 2, .alpha = 5.0, .beta = 5.0};
  // Speeds as linear between samples: |φ̈| h²/8 of the angle.
  const filter::SensorErrors sensors{kAngleNoise + 2e-4, kTorqueNoise, 0.0};
  TorqueRows filtered(
      source, RegressorFilter(model, filter, measurement, filter::propagate(model, filter, measurement, sensors)));
  SteeredRows rows(filtered, stretches);
  Answer answer;
  answer.rows = static_cast<std::size_t>(read_all(rows).rows());
  if (answer.rows > 0) {
    answer.fit = least_squares(rows);
    answer.set = feasible_set(rows, Box{{kPrior.begin(), kPrior.end()}});
  }
  return answer;
}

}  // namespace

int main() {
  // Stretches of twelve seconds, and a second from each to the next.
  const auto in_stretches = [](double t) {
    constexpr std::array angles = {0.0, 0.45, -0.3, 0.55, -0.5, 0.2};
    const auto k = static_cast<std::size_t>(t / 12.0);
    const double ahead = std::clamp(t - 12.0 * static_cast<double>(k) - 11.0, 0.0, 1.0);
    return angles[k % angles.size()] * (1.0 - ahead) + angles[(k + 1) % angles.size()] * ahead;
  };
  const Answer answer = bound(drive(in_stretches, 144.0));
  bool good = answer.set.status == FeasibleSet::Status::nonempty && answer.set.polytope->contains(kTruth);
  constexpr std::array names = {"mass", "yaw inertia", "viscous", "scrub"};
  constexpr std::array units = {"kg", "kg·m²", "N·s/m", "N·m·s/rad"};
  for (std::size_t j = 0; j < kTruth.size(); ++j) {
    const Interval side = answer.set.hull.sides[j];
    good = good && side.contains(kTruth[j]) && side.upper - side.lower < 0.25 * (kPrior[j].upper - kPrior[j].lower);
    fmt::print("{:<12} {:8.3f} in [{:.3f}, {:.3f}] {:<10}  truth {}\n", names[j],
               answer.fit.estimate[static_cast<Eigen::Index>(j)], side.lower, side.upper, units[j], kTruth[j]);
  }
  fmt::print("{} rows from stretches of constant steering\n", answer.rows);

  const Answer never = bound(drive([](double t) { return 0.5 * std::sin(0.8 * std::numbers::pi * t); }, 60.0));
  fmt::print("{} rows from a drive that steers all the time\n", never.rows);
  return good && never.rows == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
