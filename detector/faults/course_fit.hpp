// SPDX-License-Identifier: Apache-2.0
/// \file
/// How likely a fault is by what the residuals show and do not show: the course of its size that fits them best.
///
/// isolation.hpp and size_over_time.hpp say which faults are excluded. Of those that are left the likeliest is wanted,
/// and that is a matter of fit, not of proof. With θ̂ the best guess, rows of both residuals read ε = τ_f − Yθ̂, and a
/// fault of the amount λ(t) (amount_of()) adds ∫ S(t, T) dλ(T), S the response to a step at T. λ is made of steps at
/// knots about the first instant outside and of ramps between them:
///
/// **growing**: no part of it falls, non-negative least squares; **any**: least squares. An output's errors are taken
/// as Gaussian, their variance that of what the fit leaves and of a floor, which is estimated with the fit. The cost of
/// a fault is the negative logarithm of that likelihood and half the logarithm of the number of independent rows for
/// each part of λ (Schwarz's criterion); rows within 4/β of each other, or within a window of the kinematic residual,
/// are not independent. A fault that leaves no trace in a residual has to leave that residual as it is.
///
/// The cost is an estimate: errors of θ̂ and of the model are in what is left. It orders, it excludes nothing.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "detector/faults/isolation.hpp"
#include "model/fault_type.hpp"

namespace wheelwright::filter {
struct OdometryMeasurement;
struct OdometryErrors;
}  // namespace wheelwright::filter

namespace wheelwright::detector {

struct OdometryReference;

/// Times at which a course may step or bend, s.
struct CourseGrid {
  std::vector<double> knots{};  ///< ascending; between two of them the amount may rise evenly
  std::vector<double> times{};  ///< of the responses: the knots, and evenly between them
};

/// Knots over `window`, close to `outside` dense, both in s.
[[nodiscard]] CourseGrid course_grid(const Interval& window, double outside);

/// Rows of one residual, and what steps of each fault do to them.
struct CourseRows {
  std::size_t outputs = 0;
  double independent = 0.0;                  ///< rows that count as independent, of each output
  Eigen::VectorXd residual{};                ///< ε, row by row, output by output
  Eigen::VectorXd scale{};                   ///< of each output: half of a threshold's width, in the middle of all
  std::vector<Eigen::MatrixXd> responses{};  ///< of each fault: rows × (1 + times), of a step of amount 1 (`ways`: of
                                             ///< κ = 1) from before and from each time on; empty where it is not known
  bool ways = false;                         ///< of the kinematic residual
};

/// Rows of the torque residual in the window, at most `most`. `estimate` is θ̂; the rest is as for size_evidence().
[[nodiscard]] CourseRows course_rows(const ReferenceMotion& motion, const filter::RegressorFilter& filter,
                                     const Eigen::VectorXd& estimate, const bounds::Polytope& set,
                                     const std::vector<FaultType>& faults, const Interval& window,
                                     const CourseGrid& grid, std::size_t most = 240, std::size_t threads = 1);

/// The same of the kinematic residual, whose window is `length` s; as for isolate_by_odometry().
[[nodiscard]] CourseRows course_rows_by_odometry(const OdometryReference& reference, const Model& model,
                                                 const filter::OdometryMeasurement& measurement,
                                                 const filter::OdometryErrors& errors, double length,
                                                 const Eigen::VectorXd& estimate, const bounds::Polytope& set,
                                                 const std::vector<FaultType>& faults, const Interval& window,
                                                 const CourseGrid& grid, std::size_t most = 240);

/// The best course of one fault.
struct CourseFit {
  bool known = false;  ///< false: nothing of the below, no residual's responses are known
  bool grows = true;   ///< the likeliest course never falls
  double cost = 0.0;   ///< as above, but for a constant that all faults share
  double left = 1.0;   ///< root mean square of what is left over that of ε, both in the outputs' scales
  double size = 0.0;   ///< of that course at the end of the window, the fault's unit
  double rise = 0.0;   ///< s from a tenth to nine tenths of that size, where it grows
};

/// Fits each of `faults` to the rows of all residuals.
[[nodiscard]] std::vector<CourseFit> fit_courses(const std::vector<FaultType>& faults, const CourseGrid& grid,
                                                 std::span<const CourseRows> residuals);

}  // namespace wheelwright::detector
