// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detection: what a detector decided over a whole log, with its events and a thinned trace.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "detector/detector_options.hpp"
#include "detector/events.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

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

/// Result of a detector over a whole log.
struct Detection {
  detector::Residual residual = detector::Residual::d1;  ///< that decided
  std::vector<detector::Event> events;
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

/// What a detection says of its log as a whole.
enum class Watched {
  enough,   ///< half of its rows at least, or all but what the filter settles in
  little,   ///< fewer than half: of most of the log nothing is known
  no_time,  ///< instants of a clock that hardly goes on (hardly_goes_on())
  nothing,  ///< no instant
};

/// What `detection`, by `model`, says of a log with rows `step` (s) apart of which `met` were met, those included that
/// could not be used.
[[nodiscard]] Watched how_watched(const Detection& detection, const OnlineModel& model, double step, std::size_t met);

/// The share of those rows at which nothing was decided; 0 where it is at most 0.05 beside what the filter settles in.
[[nodiscard]] double undecided_share(const Detection& detection, const OnlineModel& model, double step,
                                     std::size_t met);

/// Detection by the kinematic residual, beside that by the torque residual.
struct KinematicWatch {
  std::optional<Detection> detection;  ///< nothing where it was not watched
  std::string message;                 ///< why not, for people
};

/// `model` with the outputs of its kinematic model in the place of its own, for whatever reads outputs of a Detection.
[[nodiscard]] OnlineModel with_kinematic_outputs(const OnlineModel& model);

}  // namespace wheelwright::commission

namespace wheelwright {
using commission::Detection;
}  // namespace wheelwright
