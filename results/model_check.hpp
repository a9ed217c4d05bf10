// SPDX-License-Identifier: Apache-2.0
/// \file
/// Verification of a model.json against its log: rows are filtered again, and the proofs of all bounds are checked in
/// exact arithmetic; check.json has the verdict and its scope.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "formats/files/json.hpp"
#include "results/model_claims.hpp"
#include "results/set_check.hpp"

namespace wheelwright::results {

/// What became of the claims at a stated risk (RiskClaims).
struct RiskCheck {
  std::vector<BoundVerdict> bounds;   ///< both ends of each side of the set's hull
  std::size_t sums = 0;               ///< sums that are no sharper than the log makes them
  std::size_t facets = 0;             ///< half-spaces of the set that are what they name, or follow from it
  double spent = 0.0;                 ///< the ellipsoids' risks, added exactly, rounded up
  std::vector<std::string> failures;  ///< everything that is not proved, a sentence each
};

/// Result of check_model().
struct ModelCheck {
  std::vector<BoundVerdict> bounds;                   ///< lower and upper bound of each parameter
  std::optional<bounds::CertificateCheck> emptiness;  ///< where the model says that no θ explains the log
  FacetVerdicts facets;
  std::optional<RiskCheck> at_risk;      ///< where the model says something at a stated risk and has bounds
  std::optional<SetCheck> kinematic;     ///< where the model has a kinematic residual with proofs
  std::optional<SetCheck> pose_at_risk;  ///< where that has a set at a stated risk with proofs
  bool same_log = false;                 ///< same bytes, file by file
  std::vector<std::string> failures;     ///< everything that is not proved, a sentence each
  std::vector<std::string> warnings;     ///< what is worth knowing and contradicts no proof
  std::vector<std::string> premises;     ///< what the proofs stand on and do not prove

  /// True if everything is proved.
  [[nodiscard]] bool proved() const { return failures.empty(); }
};

/// Filters `log` again as the claims say and verifies, exactly (check_certificate.hpp): that each facet is the log's
/// row that it names, or follows from it; that each published bound is proved by the rows that it names; that the hull
/// and the physical intervals contain the proved bounds; or, where the set is said to be empty, that it is. `data` says
/// which files the log is. Rows of columns with noise whose sign the prior leaves open are rebuilt over the box that
/// they prove. The same of wheel radii and yaw gains (ModelClaims::kinematic), whose windows of odometry, and sums of
/// the pose (commission::pose_sum_rows()), are made again.
/// What it says at a stated risk is left to check_at_risk(). Throws InvalidArgument when the log lacks a column.
[[nodiscard]] ModelCheck check_model(const ModelClaims& claims, LogSource& log, const logs::LogReport& data);

/// The files of a check, as they were named.
struct CheckedFiles {
  std::string model;
  std::vector<std::string> logs;
};

/// Scope of the proof and its limits, one sentence or two.
[[nodiscard]] std::string proof_scope(const ModelClaims& claims);

/// The answer in one sentence.
[[nodiscard]] std::string verdict(const ModelCheck& check, const ModelClaims& claims);

/// What is proved of wheel radii and yaw gains, in one sentence.
[[nodiscard]] std::string kinematic_verdict(const SetCheck& check, const KinematicClaims& claims);

/// What is proved of them at a stated risk, in one sentence.
[[nodiscard]] std::string pose_risk_verdict(const SetCheck& check, const KinematicClaims& claims);

/// What is proved at a stated risk, in one sentence.
[[nodiscard]] std::string risk_verdict(const RiskCheck& check, const RiskClaims& claims);

/// The answer as JSON (results/check.schema.json); `software` is name and version.
[[nodiscard]] Json to_json(const ModelCheck& check, const ModelClaims& claims, const logs::LogReport& data,
                           const CheckedFiles& files, const std::string& software);

}  // namespace wheelwright::results
