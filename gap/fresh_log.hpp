// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether what was found on one log holds on another one.
#pragma once

#include <vector>

#include <wheelwright/gap/diagnose.hpp>

namespace wheelwright {

/// What the model leaves of the filtered efforts of `fresh`, a log of the same robot that was not looked at: the nominal
/// model (`before`), and the one with θ and causes as `found` has them (`after`, with the interval of a block bootstrap);
/// nothing is fitted to it. With the filter of `found`, `options` and `baseline` as it was made with; nothing for a log
/// without efforts. Throws as diagnose() does.
[[nodiscard]] std::vector<ShrinkFigure> torque_on(LogSource& fresh, LogSource* baseline, const Robot& robot,
                                                  const Diagnosis& found, const DiagnoseOptions& options = {});

}  // namespace wheelwright
