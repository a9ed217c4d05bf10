// SPDX-License-Identifier: Apache-2.0
/// \file
/// One robot of a fleet, examined: the item of work of `wheelwright fleet`.
#pragma once

#include <vector>

#include "commission/commission.hpp"
#include "detector/detector_options.hpp"
#include "study/population.hpp"
#include "study/robot_logs.hpp"

namespace wheelwright::study {

/// Options of examine_robot().
struct ExamineOptions {
  commission::CommissionOptions commission{};
  detector::DetectorOptions detector{};
};

/// Commissions the robot, walks its detector over every check, and commissions each check by itself. Whatever a log or
/// a robot throws (any std::exception) becomes the status and message of that log: nothing is thrown. The same logs
/// give the same record.
[[nodiscard]] RobotRecord examine_robot(const RobotLogs& logs, const ExamineOptions& options = {});

/// The record's parameters of a commissioning; none where it gave no bounds.
[[nodiscard]] std::vector<RecordedParameter> recorded_parameters(const Commissioning& result);

}  // namespace wheelwright::study
