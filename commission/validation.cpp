// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/validation.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <wheelwright/core/statistics.hpp>

namespace wheelwright {
namespace {

// Every 2ᵏ-th value of a long series, at most `most` of them: its median in bounded memory.
class Thinned {
 public:
  void add(double value) {
    if (count_++ % stride_ != 0) {
      return;
    }
    kept_.push_back(value);
    if (kept_.size() == kMost) {
      for (std::size_t k = 0; k < kMost / 2; ++k) {
        kept_[k] = kept_[2 * k];
      }
      kept_.resize(kMost / 2);
      stride_ *= 2;
    }
  }
  [[nodiscard]] double median() const {
    if (kept_.empty()) {
      return 0.0;
    }
    return wheelwright::median(kept_);
  }

 private:
  static constexpr std::size_t kMost = 32768;
  std::vector<double> kept_;
  std::size_t stride_ = 1;
  std::size_t count_ = 0;
};

struct Running {
  Thinned width, width_box;
  double residual_square = 0.0;
  double torque_square = 0.0;
  std::size_t inside_noise_free = 0;
};

}  // namespace

std::vector<OutputValidation> validate_on(RegressionSource& rows, const ThresholdRule& rule) {
  const ThresholdRule box(rule.set(), rule.estimate(), ParameterSetKind::box);
  const std::size_t p = rows.parameters();
  std::vector<OutputValidation> results(rows.outputs());
  std::vector<Running> running(rows.outputs());
  for (OutputValidation& v : results) {
    v.smallest_kappa = std::numeric_limits<double>::infinity();
  }
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const std::size_t i = static_cast<std::size_t>(row) % block.outputs;
      OutputValidation& v = results[i];
      Running& r = running[i];
      const std::span<const double> y(block.Y.row(row).data(), p), dy(block.dY.row(row).data(), p);
      const double residual = block.y[row] - block.Y.row(row).dot(rule.estimate());
      const Threshold t = rule.at(y, dy, block.dy[row], i);
      const Interval prediction = rule.prediction(y, i);
      ++v.instants;
      v.outside += residual < t.lower || residual > t.upper ? 1 : 0;
      r.inside_noise_free += prediction.contains(block.y[row]) ? 1 : 0;
      const double half = 0.5 * t.width();
      if (half > 0.0) {
        v.utilisation = std::max(v.utilisation, std::abs(residual - 0.5 * (t.lower + t.upper)) / half);
      }
      r.residual_square += residual * residual;
      r.torque_square += block.y[row] * block.y[row];
      r.width.add(t.width());
      r.width_box.add(box.at(y, dy, block.dy[row], i).width());
      const double least = std::max(prediction.lower, -prediction.upper);
      if (least > 0.0) {
        v.smallest_kappa = std::min(v.smallest_kappa, t.width() / least);
      }
    }
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    OutputValidation& v = results[i];
    const Running& r = running[i];
    if (v.instants == 0) {
      v.smallest_kappa = 0.0;
      continue;
    }
    const auto count = static_cast<double>(v.instants);
    v.coverage = 1.0 - static_cast<double>(v.outside) / count;
    v.coverage_noise_free = static_cast<double>(r.inside_noise_free) / count;
    v.residual_rms = std::sqrt(r.residual_square / count);
    v.torque_rms = std::sqrt(r.torque_square / count);
    v.nrmse = v.torque_rms > 0.0 ? v.residual_rms / v.torque_rms : 0.0;
    v.median_width = r.width.median();
    v.median_width_box = r.width_box.median();
  }
  return results;
}

}  // namespace wheelwright
