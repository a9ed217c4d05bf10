// SPDX-License-Identifier: Apache-2.0
#include "gap/next/discrimination.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include "bounds/kernels.hpp"
#include "commission/design/subject.hpp"
#include "commission/noise_budget.hpp"
#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "gap/rows/block_gram.hpp"
#include "gap/rows/drive.hpp"
#include "model/filter/noise.hpp"

namespace wheelwright::gap {
namespace {

constexpr int kGoldenSteps = 14;

const Effect& find(const std::vector<Effect>& catalogue, const std::string& name) {
  const Effect* const found = find_effect(catalogue, name);
  check::that(found != nullptr, "rival '" + name + "'", "an effect of the catalogue");
  return *found;
}

// The effort of joints that a cause asks for, per output.
void add_effort(const Column& column, double factor, double step, Eigen::MatrixXd& total) {
  for (std::size_t i = 0; i < column.effort.size(); ++i) {
    if (column.effort[i].size() > 0) {
      total.col(static_cast<Eigen::Index>(i)) += factor * column.effort[i];
    }
  }
  for (std::size_t i = 0; i < column.effort_rate.size(); ++i) {
    const Eigen::VectorXd& u = column.effort_rate[i];
    for (Eigen::Index k = 1; k + 1 < u.size(); ++k) {
      total(k, static_cast<Eigen::Index>(i)) += factor * (u[k + 1] - u[k - 1]) / (2.0 * step);
    }
  }
}

// The drive as it is when `rival` is true: efforts that look at efforts settle in a second pass.
Drive driven_with(Drive drive, const Rival& rival, const std::vector<Effect>& catalogue) {
  const Eigen::MatrixXd inverse = core::inverse(drive.model.input);
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(drive.rows(), static_cast<Eigen::Index>(drive.model.n()));
    for (const RivalCause& cause : rival.causes) {
      const Effect& effect = find(catalogue, cause.effect);
      const std::vector<Column> columns = effect.columns(drive, cause.shape);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        add_effort(columns[c], effect.unit_coefficient ? 1.0 : cause.coefficients[c], drive.step, total);
      }
    }
    for (std::size_t j = 0; j < drive.joints.size(); ++j) {
      JointSignals& joint = drive.joints[j];
      joint.effort = joint.predicted_effort + total * inverse.row(static_cast<Eigen::Index>(j)).transpose();
      joint.smooth_effort = joint.effort;
    }
  }
  return drive;
}

// The whitened rows of one drive: outputs one after the other, then increments of the pose.
class Rows {
 public:
  Rows(const Drive& drive, const PlannedNoise& noise, DriveKind kind) : drive_(&drive), noise_(&noise) {
    used_ = moving(drive, noise.beta);
    if (kind == DriveKind::logged) {
      used_ = used_ && settled(drive, noise.beta);
    }
    windows_ = make_windows(drive, noise.window);
    gap_ = pose_gap(drive, windows_);
    const std::vector<std::vector<Eigen::VectorXd>> regressor = filtered_regressor(drive, noise.beta);
    Eigen::MatrixXd base = Eigen::MatrixXd::Zero(size(), static_cast<Eigen::Index>(regressor.size()));
    for (std::size_t j = 0; j < regressor.size(); ++j) {
      for (std::size_t i = 0; i < regressor[j].size(); ++i) {
        if (regressor[j][i].size() > 0) {
          base.col(static_cast<Eigen::Index>(j)).segment(start(i), drive.rows()) = whitened(i, regressor[j][i]);
        }
      }
    }
    const core::PivotedQr qr(base);
    base_ = qr.Q(qr.rank());
  }

  // What `column` adds, with what θ can make up for taken away.
  [[nodiscard]] Eigen::VectorXd of(const Column& column) const { return without_base(raw(column)); }

  [[nodiscard]] Eigen::VectorXd raw(const Column& column) const {
    Eigen::VectorXd rows = Eigen::VectorXd::Zero(size());
    for (std::size_t i = 0; i < outputs(); ++i) {
      if (i < column.effort.size() && column.effort[i].size() > 0) {
        rows.segment(start(i), drive_->rows()) += whitened(i, filtered(*drive_, noise_->beta, column.effort[i]));
      }
      if (i < column.effort_rate.size() && column.effort_rate[i].size() > 0) {
        rows.segment(start(i), drive_->rows()) +=
            whitened(i, filtered_rate(*drive_, noise_->beta, column.effort_rate[i]));
      }
    }
    const Increments increments = increments_of(*drive_, windows_, column);
    put(rows, 0, gap_.forward, increments.forward, noise_->pose.forward);
    put(rows, 1, gap_.lateral, increments.lateral, noise_->pose.lateral);
    put(rows, 2, gap_.yaw, increments.yaw, noise_->pose.yaw);
    return rows;
  }

  [[nodiscard]] Eigen::VectorXd without_base(const Eigen::VectorXd& rows) const {
    return rows - base_ * (base_.transpose() * rows);
  }

  // dᵀRd.
  [[nodiscard]] double correlated(const Eigen::VectorXd& d) const {
    double sum = d.squaredNorm();
    const double step = noise_->beta * drive_->step, decay = std::exp(-step);
    for (std::size_t i = 0; i < outputs(); ++i) {
      const auto of_output = d.segment(start(i), drive_->rows());
      for (std::size_t s = 0; s < drive_->segment_starts.size(); ++s) {
        const auto [first, last] = drive_->segment(s);
        double a = 0.0, b = 0.0;  // Σ e^{−β(t_k − t_j)} d_j and the same with (k − j)
        for (Eigen::Index k = first + 1; k < last; ++k) {
          b = decay * (b + a + of_output[k - 1]);
          a = decay * (a + of_output[k - 1]);
          sum += 2.0 * of_output[k] * (a + step * b);
        }
      }
    }
    return sum;
  }

  [[nodiscard]] double count() const {
    double pose = 0.0;
    for (const auto& [gap, floor] :
         {std::pair(&gap_.forward, noise_->pose.forward), std::pair(&gap_.lateral, noise_->pose.lateral),
          std::pair(&gap_.yaw, noise_->pose.yaw)}) {
      pose += floor > 0.0 ? static_cast<double>(gap->size()) : 0.0;
    }
    return static_cast<double>(used_.count()) * static_cast<double>(outputs()) + pose;
  }

 private:
  [[nodiscard]] std::size_t outputs() const { return drive_->model.n(); }
  [[nodiscard]] Eigen::Index start(std::size_t i) const { return static_cast<Eigen::Index>(i) * drive_->rows(); }
  [[nodiscard]] Eigen::Index windows() const { return static_cast<Eigen::Index>(windows_.size()); }
  [[nodiscard]] Eigen::Index size() const { return start(outputs()) + 3 * windows(); }

  [[nodiscard]] Eigen::VectorXd whitened(std::size_t i, const Eigen::VectorXd& signal) const {
    return (used_.select(signal.array(), 0.0) / noise_->output[i]).matrix();
  }
  void put(Eigen::VectorXd& rows, Eigen::Index channel, const Eigen::VectorXd& seen, const Eigen::VectorXd& signal,
           double floor) const {
    if (seen.size() > 0 && signal.size() > 0 && floor > 0.0) {
      rows.segment(start(outputs()) + channel * windows(), windows()) = signal / floor;
    }
  }

  const Drive* drive_;
  const PlannedNoise* noise_;
  Mask used_;
  Windows windows_;
  Increments gap_;        // which channels a log of this kind can tell
  Eigen::MatrixXd base_;  // orthonormal
};

// The columns of a rival at some shapes, and what they leave of a response.
class Imitator {
 public:
  Imitator(const Drive& drive, const Rows& rows, const Rival& rival, const std::vector<Effect>& catalogue,
           const Eigen::VectorXd& response)
      : drive_(&drive), rows_(&rows), response_(&response) {
    for (const RivalCause& cause : rival.causes) {
      effects_.push_back(&find(catalogue, cause.effect));
      shapes_.push_back(cause.shape);
      columns_.push_back(columns(*effects_.back(), cause.shape));
    }
    search();
  }

  [[nodiscard]] const Eigen::VectorXd& left() const { return left_; }
  [[nodiscard]] std::vector<double> shape() const {
    std::vector<double> all;
    for (const std::vector<double>& each : shapes_) {
      all.insert(all.end(), each.begin(), each.end());
    }
    return all;
  }

 private:
  using Columns = std::vector<Eigen::VectorXd>;

  [[nodiscard]] Columns columns(const Effect& effect, const std::vector<double>& shape) const {
    Columns result;
    for (const Column& column : effect.columns(*drive_, shape)) {
      result.push_back(rows_->of(column));
    }
    return result;
  }

  [[nodiscard]] Eigen::VectorXd residual(const std::vector<Columns>& all) const {
    Eigen::VectorXd response = *response_;
    std::vector<Eigen::VectorXd> used;
    std::vector<double> size;
    std::vector<int> sign;
    for (std::size_t k = 0; k < all.size(); ++k) {
      for (std::size_t c = 0; c < all[k].size(); ++c) {
        if (effects_[k]->unit_coefficient) {
          response -= all[k][c];
        } else if (const double norm = all[k][c].norm(); norm > 0.0) {
          used.push_back(all[k][c]);
          size.push_back(norm);
          sign.push_back(effects_[k]->parameters[c].sign);
        }
      }
    }
    const auto n = static_cast<Eigen::Index>(used.size());
    Eigen::MatrixXd X(response.size(), n);
    for (Eigen::Index j = 0; j < n; ++j) {
      X.col(j) = used[static_cast<std::size_t>(j)] / size[static_cast<std::size_t>(j)];
    }
    return n == 0 ? response : response - X * signed_least_squares(X.transpose() * X, X.transpose() * response, sign).x;
  }

  // Takes `shape` for cause k where that leaves less.
  bool try_shape(std::size_t k, const std::vector<double>& shape) {
    std::vector<Columns> all = columns_;
    all[k] = columns(*effects_[k], shape);
    Eigen::VectorXd left = residual(all);
    if (!(left.squaredNorm() < left_.squaredNorm())) {
      return false;
    }
    left_ = std::move(left);
    shapes_[k] = shape;
    columns_ = std::move(all);
    return true;
  }

  [[nodiscard]] double value_at(std::size_t k, std::size_t s, double value) const {
    std::vector<double> shape = shapes_[k];
    shape[s] = value;
    std::vector<Columns> all = columns_;
    all[k] = columns(*effects_[k], shape);
    return residual(all).squaredNorm();
  }

  // Between the grid's neighbours of the shape.
  void refine(std::size_t k, std::size_t s, const std::vector<std::vector<double>>& grid) {
    double low = -INFINITY, high = INFINITY;
    const double at = shapes_[k][s];
    for (const std::vector<double>& point : grid) {
      low = point[s] < at ? std::max(low, point[s]) : low;
      high = point[s] > at ? std::min(high, point[s]) : high;
    }
    low = std::isfinite(low) ? low : at;
    high = std::isfinite(high) ? high : at;
    constexpr double kPart = 0.3819660112501051;  // 2 − golden ratio
    double a = low + kPart * (high - low), b = high - kPart * (high - low);
    double of_a = value_at(k, s, a), of_b = value_at(k, s, b);
    for (int i = 0; i < kGoldenSteps && high > low; ++i) {
      if (of_a < of_b) {
        high = std::exchange(b, a);
        of_b = of_a;
        a = low + kPart * (high - low);
        of_a = value_at(k, s, a);
      } else {
        low = std::exchange(a, b);
        of_a = of_b;
        b = high - kPart * (high - low);
        of_b = value_at(k, s, b);
      }
    }
    std::vector<double> shape = shapes_[k];
    shape[s] = of_a < of_b ? a : b;
    try_shape(k, shape);
  }

  void search() {
    left_ = residual(columns_);
    const auto shaped = std::ranges::count_if(effects_, [](const Effect* effect) { return !effect->shapes.empty(); });
    for (int pass = 0; pass < (shaped > 1 ? 2 : 1); ++pass) {
      for (std::size_t k = 0; k < effects_.size(); ++k) {
        if (effects_[k]->shapes.empty()) {
          continue;
        }
        const std::vector<std::vector<double>> grid = shape_grid(*effects_[k], *drive_);
        for (const std::vector<double>& point : grid) {
          try_shape(k, point);
        }
        for (std::size_t s = 0; s < effects_[k]->shapes.size(); ++s) {
          if (!effects_[k]->shapes[s].discrete) {
            refine(k, s, grid);
          }
        }
      }
    }
  }

  const Drive* drive_;
  const Rows* rows_;
  const Eigen::VectorXd* response_;
  std::vector<const Effect*> effects_;
  std::vector<std::vector<double>> shapes_;
  std::vector<Columns> columns_;
  Eigen::VectorXd left_;
};

// The size at which a column asks for `share` of what there is.
double size_for(const Column& column, const Drive& drive, double share) {
  Eigen::MatrixXd effort = Eigen::MatrixXd::Zero(drive.rows(), static_cast<Eigen::Index>(drive.model.n()));
  add_effort(column, 1.0, drive.step, effort);
  Eigen::MatrixXd base = Eigen::MatrixXd::Zero(drive.rows(), static_cast<Eigen::Index>(drive.joints.size()));
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    base.col(static_cast<Eigen::Index>(j)) = drive.joints[j].predicted_effort;
  }
  if (const double asked = effort.norm(); asked > 0.0) {
    return share * (base * drive.model.input.transpose()).norm() / asked;
  }
  const double moved = std::hypot(core::rms(column.forward), core::rms(column.lateral)), turned = core::rms(column.yaw);
  if (moved > 0.0) {
    return share * core::rms(drive.coordinates[0].speed) / moved;
  }
  return turned > 0.0 ? share * core::rms(drive.coordinates.back().speed) / turned : 1.0;
}

}  // namespace

std::string Rival::name() const {
  std::vector<std::string> effects;
  std::ranges::transform(causes, std::back_inserter(effects), &RivalCause::effect);
  return fmt::format("{}", fmt::join(effects, " + "));
}

void validate(const Rival& rival, const std::vector<Effect>& catalogue, const Drive& drive) {
  check::that(!rival.causes.empty(), "rival", "at least one cause");
  for (const RivalCause& cause : rival.causes) {
    const Effect& effect = find(catalogue, cause.effect);
    const std::string what = "rival '" + cause.effect + "'";
    const Applicability there = applicability(effect, drive);
    check::that(there.applies, what, "an effect that can show (" + there.reason + ")");
    check::that(std::ranges::count(rival.causes, cause.effect, &RivalCause::effect) == 1, what, "to be named once");
    check::that(cause.coefficients.size() == effect.parameters.size(), what,
                std::to_string(effect.parameters.size()) + " coefficients");
    check::that(cause.shape.size() == effect.shapes.size(), what, std::to_string(effect.shapes.size()) + " shapes");
    for (const auto* values : {&cause.coefficients, &cause.shape}) {
      for (const double value : *values) {
        check::finite(value, what);
      }
    }
  }
}

Rival typical_rival(const std::vector<std::string>& effects, const std::vector<Effect>& catalogue, const Drive& drive,
                    double share) {
  Rival rival;
  for (const std::string& name : effects) {
    const Effect& effect = find(catalogue, name);
    const Applicability there = applicability(effect, drive);
    check::that(there.applies, "rival '" + name + "'", "an effect that can show (" + there.reason + ")");
    const std::vector<std::vector<double>> grid = shape_grid(effect, drive);
    RivalCause cause{name, {}, grid[grid.size() / 2]};
    if (!effect.unit_coefficient) {
      const std::vector<Column> columns = effect.columns(drive, cause.shape);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        cause.coefficients.push_back((effect.parameters[c].sign < 0 ? -1.0 : 1.0) * size_for(columns[c], drive, share));
      }
    }
    rival.causes.push_back(std::move(cause));
  }
  return rival;
}

PlannedNoise expected_noise(const design::DesignSubject& subject) {
  constexpr double kUniform = 1.0 / 3.0;  // variance of a uniform error over the square of its bound
  constexpr double kExtreme = 4.0;        // standard deviations that the largest of many rows is from zero
  PlannedNoise noise;
  noise.beta = subject.filter.beta;
  if (subject.errors) {
    const filter::SignalErrors& errors = *subject.errors;
    noise.output.resize(subject.model.n());
    for (std::size_t i = 0; i < noise.output.size(); ++i) {
      noise.output[i] = errors.output[static_cast<Eigen::Index>(i)] / kExtreme;
    }
  } else {
    const commission::NoiseBudget budget = commission::noise_budget(subject.robot, subject.measurement);
    check::that(budget.complete, "noise", "declared bounds of motion and effort");
    const filter::NoiseGram gram =
        filter::noise_gram(subject.model, {2, noise.beta, noise.beta}, subject.measurement, subject.step);
    const double motion = budget.sensors.motion, effort = budget.sensors.effort;
    for (std::size_t i = 0; i < subject.model.n(); ++i) {
      const double of_motion = subject.theta.dot(gram.motion[i] * subject.theta) * motion * motion;
      const double of_effort = gram.effort[static_cast<Eigen::Index>(i)] * effort * effort;
      noise.output.push_back(std::sqrt(kUniform * (of_motion + of_effort)));
    }
  }
  const auto increment = [](const model::NoiseBound& bound) {
    return std::sqrt(2.0 * kUniform) * bound.value.value_or(0.0);
  };
  noise.pose.forward = noise.pose.lateral = increment(subject.robot.noise.position);
  noise.pose.yaw = increment(subject.robot.noise.heading);
  return noise;
}

double RivalSeparation::deviations() const {
  const double cosine = std::sqrt(std::max(0.0, 1.0 - share));
  return std::sqrt(delta / (2.0 * (1.0 + cosine)));
}

double RivalSeparation::probability() const { return 0.5 * std::erfc(-deviations() / std::numbers::sqrt2); }

double RivalSeparation::ratio() const { return rows > 0.0 ? std::sqrt(1.0 + excess / rows) : 1.0; }

std::vector<RivalSeparation> discrimination(const Drive& drive, const std::vector<Rival>& rivals,
                                            const std::vector<Effect>& catalogue, const PlannedNoise& noise,
                                            DriveKind kind) {
  check::that(rivals.size() >= 2, "rivals", "at least two");
  check::positive(noise.beta, "noise.beta");
  check::that(noise.output.size() == drive.model.n(), "noise.output", "one for each output of the model");
  for (const double floor : noise.output) {
    check::positive(floor, "noise.output");
  }
  std::vector<RivalSeparation> separations;
  for (const Rival& rival : rivals) {
    validate(rival, catalogue, drive);
  }
  for (std::size_t a = 0; a < rivals.size(); ++a) {
    const Drive truth = kind == DriveKind::planned ? driven_with(drive, rivals[a], catalogue) : drive;
    const Rows rows(truth, noise, kind);
    Eigen::VectorXd raw;
    for (const RivalCause& cause : rivals[a].causes) {
      const Effect& effect = find(catalogue, cause.effect);
      const std::vector<Column> columns = effect.columns(truth, cause.shape);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const Eigen::VectorXd one = (effect.unit_coefficient ? 1.0 : cause.coefficients[c]) * rows.raw(columns[c]);
        raw = raw.size() == 0 ? one : Eigen::VectorXd(raw + one);
      }
    }
    const Eigen::VectorXd response = rows.without_base(raw);
    for (std::size_t b = 0; b < rivals.size(); ++b) {
      if (b == a) {
        continue;
      }
      const Imitator imitator(truth, rows, rivals[b], catalogue, response);
      RivalSeparation separation{.truth = a, .other = b, .rows = rows.count()};
      separation.excess = imitator.left().squaredNorm();
      // Rounding is no difference: of the part that θ does not take, and of the whole.
      const bool none = separation.excess <= 1e-20 * raw.squaredNorm();
      separation.excess = none ? 0.0 : separation.excess;
      separation.share = none ? 0.0 : separation.excess / response.squaredNorm();
      separation.delta = none ? 0.0 : separation.excess * separation.excess / rows.correlated(imitator.left());
      separation.kept = raw.squaredNorm() > 0.0 ? response.squaredNorm() / raw.squaredNorm() : 0.0;
      separation.shape = imitator.shape();
      separations.push_back(std::move(separation));
    }
  }
  return separations;
}

}  // namespace wheelwright::gap
