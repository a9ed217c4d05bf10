// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/detector_choice.hpp"

namespace wheelwright::commission {

std::optional<double> risk_decides_from(const StatedMargin& margin, double window) {
  if (!margin.at_risk) {
    return std::nullopt;
  }
  const std::vector<double>&every_noise = margin.medians, &at_risk = margin.at_risk->medians;
  std::size_t from = at_risk.size();
  while (from > 0 && at_risk[from - 1] < every_noise[from - 1]) {
    --from;
  }
  return from < at_risk.size()
             ? std::optional(window * static_cast<double>(from + 1) / static_cast<double>(at_risk.size()))
             : std::nullopt;
}

}  // namespace wheelwright::commission
