// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/minimax.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/infeasibility.hpp>
#include <wheelwright/bounds/linear_program.hpp>
#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/bounds/survey.hpp>

namespace wheelwright {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// γ that row `row` asks for at θ, a bound on the rounding of it, and what it asks for without dy and dY.
struct Demand {
  double value = 0.0, doubt = 0.0, residual = 0.0;
};

Demand demand(const RegressionBlock& block, Eigen::Index row, const Eigen::VectorXd& theta, double weight) {
  const Eigen::Index p = theta.size();
  const double* Y = block.Y.data() + row * p;
  const double* dY = block.dY.data() + row * p;
  double residual = block.y[row], allowance = block.dy[row], magnitude = std::abs(block.y[row]) + block.dy[row];
  for (Eigen::Index j = 0; j < p; ++j) {
    const double term = Y[j] * theta[j], noise = dY[j] * std::abs(theta[j]);
    residual -= term;
    allowance += noise;
    magnitude += std::abs(term) + noise;
  }
  return {(std::abs(residual) - allowance) / weight, 4.0 * static_cast<double>(p + 4) * kEpsilon * magnitude / weight,
          std::abs(residual) / weight};
}

/// The working set of the epigraph problem in (θ, γ): min γ.
class Epigraph {
 public:
  Epigraph(const RowSurvey& survey, const Box& prior, const std::vector<double>& weights)
      : prior_(prior), rows_(prior), weights_(weights) {
    const auto p = static_cast<Eigen::Index>(prior.dimension());
    coordinates_ = whitened(prior, survey.information);
    const Eigen::MatrixXd& T = coordinates_.transform;
    theta_ = weighted_estimate(survey, prior);
    clamp();
    coordinates_.centre = theta_;
    // z and γ are scaled so that both take part in a row alike.
    double steepest = 0.0, size = 0.0;
    const RegressionBlock& sample = survey.sample;
    for (Eigen::Index r = 0; r < sample.rows(); ++r) {
      const double w = weight(r, sample.outputs);
      if (std::isfinite(w)) {
        scale_ = std::max(scale_, demand(sample, r, theta_, w).residual);
        steepest = std::max(steepest, (T.transpose() * sample.Y.row(r).transpose()).norm() / w);
        size = std::max(size, (std::abs(sample.y[r]) + sample.dy[r]) / w);
      }
    }
    scale_ = std::max({scale_, 1e-13 * size, 1e-200});
    if (steepest > 0.0) {
      coordinates_.transform *= scale_ / steepest;
    }
    Eigen::VectorXd limit(p + 1);
    limit << 4.0 * extent(prior, coordinates_), 4.0 * size / scale_;
    limit.array() += 4.0;
    limit[p] += 4.0 * limit.head(p).sum();
    program_.emplace(-limit, limit);
    std::vector<HalfSpace> first;
    for (HalfSpace& side : sides_as_rows(prior)) {
      side.a.conservativeResize(p + 1);
      side.a[p] = 0.0;
      first.push_back(std::move(side));
    }
    insert(std::move(first));
  }

  [[nodiscard]] double weight(Eigen::Index row, std::size_t outputs) const {
    return weights_[static_cast<std::size_t>(row) % outputs];
  }
  [[nodiscard]] const Eigen::VectorXd& theta() const { return theta_; }
  [[nodiscard]] double gamma() const { return gamma_; }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] const std::vector<WeightedRow>& active() const { return active_; }

  /// Adds the rows of the instants of `block` that the fit violates most, until it violates none by more than
  /// `tolerance`; whether any was added.
  bool absorb(const RegressionBlock& block, const std::vector<std::size_t>& excluded, double relative) {
    bool changed = false;
    for (int round = 0; round < 64; ++round) {
      const double limit = gamma_ + tolerance(relative);
      std::vector<double> worst(2 * block.outputs, limit);
      std::vector<HalfSpace> chosen(2 * block.outputs);
      for (Eigen::Index r = 0; r < block.rows(); ++r) {
        const double w = weight(r, block.outputs);
        const std::size_t i = static_cast<std::size_t>(r) % block.outputs;
        if (!std::isfinite(w) || !(demand(block, r, theta_, w).value > std::min(worst[2 * i], worst[2 * i + 1])) ||
            std::binary_search(excluded.begin(), excluded.end(),
                               block.sample[static_cast<std::size_t>(r) / block.outputs])) {
          continue;
        }
        rows_.half_spaces(block, r, upper_, lower_);
        for (HalfSpace* row : {&upper_, &lower_}) {
          const std::size_t k = 2 * i + (row == &lower_ ? 1 : 0);
          const double asked = (row->a.dot(theta_) - row->b) / w;
          if (asked > worst[k]) {
            worst[k] = asked;
            chosen[k] = *row;
          }
        }
      }
      std::vector<HalfSpace> added;
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        if (chosen[k].a.size() != 0) {
          const Eigen::Index p = chosen[k].a.size();
          chosen[k].a.conservativeResize(p + 1);
          chosen[k].a[p] = -weights_[k / 2];
          added.push_back(std::move(chosen[k]));
        }
      }
      if (added.empty()) {
        break;
      }
      insert(std::move(added));
      changed = true;
      if (!solve()) {
        break;
      }
    }
    return changed;
  }

  /// Certified lower bound of γ*, given an upper one.
  [[nodiscard]] double certified_lower(double upper) const {
    Box box = prior_;
    box.sides.push_back({0.0, std::max(upper, 0.0)});
    std::vector<double> direction(box.dimension(), 0.0);
    direction.back() = -1.0;
    return std::max(0.0, -certified_upper_bound(direction, active_, box));
  }

  /// What is taken for no violation.
  [[nodiscard]] double tolerance(double relative) const { return 0.25 * relative * gamma_ + 1e-11 * scale_; }

  bool solve() {
    const Eigen::Index p = theta_.size();
    const LpSolution solution = program_->maximise(-Eigen::VectorXd::Unit(p + 1, p));
    if (solution.status != LpSolution::Status::optimal) {
      return false;
    }
    theta_ = coordinates_.centre + coordinates_.transform * solution.x.head(p);
    clamp();
    gamma_ = std::max(0.0, solution.x[p] * scale_);
    active_.clear();
    for (std::size_t k = 0; k < solution.rows.size(); ++k) {
      const auto i = static_cast<std::size_t>(solution.rows[k]);
      active_.push_back({held_[i], solution.multipliers[static_cast<Eigen::Index>(k)] * scale_ / norms_[i]});
    }
    return true;
  }

 private:
  void insert(std::vector<HalfSpace> rows) {
    const Eigen::Index p = theta_.size();
    const auto m = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd a(p + 1, m);
    Eigen::VectorXd b(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      HalfSpace& row = rows[static_cast<std::size_t>(i)];
      a.col(i) << coordinates_.transform.transpose() * row.a.head(p), row.a[p] * scale_;
      const double norm = std::max(a.col(i).norm(), 1e-300);
      a.col(i) /= norm;
      b[i] = (row.b - row.a.head(p).dot(coordinates_.centre)) / norm;
      norms_.push_back(norm);
      held_.push_back(std::move(row));
    }
    program_->add_rows(a, b);
  }

  void clamp() {
    for (Eigen::Index j = 0; j < theta_.size(); ++j) {
      const Interval& side = prior_.sides[static_cast<std::size_t>(j)];
      theta_[j] = std::clamp(theta_[j], side.lower, side.upper);
    }
  }

  Box prior_;
  SlabRows rows_;
  std::vector<double> weights_;
  Coordinates coordinates_;
  std::optional<LinearProgram> program_;
  std::vector<HalfSpace> held_;
  std::vector<double> norms_;
  std::vector<WeightedRow> active_;
  Eigen::VectorXd theta_;
  HalfSpace upper_, lower_;
  double gamma_ = 0.0, scale_ = 0.0;
};

MinimaxFit fit(RegressionSource& source, const RowSurvey& survey, const Box& prior, const std::vector<double>& weights,
               const std::vector<std::size_t>& excluded, const MinimaxOptions& options) {
  Epigraph epigraph(survey, prior, weights);
  MinimaxFit result;
  result.upper = std::numeric_limits<double>::infinity();
  bool solved = epigraph.solve();
  epigraph.absorb(survey.sample, {}, options.tolerance);
  RegressionBlock block;
  for (bool last = false; !last;) {
    bool changed = false;
    // The final pass only evaluates.
    last = result.passes + 1 >= options.pass_limit || !solved;
    double upper = 0.0;
    Eigen::VectorXd at = epigraph.theta();
    source.rewind();
    while (source.next(block)) {
      for (Eigen::Index r = 0; r < block.rows(); ++r) {
        const double w = epigraph.weight(r, block.outputs);
        if (!std::isfinite(w)) {
          continue;
        }
        const Demand asked = demand(block, r, at, w);
        if (asked.value + asked.doubt > upper &&
            !std::binary_search(excluded.begin(), excluded.end(),
                                block.sample[static_cast<std::size_t>(r) / block.outputs])) {
          upper = round_up(asked.value + asked.doubt);
        }
      }
      if (!last) {
        changed = epigraph.absorb(block, excluded, options.tolerance) || changed;
      }
    }
    ++result.passes;
    // `at` is where the pass began, evaluated on every row: an upper bound even when the fit moved on.
    if (upper < result.upper) {
      result.upper = upper;
      result.theta.assign(at.data(), at.data() + at.size());
    }
    last = last || !changed;
  }
  result.lower = std::min(epigraph.certified_lower(result.upper), result.upper);
  result.active = epigraph.active();
  result.converged = result.upper - result.lower <= options.tolerance * result.upper + 1e-10 * epigraph.scale();
  return result;
}

}  // namespace

MinimaxFit minimax_fit(RegressionSource& source, const Box& prior, const MinimaxOptions& options) {
  std::vector<double> weights = options.weights;
  if (weights.empty()) {
    weights.assign(source.outputs(), 1.0);
  }
  check::that(weights.size() == source.outputs(), "weights", "one per output");
  check::that(std::all_of(weights.begin(), weights.end(), [](double w) { return w > 0.0; }), "weights", "numbers > 0");
  check::that(std::any_of(weights.begin(), weights.end(), [](double w) { return std::isfinite(w); }), "weights",
              "at least one that is finite");
  check::that(options.pass_limit >= 1, "pass_limit", "at least 1");
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);

  std::vector<std::size_t> open;
  for (std::size_t j = 0; j < prior.dimension(); ++j) {
    if (known.noisy[j] && prior.sides[j].lower < 0.0 && prior.sides[j].upper > 0.0) {
      open.push_back(j);
    }
  }
  if (open.size() > 4) {
    open.clear();
  }
  MinimaxFit best;
  double lower = std::numeric_limits<double>::infinity();
  std::size_t passes = 1;
  for (std::size_t pattern = 0; pattern < std::size_t{1} << open.size(); ++pattern) {
    Box box = prior;
    for (std::size_t i = 0; i < open.size(); ++i) {
      Interval& side = box.sides[open[i]];
      ((pattern >> i & 1) != 0 ? side.upper : side.lower) = 0.0;
    }
    MinimaxFit part = fit(source, known, box, weights, excluded, options);
    passes += part.passes;
    lower = std::min(lower, part.lower);
    if (pattern == 0 || part.upper < best.upper) {
      best = std::move(part);
    }
  }
  best.lower = lower;
  best.passes = passes;
  best.converged = best.converged && best.upper - lower <= options.tolerance * best.upper + (best.upper - best.lower);
  return best;
}

}  // namespace wheelwright
