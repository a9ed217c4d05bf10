// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parts that drawings are made of.
#pragma once

#include <string>

namespace wheelwright::report {

/// The beginning of a drawing of that size, with `label` (text) for those who cannot see it.
[[nodiscard]] std::string open_svg(double width, double height, const std::string& label);

/// `what` (text) at a place; `anchor` is start, middle or end; in the colour of text where `ink`, else of axes.
[[nodiscard]] std::string svg_text(double x, double y, const char* anchor, const std::string& what, bool ink = false);

}  // namespace wheelwright::report
