// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rivals: sets of causes, any of which could be what a log shows.
#pragma once

#include <string>
#include <vector>

namespace wheelwright::gap {

struct Drive;
struct Effect;

/// One effect with its parameters, units of the catalogue.
struct RivalCause {
  std::string effect;
  std::vector<double> coefficients;  ///< one for each of Effect::parameters
  std::vector<double> shape;         ///< one for each of Effect::shapes
};

/// A set of causes that could be what a log shows.
struct Rival {
  std::vector<RivalCause> causes;

  /// "coulomb", "coulomb + delay".
  [[nodiscard]] std::string name() const;
};

/// Throws InvalidArgument, naming the effect, unless each cause of `rival` is in the catalogue once, with finite
/// coefficients and shapes as many as it has, and applies on `drive`.
void validate(const Rival& rival, const std::vector<Effect>& catalogue, const Drive& drive);

/// The rival of these effects at a size of its own: shapes in the middle of their grid, coefficients so large that each
/// column asks for `share` of the base model's efforts on `drive` (root mean squares); of a column without efforts, so
/// large that its body velocity is that share of the robot's.
[[nodiscard]] Rival typical_rival(const std::vector<std::string>& effects, const std::vector<Effect>& catalogue,
                                  const Drive& drive, double share = 0.05);

}  // namespace wheelwright::gap
