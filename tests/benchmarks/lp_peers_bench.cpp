// SPDX-License-Identifier: Apache-2.0
// The peers of bounds/ alone, next to a bare read of the columns: how long an able user of CLP or GLPK waits. Before
// any time is taken, all of them have to agree on small problems.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "core/error.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/drive_rows.hpp"
#include "tests/benchmarks/lp_peers.hpp"

namespace wheelwright::bench::lp_peers_bench {
namespace {

constexpr double agreement = 1e-6;  // of the width, or of γ

struct Kind {
  RowNoise noise;
  const char* letter;
};
constexpr Kind kinds[] = {{RowNoise::uniform, "u"}, {RowNoise::gaussian, "g"}, {RowNoise::coloured, "s"}};

void require_equal(double x, double y, double width, const std::string& what) {
  if (!(std::abs(x - y) <= agreement * width)) {
    throw Error(fmt::format("peers disagree: {}: {:.17g} and {:.17g}, width {:.3g}", what, x, y, width));
  }
}

void require_equal(const Box& x, const Box& y, const std::string& what) {
  for (std::size_t j = 0; j < x.sides.size(); ++j) {
    const double width = x.sides[j].upper - x.sides[j].lower;
    require_equal(x.sides[j].lower, y.sides[j].lower, width, fmt::format("{}, lower {}", what, j));
    require_equal(x.sides[j].upper, y.sides[j].upper, width, fmt::format("{}, upper {}", what, j));
  }
}

/// Every row as two half-spaces, and the sides of the prior box.
Facets half_spaces(const DriveRows& rows) {
  Facets facets{0, rows.p, {}, {}};
  const auto add = [&](const std::function<double(std::size_t)>& a, double b) {
    for (std::size_t j = 0; j < rows.p; ++j) {
      facets.a.push_back(a(j));
    }
    facets.b.push_back(b);
    ++facets.m;
  };
  for (const double side : {1.0, -1.0}) {
    for (std::size_t i = 0; i < rows.n; ++i) {
      add([&](std::size_t j) { return side * rows.column(j)[i]; }, side * rows.y[i] + rows.dy[i]);
    }
    for (std::size_t k = 0; k < rows.p; ++k) {
      add([&](std::size_t j) { return j == k ? side : 0.0; },
          side > 0.0 ? rows.prior.sides[k].upper : -rows.prior.sides[k].lower);
    }
  }
  return facets;
}

Facets facets_of(const Polytope& polytope) {
  Facets facets{polytope.facets().size(), polytope.dimension(), {}, {}};
  for (const bounds::HalfSpace& facet : polytope.facets()) {
    facets.a.insert(facets.a.end(), facet.a.begin(), facet.a.end());
    facets.b.push_back(facet.b);
  }
  return facets;
}

/// Throws Error where two peers differ on a small problem.
void check_peers() {
  for (const std::size_t p : {4, 6, 8, 12}) {
    for (const Kind& kind : kinds) {
      const DriveRows rows = drive_rows(2000, p, kind.noise, p);
      const std::string what = fmt::format("{} p {}", kind.letter, p);
      const Box hull = clp_hull(rows)();
      for (std::size_t j = 0; j < p; ++j) {
        if (!hull.sides[j].contains(rows.truth[j])) {
          throw Error(fmt::format("peers: {}: the hull misses the truth of parameter {}", what, j));
        }
      }
      require_equal(hull, clp_loop(rows)().hull, what + ", clp and the loop");
      const double gamma = clp_minimax(rows)();
      const Facets facets = half_spaces(rows);
      std::vector<double> along = directions(rows, 200);
      const std::size_t count = along.size();
      for (std::size_t k = 0; k < count; ++k) {
        along.push_back(-along[k]);
      }
      const std::vector<double> support = clp_support(facets)(along);
      // The hull is the support function along the axes.
      std::vector<double> axes(2 * p * p, 0.0);
      for (std::size_t j = 0; j < p; ++j) {
        axes[2 * j * p + j] = -1.0;
        axes[(2 * j + 1) * p + j] = 1.0;
      }
      const std::vector<double> sides = clp_support(facets)(axes);
      Box by_support;
      for (std::size_t j = 0; j < p; ++j) {
        by_support.sides.push_back({-sides[2 * j], sides[2 * j + 1]});
      }
      require_equal(hull, by_support, what + ", clp's hull and support");
      if (!has_glpk()) {
        continue;
      }
      require_equal(hull, glpk_hull(rows, GlpkForm::dual)(), what + ", clp and glpk");
      require_equal(hull, glpk_hull(rows, GlpkForm::ranged)(), what + ", clp and glpk, ranged rows");
      require_equal(gamma, glpk_minimax(rows)(), gamma, what + ", minimax of clp and glpk");
      const std::vector<double> again = glpk_support(facets)(along);
      for (std::size_t k = 0; k < again.size(); ++k) {
        const std::size_t opposite = (k + again.size() / 2) % again.size();
        require_equal(support[k], again[k], support[k] + support[opposite],
                      fmt::format("{}, support {} of clp and glpk", what, k));
      }
    }
  }
}

void read_bare(const DriveRows& rows) {
  const auto sum = [](const std::vector<double>& x) {
    return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())).sum();
  };
  DoNotOptimize(sum(rows.columns) + sum(rows.y));
}

void peers(Form form) {
  check_peers();
  for (const std::size_t p : {4, 8}) {
    for (const std::size_t n : {10000, 100000}) {
      for (const Kind& kind : {kinds[0], kinds[1]}) {
        const DriveRows rows = drive_rows(n, p, kind.noise);
        const auto take = [&](const char* peer, const std::string& subject, const Work& solve,
                              const std::function<std::string()>& more) {
          const auto note = [&](double) {
            return fmt::format("{} {}{}; beside a bare read", subject, kind.letter, more());
          };
          compare(
              form, {"bounds/peers", n, static_cast<int>(p), 1, peer, note}, [&] { read_bare(rows); }, solve,
              n < 100000 ? 3 : 1);
        };
        const auto nothing = [] { return std::string(); };
        {
          const HullPeer solve = clp_hull(rows);
          take(
              "clp", "hull", [&] { DoNotOptimize(solve()); }, nothing);
        }
        {
          const auto solve = clp_loop(rows);
          LoopAnswer answer;
          take(
              "clp cutting-plane loop", "hull", [&] { answer = solve(); },
              [&] { return fmt::format(", {} passes, {} rows kept", answer.passes, answer.working_set); });
        }
        {
          const MinimaxPeer solve = clp_minimax(rows);
          take(
              "clp", "minimax", [&] { DoNotOptimize(solve()); }, nothing);
        }
        if (has_glpk()) {
          for (const GlpkForm program : {GlpkForm::dual, GlpkForm::ranged}) {
            const HullPeer hull = glpk_hull(rows, program);
            const char* subject = program == GlpkForm::dual ? "hull, dual form," : "hull, ranged rows,";
            take(
                "glpk", subject, [&] { DoNotOptimize(hull()); }, nothing);
          }
          const MinimaxPeer minimax = glpk_minimax(rows);
          take(
              "glpk", "minimax", [&] { DoNotOptimize(minimax()); }, nothing);
        }
        if (n == 10000) {
          core::RegressionTable table(as_block(rows));
          const FeasibleSet set = feasible_set(table, rows.prior);
          const Facets facets = facets_of(set.polytope.value());
          const std::vector<double> along = directions(rows, n);
          const auto each = fmt::format("support along the rows, {} facets", facets.m);
          const SupportPeer clp = clp_support(facets);
          take(
              "clp", each, [&] { DoNotOptimize(clp(along)); }, nothing);
          if (has_glpk()) {
            const SupportPeer glpk = glpk_support(facets);
            take(
                "glpk", each, [&] { DoNotOptimize(glpk(along)); }, nothing);
          }
        }
      }
    }
  }
}

const bool registered = register_bench("bounds/peers", peers);

}  // namespace
}  // namespace wheelwright::bench::lp_peers_bench
