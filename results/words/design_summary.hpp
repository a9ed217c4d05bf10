// SPDX-License-Identifier: Apache-2.0
/// \file
/// Designed manoeuvres in lines and tables for a terminal.
#pragma once

#include <string>

#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "commission/design/subject.hpp"
#include "gap/next/discrimination_design.hpp"

namespace wheelwright::words {

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::BoundsDesign& design, const design::DesignSubject& subject);

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::DetectionDesign& design);

/// The result for a terminal.
[[nodiscard]] std::string summary(const gap::DiscriminationDesign& design);

}  // namespace wheelwright::words
