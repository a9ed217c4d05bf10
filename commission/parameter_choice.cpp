// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/parameter_choice.hpp>

#include <cmath>

#include <wheelwright/identify/least_squares.hpp>

namespace wheelwright {
namespace {

constexpr double kWorthwhile = 0.9;

}  // namespace

ParameterChoice choose_parameters(RegressionSource& rows, std::size_t basic, std::size_t log_rows,
                                  const FoldOptions& folds) {
  FoldedSource training(rows, Part::training, log_rows, folds);
  FoldedSource held_out(rows, Part::held_out, log_rows, folds);
  LeastSquares fit(rows.parameters());
  RegressionBlock block;
  training.rewind();
  while (training.next(block)) {
    fit.add(block);
  }
  std::vector<bool> beyond(rows.parameters(), false);
  for (std::size_t j = basic; j < beyond.size(); ++j) {
    beyond[j] = true;
  }
  const Eigen::VectorXd small = fit.solve(beyond).estimate;
  const Eigen::VectorXd large = fit.solve().estimate;
  double error_small = 0.0, error_large = 0.0, torque = 0.0;
  held_out.rewind();
  while (held_out.next(block)) {
    error_small += (block.y - block.Y * small).squaredNorm();
    error_large += (block.y - block.Y * large).squaredNorm();
    torque += block.y.squaredNorm();
  }
  ParameterChoice choice;
  if (torque > 0.0) {
    choice.nrmse_basic = std::sqrt(error_small / torque);
    choice.nrmse_full = std::sqrt(error_large / torque);
    choice.full = choice.nrmse_full < kWorthwhile * choice.nrmse_basic;
  }
  return choice;
}

}  // namespace wheelwright
