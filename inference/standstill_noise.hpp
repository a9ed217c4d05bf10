// SPDX-License-Identifier: Apache-2.0
/// \file
/// Noise levels of the columns of a log while the robot stands still.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/identify/noise_level.hpp>

namespace wheelwright::inference {

/// By which columns standstill is recognised. Commands, where there are any, must be zero; and the motion, where there
/// is any, must rest too: a robot that coasts or is pushed does not stand still.
struct StandstillSigns {
  std::vector<std::string> commands;  ///< commanded speeds of all joints
  std::vector<std::string> speeds;    ///< measured speeds of all joints
  std::vector<std::string> angles;    ///< measured angles of all joints; looked at where there are no speeds
};

/// The signs that `log` has for `model`: each list only where the columns of all joints are there.
[[nodiscard]] StandstillSigns standstill_signs(const LogSource& log, const Model& model);

/// Criteria for standstill.
struct StandstillOptions {
  double least_time = 1.0;  ///< s, of a stretch after trimming
  double trim = 0.5;        ///< s, left out at both ends of a stretch: coasting, and torque that rises before motion
  double near = 0.05;       ///< of the joint's largest speed in the log: every measured speed in a stretch is below
  double slow = 0.005;      ///< of the same: the mean speed of each half of a stretch is below, so slow creeping is
                            ///< told from noise about zero
  double piece = 60.0;      ///< s: longer stretches are cut, so slow drift of an offset is not taken for noise
  identify::ExtrapolationOptions extrapolation;  ///< of the bounds
};

/// One column at standstill.
struct StandstillNoise {
  /// What the column shows.
  enum class Kind {
    not_seen,  ///< the log has no standstill: all numbers are 0
    constant,  ///< never changes within a stretch. An encoder at rest does not: its rounding shows in motion only, so
               ///< that nothing about its noise follows
    noisy,     ///< changes
  };
  Kind kind = Kind::not_seen;
  double offset = 0.0;                ///< mean over all stretches, unit of the column
  double offset_spread = 0.0;         ///< standard deviation of the stretches' means; 0 for a single one
  double sd = 0.0;                    ///< within the stretches, about their means
  double relative_sd = 0.0;           ///< standard error of sd², relative to it, allowing for autocorrelation
  double correlation = 0.0;           ///< between neighbouring samples
  double largest = 0.0;               ///< largest deviation from a stretch's mean
  identify::ExtrapolatedBound bound;  ///< on the deviation, extrapolated over the horizon as noise_level.hpp says
};

/// The noise levels of the columns, and the stretches of standstill that they come from.
struct Standstill {
  std::vector<StandstillNoise> columns;  ///< in the order that was asked
  std::size_t stretches = 0;
  std::size_t samples = 0;
  double seconds = 0.0;    ///< of standstill, after trimming
  std::string recognised;  ///< how, e.g. "commands at zero, speeds near zero for 1 s"; why not where there is none
};

/// Noise of each of `columns` at standstill, two walks; no more than one piece is held in memory.
///
/// Assumes that the noise of the robot in motion is that of the robot at rest. For efforts and inertial sensors this is
/// a lower limit (no switching currents, no vibration); for encoders it is meaningless (Kind::constant, or a count that
/// flickers). Throws InvalidArgument when a column is missing, no sign is given, or an option is not positive.
[[nodiscard]] Standstill standstill_noise(LogSource& log, const StandstillSigns& signs,
                                          const std::vector<std::string>& columns,
                                          const StandstillOptions& options = {});

}  // namespace wheelwright::inference
