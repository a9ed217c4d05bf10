// SPDX-License-Identifier: Apache-2.0
/// \file
/// The drive that a planned motion will be, as the effects of the catalogue look at it.
#pragma once

#include <wheelwright/design/plan.hpp>
#include <wheelwright/design/subject.hpp>
#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// The drive along `plan` without noise: speeds and accelerations are the plan's own, smooth signals are the same exact
/// ones, efforts those of the base model at the subject's θ° (inverse dynamics (20)), linear between instants, the pose
/// the plan's. Wheels that are planned to stand still for 0.1 s rest. Throws InvalidArgument for a plan of fewer than
/// three samples, or one of another number of coordinates than the model.
[[nodiscard]] Drive planned_drive(const Plan& plan, const DesignSubject& subject);

}  // namespace wheelwright
