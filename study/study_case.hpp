// SPDX-License-Identifier: Apache-2.0
/// \file
/// Inputs of a study with their ranges, and one point of a study: a robot and the drive from which it is commissioned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"
#include "model/sim/scenario.hpp"

namespace wheelwright::study {

/// One input of a study. Designs live in the unit cube; value() says what a coordinate stands for.
struct StudyInput {
  std::string name;          ///< as the study file has it, e.g. "noise.wheel_speed"
  std::string unit;          ///< empty for pure numbers
  double lower = 0.0;        ///< value at 0
  double upper = 1.0;        ///< value at 1
  double nominal = 0.5;      ///< the value that it has where it is not varied, in [lower, upper]
  bool logarithmic = false;  ///< equal ratios, instead of equal differences, are equally likely
};

/// Throws InvalidArgument, naming the input and the field, unless numbers are finite, lower < upper,
/// lower <= nominal <= upper and, where logarithmic, lower > 0.
void validate(const StudyInput& input);

/// The value at `u` in [0, 1]; exactly `lower` at 0 and `upper` at 1.
[[nodiscard]] double value(const StudyInput& input, double u);

/// The coordinate of `x` in [lower, upper]: the inverse of value() to rounding.
[[nodiscard]] double coordinate(const StudyInput& input, double x);

/// A robot with a drive: a recorded log, or a scenario that is driven anew. Without inputs, what a study starts from.
struct StudyCase {
  Robot robot;                            ///< what the engineer believes: the robot file that is commissioned with
  std::optional<Scenario> scenario{};     ///< the world, whose robot is the true one; else `log` is the drive
  std::shared_ptr<const LogTable> log{};  ///< a recorded drive
  std::optional<double> rate{};           ///< Hz, of a recorded log: every n-th row, n >= 1 nearest to it
  std::optional<double> duration{};       ///< s from the beginning of a recorded log
  std::size_t outliers = 0;               ///< instants at which an effort is grossly wrong
  std::size_t outliers_allowed = 0;       ///< CommissionOptions::outliers
  std::optional<std::uint64_t> seed{};    ///< of the scenario's noise and of where outliers lie
};

/// Kind of input, with its unit and a sentence.
struct StudyInputKind {
  std::string name;  ///< with NAME for a physical parameter
  std::string unit;
  std::string sentence;
  bool simulated = false;  ///< needs a scenario
};

/// All of them:
///
/// noise.SENSOR, declared.SENSOR, filter.alpha, filter.beta, wheel_radius, track_width, encoder_counts_per_turn,
/// prior.NAME, rate, duration, outliers, outliers_allowed; of a scenario also excitation, truth.NAME, seed.
/// SENSOR is wheel_speed, wheel_angle, effort, position or heading. `noise.` changes the sensor and what the robot file
/// says of it together, `declared.` what the file says alone; of a recorded log nothing but the file can change.
[[nodiscard]] const std::vector<StudyInputKind>& study_input_kinds();

/// The unit of the input `name`. Throws InvalidArgument, with the nearest names, where there is no such input.
[[nodiscard]] std::string unit_of_input(const std::string& name);

/// The value that the input `name` has in `subject` before anything is set; nothing where it has none (a filter that is
/// chosen from the data, noise that is estimated). Throws InvalidArgument where there is no such input, or the subject
/// lacks what it is about (a prior for NAME, a scenario).
[[nodiscard]] std::optional<double> nominal_of_input(const StudyCase& subject, const std::string& name);

/// Sets the input `name` of `subject` to `x`; numbers of instants, rows and seeds are rounded. Throws InvalidArgument
/// as nominal_of_input, and for a value that the input cannot have.
void set_input(StudyCase& subject, const std::string& name, double x);

/// The drive of a case: simulated, or cut from the recorded log; outliers put in. Throws InvalidArgument where the
/// scenario makes no sense with its inputs, or a recorded log of mean speeds without angles is to be thinned.
[[nodiscard]] LogTable drive_of_case(const StudyCase& subject);

/// The length of a robot that the input `name` moves (wheel_radius, track_width); null where it is none.
[[nodiscard]] double Robot::*length_of(std::string_view name);

}  // namespace wheelwright::study
