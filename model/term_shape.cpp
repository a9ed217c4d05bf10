// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "model/model.hpp"

namespace wheelwright::model {
namespace {

// |cos²a − cos²b| = |sin(a + b) sin(a − b)| <= min(1, |a − b|), and the same for sin².
TermValue share_of_speed(double share, const MotionState& state) {
  const double share_error = std::min(1.0, state.heading_error);
  const double speed = state.speed[0];
  return {share * speed, std::min(1.0, share + share_error) * state.speed_error[0] + share_error * std::abs(speed)};
}

TermValue along_x(const MotionState& state) {
  const double c = std::cos(state.heading);
  return share_of_speed(c * c, state);
}

TermValue along_y(const MotionState& state) {
  const double s = std::sin(state.heading);
  return share_of_speed(s * s, state);
}

// sgn ω_R ± sgn ω_L; where a sign is in doubt its friction is any number in [−1, 1].
TermValue signs(const MotionState& state, double of_left) {
  TermValue sum;
  for (std::size_t j = 0; j < 2; ++j) {
    const double w = state.joint_speed[j];
    if (state.joint_error[j] > 0.0 && std::abs(w) <= state.joint_error[j]) {
      sum.error += 1.0;
    } else {
      sum.value += (j == 0 ? 1.0 : of_left) * (static_cast<double>(w > 0.0) - static_cast<double>(w < 0.0));
    }
  }
  return sum;
}

TermValue sum_of_signs(const MotionState& state) { return signs(state, 1.0); }
TermValue difference_of_signs(const MotionState& state) { return signs(state, -1.0); }

// At rest, and where the sign of the speed is in doubt, dry friction is anywhere in [−1, 1].
TermValue sign_of_speed(const MotionState& state) {
  const double v = state.speed[0];
  if (std::abs(v) <= state.speed_error[0]) {
    return {0.0, 1.0};
  }
  return {v > 0.0 ? 1.0 : -1.0, 0.0};
}

TermValue constant(const MotionState&) { return {1.0, 0.0}; }

TermFunction::Plain function_of(TermShape shape) {
  switch (shape) {
    case TermShape::own: return nullptr;
    case TermShape::along_x: return along_x;
    case TermShape::along_y: return along_y;
    case TermShape::sum_of_signs: return sum_of_signs;
    case TermShape::difference_of_signs: return difference_of_signs;
    case TermShape::sign_of_speed: return sign_of_speed;
    case TermShape::constant: return constant;
  }
  return nullptr;
}

}  // namespace

TermFunction::TermFunction(TermShape shape) : shape_(shape), plain_(function_of(shape)) {}

}  // namespace wheelwright::model
