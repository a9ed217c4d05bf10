// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detection over a whole log with a commissioned detector: decisions, a thinned trace, and events with their fault
/// isolation.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commission/commission.hpp"
#include "core/log.hpp"
#include "detector/detector.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/multiscale/sum_isolation.hpp"

namespace wheelwright::commission {

/// Walks `log` from its beginning through `detector` (of either residual), which restarts with every segment, and calls
/// `at(row, t, first, decision)` for every instant at which it decides: the row of the log, its time in s, whether it
/// is the first such instant of its segment, and the Decision, valid during the call. Returns the number of rows and
/// rewinds the log. Throws InvalidArgument when the log lacks a column.
template <filter::RowFilter Filter, typename At>
std::size_t walk_detector(LogSource& log, Detector<Filter>& detector, const At& at) {
  std::size_t rows = 0;
  bool first = true;
  const auto visit = [&](const core::LogSample& sample) {
    ++rows;
    if (sample.starts) {
      detector.restart();
      first = true;
    }
    const Decision& decision = detector.step(sample.t, sample.values);
    if (decision.valid) {
      at(sample.row, sample.t, first, decision);
      first = false;
    }
  };
  core::for_each_sample(log, detector.filter().measurement().columns(), visit, ", which the model was commissioned on");
  return rows;
}

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

/// Walks `log` through `detector` from its beginning. Of the kinematic residual OutputTrace::torque and predicted are
/// what the pose or gyro saw and what the wheels predict. Throws InvalidArgument when the log lacks a column.
template <filter::RowFilter Filter>
[[nodiscard]] Detection detect(LogSource& log, Detector<Filter> detector, const DetectionOptions& options = {});

extern template Detection detect(LogSource& log, TorqueDetector detector, const DetectionOptions& options);
extern template Detection detect(LogSource& log, detector::KinematicDetector detector, const DetectionOptions& options);

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

/// The kinematic residual of `log`, where it and the model have one.
[[nodiscard]] KinematicWatch watch_kinematics(LogSource& log, const OnlineModel& model,
                                              const detector::DetectorOptions& options,
                                              const DetectionOptions& detection = {});

/// `model` with the outputs of its kinematic model in the place of its own, for whatever reads outputs of a Detection.
[[nodiscard]] OnlineModel with_kinematic_outputs(const OnlineModel& model);

/// Options of isolate_events().
struct EventIsolationOptions {
  detector::IsolationOptions isolation{};
  detector::SumIsolationOptions sums{};  ///< where the model says something at a stated risk
  std::size_t most_events = 8;           ///< the first ones; the others are left alone
};

/// How long before the window of an isolation rows have to begin, s.
[[nodiscard]] double isolation_memory(const OnlineModel& model);

/// Isolates the first events of `detection`, which came of walking `log` with the torque residual of `model`, against
/// the catalogue of its robot. Walks the log once and holds the rows around these events. One result for each of them.
/// Where the model says something at a stated risk, sums over all scales are asked, too (narrow_by_sums()): the log is
/// walked once more for each event.
[[nodiscard]] std::vector<detector::Isolation> isolate_events(LogSource& log, const OnlineModel& model,
                                                              const Detection& detection,
                                                              const EventIsolationOptions& options = {});

/// A finding that is consistent, for people: "the right wheel's radius changes by the share 3.1 to 5.2 % since 12.4 to
/// 12.6 s".
[[nodiscard]] std::string sentence(const detector::FaultFinding& finding);

/// All findings in a sentence: "consistent with: …; …. Excluded: …. Not examined: …", or that nothing in the catalogue
/// explains the data.
[[nodiscard]] std::string sentence(const detector::Isolation& isolation);

}  // namespace wheelwright::commission

namespace wheelwright {
using commission::detect;
using commission::Detection;
}  // namespace wheelwright
