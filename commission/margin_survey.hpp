// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detectability of a commissioned robot along a drive: both residuals, all faults.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "core/warrant.hpp"
#include "detector/detector_options.hpp"
#include "detector/faults/margins.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// Options of survey_margins().
struct MarginSurveyOptions {
  detector::MarginOptions margins;  ///< persistence is the model's where `persistence` below is not given
  std::optional<detector::Persistence> persistence{};
  detector::ParameterSetKind set = detector::ParameterSetKind::polytope;
  std::vector<std::string> faults{};  ///< names; empty: the whole catalogue
  std::size_t map_points = 15;        ///< on each axis of the maps; 0: none
  std::size_t risk_onsets = 60;       ///< at most as many of the onsets are asked at the stated risk; 0: none
};

/// Maps of one fault on one side.
struct FaultMaps {
  std::string fault;
  double side = 1.0;
  detector::OperatingMap speeds;         ///< at no acceleration
  detector::OperatingMap accelerations;  ///< at the drive's typical speeds (root mean square)
};

/// Margins in one residual.
struct ResidualMargins {
  std::string name;                                     ///< "torque" or "kinematic"
  std::vector<std::string> outputs;                     ///< channels
  std::vector<detector::FaultMargins> margins;          ///< of the faults that this residual can see at all
  std::vector<std::string> blind;                       ///< faults that leave no trace in it, whatever their size
  std::vector<FaultMaps> maps;                          ///< torque only
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of the thresholds: in which sense a size is certain
};

/// Margins in the sums over scales: certain but for a stated chance.
struct RiskMargins {
  double risk = 0.0;            ///< that the sets lack the true parameters
  double miss = 0.0;            ///< a fault of a certain size is missed with at most this probability
  double false_alarms = 0.0;    ///< at most as many are to be expected in a second
  std::vector<double> windows;  ///< s: those of the survey, and 1, 5, 10 and 20 s
  std::vector<detector::FaultMargins>
      margins;  ///< in either residual, of the whole catalogue; of its onsets at most MarginSurveyOptions::risk_onsets
  std::vector<detector::FaultMargins> pose;           ///< those of them that are seen in the pose, in it alone
  core::Warrant warrant = core::Warrant::guaranteed;  ///< extrapolated where the errors were estimated from a log
  bool torque = false;                                ///< sums of torque take part
};

/// Everything that `wheelwright margins` says.
struct MarginSurvey {
  std::vector<double> windows;  ///< s
  detector::Persistence persistence;
  double noise_share = 0.0;
  double seconds = 0.0;                                                     ///< of driving
  std::vector<std::pair<detector::ManoeuvreKind, std::size_t>> manoeuvres;  ///< onsets of each kind in the drive
  std::vector<ResidualMargins> residuals;     ///< torque; kinematic where model and log have it
  std::vector<core::Assumption> assumptions;  ///< of the model
  std::string without_kinematic;              ///< why there is no kinematic residual; empty where there is one
  std::optional<RiskMargins> at_risk;         ///< where the model says something at a stated risk
  std::string without_risk;                   ///< why there is nothing at a stated risk; empty where there is
};

/// Walks `log`, a drive whose motion is taken as a reference, and asks of every fault of the catalogue what is certain
/// to be seen. Throws InvalidArgument when the log lacks a column of the model's measurement, has no settled instant,
/// or a name is none of the catalogue's.
[[nodiscard]] MarginSurvey survey_margins(LogSource& log, const OnlineModel& model,
                                          const MarginSurveyOptions& options = {});

/// Names of the faults that a first look asks for, as far as the robot can have them: both wheels' radii, and the
/// effort of the first joint that is lost in part or biased.
[[nodiscard]] std::vector<std::string> telling_faults(const OnlineModel& model);

/// survey_margins() of these faults, from at most 30 onsets in the log's beginning (beginning_of(), 600 s), within 0.1
/// to 20 s, without maps: for the first screen of a page. Nothing where that has no stretch in which the filter has
/// settled. The result does not depend on `threads`.
[[nodiscard]] std::optional<MarginSurvey> first_look(LogSource& log, const OnlineModel& model, std::size_t threads = 1);

}  // namespace wheelwright::commission
