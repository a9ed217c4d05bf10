// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rival causes as a user names them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/effects/effect.hpp"
#include "gap/rival.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::design {
struct DesignSubject;
}  // namespace wheelwright::design

namespace wheelwright::design {
struct MotionLimits;
}  // namespace wheelwright::design

namespace wheelwright::gap {

/// A size that a user gives a cause.
struct NamedSize {
  std::string what;  ///< EFFECT: its first coefficient, the others in proportion, or its first shape where it has none;
                     ///< EFFECT.PARAMETER: that coefficient or shape
  std::function<double(const std::string& unit)> value;  ///< in this unit, "1" for a pure number
  std::string label;                                     ///< what messages call it: "--size coulomb=0.2"
};

/// Rivals "A" or "A+B" at a typical size (typical_rival()), but for `sizes`. Throws InputError for unknown names; its
/// message begins with the size's label, or with `label` ("--between ") and the name.
[[nodiscard]] std::vector<Rival> rivals_named(const std::vector<std::string>& names, const std::string& label,
                                              const std::vector<NamedSize>& sizes, const std::vector<Effect>& catalogue,
                                              const Drive& drive);

/// A planned drive with a bit of everything within `limits`, on which sizes that nobody gave are found.
[[nodiscard]] Drive ordinary_drive(const design::DesignSubject& subject, const design::MotionLimits& limits);

}  // namespace wheelwright::gap
