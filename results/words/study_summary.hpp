// SPDX-License-Identifier: Apache-2.0
/// \file
/// A study of sensitivities as tables for a terminal.
#pragma once

#include <optional>
#include <string>

#include "study/bound_derivatives.hpp"
#include "study/study.hpp"

namespace wheelwright::words {

/// One table for each quantity: what each input does to it, by every method that the study asks for; the widths'
/// elasticities; and what could not be evaluated.
[[nodiscard]] std::string summary(const study::Study& study, const study::StudyResult& result,
                                  const std::optional<study::LocalSensitivity>& local);

}  // namespace wheelwright::words
