// SPDX-License-Identifier: Apache-2.0
/// \file
/// Result of a model check for a terminal, as JSON and as a page.
#pragma once

#include <string>
#include <vector>

#include "model_check.hpp"

namespace wheelwright::app {

/// The files of a check, as they were named.
struct CheckedFiles {
  std::string model;
  std::vector<std::string> logs;
};

/// Scope of the proof and its limits, one sentence or two.
[[nodiscard]] std::string proof_scope(const ModelClaims& claims);

/// The answer in one sentence.
[[nodiscard]] std::string verdict(const ModelCheck& check, const ModelClaims& claims);

/// The answer, a short table and what is not proved, for a terminal.
[[nodiscard]] std::string summary(const ModelCheck& check, const ModelClaims& claims);

/// The same as JSON (results/check.schema.json).
[[nodiscard]] Json to_json(const ModelCheck& check, const ModelClaims& claims, const LogReport& data,
                           const CheckedFiles& files);

/// The same as one self-contained HTML page.
[[nodiscard]] std::string check_report(const ModelCheck& check, const ModelClaims& claims, const CheckedFiles& files);

}  // namespace wheelwright::app
