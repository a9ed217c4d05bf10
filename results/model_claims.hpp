// SPDX-License-Identifier: Apache-2.0
/// \file
/// Claims of model.json that `wheelwright check` verifies: bounds and sets with their proofs.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/feasible_set.hpp"
#include "bounds/slab_rows.hpp"
#include "commission/at_risk/risk_set.hpp"
#include "core/interval.hpp"
#include "core/warrant.hpp"
#include "detector/learnt_model.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/recorded_log.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/odometry_measurement.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::results {

/// A row of a log, or a side of the prior box, and its multiplier in a proof, as model.json names them.
struct NamedRow {
  bounds::RowOrigin origin;
  double multiplier = 0.0;
};

/// A published bound and its proof.
struct PublishedBound {
  double value = 0.0;
  std::vector<NamedRow> proof;
};

/// A half-space of the set at a stated risk, and its multiplier in a proof.
struct NamedRiskRow {
  commission::RiskOrigin origin;  ///< a sum's number is that in RiskClaims::sums
  double multiplier = 0.0;
};

/// What a model.json claims at a stated risk, and what is needed to prove it again from the log.
struct RiskClaims {
  detector::RiskModel model;                            ///< its set, risk and errors are what is proved
  std::vector<commission::RiskOrigin> origin;           ///< of model.facets
  std::vector<std::vector<NamedRiskRow>> lower, upper;  ///< proof of model.box, side by side
  Box box;                                              ///< over which the sums hold
  double learning = 0.0;                                ///< commission::RiskSetOptions::learning
  std::vector<commission::RiskEllipsoid> ellipsoids;
  std::vector<commission::RiskFacet> sums;               ///< apart from their rounding
  std::map<std::string, Interval> parameters, physical;  ///< intervals as they are published, by name
};

/// Claims about a feasible set.
struct SetClaims {
  std::string key;  ///< that the model file has it under, for messages: "feasible_set"
  std::vector<std::string> parameter_names, output_names;
  Box prior;  ///< in which the set was sought
  FeasibleSet::Status set = FeasibleSet::Status::nonempty;
  std::vector<PublishedBound> lower, upper;  ///< of each parameter
  std::vector<NamedRow> contradiction;       ///< where the set is empty
  std::vector<bounds::HalfSpace> facets;     ///< of the set, with their origins; else none
  Box hull;                                  ///< of the set; the prior where it is empty
  std::vector<std::size_t> dropped;          ///< rows left out as outliers
  std::size_t sign_parts = 1;                ///< FeasibleSet::sign_parts
  bool guaranteed = false;                   ///< the model or one of these bounds is called so
};

/// Claims about wheel radii and yaw gains.
struct KinematicClaims : SetClaims {
  detector::KinematicModel model;
  filter::OdometryErrors errors;          ///< of the rows of the log
  std::vector<core::NoiseOrigin> origin;  ///< one for each output
  std::optional<SetClaims> at_risk;       ///< the set at a stated risk, where it has one with proofs
  double learning = 0.0;                  ///< of that: share of the log of which V0 is learnt
};

/// Claims of a model.json about θ, and all that is needed to prove them again from the log; `wheelwright check`
/// verifies them.
struct ModelClaims : SetClaims {
  Robot robot;
  Model model;
  Measurement measurement;
  FilterDesign filter;
  filter::SignalErrors errors;                          ///< of the rows of the log: Commissioning::row_errors
  std::vector<core::NoiseOrigin> origin;                ///< of errors.output, one for each output
  std::optional<filter::SignalErrors> detector_errors;  ///< of driving to come; none without a model
  std::map<std::string, Interval> physical;             ///< bounds by physical name; none where there is no scale
  std::vector<bool> left_out;                           ///< p: parameters whose columns the rows of the set lack
  std::vector<logs::LogFileReport> files;               ///< path, hash, bytes and rows of each file of the log
  std::size_t rows = 0;                                 ///< of the log
  std::size_t segments = 0;                             ///< of the log
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of the bounds, as the model states it
  std::vector<core::Assumption> assumptions;            ///< that it took; none of a model from before it listed them
  std::optional<RiskClaims> at_risk;                    ///< what it says at a stated risk
  std::optional<KinematicClaims> kinematic;             ///< of the kinematic residual, where it has one with proofs
  bool unproved_kinematic = false;                      ///< it has one without: it was written before there were any
};

/// Reads the claims of a model.json, also of one that holds no model. Throws InputError, naming file and key, when it
/// is no such file, when it has no certificates (it was written before there were any), or when a number is missing or
/// impossible. Multipliers are read as they stand: to judge them is the checker's work.
[[nodiscard]] ModelClaims read_claims(const std::filesystem::path& path);

/// The same from JSON; `file` is for messages.
[[nodiscard]] ModelClaims claims_from_json(const Json& json, const std::string& file);

}  // namespace wheelwright::results
