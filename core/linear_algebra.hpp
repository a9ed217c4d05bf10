// SPDX-License-Identifier: Apache-2.0
/// \file
/// Dense decompositions of small matrices, compiled once: the other modules see declarations, not Eigen's templates.
///
/// Sizes that do not fit each other are programming errors, as in Eigen. A matrix that is not finite gives results that
/// are not finite. References: Golub and Van Loan, Matrix Computations, 4th ed., chapters 3, 5 and 8.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/QR>

#include <optional>

namespace wheelwright::core {

/// Root mean square of the entries; 0 where there are none.
[[nodiscard]] double rms(const Eigen::VectorXd& signal);

/// Eigenvalues in ascending order and their eigenvectors, one a column.
struct EigenPairs {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// Of a symmetric matrix, whose lower triangle is read; the vectors are orthonormal.
[[nodiscard]] EigenPairs symmetric_eigen(const Eigen::MatrixXd& symmetric);

/// Eigenvalues of the pencil A v = λ B v with A symmetric and B positive definite; nothing where B is not, or rounding
/// hides it.
[[nodiscard]] std::optional<Eigen::VectorXd> generalized_eigenvalues(const Eigen::MatrixXd& A,
                                                                     const Eigen::MatrixXd& B);

/// A = U diag(values) Vᵀ with square U and V; the values descend.
struct SingularValues {
  Eigen::MatrixXd U, V;
  Eigen::VectorXd values;
};

/// By Jacobi's method after QR with pivoting of rows and columns. Every value is right to the rounding of the largest.
[[nodiscard]] SingularValues singular_values(const Eigen::MatrixXd& A);

/// The inverse by LU with partial pivoting; not finite where the matrix is singular.
[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::MatrixXd& square);

/// The Moore-Penrose inverse by a complete orthogonal decomposition of the rank that rounding leaves.
[[nodiscard]] Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

/// The least-squares solution of AX = B that has the smallest norm, by a complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd minimum_norm_solution(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// A least-squares solution of Ax = b by QR with column pivoting; what the rank leaves open is 0.
[[nodiscard]] Eigen::VectorXd least_squares_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// LU factors with partial pivoting of a square matrix.
class LuFactors {
 public:
  explicit LuFactors(const Eigen::MatrixXd& square);
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  [[nodiscard]] Eigen::MatrixXd inverse() const;
  /// An estimate of the reciprocal of the condition number in the 1-norm.
  [[nodiscard]] double reciprocal_condition() const;

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
};

/// LU factors with full pivoting: they tell whether the matrix is regular, up to rounding.
class RankRevealingLu {
 public:
  explicit RankRevealingLu(const Eigen::MatrixXd& square);
  [[nodiscard]] bool invertible() const;
  /// An estimate, as LuFactors'.
  [[nodiscard]] double reciprocal_condition() const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  [[nodiscard]] Eigen::MatrixXd inverse() const;

 private:
  Eigen::FullPivLU<Eigen::MatrixXd> factors_;
};

/// LDLᵀ factors with pivoting of a symmetric matrix, whose lower triangle is read.
class LdltFactors {
 public:
  explicit LdltFactors(const Eigen::MatrixXd& symmetric);
  /// No eigenvalue is negative.
  [[nodiscard]] bool positive() const;
  /// 0 where the factorization failed.
  [[nodiscard]] double reciprocal_condition() const;
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factors_;
};

/// Cholesky's factors A = LLᵀ of a symmetric matrix, whose lower triangle is read.
class CholeskyFactors {
 public:
  explicit CholeskyFactors(const Eigen::MatrixXd& symmetric);
  /// The matrix is positive definite, up to rounding; without that there is nothing to solve.
  [[nodiscard]] bool positive() const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  /// L⁻¹B
  [[nodiscard]] Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& B) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

/// Q and R of A, by Householder reflections.
class QrFactors {
 public:
  explicit QrFactors(const Eigen::MatrixXd& A);
  /// The upper triangle: as many rows as A, or columns, whichever is less.
  [[nodiscard]] Eigen::MatrixXd R() const;
  /// The whole of Q, square.
  [[nodiscard]] Eigen::MatrixXd Q() const;
  /// Qᵀb
  [[nodiscard]] Eigen::VectorXd rotate(const Eigen::VectorXd& b) const;

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> factors_;
};

/// The same in place: the upper triangle of `stack` becomes R, what is below it 0. No more columns than rows.
void triangularize(Eigen::Ref<Eigen::MatrixXd> stack);

/// Q, R and P of A P = Q R, by Householder reflections with column pivoting: they tell the rank.
class PivotedQr {
 public:
  PivotedQr() = default;
  /// Diagonal entries of R below `threshold` times the largest count as 0; by default what rounding leaves.
  explicit PivotedQr(const Eigen::MatrixXd& A, std::optional<double> threshold = {});
  [[nodiscard]] Eigen::Index rank() const;
  /// The whole of Q, square.
  [[nodiscard]] Eigen::MatrixXd Q() const;
  /// The first `columns` columns of Q.
  [[nodiscard]] Eigen::MatrixXd Q(Eigen::Index columns) const;
  /// Qᵀb and Qb
  [[nodiscard]] Eigen::VectorXd rotate(const Eigen::VectorXd& b) const;
  [[nodiscard]] Eigen::VectorXd rotate_back(const Eigen::VectorXd& b) const;
  /// The upper triangle of the first `size` rows and columns of R.
  [[nodiscard]] Eigen::MatrixXd R(Eigen::Index size) const;
  /// Column k of AP is column order()[k] of A.
  [[nodiscard]] const Eigen::VectorXi& order() const;
  /// A least-squares solution; what the rank leaves open is 0.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  /// Of a square matrix.
  [[nodiscard]] Eigen::MatrixXd inverse() const;

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors_;
};

/// Solutions of triangular systems TX = B, whose other triangle is not read.
[[nodiscard]] Eigen::MatrixXd solve_upper(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& B);
[[nodiscard]] Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& B);

}  // namespace wheelwright::core
