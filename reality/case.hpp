// SPDX-License-Identifier: Apache-2.0
/// \file
/// A case: a robot, a withheld effect, the logs, and the answer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <wheelwright/reality/effect.hpp>
#include <wheelwright/reality/oracle.hpp>

namespace wheelwright::reality {

/// Composition of a set.
enum class Kind { mixed, single, pair, none, outside };

/// Request for random cases. Equal requests give equal cases.
struct Request {
  std::uint64_t seed = 1;
  Kind kind = Kind::mixed;
  bool hard = false;        ///< a third of the severity, three times the noise, imperfect robots
  double duration = 120.0;  ///< s
  std::string effect;       ///< this effect alone, where it is given
};

/// An effect that was drawn.
struct Cause {
  const Entry* entry = nullptr;
  double severity = 1.0;
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

/// The robot file, as its designer would write it.
[[nodiscard]] std::string robot_yaml(const RobotDesign& robot, const std::string& name);

}  // namespace wheelwright::reality
