// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/spectrum.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <unsupported/Eigen/FFT>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {
namespace {

// Means over cells of equal duration; `filled` where a cell has a value.
struct Cells {
  double width = 0.0;
  Eigen::VectorXd value;
  Eigen::VectorXd filled;
};

Cells cells_of(const Eigen::VectorXd& t, const Eigen::VectorXd& values, double width) {
  const auto n = static_cast<Eigen::Index>((t[t.size() - 1] - t[0]) / width + 1.0 + 1e-9);
  Cells cells{width, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    const auto at = std::min(n - 1, static_cast<Eigen::Index>((t[k] - t[0]) / width + 1e-6));
    cells.value[at] += values[k];
    cells.filled[at] += 1.0;
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    if (cells.filled[k] > 0.0) {
      cells.value[k] /= cells.filled[k];
      cells.filled[k] = 1.0;
    }
  }
  return cells;
}

// The largest product of twos, threes and fives that is <= `length`: what a fast transform likes.
Eigen::Index smooth_length(Eigen::Index length) {
  for (; length > 1; --length) {
    Eigen::Index rest = length;
    for (const Eigen::Index factor : {2, 3, 5}) {
      while (rest % factor == 0) {
        rest /= factor;
      }
    }
    if (rest == 1) {
      break;
    }
  }
  return length;
}

double median_step(const Eigen::VectorXd& t) {
  std::vector<double> steps(static_cast<std::size_t>(t.size() - 1));
  for (std::size_t k = 0; k < steps.size(); ++k) {
    steps[k] = t[static_cast<Eigen::Index>(k) + 1] - t[static_cast<Eigen::Index>(k)];
  }
  return median(std::move(steps));
}

}  // namespace

double Spectrum::power(double lower, double upper) const {
  if (frequency.size() == 0) {
    return 0.0;
  }
  const double spacing = frequency[0];
  double sum = 0.0;
  for (Eigen::Index k = 0; k < frequency.size(); ++k) {
    sum += frequency[k] >= lower && frequency[k] < upper ? spacing * density[k] : 0.0;
  }
  return sum;
}

Spectrum spectrum(const Eigen::VectorXd& t, const Eigen::VectorXd& values, const SpectrumOptions& options) {
  check::that(t.size() == values.size(), "spectrum", "one value for each time");
  Spectrum out;
  if (t.size() < 16 || !(t[t.size() - 1] > t[0])) {
    return out;
  }
  const double step = median_step(t);
  if (!(step > 0.0)) {
    return out;
  }
  const double width = step * std::max(1.0, std::floor(0.25 / options.highest / step));
  const Cells cells = cells_of(t, values, width);
  const double duration = static_cast<double>(cells.value.size()) * width;
  const double window_seconds = duration >= 2.0 * options.window ? options.window : 0.5 * duration;
  const Eigen::Index length = smooth_length(static_cast<Eigen::Index>(window_seconds / width));
  if (length < 8) {
    return out;
  }
  const double exact = static_cast<double>(length) * width;
  const auto bins = std::min<Eigen::Index>(length / 2 - 1, static_cast<Eigen::Index>(options.highest * exact));
  out.frequency = Eigen::VectorXd::LinSpaced(bins, 1.0, static_cast<double>(bins)) / exact;
  const Eigen::ArrayXd taper = (Eigen::ArrayXd::LinSpaced(length, 0.5, static_cast<double>(length) - 0.5) *
                                (std::numbers::pi / static_cast<double>(length)))
                                   .sin()
                                   .square();
  std::vector<Eigen::Index> starts;
  for (Eigen::Index first = 0; first + length <= cells.value.size(); first += length / 2) {
    if (cells.filled.segment(first, length).mean() >= 0.5) {
      starts.push_back(first);
    }
  }
  out.windows = starts.size();
  if (starts.empty()) {
    return {};
  }
  out.density = Eigen::VectorXd::Zero(bins);
  Eigen::FFT<double> transform;
  Eigen::VectorXd window(length);
  Eigen::VectorXcd transformed;
  for (const Eigen::Index first : starts) {
    window = taper * cells.value.segment(first, length).array();
    transform.fwd(transformed, window);
    const double norm = (taper * cells.filled.segment(first, length).array()).square().sum();
    out.density += (2.0 * width / norm) * transformed.segment(1, bins).cwiseAbs2();
  }
  out.density /= static_cast<double>(out.windows);
  return out;
}

double filtered_noise_density(double beta, double sd, double frequency) {
  const double omega = 2.0 * std::numbers::pi * frequency, b2 = beta * beta;
  return sd * sd * (8.0 / beta) * (b2 * b2) / ((b2 + omega * omega) * (b2 + omega * omega));
}

}  // namespace wheelwright
