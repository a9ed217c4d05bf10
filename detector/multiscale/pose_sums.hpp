// SPDX-License-Identifier: Apache-2.0
/// \file
/// The kinematic residual at a stated risk: weighted sums over many time scales of what odometry leaves of a pose.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/sum_weight.hpp"
#include "detector/threshold.hpp"

namespace wheelwright::detector {

/// The weights of a model's sums: none without a heading, those of headings alone without a position.
[[nodiscard]] std::vector<PoseWeight> pose_weights(const filter::OdometryMeasurement& measurement);

/// Options of a PoseSumDetector.
struct PoseSumOptions {
  /// Expected number of false alarms in a second of driving, if errors are as assumed and the set holds the parameters.
  double false_alarms = ScaleDetectorOptions{}.false_alarms;
  double checks = 8.0;  ///< of a sum, in the time of its scale
};

/// Sums over scales T of what wheel odometry leaves of a pose, over the steps j from one pose to the next (symbols as
/// in OdometryFilter), K(x) = x e^{−x}, K_j = K((now − t_j)/T):
///
///     S = Σ K_j g_jᵀ (p_j − p_j−1 − E_j (Δφ_R,j r_R + Δφ_L,j r_L)/2)     g_j in the frame of the pose
///     S = Σ K_j g_j  (θ_j − θ_j−1 − (c_R Δφ_R,j − c_L Δφ_L,j))
///
/// Errors of a pose telescope: e_k stands in the sum with K_k g_k − K_k+1 g_k+1, so that for smooth g the sum's error
/// falls like T^{−1/2} while the fault grows with T. g_j is foreseen: a filter of steps that ended before t_j−1, by the
/// errors' correlation time and more, led by its delay; so every error's factor is known before it, and a sum of those
/// is a martingale, in closed loop too. Bounds on |S|, whatever the law of the errors:
/// - position and heading errors of the stated class average out: with V = Σ factor² s² (filter::variance_proxy), their
///   share beyond the bias is at most √((V + V0)(2L + ln(1 + V/V0))), V0 fixed beforehand, but for e^{−L} (where s² is
///   Bernstein's: with half of that mixture cut off where s² ends, and the other half there). x, y and heading of one
///   pose may depend on each other: |factor · (x, y)| <= √2 |factor| bound, and position and heading get half of the
///   risk each;
/// - heading errors η turn E_j: to first order by J E_j q_j η, q_j the way of the step. With the foreseen way d_j in
///   the place of E_j q_j that averages out, the factor of η_k is that of (K_k g_kᵀJd_k + K_k+1 g_k+1ᵀJd_k+1)/2. What
///   is left counts at its worst: n_θ |gᵀJ(E_j q_j − d_j)|, and
///   n_θ |g| (n_θ (3/2 + 1/3) Q + |Δθ| Q/6 + Σ_w |Δφ_w| δr_w/2 + …), Q the largest way and δr what the set leaves of
///   the radii;
/// - wheel angles at their worst, by parts: n_φ Σ_k |K_k c_k − K_k+1 c_k+1|, c = gᵀE r/2 (or the yaw gain times g);
/// - what happens within a step: motion_within_step(); any parameters of the set; rounding.
/// Looks and their risks are those of ScaleDetector: all looks at all sums together raise
/// PoseSumOptions::false_alarms false alarms a second at most. The gyro is not used.
///
/// step() does not allocate but in linear programs where the set has more vertices than a table takes. Memory and work
/// per sample do not depend on time.
class PoseSumDetector {
 public:
  using Vector = std::array<double, 2>;  ///< in the frame of the pose; of sums of headings the first alone

  /// A step from one pose to the next, as they were read.
  struct Step {
    std::size_t number = 0;       ///< since restart(), from 1 on
    double begin = 0.0, h = 0.0;  ///< s
    double turn = 0.0;            ///< of the heading, rad
    Vector by{};                  ///< of the position, m
    Vector mean{};                ///< E_j
    Vector moved{};               ///< Δφ of the wheels, rad
    Vector size{};                ///< |Δφ|
  };

  /// Throws InvalidArgument where `model.at_risk` is missing or makes no sense, or there is no heading.
  explicit PoseSumDetector(const KinematicModel& model, PoseSumOptions options = {});

  /// Forgets all samples.
  void restart();
  /// Takes a sample (as OdometryFilter::step, columns OdometryMeasurement::columns()). Returns whether a sum was looked
  /// at; looks() are those then. Times that do not increase, gaps, and more than a second without a pose restart.
  /// A sample that is not whole (detector.hpp) is as good as lost.
  bool step(double t, std::span<const double> sample);
  /// The sums that were looked at with the last sample. Size 1 of SumState::c0 and c1: 1 m/s, 1 rad/s, all of the
  /// parameter.
  [[nodiscard]] std::span<const SumState> looks() const { return {looks_.data(), looked_}; }
  /// Of the newest sample, s.
  [[nodiscard]] double now() const { return time_; }
  /// True if one of them is outside.
  [[nodiscard]] bool alarm() const { return alarm_; }

  [[nodiscard]] const std::vector<PoseWeight>& weights() const { return weights_; }
  /// s.
  [[nodiscard]] const std::vector<double>& scales() const { return risk_.scales; }
  [[nodiscard]] const PoseSumOptions& options() const { return options_; }
  [[nodiscard]] const filter::OdometryMeasurement& measurement() const { return measurement_; }
  /// Number of steps of all samples.
  [[nodiscard]] std::size_t steps() const { return steps_; }
  /// The last step ...
  [[nodiscard]] const Step& newest() const { return step_; }
  /// ... and its g_j for a weight.
  [[nodiscard]] const Vector& step_weight(std::size_t weight) const { return factors_[weight].g; }
  /// Largest effective radii and yaw gains of the set.
  [[nodiscard]] const Vector& largest_radii() const { return radius_; }
  [[nodiscard]] const Vector& largest_yaw_gains() const { return yaw_gain_; }
  /// What the parameters stand in a sum with, now (p): |SumState::value − (ϑ − ϑ̂)·this| <= SumState::radius.
  [[nodiscard]] Eigen::VectorXd regressor(const SumState& look) const;
  /// V of errors of position, and of heading, of every sum now (weights × scales).
  [[nodiscard]] Eigen::MatrixXd position_variances() const;
  [[nodiscard]] Eigen::MatrixXd heading_variances() const;

 private:
  static constexpr std::size_t kSignals = 9;  // E φ̇ of both wheels (4), E (2), φ̇ (2), 1
  static constexpr std::size_t kOrder = 6;    // of the filter that foresees
  using Signals = std::array<double, kSignals>;
  struct Waiting {
    double t = 0.0, h = 0.0;
    Signals signals{};
  };
  // Of one weight, the newest step's and the one's before.
  struct Factors {
    Vector g{}, g1{};
    double turned = 0.0, turned1 = 0.0;  // gᵀJd
    Vector wheel{}, wheel1{};            // what n_φ is multiplied with
    double observed = 0.0, straight = 0.0, response = 0.0;
  };
  // c0 + c1 x (+ c2 x²), x = age/T.
  struct Sum {
    double y0 = 0.0, y1 = 0.0, r0 = 0.0, r1 = 0.0, l0 = 0.0, l1 = 0.0;
    std::array<double, 3> position{}, heading{};
    double reach_position = 0.0, reach_heading = 0.0;  // Λ/√V0
  };
  struct Scale {
    double T = 0.0, since = 0.0, risk = 0.0;
    std::vector<Sum> sums;
    Eigen::ArrayXXd Y0, Y1;  // weights × p
  };

  bool read(double t, std::span<const double> sample);
  void foresee(double begin);
  void release(const Waiting& step);
  void weigh(const Step& step);
  void take(const Step& step);
  void fade();
  void look(Scale& scale, std::size_t which);
  [[nodiscard]] double averaged(double V, double usual, double L, const filter::SampleClass& sample) const;
  [[nodiscard]] Eigen::MatrixXd variances(std::array<double, 3> Sum::*part) const;

  filter::OdometryMeasurement measurement_;
  filter::OdometryErrors errors_;
  PoseRiskModel risk_;
  PoseSumOptions options_;
  ThresholdRule rule_;
  std::vector<PoseWeight> weights_;
  filter::SampleClass position_{}, heading_{};
  double position_proxy_ = 0.0, heading_proxy_ = 0.0;  // for every λ
  Eigen::VectorXd largest_, half_;                     // |ϑ| at most, sides of the set's box from ϑ̂ on
  Vector radius_{}, yaw_gain_{};                       // at most
  Eigen::Index gains_ = 0;                             // position of the yaw gains among the parameters
  double beta_ = 1.0, lead_ = 0.0, correlation_ = 0.0;
  std::vector<Waiting> ring_;
  std::size_t oldest_ = 0, count_ = 0;
  std::array<Signals, kOrder> z_{};
  Signals foreseen_{};
  std::vector<Factors> factors_;
  std::vector<Scale> states_;
  Eigen::ArrayXXd rows_;  // weights × p
  bool started_ = false;
  double time_ = 0.0;  // of the last sample
  double pose_time_ = 0.0, x_ = 0.0, y_ = 0.0, wrapped_ = 0.0, heading_now_ = 0.0;
  Vector angle_{}, speed_{}, moved_{};
  Step step_{};
  std::size_t steps_ = 0;
  std::vector<SumState> looks_;
  std::size_t looked_ = 0;
  bool alarm_ = false;
  std::vector<double> direction_;
};

/// Walks the rows of `log` whose time is wanted(t) through `detector`, which forgets all samples where a segment
/// begins; calls taken(whether sums were looked at) after each.
template <typename Wanted, typename Taken>
void walk_pose_samples(LogSource& log, PoseSumDetector& detector, const Wanted& wanted, const Taken& taken) {
  core::for_each_sample(log, detector.measurement().columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      detector.restart();
    }
    if (wanted(sample.t)) {
      taken(detector.step(sample.t, sample.values));
    }
  });
}

/// The same from `from` s on and before `until` s; calls looked() where sums were looked at.
template <typename Looked>
void walk_poses(LogSource& log, PoseSumDetector& detector, double from, double until, const Looked& looked) {
  walk_pose_samples(
      log, detector, [&](double t) { return t >= from && t < until; },
      [&](bool any) {
        if (any) {
          looked();
        }
      });
}

/// PoseRiskModel::usual_position and usual_heading: a share of the mean variances on `log`, from `from` s on and before
/// `until` s. `model.at_risk` is to have all else.
struct UsualPoseVariances {
  Eigen::MatrixXd position, heading;
};
[[nodiscard]] UsualPoseVariances usual_pose_variances(LogSource& log, const KinematicModel& model, double from,
                                                      double until);

}  // namespace wheelwright::detector

namespace wheelwright {
using detector::PoseSumDetector;
}  // namespace wheelwright
