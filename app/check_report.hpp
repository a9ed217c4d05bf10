// SPDX-License-Identifier: Apache-2.0
/// \file
/// Result of a model check as a page.
#pragma once

#include <string>

#include "results/model_check.hpp"

namespace wheelwright::app {

/// The check of a model as one self-contained HTML page.
[[nodiscard]] std::string check_report(const results::ModelCheck& check, const results::ModelClaims& claims,
                                       const results::CheckedFiles& files, const std::string& software);

}  // namespace wheelwright::app
