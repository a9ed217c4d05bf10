// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/effect.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

std::vector<double> points(const ShapeParameter& shape, const Drive& drive) {
  const Interval bounds = shape_bounds(shape, drive);
  std::vector<double> result;
  for (std::size_t k = 0; k < shape.scan; ++k) {
    const double part = shape.scan > 1 ? static_cast<double>(k) / static_cast<double>(shape.scan - 1) : 0.5;
    result.push_back(shape.logarithmic ? bounds.lower * std::pow(bounds.upper / bounds.lower, part)
                                       : bounds.lower + part * (bounds.upper - bounds.lower));
  }
  if (shape.both_signs) {
    std::vector<double> mirrored(result.rbegin(), result.rend());
    std::ranges::transform(mirrored, mirrored.begin(), std::negate<>());
    result.insert(result.begin(), mirrored.begin(), mirrored.end());
  }
  return result;
}

}  // namespace

void validate(const Effect& effect) {
  check::that(!effect.name.empty(), "Effect::name", "a name");
  check::that(static_cast<bool>(effect.columns), effect.name + ": columns", "a function");
  check::that(!effect.unit_coefficient || effect.parameters.empty(), effect.name + ": parameters",
              "none beside a unit coefficient");
  check::that(effect.unit_coefficient || !effect.parameters.empty(), effect.name + ": parameters", "at least one");
  for (const ShapeParameter& shape : effect.shapes) {
    const std::string what = effect.name + ": shape " + shape.name;
    check::that(shape.lower <= shape.upper, what, "lower <= upper");
    check::that(!shape.logarithmic || shape.lower > 0.0, what, "lower > 0 for a logarithmic grid");
    check::that(shape.scan >= 1, what, "at least one grid point");
  }
}

Applicability applicability(const Effect& effect, const Drive& drive) {
  return effect.applies ? effect.applies(drive) : Applicability{};
}

Interval shape_bounds(const ShapeParameter& shape, const Drive& drive) {
  const double scale = shape.scale ? shape.scale(drive) : 1.0;
  return {shape.lower * scale, shape.upper * scale};
}

std::vector<std::vector<double>> shape_grid(const Effect& effect, const Drive& drive) {
  std::vector<std::vector<double>> grid(1);
  for (const ShapeParameter& shape : effect.shapes) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : grid) {
      for (const double value : points(shape, drive)) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    }
    grid = std::move(longer);
  }
  return grid;
}

}  // namespace wheelwright
