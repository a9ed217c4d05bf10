// SPDX-License-Identifier: Apache-2.0
/// \file
/// Contradiction: one finding that contradicts what a commissioned model takes for granted; verdicts on its premises.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/warrant.hpp"

namespace wheelwright::commission {

/// One contradiction.
struct LogContradiction {
  /// What contradicts what.
  enum class Kind {
    effort_constant,   ///< an effort has one value in every row although its joint moves
    angle_wrapped,     ///< an angle jumps by a whole turn between two rows
    stamps_scatter,    ///< the motion is smoother over row numbers than over the stamps: these scatter, the samples do
                       ///< not
    effort_unrelated,  ///< an effort that motion does not explain at all
    effort_timing,     ///< efforts late or early against the motion, beyond what is declared
    timing_open,       ///< a shift of the efforts that the log does not exclude would leave the intervals
    wheels_disagree,   ///< the efforts of two joints do not show one and the same mass
    wrong_sign,        ///< a quantity that cannot be negative is, significantly
    dry_friction,      ///< the efforts follow the sign of the motion, and the model has no dry friction
    prior_edge,        ///< the prior explains the log only with far larger noise
    estimate_outside,  ///< the estimate lies outside the set, with its whole interval
    halves_disagree,   ///< parts of the log give different robots
    effort_offset,     ///< a joint's effort is off throughout, by more than is declared
    friction_shape,    ///< the efforts hold friction of a shape that the model does not have
    held_out_outside,  ///< driving that was held out leaves the thresholds
  };
  Kind kind = Kind::effort_constant;
  bool withdraws = true;   ///< no model is published; false: a note beside a model
  bool demotes = false;    ///< chance does not explain it, worst-case noise might: nothing is called guaranteed
  std::string subject{};   ///< the parameter, column or output that it is about
  double value = 0.0;      ///< what was found: s, share, factor, or the parameter's unit
  double limit = 0.0;      ///< what it was compared with, same unit
  std::string sentence{};  ///< what was found, with its numbers
  std::string next{};      ///< what to do about it
};

/// Name for files: "effort_constant" and so on.
[[nodiscard]] std::string_view to_string(LogContradiction::Kind kind);

/// Verdict on one premise.
struct PremiseVerdict {
  /// `holds` only where violations that matter would have shown: see test_premises() (premises.hpp).
  core::AssumptionVerdict verdict = core::AssumptionVerdict::not_tested;
  std::string detail{};  ///< what was found, and the smallest violation that would have shown, in numbers
};

/// What the rows of a log say of the premises.
struct Premises {
  PremiseVerdict constant;  ///< mass, inertia and friction are the same throughout the log
  PremiseVerdict offset;    ///< no effort has an offset beyond what is declared
  PremiseVerdict friction;  ///< friction has the shape that the model gives it
  /// Of two wheels, where the log has neither gyro nor pose: turning over driving, root mean squares of ω_R − ω_L and
  /// ω_R + ω_L. Above 1 one of the wheels may count backwards.
  std::optional<double> turning;
};

}  // namespace wheelwright::commission
