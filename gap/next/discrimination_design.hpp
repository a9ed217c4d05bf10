// SPDX-License-Identifier: Apache-2.0
/// \file
/// The manoeuvre that tells rival causes apart: T-optimal (Atkinson and Fedorov 1975) within limits.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commission/design/manoeuvre.hpp"
#include "gap/next/discrimination.hpp"

namespace wheelwright::design {
struct DesignSubject;
}  // namespace wheelwright::design

namespace wheelwright::gap {

/// `subject` with torques in place of currents or voltages, as a gap is diagnosed (TorqueView), where the motor's
/// constants are known; as it is where they are not, and an A or a V stands for an N·m.
[[nodiscard]] design::DesignSubject in_torques(const design::DesignSubject& subject);

/// The effort limit of `limits` of the same.
[[nodiscard]] design::MotionLimits limits_in_torques(design::MotionLimits limits, const design::DesignSubject& subject);

/// Two rivals that one drive told nothing about.
struct InseparablePair {
  std::size_t first = 0;
  std::size_t second = 0;
  bool by_any_motion = false;  ///< by every motion that was looked at; else the designed one leaves them within 1.64
                               ///< standard deviations of each other
  bool special_case =
      false;  ///< the one is the other with some coefficients that are not needed: the simpler one will do
  std::string measurement;  ///< what would split them
};

/// The objective: minus the least number of deviations (RivalSeparation::deviations) over the ordered pairs that
/// `decidable` lists (as discrimination() does; empty: all). Keeps a reference to `subject`.
[[nodiscard]] design::PlanObjective tell_apart(const design::DesignSubject& subject, const std::vector<Rival>& rivals,
                                               const std::vector<Effect>& catalogue, const PlannedNoise& noise,
                                               std::vector<bool> decidable = {});

/// A manoeuvre for discrimination, and what it promises.
struct DiscriminationDesign {
  design::Manoeuvre manoeuvre;
  std::vector<Rival> rivals;
  std::vector<RivalSeparation> promised;            ///< every ordered pair
  std::vector<bool> decidable;                      ///< of each: whether some motion shows A as what B cannot be
  std::vector<InseparablePair> inseparable;         ///< unordered
  std::vector<RivalSeparation> analysed;            ///< of the drive that was analysed; empty where there is none
  std::optional<design::FigureEight> figure_eight;  ///< the best one within the same limits (differential drive)
  std::optional<design::Plan> figure_eight_plan;
  std::vector<RivalSeparation> promised_eight;

  /// The decidable pair that is told apart worst, or nothing where none is decidable.
  [[nodiscard]] std::optional<std::size_t> worst() const;
  /// What the manoeuvre does, stage by stage.
  std::vector<std::string> stages;
  /// What it promises, for people.
  std::vector<std::string> sentences;
};

/// Stages of constant speed of the first half of `plan` in words, e.g. "1.2 s forwards at 0.8 m/s", and that it comes
/// back.
[[nodiscard]] std::vector<std::string> stage_words(const design::Plan& plan, const Model& model);

/// Measurement that separates two rivals which no log of efforts, wheel speeds and pose separates.
[[nodiscard]] std::string splitting_measurement(const Rival& a, const Rival& b, const std::vector<Effect>& catalogue);

/// design_manoeuvre() for tell_apart() over the decidable pairs; for comparison beside it the drive that was analysed,
/// or the best figure eight where there is none. An ordered pair
/// (A, B) is decidable where on one of some random manoeuvres within the limits B fails to imitate more than 10⁻⁴ of
/// A's signature, and θ does not take up the signature but for errors of sampling (3·10⁻⁴ of its sum of squares).
/// `analysed`: with predicted efforts; may be null. Throws InvalidArgument
/// as discrimination() and design_manoeuvre() do.
[[nodiscard]] DiscriminationDesign design_for_discrimination(
    const design::DesignSubject& subject, const design::MotionLimits& limits, const std::vector<Rival>& rivals,
    const std::vector<Effect>& catalogue, const PlannedNoise& noise, const design::DesignOptions& options = {},
    const Drive* analysed = nullptr);

}  // namespace wheelwright::gap
