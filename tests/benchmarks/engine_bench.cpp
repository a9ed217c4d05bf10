// SPDX-License-Identifier: Apache-2.0
// The engine of bounds/ against what an able user of CLP or GLPK would write (lp_peers.hpp), on rows of a simulated
// drive. Answers are compared before times are: the certified hull must contain the peer's, and be no wider than its
// tolerance.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/minimax.hpp"
#include "bounds/support_walk.hpp"
#include "core/error.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/drive_rows.hpp"
#include "tests/benchmarks/lp_peers.hpp"

namespace wheelwright::bench::engine_bench {
namespace {

struct Kind {
  RowNoise noise;
  const char* letter;
};
constexpr Kind kinds[] = {{RowNoise::uniform, "u"}, {RowNoise::gaussian, "g"}, {RowNoise::coloured, "s"}};

bounds::FeasibleSetOptions without_vertices() {
  bounds::FeasibleSetOptions options;
  options.polytope.vertex_limit = 0;
  return options;
}

bounds::SlabColumns columns_of(const DriveRows& rows) {
  bounds::SlabColumns columns;
  columns.n = rows.n;
  for (std::size_t j = 0; j < rows.p; ++j) {
    columns.Y.push_back(rows.column(j));
  }
  columns.y = rows.y.data();
  columns.dy = rows.dy.data();
  return columns;
}

/// Rows divided by their bound, so that γ dy is γ: what the minimax peers load.
struct ScaledColumns {
  std::vector<double> columns, y, zero;
  bounds::SlabColumns view;

  explicit ScaledColumns(const DriveRows& rows) : columns(rows.columns), y(rows.y), zero(rows.n, 0.0) {
    for (std::size_t i = 0; i < rows.n; ++i) {
      for (std::size_t j = 0; j < rows.p; ++j) {
        columns[j * rows.n + i] /= rows.dy[i];
      }
      y[i] /= rows.dy[i];
    }
    view.n = rows.n;
    for (std::size_t j = 0; j < rows.p; ++j) {
      view.Y.push_back(columns.data() + j * rows.n);
    }
    view.y = y.data();
    view.dy = zero.data();
  }
};

void require_contains(const Box& certified, const Box& peer) {
  for (std::size_t j = 0; j < peer.sides.size(); ++j) {
    const double width = peer.sides[j].upper - peer.sides[j].lower;
    const double low = peer.sides[j].lower - certified.sides[j].lower;
    const double high = certified.sides[j].upper - peer.sides[j].upper;
    // The peer is not certified: 1e-6 of the width is what it may be wrong by.
    if (!(std::min(low, high) >= -1e-6 * width && std::max(low, high) <= 1e-6 * width)) {
      throw Error(
          fmt::format("hull: parameter {} is off by {:.3g} and {:.3g} of the width", j, low / width, high / width));
    }
  }
}

void hulls(Form form) {
  for (const std::size_t n : {100000, 1000000}) {
    for (const Kind& kind : kinds) {
      const DriveRows rows = drive_rows(n, 8, kind.noise);
      const bounds::SlabColumns columns = columns_of(rows);
      bounds::IntervalHull hull;
      Box peer;
      const auto note = [&](double) {
        require_contains(hull.hull, peer);
        return fmt::format("{}, {} passes, {} rows looked at twice", kind.letter, hull.passes, hull.candidates);
      };
      const auto take = [&](const char* name, const Work& solve) {
        compare(
            form, {"bounds/hull", n, 8, 1, name, note}, [&] { hull = bounds::interval_hull(columns, rows.prior); },
            solve, n < 1000000 ? 3 : 1);
      };
      const auto loop = clp_loop(rows);
      take("clp cutting-plane loop", [&] { peer = loop().hull; });
      if (n == 100000 || kind.noise != RowNoise::coloured) {
        const HullPeer clp = clp_hull(rows);
        take("clp", [&] { peer = clp(); });
      }
    }
  }
}

void minimax(Form form) {
  for (const std::size_t n : {100000, 1000000}) {
    for (const Kind& kind : {kinds[0], kinds[1]}) {
      const DriveRows rows = drive_rows(n, 8, kind.noise);
      const ScaledColumns scaled(rows);
      bounds::MinimaxFit fit;
      double peer = 0.0;
      const auto note = [&](double) {
        if (!(fit.lower <= peer * (1.0 + 1e-6) && fit.upper >= peer * (1.0 - 1e-6))) {
          throw Error(fmt::format("minimax: [{:.17g}, {:.17g}], peer {:.17g}", fit.lower, fit.upper, peer));
        }
        return fmt::format("{}, {} passes, bracket {:.1g}", kind.letter, fit.passes,
                           (fit.upper - fit.lower) / fit.upper);
      };
      const auto take = [&](const char* name, const MinimaxPeer& solve) {
        compare(
            form, {"bounds/minimax", n, 8, 1, name, note}, [&] { fit = bounds::minimax_fit(scaled.view, rows.prior); },
            [&] { peer = solve(); }, n < 1000000 ? 3 : 1);
      };
      take("clp", clp_minimax(rows));
      if (has_glpk()) {
        take("glpk", glpk_minimax(rows));
      }
    }
  }
}

void walks(Form form) {
  for (const std::size_t p : {4, 6, 8, 12}) {
    const std::size_t n = 100000;
    for (const Kind& kind : {kinds[0], kinds[1]}) {
      const DriveRows rows = drive_rows(n, p, kind.noise);
      core::RegressionTable table(as_block(rows));
      const Polytope set = feasible_set(table, rows.prior, without_vertices()).polytope.value();
      Facets facets{set.facets().size(), p, {}, {}};
      for (const bounds::HalfSpace& facet : set.facets()) {
        facets.a.insert(facets.a.end(), facet.a.begin(), facet.a.end());
        facets.b.push_back(facet.b);
      }
      std::vector<double> along = directions(rows, n);
      const std::size_t count = along.size();
      for (std::size_t k = 0; k < count; ++k) {
        along.push_back(-along[k]);
      }
      std::vector<double> ours(2 * n), theirs;
      bounds::SupportWalkCount cost;
      // The walk begins without a vertex each time, as the peers begin without a basis.
      const auto walk = [&] {
        bounds::SupportWalk h(set, {.vertices = 1 << 16, .few = 0});
        for (std::size_t k = 0; k < 2 * n; ++k) {
          ours[k] = h.support({along.data() + k * p, p}, k / n);
        }
        cost = h.count();
      };
      const auto note = [&](double seconds) {
        double wrong = 0.0;
        for (std::size_t k = 0; k < 2 * n; ++k) {
          const double width = theirs[k] + theirs[(k + n) % (2 * n)];
          // Ours is a proved upper bound: it may be above a peer's value by rounding, and below by what the peer is
          // wrong (its tolerance is absolute, and with noise u the set is tiny).
          if (!(ours[k] - theirs[k] <= 1e-6 * width)) {
            throw Error(
                fmt::format("walk: direction {} is off by {:.3g} of the width", k, (ours[k] - theirs[k]) / width));
          }
          wrong = std::max(wrong, (theirs[k] - ours[k]) / width);
        }
        return fmt::format(
            "{}, {} facets, {:.0f} ns each, {:.3f} edges each; peer too large by up to {:.0e} of the width",
            kind.letter, facets.m, 1e9 * seconds / static_cast<double>(2 * n),
            static_cast<double>(cost.edges) / static_cast<double>(2 * n), wrong);
      };
      const auto take = [&](const char* name, const SupportPeer& peer) {
        compare(
            form, {"bounds/walk", 2 * n, static_cast<int>(p), 1, name, note}, walk, [&] { theirs = peer(along); }, 3);
      };
      take("clp", clp_support(facets));
      if (has_glpk()) {
        take("glpk", glpk_support(facets));
      }
    }
  }
}

void facets(Form form) {
  for (const Kind& kind : kinds) {
    const DriveRows rows = drive_rows(1000000, 8, kind.noise);
    core::RegressionTable table(as_block(rows));
    FeasibleSet set;
    const auto note = [&](double seconds) {
      return fmt::format("{}, {} facets, {:.2f} s", kind.letter, set.polytope->facets().size(), seconds);
    };
    compare(
        form, {"bounds/facets", rows.n, 8, 1, "bare read", note},
        [&] { set = feasible_set(table, rows.prior, without_vertices()); },
        [&] { DoNotOptimize(table.block().Y.sum() + table.block().y.sum()); }, 3);
  }
}

/// One thread against two on rows of which most are only looked at.
void threads(Form form) {
  for (const Kind& kind : {kinds[0], kinds[1]}) {
    const DriveRows rows = drive_rows(4000000, 8, kind.noise);
    const bounds::SlabColumns columns = columns_of(rows);
    const auto run = [&](std::size_t count) {
      bounds::IntervalHullOptions options;
      options.threads = count;
      DoNotOptimize(bounds::interval_hull(columns, rows.prior, options).hull);
    };
    const auto note = [&](double) { return std::string(kind.letter); };
    compare(
        form, {"bounds/threads", rows.n, 8, 2, "one thread", note}, [&] { run(2); }, [&] { run(1); }, 5);
  }
}

const bool registered = register_bench("bounds/hull", hulls) && register_bench("bounds/minimax", minimax) &&
                        register_bench("bounds/walk", walks) && register_bench("bounds/facets", facets) &&
                        register_bench("bounds/threads", threads);

}  // namespace
}  // namespace wheelwright::bench::engine_bench
