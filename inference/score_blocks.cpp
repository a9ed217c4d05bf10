// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/score_blocks.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

constexpr double kSingularScore = 1e-12;  // reciprocal condition, columns scaled
constexpr double kWholeBlock = 1e-6;      // times are rounded: so much more than whole blocks is none

double typical_seconds(const std::vector<MomentBlock>& blocks) {
  if (blocks.size() < 2) {
    return blocks.empty() ? 0.0 : blocks[0].last - blocks[0].first;
  }
  std::vector<double> lengths;
  for (std::size_t b = 0; b + 1 < blocks.size(); ++b) {
    lengths.push_back(blocks[b + 1].first - blocks[b].first);
  }
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

Eigen::VectorXd column_lengths(const Eigen::MatrixXd& gram) {
  Eigen::VectorXd lengths = gram.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& s : lengths) {
    s = s > 0.0 ? s : 1.0;
  }
  return lengths;
}

}  // namespace

std::size_t ScoreBlocks::lasting(double seconds) const {
  const double most = std::max(1.0, static_cast<double>(blocks()));
  const double length = block_seconds > 0.0 ? std::ceil(seconds / block_seconds - kWholeBlock) : 1.0;
  return static_cast<std::size_t>(std::clamp(length, 1.0, most));
}

Eigen::MatrixXd ScoreBlocks::scores(const Eigen::VectorXd& at) const {
  const Eigen::Index q = c.rows();
  Eigen::MatrixXd s = c;
  for (Eigen::Index j = 0; j < q; ++j) {
    s -= at[j] * A.middleRows(j * q, q);
  }
  return s;
}

Eigen::VectorXd ScoreBlocks::unscaled(const Eigen::VectorXd& at, double other) const {
  Eigen::VectorXd theta = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(parameters), other);
  theta(kept) = at.cwiseQuotient(scale);
  return theta;
}

ScoreBlocks score_blocks(const RegressionMoments& moments, const EstimatorOptions& options, bool instruments) {
  const std::size_t p = moments.parameters();
  check::that(options.excluded.empty() || options.excluded.size() == p, "excluded parameters", "one flag for each");
  const bool with_z = instruments && moments.has_instruments();
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs()));
  ScoreBlocks s;
  s.parameters = p;
  for (std::size_t j = 0; j < p; ++j) {
    if (options.excluded.empty() || !options.excluded[j]) {
      s.kept.push_back(static_cast<Eigen::Index>(j));
    }
  }
  const auto q = static_cast<Eigen::Index>(s.kept.size());
  const auto B = static_cast<Eigen::Index>(moments.blocks().size());
  const MomentSums total = moments.total(w);
  const Eigen::MatrixXd shape = (with_z ? total.ZZ : total.YY)(s.kept, s.kept);
  s.scale = column_lengths(total.YY(s.kept, s.kept));
  const Eigen::VectorXd row_scale = column_lengths(shape).cwiseInverse();
  const Eigen::VectorXd column_scale = s.scale.cwiseInverse();
  s.shape = row_scale.asDiagonal() * shape * row_scale.asDiagonal();
  s.A.resize(q * q, B);
  s.c.resize(q, B);
  for (Eigen::Index b = 0; b < B; ++b) {
    const MomentSums sums = moments.block(static_cast<std::size_t>(b), w);
    const Eigen::MatrixXd A =
        row_scale.asDiagonal() * (with_z ? sums.ZY : sums.YY)(s.kept, s.kept) * column_scale.asDiagonal();
    s.A.col(b) = A.reshaped();
    s.c.col(b) = row_scale.cwiseProduct((with_z ? sums.Zy : sums.Yy)(s.kept));
  }
  s.block_seconds = typical_seconds(moments.blocks());
  s.total_A = s.A.rowwise().sum().reshaped(q, q);
  s.total_c = s.c.rowwise().sum();
  s.psi = Eigen::VectorXd::Zero(q);
  s.inverse = Eigen::MatrixXd::Zero(q, q);
  if (q == 0 || B == 0) {
    s.reason = "there is nothing to estimate";
    return s;
  }
  const LuFactors lu(s.total_A);
  const LuFactors shape_lu(s.shape);
  s.solvable = s.total_A.allFinite() && s.total_c.allFinite() && lu.reciprocal_condition() > kSingularScore &&
               shape_lu.reciprocal_condition() > kSingularScore;
  if (!s.solvable) {
    s.reason =
        with_z ? "the instruments do not tell the parameters apart" : "the log does not tell the parameters apart";
    return s;
  }
  s.psi = lu.solve(s.total_c);
  s.inverse = lu.inverse();
  return s;
}

ScoreBlocks grouped(const ScoreBlocks& blocks, std::size_t length) {
  check::that(length >= 1, "length of a group", "at least one block");
  ScoreBlocks groups = blocks;
  const auto B = static_cast<Eigen::Index>(blocks.blocks());
  const auto l = static_cast<Eigen::Index>(length);
  const Eigen::Index G = (B + l - 1) / l;
  groups.A.resize(blocks.A.rows(), G);
  groups.c.resize(blocks.c.rows(), G);
  for (Eigen::Index g = 0; g < G; ++g) {
    const Eigen::Index count = std::min(l, B - g * l);
    groups.A.col(g) = blocks.A.middleCols(g * l, count).rowwise().sum();
    groups.c.col(g) = blocks.c.middleCols(g * l, count).rowwise().sum();
  }
  groups.block_seconds = static_cast<double>(length) * blocks.block_seconds;
  return groups;
}

}  // namespace wheelwright
