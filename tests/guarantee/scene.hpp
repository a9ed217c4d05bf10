// SPDX-License-Identifier: Apache-2.0
/// \file
/// A robot, two drives of it and what its sensors make of them, with the robot file that declares all of that.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"
#include "tests/guarantee/drive.hpp"

namespace wheelwright::guarantee {

/// Instants at which a row is written.
enum class Stamps {
  even,
  jittered,     ///< each step longer or shorter by up to Case::jitter of itself
  two_three,    ///< from a clock of 2.5 times the rate: two ticks, three ticks, two ticks …
  tenth_twice,  ///< every tenth step is twice as long
};

/// Kind of the motion columns.
enum class Sense {
  angle,       ///< with a bounded error
  encoder,     ///< the angle in whole counts
  mean_speed,  ///< counts from half a step before the stamp to half a step after it
  speed,       ///< with a bounded error
  whole_rpm,   ///< the speed in whole turns a minute
};

/// Errors that keep to a bound.
enum class Noise {
  uniform,
  two_point,  ///< plus or minus the bound
  plus,       ///< the bound, always
  minus,
  clipped_bell,   ///< normal of three times the bound, clipped to it
  against_heavy,  ///< signs of the filter's kernel, so that the inertia looks too large
  against_light,  ///< …too small
};

/// When efforts change.
enum class Changes {
  at_samples,  ///< held, a new one at every stamp (also at those whose row is lost)
  between,     ///< held, by a controller with a slower clock of its own: at most one change between two stamps
  linear,      ///< linear from stamp to stamp
  smooth,      ///< continuous; the declared bound holds how far it strays from linear between stamps
};

/// An assumption that the log breaks and the robot file does not tell.
enum class Broken {
  none,
  late_efforts,       ///< by Case::delay
  backward_speeds,    ///< mean speeds with the stamp of their interval's end
  stamps_off,         ///< by up to Case::delay
  hold_wrong,         ///< held efforts called linear, or the other way round
  torque_late,        ///< by one sample
  clipped_effort,     ///< a torque sensor at the end of its range
  hidden_friction,    ///< dry friction that is not among the parameters
  unlogged_commands,  ///< held commands of a controller with 2.5 times the rate of the log
  wrapped_angles,     ///< at a turn
  beyond_prior,       ///< a mass beyond the default prior
};

/// Everything that a case is.
struct Case {
  std::uint64_t seed = 1;
  Truth truth;
  double rate = 100.0;  ///< rows a second, on average
  Stamps stamps = Stamps::even;
  double jitter = 0.0;
  double lost = 0.0;  ///< share of rows at which rows go missing ...
  int burst = 1;      ///< ... so many at once
  Sense sense = Sense::angle;
  double motion_bound = 1e-3;    ///< rad or rad/s; half a count for counting sensors
  std::optional<double> counts;  ///< per turn
  bool declare_counts = true;
  model::SpeedSource speed_source = model::SpeedSource::automatic;
  double effort_bound = 0.01;          ///< N·m
  Noise noise = Noise::uniform;        ///< while learning
  Noise noise_watch = Noise::uniform;  ///< while watching
  Changes changes = Changes::at_samples;
  double controller_rate = 0.0;  ///< Hz, for Changes::between and Broken::unlogged_commands
  Order learn, watch;
  std::size_t rows = 1500, watch_rows = 3000;
  Broken broken = Broken::none;
  double delay = 0.0;              ///< s
  bool delay_declared = false;     ///< efforts are late by `delay`, and the robot file says so
  std::optional<double> beta;      ///< filter of the robot file, order 2
  bool declare_parameters = true;  ///< which parameters there are
  std::optional<double> prior;     ///< the mass is known to this factor, upwards and downwards

  /// Highest frequency of the learning drive over the rate.
  [[nodiscard]] double bandwidth_ratio() const { return learn.bandwidth / rate; }
};

/// A case, played.
struct Scene {
  Robot robot;
  LogTable learned, watched;
  std::map<std::string, double> truth;  ///< physical parameter -> value
  std::vector<double> exact_t;          ///< many instants of the learning drive in every step, s
  std::vector<double> exact_speed;      ///< true speed there: of the body (two wheels, m/s) or of the axis
  std::vector<double> exact_sign;       ///< sum of the signs of the joints' true speeds there
  std::vector<double> exact_resting;    ///< number of joints that stand still there
};

/// Plays `c`; `exact`: with the exact speeds.
[[nodiscard]] Scene play(const Case& c, bool exact = false);

/// Fault of the right wheel (or the axis) in the second drive, from a time on.
struct Breakdown {
  enum class Kind {
    effort_loss,    ///< a share `size` in [0, 1) is lost, while the logged effort is as large as it takes to drive all
                    ///< the same
    effort_bias,    ///< the effort reads `size` too much
    encoder_scale,  ///< the motion reads 1 + `size` times what it is, angles from where they are
  };
  Kind kind = Kind::effort_loss;
  double onset = 0.0;  ///< s
  double size = 0.0;
};

/// The second drive once more, broken, and with sensor errors of its own.
[[nodiscard]] LogTable watch_broken(const Case& c, const Breakdown& breakdown);

/// Case `number` of the campaign `seed`: everything follows from these two.
[[nodiscard]] Case random_case(std::uint64_t seed, std::uint64_t number);

/// Sets the efforts' reach of `order` so that wheels swing by about `angle` rad at its bandwidth, dry friction
/// overcome.
void reach_for(const Truth& truth, double angle, Order& order);

[[nodiscard]] const char* name(Breakdown::Kind x);
[[nodiscard]] const char* name(Stamps x);
[[nodiscard]] const char* name(Sense x);
[[nodiscard]] const char* name(Noise x);
[[nodiscard]] const char* name(Changes x);
[[nodiscard]] const char* name(Broken x);
[[nodiscard]] const char* name(Motion x);

}  // namespace wheelwright::guarantee
