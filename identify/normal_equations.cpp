// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/normal_equations.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <wheelwright/core/check.hpp>
#include <wheelwright/identify/gram_kernels.hpp>
#include <wheelwright/identify/moments.hpp>

namespace wheelwright {
namespace {

constexpr double kWorstCondition = 1e6;
constexpr std::size_t kPackedRows = 256;

using Walk = std::function<void(const std::function<void(const RegressionBlock&)>&)>;

// Σ w²Yᵀ(y − Yθ) and Σ w²(y − Yθ)², one walk.
class Gradient {
 public:
  Gradient(const Eigen::VectorXd& theta, const Eigen::VectorXd& weights)
      : weights_(&weights),
        p_(static_cast<std::size_t>(theta.size())),
        columns_((p_ + gram_kernels::kGroup - 1) / gram_kernels::kGroup * gram_kernels::kGroup),
        theta_(columns_, 0.0),
        tile_(kPackedRows * columns_, 0.0),
        of_tile_(columns_) {
    std::copy(theta.begin(), theta.end(), theta_.begin());
    sum_ = Eigen::VectorXd::Zero(theta.size());
  }

  void add(const RegressionBlock& rows) {
    const gram_kernels::GramKernels& kernels = gram_kernels::best();
    const std::size_t n = rows.outputs;
    for (std::size_t i = 0; i < n; ++i) {
      const double w = (*weights_)[static_cast<Eigen::Index>(i)];
      for (std::size_t k = 0; k < rows.instants(); k += kPackedRows) {
        const std::size_t count = std::min(kPackedRows, rows.instants() - k);
        const double* Y = rows.Y.data() + (k * n + i) * p_;
        std::size_t stride = n * p_;
        if (p_ != columns_) {
          for (std::size_t r = 0; r < count; ++r) {
            std::copy_n(Y + r * stride, p_, tile_.data() + r * columns_);
          }
          Y = tile_.data();
          stride = columns_;
        }
        std::ranges::fill(of_tile_, 0.0);
        double squares[gram_kernels::kGroup] = {};
        kernels.gradient({rows.y.data() + k * n + i, n}, {Y, stride}, columns_, count, theta_.data(), of_tile_.data(),
                         squares);
        sum_ += w * w * Eigen::Map<const Eigen::VectorXd>(of_tile_.data(), sum_.size());
        squares_ += w * w * ((squares[0] + squares[2]) + (squares[1] + squares[3]));
      }
    }
  }
  [[nodiscard]] const Eigen::VectorXd& sum() const { return sum_; }
  [[nodiscard]] double squares() const { return squares_; }

 private:
  const Eigen::VectorXd* weights_;
  std::size_t p_, columns_;
  std::vector<double> theta_, tile_, of_tile_;
  Eigen::VectorXd sum_;
  double squares_ = 0.0;
};

NormalEquationsFit solve(const Walk& walk, std::size_t outputs, std::size_t parameters, const Eigen::VectorXd& given) {
  const Eigen::VectorXd weights = given.size() > 0 ? given : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(outputs));
  RegressionMoments sums(outputs, parameters, false, 8);
  walk([&](const RegressionBlock& rows) { sums.add(rows); });
  check::that(sums.instants() > 0, "normal equations", "at least one instant");
  const MomentSums total = sums.total(weights);
  NormalEquationsFit fit;
  fit.instants = sums.instants();
  const Eigen::VectorXd scale =
      total.YY.diagonal().cwiseSqrt().unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  const Eigen::MatrixXd gram = scale.asDiagonal() * total.YY * scale.asDiagonal();
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues();
  fit.condition = eigenvalues[0] > 0.0 ? std::sqrt(eigenvalues[eigenvalues.size() - 1] / eigenvalues[0])
                                       : std::numeric_limits<double>::infinity();
  if (!(fit.condition <= kWorstCondition)) {
    return fit;
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  const auto solution = [&](const Eigen::VectorXd& right) -> Eigen::VectorXd {
    return scale.asDiagonal() * factor.solve(Eigen::VectorXd(scale.asDiagonal() * right));
  };
  const Eigen::VectorXd first = solution(total.Yy);
  Gradient gradient(first, weights);
  walk([&](const RegressionBlock& rows) { gradient.add(rows); });
  const Eigen::VectorXd step = solution(gradient.sum());
  fit.estimate = first + step;
  // The residual sum of squares is quadratic in θ, and its gradient at the solution is zero.
  fit.weighted_rss = std::max(0.0, gradient.squares() - gradient.sum().dot(step));
  for (Eigen::Index j = 0; j < step.size(); ++j) {
    fit.correction = std::max(fit.correction, fit.estimate[j] != 0.0 ? std::abs(step[j] / fit.estimate[j]) : 0.0);
  }
  fit.status = NormalEquationsFit::Status::refined;
  return fit;
}

}  // namespace

NormalEquationsFit normal_equations(RegressionSource& rows, const Eigen::VectorXd& weights) {
  RegressionBlock block;
  const Walk walk = [&](const std::function<void(const RegressionBlock&)>& visit) {
    rows.rewind();
    while (rows.next(block)) {
      visit(block);
    }
  };
  return solve(walk, rows.outputs(), rows.parameters(), weights);
}

NormalEquationsFit normal_equations(const RegressionBlock& rows, const Eigen::VectorXd& weights) {
  return solve([&](const std::function<void(const RegressionBlock&)>& visit) { visit(rows); }, rows.outputs,
               rows.parameters, weights);
}

}  // namespace wheelwright
