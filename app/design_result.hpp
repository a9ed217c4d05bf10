// SPDX-License-Identifier: Apache-2.0
/// \file
/// A designed manoeuvre as JSON and as a few lines of text.
#pragma once

#include <string>

#include <wheelwright/design/detection.hpp>
#include <wheelwright/design/manoeuvre.hpp>
#include <wheelwright/files/json.hpp>
#include <wheelwright/gap/discrimination_design.hpp>

namespace wheelwright::app {

/// The result as JSON, schema "wheelwright/design/1": limits and their use, θ as believed, and bounds in the units of
/// θ_L (promised; of the model, where there is one; of the figure eight, where there is one), with the physical half
/// widths.
[[nodiscard]] Json to_json(const BoundsDesign& design, const DesignSubject& subject, const MotionLimits& limits);

/// The result for a terminal.
[[nodiscard]] std::string summary(const BoundsDesign& design, const DesignSubject& subject);

/// The same for an inspection: smallest sizes that are certainly found, by the plan and by the figure eight.
[[nodiscard]] Json to_json(const DetectionDesign& design, const MotionLimits& limits);

/// The result for a terminal.
[[nodiscard]] std::string summary(const DetectionDesign& design);

/// The same for telling causes apart: how well each rival, being true, is told from each other one.
[[nodiscard]] Json to_json(const DiscriminationDesign& design, const MotionLimits& limits);

/// The result for a terminal.
[[nodiscard]] std::string summary(const DiscriminationDesign& design);

}  // namespace wheelwright::app
