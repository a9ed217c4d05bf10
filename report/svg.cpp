// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/svg.hpp>

#include <fmt/format.h>

#include <wheelwright/report/text.hpp>

namespace wheelwright::report {

std::string open_svg(double width, double height, const std::string& label) {
  return fmt::format(
      "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\">",
      width, height, escape(label));
}

std::string svg_text(double x, double y, const char* anchor, const std::string& what, bool ink) {
  return fmt::format("<text{} x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", ink ? " class=\"ink\"" : "", x,
                     y, anchor, escape(what));
}

}  // namespace wheelwright::report
