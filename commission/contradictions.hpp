// SPDX-License-Identifier: Apache-2.0
/// \file
/// Contradictions: findings that contradict what a commissioned model takes for granted, and the search for them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "commission/contradiction.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"
#include "model/filter/noise.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

struct Commissioning;
struct Explained;
struct Fit;
struct Setting;

/// A constant shift in time between effort and motion, by least squares over filtered rows (TimeShiftedRows).
struct EffortTiming {
  double delay = 0.0;           ///< s; > 0: the logged effort comes late
  double standard_error = 0.0;  ///< s, valid under autocorrelated residuals
  double freedom = 1.0;         ///< degrees of freedom of its Student's t
  Interval allowed{};           ///< s, what is taken as given: allowed_shift()
  double residual_ratio = 1.0;  ///< rms residual with the shift over that with the nearest one that is allowed
  double mirror_ratio = 1.0;    ///< the same as far on the other side of that: above 1 for a true shift
  double score = 0.0;  ///< of a shift at the nearest one that is allowed, as a multiple of what is told from none at a
                       ///< risk of 1e-8: its sign is that of the shift, whatever interpolation makes of noise
  double moved = 0.0;  ///< largest change of a parameter from the one to the other, in its standard errors
  Interval open{};     ///< s, the shifts that the log does not exclude at a risk of kRiskOfDoubt
  /// By how much the estimate (p) changes from the nearest shift that is allowed to either end of `open`; empty for an
  /// end that is allowed to kLeastShift of a step.
  std::array<Eigen::VectorXd, 2> open_change{};

  /// s, how far the shift lies outside of what is allowed; 0 inside.
  [[nodiscard]] double beyond() const { return std::max({0.0, allowed.lower - delay, delay - allowed.upper}); }
};

/// s, the shifts that the bounds of the rows of a set allow for, of a log with steps of `step` (s).
[[nodiscard]] Interval allowed_shift(const filter::Measurement& measurement, double step);

/// The shift that explains the first `most_rows` rows of `log` best, at most `longest` s beyond what is declared, or
/// beyond that with its sign turned; nothing where none is told (flat, at the end of what is searched, segments too
/// short, unsigned efforts). Ratios, score and moved are told of a shift that is beyond what is allowed.
[[nodiscard]] std::optional<EffortTiming> effort_timing(LogSource& log, const Setting& setting, const Fit& fit,
                                                        double longest = 0.2, std::size_t most_rows = 60000);

/// True if `timing` is a latency that a model must not be made with: beyond what is allowed, told from that at a risk
/// of 1e-8 (Student's t) and further from it than a quarter of `step` (s), of an effect that is not symmetric in the
/// sign of the shift (interpolation averages noise, which lowers the residual for a shift either way, and makes a
/// minimum half a step off look sharp: the score at the nearest shift that is allowed must tell it as well), and one
/// that either lowers the residual by 1 % or more or moves a parameter by two standard errors. Healthy logs with even
/// steps showed 0.09 steps at most.
[[nodiscard]] bool is_latency(const EffortTiming& timing, double step);

/// True if `timing` is likely to be a latency: beyond what is allowed by more than a quarter of `step` (s), and told
/// from that at a risk of 1 %. Bounds that take it for none are not called guaranteed.
[[nodiscard]] bool may_be_latency(const EffortTiming& timing, double step);

/// True if the best shift lies further beyond what is allowed than a quarter of `step` (s) and two standard errors: no
/// evidence by itself, but a cause to look at where something else contradicts the log.
[[nodiscard]] bool looks_shifted(const EffortTiming& timing, double step);

/// s, a constant shift beyond what is declared that is_latency() would tell nearly always, of `step` (s) and the
/// uncertainty of `timing`.
[[nodiscard]] double told_shift(const EffortTiming& timing, double step);

/// Findings about the signals of a log, before any feasible set is computed.
struct SignalFindings {
  std::vector<LogContradiction> contradictions;
  std::optional<EffortTiming> timing;  ///< nothing where no shift is told, or was not looked for
  Premises premises;                   ///< not tested where the signals themselves are contradicted
};

/// Wrapped angles, constant and unrelated efforts; where there are none, timing, wrong signs, wheels that disagree, and
/// premises that fail. Walks `log` a few times.
[[nodiscard]] SignalFindings contradictions_in_log(LogSource& log, const Setting& setting, const Fit& fit);

/// Of a log that no parameters explain within its declared noise: whether each of its halves has some that do.
[[nodiscard]] bool halves_are_explained(LogSource& log, const model::Robot& robot);

/// What is said then, and what to do about it.
inline constexpr std::string_view kOnlyInHalves =
    "each of its halves has parameters that explain it: mass, friction or an offset of the efforts may have changed in "
    "between";
inline constexpr std::string_view kWhatChanged =
    "drive with one load and warm, or commission the parts apart and `wheelwright compare` their models; or the bounds "
    "under `noise:` are a little too small";

/// Contradictions within a finished commissioning: estimates outside their set, shifts of `timing` that the log does
/// not exclude and with which they would be, held-out rows outside the thresholds, a noise bound that had to be raised
/// by `raised` for the prior box to explain the log.
[[nodiscard]] std::vector<LogContradiction> contradictions_in_result(const Commissioning& result,
                                                                     const Setting& setting,
                                                                     const std::optional<EffortTiming>& timing,
                                                                     double raised);

/// What a shift is beside declared errors.
enum class ShiftWeight {
  explained,  ///< none, by chance or by what is unknown between samples
  doubted,    ///< chance does not explain it: nothing is called guaranteed
  told,       ///< the worst noise does not either, or a quarter of the residual goes with it: no model
};

/// Weighs `timing` in a log of declared noise, of steps of `step` (s), against `explained`.
[[nodiscard]] ShiftWeight weigh_shift(const EffortTiming& timing, const Explained& explained, double step);

/// Weighs what statistics found in a log of declared noise against `explained`: Kind::effort_timing by weigh_shift()
/// (one that is explained is dropped). Kind::wrong_sign and Kind::estimate_outside keep LogContradiction::withdraws
/// beyond all of it alone; where `errors_average` (premises.hpp; elsewhere noise explains them as well) they are
/// LogContradiction::demotes beyond what is in doubt.
void weigh_contradictions(Commissioning& result, const Setting& setting, const Fit& fit,
                          const std::optional<EffortTiming>& timing, const Explained& explained, bool errors_average);

/// What declared errors make of a log before it is commissioned: what commission_robot() will make of it.
struct WithinDeclared {
  bool a_set = true;  ///< some parameters in the prior explain every row
  ShiftWeight shift = ShiftWeight::explained;
};

/// The verdict on `log` in a setting whose noise is declared, with the shift that was found in it. Walks the log a few
/// times, as long as a feasible set takes.
[[nodiscard]] WithinDeclared within_declared(LogSource& log, const Setting& setting, const Fit& fit,
                                             const std::optional<EffortTiming>& timing);

/// Kind::effort_timing of `timing` in words, whatever its size: efforts that are late or early, or speeds that are
/// smoothed. Walks the log twice.
[[nodiscard]] LogContradiction shift_finding(LogSource& log, const Setting& setting, const Fit& fit,
                                             const EffortTiming& timing);

/// True if weigh_contradictions() would change anything.
[[nodiscard]] bool wants_weighing(const Commissioning& result, const Setting& setting);

/// Weighs what says that an effort is wrong against the declared errors of the rows (`errors`, with parameters in
/// `box`): Kind::effort_unrelated is dropped where these are as large as the efforts, Kind::wheels_disagree only
/// demotes where they are large enough for it.
void weigh_efforts(LogSource& log, const Setting& setting, const filter::SignalErrors& errors, const Box& box,
                   std::vector<LogContradiction>& contradictions);

}  // namespace wheelwright::commission
