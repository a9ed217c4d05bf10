// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/information_over_time.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

constexpr double kWindows = 60.0;
constexpr double kNoInformation = 1e-13;  // eigenvalue of the scaled Gram matrix, of the largest
constexpr double kConfounded = 1e-5;      // part of a scaled unit vector in the null space

}  // namespace

InformationOverTime information_over_time(const RegressionMoments& moments, const InformationOptions& options) {
  check::non_negative(options.seconds, "length of a window");
  check::that(options.coverage > 0.0 && options.coverage <= 1.0, "coverage", "in (0, 1]");
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs()));
  const std::vector<MomentBlock>& blocks = moments.blocks();
  const auto p = static_cast<Eigen::Index>(moments.parameters());
  InformationOverTime result;
  result.parameters.resize(moments.parameters());
  if (blocks.empty()) {
    return result;
  }
  const double seconds =
      options.seconds > 0.0 ? options.seconds : (blocks.back().last - blocks.front().first) / kWindows;
  std::vector<Eigen::MatrixXd> grams;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Eigen::MatrixXd YY = moments.block(b, w).YY;
    // A block belongs where its middle is.
    if (result.windows.empty() || 0.5 * (blocks[b].first + blocks[b].last) >= result.windows.back().first + seconds) {
      result.windows.push_back(blocks[b]);
      grams.push_back(YY);
    } else {
      result.windows.back().last = blocks[b].last;
      result.windows.back().instants += blocks[b].instants;
      grams.back() += YY;
    }
  }
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(p, p);
  for (const Eigen::MatrixXd& gram : grams) {
    G += gram;
  }
  const Eigen::VectorXd one_over = G.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 0.0; });
  const EigenPairs eigen = symmetric_eigen(one_over.asDiagonal() * G * one_over.asDiagonal());
  const Eigen::VectorXd inverse = eigen.values.unaryExpr(
      [&](double value) { return value > kNoInformation * eigen.values[p - 1] ? 1.0 / value : 0.0; });
  const auto W = static_cast<Eigen::Index>(result.windows.size());

  for (Eigen::Index j = 0; j < p; ++j) {
    ParameterInformation& info = result.parameters[static_cast<std::size_t>(j)];
    info.share = info.cumulative = Eigen::VectorXd::Zero(W);
    const Eigen::VectorXd row = eigen.vectors.row(j).transpose();
    const double confounded = (inverse.array() == 0.0).select(row.array().square(), 0.0).sum();
    if (!(one_over[j] > 0.0) || confounded > kConfounded * kConfounded) {
      continue;
    }
    const Eigen::VectorXd column = one_over.cwiseProduct(eigen.vectors * inverse.cwiseProduct(row)) * one_over[j];
    const Eigen::VectorXd d = column / column[j];
    for (Eigen::Index k = 0; k < W; ++k) {
      info.share[k] = std::max(0.0, d.dot(grams[static_cast<std::size_t>(k)] * d));
    }
    info.information = info.share.sum();
    if (!(info.information > 0.0)) {
      continue;
    }
    info.share /= info.information;
    std::partial_sum(info.share.begin(), info.share.end(), info.cumulative.begin());

    std::vector<std::size_t> order(result.windows.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return info.share[static_cast<Eigen::Index>(a)] > info.share[static_cast<Eigen::Index>(b)];
    });
    double carried = 0.0;
    for (std::size_t k = 0; k < order.size() && carried < options.coverage; ++k) {
      info.shortest.push_back(order[k]);
      carried += info.share[static_cast<Eigen::Index>(order[k])];
    }
    std::sort(info.shortest.begin(), info.shortest.end());
    for (std::size_t k = 0; k < info.shortest.size(); ++k) {
      const MomentBlock& window = result.windows[info.shortest[k]];
      if (k > 0 && info.shortest[k] == info.shortest[k - 1] + 1) {
        info.spans.back().second = window.last;
      } else {
        info.spans.emplace_back(window.first, window.last);
      }
      info.seconds += window.last - window.first;
    }
  }
  return result;
}

}  // namespace wheelwright
