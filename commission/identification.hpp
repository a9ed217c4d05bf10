// SPDX-License-Identifier: Apache-2.0
/// \file
/// Identification of the parameters from a log of fault-free driving, without bounds and thresholds: estimates,
/// uncertainty, unidentified directions, and unmodelled effects, Stribeck friction of the wheels among them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"
#include "identify/inference/identifiability.hpp"
#include "identify/inference/kinematic_calibration.hpp"
#include "identify/inference/noise_levels.hpp"
#include "identify/inference/regions.hpp"
#include "identify/inference/robust.hpp"
#include "identify/variable_projection.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::commission {

/// y_f ≈ Y_f θ + c f*(B g(ω; ω_s)), where g_j = exp(−(|ω_j|/ω_s)²) sgn ω_j at each joint, B is Model::input (joint
/// efforts to outputs) and f the torque filter: p + 1 linear parameters, the last is c (N·m at each joint), and the
/// shape ω_s (rad/s, or m/s for a joint that is driven straight).
///
/// The recursion is RegressorFilter's own (model/filter/kernel.hpp). Measured speeds give g at the samples, linear
/// between them as measured efforts are; angles and mean speeds give g of each step's mean speed, as every other
/// function of the motion. A model with Coulomb friction already in Y keeps it: c is what is added at low speed.
/// Without slow driving ω_s is flat (ShapeState::flat).
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

/// Noise that needs no finding.
struct KnownNoise {
  double bound = 0.0;  ///< |n| <= bound
  std::string unit;    ///< of the bound: rad also for mean speeds, whose noise is that of the angles behind them
  std::string origin;  ///< "as declared" or "half an encoder count"
};

/// Noise of one column of the log.
struct ColumnNoise {
  std::string column;
  std::string unit;
  inference::NoiseEvidence evidence;
  inference::NoiseChoice choice;    ///< found in the log
  std::optional<KnownNoise> known;  ///< goes before what was found, wherever the column is an angle or made of angles
};

/// One point of a curve: what the residual would be with the shape held there.
struct ShapePoint {
  double shape = 0.0;
  double residual_ratio = 1.0;  ///< as ShapeFinding's; NaN where the model is not defined
};

/// Shape parameter of a ShapeFinding.
enum class ShapeKind { delay, effort_lag, actuator_lag, stribeck_speed };

/// One more quantity that enters nonlinearly, added alone to the model.
struct ShapeFinding {
  ShapeKind kind = ShapeKind::delay;
  std::string name;  ///< delay, effort_lag, actuator_lag or stribeck_speed
  std::string unit;
  identify::ShapeState state = identify::ShapeState::flat;
  bool converged = false;
  double estimate = 0.0;
  double standard_error = 0.0;
  double freedom = 0.0;           ///< of Student's t
  double residual_ratio = 1.0;    ///< residual rms with it over that without, same rows: 1 where it explains nothing
  Interval searched;              ///< where it was looked for
  std::vector<ShapePoint> curve;  ///< over all that was searched, ascending
};

/// Options of an identification.
struct IdentificationOptions {
  SettingOptions setting;
  double confidence = 0.95;        ///< of the regions
  std::uint64_t seed = 1;          ///< of bootstrap and signs
  bool shapes = true;              ///< whether delay, lags and Stribeck speed are looked for
  std::size_t curve_points = 25;   ///< of each shape's curve, at least 2
  std::size_t most_rows = 200000;  ///< instants above which they are not: the rows are held in memory
  double longest_delay = 0.2;      ///< s, searched to both sides for delays, upwards for lags
  std::function<void(std::string_view stage, double share)> progress;  ///< may be empty
};

/// The result.
struct Identification {
  bool effort =
      true;  ///< the log has efforts: without, only `kinematics`, `setting`'s robot and model, and notes are given
  double confidence = 0.95;
  Setting setting;
  Fit fit;
  std::vector<ColumnNoise> noise;         ///< motion columns, then effort columns
  inference::RobustFit robust;            ///< Huber's loss, physically consistent
  inference::ConstrainedFit constrained;  ///< physically consistent θ nearest to the chosen estimate, by its covariance
  inference::RegionComparison regions;    ///< of the chosen estimate; empty where no parameter is excited
  inference::Identifiability
      identifiability;  ///< of the physical quantities where physical_scales() has them, else of θ_L
  inference::InformationOverTime information;
  std::vector<ShapeFinding> shapes;  ///< empty where they were not looked for: least squares must be unbiased for that
  std::optional<inference::KinematicCalibration> kinematics;  ///< where the log has a pose
  std::vector<std::string> notes;                             ///< what was assumed, left out or could not be done
};

/// True if `log` has the motion of both wheels, as speeds or as angles, and a heading to calibrate them by.
[[nodiscard]] bool shows_kinematics(const LogSource& log, const Robot& robot);

/// Identifies on the whole of `log`, in several walks. A log of wheel motion and pose without efforts gives kinematics
/// only. Throws InputError or InvalidArgument for a log or robot that cannot be used at all.
[[nodiscard]] Identification identify(LogSource& log, const Robot& robot, const IdentificationOptions& options = {});

}  // namespace wheelwright::commission
