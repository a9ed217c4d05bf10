// SPDX-License-Identifier: Apache-2.0
/// \file
/// Commissioning pipeline: from a log of fault-free driving to a model with thresholds for the detector.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bounds/feasible_set.hpp"
#include "commission/at_risk/risk_reach.hpp"
#include "commission/at_risk/risk_set.hpp"
#include "commission/choice/filter_choice.hpp"
#include "commission/contradiction.hpp"
#include "commission/kinematic.hpp"
#include "commission/output_noise.hpp"
#include "commission/survey.hpp"
#include "commission/validation.hpp"
#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "identify/estimate.hpp"
#include "identify/least_squares.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Result of commissioning for one parameter.
struct ParameterResult {
  model::Parameter parameter;
  identify::Excitation excitation = identify::Excitation::identified;
  std::string reason;                    ///< why it is not identified, for people
  std::optional<double> estimate;        ///< nothing where the log does not show the parameter
  std::optional<double> standard_error;  ///< valid under autocorrelated residuals
  double lower = 0.0;                    ///< bounds (certified hull)
  double upper = 0.0;
  double chebyshev = 0.0;       ///< centre of the feasible set
  bool lower_is_prior = false;  ///< the bound is the prior box's: the log does not tighten it
  bool upper_is_prior = false;
  bool estimate_inside = true;                   ///< least squares may leave the hull
  std::vector<bounds::RowOrigin> lower_binding;  ///< samples that set the lower bound
  std::vector<bounds::RowOrigin> upper_binding;
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of lower and upper
};

/// Feasible set of an earlier pass: it bounds the motion between samples in the rows of the next pass.
struct EarlierSet {
  FeasibleSet set;
  std::vector<std::size_t> dropped;  ///< rows of the log whose instants it leaves out as outliers
};

/// Why little was learned from a log whose bounds hold all the same, and what would bring more.
struct LittleLearned {
  std::string why{};                    ///< empty: enough was learned
  std::vector<std::string> remedies{};  ///< each by the name of its key or drive, with what it would bring
};

/// The result of commissioning.
struct Commissioning {
  /// Status of the commissioning.
  enum class Status {
    done,          ///< a model came out
    partial,       ///< a model came out, but some parameters are not excited: their bounds are the prior's
    empty,         ///< no θ explains the log within the declared noise: see contradiction; no model
    nothing,       ///< no parameter is excited: no model
    contradicted,  ///< a set came out, but the log contradicts its assumptions: see contradictions; no model
  };
  Status status = Status::done;
  /// Whether a model came out.
  [[nodiscard]] bool has_model() const { return status == Status::done || status == Status::partial; }
  std::string message;  ///< one sentence for people, with what to do next where that is needed
  OnlineModel model;    ///< without estimate, facets and box where the status gives no model
  std::vector<ParameterResult> parameters;
  Survey survey;
  std::vector<OutputNoise> noise;  ///< one for each output
  filter::NoiseMode noise_mode = filter::NoiseMode::worst_case;
  FilterChoice filter_choice;  ///< the curve is empty where the filter was given
  identify::EstimatorChoice
      estimators;  ///< candidates for θ̂, the one chosen and why; none where no parameter is excited
  identify::ResidualSummary residuals;  ///< of θ̂ on the whole log
  int rank = 0;
  double condition = 0.0;
  std::vector<OutputValidation> validation;  ///< on held-out blocks, of a model made from the other blocks
  FoldOptions folds;
  double minimax = 0.0;  ///< where the set is empty: by how much the bounds n̄ on the effort would have to be
                         ///< raised for it not to be (those on the motion kept), up to 0.05 %; else 0
  std::optional<double> effort_shift;  ///< s, by which the efforts seem late against the motion
  double effort_shift_told = 0.0;      ///< s, a shift beyond what is declared that would have been told
  Interval effort_shift_open{};        ///< s, the shifts that the log does not exclude at a risk of 1 %
  Premises premises;                   ///< what statistics say of constancy, offsets and friction
  LittleLearned little;
  std::vector<LogContradiction> contradictions;  ///< found whatever the status; one that withdraws leaves no model
  Box prior;                                     ///< in which the set was sought
  filter::SignalErrors
      row_errors;              ///< dY and dy of the rows that the set is made of: OutputNoise::learning in `output`
  std::vector<bool> left_out;  ///< p, or empty (none): parameters whose columns the set's rows lack (without_columns())
  std::vector<std::size_t> dropped;  ///< rows of the log whose instants the set leaves out as outliers
  FeasibleSet feasible;              ///< the set, its hull, certificates
  std::vector<EarlierSet>
      earlier;  ///< sets of the earlier passes, from which it was refined: the first one rests on the
                ///< limit of the accelerations alone; none where nothing bounds the motion by the model
  std::optional<RiskSet> at_risk;    ///< where the robot file declares errors that average out, and a model came out
  std::vector<RiskReach> reach;      ///< what the detector at that risk will see on drives like this log
  KinematicCommissioning kinematic;  ///< of the kinematic residual; its model is also OnlineModel::kinematic
  double polytope_over_box = 1.0;    ///< median width of [l, u]: polytope over box, held out, worst output
  std::vector<std::string> notes;    ///< what was repaired or chosen, for people
  std::vector<core::Assumption> assumptions;  ///< all assumptions, with the verdict of the log on each
};

struct KinematicPart;

/// Options of commission_robot().
struct CommissionOptions {
  FilterChoiceOptions filter_choice;
  FoldOptions folds;  ///< purge is set to the filter's memory
  identify::ExtrapolationOptions extrapolation;
  filter::NoiseMode noise_mode = filter::NoiseMode::worst_case;  ///< for declared noise
  double confidence = 0.999;                                     ///< statistical noise mode
  KinematicCommissionOptions kinematic;  ///< of the kinematic residual; folds, extrapolation and persistence are
                                         ///< those of these options
  std::size_t outliers = 0;              ///< instants that the feasible set may leave out (θ̂ stands on all of them)
  detector::Persistence persistence;
  /// What is asked for at a stated risk: nothing, set and detector, or what that detector will see (reach), too. The
  /// first and the last each take as long as all the rest where the noise is estimated.
  enum class AtRisk { nothing, detector, reach };
  AtRisk at_risk = AtRisk::reach;
  std::size_t threads = 1;  ///< for a log that can be walked twice at once; the result does not depend on it
  /// The kinematic residual as it was made before (make_kinematic_part()), of the same log, robot and options and for a
  /// filter of the same order: taken instead of being made again.
  std::shared_ptr<const KinematicPart> kinematic_part{};
  std::function<void(std::string_view stage, double share)> progress;  ///< told of every stage; may be empty
};

/// CommissionOptions::kinematic with what comes from the other options and from the robot.
[[nodiscard]] KinematicCommissionOptions kinematic_options(const Robot& robot, const CommissionOptions& options);

/// Log → filtered regression → θ̂_L → feasible set and bounds → ρ(t) → validation. Walks the log several times and
/// never holds it. Throws InputError or InvalidArgument for a log or robot that cannot be used at all; outcomes that
/// depend on the data are in the result.
[[nodiscard]] Commissioning commission_robot(LogSource& log, const Robot& robot, const CommissionOptions& options = {});

}  // namespace wheelwright::commission

namespace wheelwright {
using commission::commission_robot;
using commission::Commissioning;
}  // namespace wheelwright
