// SPDX-License-Identifier: Apache-2.0
/// \file
/// The detector at a stated risk: weighted sums over many time scales, sharper than a filter since errors average out.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "detector/sum_weight.hpp"
#include "detector/threshold.hpp"
#include "model/filter/element_filter.hpp"
#include "model/filter/predictable_regressor.hpp"

namespace wheelwright::detector {

/// The weights of a model's sums: constant and effort of each joint, torque of each parameter.
[[nodiscard]] std::vector<SumWeight> sum_weights(const Model& model);

/// Options of a ScaleDetector.
struct ScaleDetectorOptions {
  /// Expected number of false alarms in a second of driving, if errors are as assumed and θ is in the set. Once in ten
  /// years.
  double false_alarms = 1.0 / (10.0 * 365.25 * 86400.0);
  double checks = 8.0;            ///< of a sum, in the time of its scale
  bool exact_thresholds = false;  ///< those of sums that are far inside, too, by the set instead of its box
  ParameterSetKind set = ParameterSetKind::polytope;  ///< which θ explain a sum
};

/// A sum that stands where no healthy robot's could, or how near it comes.
struct SumState {
  std::size_t weight = 0, scale = 0;
  double value = 0.0;      ///< Σ g (torque − Yθ̂)
  double threshold = 0.0;  ///< |value| of a healthy robot is below; of a sum that is far inside, by the set's box
  double excess = 0.0;     ///< by which it stands outside, > 0: an alarm; unit of `threshold`
  /// By c0 a fault of size 1 that the weight is like would have moved the sum, had it always been there; after a
  /// further time of x scales (c0 + c1 x)e^{−x} of it remain. Size 1: the effort's unit, all of the effort, all of the
  /// parameter.
  double c0 = 0.0, c1 = 0.0;
  double radius = 0.0;    ///< what errors alone can do: the threshold's part that does not depend on the set
  double averaged = 0.0;  ///< the part of `radius` that errors have which average out
};

/// Numbers of a ScaleDetector that do not change from sample to sample, for its form in C
/// (detector/export/export_c.hpp).
struct SumConstants {
  Eigen::VectorXd largest, half;  ///< p: |θ| at most, sides of the set's box from θ̂ on
  Eigen::MatrixXd inverse;        ///< n × n: (N Nᵀ)⁻¹, N the model's input
  Eigen::MatrixXd to_joints;      ///< joints × n: N⁺
  Eigen::MatrixXd slope_gain;     ///< n × n: what θ makes of errors of the joints' slopes, as a bound on its square
  Eigen::VectorXd speed_gain;     ///< n: the most that θ makes of errors of all joints' speeds
  filter::SampleClass effort{};   ///< one effort
  bool averages = false;          ///< whether its errors do
  double square = 0.0;            ///< its variance proxy for every λ
  std::vector<double> cost{};     ///< mixture_cost() of each scale
  Eigen::MatrixXd usual{};        ///< weights × scales: usual_multiple()
};

/// Sums over scales T, with weights w(t) = K((now − t)/T) g(t), K(x) = x e^{−x}, g foreseen (PredictableRegressor), of
/// what the model does not explain:
///
///     S = Σ w_k (torque_k − Y_k θ)
///
/// A healthy robot's S is made of its sensors' errors alone. Those of efforts average out: with V = Σ weight² · s², s²
/// their variance proxy (error_class.hpp), |S − bias| <= L/λ + λV/2 for a λ that is fixed beforehand, but for the
/// probability 2e^{−L}, and the least of that over several λ at no more than a part of that risk for each
/// (averaged_radius(); method of mixtures: Robbins 1970; de la Peña, Klass, Lai 2004). All else counts at its worst:
/// bias, the angles' errors, what happens between samples, and any θ of the set. A sum is looked at `checks` times in
/// its scale, and the risks of all looks at all sums add up to ScaleDetectorOptions::false_alarms. No assumption on the
/// drive, the noise's law, or when a fault comes.
///
/// step() does not allocate but in linear programs where the set has more vertices than a table takes. Memory and work
/// per sample do not depend on time.
class ScaleDetector {
 public:
  /// Throws InvalidArgument where `model.at_risk` is missing or makes no sense.
  explicit ScaleDetector(const OnlineModel& model, ScaleDetectorOptions options = {});

  /// Forgets all samples.
  void restart();
  /// Takes a sample (RegressorFilter::step). Returns whether a sum was looked at; looks() are those then. A sample that
  /// is not whole (detector.hpp) is as good as lost.
  bool step(double t, std::span<const double> sample);
  /// The sums that were looked at with the last sample.
  [[nodiscard]] std::span<const SumState> looks() const { return {looks_.data(), looked_}; }
  /// True if one of them is outside.
  [[nodiscard]] bool alarm() const { return alarm_; }

  [[nodiscard]] const std::vector<SumWeight>& weights() const { return weights_; }
  /// s.
  [[nodiscard]] const std::vector<double>& scales() const { return risk_.scales; }
  [[nodiscard]] const filter::ElementFilter& elements() const { return elements_; }
  /// g of the newest element (weights × outputs).
  [[nodiscard]] const Eigen::ArrayXXd& element_weights() const { return g_; }
  [[nodiscard]] const filter::PredictableRegressor& foreseen() const { return foreseen_; }
  /// The set at a stated risk, and θ̂.
  [[nodiscard]] const ThresholdRule& rule() const { return rule_; }
  [[nodiscard]] const RiskModel& risk() const { return risk_; }
  [[nodiscard]] const ScaleDetectorOptions& options() const { return options_; }
  [[nodiscard]] SumConstants constants() const;
  /// V of every sum now, of proxies for every λ (weights × scales).
  [[nodiscard]] Eigen::MatrixXd variances() const;

 private:
  // c0 + c1 x (+ c2 x²) of every weight, x = age/T.
  struct Scale {
    double T = 0.0, decay = 1.0, delta = 0.0, since = 0.0, risk = 0.0, cost = 0.0, samples = 0.0;
    Eigen::ArrayXd usual, reach;       // usual_multiple(), and that times the most that a kernel is
    Eigen::ArrayXXd linear0, linear1;  // weights × Columns, parameters from kParameters on
    Eigen::ArrayXXd v0, v1, v2;        // variance for every λ, and where errors have a deviation for small λ
    Eigen::ArrayXd u0, u1, u2;         // squares of the weights of errors of the motion
  };
  // What a sum has, what a fault adds to it, what errors do to it at worst, its regressor.
  enum Columns : Eigen::Index { kValue, kResponse, kWorst, kParameters };

  void begin();
  void weigh();
  void take();
  void fade();
  void look(Scale& scale, std::size_t which);

  filter::ElementFilter elements_;
  filter::PredictableRegressor foreseen_;
  RiskModel risk_;
  ScaleDetectorOptions options_;
  ThresholdRule rule_;
  std::vector<SumWeight> weights_;
  std::vector<Scale> states_;
  Eigen::VectorXd largest_;    // |θ|
  Eigen::VectorXd half_;       // sides of the set's hull from θ̂ on
  Eigen::MatrixXd inverse_;    // (N Nᵀ)⁻¹, N the model's input
  Eigen::MatrixXd to_joints_;  // joints × outputs: N⁺
  Eigen::MatrixXd slope_gain_;  // outputs × outputs: |·|² bounds that of what θ makes of errors of slopes in the joints
  Eigen::VectorXd speed_gain_;    // outputs: the most that θ makes of errors of all joints' speeds
  bool averages_ = false;         // errors of efforts
  filter::SampleClass effort_{};  // of one effort
  bool varied_ = false;           // their deviation is below their bound
  double square_ = 0.0;           // its proxy for every λ
  double variance_ = 0.0;         // for small λ
  double third_ = 0.0;            // of the largest error, times its multiplicity
  Eigen::ArrayXXd g_, g1_;        // weights × outputs: of the newest element and the one before
  Eigen::ArrayXXd c_, c1_, c2_;   // slope_gain_ times these
  Eigen::ArrayXXd joint_g_;       // weights × joints: what errors of efforts are multiplied with
  Eigen::VectorXd torque_;
  core::RowMatrix Y_;
  Eigen::ArrayXXd signals_;  // weights × Columns: of the newest element
  Eigen::ArrayXd cut_;       // weights: what taking the newest element out of a smooth sum costs, in units of K
  Eigen::ArrayXd turning_, efforts_, efforts1_, spread_;
  Eigen::ArrayXXd squares_, a0_, a1_;
  std::array<double, 4> steps_{};  // the newest last
  std::size_t taken_ = 0;
  std::vector<SumState> looks_;
  std::size_t looked_ = 0;
  bool alarm_ = false;
  std::vector<double> direction_;
};

/// λ that averaged_radius() looks at: the first in units of the usual one, each twice the one before; up to the usual
/// one small variances hold.
inline constexpr int kMultiples = 8, kUsualMultiple = 2;
inline constexpr double kFirstMultiple = 0.25;
/// What each of them, to either side, may cost for all to have the risk e^{−L}.
[[nodiscard]] double mixture_cost(double L);
/// The λ that is best for a usual drive's variance, of which V0 is RiskModel::usual; 0 where that is 0.
[[nodiscard]] double usual_multiple(double V0, double cost);
/// Bound on the share in a sum of errors whose summed variance proxies are `V` for |λ| <= `usual`, and `all` >= V for
/// every λ: min of cost/λ + λV/2 over the λ above, to be exceeded with a probability of at most e^{−L} with `cost` =
/// mixture_cost(L) (e^{λS − λ²V/2} is a supermartingale). Infinite where `usual` is 0.
[[nodiscard]] double averaged_radius(double V, double all, double cost, double usual);

/// Walks `log` through `detector`, which forgets all samples where a segment begins. After each sample calls visit(t,
/// whether it begins a segment, whether sums were looked at).
template <typename Visit>
void walk_log(LogSource& log, ScaleDetector& detector, Visit&& visit) {
  core::for_each_sample(log, detector.elements().measurement().columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      detector.restart();
    }
    const bool looked = detector.step(sample.t, sample.values);
    visit(sample.t, sample.starts, looked);
  });
}

/// V0 of every sum for RiskModel::usual: a share of the mean V on a log of usual driving.
[[nodiscard]] Eigen::MatrixXd usual_variances(LogSource& log, const OnlineModel& model);

}  // namespace wheelwright::detector

namespace wheelwright {
using detector::ScaleDetector;
}  // namespace wheelwright
