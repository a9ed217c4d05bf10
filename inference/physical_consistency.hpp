// SPDX-License-Identifier: Apache-2.0
/// \file
/// What every real robot fulfils, as constraints on θ_L: no negative mass, inertia or friction, and mass inside its
/// footprint.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/inference/constrained.hpp>

namespace wheelwright {

/// What stands behind one entry of θ_L: θ_j = per_physical · quantity (model/model.hpp's Parameter).
struct PhysicalQuantity {
  std::string name;           ///< e.g. "mass", "yaw_inertia", "viscous_linear"
  double per_physical = 1.0;  ///< other than 0
  std::string unit;           ///< of the quantity, for the words, e.g. "kg"
};

/// quantity >= 0 for mass, yaw_inertia, inertia, coulomb and whatever starts with "viscous" (other names, such as
/// offset, are free); and yaw_inertia <= mass·R² where both are there and the radius R > 0, m, of the circle about the
/// wheels' midpoint that holds all of the robot's mass is given: I = ∫ρ² dm with ρ <= R. The closed set is used: a mass
/// of 0 that binds says that the log asks for a negative one. Throws InvalidArgument for a scale of 0 or a radius that
/// is not positive.
[[nodiscard]] std::vector<LinearConstraint> physical_consistency(const std::vector<PhysicalQuantity>& parameters,
                                                                 std::optional<double> footprint_radius = {});

/// lower <= quantity <= upper for each interval that is given (in the quantity's unit; an infinite end is no
/// constraint); `bounds` has one for each parameter. Throws InvalidArgument for an empty interval or a NaN.
[[nodiscard]] std::vector<LinearConstraint> bounds_on(const std::vector<PhysicalQuantity>& parameters,
                                                      const std::vector<std::optional<Interval>>& bounds);

}  // namespace wheelwright
