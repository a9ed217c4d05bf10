// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exact optima of linear programs: QSopt_ex (Applegate, Cook, Dash and Espinoza 2007, "Exact solutions to linear
/// programming problems", Oper. Res. Lett. 35), in rationals from beginning to end. Every double is the rational it is.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmpxx.h>

extern "C" {
#include <qsopt_ex/QSopt_ex.h>
}

#include "bounds/box.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds::qsopt {

/// To be called before the first rational is made: the library gives GMP its own memory. Messages go nowhere.
inline void start() {
  if (__QSexact_setup == 0) {
    QSexactStart();
    QSlog_set_handler([](const char*, void*) {}, nullptr);
  }
}

/// { x in box : lower <= a·x <= upper for every row } and maxima over it.
class ExactProgram {
 public:
  explicit ExactProgram(std::size_t p) : p_(p), problem_(mpq_QScreate_prob("exact", QS_MAX), mpq_QSfree_prob) {}

  /// A variable between finite bounds; all p of them come before the rows.
  void add_variable(const mpq_class& lower, const mpq_class& upper) {
    const mpq_class cost = 0;
    check(mpq_QSnew_col(get(), cost.get_mpq_t(), lower.get_mpq_t(), upper.get_mpq_t(), nullptr), "new column");
  }
  /// a·x <= b, or a·x >= b.
  void add_row(const std::vector<mpq_class>& a, const mpq_class& b, bool at_most) {
    Vector values(p_);
    std::vector<int> index;
    for (std::size_t j = 0; j < p_; ++j) {
      mpq_set(values[j], a[j].get_mpq_t());
      index.push_back(static_cast<int>(j));
    }
    mpq_t right;
    mpq_init(right);
    mpq_set(right, b.get_mpq_t());
    const int code =
        mpq_QSadd_row(get(), static_cast<int>(p_), index.data(), values.data(), &right, at_most ? 'L' : 'G', nullptr);
    mpq_clear(right);
    check(code, "new row");
  }

  /// max c·x, or nothing where the set is empty. Throws std::runtime_error where the solver gives up.
  std::optional<mpq_class> maximise(const std::vector<mpq_class>& c) {
    mpq_t number;
    mpq_init(number);
    for (std::size_t j = 0; j < p_; ++j) {
      mpq_set(number, c[j].get_mpq_t());
      check(mpq_QSchange_objcoef(get(), static_cast<int>(j), number), "objective");
    }
    int status = 0;
    const int code = QSexact_solver(get(), nullptr, nullptr, nullptr, DUAL_SIMPLEX, &status);
    std::optional<mpq_class> value;
    if (code == 0 && status == QS_LP_OPTIMAL) {
      check(mpq_QSget_objval(get(), &number), "value");
      value.emplace(number);
    }
    mpq_clear(number);
    check(code, "solver");
    if (status != QS_LP_OPTIMAL && status != QS_LP_INFEASIBLE) {
      throw std::runtime_error("QSopt_ex ends with status " + std::to_string(status));
    }
    return value;
  }

 private:
  /// An array of rationals as C has it.
  class Vector {
   public:
    explicit Vector(std::size_t size) : size_(size), data_(new mpq_t[size]) {
      for (std::size_t j = 0; j < size_; ++j) {
        mpq_init(data_[j]);
      }
    }
    Vector(const Vector&) = delete;
    Vector& operator=(const Vector&) = delete;
    ~Vector() {
      for (std::size_t j = 0; j < size_; ++j) {
        mpq_clear(data_[j]);
      }
    }
    mpq_t& operator[](std::size_t j) { return data_[j]; }
    mpq_t* data() { return data_.get(); }

   private:
    std::size_t size_;
    std::unique_ptr<mpq_t[]> data_;
  };

  static void check(int code, const char* what) {
    if (code != 0) {
      throw std::runtime_error(std::string("QSopt_ex fails: ") + what);
    }
  }
  [[nodiscard]] mpq_QSprob get() const { return problem_.get(); }

  std::size_t p_;
  std::unique_ptr<std::remove_pointer_t<mpq_QSprob>, void (*)(mpq_QSprob)> problem_;
};

/// Doubles as the rationals they are.
inline std::vector<mpq_class> rationals(std::span<const double> x) { return {x.begin(), x.end()}; }

/// { θ in box : |y − Yθ| <= dy for every row } exactly as the numbers say (dY is taken as zero).
inline ExactProgram exact_set(const RegressionBlock& rows, const Box& box) {
  ExactProgram program(box.dimension());
  for (const Interval& side : box.sides) {
    program.add_variable(side.lower, side.upper);
  }
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const std::vector<mpq_class> a = rationals({rows.Y.row(r).data(), box.dimension()});
    const mpq_class y = rows.y[r], dy = rows.dy[r];
    program.add_row(a, y + dy, true);
    program.add_row(a, y - dy, false);
  }
  return program;
}

/// γ* = min γ with |y − Yθ| <= γ for every row, θ in box, γ in [0, limit]: the exact minimax fit.
inline mpq_class exact_minimax(const RegressionBlock& rows, const Box& box, double limit) {
  const std::size_t p = box.dimension();
  ExactProgram program(p + 1);
  for (const Interval& side : box.sides) {
    program.add_variable(side.lower, side.upper);
  }
  program.add_variable(0, limit);
  std::vector<mpq_class> cost(p + 1, 0);
  cost[p] = -1;
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    std::vector<mpq_class> a = rationals({rows.Y.row(r).data(), p});
    a.push_back(-1);
    program.add_row(a, rows.y[r], true);
    a[p] = 1;
    program.add_row(a, rows.y[r], false);
  }
  const std::optional<mpq_class> value = program.maximise(cost);
  if (!value) {
    throw std::runtime_error("exact minimax: the limit is too small");
  }
  return -*value;
}

}  // namespace wheelwright::bounds::qsopt
