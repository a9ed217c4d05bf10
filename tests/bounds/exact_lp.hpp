// SPDX-License-Identifier: Apache-2.0
/// \file
/// Adversarial problems for feasible_set() and what is to be held against their exact optima; for exact_lp_test.cpp and
/// for the long study exact_lp_study.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "tests/bounds/qsopt_oracle.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::exact_lp {

using testing_rows::Random;

/// Kind of difficulty of a problem.
enum class Family {
  random,        ///< entries of Y uniform on [−1, 1]
  collinear,     ///< columns that differ by 1e-7 of the first
  scales,        ///< columns from 1e-6 to 1e6
  quantised,     ///< clipped and quantised Y and y: many facets through one vertex
  nearly_empty,  ///< ē = ē*(1 + 1e-9), ē* the exact minimax fit
  short_log,     ///< fewer rows than parameters, or two equal columns: the prior's sides are bounds
  turning,       ///< slowly turning rows: neighbours are nearly equal
};
inline constexpr std::array families{Family::random,       Family::collinear, Family::scales, Family::quantised,
                                     Family::nearly_empty, Family::short_log, Family::turning};

inline const char* name_of(Family family) {
  switch (family) {
    case Family::random: return "random";
    case Family::collinear: return "collinear";
    case Family::scales: return "scales";
    case Family::quantised: return "quantised";
    case Family::nearly_empty: return "nearly empty";
    case Family::short_log: return "short log";
    case Family::turning: return "turning";
  }
  return "";
}

/// A problem: its set is not empty, and dY = 0.
struct Problem {
  RegressionBlock rows;
  Box prior;
};

/// A problem of tens of rows to some hundred, the same for the same arguments.
inline Problem problem(Family family, std::size_t p, std::uint64_t seed) {
  Random random(0x9e3779b97f4a7c15U * (seed + 1) + 97U * p + static_cast<std::uint64_t>(family));
  const std::size_t count = family == Family::short_log && seed % 2 == 0
                                ? std::max<std::size_t>(1, p - 1 - seed / 2 % std::max<std::size_t>(1, p / 2))
                                : 3 * p + 5 + static_cast<std::size_t>(random.unit() * 7.0 * static_cast<double>(p));
  std::vector<double> truth = random.vector(p), scale(p, 1.0), phase = random.vector(p), last(p);
  Box prior = testing_rows::cube(p, 64.0);
  double noise = 0.25 * std::pow(10.0, -3.0 * random.unit());
  if (family == Family::scales) {
    for (std::size_t j = 0; j < p; ++j) {
      scale[j] = std::pow(10.0, 6.0 * random.symmetric());
      truth[j] /= scale[j];
      prior.sides[j] = {-64.0 / scale[j], 64.0 / scale[j]};
    }
  } else if (family == Family::quantised) {
    for (double& value : truth) {
      value = std::round(4.0 * value) / 4.0;
    }
    noise = 0.5;
  }
  testing_rows::Rows rows(p);
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<double> Y = random.vector(p);
    double y = 0.0;
    for (std::size_t j = 0; j < p; ++j) {
      const double u = Y[j];
      if (family == Family::collinear && j > 0) {
        Y[j] = Y[0] * (1.0 + 1e-7 * u);
      } else if (family == Family::quantised) {
        Y[j] = std::clamp(std::round(8.0 * u) / 4.0, -1.0, 1.0);
      } else if (family == Family::turning) {
        Y[j] = std::sin(0.02 * static_cast<double>(k * (j + 1)) + 3.0 * phase[j]) + 1e-4 * u;
      } else if (family == Family::short_log && seed % 2 == 1 && j > 0 && j + 1 == p) {
        Y[j] = Y[0];
      }
      Y[j] *= scale[j];
      y += Y[j] * truth[j];
    }
    y += 0.999 * noise * random.symmetric();
    if (family == Family::quantised) {
      y = std::round(8.0 * y) / 8.0;  // wrong by 1/16 more at most
    }
    rows.add(Y, y, family == Family::quantised ? 0.625 : noise);
  }
  Problem result{rows.block(0, count), prior};
  if (family == Family::nearly_empty) {
    const double least = qsopt::exact_minimax(result.rows, prior, 1.0).get_d();
    result.rows.dy.setConstant(least * (1.0 + 1e-9) + std::numeric_limits<double>::denorm_min());
  }
  return result;
}

/// The problem with every bound widened by what rounding may make of its row: 8ε(|y| + ē + Σ_j |Y_j| max|θ_j|). A
/// published value that this set reaches is the exact one of data that a double cannot tell from those given.
inline Problem rounded(Problem problem) {
  for (Eigen::Index r = 0; r < problem.rows.rows(); ++r) {
    double size = std::abs(problem.rows.y[r]) + problem.rows.dy[r];
    for (std::size_t j = 0; j < problem.prior.dimension(); ++j) {
      size += std::abs(problem.rows.Y(r, static_cast<Eigen::Index>(j))) * core::magnitude(problem.prior.sides[j]);
    }
    problem.rows.dy[r] += 8.0 * std::numeric_limits<double>::epsilon() * size;
  }
  return problem;
}

/// Published against exact, of one problem. Every value has to be no further out than 1e-9 of the exact width and a
/// unit in its last place. Where a set is a sliver, which nearly_empty problems alone are, rounding of the data is more
/// than that: there every value has to be reached by rounded() data.
struct Verdict {
  bool empty = false;        ///< proved empty by the library, and not so exactly: a failure
  std::size_t compared = 0;  ///< bounds and values of the support function
  std::size_t inside = 0;    ///< that lie inside the exact one: a failure, with zero tolerance
  std::size_t sliver = 0;    ///< further out than 1e-9 of the width and a unit, but reached by rounded data
  std::size_t loose = 0;     ///< further out, and not reached: a failure
  double worst = 0.0;        ///< largest excess over the width, of those that are neither
  std::string worst_at;      ///< where
};

/// Holds every bound of the hull, and the support function in `trials` random directions and along as many rows,
/// against the exact ones.
inline Verdict judge(const Problem& problem, std::uint64_t seed, std::size_t trials) {
  const std::size_t p = problem.prior.dimension();
  Verdict verdict;
  core::RegressionTable table(problem.rows);
  const FeasibleSet set = feasible_set(table, problem.prior);
  qsopt::ExactProgram exact = qsopt::exact_set(problem.rows, problem.prior);
  std::optional<qsopt::ExactProgram> widened;

  const auto compare = [&](double published_low, double published_high, const std::vector<mpq_class>& a,
                           const std::string& where) {
    std::vector<mpq_class> opposite = a;
    for (mpq_class& x : opposite) {
      x = -x;
    }
    const std::optional<mpq_class> high = exact.maximise(a), low = exact.maximise(opposite);
    if (!high || !low) {
      throw std::runtime_error("the problem is empty");
    }
    const mpq_class width = *high + *low;
    const auto one = [&](double published, const std::vector<mpq_class>& direction, const mpq_class& value,
                         const char* side) {
      ++verdict.compared;
      const mpq_class excess = mpq_class(published) - value;
      verdict.inside += excess < 0;
      const mpq_class unit = mpq_class(std::nextafter(std::abs(published), HUGE_VAL)) - mpq_class(std::abs(published));
      if ((excess - unit) * 1000000000 > width) {
        if (!widened) {
          const Problem wide = rounded(problem);
          widened.emplace(qsopt::exact_set(wide.rows, wide.prior));
        }
        const bool reached = mpq_class(published) - unit <= widened->maximise(direction).value();
        ++(reached ? verdict.sliver : verdict.loose);
      } else if (width > 0 && mpq_class(excess / width).get_d() > verdict.worst) {
        verdict.worst = mpq_class(excess / width).get_d();
        verdict.worst_at = where + side;
      }
    };
    one(-published_low, opposite, *low, ", low");
    one(published_high, a, *high, ", high");
  };

  if (set.status == FeasibleSet::Status::empty) {
    verdict.empty = exact.maximise(std::vector<mpq_class>(p, 0)).has_value();
    return verdict;
  }
  for (std::size_t j = 0; j < p; ++j) {
    std::vector<mpq_class> axis(p, 0);
    axis[j] = 1;
    compare(set.hull.sides[j].lower, set.hull.sides[j].upper, axis, "hull " + std::to_string(j));
  }
  Random random(seed);
  for (std::size_t trial = 0; trial < 2 * trials; ++trial) {
    std::vector<double> a(p), opposite(p);
    const auto row = static_cast<Eigen::Index>(random.unit() * static_cast<double>(problem.rows.rows()));
    for (std::size_t j = 0; j < p; ++j) {
      const double scale = problem.prior.sides[j].upper;
      a[j] = trial % 2 == 0 ? random.symmetric() / scale : problem.rows.Y(row, static_cast<Eigen::Index>(j));
      opposite[j] = -a[j];
    }
    compare(-set.polytope->support(opposite), set.polytope->support(a), qsopt::rationals(a),
            "support " + std::to_string(trial));
  }
  return verdict;
}

/// Verdicts of many problems.
struct Tally {
  std::size_t problems = 0, compared = 0;
  std::size_t empty = 0, inside = 0;  ///< problems: see Verdict
  std::size_t slivers = 0;            ///< nearly_empty problems with a value that only rounded data reach
  std::size_t loose = 0;              ///< problems with a loose value, or with one of a sliver that they are not
  double worst = 0.0;                 ///< largest excess over the width, slivers apart
  std::string worst_at, failures;     ///< where

  void add(const Verdict& verdict, Family family, const std::string& where) {
    const bool fails = verdict.loose > 0 || (verdict.sliver > 0 && family != Family::nearly_empty);
    ++problems;
    compared += verdict.compared;
    empty += verdict.empty;
    inside += verdict.inside > 0;
    slivers += verdict.sliver > 0 && family == Family::nearly_empty;
    loose += fails;
    if (verdict.worst > worst) {
      worst = verdict.worst;
      worst_at = where + ", " + verdict.worst_at;
    }
    if (verdict.empty || verdict.inside > 0 || fails) {
      failures +=
          fmt::format("  {}: called empty {}, inside {}, loose {}, of a sliver {}, worst {:.2g} at {}\n", where,
                      verdict.empty, verdict.inside, verdict.loose, verdict.sliver, verdict.worst, verdict.worst_at);
    }
  }
};

/// One line of numbers.
inline std::string summary(const Tally& t) {
  return fmt::format(
      "{:>5} problems, {:>6} values: inside {}, called empty {}, loose {}, slivers {}; worst excess {:.2g} of the "
      "width ({})",
      t.problems, t.compared, t.inside, t.empty, t.loose, t.slivers, t.worst, t.worst_at);
}

/// Judges one problem and adds it to the tally.
inline void judge_one(Tally& tally, Family family, std::size_t p, std::uint64_t seed, std::size_t trials) {
  tally.add(judge(problem(family, p, seed), seed, trials), family,
            fmt::format("{}, p {}, seed {}", name_of(family), p, seed));
}

}  // namespace wheelwright::bounds::exact_lp
