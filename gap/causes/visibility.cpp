// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/QR>

#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Rows of all spaces in units of their floors, one after the other.
class Whitened {
 public:
  explicit Whitened(const GapRows& rows) : rows_(rows) {
    for (const RowSpace& space : rows.spaces) {
      starts_.push_back(size_);
      size_ += space.t.size();
      first_ = space.t.size() > 0 ? std::min(first_, space.t[0]) : first_;
    }
  }

  [[nodiscard]] Eigen::Index size() const { return size_; }
  [[nodiscard]] std::size_t spaces() const { return rows_.spaces.size(); }

  [[nodiscard]] Eigen::VectorXd operator()(const std::vector<Eigen::VectorXd>& parts) const {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(size_);
    for (std::size_t s = 0; s < parts.size(); ++s) {
      if (parts[s].size() > 0) {
        all.segment(starts_[s], parts[s].size()) = parts[s] / rows_.spaces[s].floor;
      }
    }
    return all;
  }

  // Mean square of the rows of one space.
  [[nodiscard]] double mean_square(const Eigen::VectorXd& all, std::size_t space) const {
    const Eigen::Index n = rows_.spaces[space].t.size();
    return n == 0 ? 0.0 : all.segment(starts_[space], n).squaredNorm() / static_cast<double>(n);
  }

  // Sums of `values` over stretches of `length` seconds.
  [[nodiscard]] Eigen::VectorXd by_time(const Eigen::VectorXd& values, double length) const {
    std::vector<double> sums;
    for (std::size_t s = 0; s < spaces(); ++s) {
      const Eigen::VectorXd& t = rows_.spaces[s].t;
      for (Eigen::Index k = 0; k < t.size(); ++k) {
        const auto piece = static_cast<std::size_t>(std::floor((t[k] - first_) / length));
        sums.resize(std::max(sums.size(), piece + 1), 0.0);
        sums[piece] += values[starts_[s] + k];
      }
    }
    std::erase(sums, 0.0);
    return Eigen::Map<const Eigen::VectorXd>(sums.data(), std::ssize(sums));
  }

 private:
  const GapRows& rows_;
  std::vector<Eigen::Index> starts_;
  Eigen::Index size_ = 0;
  double first_ = kNever;
};

class Visibility {
 public:
  Visibility(const GapProblem& problem, const Baseline& now, const SelectionOptions& options)
      : problem_(problem), now_(now), options_(options), whitened_(problem.rows) {
    left_ = whitened_(now.left);
    base_ = columns_of(problem.table.base);
    unknown_ = columns_of(problem.table.unknown);
  }

  // The factor of `parts` from which on they would have been seen; infinite where no factor does.
  [[nodiscard]] double factor(const std::vector<Eigen::VectorXd>& parts) const {
    const Eigen::VectorXd column = whitened_(parts);
    const auto rows = static_cast<double>(whitened_.size());
    const Eigen::VectorXd beside = without(column, base_);
    constexpr double kRounding = 1e-10;
    const double refitted = beside.squaredNorm() > kRounding * column.squaredNorm() ? beside.squaredNorm() / rows : 0.0;
    const double nominal = trusts_theta() ? without(column, unknown_).squaredNorm() / rows : refitted;
    return std::min({by_structure(beside, refitted, nominal), by_theta(refitted, nominal), by_channel(beside)});
  }

 private:
  [[nodiscard]] bool trusts_theta() const { return base_.cols() > unknown_.cols(); }

  [[nodiscard]] Eigen::MatrixXd columns_of(const std::vector<std::size_t>& columns) const {
    Eigen::MatrixXd all(whitened_.size(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t j = 0; j < columns.size(); ++j) {
      std::vector<Eigen::VectorXd> parts;
      for (const RowSpace& space : problem_.rows.spaces) {
        parts.push_back(space.columns[columns[j]]);
      }
      all.col(static_cast<Eigen::Index>(j)) = whitened_(parts);
    }
    return all;
  }

  [[nodiscard]] static Eigen::VectorXd without(const Eigen::VectorXd& column, const Eigen::MatrixXd& on) {
    return on.cols() == 0 ? column : Eigen::VectorXd(column - on * on.colPivHouseholderQr().solve(column));
  }

  // As a cause beside θ.
  [[nodiscard]] double by_structure(const Eigen::VectorXd& beside, double refitted, double nominal) const {
    if (!(refitted > 0.0)) {
      return kNever;
    }
    const double needed = std::max(now_.refitted_excess + options_.smallest, options_.least_gap);
    double size = std::sqrt(std::max(needed - now_.refitted_excess, 0.0) / refitted);
    if (trusts_theta()) {
      size = std::max(size, std::sqrt(std::max(needed - now_.nominal_excess, 0.0) / nominal));
    }
    const Eigen::VectorXd noise = left_ - beside * (beside.dot(left_) / beside.squaredNorm());
    constexpr double kStep = 1.1, kMost = 10.0;
    for (double factor = 1.0; factor < kMost; factor *= kStep) {
      const Eigen::ArrayXd added = factor * size * beside.array();
      const Eigen::VectorXd savings =
          whitened_.by_time((added * (added + 2.0 * noise.array())).matrix(), options_.piece);
      if (savings.size() > 0 && saves_more_than_chance(savings, options_.significance / 2.0, options_.seed)) {
        return factor * size;
      }
    }
    return kNever;
  }

  // As more than θ may do without a cause.
  [[nodiscard]] double by_theta(double refitted, double nominal) const {
    if (!trusts_theta() || !(nominal > 0.0)) {
      return kNever;
    }
    const double first = std::sqrt(0.1 * options_.smallest / nominal);
    constexpr double kStep = 1.03, kMost = 100.0;
    for (double factor = 1.0; factor < kMost; factor *= kStep) {
      const double square = std::pow(factor * first, 2);
      const double held = std::max(now_.nominal_excess + square * nominal, 0.0);
      const double structure = std::max(now_.refitted_excess + square * refitted, 0.0);
      const double gap = std::max(held, structure);
      if (held - structure > std::max(options_.theta_share * gap + 2.0 * structure, options_.smallest)) {
        return factor * first;
      }
    }
    return kNever;
  }

  // As what lifts one channel above its floor.
  [[nodiscard]] double by_channel(const Eigen::VectorXd& beside) const {
    double size = kNever;
    for (std::size_t s = 0; s < whitened_.spaces(); ++s) {
      const double square = whitened_.mean_square(beside, s);
      const double room = 1.0 + 2.0 * options_.tolerated_floor - whitened_.mean_square(left_, s);
      if (square > 0.0) {
        size = std::min(size, std::sqrt(std::max(room, 0.0) / square));
      }
    }
    return size;
  }

  const GapProblem& problem_;
  const Baseline& now_;
  const SelectionOptions& options_;
  Whitened whitened_;
  Eigen::VectorXd left_;
  Eigen::MatrixXd base_, unknown_;
};

// The shape of an effect of unit coefficient from which on it is seen, between its bounds: that bound where it shows
// least if it is seen at both; nothing if at none.
std::optional<double> smallest_shape(const Effect& effect, const PreparedGap& prepared, const GapProblem& problem,
                                     const Visibility& visibility) {
  const Interval bounds = shape_bounds(effect.shapes.front(), prepared.drive);
  const auto needed = [&](double shape) {
    const FittedEffect fitted{effect, {shape}, {}};
    return visibility.factor(rows_of(prepared.drive, problem.rows, fitted, prepared.row_options));
  };
  double not_seen = bounds.lower, is_seen = bounds.upper;
  if (needed(not_seen) <= needed(is_seen)) {
    std::swap(not_seen, is_seen);
  }
  if (needed(not_seen) <= 1.0) {
    return not_seen;
  }
  if (needed(is_seen) > 1.0) {
    return std::nullopt;
  }
  constexpr double kEnough = 1.02;
  while (std::max(is_seen / not_seen, not_seen / is_seen) > kEnough) {
    const double middle = std::sqrt(is_seen * not_seen);
    (needed(middle) <= 1.0 ? is_seen : not_seen) = middle;
  }
  return is_seen;
}

// The size of an effect whose coefficient `k` is this one, the others 0, as results have it (Effect::physical).
VisibleSize told_size(const Effect& effect, std::size_t k, double coefficient, const std::vector<double>& shape) {
  if (effect.physical) {
    std::vector<double> coefficients(effect.parameters.size(), 0.0);
    coefficients[k] = coefficient;
    for (const PhysicalValue& value : effect.physical(coefficients, shape)) {
      if (std::isfinite(value.value) && value.value != 0.0) {
        return {effect.name, value.name, value.unit, std::abs(value.value)};
      }
    }
  }
  return {effect.name, effect.parameters[k].name, effect.parameters[k].unit, coefficient};
}

}  // namespace

std::vector<VisibleSize> visible_sizes(const PreparedGap& prepared, const GapProblem& problem, const Baseline& now,
                                       const SelectionOptions& options) {
  const Visibility visibility(problem, now, options);
  std::vector<VisibleSize> sizes;
  std::set<std::string> told;
  for (const Effect& effect : prepared.catalogue) {
    if (effect.free_form || told.contains(effect.name) || !applicability(effect, prepared.drive).applies) {
      continue;
    }
    if (effect.unit_coefficient) {
      if (effect.shapes.size() == 1) {
        if (const std::optional<double> shape = smallest_shape(effect, prepared, problem, visibility)) {
          told.insert(effect.name);
          sizes.push_back({effect.name, effect.shapes.front().name, effect.shapes.front().unit, *shape});
        }
      }
      continue;
    }
    const std::vector<std::vector<double>> grid = shape_grid(effect, prepared.drive);
    const std::vector<double>& shape = grid[grid.size() / 2];
    const std::vector<Column> columns = effect.columns(prepared.drive, shape);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const double size =
          effect.parameters[k].beside
              ? kNever
              : visibility.factor(rows_of(prepared.drive, problem.rows, columns[k], prepared.row_options));
      if (std::isfinite(size)) {
        told.insert(effect.name);
        sizes.push_back(told_size(effect, k, size, shape));
      }
    }
  }
  return sizes;
}

}  // namespace wheelwright::gap
