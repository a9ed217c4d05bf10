// SPDX-License-Identifier: Apache-2.0
#include "core/linear_algebra.hpp"

#include <algorithm>

namespace wheelwright::core {

double rms(const Eigen::VectorXd& signal) {
  return signal.size() > 0 ? std::sqrt(signal.squaredNorm() / static_cast<double>(signal.size())) : 0.0;
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& square) { return square.inverse(); }

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A) { return A.completeOrthogonalDecomposition().pseudoInverse(); }

Eigen::MatrixXd minimum_norm_solution(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return A.completeOrthogonalDecomposition().solve(B);
}

Eigen::VectorXd least_squares_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

LuFactors::LuFactors(const Eigen::MatrixXd& square) : factors_(square) {}
Eigen::MatrixXd LuFactors::solve(const Eigen::MatrixXd& B) const { return factors_.solve(B); }
Eigen::VectorXd LuFactors::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }
Eigen::MatrixXd LuFactors::inverse() const { return factors_.inverse(); }
double LuFactors::reciprocal_condition() const { return factors_.rcond(); }

RankRevealingLu::RankRevealingLu(const Eigen::MatrixXd& square) : factors_(square) {}
bool RankRevealingLu::invertible() const { return factors_.isInvertible(); }
double RankRevealingLu::reciprocal_condition() const { return factors_.rcond(); }
Eigen::VectorXd RankRevealingLu::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }
Eigen::MatrixXd RankRevealingLu::inverse() const { return factors_.inverse(); }

LdltFactors::LdltFactors(const Eigen::MatrixXd& symmetric) : factors_(symmetric) {}
bool LdltFactors::positive() const { return factors_.isPositive(); }
double LdltFactors::reciprocal_condition() const { return factors_.info() == Eigen::Success ? factors_.rcond() : 0.0; }
Eigen::MatrixXd LdltFactors::solve(const Eigen::MatrixXd& B) const { return factors_.solve(B); }
Eigen::VectorXd LdltFactors::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }

CholeskyFactors::CholeskyFactors(const Eigen::MatrixXd& symmetric) : factors_(symmetric) {}
bool CholeskyFactors::positive() const { return factors_.info() == Eigen::Success; }
Eigen::VectorXd CholeskyFactors::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }
Eigen::MatrixXd CholeskyFactors::solve_lower(const Eigen::MatrixXd& B) const { return factors_.matrixL().solve(B); }

QrFactors::QrFactors(const Eigen::MatrixXd& A) : factors_(A) {}
Eigen::MatrixXd QrFactors::R() const {
  const Eigen::MatrixXd& qr = factors_.matrixQR();
  return qr.topRows(std::min(qr.rows(), qr.cols())).triangularView<Eigen::Upper>();
}
Eigen::MatrixXd QrFactors::Q() const { return factors_.householderQ(); }
Eigen::VectorXd QrFactors::rotate(const Eigen::VectorXd& b) const { return factors_.householderQ().adjoint() * b; }

void triangularize(Eigen::Ref<Eigen::MatrixXd> stack) {
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(stack);
  stack.triangularView<Eigen::StrictlyLower>().setZero();
}

PivotedQr::PivotedQr(const Eigen::MatrixXd& A, std::optional<double> threshold) {
  if (threshold) {
    factors_.setThreshold(*threshold);
  }
  factors_.compute(A);
}
Eigen::Index PivotedQr::rank() const { return factors_.rank(); }
Eigen::MatrixXd PivotedQr::Q() const { return factors_.householderQ(); }
Eigen::MatrixXd PivotedQr::Q(Eigen::Index columns) const {
  return factors_.householderQ() * Eigen::MatrixXd::Identity(factors_.rows(), columns);
}
Eigen::VectorXd PivotedQr::rotate(const Eigen::VectorXd& b) const { return factors_.householderQ().adjoint() * b; }
Eigen::VectorXd PivotedQr::rotate_back(const Eigen::VectorXd& b) const { return factors_.householderQ() * b; }
Eigen::MatrixXd PivotedQr::R(Eigen::Index size) const {
  return factors_.matrixR().topLeftCorner(size, size).triangularView<Eigen::Upper>();
}
const Eigen::VectorXi& PivotedQr::order() const { return factors_.colsPermutation().indices(); }
Eigen::VectorXd PivotedQr::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }
Eigen::MatrixXd PivotedQr::inverse() const { return factors_.inverse(); }

Eigen::MatrixXd solve_upper(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& B) {
  return upper.triangularView<Eigen::Upper>().solve(B);
}

Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& B) {
  return lower.triangularView<Eigen::Lower>().solve(B);
}

}  // namespace wheelwright::core
