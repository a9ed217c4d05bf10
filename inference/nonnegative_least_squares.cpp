// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/nonnegative_least_squares.hpp>

#include <limits>
#include <vector>

#include <Eigen/QR>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

struct ActiveSet {
  const Eigen::MatrixXd& E;
  const Eigen::VectorXd& f;
  Eigen::VectorXd x;
  std::vector<Eigen::Index> free;  // columns with x > 0

  /// The unconstrained solution in the free columns; empty where they are dependent.
  [[nodiscard]] Eigen::VectorXd solve() const {
    if (free.empty()) {
      return {};
    }
    const auto qr = E(Eigen::all, free).colPivHouseholderQr();
    return qr.rank() == static_cast<Eigen::Index>(free.size()) ? qr.solve(f) : Eigen::VectorXd();
  }

  /// Moves towards `target` until an entry reaches 0, which leaves the free columns.
  void move(const Eigen::VectorXd& target) {
    double step = 1.0;
    std::size_t blocking = free.size();
    for (std::size_t k = 0; k < free.size(); ++k) {
      const double now = x[free[k]], then = target[static_cast<Eigen::Index>(k)];
      if (then <= 0.0 && now / (now - then) < step) {
        step = now / (now - then);
        blocking = k;
      }
    }
    for (std::size_t k = 0; k < free.size(); ++k) {
      x[free[k]] += step * (target[static_cast<Eigen::Index>(k)] - x[free[k]]);
    }
    for (std::size_t k = free.size(); k-- > 0;) {
      if (k == blocking || !(x[free[k]] > 0.0)) {
        x[free[k]] = 0.0;
        free.erase(free.begin() + static_cast<std::ptrdiff_t>(k));
      }
    }
  }
};

}  // namespace

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& E, const Eigen::VectorXd& f) {
  check::that(E.rows() == f.size() && E.allFinite() && f.allFinite(), "non-negative least squares",
              "a finite right side with a value for each row of the matrix");
  ActiveSet set{E, f, Eigen::VectorXd::Zero(E.cols()), {}};
  const double tolerance = 64.0 * std::numeric_limits<double>::epsilon() * E.colwise().norm().maxCoeff() * f.norm();
  std::vector<bool> barred(static_cast<std::size_t>(E.cols()), false);
  // Each round ends with a smaller misfit, so that no set of free columns comes back; the limit stops rounding only.
  for (Eigen::Index round = 0; round < 64 * (E.cols() + 1); ++round) {
    const Eigen::VectorXd slope = E.transpose() * (f - E * set.x);
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < E.cols(); ++j) {
      if (!(set.x[j] > 0.0) && !barred[static_cast<std::size_t>(j)] && slope[j] > tolerance &&
          (best < 0 || slope[j] > slope[best])) {
        best = j;
      }
    }
    if (best < 0) {
      break;
    }
    set.free.push_back(best);
    Eigen::VectorXd target = set.solve();
    // A column that cannot move forward is a matter of rounding (or depends on the free ones): not again until x moves.
    if (target.size() == 0 || !(target[target.size() - 1] > 0.0)) {
      set.free.pop_back();
      barred[static_cast<std::size_t>(best)] = true;
      continue;
    }
    barred.assign(barred.size(), false);
    while (!set.free.empty() && !(target.array() > 0.0).all()) {
      set.move(target);
      target = set.solve();
    }
    for (std::size_t k = 0; k < set.free.size(); ++k) {
      set.x[set.free[k]] = target[static_cast<Eigen::Index>(k)];
    }
  }
  return set.x;
}

}  // namespace wheelwright
