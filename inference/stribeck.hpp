// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stribeck friction of the wheels as one more column of a filtered log, with its speed as shape parameter.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/filter/regressor_filter.hpp>
#include <wheelwright/identify/variable_projection.hpp>

namespace wheelwright::inference {

/// y_f ≈ Y_f θ + c f*(B g(ω; ω_s)), where g_j = exp(−(|ω_j|/ω_s)²) sgn ω_j at each joint, B is Model::input (joint
/// efforts to outputs) and f the torque filter: p + 1 linear parameters, the last is c (N·m at each joint), and the
/// shape ω_s (rad/s, or m/s for a joint that is driven straight).
///
/// The recursion is RegressorFilter's own (filter/kernel.hpp). Measured speeds give g at the samples, linear between
/// them as measured efforts are; angles and mean speeds give g of each step's mean speed, as every other function of
/// the motion. A model with Coulomb friction already in Y keeps it: c is what is added at low speed. Without slow
/// driving ω_s is flat (ShapeState::flat).
class StribeckRows final : public identify::SeparableModel {
 public:
  /// Walks `log` once through `filter` and keeps the rows. Throws InvalidArgument when the log lacks a column of the
  /// filter's measurement or gives no row.
  StribeckRows(LogSource& log, RegressorFilter filter);

  [[nodiscard]] const Eigen::VectorXd& response() const override { return response_; }
  [[nodiscard]] std::size_t outputs() const override { return static_cast<std::size_t>(input_.rows()); }
  [[nodiscard]] Eigen::Index shapes() const override { return 1; }
  [[nodiscard]] Eigen::Index columns() const override { return Y_.cols() + 1; }
  /// Defined for ω_s > 0.
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const override;

 private:
  // An instant of the filter: the step that ends there, and whether it begins a segment and gives a row.
  struct Instant {
    double length;
    bool begins, gives_row;
  };
  filter::FilterKernel kernel_;
  Eigen::MatrixXd input_;
  std::vector<Instant> instants_;
  Eigen::MatrixXd speed_;  // joints × instants
  Eigen::MatrixXd Y_;
  Eigen::VectorXd response_;
};

}  // namespace wheelwright::inference
