// SPDX-License-Identifier: Apache-2.0
/// \file
/// The points of a study as items of work, and the derivatives at its nominal point.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "study/bound_derivatives.hpp"
#include "study/study.hpp"
#include "study/work.hpp"

namespace wheelwright::study {

/// The point of an item.
[[nodiscard]] Eigen::VectorXd point_of(const StudyDesign& design, std::size_t item);

/// The items of a design, evaluate_point() as text_of() each. Keeps references to both.
[[nodiscard]] Work work_of(const Study& study, const StudyDesign& design);

/// Derivatives of the bounds at the nominal point by the inputs that stand in the robot file; nothing where
/// StudyMethods::local is not asked for. Without such an input or a model nothing, and `notes` gets a sentence why.
[[nodiscard]] std::optional<LocalSensitivity> nominal_derivatives(const Study& study, std::vector<std::string>& notes);

}  // namespace wheelwright::study
