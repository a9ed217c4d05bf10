// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "core/linear_algebra.hpp"

namespace wheelwright::core {

EigenPairs symmetric_eigen(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

std::optional<Eigen::VectorXd> generalized_eigenvalues(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  if (!CholeskyFactors(B).positive()) {
    return std::nullopt;
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(A, B, Eigen::EigenvaluesOnly);
  return solver.info() == Eigen::Success ? std::optional(solver.eigenvalues()) : std::nullopt;
}

SingularValues singular_values(const Eigen::MatrixXd& A) {
  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::FullPivHouseholderQRPreconditioner> svd(
      A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

}  // namespace wheelwright::core
