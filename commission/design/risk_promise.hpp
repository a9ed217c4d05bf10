// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a plan promises at a stated risk, where errors average out: bounds, and the smallest certain faults.
///
/// **Bounds.** A log along the plan gives the guaranteed set P(e), and tangent slabs |y_f − Y_f θ| <= dy_f of an
/// ellipsoid (commission/at_risk/risk_set.hpp). Y_f, the summed variances V and dy_f are made of the motion and of the
/// efforts that it takes, up to terms of second order in the errors; only y_f depends on the errors that came true. Two
/// members of one such set differ by a d with |Y_f d| <= 2 dy_f, whatever y_f is. So the set of the log without noise
/// is as wide as any, and it is what is promised: as for the guaranteed bounds (plan.hpp), and by the code of
/// commissioning.
///
/// **Faults.** The sums of the detector at a stated risk along the planned log, with weights, V, radii and what the set
/// leaves open as on a drive (detector/multiscale/sum_response.hpp); looks allow for any log that the sensors may write
/// of it. The fault is there from before the plan begins, so that it has no onset and no jump.
#pragma once

#include <vector>

#include "commission/design/detection.hpp"
#include "commission/design/plan.hpp"
#include "commission/design/subject.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::design {

/// The bounds that a log along the plan is promised to give at least, but for RiskSetOptions::risk: the hull of the set
/// at that risk of the log without noise, inside promised_bounds(). Throws InvalidArgument where the subject has no
/// errors that average out (DesignSubject::averaging).
[[nodiscard]] Box promised_bounds_at_risk(const Plan& plan, const DesignSubject& subject);

/// The objective "narrow bounds at the stated risk". Keeps a reference to `subject`.
[[nodiscard]] PlanObjective narrow_bounds_at_risk(const DesignSubject& subject, WidthCriterion criterion);

/// Promises by sums.
struct RiskPromises {
  std::vector<PromisedFault> faults;  ///< fault by fault, side by side, as promised_faults()
  double miss = 0.0;                  ///< a fault of a promised size is missed with no more probability
};

/// Promises of `plan` by the sums of `model`'s detector at a stated risk. Of each scale the look that promises most is
/// solved exactly, so that another might allow for a slightly smaller size. Throws InvalidArgument as
/// promised_faults(), and where the model says nothing at a risk.
[[nodiscard]] RiskPromises promised_faults_at_risk(const Plan& plan, const DesignSubject& subject,
                                                   const OnlineModel& model, const std::vector<InspectedFault>& faults);

/// certain_detection() by these sums. Keeps references to `subject` and `model`.
[[nodiscard]] PlanObjective certain_detection_at_risk(const DesignSubject& subject, const OnlineModel& model,
                                                      const std::vector<InspectedFault>& faults);

}  // namespace wheelwright::design
