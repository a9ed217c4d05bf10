// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/limit/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "core/check.hpp"
#include "tests/benchmarks/limit/raw_equations.hpp"

namespace wheelwright::bench {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// C of the equations' errors.
Sparse covariance(const RawEquations& e, const Eigen::VectorXd& theta) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index sources = 0;
  const auto add = [&](const std::vector<ErrorSource>& errors, bool motion) {
    for (const ErrorSource& source : errors) {
      for (const ErrorSource::Entry& entry : source.entries) {
        const double by = motion ? theta[static_cast<Eigen::Index>(entry.parameter)] : 1.0;
        entries.emplace_back(static_cast<Eigen::Index>(entry.row), sources, source.bound * by * entry.weight);
      }
      ++sources;
    }
  };
  add(e.joint, true);
  add(e.effort, false);
  Sparse root(static_cast<Eigen::Index>(e.rows()), sources);
  root.setFromTriplets(entries.begin(), entries.end());
  return root * Sparse(root.transpose());
}

}  // namespace

double upper_quantile(double risk) {
  check::that(risk > 0.0 && risk < 0.5, "risk", "in (0, 1/2)");
  double below = 0.0, above = 40.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (below + above);
    (0.5 * std::erfc(middle / std::numbers::sqrt2) > risk ? below : above) = middle;
  }
  return above;
}

double likelihood_limit(const Model& model, const filter::Measurement& measurement,
                        const filter::SensorErrors& deviations, const Eigen::VectorXd& theta,
                        const detector::ReferenceMotion& motion, const model::FaultType& fault, double side,
                        std::size_t onset, const LikelihoodQuestion& question) {
  check::that(side == 1.0 || side == -1.0, "side", "1 or −1");
  check::that(onset < motion.instants(), "onset", "an instant of the motion");
  const auto next = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), onset);
  const std::size_t end = next == motion.segment_starts.end() ? motion.instants() : *next;
  // The equation at an instant holds the sample before it.
  std::size_t first = onset, last = onset;
  while (first > *(next - 1) + 1 && motion.t[onset] - motion.t[first - 1] <= question.before) {
    --first;
  }
  while (last + 1 < end && motion.t[last + 1] - motion.t[onset] <= question.window) {
    ++last;
  }
  check::that(last > onset, "window", "at least one sampling interval of the segment");
  const RawEquations e = raw_equations(model, measurement, deviations, motion, first, last);
  const detector::FaultSignals sign = raw_signature(e, fault, model, motion, onset);
  const Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> solver(covariance(e, theta));
  check::that(solver.info() == Eigen::Success, "deviations", "errors in all equations");
  const Eigen::VectorXd linear = side * ((sign.g1 - sign.s) * theta + sign.c), square = sign.g2 * theta;
  const Eigen::VectorXd weights = solver.solve(linear);
  const double a = linear.dot(weights), b = 2.0 * square.dot(weights), c = square.dot(solver.solve(square));
  const double z = upper_quantile(question.risk);
  double below = 0.0, above = std::abs(fault.kappa(side > 0.0 ? fault.range.upper : fault.range.lower));
  const auto seen = [&](double kappa) { return kappa * kappa * (a + kappa * (b + kappa * c)) >= z * z; };
  if (!seen(above)) {
    return std::numeric_limits<double>::infinity();
  }
  while (above - below > 1e-9 * above) {
    const double middle = 0.5 * (below + above);
    (seen(middle) ? above : below) = middle;
  }
  return std::abs(fault.magnitude(side * above));
}

}  // namespace wheelwright::bench
