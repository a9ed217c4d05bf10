// SPDX-License-Identifier: Apache-2.0
/// \file
/// A fleet as a population: records of single robots (numbers and sentences, no logs and no sets) and their table by
/// parameter; random effects, robots outside at a family-wise level (Holm); a prior box for the next robot, with a
/// coverage that holds whatever the distribution.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/interval.hpp"
#include "core/warrant.hpp"

namespace wheelwright::study {

/// Status of a robot's commissioning.
enum class RobotStatus {
  commissioned,  ///< every parameter shows
  partial,       ///< a model came out; the bounds of some parameters are the prior's
  contradicted,  ///< no parameters explain the log within the declared noise
  nothing,       ///< no parameter shows: no model
  unreadable,    ///< the log or the robot file cannot be used: the message says why
};

/// One parameter of one log. Where the effort's constants are known it is the physical quantity as a robot file's
/// `prior` counts it, θ_L,j / per_physical (under voltage, viscous terms with the braking of the back-EMF in them);
/// else θ_L,j itself. Bounds are rounded outward.
struct RecordedParameter {
  std::string name;  ///< physical name, name of θ_L,j, or "kinematic." and the name of a kinematic parameter
  std::string unit;
  bool is_prior_key = false;               ///< `name` is a key of a robot file's `prior`
  std::optional<double> estimate{};        ///< nothing where the log does not show the parameter
  std::optional<double> standard_error{};  ///< of the estimate, where it is finite
  std::optional<double> freedom{};  ///< degrees of freedom of the standard error; nothing where it is taken as exact
  double lower = 0.0;               ///< of the bounds, in the sense of `warrant`
  double upper = 0.0;
  bool lower_is_prior = false;  ///< the log does not tighten this side
  bool upper_is_prior = false;
  Interval prior{};  ///< in which the bounds were sought; [lower, upper] where that is not known
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of lower and upper

  friend bool operator==(const RecordedParameter&, const RecordedParameter&) = default;
};

/// The threshold of one output, on driving that was held out.
struct RecordedOutput {
  std::string name;
  std::string unit;
  double median_width = 0.0;     ///< of u − l, unit of the output
  std::size_t instants = 0;      ///< held out
  std::size_t false_alarms = 0;  ///< of these, outside

  friend bool operator==(const RecordedOutput&, const RecordedOutput&) = default;
};

/// A log, or several taken together, commissioned by itself.
struct LogRecord {
  std::string log;    ///< as the list names it
  double when = 0.0;  ///< days; a plain order where RobotRecord::dated is false
  RobotStatus status = RobotStatus::unreadable;
  std::string message;  ///< one sentence for people
  double seconds = 0.0;
  std::size_t rows = 0;
  std::vector<RecordedParameter> parameters{};

  friend bool operator==(const LogRecord&, const LogRecord&) = default;
};

/// A later log: looked at by the detector of the commissioned model, and commissioned anew to see what moved.
struct CheckRecord {
  LogRecord log;
  bool checked = false;           ///< there was a model, and the detector decided on the log or saw a fault
  std::string not_checked;        ///< why it was not; else empty
  std::size_t events = 0;         ///< alarms of both residuals
  std::optional<double> first{};  ///< time of the first alarm, s of the log
  std::size_t instants = 0;       ///< decisions of the torque residual
  double outside_share = 0.0;     ///< largest share of instants outside over its outputs

  friend bool operator==(const CheckRecord&, const CheckRecord&) = default;
};

/// A robot's entry in the fleet.
struct RobotRecord {
  std::string robot;
  bool dated = false;  ///< `when` of its logs are dates (days since 1970-01-01) or days; else their order
  LogRecord commissioning;
  std::vector<RecordedOutput> outputs{};
  std::optional<double> smallest_radius_change{};  ///< share of the wheel radius certainly seen held out; nothing where
                                                   ///< none up to 41 % (an effort scaled by 2) is, or for no wheels
  std::vector<CheckRecord> checks{};               ///< in order of time
  std::vector<std::string> notes{};
  std::vector<std::string> findings{};  ///< what is wrong with the robot's entry (a duplicate, a missing file)
  bool passing = false;  ///< its files changed while they were read: another run says something else of them

  friend bool operator==(const RobotRecord&, const RobotRecord&) = default;
};

/// One robot's value of a parameter.
struct FleetEntry {
  std::size_t robot = 0;        ///< index into FleetTable::robots
  double estimate = 0.0;        ///< NaN where the log does not show it
  double standard_error = 0.0;  ///< NaN where there is none
  double freedom = 0.0;         ///< of the standard error; infinite where it is taken as exact
  double lower = 0.0;           ///< bounds
  double upper = 0.0;
  Interval prior{};  ///< in which they were sought
};

/// One parameter over the fleet.
struct FleetColumn {
  std::string name;
  std::string unit;
  bool is_prior_key = false;
  std::vector<FleetEntry> entries{};  ///< ascending robots
  core::Warrant warrant =
      core::Warrant::extrapolated;  ///< the weakest of all logs' bounds of it, those of checks included
};

/// Robots in the order in which they were added.
struct FleetTable {
  std::vector<std::string> robots{};
  std::vector<RobotStatus> status{};
  std::vector<FleetColumn> columns{};
};

/// Index of the column `name` with `unit`; a new one where there is none.
[[nodiscard]] std::size_t column_of(FleetTable& table, const RecordedParameter& parameter);

/// Appends the robot of `record` with the parameters of its commissioning.
void add(FleetTable& table, const RobotRecord& record);

/// Result of fit_random_effects().
struct RandomEffects {
  std::size_t members = 0;
  double centre = 0.0;        ///< μ, unit of the values
  double centre_error = 0.0;  ///< standard error of μ
  double spread = 0.0;   ///< τ, standard deviation between members, their own errors apart; 0 where those explain it
  double freedom = 0.0;  ///< degrees of freedom of √(s² + τ²) for Student's t
};

/// Takes no member out.
inline constexpr std::size_t kNoMember = static_cast<std::size_t>(-1);

/// The random-effects model x_i = μ + b_i + e_i, b_i of standard deviation τ, e_i of standard deviation s_i known
/// (`paule1982`), fitted robustly against a few outliers: with z_i = (x_i − μ)/√(s_i² + τ²) and Huber's ψ(z) = max(−c,
/// min(c, z)), c = 1.5, μ and τ solve (`huber2009`, section 6.4, "Proposal 2")
///
///     Σ ψ(z_i)/√(s_i² + τ²) = 0,     Σ ψ(z_i)² = (n − 1) E ψ(Z)²,     Z standard normal,
///
/// and τ = 0 where even that makes the second sum too small. With c → ∞ they are Paule and Mandel's equations. About a
/// quarter of the members may be arbitrarily far off. freedom = 0.72 (n − 1): Proposal 2's scale has 0.72 of the
/// efficiency of the standard deviation at the normal distribution.
///
/// Member number `without` is left out. Throws InvalidArgument for fewer than two members left, lengths that differ,
/// values that are not finite and errors that are not finite and >= 0.
[[nodiscard]] RandomEffects fit_random_effects(std::span<const double> values, std::span<const double> errors,
                                               std::size_t without = kNoMember);

/// Options of describe_population().
struct PopulationOptions {
  double level = 0.05;     ///< probability that any robot of a homogeneous fleet is called outside
  std::size_t fewest = 5;  ///< robots that a parameter needs for its population to be looked at
  double central = 0.9;    ///< share of the others that the certain statement is about
  double odd_level = 0.2;  ///< probability that any robot of a homogeneous fleet is called odd, or outside
};

/// One parameter over the fleet.
struct ParameterPopulation {
  std::size_t column = 0;      ///< of the table
  std::size_t shown = 0;       ///< robots whose log shows the parameter, with a standard error
  bool described = false;      ///< there are enough of them
  RandomEffects fit{};         ///< μ and τ, where described
  double typical_error = 0.0;  ///< median of the robots' own standard errors
  Interval central{};  ///< the middle `central` share of the robots' true values lies in it, if noise kept to its
                       ///< bounds: quantiles of the lower and of the upper bounds
};

/// A robot outside.
struct RobotOutside {
  std::size_t robot = 0;
  std::size_t column = 0;
  double value = 0.0;       ///< estimate
  double deviations = 0.0;  ///< t: distance from the others' centre in standard deviations, with its sign
  double p = 1.0;           ///< two-sided
  double adjusted_p = 1.0;  ///< Holm over robots and parameters
  double certainly_beyond =
      0.0;               ///< share of the other robots whose whole interval of bounds lies on one side of its own
  bool certain = false;  ///< its interval of bounds does not meet where the central share of the others certainly is
};

/// The result of describe_population().
struct Population {
  std::vector<ParameterPopulation> parameters{};  ///< one for each column of the table
  std::vector<RobotOutside> outside{};            ///< smallest adjusted p first
  std::vector<RobotOutside> odd{};                ///< likewise: robots that are not outside, but odd
  std::size_t tests = 0;                          ///< pairs of robot and parameter
};

/// Of each parameter, centre and spread of the robots that show it (population.hpp), and the robots outside. A robot
/// is compared with the others: with their μ and τ (fitted without it where there are at most 200 robots; beyond, its
/// own pull on them is bounded and below a hundredth of a deviation),
///
///     t = (x − μ)/√(s² + τ² + s_μ²),
///
/// which for a robot like the others follows about Student's t (normal θ and errors) of ν degrees of freedom, those of
/// the estimated variances in it: 1/ν = 1/(freedom of the others' random effects) + q²/(those of s), q = s²/(s² + τ² +
/// s_μ²). It is outside where its p, adjusted by Holm's method over all robots and parameters, is at most `level`, and
/// odd where that is at most `odd_level`: in a small fleet hardly anything is unlikely enough for the former. The
/// certain statement needs no distribution, only the noise bounds. Throws InvalidArgument for a level or share outside
/// (0, 1) or fewest < 4.
[[nodiscard]] Population describe_population(const FleetTable& table, const PopulationOptions& options = {});

/// Options of pooled_prior().
struct PooledPriorOptions {
  double coverage = 0.95;    ///< least probability that the box holds the next robot's θ
  std::uint64_t seed = 1;    ///< of the split
  double most_hidden = 0.1;  ///< a parameter that more of the learning robots than this share do not show is left out
};

/// One parameter of the box.
struct PooledParameter {
  std::size_t column = 0;  ///< of the table
  bool included = false;
  std::string reason{};      ///< why it is left out; else empty
  double hidden = 0.0;       ///< share of the learning robots whose log does not show it
  double centre = 0.0;       ///< median of the learning robots' mid-points
  double scale_below = 0.0;  ///< median of how far their intervals reach below the centre
  double scale_above = 0.0;  ///< median of how far their intervals reach above the centre
  Interval before{};         ///< hull of the priors with which the fleet was commissioned
  Interval box{};            ///< rounded outward; `before` where it is not included or there is no box
};

/// The result of pooled_prior().
struct PooledPrior {
  bool exists = false;                        ///< there is a box with at least one parameter
  std::string message{};                      ///< one sentence for people: the statement, or why there is none
  double asked = 0.0;                         ///< coverage that was asked for
  double coverage = 0.0;                      ///< coverage that is stated: k/(m + 1); 0 where there is no box
  std::size_t learning = 0;                   ///< robots that gave centres and scales
  std::size_t scored = 0;                     ///< m, the others
  std::size_t rank = 0;                       ///< k
  std::size_t boundless = 0;                  ///< of the scored, robots without bounds: their scores are infinite
  std::size_t needed = 0;                     ///< fewest robots of a fleet for a box at the coverage asked for
  double radius = 0.0;                        ///< k-th smallest score
  std::vector<PooledParameter> parameters{};  ///< of the columns that are keys of a prior
};

/// Split-conformal prediction (`vovk2005`, `lei2018`) of a box. The robots whose logs could be read are split in halves
/// by a seeded hash of their names. One half gives each parameter a centre and a scale to each side, and says which
/// parameters are left out. Each of the m robots of the other half gets the score
///
///     S_i = max over parameters of max((c − l_i)/s_below, (u_i − c)/s_above)
///
/// of the farthest corner of its bounds: at least the score of its true θ, which is unknown. The box is all points with
/// a score of at most the k-th smallest, k = ⌈(m + 1)(1 − a)⌉, cut to the hull of the robots' own priors.
///
/// Where the robots and the next one are exchangeable and their noise keeps to its bounds, P(θ of the next robot in the
/// box) >= k/(m + 1) >= 1 − a, over fleets and next robots together, for any distribution of θ: the true θ's of the
/// scored robots and the next one's are exchangeable given the learning half, and larger scores only enlarge the box.
/// No robot is left out as an outlier. A robot that was read but gave no bounds (contradicted, nothing shown) has an
/// infinite score, so the statement is about such robots too; where they are more than the coverage allows, there is no
/// box. A parameter that a scored robot's log does not show has the bounds of its prior, which are wide and true. Which
/// parameters are included depends on the learning half only, and so costs no coverage. Robots whose logs could not be
/// read take no part: that has to have nothing to do with their θ.
///
/// Throws InvalidArgument for a coverage outside (0, 1) or a share outside [0, 1].
[[nodiscard]] PooledPrior pooled_prior(const FleetTable& table, const PooledPriorOptions& options = {});

}  // namespace wheelwright::study
