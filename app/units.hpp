// SPDX-License-Identifier: Apache-2.0
/// \file
/// Quantities with units on the command line.
#pragma once

#include <string_view>

namespace wheelwright::app {

/// The value of `text` in the SI unit `unit` ("s", "m", "rad", "rad/s", "rad/s²", "m/s", "Hz", "1/s", "kg", "N·m", "A",
/// "V", "1"): "120", "2min", "2 min" are all 120 s. A number alone is in `unit` itself. Spelling counts ("m" is no
/// "M"), except that · and ² may be written * and ^2 or left out. Throws InputError "'2 parsec': expected a number, in
/// s or with one of ms, ..." for anything else, infinite and NaN included. Units that are not in this list take
/// themselves only. The message begins with `option` ("--size coulomb=1s") where there is one.
[[nodiscard]] double quantity(std::string_view text, std::string_view unit, std::string_view option = {});

}  // namespace wheelwright::app
