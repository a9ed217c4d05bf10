// SPDX-License-Identifier: Apache-2.0
/// \file
/// The report of `wheelwright gap`.
#pragma once

#include <string>

#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright::report {

/// One self-contained page: the verdict in words; the causes with their parameters; what cannot be told apart on this
/// log, and which drive would; the residual over time before, after θ is fitted again and after the causes are added,
/// with the floor; how far it shrinks; where it lies by channel, regime, frequency and place; the parameters that the
/// missing effect had poisoned; contradictory rows. `robot` is its name, `next_manoeuvre` a sentence for the drive that
/// would tell the causes apart (may be empty). Columns x and y of `context.signals` give the map of places.
[[nodiscard]] std::string gap_report(const Diagnosis& diagnosis, const std::string& robot, const ReportContext& context,
                                     const std::string& next_manoeuvre = {});

}  // namespace wheelwright::report
