// SPDX-License-Identifier: Apache-2.0
#include "model/fault_type.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/check.hpp"

namespace wheelwright::model {
namespace {

using std::numbers::pi;

template <typename M>
void check_shape(const M& matrix, std::size_t rows, std::size_t columns, const std::string& name) {
  check::that(matrix.size() == 0 || (static_cast<std::size_t>(matrix.rows()) == rows &&
                                     static_cast<std::size_t>(matrix.cols()) == columns && matrix.allFinite()),
              name, std::to_string(rows) + " × " + std::to_string(columns) + " finite numbers, or none");
}

}  // namespace

double FaultProfile::at(double since, double angle, double speed) const {
  switch (kind) {
    case Kind::step: return 1.0;
    case Kind::ramp: return std::min(since / rise, 1.0);
    case Kind::smooth: return since < rise ? 0.5 * (1.0 - std::cos(pi * (since / rise))) : 1.0;
    case Kind::pulse: return since < rise ? 1.0 : 0.0;
    case Kind::bump: {
      const double psi = std::remainder(angle - std::copysign(0.5 * arc, speed), 2.0 * pi);
      return std::abs(psi) < 0.5 * arc ? 0.5 * (1.0 + std::cos(2.0 * pi * psi / arc)) : 0.0;
    }
  }
  return 0.0;
}

double FaultType::kappa(double magnitude) const {
  return share_lost ? magnitude / (1.0 - magnitude) : magnitude / per_kappa;
}

double FaultType::magnitude(double kappa) const { return share_lost ? kappa / (1.0 + kappa) : kappa * per_kappa; }

void validate(const FaultType& fault, const Model& model) {
  const std::string name = "fault '" + fault.name + "', ";
  const std::size_t n = model.n(), c = model.coordinates.size();
  check_shape(fault.motion, c, c, name + "motion");
  check_shape(fault.slip, c, 1, name + "slip");
  check_shape(fault.effort, n, n, name + "effort");
  check_shape(fault.ground, n, n, name + "ground");
  check_shape(fault.offset, n, 1, name + "offset");
  check_shape(fault.theta, model.p(), 1, name + "theta");
  check_shape(fault.seen, c, c, name + "seen");
  check::finite(fault.lateral, name + "lateral");
  check::that(fault.range.lower <= 0.0 && fault.range.upper >= 0.0 && fault.range.lower < fault.range.upper,
              name + "range", "an interval that holds 0 and more");
  check::that(fault.per_kappa > 0.0, name + "per_kappa", "a number > 0");
  check::that(!fault.share_lost || (fault.range.lower == 0.0 && fault.range.upper < 1.0), name + "range",
              "[0, m] with m < 1 for a share that is lost");
  check::finite(fault.range.lower, name + "range");
  check::finite(fault.range.upper, name + "range");
  check::that(fault.lateral == 0.0 || c >= 2, name + "lateral", "0 for a model without a heading");
  const FaultProfile& profile = fault.profile;
  check::that(profile.kind != FaultProfile::Kind::smooth, name + "profile.kind", "step, ramp, pulse or bump");
  check::that(
      profile.rise > 0.0 || profile.kind == FaultProfile::Kind::step || profile.kind == FaultProfile::Kind::bump,
      name + "profile.rise", "a number > 0");
  check::that(profile.kind != FaultProfile::Kind::bump ||
                  (profile.arc > 0.0 && profile.arc <= 2.0 * pi && profile.joint < model.joints.size()),
              name + "profile.arc", "an arc in (0, 2π] of a joint that there is");
  const bool gains = fault.effort.size() > 0 || fault.ground.size() > 0;
  const bool moves = fault.motion.size() > 0 || fault.slip.size() > 0 || fault.lateral != 0.0;
  check::that(fault.seen.size() == 0 || !gains || !moves, name + "seen",
              "nothing where the fault changes motion and efforts at once");
}

}  // namespace wheelwright::model
