// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether one signal was made from the noise of another.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>

namespace wheelwright {

/// Whether column first[i] of `log` carries noise of column second[i], for any i: whether their sixth differences, in
/// which motion is next to nothing and noise is large, are correlated at the same sample or up to three samples later. Said
/// so above |ρ| = 0.1 and six standard errors of independent white series, 6·√C(24, 12)/C(12, 6)/√N. One walk; windows as in difference_noise.hpp.
/// A column that is smooth down to rounding carries no noise. Throws InvalidArgument when a column is missing or the lists
/// differ in length.
[[nodiscard]] bool share_noise(LogSource& log, const std::vector<std::string>& first,
                               const std::vector<std::string>& second);

}  // namespace wheelwright
