// SPDX-License-Identifier: Apache-2.0
/// \file
/// design.json: a designed manoeuvre and what it promises.
#pragma once

#include <string>

#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "formats/files/json.hpp"
#include "gap/next/discrimination_design.hpp"

namespace wheelwright::results {

/// The result as JSON, schema "wheelwright/design/1": limits and their use, θ as believed, and bounds in the units of
/// θ_L (promised; of the model, where there is one; of the figure eight, where there is one), with the physical half
/// widths; and what is promised at a stated risk, where errors average out.
[[nodiscard]] Json to_json(const design::BoundsDesign& design, const design::DesignSubject& subject,
                           const design::MotionLimits& limits);

/// The same for an inspection: smallest sizes that are certainly found, by the plan and by the figure eight.
[[nodiscard]] Json to_json(const design::DetectionDesign& design, const design::MotionLimits& limits);

/// The same for telling causes apart: how well each rival, being true, is told from each other one.
[[nodiscard]] Json to_json(const gap::DiscriminationDesign& design, const design::MotionLimits& limits);

}  // namespace wheelwright::results
