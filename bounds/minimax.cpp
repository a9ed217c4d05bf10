// SPDX-License-Identifier: Apache-2.0
#include "bounds/minimax.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <tuple>

#include "bounds/certificate.hpp"
#include "bounds/linear_program.hpp"
#include "bounds/slab_rows.hpp"
#include "bounds/survey.hpp"
#include "core/limits.hpp"

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kScanned = 1 << 14;
constexpr std::size_t kAtOnce = 256;  // rows of a sample
constexpr std::size_t kSmall = 64;    // rows that are not worth a store of their own
constexpr double kAside = 1e-6;       // of γ: room for rounding below which a row is not put aside

/// γ that row `row` asks for at θ, a bound on the rounding of it, and what it asks for without dy and dY.
struct Demand {
  double value = 0.0, doubt = 0.0, residual = 0.0;
};

Demand demand(const SlabColumns& rows, std::size_t row, const Eigen::VectorXd& theta, double weight) {
  const Eigen::Index p = theta.size();
  double residual = rows.y[row], allowance = rows.dy[row], magnitude = std::abs(rows.y[row]) + rows.dy[row];
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto k = static_cast<std::size_t>(j);
    const double term = rows.Y[k][row] * theta[j];
    const double noise = rows.dY.empty() ? 0.0 : rows.dY[k][row] * std::abs(theta[j]);
    residual -= term;
    allowance += noise;
    magnitude += std::abs(term) + noise;
  }
  return {(std::abs(residual) - allowance) / weight,
          4.0 * static_cast<double>(p + 4) * core::kEpsilon * magnitude / weight, std::abs(residual) / weight};
}

/// The working set of the epigraph problem in (θ, γ): min γ.
class Epigraph {
 public:
  /// `information` as in whitened(); `guess` is a least-squares fit; `sample` has rows of every output.
  Epigraph(const Box& prior, const std::vector<double>& weights, const Eigen::MatrixXd& information,
           const Eigen::VectorXd& guess, const std::vector<SlabColumns>& sample)
      : prior_(prior), rows_(prior), weights_(weights), theta_(guess) {
    const auto p = static_cast<Eigen::Index>(prior.dimension());
    coordinates_ = whitened(prior, information);
    const Eigen::MatrixXd& T = coordinates_.transform;
    clamp();
    coordinates_.centre = theta_;
    // z and γ are scaled so that both take part in a row alike.
    double steepest = 0.0, size = 0.0;
    Eigen::MatrixXd Y, at;
    Eigen::VectorXd y, left;
    for (const SlabColumns& rows : sample) {
      const double w = weights_[rows.output];
      for (std::size_t first = 0; std::isfinite(w) && first < rows.n; first += kAtOnce) {
        const auto count = static_cast<Eigen::Index>(std::min(kAtOnce, rows.n - first));
        Y.resize(count, p);
        for (Eigen::Index j = 0; j < p; ++j) {
          Y.col(j) = Eigen::Map<const Eigen::VectorXd>(rows.Y[static_cast<std::size_t>(j)] + first, count);
        }
        y = Eigen::Map<const Eigen::VectorXd>(rows.y + first, count);
        left = y;
        left.noalias() -= Y * theta_;
        at.noalias() = Y * T;
        scale_ = std::max(scale_, left.lpNorm<Eigen::Infinity>() / w);
        steepest = std::max(steepest, std::sqrt(at.rowwise().squaredNorm().maxCoeff()) / w);
        size =
            std::max(size, (y.cwiseAbs() + Eigen::Map<const Eigen::VectorXd>(rows.dy + first, count)).maxCoeff() / w);
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

  [[nodiscard]] const Eigen::VectorXd& theta() const { return theta_; }
  [[nodiscard]] double gamma() const { return gamma_; }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] const std::vector<WeightedRow>& active() const { return active_; }

  /// Adds the rows that the fit violates most, until it violates none by more than the tolerance; whether any was
  /// added.
  bool absorb(const SlabColumns& rows, double relative) {
    const double w = weights_[rows.output];
    bool changed = false;
    for (int round = 0; round < kRounds && std::isfinite(w); ++round) {
      const double limit = gamma_ + tolerance(relative);
      const auto found = beyond(rows, theta_, Eigen::VectorXd::Zero(theta_.size()), limit * w, nullptr);
      if (found.empty()) {
        break;
      }
      if (4 * found.size() < rows.n && rows.n > kSmall) {
        // Few: settled among themselves first, so that the many are looked at again only once.
        SlabStore few;
        few.append(rows, found);
        SlabColumns settled = few.view();
        settled.output = rows.output;
        changed = absorb(settled, relative) || changed;
        if (failed_) {
          break;
        }
        continue;
      }
      // The row that is worst on either side, in each of several stretches of time.
      const std::size_t stretches = std::min<std::size_t>(static_cast<std::size_t>(theta_.size()) + 1, found.size());
      std::vector<HalfSpace> added;
      for (std::size_t s = 0; s < stretches; ++s) {
        double worst[2] = {limit, limit};
        HalfSpace chosen[2];
        for (std::size_t f = s * found.size() / stretches; f < (s + 1) * found.size() / stretches; ++f) {
          const std::size_t r = found[f];
          const double asked = demand(rows, r, theta_, w).value;
          if (!(asked > std::min(worst[0], worst[1]))) {
            continue;
          }
          half_spaces(rows, r);
          for (HalfSpace* row : {&upper_, &lower_}) {
            const std::size_t k = row == &lower_ ? 1 : 0;
            const double at = (row->a.dot(theta_) - row->b) / w;
            if (at > worst[k]) {
              worst[k] = at;
              chosen[k] = *row;
            }
          }
        }
        for (HalfSpace& row : chosen) {
          // A row of the program that its solution violates is as near as rounding lets it come.
          if (row.a.size() != 0 &&
              taken_.insert({row.origin.sample, row.origin.t, row.origin.output, row.origin.side}).second) {
            row.a.conservativeResize(theta_.size() + 1);
            row.a[theta_.size()] = -w;
            added.push_back(std::move(row));
          }
        }
      }
      if (added.empty()) {
        break;
      }
      insert(std::move(added));
      changed = true;
      if (!solve()) {
        failed_ = true;
        break;
      }
    }
    return changed;
  }

  /// Rows without |y − Y·at| + Σ|Y_j| half_j <= floor + dy + Σ dY_j |θ_j|; `peaks` as in kernels::Table::scan.
  std::span<const std::uint32_t> beyond(const SlabColumns& rows, const Eigen::VectorXd& at, const Eigen::VectorXd& half,
                                        double floor, double* peaks) {
    const Eigen::VectorXd least = (at.cwiseAbs() - half).cwiseMax(0.0);
    const kernels::Slabs slabs{rows.Y.data(), rows.dY.empty() ? nullptr : rows.dY.data(), rows.y, rows.dy, rows.n,
                               rows.Y.size()};
    found_.resize(std::max(found_.size(), rows.n));
    return {found_.data(),
            kernels::best().scan(slabs, at.data(), half.data(), least.data(), nullptr, floor, found_.data(), peaks)};
  }

  /// Whether a linear program could not be solved: the fit is then what it was before.
  [[nodiscard]] bool failed() const { return failed_; }

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
  static constexpr int kRounds = 256;

  void half_spaces(const SlabColumns& rows, std::size_t r) {
    Y_.clear();
    dY_.clear();
    for (std::size_t j = 0; j < rows.parameters(); ++j) {
      Y_.push_back(rows.Y[j][r]);
      dY_.push_back(rows.dY.empty() ? 0.0 : rows.dY[j][r]);
    }
    rows_.half_spaces(Y_, dY_, rows.y[r], rows.dy[r], rows.origin(r), upper_, lower_);
  }

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
  std::set<std::tuple<std::size_t, double, std::size_t, Side>>
      taken_;  // sample, t, output, side of rows in the program
  std::vector<double> norms_;
  std::vector<WeightedRow> active_;
  Eigen::VectorXd theta_;
  HalfSpace upper_, lower_;
  std::vector<std::uint32_t> found_;
  std::vector<double> Y_, dY_;
  double gamma_ = 0.0, scale_ = 0.0;
  bool failed_ = false;
};

/// The largest demand of any row at `theta`, rounded outward.
double largest_demand(const SlabColumns& rows, const Eigen::VectorXd& theta, double weight) {
  double upper = 0.0;
  for (std::size_t r = 0; r < rows.n; ++r) {
    const Demand asked = demand(rows, r, theta, weight);
    upper = std::max(upper, core::round_up(asked.value + asked.doubt));
  }
  return upper;
}

MinimaxFit finished(const Epigraph& epigraph, MinimaxFit result, double tolerance) {
  result.lower = std::min(epigraph.certified_lower(result.upper), result.upper);
  result.active = epigraph.active();
  result.converged = result.upper - result.lower <= tolerance * result.upper + 1e-10 * epigraph.scale();
  return result;
}

MinimaxFit fit(core::RegressionSource& source, const RowSurvey& survey, const Box& prior,
               const std::vector<double>& weights, const std::vector<std::size_t>& excluded,
               const MinimaxOptions& options) {
  ColumnPacker packer(source.outputs(), prior.dimension()), sampled(source.outputs(), prior.dimension());
  std::vector<SlabColumns> sample;
  sampled.walk(survey.sample, [&](const SlabColumns& columns, const std::vector<char>&) {
    sample.push_back(columns);
    return true;
  });
  Epigraph epigraph(prior, weights, survey.information, weighted_estimate(survey, prior), sample);
  for (const SlabColumns& columns : sample) {
    epigraph.absorb(columns, options.tolerance);
  }
  MinimaxFit result;
  result.upper = std::numeric_limits<double>::infinity();
  for (bool last = false; !last;) {
    bool changed = false;
    // The final pass only evaluates.
    last = result.passes + 1 >= options.pass_limit || epigraph.failed();
    double upper = 0.0;
    const Eigen::VectorXd at = epigraph.theta();
    packer.walk(source, excluded, [&](const SlabColumns& columns, const std::vector<char>&) {
      const double w = weights[columns.output];
      if (std::isfinite(w)) {
        upper = std::max(upper, largest_demand(columns, at, w));
        changed = (!last && epigraph.absorb(columns, options.tolerance)) || changed;
      }
      return true;
    });
    ++result.passes;
    // `at` is where the pass began, evaluated on every row: an upper bound even when the fit moved on.
    if (upper < result.upper) {
      result.upper = upper;
      result.theta.assign(at.data(), at.data() + at.size());
    }
    last = last || !changed;
  }
  return finished(epigraph, std::move(result), options.tolerance);
}

/// Rows [first, first + count), of which those are put aside that can matter for any θ within `half` of `centre`.
struct Look {
  std::size_t first = 0, count = 0;
  Eigen::VectorXd centre, half;

  [[nodiscard]] bool holds(const Eigen::VectorXd& theta) const {
    return ((theta - centre).cwiseAbs().array() <= half.array()).all();
  }
};

MinimaxFit fit(const SlabColumns& rows, const Box& prior, const std::vector<double>& weights,
               const MinimaxOptions& options) {
  const double w = weights[rows.output];
  const SpreadSample sample(rows);
  const Eigen::MatrixXd information = sample.information(prior);
  Epigraph epigraph(prior, weights, information, sample.estimate(prior, information), {sample.all()});
  std::vector<Eigen::VectorXd> fits;
  sample.each_level([&](const SlabColumns& level) {
    epigraph.absorb(level, options.tolerance);
    fits.push_back(epigraph.theta());
    return true;
  });
  // Each look is as long as all before it: what it brings moves the fit about half as far as the look before.
  Eigen::VectorXd half = 2.0 * (fits[2] - fits[1]).cwiseAbs() + 0.5 * (fits[1] - fits[0]).cwiseAbs();
  std::vector<Look> looks;
  for (std::size_t first = 0; first < rows.n; first += looks.back().count) {
    looks.push_back({first, std::min(std::max(first, kScanned), rows.n - first), {}, {}});
  }
  SlabStore aside;
  std::vector<double> peaks(rows.parameters() + 1);
  double floor = 0.0;  // no row that is not aside asks for more where all looks hold, but for rounding
  const auto look_at = [&](Look& look) {
    look.centre = epigraph.theta();
    look.half = half;
    const double least = (1.0 - kAside) * epigraph.gamma();
    floor = std::max(floor, least);
    for (std::size_t first = look.first; first < look.first + look.count; first += kScanned) {
      const SlabColumns portion = rows.part(first, std::min(kScanned, look.first + look.count - first));
      aside.append(portion, epigraph.beyond(portion, look.centre, look.half, least * w, peaks.data()));
    }
    epigraph.absorb(aside.view(), options.tolerance);
    return (epigraph.theta() - look.centre).cwiseAbs().eval();
  };
  for (Look& look : looks) {
    half = (0.5 * half).cwiseMax(4.0 * look_at(look));
  }
  MinimaxFit result;
  result.passes = 1;
  const auto holds = [&](const Look& look) { return look.holds(epigraph.theta()); };
  bool settled = std::ranges::all_of(looks, holds);
  while (!settled && result.passes < options.pass_limit && !epigraph.failed()) {
    for (Look& look : looks) {
      if (!holds(look)) {
        half = (2.0 * look.half).cwiseMax(4.0 * (epigraph.theta() - look.centre).cwiseAbs());
        look_at(look);
      }
    }
    ++result.passes;
    settled = std::ranges::all_of(looks, holds);
  }
  const Eigen::VectorXd theta = epigraph.theta();
  result.theta.assign(theta.data(), theta.data() + theta.size());
  if (settled) {
    double magnitude = peaks.back() + floor * w;
    for (Eigen::Index j = 0; j < theta.size(); ++j) {
      double reach = 0.0;
      for (const Look& look : looks) {
        reach = std::max(reach, std::abs(look.centre[j]) + 2.0 * look.half[j]);
      }
      magnitude += 2.0 * peaks[static_cast<std::size_t>(j)] * reach;
    }
    const double doubt = 8.0 * static_cast<double>(theta.size() + 4) * core::kEpsilon * magnitude / w;
    result.upper = std::max(largest_demand(aside.view(), theta, w), core::round_up(floor + doubt));
  } else {
    result.upper = largest_demand(rows, theta, w);
    ++result.passes;
  }
  return finished(epigraph, std::move(result), options.tolerance);
}

/// The weights of all outputs, checked.
std::vector<double> checked_weights(const MinimaxOptions& options, std::size_t outputs) {
  std::vector<double> weights = options.weights;
  if (weights.empty()) {
    weights.assign(outputs, 1.0);
  }
  check::that(weights.size() == outputs, "weights", "one per output");
  check::that(std::all_of(weights.begin(), weights.end(), [](double w) { return w > 0.0; }), "weights", "numbers > 0");
  check::that(std::any_of(weights.begin(), weights.end(), [](double w) { return std::isfinite(w); }), "weights",
              "at least one that is finite");
  check::that(options.pass_limit >= 1, "pass_limit", "at least 1");
  return weights;
}

}  // namespace

MinimaxFit minimax_fit(core::RegressionSource& source, const Box& prior, const MinimaxOptions& options) {
  const std::vector<double> weights = checked_weights(options, source.outputs());
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);

  std::vector<std::size_t> open = open_signs(known, prior);
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
  // Another pattern may hold the truth down to its own lower bound; what double precision allows is what it allowed the
  // best one.
  const double own_gap = best.upper - best.lower;
  best.converged = best.converged && best.upper - lower <= std::max(options.tolerance * best.upper, own_gap);
  best.lower = lower;
  best.passes = passes;
  return best;
}

MinimaxFit minimax_fit(const SlabColumns& rows, const Box& prior, const MinimaxOptions& options) {
  check::that(prior.dimension() > 0 && rows.parameters() == prior.dimension(), "prior box",
              "one side per parameter of the regression");
  check_finite(prior, "prior box");
  check::that(rows.output == 0 && rows.outputs == nullptr, "rows", "of one output");
  check::that(options.excluded_samples.empty(), "excluded_samples", "none for rows in memory");
  return fit(rows, prior, checked_weights(options, 1), options);
}

}  // namespace wheelwright::bounds
