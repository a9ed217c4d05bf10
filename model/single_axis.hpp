// SPDX-License-Identifier: Apache-2.0
/// \file
/// One driven axis, linear or rotary: effort = inertia·q̈ + viscous·q̇ [+ coulomb·sgn q̇] [+ offset].
#pragma once

#include "model/model.hpp"

namespace wheelwright::model {

/// A single axis; log columns `position`, `velocity`, `effort`.
struct SingleAxis {
  bool coulomb = false;  ///< with dry friction, effort unit
  bool offset = false;   ///< with a constant offset of the effort

  /// The model with θ_L = [inertia, viscous(, coulomb)(, offset)].
  [[nodiscard]] Model model() const;
};

}  // namespace wheelwright::model
