// SPDX-License-Identifier: Apache-2.0
/// \file
/// A designed manoeuvre in a few lines for a terminal.
#pragma once

#include <string>

#include <wheelwright/design/detection.hpp>
#include <wheelwright/design/manoeuvre.hpp>
#include <wheelwright/gap/discrimination_design.hpp>

namespace wheelwright::words {

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::BoundsDesign& design, const design::DesignSubject& subject);

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::DetectionDesign& design);

/// The result for a terminal.
[[nodiscard]] std::string summary(const gap::DiscriminationDesign& design);

}  // namespace wheelwright::words
