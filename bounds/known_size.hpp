// SPDX-License-Identifier: Apache-2.0
/// \file
/// Loops whose length the compiler knows, for the small sizes that blocks of parameters have.
#pragma once

#include <cstddef>
#include <type_traits>

namespace wheelwright::bounds {

/// work(std::integral_constant<std::size_t, Q>), Q = `size` from 2 to 12, else 0: the size is then known to `work`
/// alone.
template <typename Work>
decltype(auto) with_known_size(std::size_t size, Work&& work) {
  switch (size) {
    case 2: return work(std::integral_constant<std::size_t, 2>());
    case 3: return work(std::integral_constant<std::size_t, 3>());
    case 4: return work(std::integral_constant<std::size_t, 4>());
    case 5: return work(std::integral_constant<std::size_t, 5>());
    case 6: return work(std::integral_constant<std::size_t, 6>());
    case 7: return work(std::integral_constant<std::size_t, 7>());
    case 8: return work(std::integral_constant<std::size_t, 8>());
    case 9: return work(std::integral_constant<std::size_t, 9>());
    case 10: return work(std::integral_constant<std::size_t, 10>());
    case 11: return work(std::integral_constant<std::size_t, 11>());
    case 12: return work(std::integral_constant<std::size_t, 12>());
    default: return work(std::integral_constant<std::size_t, 0>());
  }
}

}  // namespace wheelwright::bounds
