// SPDX-License-Identifier: Apache-2.0
/// \file
/// The sim-to-real gap of a robot: where it lies, which unmodelled effect causes it, how far it shrinks once the effect
/// is in the model. The result is written as gap.json.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "gap/effects/effect.hpp"
#include "gap/rows/gap_rows.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// Verdict of the log on the model.
enum class GapVerdict {
  no_gap,       ///< the model, re-fitted at most within its prior, explains the log to the noise floor
  explained,    ///< one cause (which may be a combination) beats every other, and reaches the floor
  ambiguous,    ///< the causes in the credible set cannot be told apart on this log
  unexplained,  ///< what the best cause leaves is above the floor
};

/// Its name in files: that of the enumerator.
[[nodiscard]] std::string_view to_string(GapVerdict verdict);

/// What the robot of the log is compared with.
enum class GapReference {
  robot_file,   ///< the model with the nominal values of the robot file; those that it lacks are fitted to the log
  healthy_log,  ///< the model as fitted to a log of the healthy robot
  simulator,    ///< the model as fitted to a simulator's log: what that simulator does
};

/// A number with its 95 % interval.
struct GapEstimate {
  std::string name;
  std::string unit;
  double estimate = 0.0;
  double lower = 0.0;
  double upper = 0.0;
  bool shape = false;  ///< enters the effect's columns nonlinearly
};

/// A law that a cause may follow: an effect of its family, as fitted in its place.
struct GapLaw {
  std::string effect;
  std::string sentence;
  std::vector<GapEstimate> parameters;
};

/// One cause of the best combination.
struct GapCause {
  std::string effect;
  std::string sentence;
  bool parametric = false;
  std::vector<GapEstimate> parameters;
  double share = 0.0;  ///< of the gap, Shapley value over the combination; the shares add up to what is explained
  std::optional<double> probability{};  ///< that it is there, alone or with others; nothing where no record is known
  std::string family{};                 ///< Effect::family; empty: none
  std::vector<GapLaw> laws{};  ///< of its family between which the log does not tell, `effect` first; empty: it
                               ///< leaves no other one standing
};

/// A member of the model confidence set.
struct CredibleCauses {
  std::vector<std::string> effects;
  double held_out_error = 0.0;          ///< mean square, in units of the noise floor's
  double p_value = 0.0;                 ///< that it is as good as the best member
  std::optional<double> probability{};  ///< that these causes are there and no others; nothing where no record is known
  std::vector<std::string> trifles{};   ///< those of the effects whose share of the gap is nothing in two decimals
  std::size_t answer = 0;               ///< number of the answer that the set belongs to, number_answers()
};

/// Number of answers among the sets (CredibleCauses::answer).
[[nodiscard]] std::size_t answers_among(const std::vector<CredibleCauses>& credible);

/// What became of diagnoses of one kind, on logs of which the causes were withheld from the tool.
struct TrackRecord {
  int logs = 0;
  int first = 0;    ///< on which just the causes that were named first were there
  int other = 0;    ///< on which just those of another member of the credible set were
  int causes = 0;   ///< that were named first, on all of these logs
  int present = 0;  ///< of them: that were there, alone or with others
};

/// The smallest size of a cause at which a log without a gap would not have passed for one.
struct VisibleSize {
  std::string effect;
  std::string parameter;  ///< as GapCause::parameters has it
  std::string unit;
  double size = 0.0;  ///< in `unit`; a magnitude
};

/// A healthy robot that the model does not fit.
struct HealthyMisfit {
  std::string channel;
  double share = 0.0;                ///< of that channel's mean square: what the model leaves beyond the sensors' noise
  std::vector<std::string> known{};  ///< effects that are in the model of the healthy robot already
  std::vector<std::string>
      helping{};         ///< effects that would take off most of what it leaves, most first; empty: none of
                         ///< the catalogue takes off a tenth
  std::string regime{};  ///< in which what it leaves is concentrated; empty: in none
};

/// Two sets of causes that look alike on this log, whatever came out.
struct ConfusablePair {
  std::string first, second;
  double similarity = 0.0;   ///< share of one's signature (after θ is fitted again) that the other explains, in [0, 1]
  bool inseparable = false;  ///< by any log without further sensors, not by this one alone
  std::string reason;        ///< "not excited", or what measurement would split them
};

/// Share of the structural part (mean square above the floor) by where it lies.
struct GapShare {
  GapSpace space = GapSpace::dynamic;
  std::string channel;
  std::string regime;  ///< e.g. "reversal of the right wheel", "0.5 to 1 Hz", "t = 20 to 25 s"
  std::string kind;    ///< what the regime is a part of: "speed", "frequency", "time", …
  double share = 0.0;
  double presence = 0.0;  ///< share of the rows
  double p_value = 1.0;   ///< that the excess is there by chance, under autocorrelation
};

/// One figure before and after the causes are added to the model, on held-out data.
struct ShrinkFigure {
  std::string name;  ///< "sum", "velocity_1s", …
  std::string unit;
  double before = 0.0;  ///< of the nominal model
  double after = 0.0;   ///< of the model with the causes
  double floor = 0.0;   ///< of noise alone; 0 where none is known
  double lower = 0.0;   ///< 95 % interval of `after`
  double upper = 0.0;
};

/// Shrinkage of the gap.
struct GapShrink {
  std::vector<ShrinkFigure> torque_rms;       ///< per channel
  std::vector<ShrinkFigure> rollout;          ///< open loop
  std::vector<ShrinkFigure> threshold_width;  ///< per channel, median of u − l
  std::vector<ShrinkFigure> smallest_fault;   ///< per channel, share of the wheel radius
  std::vector<ShrinkFigure>
      fresh_torque_rms;  ///< per channel, on another log that nothing was fitted to; where there is one
};

/// A parameter of θ: nominal, estimated without the causes (biased by them), and estimated with them. An estimate of
/// what cannot be negative (a mass, a friction) that is not above 0 is NaN: the log does not tell it from 0. Its lower
/// end is then 0.
struct ParameterShift {
  std::string parameter;
  std::string unit;
  std::optional<double> nominal;
  double without_causes = 0.0;
  double estimate = 0.0;
  double lower = 0.0;
  double upper = 0.0;
};

/// Rows that no θ explains together within the noise (Farkas certificate of an empty feasible set).
struct Contradiction {
  double t = 0.0;  ///< s
  std::string channel;
  double weight = 0.0;  ///< its share of the certificate
};

/// Result of diagnose().
struct Diagnosis {
  GapVerdict verdict = GapVerdict::no_gap;
  std::string summary;                   ///< a few sentences for people
  std::vector<GapCause> causes;          ///< best combination, largest share first
  std::vector<CredibleCauses> credible;  ///< model confidence set at 90 %
  std::optional<TrackRecord> record;  ///< of diagnoses like this one; with a log of the healthy robot, efforts, a pose
                                      ///< and the catalogue whole, as it was taken
  std::vector<VisibleSize> visible;   ///< with no_gap: by effect, in the order of the catalogue
  std::optional<HealthyMisfit> misfit;    ///< nothing: the model fits the healthy robot, or there is no log of it
  std::vector<CredibleCauses> looked_at;  ///< best sets of every size, the empty one first: what was tried
  std::vector<ConfusablePair> confusable;
  std::vector<GapShare> where;  ///< largest share first
  GapShrink shrink;
  std::vector<ParameterShift> parametric;
  std::vector<Contradiction> contradictions;
  GapReference reference = GapReference::robot_file;
  double gap = 0.0;                      ///< what `reference` leaves above the floor, share of the efforts' mean square
  double structural = 0.0;               ///< the part of it that stays after θ is fitted again
  double remaining = 0.0;                ///< share of the gap that the causes leave
  double floor_error = 0.0;              ///< relative error of the floor
  std::string floor_origin;              ///< where the floor is from, in words
  double beta = 0.0;                     ///< of the filter, 1/s
  std::vector<std::string> not_excited;  ///< effects that this log could not show, with what to drive
  std::vector<std::string> notes;
  std::vector<ResidualSeries> series;  ///< for pictures
  Eigen::VectorXd theta;               ///< p, θ_L with the causes beside it
  std::vector<FittedEffect> fitted;    ///< the causes
  std::optional<Robot> improved;       ///< the robot with its causes, where the robot file can carry them
};

}  // namespace wheelwright::gap

namespace wheelwright {
using gap::Diagnosis;
}  // namespace wheelwright
