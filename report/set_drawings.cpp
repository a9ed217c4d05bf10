// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/set_drawings.hpp>

#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/report/page.hpp>
#include <wheelwright/report/parameter_view.hpp>
#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

constexpr std::size_t kDirections = 90;
constexpr std::size_t kMostPairs = 10;
constexpr double kSize = 190.0, kLeft = 66.0, kTop = 10.0, kBottom = 40.0;

// A quantity along an axis of the drawing: its interval fills it.
struct Side {
  const ParameterView* view;
  Interval theta;

  [[nodiscard]] double share(double value, double low, double high) const { return (value - low) / (high - low); }
  [[nodiscard]] double of_theta(double value) const { return share(value, theta.lower, theta.upper); }
  [[nodiscard]] double of_view(double value) const { return share(value, view->lower, view->upper); }
};

std::string outline(const Polytope& set, std::size_t i, std::size_t j, const Side& across, const Side& up) {
  std::string points;
  std::vector<double> a(set.dimension(), 0.0), most(set.dimension());
  for (std::size_t k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(kDirections);
    a[i] = std::cos(angle) / across.theta.width();
    a[j] = std::sin(angle) / up.theta.width();
    static_cast<void>(set.support(a, most));
    fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", kLeft + kSize * across.of_theta(most[i]),
                   kTop + kSize * (1.0 - up.of_theta(most[j])));
  }
  return points;
}

std::string projection(const Polytope& set, std::size_t i, std::size_t j, const Side& across, const Side& up) {
  const std::string x_name = words(across.view->name), y_name = words(up.view->name);
  std::string out = fmt::format(
      "<div><h3>{3} and {4}</h3><svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" "
      "aria-label=\"feasible set: {3} and {4}\"><rect x=\"{5}\" y=\"{6}\" width=\"{2}\" height=\"{2}\" "
      "class=\"axis open\" fill=\"none\"/><polygon class=\"bar\" points=\"{7}\"/>",
      kLeft + kSize + 14.0, kTop + kSize + kBottom, kSize, escape(x_name), escape(y_name), kLeft, kTop,
      outline(set, i, j, across, up));
  const auto place = [&](const char* element, double x, double y) {
    if (x > -0.02 && x < 1.02 && y > -0.02 && y < 1.02) {
      out += fmt::format(fmt::runtime(element), kLeft + kSize * x, kTop + kSize * (1.0 - y));
    }
  };
  place("<circle class=\"centre\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>", across.of_view(across.view->centre),
        up.of_view(up.view->centre));
  if (across.view->estimate && up.view->estimate) {
    place("<circle class=\"point\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\"/>", across.of_view(*across.view->estimate),
          up.of_view(*up.view->estimate));
  }
  const auto [left, right] = outward(across.view->lower, across.view->upper);
  const auto [low, high] = outward(up.view->lower, up.view->upper);
  const double foot = kTop + kSize + 14.0;
  out += fmt::format(
      "<text x=\"{0}\" y=\"{2}\">{3}</text><text x=\"{1}\" y=\"{2}\" text-anchor=\"end\">{4}</text>"
      "<text class=\"ink\" x=\"{5}\" y=\"{6}\" text-anchor=\"middle\">{7}</text>",
      kLeft, kLeft + kSize, foot, left, right, kLeft + 0.5 * kSize, foot + 16.0,
      escape(with_unit(x_name + ",", across.view->unit)));
  out += fmt::format(
      "<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">{2}</text><text x=\"{0}\" y=\"{3}\" text-anchor=\"end\">{4}</text>"
      "<text class=\"ink\" x=\"12\" y=\"{5}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {5})\">{6}</text>",
      kLeft - 5.0, kTop + 9.0, high, kTop + kSize, low, kTop + 0.5 * kSize,
      escape(with_unit(y_name + ",", up.view->unit)));
  return out + "</svg></div>";
}

}  // namespace

std::string set_projections(const Commissioning& result) {
  if (!result.feasible.polytope) {
    return {};
  }
  const Polytope& set = *result.feasible.polytope;
  const std::vector<ParameterViews> views = parameter_views(result);
  std::string out;
  std::size_t pairs = 0;
  for (const Polytope::Block& block : set.blocks()) {
    for (std::size_t b = 1; b < block.parameters.size(); ++b) {
      for (std::size_t a = 0; a < b && pairs < kMostPairs; ++a) {
        const std::size_t i = block.parameters[a], j = block.parameters[b];
        const Side across{&views.at(i).best(), set.hull().sides[i]}, up{&views.at(j).best(), set.hull().sides[j]};
        const auto drawable = [](const Side& side) {
          return side.theta.width() > 0.0 && std::isfinite(side.theta.width()) && side.view->upper > side.view->lower;
        };
        if (drawable(across) && drawable(up)) {
          out += projection(set, i, j, across, up);
          ++pairs;
        }
      }
    }
  }
  return out.empty()
             ? out
             : "<div class=\"pairs\">" + out + "</div>" +
                   paragraph(
                       "<span class=\"note\">What of the dashed box is possible: a point inside is a pair of values "
                       "that no sample of the log excludes together with some values of the others. Black dot: "
                       "estimate; ring: Chebyshev centre. Pairs that are not drawn do not limit each other.</span>");
}

}  // namespace wheelwright::report
