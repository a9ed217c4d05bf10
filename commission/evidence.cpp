// SPDX-License-Identifier: Apache-2.0
#include "commission/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "commission/noise_budget.hpp"
#include "commission/setting_rows.hpp"
#include "core/linear_algebra.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

// −d(Yθ)/dt, row by row, by central differences; zero at the ends of segments.
Eigen::VectorXd shift_column(const RegressionBlock& rows, const Eigen::VectorXd& theta) {
  const Eigen::VectorXd torque = rows.Y * theta;
  Eigen::VectorXd column = Eigen::VectorXd::Zero(torque.size());
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  for (std::size_t k = 1; k + 1 < rows.instants(); ++k) {
    if (rows.sample[k + 1] != rows.sample[k - 1] + 2) {
      continue;
    }
    const auto at = static_cast<Eigen::Index>(k) * n;
    column.segment(at, n) = (torque.segment(at - n, n) - torque.segment(at + n, n)) / (rows.t[k + 1] - rows.t[k - 1]);
  }
  return column;
}

// Root of the sum of squares over stretches of `length` s of Σ|weights|·errors in each: the standard deviation of a sum
// whose stretches have signs of their own.
double by_stretches(const RegressionBlock& rows, const Eigen::VectorXd& weights, const Eigen::VectorXd& errors,
                    double length) {
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  double square = 0.0, sum = 0.0, begun = rows.t.front();
  for (std::size_t k = 0; k < rows.instants(); ++k) {
    if (std::abs(rows.t[k] - begun) > length) {
      square += sum * sum;
      sum = 0.0;
      begun = rows.t[k];
    }
    const auto at = static_cast<Eigen::Index>(k) * n;
    sum += weights.segment(at, n).cwiseAbs().dot(errors.segment(at, n));
  }
  return std::sqrt(square + sum * sum);
}

}  // namespace

RegressionBlock first_rows(core::RegressionSource& rows, std::size_t most) {
  std::vector<RegressionBlock> parts;
  RegressionBlock block, all;
  std::size_t instants = 0;
  rows.rewind();
  while (instants < most && rows.next(block)) {
    instants += block.instants();
    parts.push_back(block);
  }
  rows.rewind();
  all.resize(instants, rows.outputs(), rows.parameters());
  std::size_t first = 0;
  for (const RegressionBlock& part : parts) {
    const auto at = static_cast<Eigen::Index>(first * rows.outputs());
    std::ranges::copy(part.sample, all.sample.begin() + static_cast<std::ptrdiff_t>(first));
    std::ranges::copy(part.t, all.t.begin() + static_cast<std::ptrdiff_t>(first));
    all.Y.middleRows(at, part.rows()) = part.Y;
    all.dY.middleRows(at, part.rows()) = part.dY;
    all.y.segment(at, part.rows()) = part.y;
    all.dy.segment(at, part.rows()) = part.dy;
    first += part.instants();
  }
  return all;
}

Explained explained_by_errors(LogSource& log, const Setting& s, const Fit& fit, const filter::SignalErrors& errors,
                              const Box& box, std::size_t most_rows) {
  const auto p = static_cast<Eigen::Index>(s.model.p());
  Explained result{Eigen::VectorXd::Zero(p + 1), Eigen::VectorXd::Zero(p + 1)};
  if (!s.noise_complete) {
    return result;
  }
  filter::SignalErrors between = errors;
  between.acceleration.setZero();
  between.speed.setZero();
  between.output.setZero();
  between.bridges = false;  // as rows of the fit are
  between.interpolates = errors_of_fit(s).interpolates;
  TorqueRows fitted_stream = make_rows(log, s, errors_of_fit(s));
  const RegressionBlock rows = first_rows(fitted_stream, most_rows);
  TorqueRows bounded_stream = make_rows(log, s, between);
  const RegressionBlock bounded = first_rows(bounded_stream, most_rows);
  log.rewind();
  if (rows.instants() == 0 || bounded.sample != rows.sample) {
    return result;
  }
  const std::vector<double> centre = box.centre();
  const Eigen::VectorXd theta = Eigen::Map<const Eigen::VectorXd>(centre.data(), p), largest = box.magnitudes();
  // Weighted columns of all that is estimated; what is not excited stays out.
  core::RowMatrix A(rows.rows(), p + 1);
  A.leftCols(p) = rows.Y;
  A.col(p) = shift_column(rows, theta);
  Eigen::VectorXd weight(rows.rows());
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    weight[r] = fit.weights[r % fit.weights.size()];
  }
  A.array().colwise() *= weight.array();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (fit.excitation[static_cast<std::size_t>(j)].state != identify::Excitation::not_excited &&
        A.col(j).squaredNorm() > 0.0) {
      kept.push_back(j);
    }
  }
  const auto fitted = static_cast<Eigen::Index>(kept.size());
  if (fitted == 0) {
    return result;
  }
  Eigen::MatrixXd columns(rows.rows(), fitted);
  for (Eigen::Index j = 0; j < fitted; ++j) {
    columns.col(j) = A.col(kept[static_cast<std::size_t>(j)]);
  }
  const Eigen::VectorXd scale = columns.colwise().norm().cwiseInverse();
  columns *= scale.asDiagonal();
  const Eigen::MatrixXd gram = columns.transpose() * columns;
  const Eigen::MatrixXd inverse = core::pseudo_inverse(gram);
  core::RowMatrix g(rows.rows(), fitted + 1);
  g.leftCols(fitted) = columns * inverse * scale.asDiagonal();
  const Eigen::VectorXd shift = A.col(p);
  const Eigen::VectorXd left = shift - columns * (inverse * (columns.transpose() * shift));
  const double square = left.squaredNorm();
  g.col(fitted) = square > 0.0 ? (left / square).eval() : Eigen::VectorXd::Zero(rows.rows()).eval();
  g.array().colwise() *= weight.array();

  const Eigen::VectorXd of_motion = (bounded.dY + (bounded.Y - rows.Y).cwiseAbs()) * largest;
  const Eigen::VectorXd doubt = of_motion + bounded.dy + (bounded.y - rows.y).cwiseAbs();
  Eigen::VectorXd in_doubt = g.cwiseAbs().transpose() * doubt;
  const bool held_between =
      s.measurement.hold == Hold::zero_order && s.measurement.changes == model::EffortChanges::between;
  // EffortTiming::allowed has what efforts do.
  const Eigen::VectorXd& of_shift = held_between || s.measurement.delay != Interval{} ? of_motion : doubt;
  in_doubt[fitted] = g.col(fitted).cwiseAbs().dot(of_shift);
  constexpr double kNearlyAlways = 3.0;  // standard deviations
  result.shift_by_chance = std::min(
      in_doubt[fitted], kNearlyAlways * by_stretches(rows, g.col(fitted), of_shift, s.filter.settle / s.filter.beta));
  filter::ErrorInfluence influence(s.model, s.filter, s.measurement, noise_budget(s.robot, s.measurement).sensors,
                                   theta, fitted + 1);
  influence.add(rows, g);
  for (Eigen::Index j = 0; j < fitted; ++j) {
    result.in_doubt[kept[static_cast<std::size_t>(j)]] = in_doubt[j];
    result.noise[kept[static_cast<std::size_t>(j)]] = influence.value()[j];
  }
  result.in_doubt[p] = in_doubt[fitted];
  result.noise[p] = influence.value()[fitted];
  return result;
}

}  // namespace wheelwright::commission
