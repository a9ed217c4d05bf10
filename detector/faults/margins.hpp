// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detectability along a drive: minimum detectable faults by delay and manoeuvre, and maps over the operating space.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "detector/events.hpp"
#include "model/fault_type.hpp"
#include "model/filter/noise.hpp"

namespace wheelwright::detector {

class FaultRows;
struct ReferenceMotion;
class ThresholdRule;

/// Manoeuvre: the kind of motion over a stretch of time.
enum class ManoeuvreKind {
  standstill,
  cruising,      ///< straight, or a single axis, at nearly constant speed
  accelerating,  ///< straight, or a single axis
  turning,       ///< forward and yaw motion
  spinning,      ///< on the spot
};

/// In words, e.g. "cruising straight".
[[nodiscard]] std::string_view manoeuvre_words(ManoeuvreKind kind);

/// Kind of manoeuvre of the instants [first, last) of `motion`, by root mean squares over them: standstill below 3 % of
/// the largest joint speed of the whole motion; of two joints, straight where their difference is below a tenth of
/// their sum, spinning where their sum is below a tenth of their difference; accelerating where the joints'
/// acceleration times the stretch's length is above half their speed.
[[nodiscard]] ManoeuvreKind kind_of(const ReferenceMotion& motion, std::size_t first, std::size_t last);

/// Options of the margins along a drive. Sizes of faults are magnitudes, in the unit of their type.
struct MarginOptions {
  std::vector<double> windows = {0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0};  ///< s, ascending
  double onset_step = 0.5;        ///< s between the onsets that are tried
  std::size_t most_onsets = 120;  ///< onsets are further apart where there would be more
  double kind_window = 1.0;       ///< s after an onset by which its manoeuvre is named
  Persistence persistence{};      ///< of the detector
  double noise_share = 0.0;       ///< of its bounds, that noise may use where a fault is only possibly seen
  std::size_t threads = 1;        ///< the result does not depend on it
  std::function<void(std::string_view stage, double share)> progress = {};  ///< may be empty
};

/// One fault on one side (growing or shrinking) from one onset on. Of a reading that stands still nothing is certain
/// and nothing hidden: the value it holds is that of one sample, and not known beforehand. The time until an alarm
/// counts from the sample of the first instant that the fault has reached, at most a sampling step after the fault.
/// Sizes are absolute; infinite where none is certain in the fault's range. A window that runs past the end of the
/// segment has no value.
struct OnsetMargin {
  std::size_t instant = 0;  ///< of the motion
  double t = 0.0;           ///< of the onset, s: rows that the filter has later know of it
  ManoeuvreKind kind = ManoeuvreKind::standstill;
  std::vector<double> certain;                  ///< per window that fits: every size from here up to the range's end
                                                ///< raises an alarm within it, whatever θ in P and noise
  std::vector<std::vector<double>> by_channel;  ///< the same, output by output
  double hidden = 0.0;                          ///< no size up to this one raises an alarm within the last window that
                                                ///< fits, whatever θ in P and noise of MarginOptions::noise_share
};

/// Margins of a drive for one fault of one sign.
struct FaultMargins {
  FaultType fault;
  double side = 1.0;  ///< 1: positive magnitudes, −1: negative ones
  std::vector<OnsetMargin> onsets;

  /// The largest size that was looked at.
  [[nodiscard]] double largest() const { return side > 0.0 ? fault.range.upper : -fault.range.lower; }
};

/// Order statistics of the smallest certain size over onsets.
struct MarginSummary {
  std::size_t onsets = 0;   ///< with a value
  std::size_t certain = 0;  ///< of these, with a size that is certain
  double best = 0.0;        ///< smallest; infinite where none is certain
  double most = 0.0;        ///< certain at every onset that has a certain size; infinite where there is none
  double median = 0.0;      ///< infinite where fewer than half are certain
  double worst = 0.0;       ///< certain at every onset; infinite where there is one without
};

/// Summary over the onsets of one kind of manoeuvre (or all of them) in window number `window`, of one channel or all.
[[nodiscard]] MarginSummary summarise(const FaultMargins& margins, std::size_t window,
                                      std::optional<ManoeuvreKind> kind = std::nullopt,
                                      std::optional<std::size_t> channel = std::nullopt);

/// Makes the rows of a fault for one thread.
using FaultRowsFactory = std::function<std::unique_ptr<FaultRows>(const FaultType&)>;

/// Margins of `faults`, both sides where their range has two, for a detector with thresholds `rule` on the rows that
/// `rows` makes, along `motion`. Every number is exact over the feasible set (fault_margin.hpp) for the motion as it
/// stands; it is a promise for a robot that drives it, with the encoders seeing what a fault leaves of it.
/// Throws InvalidArgument for windows that do not ascend, an onset step that is not positive, a share of noise outside
/// [0, 1], and a motion without a settled stretch longer than a window.
[[nodiscard]] std::vector<FaultMargins> margins_along(const ReferenceMotion& motion,
                                                      const std::vector<FaultType>& faults, const ThresholdRule& rule,
                                                      const FaultRowsFactory& rows, const MarginOptions& options = {});

/// A plane of operating points: two coordinates' speeds at no acceleration, or their accelerations while passing
/// through the speeds `at`.
struct OperatingPlane {
  bool accelerations = false;  ///< the axes are accelerations
  std::vector<double> x;       ///< of the first coordinate, m/s or m/s²
  std::vector<double> y;       ///< of the second one, rad/s or rad/s²; a single value for models with one coordinate
  Eigen::VectorXd at{};        ///< speeds, one for each coordinate, where the axes are accelerations
};

/// Smallest certain magnitude of a fault on one side at each point, x.size() × y.size(); infinite where none is
/// certain.
struct OperatingMap {
  OperatingPlane plane;
  Eigen::MatrixXd smallest;
};

/// The map of `fault` for a detector with thresholds `rule` whose rows have the errors `errors`, once the filter has
/// settled at each point (settled_rows()). Throws InvalidArgument for empty axes.
[[nodiscard]] OperatingMap operating_map(const FaultType& fault, double side, const Model& model,
                                         const FilterDesign& design, const filter::SignalErrors& errors,
                                         const ThresholdRule& rule, OperatingPlane plane);

}  // namespace wheelwright::detector
