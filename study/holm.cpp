// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/holm.hpp>

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace wheelwright {

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double running = 0.0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double left = static_cast<double>(order.size() - k);
    running = std::max(running, std::min(1.0, left * p[order[k]]));
    adjusted[order[k]] = running;
  }
  return adjusted;
}

}  // namespace wheelwright
