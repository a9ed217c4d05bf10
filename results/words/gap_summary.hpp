// SPDX-License-Identifier: Apache-2.0
/// \file
/// A diagnosed gap in sentences and tables for a terminal.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnosis.hpp"

namespace wheelwright::words {

/// Files that the summary refers to.
struct GapResults {
  std::string out;                         ///< what stands before names of results; empty: none was written
  std::string robot;                       ///< robot file
  bool improved = false;                   ///< whether robot_improved.yaml was written
  std::string next_manoeuvre;              ///< what the next drive promises; empty: none was designed
  bool commands = false;                   ///< whether next_manoeuvre.csv was written
  bool naive = false;                      ///< whether the naive rule was asked
  std::vector<std::string> naive_effects;  ///< what it said
};

/// Verdict, causes with their intervals, what the healthy log had already, how far the gap shrinks, and what to do
/// next.
[[nodiscard]] std::string summary(const Diagnosis& diagnosis, const GapResults& results);

}  // namespace wheelwright::words
