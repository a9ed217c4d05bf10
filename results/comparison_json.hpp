// SPDX-License-Identifier: Apache-2.0
/// \file
/// comparison.json: two models against each other.
#pragma once

#include <string>
#include <vector>

#include "commission/model_comparison.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::results {

/// A model of a comparison: its file, robot and the logs that it was made from.
struct ComparedModel {
  std::string file;
  std::string robot;
  std::string software;
  Json logs = Json::array();  ///< path and hash of each, as model.json has them
  /// Of θ's entries, as the physical quantities behind them where the model has these, and of the wheels.
  std::vector<commission::BestGuess> guesses{};
};

/// What model.json at `file` says of itself. Throws InputError when it is no such file.
[[nodiscard]] ComparedModel compared_model(const std::string& file);

/// The result as JSON (results/comparison.schema.json); `software` is name and version.
[[nodiscard]] Json to_json(const commission::ModelComparison& comparison, const ComparedModel& before,
                           const ComparedModel& after, const std::string& software);

}  // namespace wheelwright::results
