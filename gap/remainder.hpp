// SPDX-License-Identifier: Apache-2.0
/// \file
/// What some columns of a least-squares problem leave of others, from Gram matrices alone.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/block_gram.hpp>

namespace wheelwright {

/// Σ rᵢ rⱼ over all rows, r the columns `of` less their least-squares fit by the columns `on` (indices of `gram`, the
/// response has the index columns()). Columns of `on` that the others make up to ten digits count once.
[[nodiscard]] Eigen::MatrixXd remainder(const BlockGram& gram, const std::vector<std::size_t>& of,
                                        const std::vector<std::size_t>& on);

}  // namespace wheelwright
