// SPDX-License-Identifier: Apache-2.0
/// \file
/// One input at a time, the others at their nominal values: curves and tornado charts. Tells nothing of interactions.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// A quantity over one input. All values in the quantity's unit, NaN where there was none.
struct InputCurve {
  Eigen::VectorXd coordinates = {};  ///< levels from 0 to 1, equally spaced
  Eigen::VectorXd values = {};       ///< at each of them
  double low = 0.0;                  ///< value at the input's lower end
  double high = 0.0;                 ///< value at its upper end
  double swing = 0.0;                ///< largest less smallest value, with the nominal point; NaN for no value at all
  Eigen::Index missing = 0;          ///< levels without a value
};

/// A quantity over each input.
struct OneAtATime {
  double nominal = 0.0;                 ///< value at the nominal point; NaN where there was none
  std::vector<InputCurve> inputs = {};  ///< in the design's order
  std::vector<std::size_t> order = {};  ///< of the inputs, the largest swing first, those without a value last
};

/// The nominal point, then for each input `levels` rows with that input at 0, 1/(levels − 1), …, 1 and the others nominal.
/// `nominal` holds a coordinate in [0, 1] for each input. Shape (1 + inputs · levels) × inputs. Throws InvalidArgument for
/// no input, a coordinate outside [0, 1], or fewer than two levels.
[[nodiscard]] Eigen::MatrixXd one_at_a_time_design(const Eigen::VectorXd& nominal, Eigen::Index levels = 5);

/// Curves for each column of `values` (rows of the design × quantities; NaN or an infinity where a row gave no value).
/// Throws InvalidArgument where `values` has not the rows of the design.
[[nodiscard]] std::vector<OneAtATime> one_at_a_time(const Eigen::MatrixXd& values, Eigen::Index inputs,
                                                    Eigen::Index levels = 5);

}  // namespace wheelwright
