// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/linear_program.hpp>

#include <cmath>
#include <limits>

#include <Eigen/LU>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

namespace wheelwright {
namespace {

constexpr double kTolerance = 1e-10;

}  // namespace

struct LinearProgram::Engine {
  explicit Engine(Eigen::Index p) : a(p, 0) {
    model.setLogLevel(0);
    model.resize(static_cast<int>(p), 0);
    model.scaling(0);
    model.setPerturbation(100);
    model.setPrimalTolerance(kTolerance);
    model.setDualTolerance(kTolerance);
    model.setMaximumIterations(20000);
  }

  ClpSimplex model;
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  std::vector<char> enabled;
  Eigen::Index count = 0;
  bool columns_changed = true;

  /// Largest violation of the enabled rows at x.
  double violation(const Eigen::VectorXd& x) const {
    double worst = 0.0;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (enabled[static_cast<std::size_t>(i)] != 0) {
        worst = std::max(worst, a.col(i).dot(x) - b[i]);
      }
    }
    return worst;
  }

  /// The answer of CLP's basis, computed anew: x = A_B⁻¹ b_B and λ = A_B⁻ᵀ c, or CLP's own numbers where the basis
  /// holds fewer rows than variables.
  LpSolution answer(const Eigen::VectorXd& c) {
    const Eigen::Index p = a.rows();
    std::vector<int> basic;
    for (int i = 0; i < static_cast<int>(count); ++i) {
      if (model.getColumnStatus(i) == ClpSimplex::basic) {
        basic.push_back(i);
      }
    }
    LpSolution result;
    result.x = Eigen::Map<const Eigen::VectorXd>(model.dualRowSolution(), p);
    Eigen::VectorXd lambda(static_cast<Eigen::Index>(basic.size()));
    for (std::size_t k = 0; k < basic.size(); ++k) {
      lambda[static_cast<Eigen::Index>(k)] = model.primalColumnSolution()[basic[k]];
    }
    if (static_cast<Eigen::Index>(basic.size()) == p) {
      Eigen::MatrixXd columns(p, p);
      Eigen::VectorXd rhs(p);
      for (Eigen::Index k = 0; k < p; ++k) {
        columns.col(k) = a.col(basic[static_cast<std::size_t>(k)]);
        rhs[k] = b[basic[static_cast<std::size_t>(k)]];
      }
      const Eigen::PartialPivLU<Eigen::MatrixXd> lu(columns);
      Eigen::VectorXd polished = lu.solve(c);
      polished += lu.solve(c - columns * polished);
      const Eigen::VectorXd vertex = lu.transpose().solve(rhs);
      if (polished.allFinite() && (polished - lambda).norm() <= 1e-6 * (1.0 + lambda.norm())) {
        lambda = polished;
      }
      if (vertex.allFinite() && (vertex - result.x).norm() <= 1e-6 * (1.0 + result.x.norm())) {
        result.x = vertex;
      }
    }
    std::vector<double> positive;
    for (std::size_t k = 0; k < basic.size(); ++k) {
      if (lambda[static_cast<Eigen::Index>(k)] > 0.0) {
        result.rows.push_back(basic[k]);
        positive.push_back(lambda[static_cast<Eigen::Index>(k)]);
      }
    }
    result.multipliers = Eigen::Map<const Eigen::VectorXd>(positive.data(), static_cast<Eigen::Index>(positive.size()));
    result.value = c.dot(result.x);
    result.status = LpSolution::Status::optimal;
    return result;
  }

  LpSolution solve(const Eigen::VectorXd& c, bool cold) {
    if (cold) {
      model.allSlackBasis();
    }
    if (columns_changed) {
      model.primal(0);
    } else {
      model.dual(0);
    }
    columns_changed = false;
    LpSolution result;
    switch (model.status()) {
      case 0:
        result = answer(c);
        if (!result.x.allFinite() || violation(result.x) > 1e-8 * (1.0 + result.x.norm())) {
          result.status = LpSolution::Status::failed;
        }
        break;
      case 2: result.status = LpSolution::Status::infeasible; break;
      default: result.status = LpSolution::Status::failed; break;
    }
    return result;
  }
};

LinearProgram::LinearProgram(Eigen::Index variables) : engine_(std::make_unique<Engine>(variables)) {}
LinearProgram::~LinearProgram() = default;
LinearProgram::LinearProgram(LinearProgram&&) noexcept = default;
LinearProgram& LinearProgram::operator=(LinearProgram&&) noexcept = default;

Eigen::Index LinearProgram::rows() const { return engine_->count; }

void LinearProgram::add_rows(const Eigen::MatrixXd& a_columns, const Eigen::VectorXd& b) {
  Engine& e = *engine_;
  const Eigen::Index p = e.a.rows(), added = a_columns.cols();
  if (added == 0) {
    return;
  }
  if (e.a.cols() < e.count + added) {
    const Eigen::Index capacity = std::max<Eigen::Index>(2 * e.a.cols(), e.count + added);
    e.a.conservativeResize(p, capacity);
    e.b.conservativeResize(capacity);
  }
  e.a.middleCols(e.count, added) = a_columns;
  e.b.segment(e.count, added) = b;
  e.enabled.resize(static_cast<std::size_t>(e.count + added), 1);
  e.count += added;

  std::vector<CoinBigIndex> starts(static_cast<std::size_t>(added) + 1);
  std::vector<int> indices(static_cast<std::size_t>(added * p));
  for (Eigen::Index k = 0; k <= added; ++k) {
    starts[static_cast<std::size_t>(k)] = static_cast<CoinBigIndex>(k * p);
  }
  for (Eigen::Index k = 0; k < added * p; ++k) {
    indices[static_cast<std::size_t>(k)] = static_cast<int>(k % p);
  }
  const Eigen::MatrixXd packed = a_columns;
  e.model.addColumns(static_cast<int>(added), nullptr, nullptr, b.data(), starts.data(), indices.data(), packed.data());
  e.columns_changed = true;
}

LpSolution LinearProgram::maximise(const Eigen::VectorXd& c) {
  Engine& e = *engine_;
  for (int j = 0; j < static_cast<int>(c.size()); ++j) {
    e.model.setRowBounds(j, c[j], c[j]);
  }
  try {
    LpSolution result = e.solve(c, false);
    if (result.status != LpSolution::Status::optimal) {
      e.columns_changed = true;
      result = e.solve(c, true);
    }
    return result;
  } catch (...) {
    return {};
  }
}

void LinearProgram::disable(Eigen::Index row) {
  engine_->enabled[static_cast<std::size_t>(row)] = 0;
  engine_->model.setColumnUpper(static_cast<int>(row), 0.0);
}

void LinearProgram::enable(Eigen::Index row) {
  engine_->enabled[static_cast<std::size_t>(row)] = 1;
  engine_->model.setColumnUpper(static_cast<int>(row), COIN_DBL_MAX);
}

}  // namespace wheelwright
