// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/isolation.hpp"

#include <algorithm>
#include <cmath>

#include "bounds/polytope.hpp"
#include "core/for_all.hpp"
#include "core/linear_algebra.hpp"
#include "detector/faults/isolation_search.hpp"
#include "detector/faults/onset_rows.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kMemory = 12.0;      // of the filter, in units of 1/β
constexpr double kFresh = 2.0;        // of this, in the same units, an onset is still to be seen
constexpr double kStillJoint = 1e-9;  // rad/s, of a reading that stands still

// An encoder whose reading stands still, from somewhere on or for a time: judged by the reading.
void judge_reading(const IsolationSetting& in, const RegressorFilter& filter, FaultFinding& finding) {
  const Model& model = filter.model();
  const Eigen::MatrixXd inverse = core::pseudo_inverse(model.motion);
  const Eigen::VectorXd share = (inverse * finding.fault.seen * model.motion).diagonal();
  Eigen::Index joint = 0;
  if (!(share.minCoeff(&joint) < -0.5)) {
    return;
  }
  const IsolationWindow& w = in.window;
  const auto still = [&](std::size_t k) {
    return std::abs(in.motion.joint_speed(joint, static_cast<Eigen::Index>(k))) <=
           filter.errors().joint_sample * (1.0 + 1e-9) + kStillJoint;
  };
  const bool ends = finding.fault.profile.kind == FaultProfile::Kind::pulse;
  finding.verdict = FaultFinding::Verdict::excluded;
  for (std::size_t k = w.begin; k < w.end;) {
    std::size_t stop = k;
    while (stop < w.end && still(stop)) {
      ++stop;
    }
    // The instant on which the reading stops is still half of motion.
    const std::size_t from = k > w.begin ? k - 1 : k;
    const double long_enough =
        finding.fault.profile.rise - 3.0 * (in.motion.instant[from + 1] - in.motion.instant[from]);
    const bool fits =
        from <= w.outside && stop > k &&
        (ends ? in.motion.instant[stop - 1] - in.motion.instant[k] >= long_enough || stop == w.end : stop == w.end);
    if (fits) {
      const Interval onset{in.motion.instant[from], in.motion.instant[std::min(w.outside, stop - 1)]};
      finding.onset = finding.verdict == FaultFinding::Verdict::consistent
                          ? Interval{finding.onset.lower, std::max(finding.onset.upper, onset.upper)}
                          : onset;
      finding.earlier = finding.earlier || k == w.begin;
      finding.verdict = FaultFinding::Verdict::consistent;
    }
    k = std::max(stop, k + 1);
  }
}

// More than an effort can have been, from what was measured and from P, per unit of `offset`.
double largest_offset(const IsolationSetting& in, double static_gain, const Eigen::VectorXd& offset) {
  const RegressionBlock& data = in.motion.rows;
  double most = data.y.cwiseAbs().maxCoeff() + data.dy.maxCoeff();
  most += ((data.Y.cwiseAbs() + data.dY) * in.largest).maxCoeff();
  return 20.0 * most / (static_gain * offset.cwiseAbs().maxCoeff());
}

void look_for(const IsolationSetting& in, const RegressorFilter& filter, FaultFinding& finding) {
  FaultType fault = finding.fault;
  const bool free_offset = fault.held_effort;
  double most = 0.0;
  if (free_offset) {
    // What it stands at is not known: an offset of any size in place of the effort.
    Eigen::Index column = 0;
    fault.effort.cwiseAbs().colwise().sum().maxCoeff(&column);
    fault.offset = fault.effort.col(column);
    fault.held_effort = false;
    most = largest_offset(in, filter.design().static_gain(), fault.offset);
  }
  OnsetRows rows(fault, filter.model(), filter.design(), in.motion, in.window.first, in.window.end);
  search(in, rows, free_offset, most, finding);
}

bool stands_still(const FaultType& fault) {
  return fault.seen.size() > 0 && fault.whole &&
         (fault.profile.kind == FaultProfile::Kind::step || fault.profile.kind == FaultProfile::Kind::pulse);
}

}  // namespace

std::size_t Isolation::count(FaultFinding::Verdict verdict) const {
  return static_cast<std::size_t>(
      std::count_if(findings.begin(), findings.end(), [&](const FaultFinding& f) { return f.verdict == verdict; }));
}

std::size_t Isolation::count_at_risk() const {
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(), [](const FaultFinding& f) {
    return f.verdict == FaultFinding::Verdict::consistent && !(f.at_risk && f.at_risk->excluded);
  }));
}

Isolation isolate(const ReferenceMotion& motion, const RegressorFilter& filter, const Polytope& set,
                  const std::vector<FaultType>& faults, double outside, double alarm, const IsolationOptions& options) {
  const double beta = filter.design().beta;
  const IsolationSetting setting(motion, set, options,
                                 isolation_window(motion, {kMemory / beta, kFresh / beta}, outside, alarm, options));
  Isolation isolation;
  isolation.window = {motion.t[setting.window.begin], motion.t[setting.window.end - 1]};
  isolation.findings.resize(faults.size());
  core::for_all(faults.size(), options.threads, [&](std::size_t k) {
    FaultFinding& finding = isolation.findings[k];
    finding.fault = faults[k];
    validate(finding.fault, filter.model());
    if (stands_still(finding.fault)) {
      judge_reading(setting, filter, finding);
    } else if (OnsetRows::knows(finding.fault, filter.model()) && setting.window.end >= setting.window.begin + 4) {
      look_for(setting, filter, finding);
    }
  });
  return isolation;
}

}  // namespace wheelwright::detector
