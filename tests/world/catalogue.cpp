// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include "core/error.hpp"
#include "tests/world/effect.hpp"

namespace wheelwright::reality {

double soft_sign(double x, double width) { return std::tanh(x / width); }

const std::vector<Entry>& catalogue() {
  static const std::vector<Entry> all = [] {
    std::vector<Entry> entries;
    for (const auto& some : {friction_effects(), actuator_effects(), body_effects(), kinematic_effects(),
                             parametric_effects(), outside_effects()}) {
      entries.insert(entries.end(), some.begin(), some.end());
    }
    return entries;
  }();
  return all;
}

const Entry& find_entry(std::string_view name) {
  for (const Entry& entry : catalogue()) {
    if (entry.name == name) {
      return entry;
    }
  }
  throw InvalidArgument(fmt::format("no effect '{}'", name));
}

}  // namespace wheelwright::reality
