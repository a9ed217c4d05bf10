// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/operating_map.hpp>

#include <cmath>
#include <limits>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

// dY of a settled row.
RowMatrix settled_errors(const Model& model, const FilterDesign& design, const SignalErrors& errors,
                         const Eigen::VectorXd& v) {
  RowMatrix dY = RowMatrix::Zero(static_cast<Eigen::Index>(model.n()), static_cast<Eigen::Index>(model.p()));
  if (errors.acceleration.size() == 0) {
    return dY;
  }
  const Eigen::VectorXd joints = pseudo_inverse(model.motion) * v;
  const std::vector<double> speed(v.begin(), v.end()), joint_speed(joints.begin(), joints.end()),
      speed_error(errors.speed_sample.begin(), errors.speed_sample.end()),
      joint_error(joint_speed.size(), errors.joint_sample);
  for (const Term& term : model.terms) {
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    double error = 0.0;
    switch (term.kind) {
      case Term::Kind::acceleration: error = errors.acceleration[c]; break;
      case Term::Kind::speed: error = errors.speed[c]; break;
      case Term::Kind::function:
        error = design.static_gain() *
                term.function({speed, speed_error, joint_speed, joint_error, 0.0, errors.heading}).error;
        break;
    }
    dY(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.parameter)) +=
        std::abs(term.scale) * error;
  }
  return dY;
}

}  // namespace

OperatingMap operating_map(const FaultType& fault, double side, const Model& model, const FilterDesign& design,
                           const SignalErrors& errors, const ThresholdRule& rule, OperatingPlane plane) {
  check::that(!plane.x.empty() && !plane.y.empty(), "operating plane", "values on both axes");
  const auto c = static_cast<Eigen::Index>(model.coordinates.size());
  const double largest = side > 0.0 ? fault.range.upper : -fault.range.lower;
  const double limit = std::abs(fault.kappa(side * largest));
  const std::size_t p = model.p();
  FaultMargin margin(rule);
  OperatingMap map{std::move(plane), {}};
  map.smallest.setConstant(static_cast<Eigen::Index>(map.plane.x.size()), static_cast<Eigen::Index>(map.plane.y.size()),
                           std::numeric_limits<double>::infinity());
  for (Eigen::Index a = 0; a < map.smallest.rows(); ++a) {
    for (Eigen::Index b = 0; b < map.smallest.cols(); ++b) {
      Eigen::VectorXd point = Eigen::VectorXd::Zero(c);
      point[0] = map.plane.x[static_cast<std::size_t>(a)];
      if (c > 1) {
        point[1] = map.plane.y[static_cast<std::size_t>(b)];
      }
      const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c);
      const Eigen::VectorXd v = !map.plane.accelerations ? point : map.plane.at.size() == c ? map.plane.at : rest;
      const SettledRows rows = settled_rows(fault, model, design, v, map.plane.accelerations ? point : rest);
      const RowMatrix dY = settled_errors(model, design, errors, v);
      for (std::size_t i = 0; i < model.n(); ++i) {
        const auto r = static_cast<Eigen::Index>(i);
        const FaultRow row{{rows.Y.row(r).data(), p},
                           {rows.signature.g1.row(r).data(), p},
                           {rows.signature.g2.row(r).data(), p},
                           {rows.signature.s.row(r).data(), p},
                           {dY.row(r).data(), p},
                           rows.signature.c[r],
                           errors.output.size() > 0 ? errors.output[r] : 0.0};
        double& best = map.smallest(a, b);
        if (fault.whole) {
          best = margin.certain(row, limit, side, i) ? largest : best;
        } else if (const auto found = margin.smallest_certain(row, limit, side, i)) {
          best = std::min(best, std::abs(fault.magnitude(side * *found)));
        }
      }
    }
  }
  return map;
}

}  // namespace wheelwright
