// SPDX-License-Identifier: Apache-2.0
/// \file
/// Efforts in other units than torque: a gap is diagnosed in torques, and told in the unit of the log.
#pragma once

#include <map>
#include <string>

#include "core/log.hpp"
#include "gap/diagnosis.hpp"
#include "gap/rows/drive.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// A robot whose efforts are currents or voltages, seen as one of torques. With the motor's constants the torques are
/// physical: N k_t i for a current, N k_t V/R for a voltage, whose back-EMF N² k_t k_e/R is then a part of the viscous
/// friction. Without them an A (or V) stands for an N·m: times, angles and shares are what they are, while masses,
/// frictions and torques are in multiples of the unknown constant.
struct TorqueView {
  Robot robot;                             ///< with torques; nominal values, priors, limits and noise made so
  model::EffortKind logged{};              ///< what the log has
  bool physical = true;                    ///< whether torques are known; else an effort of 1 counts as 1 N·m
  double torque_per_effort = 1.0;          ///< 1 where they are not known
  std::map<std::string, double> back_emf;  ///< viscous parameter -> what of it is the motor's, physical units
};

/// The view of `robot`. Where torques are not physical it has no nominal values, and the widest priors that the motor's
/// constant allows. Throws InvalidArgument for constants that are not > 0.
[[nodiscard]] TorqueView in_torques(const Robot& robot);

/// Columns of efforts of `log` as those of view.robot; others are as they are.
void to_torques(LogTable& log, const TorqueView& view);

/// Units of `drive`, which was made of view.robot, as they are where torques are not physical, and whether its efforts
/// are what flowed.
void tell_units(Drive& drive, const TorqueView& view);

/// The unit `unit` of an effect's or a model's quantity with A or V in place of N·m; `unit` where torques are physical.
[[nodiscard]] std::string effort_unit(const TorqueView& view, const std::string& unit);

/// Puts numbers, units and names of `diagnosis`, made of view.robot, into those of `robot`, and its improved robot into
/// a robot with efforts as logged; a note says why where there is none.
void from_torques(Diagnosis& diagnosis, const Robot& robot, const TorqueView& view);

}  // namespace wheelwright::gap
