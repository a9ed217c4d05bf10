// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/one_at_a_time.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright {
namespace {

void validate(Eigen::Index inputs, Eigen::Index levels) {
  check::that(inputs >= 1, "inputs of a study", "at least 1");
  check::that(levels >= 2, "levels", "at least 2, the ends of the range");
}

OneAtATime curves(const Eigen::VectorXd& values, Eigen::Index inputs, Eigen::Index levels) {
  OneAtATime out;
  out.nominal = values[0];
  for (Eigen::Index i = 0; i < inputs; ++i) {
    InputCurve curve;
    curve.coordinates = Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
    curve.values = values.segment(1 + i * levels, levels);
    curve.low = curve.values[0];
    curve.high = curve.values[levels - 1];
    double least = out.nominal, most = out.nominal;
    for (const double y : curve.values) {
      least = std::fmin(least, y);
      most = std::fmax(most, y);
      curve.missing += std::isnan(y) ? 1 : 0;
    }
    curve.swing = most - least;
    out.inputs.push_back(std::move(curve));
  }
  out.order.resize(out.inputs.size());
  std::iota(out.order.begin(), out.order.end(), std::size_t{0});
  const auto rank = [&](std::size_t i) { return std::isnan(out.inputs[i].swing) ? -1.0 : out.inputs[i].swing; };
  std::stable_sort(out.order.begin(), out.order.end(), [&](std::size_t a, std::size_t b) { return rank(a) > rank(b); });
  return out;
}

}  // namespace

Eigen::MatrixXd one_at_a_time_design(const Eigen::VectorXd& nominal, Eigen::Index levels) {
  const Eigen::Index inputs = nominal.size();
  validate(inputs, levels);
  check::that((nominal.array() >= 0.0).all() && (nominal.array() <= 1.0).all(), "nominal coordinates",
              "numbers in [0, 1]");
  Eigen::MatrixXd design = nominal.transpose().replicate(1 + inputs * levels, 1);
  for (Eigen::Index i = 0; i < inputs; ++i) {
    design.col(i).segment(1 + i * levels, levels) = Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
  }
  return design;
}

std::vector<OneAtATime> one_at_a_time(const Eigen::MatrixXd& values, Eigen::Index inputs, Eigen::Index levels) {
  validate(inputs, levels);
  check::that(values.rows() == 1 + inputs * levels, fmt::format("{} rows of values", values.rows()),
              fmt::format("{}, one for each row of the design", 1 + inputs * levels));
  const Eigen::MatrixXd finite = values.unaryExpr([](double y) { return std::isfinite(y) ? y : kNan; });
  std::vector<OneAtATime> out;
  for (Eigen::Index q = 0; q < finite.cols(); ++q) {
    out.push_back(curves(finite.col(q), inputs, levels));
  }
  return out;
}

}  // namespace wheelwright
