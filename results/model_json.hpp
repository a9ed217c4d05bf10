// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words and parts of model.json that other results have too: warrants, assumptions, error classes, the choice of
/// an estimator, the section `kinematic`.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "commission/commission.hpp"
#include "commission/kinematic.hpp"
#include "core/warrant.hpp"
#include "formats/files/json.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/robot_keys.hpp"
#include "identify/estimate.hpp"
#include "model/filter/error_class.hpp"

namespace wheelwright::results {

inline constexpr files::Words<Commissioning::Status, 5> kStatusWords{
    {{Commissioning::Status::done, "done"},
     {Commissioning::Status::partial, "partial"},
     {Commissioning::Status::empty, "empty"},
     {Commissioning::Status::nothing, "nothing"},
     {Commissioning::Status::contradicted, "contradicted"}}};
inline constexpr files::Words<identify::Excitation, 3> kExcitationWords{
    {{identify::Excitation::identified, "identified"},
     {identify::Excitation::indistinct, "indistinct"},
     {identify::Excitation::not_excited, "not_excited"}}};
inline constexpr files::Words<bounds::Side, 2> kSideWords{
    {{bounds::Side::upper, "upper"}, {bounds::Side::lower, "lower"}}};

/// The numbers of `v` as an array.
[[nodiscard]] Json numbers(const Eigen::VectorXd& v);

/// The files of a log, with their sizes and hashes.
[[nodiscard]] Json files_json(const logs::LogReport& data);

/// All candidates of `choice`, in their order (definition estimator_candidate of model.schema.json).
[[nodiscard]] Json candidates_json(const identify::EstimatorChoice& choice);

/// Durbin, Wu and Hausman's test (definition endogeneity_test); null where it was not made.
[[nodiscard]] Json endogeneity_json(const identify::EstimatorChoice& choice);

/// What kinematic.at_risk calls the one output of its rows (commission::pose_sum_rows()).
inline constexpr const char* kPoseSum = "pose";

/// Names of θ's entries.
[[nodiscard]] std::vector<std::string> parameter_names(const Model& model);

/// Where a half-space comes from; names of parameters and outputs.
[[nodiscard]] Json origin_json(const bounds::RowOrigin& origin, const std::vector<std::string>& parameters,
                               const std::vector<std::string>& outputs);

/// The rows that prove a bound with their multipliers; the check needs no more.
[[nodiscard]] Json proof_json(const std::vector<bounds::WeightedRow>& rows, const std::vector<std::string>& parameters,
                              const std::vector<std::string>& outputs);

/// Lower and upper end of each side.
[[nodiscard]] Json sides_json(const Box& box);

/// Constant thresholds of `outputs` (definition constant_thresholds of model.schema.json).
[[nodiscard]] Json constant_thresholds_json(const detector::ConstantThresholds& thresholds,
                                            const std::vector<std::string>& outputs);

/// What is known of one column's errors, without a deviation that is no less than the bound.
[[nodiscard]] Json error_class_json(const filter::ErrorClass& c);

/// Error classes as model.json has them under `at_risk/errors`.
[[nodiscard]] Json error_classes_json(const filter::ErrorClasses& classes);

/// The section as JSON (results/model.schema.json, definition `kinematic`); nothing where the log had neither pose nor
/// gyro.
[[nodiscard]] std::optional<Json> kinematic_json(const commission::KinematicCommissioning& result,
                                                 const commission::FoldOptions& folds);

}  // namespace wheelwright::results
