// SPDX-License-Identifier: Apache-2.0
/// \file
/// Instruments: regressor columns of a motion that is independent of the noise of the measured motion.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "core/regression.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::identify {

/// Where the motion behind the instruments comes from.
struct InstrumentMotion {
  /// The two kinds.
  enum class Kind {
    commanded,  ///< logged commands: free of the sensors' noise unless they are feedback of the noisy motion itself, or
                ///< of
                ///< a pose made from it (noise_level.hpp looks for the first)
    simulated,  ///< the model with parameters `theta`, driven by the logged efforts. It does not see the noise of the
                ///< motion, except through a controller that answers to it; it holds that of measured efforts, which
                ///< biases inertias by the noise's share of the effort's power (an effort that is a command has none)
  };
  Kind kind = Kind::commanded;
  std::vector<std::string> columns;  ///< commanded: one column of joint speeds for each joint
  Eigen::VectorXd theta;             ///< simulated: p
};

/// The commanded motion of `model`'s joints where `log` has all its columns (Joint::command).
[[nodiscard]] std::optional<InstrumentMotion> commanded_motion(const LogSource& log, const Model& model);

/// Open-loop motion of a model driven by efforts: M(θ) v̇ = input·effort − the other terms, by Runge-Kutta steps of
/// fourth order, two a sample.
class MotionSimulation {
 public:
  /// True if `model` can be simulated with `theta`: as many outputs as coordinates and joints, M(θ) and the map from
  /// joints to coordinates invertible.
  [[nodiscard]] static bool possible(const Model& model, const Eigen::VectorXd& theta);
  /// Throws InvalidArgument where it is not possible. `hold` of the efforts between samples.
  MotionSimulation(Model model, Eigen::VectorXd theta, Hold hold);
  /// Begins a segment at time `t` (s) with joint speeds `speed` and `effort` of each joint, heading 0.
  void restart(double t, const Eigen::VectorXd& speed, const Eigen::VectorXd& effort);
  /// Advances to the sample at `t` with `effort`; returns the speeds of the joints there. The heading that the model's
  /// terms see is the simulated one.
  const Eigen::VectorXd& step(double t, const Eigen::VectorXd& effort);

 private:
  [[nodiscard]] Eigen::VectorXd acceleration(const Eigen::VectorXd& speed, const Eigen::VectorXd& effort,
                                             double heading) const;

  Model model_;
  Eigen::VectorXd theta_;
  Hold hold_;
  Eigen::MatrixXd inverse_inertia_, joints_from_coordinates_;
  double t_ = 0.0;
  double heading_ = 0.0;
  Eigen::VectorXd speed_, joint_, effort_;
};

/// Rows of a log and, beside each, its instruments: p columns of Y_f and then p columns Z_f, which are the same
/// filter's of another motion. Z has no error bounds. Only instants that both filters give are handed out. The log must
/// outlive the stream and is rewound by it.
class InstrumentStream final : public core::RegressionSource {
 public:
  /// Throws InvalidArgument when `log` lacks a column, or the motion cannot be made.
  InstrumentStream(LogSource& log, RegressorFilter rows, const InstrumentMotion& motion);
  [[nodiscard]] std::size_t outputs() const override { return rows_.model().n(); }
  /// 2p.
  [[nodiscard]] std::size_t parameters() const override { return 2 * rows_.model().p(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;
  /// Root mean square of the instruments' joint speeds that were made so far over that of the measured ones
  /// (0 before the first sample, and for logs of angles, whose simulation starts at rest): far from 1 where a
  /// simulation ran away.
  [[nodiscard]] double speed_ratio() const;

 private:
  void begin_segment();
  void make_motion(double t, std::size_t k);

  LogSource* log_;
  RegressorFilter rows_, instruments_;
  std::optional<MotionSimulation> simulation_;
  std::vector<std::size_t> pick_, commands_;
  std::vector<double> sample_, instrument_sample_;
  bool fresh_ = true;
  double measured_squares_ = 0.0, made_squares_ = 0.0;
  LogBlock scratch_;
};

}  // namespace wheelwright::identify
