// SPDX-License-Identifier: Apache-2.0
/// \file
/// Axes with names, for tests of one property on each of them.
#pragma once

#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/exact_axis.hpp"

namespace wheelwright::testing_support {

/// An axis and what tests call it.
struct NamedAxis {
  std::string name;
  ExactAxis axis;
};
inline void PrintTo(const NamedAxis& n, std::ostream* out) { *out << n.name; }

/// Axes that are driven for so long unless they say otherwise.
class NamedAxes {
 public:
  explicit NamedAxes(double seconds) : seconds_(seconds) {}

  /// One more, after change(axis).
  template <typename Change>
  void operator()(const std::string& name, Change&& change) {
    ExactAxis axis;
    axis.seconds = seconds_;
    change(axis);
    all_.push_back({name, axis});
  }
  [[nodiscard]] std::vector<NamedAxis> all() && { return std::move(all_); }

 private:
  double seconds_;
  std::vector<NamedAxis> all_;
};

}  // namespace wheelwright::testing_support
