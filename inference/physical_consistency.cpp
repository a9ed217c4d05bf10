// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/physical_consistency.hpp>

#include <cmath>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

/// "viscous_linear" as people write it.
std::string spoken(std::string name) {
  for (char& c : name) {
    c = c == '_' ? ' ' : c;
  }
  return name;
}

bool never_negative(const std::string& name) {
  return name == "mass" || name == "yaw_inertia" || name == "inertia" || name == "coulomb" ||
         name.starts_with("viscous");
}

/// sign · quantity_j <= bound.
LinearConstraint one_sided(const std::vector<PhysicalQuantity>& parameters, std::size_t j, double sign, double bound) {
  const auto at = static_cast<Eigen::Index>(j);
  LinearConstraint constraint;
  constraint.a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  constraint.a[at] = sign / parameters[j].per_physical;
  constraint.b = bound;
  return constraint;
}

void check_scales(const std::vector<PhysicalQuantity>& parameters) {
  check::that(!parameters.empty(), "parameters", "at least one");
  for (const PhysicalQuantity& parameter : parameters) {
    check::that(std::isfinite(parameter.per_physical) && parameter.per_physical != 0.0,
                "per_physical of " + parameter.name, "a finite number other than 0");
  }
}

}  // namespace

std::vector<LinearConstraint> physical_consistency(const std::vector<PhysicalQuantity>& parameters,
                                                   std::optional<double> footprint_radius) {
  check_scales(parameters);
  std::vector<LinearConstraint> constraints;
  std::optional<std::size_t> mass, inertia;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const std::string& name = parameters[j].name;
    if (never_negative(name)) {
      constraints.push_back(one_sided(parameters, j, -1.0, 0.0));
      constraints.back().name = name + " = 0";
      constraints.back().asks = "a negative " + spoken(name);
    }
    mass = name == "mass" ? j : mass;
    inertia = name == "yaw_inertia" ? j : inertia;
  }
  if (footprint_radius) {
    const double radius = check::positive(*footprint_radius, "footprint radius");
    if (mass && inertia) {
      LinearConstraint footprint = one_sided(parameters, *inertia, 1.0, 0.0);
      footprint.a[static_cast<Eigen::Index>(*mass)] = -radius * radius / parameters[*mass].per_physical;
      footprint.name = fmt::format("yaw_inertia = mass·R² with R = {} m", radius);
      footprint.asks = "an inertia larger than the footprint allows";
      constraints.push_back(footprint);
    }
  }
  return constraints;
}

std::vector<LinearConstraint> bounds_on(const std::vector<PhysicalQuantity>& parameters,
                                        const std::vector<std::optional<Interval>>& bounds) {
  check_scales(parameters);
  check::that(bounds.size() == parameters.size(), "bounds", "one for each parameter");
  std::vector<LinearConstraint> constraints;
  for (std::size_t j = 0; j < bounds.size(); ++j) {
    if (!bounds[j]) {
      continue;
    }
    check::that(bounds[j]->lower <= bounds[j]->upper, "bounds of " + parameters[j].name, "lower <= upper");
    for (const double sign : {-1.0, 1.0}) {
      const double end = sign < 0.0 ? bounds[j]->lower : bounds[j]->upper;
      if (std::isfinite(end)) {
        constraints.push_back(one_sided(parameters, j, sign, sign * end));
        constraints.back().name = fmt::format("{} = {} {}", parameters[j].name, end, parameters[j].unit);
        constraints.back().asks =
            fmt::format("a {} {} than stated", sign < 0.0 ? "smaller" : "larger", spoken(parameters[j].name));
      }
    }
  }
  return constraints;
}

}  // namespace wheelwright
