// SPDX-License-Identifier: Apache-2.0
#include "commission/validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "commission/keep_instants.hpp"
#include "core/check.hpp"
#include "core/interval.hpp"
#include "core/statistics.hpp"
#include "detector/detector_options.hpp"
#include "detector/threshold.hpp"

namespace wheelwright::commission {

FoldedSource::FoldedSource(core::RegressionSource& rows, Part part, std::size_t log_rows, FoldOptions options)
    : source_(&rows), part_(part), log_rows_(std::max<std::size_t>(log_rows, 1)), options_(options) {
  check::that(options.blocks >= 2 && options.hold_out_every >= 2 && options.hold_out_every <= options.blocks, "folds",
              "at least two blocks, of which some but not all are held out");
  check::non_negative(options.purge, "folds purge");
}

void FoldedSource::rewind() {
  source_->rewind();
  current_ = static_cast<std::size_t>(-1);
}

bool FoldedSource::next(RegressionBlock& block) {
  if (!source_->next(block)) {
    return false;
  }
  if (part_ == Part::everything) {
    return true;
  }
  keep_instants(block, [&](std::size_t k) {
    const std::size_t fold = block.sample[k] * options_.blocks / log_rows_;
    if (fold != current_) {
      current_ = fold;
      block_start_ = block.t[k];
    }
    const bool held_out = fold % options_.hold_out_every == options_.hold_out_every - 1;
    const bool purged = fold > 0 && block.t[k] >= block_start_ && block.t[k] < block_start_ + options_.purge;
    return !purged && held_out == (part_ == Part::held_out);
  });
  return true;
}

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
    return core::median(kept_);
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

std::optional<double> smallest_certain_kappa(const std::vector<OutputValidation>& validation) {
  double least = std::numeric_limits<double>::infinity();
  for (const OutputValidation& v : validation) {
    if (v.instants > 0 && v.smallest_kappa > 0.0) {
      least = std::min(least, v.smallest_kappa);
    }
  }
  return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

bool sees_nothing(const std::vector<OutputValidation>& validation) {
  const bool tried = std::ranges::any_of(validation, [](const OutputValidation& v) { return v.instants > 0; });
  const std::optional<double> kappa = smallest_certain_kappa(validation);
  return tried && !(kappa && *kappa <= whole_effort);
}

std::vector<OutputValidation> validate_on(core::RegressionSource& rows, const detector::ThresholdRule& rule) {
  const detector::ThresholdRule box(rule.set(), rule.estimate(), detector::ParameterSetKind::box);
  const std::size_t p = rows.parameters();
  std::vector<OutputValidation> results(rows.outputs());
  std::vector<Running> running(rows.outputs());
  for (OutputValidation& v : results) {
    v.smallest_kappa = std::numeric_limits<double>::infinity();
  }
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const std::size_t i = static_cast<std::size_t>(row) % block.outputs;
      OutputValidation& v = results[i];
      Running& r = running[i];
      const std::span<const double> y(block.Y.row(row).data(), p), dy(block.dY.row(row).data(), p);
      const double residual = block.y[row] - block.Y.row(row).dot(rule.estimate());
      const detector::Threshold t = rule.at(y, dy, block.dy[row], i);
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
  });
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

}  // namespace wheelwright::commission
