// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/drive_rows.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "core/check.hpp"
#include "model/filter/kernel.hpp"
#include "model/sim/plant.hpp"

namespace wheelwright::bench {
namespace {

constexpr double step = 0.01;                    // s
constexpr double beta = 20.0;                    // 1/s, and α
constexpr double radius = 0.0975;                // m
constexpr double track = 0.381;                  // m
constexpr double lever = 0.5 * track;            // m
constexpr double torque_error = 0.05;            // ē of the sum channel, N·m
constexpr double correlation_time = 2.0 / 20.0;  // of coloured noise, s
constexpr std::size_t settling = 120;            // samples until the filter has forgotten its start
constexpr std::size_t largest_p = 12;

double unit(std::mt19937_64& generator) { return static_cast<double>(generator() >> 11U) * 0x1p-53; }

/// A sum of sines of periods from 3 to 60 s, whose phases drift slowly, so that no stretch repeats another.
class MultiSine {
 public:
  MultiSine(std::mt19937_64& generator, double mean, double amplitude) : mean_(mean) {
    for (std::size_t k = 0; k < tones_.size(); ++k) {
      const double period = 3.0 * std::pow(20.0, (static_cast<double>(k) + unit(generator)) / 6.0);
      tones_[k] = {2.0 * std::numbers::pi / period, 2.0 * std::numbers::pi * unit(generator),
                   amplitude * (0.25 + 0.1 * static_cast<double>(k)) / 2.0};
    }
    drift_ = 2.0 * std::numbers::pi / (200.0 + 200.0 * unit(generator));
  }

  [[nodiscard]] double operator()(double t) const {
    const double shift = 3.0 * std::sin(drift_ * t) + 2.0 * std::sin(0.618 * drift_ * t);
    double sum = mean_;
    for (std::size_t k = 0; k < tones_.size(); ++k) {
      sum += tones_[k].amplitude * std::sin(tones_[k].rate * t + tones_[k].phase + (k % 2 == 0 ? shift : -shift));
    }
    return sum;
  }

 private:
  struct Tone {
    double rate, phase, amplitude;
  };
  double mean_, drift_ = 0.0;
  std::array<Tone, 6> tones_{};
};

/// θ of the robot, and how far a prior would let it go.
struct Known {
  double truth, lower, upper;
};
constexpr std::array<Known, largest_p> parameters{{{2.05, 0.0, 10.0},     // r·mass, kg·m
                                                   {0.088, 0.0, 1.0},     // r·yaw inertia, kg·m³
                                                   {0.021, 0.0, 1.0},     // viscous friction, right wheel, N·m·s
                                                   {0.017, 0.0, 1.0},     // and left wheel
                                                   {0.082, -1.0, 1.0},    // r·mass·offset of its centre, kg·m²
                                                   {0.049, 0.0, 1.0},     // r·viscous friction of yaw, N·m²·s
                                                   {0.15, 0.0, 2.0},      // dry friction, right wheel, N·m
                                                   {0.12, 0.0, 2.0},      // and left wheel
                                                   {0.02, -1.0, 1.0},     // torque offset, right wheel, N·m
                                                   {-0.015, -1.0, 1.0},   // and left wheel
                                                   {0.2, -5.0, 5.0},      // r·mass·g·slope along x, N·m
                                                   {-0.12, -5.0, 5.0}}};  // and along y

/// Y of one instant, both channels; in the columns of mass and inertia the speeds whose derivatives belong there.
using Instant = std::array<std::array<double, largest_p>, 2>;
constexpr std::array<bool, largest_p> is_acceleration{true, true};

Instant instant(double v1, double v2, double heading) {
  const double right = (v1 + lever * v2) / radius, left = (v1 - lever * v2) / radius;
  const double dry_right = std::tanh(right / 0.1), dry_left = std::tanh(left / 0.1);
  return {{{v1, 0.0, right, left, -v2 * v2, 0.0, dry_right, dry_left, 1.0, 1.0, std::cos(heading), std::sin(heading)},
           {0.0, v2, lever * right, -lever * left, v1 * v2, v2, lever * dry_right, -lever * dry_left, lever, -lever,
            0.0, 0.0}}};
}

/// Uniform on [−1, 1] with an exponential autocorrelation: an autoregressive Gaussian through its distribution
/// function.
class Coloured {
 public:
  explicit Coloured(std::uint64_t seed) : generator_(seed) {}
  double operator()() {
    const double u = 1.0 - unit(generator_), angle = 2.0 * std::numbers::pi * unit(generator_);
    state_ = memory_ * state_ + std::sqrt(1.0 - memory_ * memory_) * std::sqrt(-2.0 * std::log(u)) * std::cos(angle);
    return std::erf(state_ / std::numbers::sqrt2);
  }

 private:
  std::mt19937_64 generator_;
  double memory_ = std::exp(-step / correlation_time);
  double state_ = 0.0;
};

}  // namespace

DriveRows drive_rows(std::size_t n, std::size_t p, RowNoise noise, std::uint64_t seed) {
  check::that(n > 0 && n % 2 == 0, "rows of a drive", "an even number > 0");
  check::that(p == 4 || p == 6 || p == 8 || p == 12, "parameters of a drive", "4, 6, 8 or 12");
  DriveRows rows;
  rows.n = n;
  rows.p = p;
  rows.columns.resize(n * p);
  rows.y.resize(n);
  rows.dy.resize(n);
  for (std::size_t j = 0; j < p; ++j) {
    rows.truth.push_back(parameters[j].truth);
    rows.prior.sides.push_back({parameters[j].lower, parameters[j].upper});
  }

  std::mt19937_64 generator(seed);
  const MultiSine speed(generator, 0.25, 0.5), turn(generator, 0.1, 1.0);
  const filter::StepWeights weights(beta, step);
  std::array<std::array<filter::Cascade, largest_p>, 2> filters{};
  const std::array<double, 2> bound{torque_error, lever * torque_error};
  const sim::NoiseShape shape =
      noise == RowNoise::gaussian ? sim::NoiseShape::truncated_gaussian : sim::NoiseShape::uniform;
  std::array<sim::Noise, 2> independent{sim::Noise(seed, 1, bound[0], shape), sim::Noise(seed, 2, bound[1], shape)};
  std::array<Coloured, 2> coloured{Coloured(2 * seed + 1), Coloured(2 * seed + 2)};

  double heading = 0.0, v2 = turn(0.0);
  Instant before = instant(speed(0.0), v2, heading);
  for (std::size_t k = 1; k < settling + n / 2; ++k) {
    const double t = step * static_cast<double>(k), next = turn(t);
    heading += 0.5 * step * (v2 + next);
    v2 = next;
    const Instant now = instant(speed(t), v2, heading);
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t j = 0; j < p; ++j) {
        if (is_acceleration[j]) {
          filters[i][j].increment(weights, now[i][j] - before[i][j]);
        } else {
          filters[i][j].linear(weights, before[i][j], now[i][j]);
        }
      }
    }
    before = now;
    if (k < settling) {
      continue;
    }
    for (std::size_t i = 0; i < 2; ++i) {
      const std::size_t row = 2 * (k - settling) + i;
      double exact = 0.0;
      for (std::size_t j = 0; j < p; ++j) {
        const double value = beta * beta * filters[i][j].z2;
        rows.columns[j * n + row] = value;
        exact += value * rows.truth[j];
      }
      rows.y[row] = noise == RowNoise::coloured ? exact + bound[i] * coloured[i]() : independent[i].measure(exact);
      rows.dy[row] = noise == RowNoise::uniform ? bound[i] : 1.1 * bound[i];
    }
  }
  return rows;
}

RegressionBlock as_block(const DriveRows& rows) {
  RegressionBlock block;
  block.resize(rows.n / DriveRows::outputs, DriveRows::outputs, rows.p);
  block.dY.setZero();
  for (std::size_t k = 0; k < rows.n / DriveRows::outputs; ++k) {
    block.sample[k] = k;
    block.t[k] = step * static_cast<double>(k);
  }
  const auto n = static_cast<Eigen::Index>(rows.n), p = static_cast<Eigen::Index>(rows.p);
  block.Y = Eigen::Map<const Eigen::MatrixXd>(rows.columns.data(), n, p);
  block.y = Eigen::Map<const Eigen::VectorXd>(rows.y.data(), n);
  block.dy = Eigen::Map<const Eigen::VectorXd>(rows.dy.data(), n);
  return block;
}

std::vector<double> directions(const DriveRows& rows, std::size_t count) {
  check::that(count % 2 == 0 && count <= rows.n, "directions", "an even number of at most as many as there are rows");
  std::vector<double> result;
  result.reserve(count * rows.p);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t row = i; row < count; row += 2) {
      for (std::size_t j = 0; j < rows.p; ++j) {
        result.push_back(rows.column(j)[row]);
      }
    }
  }
  return result;
}

}  // namespace wheelwright::bench
