// SPDX-License-Identifier: Apache-2.0
/// \file
/// Fault signatures in the kinematic residual: the motion by pose or gyro that wheel odometry does not show.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bounds/box.hpp"
#include "core/log.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/reference_motion.hpp"
#include "model/filter/odometry_filter.hpp"

namespace wheelwright::detector {

/// A drive as the kinematic residual sees it: ReferenceMotion whose rows are windows of odometry (OdometryFilter), at
/// the samples with a new pose; an instant is settled where it has a row.
struct OdometryReference {
  ReferenceMotion motion;
  std::vector<std::size_t> window;  ///< per instant, the instant at which its window begins (itself where no row is)
};

/// The motion of `log` as `filter` reads it; `model` is the differential drive's. Walks the log once and holds it.
/// Throws InvalidArgument when the log lacks a column of the filter's measurement.
[[nodiscard]] OdometryReference read_odometry(LogSource& log, filter::OdometryFilter filter, const Model& model);

/// What a fault does to the wheels' ways, in joints.
struct OdometrySignature {
  Eigen::Matrix2d rolled = Eigen::Matrix2d::Zero();  ///< K: truly rolled beyond what encoders would show
  Eigen::Matrix2d shown = Eigen::Matrix2d::Zero();   ///< S: shown beyond it
  double along = 0.0, turning = 0.0;                 ///< a, m/s and rad/s

  /// The largest share of the encoders' errors in K and S of what they show.
  [[nodiscard]] double read_share() const;
};

/// That of `fault`. Throws InvalidArgument where it does not fit `model`, a differential drive.
[[nodiscard]] OdometrySignature odometry_signature(const FaultType& fault, const Model& model);

/// Rows of the kinematic residual after a fault's onset. With q_j what a wheel truly rolls beyond what its encoder
/// would show without a fault in step j (s K in joints, times its way) and σ_j what the encoder shows beyond it (s S),
/// the displacement is Σ E_j (Δφ + κ q) r/2 + κ Σ (E_j s a_1 + E_j⊥ s d) h, seen as Σ E_j (Δφ + κ σ) r/2, and alike for
/// the turn. Efforts play no part. A measured way has the encoders' errors, and so have K and S of it. E_j are the
/// directions of the healthy drive: where a fault turns the robot by up to κ η within a window, rows are in doubt by κ
/// η times the way driven.
class OdometryFaultRows final : public FaultRows {
 public:
  /// `hull` bounds the parameters (OdometryMeasurement::parameters()). Throws InvalidArgument where `fault` does not
  /// fit `model`. `reference` is kept by reference.
  OdometryFaultRows(const FaultType& fault, const Model& model, const filter::OdometryMeasurement& measurement,
                    const OdometryReference& reference, const Box& hull);

  [[nodiscard]] std::size_t outputs() const override { return n_; }
  void begin(std::size_t onset) override;
  bool next() override;
  [[nodiscard]] std::size_t instant() const override { return k_; }
  [[nodiscard]] FaultRow row(std::size_t i) const override;

 private:
  // Sums from the onset on.
  struct Sums {
    std::array<Eigen::Vector2d, 2> rolled{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};  // E q of each wheel
    std::array<Eigen::Vector2d, 2> shown{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};   // E σ
    Eigen::Vector2d slipped = Eigen::Vector2d::Zero();                                        // E s a_1 h + E⊥ s d h
    Eigen::Vector2d turned = Eigen::Vector2d::Zero(), turn_shown = Eigen::Vector2d::Zero();   // q, σ of each wheel
    double slipped_turn = 0.0;                                                                // s a_2 h
    double turn_size = 0.0;         // of κ's part of the heading
    double way = 0.0, moved = 0.0;  // |Δφ| r/2, and of κ's part
  };
  void write();

  FaultType fault_;
  const OdometryReference* reference_;
  filter::OdometryMeasurement measurement_;
  OdometrySignature signature_;
  double most_kappa_ = 0.0;
  std::array<double, 2> radius_{};  // at most
  std::array<Interval, 2> yaw_gain_{};
  std::size_t n_ = 0, p_ = 0;
  std::vector<Sums> sums_;  // from the onset to instant k_
  std::size_t onset_ = 0, k_ = 0, end_ = 0;
  FaultSignals rows_;
  Eigen::VectorXd doubt_;
  core::RowMatrix range_;
};

}  // namespace wheelwright::detector
