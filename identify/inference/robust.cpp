// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/robust.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "identify/moments.hpp"

namespace wheelwright::inference {
namespace {

constexpr double kMadOfGaussian = 0.674489750196081743;  // median |Z| of a standard normal Z
constexpr double kScaleFloor = 1e-12;                    // of the rms of y
constexpr double kStepTolerance = 1e-6;                  // standard errors
constexpr int kScaleRounds = 100;
constexpr double kStartTuning = 0.05;  // Huber's loss with it is nearly |u|

/// Y and y of at most `most` instants, every stride-th of the source.
struct HeldRows {
  RegressionBlock block;  // without dY, dy
  std::size_t seen = 0;

  HeldRows(core::RegressionSource& rows, std::size_t most) {
    const std::size_t n = rows.outputs(), p = rows.parameters();
    std::vector<double> Y, y;
    std::size_t stride = 1, held = 0;
    RegressionBlock next;
    rows.rewind();
    while (rows.next(next)) {
      for (std::size_t k = 0; k < next.instants(); ++k, ++seen) {
        if (seen % stride != 0) {
          continue;
        }
        if (held == most) {
          for (std::size_t j = 0; 2 * j < held; ++j) {
            std::copy_n(Y.begin() + static_cast<std::ptrdiff_t>(2 * j * n * p), n * p,
                        Y.begin() + static_cast<std::ptrdiff_t>(j * n * p));
            std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(2 * j * n), n,
                        y.begin() + static_cast<std::ptrdiff_t>(j * n));
          }
          held = (held + 1) / 2;
          Y.resize(held * n * p);
          y.resize(held * n);
          stride *= 2;
          if (seen % stride != 0) {
            continue;
          }
        }
        const double* from = next.Y.data() + k * n * p;
        Y.insert(Y.end(), from, from + n * p);
        y.insert(y.end(), next.y.data() + k * n, next.y.data() + (k + 1) * n);
        ++held;
      }
    }
    block.outputs = n;
    block.parameters = p;
    block.t.resize(held);
    block.Y =
        Eigen::Map<const core::RowMatrix>(Y.data(), static_cast<Eigen::Index>(held * n), static_cast<Eigen::Index>(p));
    block.y = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(held * n));
  }
  [[nodiscard]] bool all() const { return block.instants() == seen; }
};

/// Folds the rows of `block`, weighted for the residuals at `theta`, into `sums`.
void add_reweighted(const RegressionBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& scales,
                    const LossFunction& loss, identify::LeastSquares& sums) {
  RegressionBlock weighted;
  weighted.outputs = block.outputs;
  weighted.parameters = block.parameters;
  weighted.t = block.t;
  weighted.Y = block.Y;
  weighted.y = block.y;
  for (Eigen::Index row = 0; row < block.rows(); ++row) {
    const double s = scales[row % scales.size()];
    const double u = (block.y[row] - block.Y.row(row).dot(theta)) / s;
    const double factor = std::sqrt(loss.weight(u)) / s;
    weighted.Y.row(row) *= factor;
    weighted.y[row] *= factor;
  }
  sums.add(weighted);
}

/// Median of |y − Yθ| over that of a standard normal, for each output, not below the floor.
Eigen::VectorXd median_scales(const RegressionBlock& rows, const Eigen::VectorXd& theta, std::vector<bool>& at_floor) {
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  Eigen::VectorXd scales(n);
  std::vector<double> sizes(rows.instants());
  for (Eigen::Index i = 0; i < n; ++i) {
    double squares = 0.0;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const Eigen::Index row = static_cast<Eigen::Index>(k) * n + i;
      sizes[k] = std::abs(rows.y[row] - rows.Y.row(row).dot(theta));
      squares += rows.y[row] * rows.y[row];
    }
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    const double upper = *middle;
    const double median = sizes.size() % 2 == 1 ? upper : 0.5 * (upper + *std::max_element(sizes.begin(), middle));
    const double rms = std::sqrt(squares / static_cast<double>(sizes.size()));
    const double floor = rms > 0.0 ? kScaleFloor * rms : 1.0;
    scales[i] = std::max(median / kMadOfGaussian, floor);
    at_floor[static_cast<std::size_t>(i)] = scales[i] <= floor;
  }
  return scales;
}

/// What one walk over all rows gathers at the final estimate.
class Gathering {
 public:
  Gathering(const LossFunction& loss, Eigen::VectorXd theta, Eigen::VectorXd scales, std::size_t most_episodes)
      : loss_(loss),
        theta_(std::move(theta)),
        scales_(std::move(scales)),
        half_(loss.half_weight()),
        most_(most_episodes),
        bread_(Eigen::MatrixXd::Zero(theta_.size(), theta_.size())),
        scores_(static_cast<std::size_t>(theta_.size())),
        open_(static_cast<std::size_t>(scales_.size())),
        light_(open_.size()),
        rejected_(open_.size()) {}

  void add(const RegressionBlock& block) {
    Eigen::VectorXd score(theta_.size());
    for (std::size_t k = 0; k < block.instants(); ++k) {
      score.setZero();
      for (std::size_t i = 0; i < block.outputs; ++i) {
        const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
        const double s = scales_[static_cast<Eigen::Index>(i)];
        const double u = (block.y[row] - block.Y.row(row).dot(theta_)) / s;
        score += loss_.psi(u) / s * block.Y.row(row).transpose();
        bread_ += loss_.psi_slope(u) / (s * s) * block.Y.row(row).transpose() * block.Y.row(row);
        objective_ += loss_.rho(u);
        note(block, k, i, u);
      }
      scores_.add(score);
      ++instants_;
    }
  }

  void finish(RobustFit& fit, const std::vector<LinearConstraint>& constraints) {
    for (auto& episode : open_) {
      close(episode);
    }
    fit.objective = objective_;
    fit.instants = instants_;
    fit.episodes = episodes_;
    const auto count = static_cast<double>(instants_);
    for (std::size_t i = 0; i < open_.size(); ++i) {
      OutputWeights weights;
      weights.scale = scales_[static_cast<Eigen::Index>(i)];
      weights.down_weighted = static_cast<double>(light_[i]) / count;
      weights.gaussian_share = std::isfinite(half_) ? std::erfc(half_ / std::numbers::sqrt2) : 0.0;
      weights.rejected = static_cast<double>(rejected_[i]) / count;
      fit.outputs.push_back(weights);
    }
    const identify::LongRunCovariance scores = identify::long_run_covariance(scores_);
    const Eigen::MatrixXd inverse = inverse_bread(fit.active, constraints);
    fit.covariance = inverse * scores.matrix * inverse;
    fit.standard_error = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    fit.freedom = scores.freedom;
  }

 private:
  void note(const RegressionBlock& block, std::size_t k, std::size_t i, double u) {
    std::optional<Episode>& episode = open_[i];
    if (!(std::abs(u) > half_)) {
      close(episode);
      return;
    }
    ++light_[i];
    rejected_[i] += loss_.weight(u) == 0.0 ? 1 : 0;
    if (!episode) {
      episode.emplace(Episode{.output = i, .first_time = block.t[k]});
    }
    episode->last_time = block.t[k];
    ++episode->instants;
    if (std::abs(u) > std::abs(episode->worst)) {
      episode->worst = u;
      episode->worst_sample = block.sample[k];
      episode->worst_time = block.t[k];
    }
  }

  void close(std::optional<Episode>& episode) {
    if (!episode) {
      return;
    }
    const auto worse = [](const Episode& a, const Episode& b) { return std::abs(a.worst) > std::abs(b.worst); };
    episodes_.insert(std::upper_bound(episodes_.begin(), episodes_.end(), *episode, worse), *episode);
    if (episodes_.size() > most_) {
      episodes_.pop_back();
    }
    episode.reset();
  }

  /// Inverse of Σ ψ'YᵀY/s² on the face of the constraints that hold the estimate, 0 across it and along what the rows
  /// do not determine.
  [[nodiscard]] Eigen::MatrixXd inverse_bread(const std::vector<ActiveConstraint>& active,
                                              const std::vector<LinearConstraint>& constraints) const {
    const Eigen::Index p = theta_.size();
    const Eigen::VectorXd scale =
        bread_.diagonal().unaryExpr([](double h) { return h > 0.0 ? 1.0 / std::sqrt(h) : 0.0; });
    Eigen::MatrixXd holding(p, 0);
    for (const ActiveConstraint& constraint : active) {
      if (constraint.multiplier > 0.0) {
        holding.conservativeResize(Eigen::NoChange, holding.cols() + 1);
        holding.rightCols(1) = scale.cwiseProduct(constraints[constraint.index].a);
      }
    }
    Eigen::MatrixXd face = Eigen::MatrixXd::Identity(p, p);
    if (holding.cols() > 0) {
      const core::PivotedQr qr(holding);
      face = qr.Q().rightCols(p - qr.rank());
    }
    if (face.cols() == 0) {
      return Eigen::MatrixXd::Zero(p, p);
    }
    const Eigen::MatrixXd moving = scale.asDiagonal() * face;
    const core::EigenPairs eigen = core::symmetric_eigen(moving.transpose() * bread_ * moving);
    const Eigen::VectorXd inverse =
        eigen.values.unaryExpr([](double value) { return value > 1e-12 ? 1.0 / value : 0.0; });
    return moving * eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose() * moving.transpose();
  }

  LossFunction loss_;
  Eigen::VectorXd theta_, scales_;
  double half_;
  std::size_t most_;
  Eigen::MatrixXd bread_;
  identify::BlockSums scores_;
  double objective_ = 0.0;
  std::size_t instants_ = 0;
  std::vector<std::optional<Episode>> open_;
  std::vector<Episode> episodes_;
  std::vector<std::size_t> light_, rejected_;
};

/// The steps of a fit, on what they share.
class Fitting {
 public:
  Fitting(core::RegressionSource& rows, const RobustOptions& options)
      : rows_(rows),
        options_(options),
        held_(rows, options.most_instants),
        loss_{options.loss, options.tuning > 0.0 ? options.tuning : tuning_constant(options.loss)} {
    check::that(held_.seen > 0, "robust fit", "a source with at least one instant");
    boxed_ = find_box(options.constraints, static_cast<Eigen::Index>(rows.parameters()), box_);
  }

  RobustFit run() {
    fit_.held = held_.block.instants();
    if (!start()) {
      fit_.status = RobustStatus::infeasible;
      return fit_;
    }
    solve_held({Loss::huber, tuning_constant(Loss::huber)});
    if (loss_.loss != Loss::huber || loss_.c != tuning_constant(Loss::huber)) {
      solve_held(loss_);
    }
    finish();
    Gathering gathering(loss_, theta_, scales_, options_.most_episodes);
    core::for_each_block(rows_, [&](const RegressionBlock& block) { gathering.add(block); });
    fit_.estimate = theta_;
    gathering.finish(fit_, options_.constraints);
    return fit_;
  }

 private:
  /// Sets the estimate to the least-squares fit of `sums`; false where the constraints contradict each other.
  bool settle(const identify::LeastSquares& sums) {
    if (options_.constraints.empty()) {
      const identify::LeastSquaresFit fit = sums.solve();
      theta_ = fit.estimate;
      fit_.rank = fit.rank;
      return true;
    }
    const ConstrainedFit fit = constrained_least_squares(sums, options_.constraints);
    fit_.active = fit.active;
    if (fit.status == ConstrainedStatus::infeasible) {
      return false;
    }
    fit_.rank = sums.solve().rank;
    theta_ = fit.estimate;
    return true;
  }

  bool start() {
    identify::LeastSquares sums(rows_.parameters());
    sums.add(held_.block);
    if (!settle(sums)) {
      return false;
    }
    std::vector<bool> at_floor(rows_.outputs());
    scales_ = median_scales(held_.block, theta_, at_floor);
    for (int round = 0; round < kScaleRounds; ++round) {
      identify::LeastSquares weighted(rows_.parameters());
      add_reweighted(held_.block, theta_, scales_, {Loss::huber, kStartTuning}, weighted);
      settle(weighted);
      const Eigen::VectorXd before = scales_;
      scales_ = median_scales(held_.block, theta_, at_floor);
      if (((scales_ - before).array().abs() <= 1e-4 * before.array()).all()) {
        break;
      }
    }
    fit_.exact_fit = std::find(at_floor.begin(), at_floor.end(), true) != at_floor.end();
    return true;
  }

  void solve_held(const LossFunction& loss) {
    if (!options_.constraints.empty() && !boxed_) {
      return;
    }
    const MEstimate result =
        boxed_ ? m_estimate(held_.block, scales_, loss, theta_, box_) : m_estimate(held_.block, scales_, loss, theta_);
    theta_ = result.theta;
    fit_.solver_converged = fit_.solver_converged && result.converged;
  }

  void finish() {
    fit_.status = RobustStatus::not_converged;
    while (fit_.passes < options_.most_passes && fit_.status == RobustStatus::not_converged) {
      identify::LeastSquares sums(rows_.parameters());
      if (held_.all()) {
        add_reweighted(held_.block, theta_, scales_, loss_, sums);
      } else {
        core::for_each_block(
            rows_, [&](const RegressionBlock& block) { add_reweighted(block, theta_, scales_, loss_, sums); });
      }
      ++fit_.passes;
      const Eigen::VectorXd before = theta_;
      settle(sums);
      const Eigen::Index p = theta_.size();
      fit_.last_step = (sums.factor().topLeftCorner(p, p) * (theta_ - before)).norm();
      fit_.status = fit_.last_step <= kStepTolerance ? RobustStatus::converged : RobustStatus::not_converged;
    }
  }

  core::RegressionSource& rows_;
  const RobustOptions& options_;
  HeldRows held_;
  LossFunction loss_;
  BoxCoordinates box_;
  bool boxed_ = false;
  Eigen::VectorXd theta_, scales_;
  RobustFit fit_;
};

}  // namespace

RobustFit robust_fit(core::RegressionSource& rows, const RobustOptions& options) {
  check::non_negative(options.tuning, "tuning constant");
  check::that(options.most_instants >= 8, "most_instants", "at least 8");
  check::that(options.most_passes >= 1, "most_passes", "at least 1");
  for (const LinearConstraint& constraint : options.constraints) {
    check::that(static_cast<std::size_t>(constraint.a.size()) == rows.parameters(),
                "constraint '" + constraint.name + "'", "a coefficient for each parameter");
    check::that(constraint.a.allFinite() && std::isfinite(constraint.b) && !constraint.a.isZero(0.0),
                "constraint '" + constraint.name + "'", "finite numbers, and a coefficient other than 0");
  }
  return Fitting(rows, options).run();
}

}  // namespace wheelwright::inference
