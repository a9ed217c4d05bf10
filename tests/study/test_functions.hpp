// SPDX-License-Identifier: Apache-2.0
/// \file
/// Functions on the unit cube whose Sobol' indices are known in closed form.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::study::sensitivity_example {

struct TestFunction {
  std::string name;
  Eigen::Index inputs = 0;
  std::function<double(const Eigen::VectorXd&)> value;
  std::vector<double> first, total;
};

inline Eigen::MatrixXd evaluate(const TestFunction& f, const Eigen::MatrixXd& design) {
  Eigen::MatrixXd values(design.rows(), 1);
  for (Eigen::Index n = 0; n < design.rows(); ++n) {
    values(n, 0) = f.value(design.row(n).transpose());
  }
  return values;
}

// sin x1 + a sin² x2 + b x3⁴ sin x1 on [−π, π]³ (ishigami1990).
inline TestFunction ishigami(double a = 7.0, double b = 0.1) {
  const double pi4 = std::pow(std::numbers::pi, 4);
  const double v1 = 0.5 * (1.0 + b * pi4 / 5.0) * (1.0 + b * pi4 / 5.0), v2 = a * a / 8.0,
               v13 = 8.0 * b * b * pi4 * pi4 / 225.0, v = v1 + v2 + v13;
  const auto value = [a, b](const Eigen::VectorXd& u) {
    const Eigen::ArrayXd x = std::numbers::pi * (2.0 * u.array() - 1.0);
    return std::sin(x[0]) * (1.0 + b * std::pow(x[2], 4)) + a * std::sin(x[1]) * std::sin(x[1]);
  };
  return {"Ishigami", 3, value, {v1 / v, v2 / v, 0.0}, {(v1 + v13) / v, v2 / v, v13 / v}};
}

// Π (|4 u_i − 2| + a_i) / (1 + a_i) (sobol1993).
inline TestFunction g_function(const std::vector<double>& a = {0.0, 1.0, 4.5, 9.0, 99.0, 99.0}) {
  double product = 1.0;
  for (const double ai : a) {
    product *= 1.0 + 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
  }
  TestFunction f{"g", static_cast<Eigen::Index>(a.size()), {}, {}, {}};
  for (const double ai : a) {
    const double v = 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
    f.first.push_back(v / (product - 1.0));
    f.total.push_back(v * product / (1.0 + v) / (product - 1.0));
  }
  f.value = [a](const Eigen::VectorXd& u) {
    double y = 1.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      y *= (std::abs(4.0 * u[static_cast<Eigen::Index>(i)] - 2.0) + a[i]) / (1.0 + a[i]);
    }
    return y;
  };
  return f;
}

// A constant and Σ c_i u_i: first-order and total indices are c_i² / Σ c².
inline TestFunction additive(Eigen::VectorXd c = Eigen::Vector4d(4.0, 3.0, 2.0, 0.0), double constant = 10.0) {
  TestFunction f{"additive", c.size(), {}, {}, {}};
  for (const double ci : c) {
    f.first.push_back(ci * ci / c.squaredNorm());
  }
  f.total = f.first;
  f.value = [c = std::move(c), constant](const Eigen::VectorXd& u) { return constant + c.dot(u); };
  return f;
}

}  // namespace wheelwright::study::sensitivity_example
