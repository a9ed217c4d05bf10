// SPDX-License-Identifier: Apache-2.0
#include "detector_run.hpp"

#include <wheelwright/commission/detector_walk.hpp>

namespace wheelwright::python {

DetectorRun run_detector(LogSource& log, TorqueDetector& detector, double merge) {
  DetectorRun run;
  run.outputs = detector.filter().model().n();
  detector::EventRecorder recorder(run.outputs, merge);
  commission::walk_detector(log, detector, [&](std::size_t row, double t, bool, const Decision& decision) {
    run.t.push_back(t);
    run.row.push_back(static_cast<std::int64_t>(row));
    for (std::size_t i = 0; i < run.outputs; ++i) {
      const detector::ChannelDecision& c = decision.channels[i];
      run.residual.push_back(c.residual);
      run.predicted.push_back(c.predicted);
      run.lower.push_back(c.threshold.lower);
      run.upper.push_back(c.threshold.upper);
      run.outside.push_back(c.outside ? 1 : 0);
      run.alarm.push_back(c.alarm ? 1 : 0);
      recorder.add(i, row, t, c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm);
    }
  });
  run.events = recorder.events();
  return run;
}

}  // namespace wheelwright::python
