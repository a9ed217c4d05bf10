// SPDX-License-Identifier: Apache-2.0
/// \file
/// The residual inside its threshold over a whole log, thinned so that no peak is lost: what a report draws.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/detector/detector.hpp>
#include <wheelwright/detector/kinematic_detector.hpp>

namespace wheelwright {

/// One output over time. All vectors have the length of Trace::t.
struct OutputTrace {
  std::vector<double> torque;         ///< τ_f
  std::vector<double> predicted;      ///< Y_f θ̂
  std::vector<double> residual_low;   ///< smallest ε of the bin
  std::vector<double> residual_high;  ///< largest ε of the bin
  std::vector<double> lower;          ///< l where ε comes nearest to it in the bin
  std::vector<double> upper;          ///< u where ε comes nearest to it in the bin
};

/// A thinned walk of a detector over a log. A bin in which ε leaves [l, u] shows that it does.
struct Trace {
  std::vector<double> t;  ///< time at the middle of each bin, s
  std::vector<OutputTrace> outputs;
  std::vector<std::size_t> breaks;  ///< indices of `t` at which a new segment starts
};

/// What a detector said of a whole log.
struct Detection {
  std::vector<Event> events;
  std::size_t rows = 0;              ///< rows of the log
  std::size_t instants = 0;          ///< instants with a decision
  double seconds = 0.0;              ///< time under watch, s
  std::vector<std::size_t> outside;  ///< per output, instants outside
  std::vector<double> utilisation;   ///< per output, max |ε − middle| / half width
  std::vector<double> nrmse;         ///< per output, rms ε / rms τ_f
  Trace trace;
};

/// Options of detect().
struct DetectionOptions {
  std::size_t most_points = 6000;  ///< bins of the trace
  double merge = 0.5;              ///< s: instants outside nearer than this are one event
};

/// Walks `log` through `detector` from its beginning. Throws InvalidArgument when the log lacks a column.
[[nodiscard]] Detection detect(LogSource& log, Detector detector, const DetectionOptions& options = {});

/// The same for the kinematic residual: OutputTrace::torque and predicted are then what the pose or gyro saw and what
/// the wheels predict.
[[nodiscard]] Detection detect(LogSource& log, KinematicDetector detector, const DetectionOptions& options = {});

}  // namespace wheelwright
