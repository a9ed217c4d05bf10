// SPDX-License-Identifier: Apache-2.0
/// \file
/// Trial of one detector on a log: commissioning with a filter and a guarantee, then minimum detectable faults.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commission/commission.hpp"
#include "core/log.hpp"
#include "detector/events.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// A fault that a detector is chosen for.
struct StatedFault {
  std::string name;              ///< of fault_catalogue()
  std::optional<double> size{};  ///< its magnitude, > 0, on both sides where the fault's range has it on both; nothing:
                                 ///< 0.2 of a share, 1 of a fault that is there or not
};

/// Promise of a detector about false alarms.
enum class Guarantee {
  never,         ///< none while noise stays inside its declared bounds, whatever it does there
  hourly,        ///< one in an hour with at most the stated probability, for independent zero-mean noise inside its
                 ///< declared bounds; learning from the log is counted in
  extrapolated,  ///< noise is not declared: its bounds are extrapolated from the log's residuals (noise_level.hpp)
};

/// Options of a trial.
struct TrialOptions {
  std::vector<StatedFault> faults;
  double window = 1.0;           ///< s, in which a fault is to be seen
  double false_alarms = 0.0;     ///< probability of one in an hour, in [0, 1); 0: never
  double onset_step = 0.5;       ///< s between the onsets that are tried, at least
  std::size_t most_onsets = 60;  ///< over the log; the same for every detector, as far as its filter has settled there
  std::size_t tried = 1;         ///< detectors that are tried on this log, of which one is chosen (hourly_confidence)
  CommissionOptions commission{};  ///< guarantee and persistence apart
  std::size_t threads = 1;
};

/// What is certain of a stated fault: order statistics over the onsets while the robot moves whose window fits.
struct StatedSizes {
  double median = 0.0;  ///< smallest size that is certain within the window; infinite where fewer than half have one
  double worst = 0.0;   ///< the same, at every onset
  double delay = 0.0;   ///< s until a fault of the stated size is certain to be seen, median, a fortieth of the window
                        ///< too long at most; infinite where it is not, at half of the onsets
  std::vector<double> medians{};  ///< `median` within each fortieth of the window
};

/// One stated fault on one side: for every noise within its bounds, and where the model says something at a stated
/// risk, by sums over scales (detector/multiscale/sum_margins.hpp).
struct StatedMargin : StatedSizes {
  std::string fault;
  std::string unit;
  double side = 1.0;   ///< 1: positive magnitudes, −1: negative ones
  double asked = 0.0;  ///< its stated size
  std::size_t onsets = 0;
  std::optional<StatedSizes> at_risk{};
  std::optional<StatedSizes> either{};  ///< by whichever is certain of the smaller size, onset by onset
};

/// A detector and what it is worth.
struct DetectorCandidate {
  FilterDesign filter;
  Guarantee guarantee = Guarantee::never;
  detector::Persistence persistence;
  std::string origin;                  ///< how it became a candidate
  std::string failure{};               ///< why there is no such detector; empty where there is one
  std::vector<StatedMargin> faults{};  ///< in the order of TrialOptions::faults, the positive side first
  /// Largest of median/asked, and of the delays, over the faults that count (choose_detector).
  double size = std::numeric_limits<double>::infinity();
  double delay = std::numeric_limits<double>::infinity();
  std::optional<double> size_at_risk{};  ///< the same of StatedMargin::at_risk; nothing where there is none
  std::optional<double> miss{};          ///< at the stated risk: a certain fault is missed with no more probability
  core::Warrant risk_warrant = core::Warrant::guaranteed;  ///< of what is said at the stated risk
};

/// Confidence at which noise is propagated (PropagationOptions::confidence, for the log's `rows`) so that, with
/// probability at least 1 − `false_alarms`, every row of an hour of driving at `step` (s) *and* of the log, under each
/// of `tried` filters of which one is chosen, obeys its bound: the true θ lies in the set that was learned, and no
/// alarm follows. All have the same bounds, so the union bound shares P out by rows: 1 − confidence =
/// P·rows/(tried·rows + rows of an hour). Throws InvalidArgument unless 0 < false_alarms < 1, rows >= 1, step > 0 and
/// tried >= 1.
[[nodiscard]] double hourly_confidence(double false_alarms, double rows, double step, std::size_t tried = 1);

/// A model and its candidates, one for each persistence.
struct Trial {
  std::optional<Commissioning> commissioning;  ///< nothing where commissioning threw
  std::vector<DetectorCandidate> candidates;
};

/// Commissions `robot` on `log` with `filter`, under a guarantee of options.false_alarms, and asks for the margins of
/// the stated faults along the same log under each of `persistences`. Commissioning that fails, for what the data say
/// or because the filter does not fit the log, is in DetectorCandidate::failure. Throws as validate().
[[nodiscard]] Trial try_detector(const LogTable& log, const Robot& robot, const FilterDesign& filter,
                                 const std::vector<detector::Persistence>& persistences, const std::string& origin,
                                 const TrialOptions& options);

/// The candidates of a commissioning that try_detector() made with the same options, under other `persistences`.
[[nodiscard]] std::vector<DetectorCandidate> candidates_of(const LogTable& log, const Commissioning& commissioning,
                                                           const FilterDesign& filter,
                                                           const std::vector<detector::Persistence>& persistences,
                                                           const std::string& origin, const TrialOptions& options);

/// The kinematic residual for TrialOptions::commission of trials with filters of `order`: none of them changes it. Null
/// where it cannot be made; the trials then say why. Throws as validate().
[[nodiscard]] std::shared_ptr<const KinematicPart> kinematic_part_of(const LogTable& log, const Robot& robot, int order,
                                                                     const TrialOptions& options);

/// Throws InvalidArgument unless lengths are positive, the probability is in [0, 1), and every fault is one of the
/// catalogue's, stated once, with a size inside its range (of a mass: when it is found).
void validate(const TrialOptions& options, const Robot& robot);

}  // namespace wheelwright::commission
