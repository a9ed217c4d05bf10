// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/limit/consistency.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::bench {
namespace {

// What evaluating a weighted sum, and the running integrals behind a signature, can be wrong by, relative to the sum of
// absolute values: far above some thousand roundings.
constexpr double kRounding = 1e-11;
// Disturbances of an explanation stay this far inside their bounds, for the solver's tolerance.
constexpr double kInside = 1.0 - 1e-6;

// λᵀ of the equations, with the error bounds of its entries.
struct CombinedRow {
  Eigen::VectorXd y, error;
  double noise = 0.0;

  CombinedRow(const RawEquations& e, const Eigen::VectorXd& weights)
      : y(e.Y.transpose() * weights), error(Eigen::VectorXd::Zero(y.size())) {
    const auto response = [&](const ErrorSource& source) {
      double total = 0.0;
      for (const ErrorSource::Entry& entry : source.entries) {
        total += weights[static_cast<Eigen::Index>(entry.row)] * entry.weight;
      }
      return source.bound * std::abs(total) * (1.0 + kRounding);
    };
    for (const auto* sources : {&e.column, &e.function}) {
      for (const ErrorSource& source : *sources) {
        error[static_cast<Eigen::Index>(source.entries.front().parameter)] += response(source);
      }
    }
    for (const ErrorSource& source : e.effort) {
      noise += response(source);
    }
    error += kRounding * (e.Y.cwiseAbs().transpose() * weights.cwiseAbs());
  }
};

Eigen::VectorXd magnitudes(const core::RowMatrix& matrix, const Eigen::VectorXd& weights) {
  return matrix.cwiseAbs().transpose() * weights.cwiseAbs();
}

double support(const Polytope& set, const Eigen::VectorXd& a) {
  return set.support({a.data(), static_cast<std::size_t>(a.size())});
}

// max over P of aθ + Σ Δ_j |θ_j|, outward.
double reach(const Polytope& set, Eigen::VectorXd a, const Eigen::VectorXd& error) {
  double open = 0.0;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    const Interval side = set.hull().sides[static_cast<std::size_t>(j)];
    if (side.lower >= 0.0) {
      a[j] += error[j];
    } else {
      open += error[j] * std::max(std::abs(side.lower), side.upper);
    }
  }
  return support(set, a) + open * (1.0 + kRounding);
}

// The proof that weights λ give for a fault: by how much the least that the faulty robot shows exceeds the most that a
// healthy one can, rounding included; > 0 is a proof.
class Proof {
 public:
  Proof(const Polytope& set, const RawEquations& e, const detector::FaultSignals& sign, double side,
        const Eigen::VectorXd& largest, const Eigen::VectorXd& weights)
      : set_(&set),
        row_(e, weights),
        g1_(side * (sign.g1.transpose() * weights)),
        g2_(sign.g2.transpose() * weights),
        s_(side * (sign.s.transpose() * weights)),
        c_(side * sign.c.dot(weights)),
        rounding_(kRounding * largest.dot(magnitudes(e.Y, weights))),
        rounding1_(kRounding * (largest.dot(magnitudes(sign.g1, weights) + magnitudes(sign.s, weights)) +
                                sign.c.cwiseAbs().dot(weights.cwiseAbs()))),
        rounding2_(kRounding * largest.dot(magnitudes(sign.g2, weights))) {}

  [[nodiscard]] double excess(double kappa) const {
    const double rounding = 2.0 * (rounding_ + kappa * rounding1_ + kappa * kappa * rounding2_);
    const Eigen::VectorXd acting = row_.y + kappa * g1_ + kappa * kappa * g2_, seen = row_.y + kappa * s_;
    return -support(*set_, -acting) + kappa * c_ - reach(*set_, seen, 2.0 * row_.error) - 2.0 * row_.noise - rounding;
  }

  /// The smallest size that is proved together with all from there to `largest`, to a relative 1e-7, upwards.
  [[nodiscard]] std::optional<double> smallest(double largest) const {
    if (!(excess(largest) > 0.0)) {
      return std::nullopt;
    }
    double below = 0.0, above = largest;
    while (above - below > 1e-7 * above) {
      const double middle = 0.5 * (below + above);
      (excess(middle) > 0.0 ? above : below) = middle;
    }
    return above;
  }

 private:
  const Polytope* set_;
  CombinedRow row_;
  Eigen::VectorXd g1_, g2_, s_;
  double c_, rounding_, rounding1_, rounding2_;
};

}  // namespace

ConsistencyTest::ConsistencyTest(Model model, filter::Measurement measurement, filter::SensorErrors sensors,
                                 Polytope set, ConsistencyOptions options)
    : model_(std::move(model)),
      measurement_(std::move(measurement)),
      sensors_(sensors),
      options_(options),
      set_(std::move(set)) {
  model::validate(model_);
  check::non_negative(sensors_.motion, "motion error bound");
  check::non_negative(sensors_.effort, "effort error bound");
  check::non_negative(options_.before, "ConsistencyOptions::before");
  check::positive(options_.tolerance, "ConsistencyOptions::tolerance");
  check::that(set_.dimension() == model_.p(), "set", "a set of the model's parameters");
  largest_.resize(static_cast<Eigen::Index>(model_.p()));
  for (std::size_t j = 0; j < model_.p(); ++j) {
    const Interval side = set_.hull().sides[j];
    largest_[static_cast<Eigen::Index>(j)] = std::max(std::abs(side.lower), std::abs(side.upper));
  }
}

std::vector<Disturbance> ConsistencyTest::relaxed(const RawEquations& equations, double times) const {
  std::vector<Disturbance> all;
  const auto add = [&](const std::vector<ErrorSource>& sources, bool motion) {
    for (const ErrorSource& source : sources) {
      Disturbance& to = all.emplace_back();
      const std::size_t j = source.entries.front().parameter;
      const bool by_theta = motion && set_.hull().sides[j].lower >= 0.0;
      const double unit = times * source.bound * (motion && !by_theta ? largest_[static_cast<Eigen::Index>(j)] : 1.0);
      to.parameter = by_theta ? j : Disturbance::kNone;
      for (const ErrorSource::Entry& entry : source.entries) {
        to.entries.emplace_back(entry.row, unit * entry.weight);
      }
    }
  };
  add(equations.column, true);
  add(equations.function, true);
  add(equations.effort, false);
  return all;
}

std::vector<Disturbance> ConsistencyTest::exact(const RawEquations& equations, const Eigen::VectorXd& theta,
                                                double times) const {
  std::vector<Disturbance> all;
  const auto add = [&](const std::vector<ErrorSource>& sources, bool motion) {
    for (const ErrorSource& source : sources) {
      Disturbance& to = all.emplace_back();
      for (const ErrorSource::Entry& entry : source.entries) {
        const double weight = times * kInside * source.bound * entry.weight *
                              (motion ? theta[static_cast<Eigen::Index>(entry.parameter)] : 1.0);
        const auto same =
            std::find_if(to.entries.begin(), to.entries.end(), [&](const auto& e) { return e.first == entry.row; });
        if (same == to.entries.end()) {
          to.entries.emplace_back(entry.row, weight);
        } else {
          same->second += weight;
        }
      }
    }
  };
  add(equations.joint, true);
  add(equations.effort, false);
  return all;
}

Consistency ConsistencyTest::consistent(const detector::ReferenceMotion& motion, const Eigen::MatrixXd& effort,
                                        std::size_t first, std::size_t last) {
  const RawEquations e = raw_equations(model_, measurement_, sensors_, motion, first, last);
  const Eigen::VectorXd u = raw_efforts(e, model_, measurement_, motion, effort);
  const auto p = static_cast<Eigen::Index>(model_.p());
  const Eigen::Map<const Eigen::VectorXd> centre(set_.centre().data(), p);
  SeparationSolver solver;
  const Separation found =
      solver.solve({.set = &set_, .healthy = &e.Y, .disturbances = relaxed(e, 1.0), .deviation = u - e.Y * centre});
  Consistency result;
  if (!found.solved) {
    return result;
  }
  result.unexplained = found.share;
  result.theta = found.theta;
  result.weights = found.weights;
  const CombinedRow row(e, found.weights);
  const double rounding =
      2.0 * kRounding * (u.cwiseAbs().dot(found.weights.cwiseAbs()) + largest_.dot(magnitudes(e.Y, found.weights)));
  const double shown = found.weights.dot(u);
  result.refuted = shown - row.noise - rounding > reach(set_, row.y, row.error) ||
                   -shown - row.noise - rounding > reach(set_, -row.y, row.error);
  return result;
}

DetectableSize ConsistencyTest::smallest_detectable(const detector::ReferenceMotion& motion, const FaultType& fault,
                                                    double side, std::size_t onset, double window) {
  check::that(side == 1.0 || side == -1.0, "side", "1 or −1");
  check::that(onset < motion.instants(), "onset", "an instant of the motion");
  const auto next = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), onset);
  const std::size_t end = next == motion.segment_starts.end() ? motion.instants() : *next;
  std::size_t first = onset, last = onset;
  while (first > *(next - 1) && motion.t[onset] - motion.t[first - 1] <= options_.before) {
    --first;
  }
  while (last + 1 < end && motion.t[last + 1] - motion.t[onset] <= window) {
    ++last;
  }
  check::that(last > onset, "window", "at least one sampling interval of the segment");
  const RawEquations e = raw_equations(model_, measurement_, sensors_, motion, first, last);
  const detector::FaultSignals sign = raw_signature(e, fault, model_, motion, onset);
  const auto p = static_cast<Eigen::Index>(model_.p());
  const Eigen::Map<const Eigen::VectorXd> centre(set_.centre().data(), p);

  SeparationSolver descent, explanation;
  const auto separate = [&](SeparationSolver& solver, double kappa, std::vector<Disturbance> disturbances,
                            const Eigen::VectorXd* member) {
    const double k = side * kappa;
    const core::RowMatrix healthy = e.Y + k * sign.s, faulty = e.Y + k * sign.g1 + k * k * sign.g2;
    SeparationProblem problem{.set = &set_,
                              .healthy = &healthy,
                              .faulty = &faulty,
                              .disturbances = std::move(disturbances),
                              .deviation = (faulty - healthy) * centre + k * sign.c};
    if (member) {
      problem.fixed = true;
      problem.member = *member;
    }
    return problem.deviation.isZero(0.0) ? Separation{} : solver.solve(problem);
  };

  DetectableSize result;
  const double largest = std::abs(fault.kappa(side > 0.0 ? fault.range.upper : fault.range.lower));
  const auto size_of = [&](double kappa) { return std::abs(fault.magnitude(side * kappa)); };
  double kappa = largest;
  Eigen::VectorXd member = centre;
  for (std::size_t step = 0; step < options_.most_steps; ++step) {
    const Separation found = separate(descent, kappa, relaxed(e, 2.0), nullptr);
    if (!found.solved) {
      break;
    }
    member = found.theta;
    // λ or −λ: the solver's sign of a dual is its own affair.
    std::optional<double> proved;
    Eigen::VectorXd weights;
    for (const double sense : {1.0, -1.0}) {
      const Proof proof(set_, e, sign, side, largest_, sense * found.weights);
      const std::optional<double> size =
          fault.whole ? (proof.excess(kappa) > 0.0 ? std::optional(kappa) : std::nullopt) : proof.smallest(kappa);
      if (size && (!proved || *size < *proved)) {
        proved = size;
        weights = sense * found.weights;
      }
    }
    if (!proved) {
      break;
    }
    result.upper = size_of(*proved);
    result.weights = weights;
    const bool ends = fault.whole || kappa - *proved <= options_.tolerance * kappa;
    kappa = *proved;
    if (ends || kappa <= 0.0) {
      break;
    }
  }
  // An explanation as near to that as can be found.
  double tried = std::isfinite(result.upper) ? kappa * (1.0 - options_.tolerance) : largest;
  for (int attempt = 0; attempt < (fault.whole ? 1 : 6) && tried > 0.0; ++attempt) {
    const Separation found = separate(explanation, tried, exact(e, member, 2.0), &member);
    if (found.solved && found.share <= 0.0) {
      result.lower = size_of(tried);
      break;
    }
    tried *= found.solved ? (1.0 - found.share) * (1.0 - options_.tolerance) : 0.5;
  }
  result.programs = descent.programs() + explanation.programs();
  return result;
}

}  // namespace wheelwright::bench
