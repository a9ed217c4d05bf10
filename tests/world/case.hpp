// SPDX-License-Identifier: Apache-2.0
/// \file
/// A case: a robot, a withheld effect, the logs, and the answer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/world/effect.hpp"
#include "tests/world/law.hpp"
#include "tests/world/oracle.hpp"

namespace wheelwright::reality {

/// Composition of a set.
enum class Kind { mixed, single, pair, triple, none, outside };

/// Request for random cases. Equal requests give equal cases.
struct Request {
  std::uint64_t seed = 1;
  Kind kind = Kind::mixed;
  bool hard = false;   ///< a third of the severity, three times the noise, imperfect robots
  double low = 5.0;    ///< least gap that one effect makes, per cent of the torque's RMS; the noise may ask for more
  double high = 35.0;  ///< largest, likewise
  double duration = 120.0;  ///< s
  std::string effect;       ///< this effect alone, where it is given
  LawChoice laws;           ///< what effects follow; it changes no other draw
  bool wide = false;        ///< robots of 0.5 to 500 kg, none of which is quite what its file says
  bool ordinary = false;    ///< logs with jitter, lost rows and smoothed speeds (Logger)
  bool each = false;        ///< every effect and law in turn, one to a case
};

/// An effect under a law.
struct Subject {
  const Entry* entry = nullptr;
  const Law* law = nullptr;  ///< null: the one law that the effect has

  [[nodiscard]] Effect make(const RobotDesign& robot, Random random, double severity) const {
    return law != nullptr ? law->make(robot, random, severity) : entry->make(robot, random, severity);
  }
};

/// Every law of every effect that is not outside, and the effects that have one law only; of `effect` alone where it
/// is not empty.
[[nodiscard]] std::vector<Subject> subjects(std::string_view effect = {});

/// An effect that was drawn.
struct Cause {
  Subject of;
  double severity = 1.0;
  double before = 0.0;  ///< gap that it alone makes with the healthy robot's parameters, per cent of the torque's RMS
  double after = 0.0;   ///< likewise with parameters by least squares; both on the part of the drive that was tried
  std::vector<std::pair<std::string, double>> parameters;
};

/// Everything about a case.
struct Case {
  RobotDesign robot;
  std::vector<Cause> causes;
  Gap healthy;  ///< of the baseline
  Gap gap;      ///< of the real drive
  Oracle oracle;
  LogTable baseline, real, fresh;
};

/// Case `index` of `request`; it does not depend on any other.
[[nodiscard]] Case make_case(const Request& request, std::uint64_t index);

/// The simulator's file (MJCF) of its designer: the robot of the data sheet, with motors called as its wheels' joints.
[[nodiscard]] std::string designers_xml(const RobotDesign& robot);

/// The robot file, as its designer would write it.
[[nodiscard]] std::string robot_yaml(const RobotDesign& robot, const std::string& name);

}  // namespace wheelwright::reality
