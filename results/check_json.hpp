// SPDX-License-Identifier: Apache-2.0
/// \file
/// check.json: the verdict on a model and its scope.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/files/json.hpp>
#include <wheelwright/results/model_check.hpp>

namespace wheelwright::results {

/// The files of a check, as they were named.
struct CheckedFiles {
  std::string model;
  std::vector<std::string> logs;
};

/// Scope of the proof and its limits, one sentence or two.
[[nodiscard]] std::string proof_scope(const ModelClaims& claims);

/// The answer in one sentence.
[[nodiscard]] std::string verdict(const ModelCheck& check, const ModelClaims& claims);

/// What is proved at a stated risk, in one sentence.
[[nodiscard]] std::string risk_verdict(const RiskCheck& check, const RiskClaims& claims);

/// The answer as JSON (results/check.schema.json); `software` is name and version.
[[nodiscard]] Json to_json(const ModelCheck& check, const ModelClaims& claims, const logs::LogReport& data,
                           const CheckedFiles& files, const std::string& software);

}  // namespace wheelwright::results
