// SPDX-License-Identifier: Apache-2.0
/// \file
/// The choice of an estimator as JSON, alike in model.json and identification.json.
#pragma once

#include <wheelwright/files/json_file.hpp>
#include <wheelwright/identify/estimator_choice.hpp>

namespace wheelwright {

/// The numbers of `v` as an array.
[[nodiscard]] Json numbers(const Eigen::VectorXd& v);

/// All candidates of `choice`, in their order (definition estimator_candidate of model.schema.json).
[[nodiscard]] Json candidates_json(const EstimatorChoice& choice);

/// Durbin, Wu and Hausman's test (definition endogeneity_test); null where it was not made.
[[nodiscard]] Json endogeneity_json(const EstimatorChoice& choice);

}  // namespace wheelwright
