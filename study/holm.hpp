// SPDX-License-Identifier: Apache-2.0
/// \file
/// Many tests at once.
#pragma once

#include <vector>

namespace wheelwright {

/// Holm's step-down adjustment (`holm1979`): rejecting where the adjusted p is at most α errs anywhere with a probability
/// of at most α, however the tests depend on one another. The order of `p` is kept; values are in [0, 1].
[[nodiscard]] std::vector<double> holm(const std::vector<double>& p);

}  // namespace wheelwright
