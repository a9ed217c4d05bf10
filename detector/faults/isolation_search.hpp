// SPDX-License-Identifier: Apache-2.0
/// \file
/// Search for the sizes and onsets with which one fault explains a window of rows, of either residual (isolation.hpp
/// has the mathematics).
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "bounds/polytope.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/faults/onset_rows.hpp"
#include "detector/faults/reference_motion.hpp"

namespace wheelwright::detector {

/// Instants of a motion that an isolation looks at.
struct IsolationWindow {
  std::size_t first = 0;  ///< from here on signatures are followed
  std::size_t begin = 0;  ///< from here on onsets are told apart
  std::size_t outside = 0, end = 0;
  bool from_start = false;          ///< the segment begins with the window
  std::vector<std::size_t> rows{};  ///< whose rows are used
};

/// How long rows know of what was before them.
struct RowMemory {
  double all = 0.0;    ///< s, of what is not forgotten
  double fresh = 0.0;  ///< s, in which an onset is to be seen best
};

/// The window about an alarm at `alarm` whose first instant outside is `outside` (s). Throws InvalidArgument where
/// `alarm` is not in the motion.
[[nodiscard]] IsolationWindow isolation_window(const ReferenceMotion& motion, const RowMemory& memory, double outside,
                                               double alarm, const IsolationOptions& options);

/// What the searches for all faults of a catalogue share. References are kept.
struct IsolationSetting {
  IsolationSetting(const ReferenceMotion& reference, const bounds::Polytope& parameters, const IsolationOptions& how,
                   IsolationWindow where);

  const ReferenceMotion& motion;
  const bounds::Polytope& set;
  const IsolationOptions& options;
  IsolationWindow window;
  Eigen::VectorXd centre, half, largest;  ///< of θ: middle of P's box, half-widths, max |θ_j|
};

/// False where it is proved that no θ of the set and no admissible noise explain the window's rows without a fault.
[[nodiscard]] bool explained_without_fault(const IsolationSetting& setting);

/// Writes to `finding` what is left of its fault, whose rows are `rows`. `free_offset`: the fault's offset stands for
/// an effort of any size, `largest_offset` per unit of κ at most.
void search(const IsolationSetting& setting, HypothesisRows& rows, bool free_offset, double largest_offset,
            FaultFinding& finding);

}  // namespace wheelwright::detector
