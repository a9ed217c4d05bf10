// SPDX-License-Identifier: Apache-2.0
/// \file
/// The models of NIST's nonlinear reference problems, each written once and usable in two ways: with the parameters
/// that enter linearly split off, or with all of them as shape parameters.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <ceres/jet.h>

#include "identify/variable_projection.hpp"
#include "tests/identify/nist.hpp"

namespace wheelwright::testing_support {

using NistJet = ceres::Jet<double, 9>;

/// y = offset + Σ φ_j b_linear(j), with φ and the offset functions of b_shape(·) and of x.
struct NistModel {
  std::string name;
  std::vector<int> shape;   ///< numbers (from 0) of the parameters that enter nonlinearly
  std::vector<int> linear;  ///< numbers of the others
  /// Writes φ (one for each linear parameter) at the shapes w and the predictors x; returns the offset.
  std::function<NistJet(const Eigen::VectorXd& x, const std::vector<NistJet>& w, std::vector<NistJet>& phi)> at;
  bool log_response = false;
  /// As googletest prints it.
  friend void PrintTo(const NistModel& model, std::ostream* out) { *out << model.name; }
};

/// All of them.
inline std::vector<NistModel> nist_models() {
  using J = NistJet;
  using X = Eigen::VectorXd;
  using V = std::vector<J>;
  const double pi = 3.141592653589793238462643383279;
  const auto gauss = [](const X& x, const V& w, V& phi) {
    phi = {exp(-w[0] * x[0]), exp(-(x[0] - w[1]) * (x[0] - w[1]) / (w[2] * w[2])),
           exp(-(x[0] - w[3]) * (x[0] - w[3]) / (w[4] * w[4]))};
    return J(0.0);
  };
  const auto lanczos = [](const X& x, const V& w, V& phi) {
    phi = {exp(-w[0] * x[0]), exp(-w[1] * x[0]), exp(-w[2] * x[0])};
    return J(0.0);
  };
  const auto chwirut = [](const X& x, const V& w, V&) { return exp(-w[0] * x[0]) / (w[1] + w[2] * x[0]); };
  const auto saturation = [](const X& x, const V& w, V& phi) {
    phi = {J(1.0) - exp(-w[0] * x[0])};
    return J(0.0);
  };
  const auto cubic_ratio = [](const X& x, const V& w, V& phi) {
    const double u = x[0];
    const J d = 1.0 / (1.0 + w[0] * u + w[1] * (u * u) + w[2] * (u * u * u));
    phi = {d, d * u, d * (u * u), d * (u * u * u)};
    return J(0.0);
  };
  return {
      {"Misra1a", {1}, {0}, saturation},
      {"Misra1b",
       {1},
       {0},
       [](const X& x, const V& w, V& phi) {
         const J d = 1.0 + w[0] * (x[0] / 2.0);
         phi = {1.0 - 1.0 / (d * d)};
         return J(0.0);
       }},
      {"Misra1c",
       {1},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {1.0 - 1.0 / sqrt(1.0 + 2.0 * w[0] * x[0])};
         return J(0.0);
       }},
      {"Misra1d",
       {1},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {w[0] * x[0] / (1.0 + w[0] * x[0])};
         return J(0.0);
       }},
      {"Chwirut1", {0, 1, 2}, {}, chwirut},
      {"Chwirut2", {0, 1, 2}, {}, chwirut},
      {"Lanczos1", {1, 3, 5}, {0, 2, 4}, lanczos},
      {"Lanczos2", {1, 3, 5}, {0, 2, 4}, lanczos},
      {"Lanczos3", {1, 3, 5}, {0, 2, 4}, lanczos},
      {"Gauss1", {1, 3, 4, 6, 7}, {0, 2, 5}, gauss},
      {"Gauss2", {1, 3, 4, 6, 7}, {0, 2, 5}, gauss},
      {"Gauss3", {1, 3, 4, 6, 7}, {0, 2, 5}, gauss},
      {"DanWood",
       {1},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {exp(w[0] * std::log(x[0]))};
         return J(0.0);
       }},
      {"Kirby2",
       {3, 4},
       {0, 1, 2},
       [](const X& x, const V& w, V& phi) {
         const double u = x[0];
         const J d = 1.0 / (1.0 + w[0] * u + w[1] * (u * u));
         phi = {d, d * u, d * (u * u)};
         return J(0.0);
       }},
      {"Hahn1", {4, 5, 6}, {0, 1, 2, 3}, cubic_ratio},
      {"Nelson",
       {2},
       {0, 1},
       [](const X& x, const V& w, V& phi) {
         phi = {J(1.0), -x[0] * exp(-w[0] * x[1])};
         return J(0.0);
       },
       true},
      {"MGH17",
       {3, 4},
       {0, 1, 2},
       [](const X& x, const V& w, V& phi) {
         phi = {J(1.0), exp(-w[0] * x[0]), exp(-w[1] * x[0])};
         return J(0.0);
       }},
      {"Roszman1",
       {2, 3},
       {0, 1},
       [pi](const X& x, const V& w, V& phi) {
         phi = {J(1.0), J(-x[0])};
         const J ratio = w[0] / (x[0] - w[1]);
         return J(std::atan(ratio.a), ratio.v / (1.0 + ratio.a * ratio.a)) * (-1.0 / pi);
       }},
      {"ENSO",
       {3, 6},
       {0, 1, 2, 4, 5, 7, 8},
       [pi](const X& x, const V& w, V& phi) {
         const double year = 2.0 * pi * x[0] / 12.0;
         const J a = 2.0 * pi * x[0] / w[0];
         const J b = 2.0 * pi * x[0] / w[1];
         phi = {J(1.0), J(std::cos(year)), J(std::sin(year)), cos(a), sin(a), cos(b), sin(b)};
         return J(0.0);
       }},
      {"MGH09",
       {1, 2, 3},
       {0},
       [](const X& x, const V& w, V& phi) {
         const double u = x[0];
         phi = {(u * u + u * w[0]) / (u * u + u * w[1] + w[2])};
         return J(0.0);
       }},
      {"Thurber", {4, 5, 6}, {0, 1, 2, 3}, cubic_ratio},
      {"BoxBOD", {1}, {0}, saturation},
      {"Rat42",
       {1, 2},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {1.0 / (1.0 + exp(w[0] - w[1] * x[0]))};
         return J(0.0);
       }},
      {"MGH10",
       {1, 2},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {exp(w[0] / (x[0] + w[1]))};
         return J(0.0);
       }},
      {"Eckerle4",
       {1, 2},
       {0},
       [](const X& x, const V& w, V& phi) {
         const J z = (x[0] - w[1]) / w[0];
         phi = {exp(-0.5 * z * z) / w[0]};
         return J(0.0);
       }},
      {"Rat43",
       {1, 2, 3},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {exp(-log(1.0 + exp(w[0] - w[1] * x[0])) / w[2])};
         return J(0.0);
       }},
      {"Bennett5",
       {1, 2},
       {0},
       [](const X& x, const V& w, V& phi) {
         phi = {exp(-log(w[0] + x[0]) / w[1])};
         return J(0.0);
       }},
  };
}

/// A NIST problem as a separable model: split as `model` says, or with every parameter a shape (`split` false).
class NistRegression final : public identify::SeparableModel {
 public:
  NistRegression(const NistProblem& problem, NistModel model, bool split)
      : problem_(&problem), model_(std::move(model)), split_(split), y_(problem.y) {
    if (model_.log_response) {
      y_ = y_.array().log();
    }
  }
  [[nodiscard]] const Eigen::VectorXd& response() const override { return y_; }
  [[nodiscard]] Eigen::Index shapes() const override {
    return split_ ? static_cast<Eigen::Index>(model_.shape.size()) : problem_->certified.size();
  }
  [[nodiscard]] Eigen::Index columns() const override {
    return split_ ? static_cast<Eigen::Index>(model_.linear.size()) : 0;
  }
  /// Number in b of entry j of (ω, θ).
  [[nodiscard]] int parameter(Eigen::Index j) const {
    if (!split_) {
      return static_cast<int>(j);
    }
    const auto q = shapes();
    return j < q ? model_.shape[static_cast<std::size_t>(j)] : model_.linear[static_cast<std::size_t>(j - q)];
  }
  /// The shapes of a start (or of a solution) b.
  [[nodiscard]] Eigen::VectorXd shape_of(const Eigen::VectorXd& b) const {
    return Eigen::VectorXd::NullaryExpr(shapes(), [&](Eigen::Index j) { return b[parameter(j)]; });
  }
  bool evaluate(const Eigen::VectorXd& shape, bool, identify::SeparableValues& at) const override {
    const Eigen::Index rows = y_.size();
    const auto q = static_cast<std::size_t>(shapes());
    at.offset.setZero(rows);
    at.columns.setZero(rows, columns());
    at.offset_by.assign(q, Eigen::VectorXd::Zero(rows));
    at.columns_by.assign(q, Eigen::MatrixXd::Zero(rows, columns()));
    std::vector<NistJet> all(9, NistJet(0.0)), w, phi;
    for (std::size_t k = 0; k < q; ++k) {
      all[static_cast<std::size_t>(parameter(static_cast<Eigen::Index>(k)))] =
          NistJet(shape[static_cast<Eigen::Index>(k)], static_cast<int>(k));
    }
    for (const int k : model_.shape) {
      w.push_back(all[static_cast<std::size_t>(k)]);
    }
    for (Eigen::Index i = 0; i < rows; ++i) {
      phi.clear();
      NistJet value = model_.at(problem_->x.row(i), w, phi);
      for (std::size_t j = 0; j < phi.size(); ++j) {
        if (split_) {
          at.columns(i, static_cast<Eigen::Index>(j)) = phi[j].a;
          for (std::size_t k = 0; k < q; ++k) {
            at.columns_by[k](i, static_cast<Eigen::Index>(j)) = phi[j].v[static_cast<int>(k)];
          }
        } else {
          value += phi[j] * all[static_cast<std::size_t>(model_.linear[j])];
        }
      }
      at.offset[i] = value.a;
      for (std::size_t k = 0; k < q; ++k) {
        at.offset_by[k][i] = value.v[static_cast<int>(k)];
      }
    }
    return true;
  }

 private:
  const NistProblem* problem_;
  NistModel model_;
  bool split_;
  Eigen::VectorXd y_;
};

}  // namespace wheelwright::testing_support
