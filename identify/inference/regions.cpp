// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/regions.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/inference/block_bootstrap.hpp"
#include "identify/noise_level.hpp"

namespace wheelwright::inference {
namespace {

constexpr double kLostVariance = 0.05;  // at the edges of groups whose length is chosen
constexpr double kFlat = 1e-12;         // an ellipsoid's axis of a smaller eigenvalue is taken to be unbounded

// {z : zᵀz <= ‖b − Qz‖²} as Σ λ_k u_k² + 2 g_k u_k <= d in the coordinates u = Uᵀz.
struct Ellipsoid {
  Eigen::MatrixXd U;
  Eigen::VectorXd lambda, g;
  double d = 0.0;
  bool bounded = false;
};

Ellipsoid ellipsoid(const Eigen::MatrixXd& Q, const Eigen::VectorXd& b) {
  const core::EigenPairs eigen =
      core::symmetric_eigen(Eigen::MatrixXd::Identity(b.size(), b.size()) - Q.transpose() * Q);
  Ellipsoid e{eigen.vectors, eigen.values, eigen.vectors.transpose() * (Q.transpose() * b), b.squaredNorm(), false};
  e.bounded = e.lambda.allFinite() && e.lambda.minCoeff() > kFlat;
  return e;
}

// max zᵀz over the ellipsoid: by the S-lemma the minimum over ξ > 1/λ_min of ξd + Σ ξ²g²/(ξλ − 1), which is convex; its
// derivative is bisected in log(ξλ_min − 1). Every ξ gives an upper bound.
double largest_norm(const Ellipsoid& e) {
  if (!e.bounded) {
    return core::kInfinity;
  }
  const double least = e.lambda.minCoeff();
  const auto value = [&](double xi) {
    return xi * e.d + (xi * xi * e.g.array().square() / (xi * e.lambda.array() - 1.0)).sum();
  };
  const auto slope = [&](double xi) {
    const Eigen::ArrayXd excess = xi * e.lambda.array() - 1.0;
    return e.d + (e.g.array().square() * xi * (excess - 1.0) / excess.square()).sum();
  };
  const auto at = [&](double log_excess) { return (1.0 + std::exp(log_excess)) / least; };
  double low = -25.0;
  double high = 25.0;
  double best = std::min(value(at(low)), value(at(high)));
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    best = std::min(best, value(at(middle)));
    (slope(at(middle)) < 0.0 ? low : high) = middle;
  }
  return best;
}

double nth_largest(std::vector<double>& values, std::size_t n) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(n - 1);
  std::nth_element(values.begin(), nth, values.end(), std::greater<>());
  return *nth;
}

}  // namespace

SignPerturbedSums::SignPerturbedSums(const identify::RegressionMoments& moments, const SignPerturbedOptions& options)
    : m_(options.sums), parameters_(moments.parameters()) {
  check::that(options.confidence > 0.0 && options.confidence < 1.0, "confidence", "between 0 and 1");
  check::non_negative(options.seconds, "length of a group with one sign");
  check::that(options.groups >= 1, "groups", "at least 1");
  q_ = static_cast<std::size_t>(std::floor((1.0 - options.confidence) * static_cast<double>(m_) + 1e-9));
  check::that(q_ >= 1, "sign-perturbed sums", "at least 1/(1 − confidence) of them");

  const ScoreBlocks blocks = score_blocks(moments, options.estimator, options.instruments);
  kept_ = blocks.kept;
  usable_ = blocks.solvable;
  reason_ = blocks.reason;
  scale_ = blocks.scale;
  psi_ = blocks.psi;
  centre_ = blocks.unscaled(blocks.psi);
  if (!usable_) {
    return;
  }
  const Eigen::MatrixXd influence = blocks.inverse * blocks.scores(blocks.psi);
  const std::size_t length = options.seconds > 0.0 ? blocks.lasting(options.seconds)
                                                   : sign_group_length(influence, kLostVariance, options.groups);
  edge_share_ = wheelwright::inference::edge_share(influence, length);
  const ScoreBlocks groups = grouped(blocks, length);
  groups_ = groups.blocks();
  group_seconds_ = groups.block_seconds;

  std::mt19937_64 generator(options.seed);
  const auto m = static_cast<Eigen::Index>(m_);
  const auto G = static_cast<Eigen::Index>(groups_);
  Eigen::MatrixXd signs = Eigen::MatrixXd::Ones(G, m);
  for (Eigen::Index i = 1; i < m; ++i) {
    std::uint64_t bits = 0;
    for (Eigen::Index g = 0; g < G; ++g) {
      bits = g % 64 == 0 ? generator() : bits >> 1U;
      signs(g, i) = (bits & 1U) != 0 ? 1.0 : -1.0;
    }
  }
  order_.resize(m_);
  std::generate(order_.begin(), order_.end(), std::ref(generator));

  const core::CholeskyFactors P(groups.shape);
  c_ = P.solve_lower(groups.c * signs);
  A_ = groups.A * signs;
  const Eigen::Index q = c_.rows();
  for (Eigen::Index j = 0; j < q; ++j) {
    A_.middleRows(j * q, q) = P.solve_lower(A_.middleRows(j * q, q));
  }
}

double SignPerturbedSums::probability() const { return 1.0 - static_cast<double>(q_) / static_cast<double>(m_); }

bool SignPerturbedSums::contains(const Eigen::VectorXd& theta) const {
  check::that(static_cast<std::size_t>(theta.size()) == parameters_, "θ", "one value for each parameter");
  if (!usable_) {
    return true;
  }
  const Eigen::VectorXd psi = Eigen::VectorXd(theta(kept_)).cwiseProduct(scale_);
  const Eigen::Index q = c_.rows();
  Eigen::MatrixXd S = c_;
  for (Eigen::Index j = 0; j < q; ++j) {
    S -= psi[j] * A_.middleRows(j * q, q);
  }
  const Eigen::VectorXd norms = S.colwise().squaredNorm();
  std::size_t below = 0;  // sums that come before S_0
  for (Eigen::Index i = 1; i < norms.size(); ++i) {
    if (norms[i] < norms[0] || (norms[i] == norms[0] && order_[static_cast<std::size_t>(i)] < order_[0])) {
      ++below;
    }
  }
  return below + 1 <= m_ - q_;
}

SignPerturbedBounds SignPerturbedSums::bounds() const {
  const auto p = static_cast<Eigen::Index>(parameters_);
  SignPerturbedBounds result{Eigen::VectorXd::Zero(p), Eigen::VectorXd::Zero(p), Eigen::MatrixXd::Zero(p, p),
                             core::kInfinity};
  if (!usable_) {
    result.lower(kept_).setConstant(-core::kInfinity);
    result.upper(kept_).setConstant(core::kInfinity);
    return result;
  }
  const Eigen::Index q = c_.rows();
  const Eigen::MatrixXd root = A_.col(0).reshaped(q, q);  // z = root (ψ − ψ̂) = −S_0
  const Eigen::MatrixXd K = core::inverse(root);
  std::vector<double> norms;
  std::vector<std::vector<double>> up(static_cast<std::size_t>(q)), down(static_cast<std::size_t>(q));
  for (Eigen::Index i = 1; i < c_.cols(); ++i) {
    const Eigen::MatrixXd A = A_.col(i).reshaped(q, q);
    const Ellipsoid e = ellipsoid(A * K, c_.col(i) - A * psi_);
    norms.push_back(largest_norm(e));
    const Eigen::VectorXd centre = -e.g.cwiseQuotient(e.lambda);
    const double size = e.d - e.g.dot(centre);
    const Eigen::MatrixXd rows = K * e.U;
    for (Eigen::Index j = 0; j < q; ++j) {
      const double shift = rows.row(j).dot(centre);
      const double reach = std::sqrt(size * (rows.row(j).transpose().array().square() / e.lambda.array()).sum());
      up[static_cast<std::size_t>(j)].push_back(e.bounded ? shift + reach : core::kInfinity);
      down[static_cast<std::size_t>(j)].push_back(e.bounded ? reach - shift : core::kInfinity);
    }
  }
  result.radius = nth_largest(norms, q_);
  for (Eigen::Index j = 0; j < q; ++j) {
    const Eigen::Index at = kept_[static_cast<std::size_t>(j)];
    result.upper[at] = (psi_[j] + nth_largest(up[static_cast<std::size_t>(j)], q_)) / scale_[j];
    result.lower[at] = (psi_[j] - nth_largest(down[static_cast<std::size_t>(j)], q_)) / scale_[j];
  }
  const Eigen::MatrixXd scaled = root * scale_.asDiagonal();
  result.H(kept_, kept_) = scaled.transpose() * scaled;
  return result;
}

namespace {

constexpr double kLargeEdges = 0.1;  // of the variance of a sum: a doubt worth a remark

RegionRow nothing(RegionMethod method, double confidence, std::size_t p) {
  RegionRow row;
  row.method = method;
  row.confidence = confidence;
  row.lower = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(p), -std::numeric_limits<double>::infinity());
  row.upper = -row.lower;
  return row;
}

RegionRow student_row(const identify::Estimate& estimate, double confidence, std::size_t p) {
  RegionRow row = nothing(RegionMethod::student_t, confidence, p);
  row.promise = fmt::format(
      "{:.4g} % of such logs for each parameter, in the long run, while the errors' mean does not depend on the motion "
      "and their memory is short against the log",
      100.0 * confidence);
  row.available = estimate.usable;
  row.remark = estimate.reason;
  if (row.available) {
    const double t = core::student_quantile(confidence, estimate.freedom);
    row.lower = estimate.theta - t * estimate.standard_error;
    row.upper = estimate.theta + t * estimate.standard_error;
  }
  return row;
}

RegionRow bootstrap_row(const BlockBootstrap& bootstrap, std::size_t p) {
  RegionRow row = nothing(RegionMethod::block_bootstrap, bootstrap.confidence, p);
  row.promise = fmt::format(
      "{:.4g} % of such logs for each parameter, in the long run, while the log is stationary and errors further apart "
      "than {:.2g} s are independent; errors may be skewed",
      100.0 * bootstrap.confidence, bootstrap.seconds);
  row.available = bootstrap.usable;
  row.remark = bootstrap.reason;
  if (row.available) {
    row.lower = bootstrap.lower;
    row.upper = bootstrap.upper;
  }
  return row;
}

RegionRow sign_row(const SignPerturbedSums& sums, std::size_t p) {
  RegionRow row = nothing(RegionMethod::sign_perturbed_sums, sums.probability(), p);
  row.all_at_once = true;
  row.promise = fmt::format(
      "at least {:.4g} % for all parameters at once, for a log of any length, if errors in different stretches of "
      "{:.2g} s "
      "are independent and as likely of either sign",
      100.0 * sums.probability(), sums.group_seconds());
  row.available = sums.usable();
  row.remark = sums.reason();
  if (row.available) {
    const SignPerturbedBounds bounds = sums.bounds();
    row.lower = bounds.lower;
    row.upper = bounds.upper;
    if (sums.edge_share() > kLargeEdges) {
      row.remark = fmt::format(
          "the log is short for its errors' memory: {} stretches are still correlated and miss "
          "about {:.0f} % of the variance",
          sums.groups(), 100.0 * sums.edge_share());
    } else if (!row.lower.allFinite() || !row.upper.allFinite()) {
      row.remark = fmt::format("{} stretches are too few to bound every parameter", sums.groups());
    }
  }
  return row;
}

RegionRow hull_row(const IntervalBounds& hull) {
  RegionRow row;
  row.method = RegionMethod::interval_hull;
  row.available = row.all_at_once = true;
  row.confidence = 1.0;
  row.lower = hull.lower;
  row.upper = hull.upper;
  row.promise = fmt::format("always, for all parameters at once, while |e| ≤ {:.3g}{}{} at every instant",
                            fmt::join(hull.error, " and "), hull.unit.empty() ? "" : " ", hull.unit);
  return row;
}

}  // namespace

std::string_view to_string(RegionMethod method) {
  switch (method) {
    case RegionMethod::student_t: return "student_t";
    case RegionMethod::block_bootstrap: return "block_bootstrap";
    case RegionMethod::sign_perturbed_sums: return "sign_perturbed_sums";
    case RegionMethod::interval_hull: return "interval_hull";
  }
  return {};
}

RegionComparison compare_regions(const identify::RegressionMoments& moments, const identify::Estimate& estimate,
                                 const RegionOptions& options, const std::optional<IntervalBounds>& hull) {
  const std::size_t p = moments.parameters();
  check::that(static_cast<std::size_t>(estimate.theta.size()) == p, "estimate", "one of these moments");
  const bool instruments = estimate.estimator == identify::Estimator::instrumental_variables;
  BlockBootstrapOptions bootstrap_options = options.bootstrap;
  bootstrap_options.confidence = options.confidence;
  bootstrap_options.instruments = instruments;
  SignPerturbedOptions sign_options = options.sign_perturbed;
  sign_options.confidence = options.confidence;
  sign_options.instruments = instruments;
  const BlockBootstrap bootstrap = block_bootstrap(moments, bootstrap_options);
  const SignPerturbedSums sums(moments, sign_options);

  RegionComparison comparison;
  comparison.theta = estimate.theta;
  comparison.rows = {student_row(estimate, options.confidence, p), bootstrap_row(bootstrap, p), sign_row(sums, p)};
  comparison.bootstrap_seconds = bootstrap.seconds;
  comparison.sign_seconds = sums.group_seconds();
  comparison.sign_groups = sums.groups();
  if (!instruments && estimate.estimator != identify::Estimator::least_squares) {
    for (std::size_t i : {std::size_t{1}, std::size_t{2}}) {
      std::string& remark = comparison.rows[i].remark;
      remark += remark.empty() ? "" : "; ";
      remark += "of least squares, which noise of the motion biases";
    }
  }
  if (hull) {
    check::that(static_cast<std::size_t>(hull->lower.size()) == p && hull->upper.size() == hull->lower.size(),
                "interval hull", "an interval for each parameter");
    comparison.rows.push_back(hull_row(*hull));
  }
  return comparison;
}

}  // namespace wheelwright::inference
