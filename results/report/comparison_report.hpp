// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of `wheelwright compare`.
#pragma once

#include <string>
#include <vector>

#include "commission/model_comparison.hpp"

namespace wheelwright::report {

/// What two models are and where they come from. Every text may hold anything: it is escaped on the page.
struct ComparisonContext {
  std::string title;
  std::string before, after;         ///< model file and logs of each
  std::vector<std::string> remarks;  ///< what limits the answer, a sentence each
  std::string software;              ///< name and version
};

/// The page.
[[nodiscard]] std::string comparison_report(const commission::ModelComparison& comparison,
                                            const ComparisonContext& context);

}  // namespace wheelwright::report
