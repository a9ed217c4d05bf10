// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a designed manoeuvre.
#pragma once

#include <string>

#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "gap/next/discrimination_design.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// One self-contained HTML page: what was designed in words, the promised bounds beside those of the model and of a
/// figure eight, the path, the commands over time, how much of each limit is used. `context.signals` is not
/// used.
[[nodiscard]] std::string design_report(const design::BoundsDesign& design, const design::DesignSubject& subject,
                                        const design::MotionLimits& limits, const ReportContext& context);

/// The same for an inspection: from which size on each fault is certainly found, beside what a figure eight would find.
[[nodiscard]] std::string design_report(const design::DetectionDesign& design, const design::DesignSubject& subject,
                                        const design::MotionLimits& limits, const ReportContext& context);

/// The same for telling causes apart: how well each rival is told from each other one, beside a figure eight.
[[nodiscard]] std::string design_report(const gap::DiscriminationDesign& design, const design::DesignSubject& subject,
                                        const design::MotionLimits& limits, const ReportContext& context);

}  // namespace wheelwright::report
