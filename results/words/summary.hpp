// SPDX-License-Identifier: Apache-2.0
/// \file
/// Results in a few lines or tables for a terminal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/choice/detector_choice.hpp"
#include "commission/commission.hpp"
#include "commission/design/detection.hpp"
#include "commission/design/manoeuvre.hpp"
#include "commission/doctor/log_health.hpp"
#include "commission/watch/blind_watch.hpp"
#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "commission/watch/risk_watch.hpp"
#include "gap/diagnosis.hpp"
#include "gap/next/discrimination_design.hpp"
#include "identify/inference/identification.hpp"
#include "study/bound_derivatives.hpp"
#include "study/fleet_result.hpp"
#include "study/study.hpp"

namespace wheelwright::words {

/// The smallest fault ζ = κ·Yθ of which some instant of held-out driving is certain, in the words of the robot's kind;
/// that there is none where κ is more than 1.
[[nodiscard]] std::string smallest_fault(const Robot& robot, double kappa);

/// Summary of a commissioning for a terminal.
[[nodiscard]] std::string summary(const Commissioning& result);

/// Summary of a detection for a terminal.
[[nodiscard]] std::string summary(const Detection& detection, const OnlineModel& model);

/// Summary of the kinematic residual for a terminal.
[[nodiscard]] std::string summary(const commission::KinematicWatch& watch, const OnlineModel& model);

/// The examination of a log for a terminal: findings, the gravest first (`all`: also what is as it should be), then the
/// verdict.
[[nodiscard]] std::string summary(const doctor::LogHealth& health, bool all = false);

/// The choice for a terminal: a table of all candidates, the stated faults, what each guarantee decides, and
/// `robot_file_line`, which asks for the chosen filter.
[[nodiscard]] std::string summary(const commission::DetectorChoice& choice, const std::string& robot_file_line);

/// Summary of the detector at a stated risk for a terminal; empty where the model says nothing at a risk.
[[nodiscard]] std::string summary(const commission::RiskWatch& watch, const OnlineModel& model);

/// The incidents for a terminal, a line each; empty where there are none.
[[nodiscard]] std::string summary(const std::vector<detector::Incident>& incidents);

/// Why a detector of `model` decided at no instant of `rows` rows with the median step `step` (s), or at instants that
/// tell nothing (commission::hardly_goes_on()), with what to do about it.
[[nodiscard]] std::string why_undecided(const OnlineModel& model, std::size_t rows, double step);

/// Why `detection`, by `model`, says nothing of a log as a whole (commission::how_watched()), with what to do about it;
/// empty where it does. `rows` are those with the median step `step` (s), `met` those that were met, and `repairs` says
/// what reading found.
[[nodiscard]] std::string why_not_decided(const Detection& detection, const OnlineModel& model, std::size_t rows,
                                          double step, std::size_t met, const std::vector<std::string>& repairs);

/// Why most of a log was not decided on: `instants` of the `rows` that were met; `repairs` says what reading found.
[[nodiscard]] std::string why_mostly_undecided(std::size_t instants, std::size_t rows,
                                               const std::vector<std::string>& repairs);

/// Why rows of a stream bring no decision: `causes`, or that they are too few for the filter of `model`.
[[nodiscard]] std::string why_blind(const OnlineModel& model, const std::vector<std::string>& causes);

/// That `rows` of a stream were so near to those before them by its clock that they tell nothing to `model`.
[[nodiscard]] std::string crawling_words(const OnlineModel& model, std::size_t rows);

/// A spell without decisions in a line, for the reason `why`; `until` (s) where it is over.
[[nodiscard]] std::string blind_line(const commission::BlindSpell& spell, std::optional<double> until,
                                     const std::string& why);

/// A time in which no row of a stream came in a line.
[[nodiscard]] std::string silence_line(const commission::StreamSilence& silence);

/// One event in a line.
[[nodiscard]] std::string event_line(const detector::Event& event, const OnlineModel& model);

/// Words first, then one table of estimates and intervals by every method, then what to do next.
[[nodiscard]] std::string summary(const inference::Identification& result);

/// Files that the summary refers to.
struct GapResults {
  std::string out;                         ///< what stands before names of results; empty: none was written
  std::string robot;                       ///< robot file
  bool improved = false;                   ///< whether robot_improved.yaml was written
  std::string next_manoeuvre;              ///< what the next drive promises; empty: none was designed
  bool commands = false;                   ///< whether next_manoeuvre.csv was written
  bool naive = false;                      ///< whether the naive rule was asked
  std::vector<std::string> naive_effects;  ///< what it said
};

/// Verdict, causes with their intervals, what the healthy log had already, how far the gap shrinks, and what to do
/// next.
[[nodiscard]] std::string summary(const Diagnosis& diagnosis, const GapResults& results);

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::BoundsDesign& design, const design::DesignSubject& subject);

/// The result for a terminal.
[[nodiscard]] std::string summary(const design::DetectionDesign& design);

/// The result for a terminal.
[[nodiscard]] std::string summary(const gap::DiscriminationDesign& design);

/// One table for each quantity: what each input does to it, by every method that the study asks for; the widths'
/// elasticities; and what could not be evaluated.
[[nodiscard]] std::string summary(const study::Study& study, const study::StudyResult& result,
                                  const std::optional<study::LocalSensitivity>& local);

/// The fleet for a terminal: its sentences, then why logs failed, the most frequent reasons first.
[[nodiscard]] std::string summary(const study::FleetResult& fleet);

}  // namespace wheelwright::words
