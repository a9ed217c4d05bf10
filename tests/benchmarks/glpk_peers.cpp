// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <numeric>
#include <string>

#include <glpk.h>

#include "core/error.hpp"
#include "tests/benchmarks/lp_peers.hpp"
#include "tests/benchmarks/scaled_rows.hpp"

namespace wheelwright::bench {
namespace {

double optimum(glp_prob* problem, const glp_smcp& parameters) {
  const int code = glp_simplex(problem, &parameters);
  if (code != 0 || glp_get_status(problem) != GLP_OPT) {
    throw Error("GLPK ends with code " + std::to_string(code) + ", status " + std::to_string(glp_get_status(problem)));
  }
  return glp_get_obj_val(problem);
}

/// The dual form, min b·λ with Aᵀλ = a, λ >= 0, of max { a·x : Ax <= b }.
class Program {
 public:
  Program(std::size_t rows, std::size_t columns) : problem_(glp_create_prob(), glp_delete_prob) {
    glp_term_out(GLP_OFF);
    glp_add_rows(get(), static_cast<int>(rows));
    glp_add_cols(get(), static_cast<int>(columns));
    for (std::size_t j = 0; j < rows; ++j) {
      set_right(j, 0.0);
    }
    glp_init_smcp(&parameters_);
    parameters_.msg_lev = GLP_MSG_OFF;
    parameters_.presolve = GLP_OFF;
  }

  /// A half-space: its coefficients as GLPK wants them, from index 1.
  void add(const int* index, const double* a, int count, double b) {
    ++column_;
    glp_set_mat_col(get(), column_, count, index, a);
    glp_set_col_bnds(get(), column_, GLP_LO, 0.0, 0.0);
    glp_set_obj_coef(get(), column_, b);
  }
  /// A half-space with its dense coefficients.
  void add(std::span<const double> a, double b) {
    int index[14] = {};
    double value[14] = {};
    for (std::size_t j = 0; j < a.size(); ++j) {
      index[j + 1] = static_cast<int>(j) + 1;
      value[j + 1] = a[j];
    }
    add(index, value, static_cast<int>(a.size()), b);
  }
  /// The sides of a box.
  void add(const Box& box) {
    for (std::size_t j = 0; j < box.sides.size(); ++j) {
      for (const double side : {1.0, -1.0}) {
        const int index[2] = {0, static_cast<int>(j) + 1};
        const double value[2] = {0.0, side};
        add(index, value, 1, side > 0.0 ? box.sides[j].upper : -box.sides[j].lower);
      }
    }
  }

  void set_right(std::size_t j, double a) { glp_set_row_bnds(get(), static_cast<int>(j) + 1, GLP_FX, a, a); }
  /// Forgets the basis.
  void reset() { glp_std_basis(get()); }

  double solve(int method, int pricing = GLP_PT_PSE) {
    parameters_.meth = method;
    parameters_.pricing = pricing;
    return optimum(get(), parameters_);
  }

 private:
  [[nodiscard]] glp_prob* get() const { return problem_.get(); }
  std::shared_ptr<glp_prob> problem_;
  glp_smcp parameters_{};
  int column_ = 0;
};

HullPeer ranged_hull(const ScaledRows& rows) {
  const std::shared_ptr<glp_prob> problem(glp_create_prob(), glp_delete_prob);
  glp_prob* lp = problem.get();
  const int n = static_cast<int>(rows.n), p = static_cast<int>(rows.p);
  glp_term_out(GLP_OFF);
  glp_add_rows(lp, n);
  glp_add_cols(lp, p);
  std::vector<int> index(rows.n + 1);
  std::iota(index.begin(), index.end(), 0);
  std::vector<double> value(rows.n + 1);
  for (int j = 0; j < p; ++j) {
    const Interval side = rows.box.sides[static_cast<std::size_t>(j)];
    std::copy_n(rows.a.data() + static_cast<std::size_t>(j) * rows.n, rows.n, value.begin() + 1);
    glp_set_mat_col(lp, j + 1, n, index.data(), value.data());
    glp_set_col_bnds(lp, j + 1, GLP_DB, side.lower, side.upper);
  }
  for (int i = 0; i < n; ++i) {
    const double c = rows.c[static_cast<std::size_t>(i)];
    glp_set_row_bnds(lp, i + 1, GLP_DB, c - 1.0, c + 1.0);
  }
  glp_smcp parameters;
  glp_init_smcp(&parameters);
  parameters.msg_lev = GLP_MSG_OFF;
  parameters.meth = GLP_DUAL;
  parameters.pricing = GLP_PT_STD;

  return [problem, lp, parameters, unit = rows.unit] {
    glp_std_basis(lp);
    Box hull;
    for (std::size_t j = 0; j < unit.size(); ++j) {
      double bounds[2];
      for (const double sign : {1.0, -1.0}) {
        glp_set_obj_coef(lp, static_cast<int>(j) + 1, sign);
        bounds[sign < 0.0] = sign * optimum(lp, parameters) / unit[j];
      }
      glp_set_obj_coef(lp, static_cast<int>(j) + 1, 0.0);
      hull.sides.push_back({bounds[0], bounds[1]});
    }
    return hull;
  };
}

}  // namespace

bool has_glpk() noexcept { return true; }

HullPeer glpk_hull(const DriveRows& drive, GlpkForm form) {
  const ScaledRows rows(drive);
  if (form == GlpkForm::ranged) {
    return ranged_hull(rows);
  }
  Program program(rows.p, 2 * rows.n + 2 * rows.p);
  for (std::size_t i = 0; i < rows.n; ++i) {
    rows.sides(i, [&](const auto& a, double b) { program.add({a.data(), rows.p}, b + 1.0); });
  }
  program.add(rows.box);

  return [program, p = rows.p, unit = rows.unit]() mutable {
    program.reset();
    Box hull;
    for (std::size_t j = 0; j < p; ++j) {
      double bounds[2];
      for (const double sign : {-1.0, 1.0}) {
        program.set_right(j, sign);
        bounds[sign > 0.0] = sign * program.solve(j == 0 && sign < 0.0 ? GLP_PRIMAL : GLP_DUALP) / unit[j];
      }
      program.set_right(j, 0.0);
      hull.sides.push_back({bounds[0], bounds[1]});
    }
    return hull;
  };
}

MinimaxPeer glpk_minimax(const DriveRows& drive) {
  const ScaledRows rows(drive);
  Program program(rows.p + 1, 2 * rows.n + 2 * rows.p);
  for (std::size_t i = 0; i < rows.n; ++i) {
    rows.sides(i, [&](auto a, double b) {
      a[rows.p] = 1.0;
      program.add({a.data(), rows.p + 1}, b);
    });
  }
  program.add(rows.box);
  program.set_right(rows.p, 1.0);

  return [program]() mutable {
    program.reset();
    return -program.solve(GLP_PRIMAL, GLP_PT_STD);
  };
}

SupportPeer glpk_support(const Facets& facets) {
  const ScaledFacets scaled(facets);
  const std::size_t p = facets.p;
  Program program(p, facets.m);
  for (std::size_t i = 0; i < facets.m; ++i) {
    program.add({scaled.a.data() + i * p, p}, scaled.b[i]);
  }

  return [program, p, unit = scaled.unit](std::span<const double> directions) mutable {
    std::vector<double> values;
    values.reserve(directions.size() / p);
    program.reset();
    for (std::size_t k = 0; k < directions.size(); k += p) {
      for (std::size_t j = 0; j < p; ++j) {
        program.set_right(j, directions[k + j] / unit[j]);
      }
      values.push_back(program.solve(k == 0 ? GLP_PRIMAL : GLP_DUALP));
    }
    return values;
  };
}

}  // namespace wheelwright::bench
