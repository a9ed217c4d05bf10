// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/contradictions.hpp>

namespace wheelwright {

std::string_view to_string(LogContradiction::Kind kind) {
  switch (kind) {
    case LogContradiction::Kind::effort_constant: return "effort_constant";
    case LogContradiction::Kind::angle_wrapped: return "angle_wrapped";
    case LogContradiction::Kind::stamps_scatter: return "stamps_scatter";
    case LogContradiction::Kind::effort_unrelated: return "effort_unrelated";
    case LogContradiction::Kind::effort_timing: return "effort_timing";
    case LogContradiction::Kind::wheels_disagree: return "wheels_disagree";
    case LogContradiction::Kind::wrong_sign: return "wrong_sign";
    case LogContradiction::Kind::dry_friction: return "dry_friction";
    case LogContradiction::Kind::prior_edge: return "prior_edge";
    case LogContradiction::Kind::estimate_outside: return "estimate_outside";
    case LogContradiction::Kind::halves_disagree: return "halves_disagree";
    case LogContradiction::Kind::held_out_outside: return "held_out_outside";
  }
  return "";
}

}  // namespace wheelwright
