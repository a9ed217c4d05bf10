// SPDX-License-Identifier: Apache-2.0
/// \file
/// The robots of the study of peers, how they drive, and how large a fault must be for them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "commission/commission.hpp"
#include "detector/threshold.hpp"
#include "model/fault_type.hpp"
#include "tests/benchmarks/peers/statistic.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::peers {

/// Knowledge of the parameters.
enum class Regime {
  uncertain,   ///< θ in θ° ± 20 %, another one in every drive; θ̂ one of them
  identified,  ///< commissioned on a rich log of 60 s
};

enum class Driving { gentle, varied, hard };
inline constexpr std::array kDriving = {Driving::gentle, Driving::varied, Driving::hard};
[[nodiscard]] std::string_view to_string(Driving driving);

/// A robot as its detectors know it.
struct Subject {
  Scenario scenario;        ///< sensors and θ°; noise is as large as declared, without the bias that is
  Scenario learning;        ///< the drive of 60 s that it was commissioned on
  OnlineModel model;        ///< facets, box and estimate are those of the regime
  OnlineModel statistical;  ///< the same with NoiseMode::statistical
  Regime regime = Regime::identified;
  Eigen::MatrixXd covariance;               ///< of θ̂; of a uniform θ in the box where it is uncertain
  std::array<double, kOutputs> variance{};  ///< of the residual of a least-squares fit to the learning log
  double torque_sd = 0.0;                   ///< of the noise of an effort, as declared, N·m
  double angle_sd = 0.0;                    ///< of the noise of an angle, rad

  [[nodiscard]] detector::ThresholdRule rule(
      detector::ParameterSetKind kind = detector::ParameterSetKind::polytope) const {
    return {Polytope(model.facets, model.box), model.estimate, kind};
  }
  [[nodiscard]] detector::ThresholdRule statistical_rule() const {
    return {Polytope(statistical.facets, statistical.box), model.estimate};
  }
};

/// The robot of a seed in a regime. Throws InvalidArgument where commissioning fails.
[[nodiscard]] Subject make_subject(std::uint64_t seed, Regime regime);

/// A fault-free drive: trajectory and, where they are uncertain, parameters are those of the seed.
[[nodiscard]] Scenario make_drive(const Subject& subject, Driving driving, std::uint64_t seed, double duration);

/// Drives in which a robot breaks, still without a fault: `count` for each class of driving, one class after the other.
[[nodiscard]] std::array<std::vector<testing_support::FaultyRun>, kDriving.size()> make_runs(const Subject& subject,
                                                                                             std::uint64_t robot,
                                                                                             std::size_t count);

/// Fault-free logs of about `samples` samples in all: varied driving, other drives than those that are judged.
[[nodiscard]] std::vector<LogTable> usual_logs(const Subject& subject, std::uint64_t robot, double samples);

/// Seed of a drive of a robot.
[[nodiscard]] std::uint64_t drive_seed(std::uint64_t robot, Driving driving, std::uint64_t number);

/// s after the onset in which a fault counts as seen.
inline constexpr double kPatience = 5.0;

/// A fault that is tried: with its simulated counterpart.
struct TriedFault {
  FaultType type;
  std::optional<model::Fault::Kind> simulated;
  std::array<double, 2> certain{};  ///< median over onsets of the smallest size certain within 1 s: growing, shrinking;
                                    ///< infinite where none is in half of them
};

/// The faults of the study for this robot in this driving, with their sizes along noise-free drives of θ°.
[[nodiscard]] std::vector<TriedFault> tried_faults(const Subject& subject, Driving driving, std::uint64_t seed);

}  // namespace wheelwright::peers
