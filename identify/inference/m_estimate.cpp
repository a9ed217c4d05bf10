// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/robust.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <ceres/ceres.h>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::inference {

double tuning_constant(Loss loss) {
  switch (loss) {
    case Loss::huber: return 1.345;
    case Loss::cauchy: return 2.385;
    case Loss::tukey: return 4.685;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::rho(double u) const {
  const double value = root(u).value;
  return 0.5 * value * value;
}

double LossFunction::psi(double u) const { return u * weight(u); }

double LossFunction::psi_slope(double u) const {
  const double q = (u / c) * (u / c);
  switch (loss) {
    case Loss::huber: return q <= 1.0 ? 1.0 : 0.0;
    case Loss::cauchy: return (1.0 - q) / ((1.0 + q) * (1.0 + q));
    case Loss::tukey: return q < 1.0 ? (1.0 - q) * (1.0 - 5.0 * q) : 0.0;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::weight(double u) const {
  const double q = (u / c) * (u / c);
  switch (loss) {
    case Loss::huber: return q <= 1.0 ? 1.0 : c / std::abs(u);
    case Loss::cauchy: return 1.0 / (1.0 + q);
    case Loss::tukey: return q < 1.0 ? (1.0 - q) * (1.0 - q) : 0.0;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::half_weight() const {
  switch (loss) {
    case Loss::huber: return 2.0 * c;
    case Loss::cauchy: return c;
    case Loss::tukey: return c * std::sqrt(1.0 - std::sqrt(0.5));
    case Loss::squared: break;
  }
  return std::numeric_limits<double>::infinity();
}

LossFunction::Root LossFunction::root(double u) const {
  const double q = (u / c) * (u / c);
  Root r{u, 1.0};
  if (loss == Loss::huber && q > 1.0) {
    const double size = std::sqrt(c * (2.0 * std::abs(u) - c));
    r = {std::copysign(size, u), c / size};
  } else if (loss == Loss::cauchy && q > 0.0) {
    r.value = std::copysign(c * std::sqrt(std::log1p(q)), u);
    r.slope = u / (r.value * (1.0 + q));
  } else if (loss == Loss::tukey && q < 1.0) {
    const double share = std::sqrt(1.0 - q + q * q / 3.0);
    r = {u * share, (1.0 - q) * (1.0 - q) / share};
  } else if (loss == Loss::tukey) {
    r = {std::copysign(c / std::sqrt(3.0), u), 0.0};
  }
  return r;
}

namespace {

/// All rows at once: residual root((y − Y(θ0 + Tz))/s).
class Roots final : public ceres::CostFunction {
 public:
  Roots(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
        const Eigen::VectorXd& origin, const Eigen::MatrixXd& T)
      : loss_(loss), u_(rows.y - rows.Y * origin), slope_(-rows.Y * T) {
    for (Eigen::Index row = 0; row < u_.size(); ++row) {
      const double s = scales[row % scales.size()];
      u_[row] /= s;
      slope_.row(row) /= s;
    }
    set_num_residuals(static_cast<int>(u_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(T.cols()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::VectorXd> z(parameters[0], slope_.cols());
    const bool wanted = jacobians != nullptr && jacobians[0] != nullptr;
    for (Eigen::Index row = 0; row < u_.size(); ++row) {
      const LossFunction::Root root = loss_.root(u_[row] + slope_.row(row).dot(z));
      residuals[row] = root.value;
      if (wanted) {
        Eigen::Map<Eigen::RowVectorXd>(jacobians[0] + row * slope_.cols(), slope_.cols()) =
            root.slope * slope_.row(row);
      }
    }
    return true;
  }

 private:
  LossFunction loss_;
  Eigen::VectorXd u_;
  core::RowMatrix slope_;
};

/// θ = θ0 + Tz: columns of YT/s are orthonormal up to √N, directions without rows are left out.
Eigen::MatrixXd whitening(const RegressionBlock& rows, const Eigen::VectorXd& scales) {
  identify::LeastSquares gram(rows.parameters, scales.cwiseInverse());
  gram.add(rows);
  const identify::LeastSquaresFit fit = gram.solve();
  const Eigen::VectorXd rms = fit.column_rms.unaryExpr([](double r) { return r > 0.0 ? r : 1.0; });
  const Eigen::MatrixXd scaled =
      rms.asDiagonal() * fit.inverse_gram * rms.asDiagonal() * static_cast<double>(fit.instants);
  const core::EigenPairs eigen = core::symmetric_eigen(scaled);
  const Eigen::Index kept = fit.rank;
  return rms.cwiseInverse().asDiagonal() * eigen.vectors.rightCols(kept) *
         eigen.values.tail(kept).cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

MEstimate run(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
              const Eigen::VectorXd& origin, const Eigen::MatrixXd& T, const Eigen::VectorXd& lower,
              const Eigen::VectorXd& upper) {
  check::that(rows.instants() > 0 && static_cast<std::size_t>(scales.size()) == rows.outputs, "m-estimate",
              "rows, and a scale for each output");
  check::that((scales.array() > 0.0).all() && scales.allFinite(), "scales", "finite numbers > 0");
  check::that(origin.size() == rows.Y.cols() && origin.allFinite(), "start", "a finite value for each parameter");
  check::positive(loss.c, "tuning constant");
  if (T.cols() == 0) {
    return {origin, true, "no direction is determined by the rows"};
  }
  Eigen::VectorXd z = Eigen::VectorXd::Zero(T.cols());
  ceres::Problem problem;
  problem.AddParameterBlock(z.data(), static_cast<int>(z.size()));
  problem.AddResidualBlock(new Roots(rows, scales, loss, origin, T), nullptr, z.data());
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    if (std::isfinite(lower[j])) {
      problem.SetParameterLowerBound(z.data(), static_cast<int>(j), lower[j]);
    }
    if (std::isfinite(upper[j])) {
      problem.SetParameterUpperBound(z.data(), static_cast<int>(j), upper[j]);
    }
  }
  ceres::Solver::Options options;
  options.linear_solver_type = lower.size() == 0 ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.minimizer_progress_to_stdout = false;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  MEstimate result;
  result.theta = origin + T * z;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.message = summary.message;
  if (!result.theta.allFinite()) {
    result = {origin, false, "Ceres left the finite numbers: " + summary.message};
  }
  return result;
}

}  // namespace

MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                     const Eigen::VectorXd& start) {
  return run(rows, scales, loss, start, whitening(rows, scales), {}, {});
}

bool find_box(const std::vector<LinearConstraint>& constraints, Eigen::Index p, BoxCoordinates& box) {
  constexpr double parallel = 1e-12;
  Eigen::MatrixXd directions(0, p);
  std::vector<double> lower, upper;
  for (const LinearConstraint& constraint : constraints) {
    const double length = constraint.a.norm();
    const Eigen::RowVectorXd a = constraint.a.transpose() / length;
    Eigen::Index at = 0;
    double sign = 1.0;
    for (; at < directions.rows(); ++at) {
      sign = a.dot(directions.row(at)) < 0.0 ? -1.0 : 1.0;
      if ((a - sign * directions.row(at)).norm() <= parallel) {
        break;
      }
    }
    if (at == directions.rows()) {
      sign = 1.0;
      directions.conservativeResize(at + 1, Eigen::NoChange);
      directions.row(at) = a;
      lower.push_back(-core::kInfinity);
      upper.push_back(core::kInfinity);
    }
    const auto k = static_cast<std::size_t>(at);
    if (sign > 0.0) {
      upper[k] = std::min(upper[k], constraint.b / length);
    } else {
      lower[k] = std::max(lower[k], -constraint.b / length);
    }
  }
  const Eigen::Index m = directions.rows();
  if (m > p || m == 0) {
    return false;
  }
  for (std::size_t k = 0; k < lower.size(); ++k) {
    if (!(lower[k] < upper[k])) {
      return false;
    }
  }
  const core::PivotedQr qr(directions.transpose());
  if (qr.rank() < m) {
    return false;
  }
  const Eigen::MatrixXd Q = qr.Q();
  box.B.resize(p, p);
  box.B << directions, Q.rightCols(p - m).transpose();
  box.lower = Eigen::VectorXd::Constant(p, -core::kInfinity);
  box.upper = Eigen::VectorXd::Constant(p, core::kInfinity);
  for (Eigen::Index k = 0; k < m; ++k) {
    box.lower[k] = lower[static_cast<std::size_t>(k)];
    box.upper[k] = upper[static_cast<std::size_t>(k)];
  }
  return true;
}

MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                     const Eigen::VectorXd& start, const BoxCoordinates& box) {
  const Eigen::VectorXd z = (box.B * start).cwiseMax(box.lower).cwiseMin(box.upper);
  const core::PivotedQr B(box.B);
  const Eigen::VectorXd origin = B.solve(z);
  return run(rows, scales, loss, origin, B.inverse(), box.lower - z, box.upper - z);
}

}  // namespace wheelwright::inference
