// SPDX-License-Identifier: Apache-2.0
#include "results/model_check.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commission/assumptions.hpp"
#include "commission/at_risk/pose_at_risk.hpp"
#include "commission/fit.hpp"
#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"
#include "results/assumptions_json.hpp"
#include "results/model_json.hpp"
#include "results/risk_check.hpp"

namespace wheelwright::results {
namespace {

void judge_physical(const ModelClaims& claims, ModelCheck& result) {
  const auto scales = commission::physical_scales(claims.robot, claims.model);
  for (std::size_t j = 0; j < claims.model.p(); ++j) {
    const model::Parameter& parameter = claims.model.parameters[j];
    if (const auto stated = claims.physical.find(parameter.physical); stated != claims.physical.end() && scales) {
      const commission::PhysicalScale& s = (*scales)[j];
      const Interval exact = Interval{s.scale, s.scale} * Interval{claims.lower[j].value, claims.upper[j].value} -
                             Interval{s.offset, s.offset};
      if (!(stated->second.lower <= exact.lower && exact.upper <= stated->second.upper)) {
        result.failures.push_back(
            fmt::format("the physical {}, [{}, {}], does not contain what its bounds mean, [{}, {}]",
                        parameter.physical, stated->second.lower, stated->second.upper, exact.lower, exact.upper));
      }
    }
  }
}

void judge_log(const ModelClaims& claims, const logs::LogReport& data, ModelCheck& result) {
  result.same_log =
      std::ranges::equal(claims.files, data.files, {}, &logs::LogFileReport::hash, &logs::LogFileReport::hash);
  if (result.same_log && data.rows == claims.rows && data.segments == claims.segments) {
    return;
  }
  const auto names = [](const std::vector<logs::LogFileReport>& files) {
    std::string text;
    for (const logs::LogFileReport& file : files) {
      text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", file.path, file.hash);
    }
    return text;
  };
  const std::string differs =
      fmt::format("{} is not the log that was commissioned, {}", names(data.files), names(claims.files));
  if (data.rows != claims.rows || data.segments != claims.segments) {
    result.failures.push_back(fmt::format("{}: it has {} usable rows (segments: {}), not {} ({})", differs, data.rows,
                                          data.segments, claims.rows, claims.segments));
  } else {
    result.warnings.push_back(differs + ", byte by byte; it has as many rows, and what is proved here holds for it");
  }
}

void judge_prior(const ModelClaims& claims, ModelCheck& result) {
  const model::PriorBox known = model::prior_box(claims.robot, claims.model);
  for (std::size_t j = 0; j < claims.model.p(); ++j) {
    const Interval& stated = claims.prior.sides[j];
    if (known.bounds[j].lower < stated.lower || stated.upper < known.bounds[j].upper) {
      auto& list = known.declared[j] ? result.failures : result.warnings;
      list.push_back(fmt::format("the prior of {}, [{}, {}], is narrower than {}, [{}, {}]",
                                 claims.model.parameters[j].name, stated.lower, stated.upper,
                                 known.declared[j] ? "the robot's" : "the default of this version",
                                 known.bounds[j].lower, known.bounds[j].upper));
    }
  }
}

/// Driving to come is watched with no smaller errors than those that the set is proved with. An acceleration is asked
/// of it only where it is stated: commissioning may know one of the log and none of other driving.
void judge_detector(const ModelClaims& claims, ModelCheck& result) {
  if (!claims.detector_errors) {
    return;
  }
  const filter::SignalErrors &watched = *claims.detector_errors, &proved = claims.errors;
  const auto judge = [&](const char* key, const auto& stated, const auto& least) {
    for (Eigen::Index i = 0; i < least.size(); ++i) {
      const double value = i < stated.size() ? stated[i] : 0.0;
      if (value < least[i]) {
        result.failures.push_back(
            fmt::format("detector.error_bounds.{}[{}] is {}: expected at least {}, the noise that the bounds are "
                        "proved with",
                        key, i, value, least[i]));
      }
    }
  };
  judge("output", watched.output, proved.output);
  judge("acceleration", watched.acceleration, proved.acceleration);
  judge("speed", watched.speed, proved.speed);
  judge("speed_sample", watched.speed_sample, proved.speed_sample);
  judge("joint_sample", Eigen::VectorXd::Constant(1, watched.joint_sample),
        Eigen::VectorXd::Constant(1, proved.joint_sample));
  judge("heading", Eigen::VectorXd::Constant(1, watched.heading), Eigen::VectorXd::Constant(1, proved.heading));
  if (!proved.between_samples) {
    return;
  }
  if (!watched.between_samples) {
    result.failures.emplace_back(
        "detector.error_bounds.between_samples is null: expected bounds of the motion between samples, with which the "
        "set is proved");
    return;
  }
  judge("between_samples.effort", watched.motion.effort, proved.motion.effort);
  judge("between_samples.largest", watched.motion.largest, proved.motion.largest);
  judge("between_samples.mobility", watched.motion.mobility.reshaped<Eigen::RowMajor>().eval(),
        proved.motion.mobility.reshaped<Eigen::RowMajor>().eval());
  if (watched.motion.limit.size() > 0) {
    judge("between_samples.acceleration", watched.motion.limit, proved.motion.limit);
  }
}

void judge_kinematic_prior(const KinematicClaims& claims, const Robot& robot, std::vector<std::string>& warnings) {
  const commission::KinematicCommissionOptions usual;
  for (std::size_t j = 0; j < claims.parameter_names.size(); ++j) {
    const std::string& name = claims.parameter_names[j];
    const double nominal = robot.wheel_radius / (name.starts_with("yaw_gain") ? robot.track_width : 1.0);
    const Interval known = name == "gyro_bias"
                               ? Interval{-usual.bias, usual.bias}
                               : Interval{(1.0 - usual.radius_share) * nominal, (1.0 + usual.radius_share) * nominal};
    const Interval& stated = claims.prior.sides[j];
    if (known.lower < stated.lower || stated.upper < known.upper) {
      warnings.push_back(
          fmt::format("the prior of {}, [{}, {}], is narrower than the default of this version, [{}, {}]", name,
                      stated.lower, stated.upper, known.lower, known.upper));
    }
  }
}

SetCheck check_kinematic(const KinematicClaims& claims, const Robot& robot, LogSource& log) {
  const detector::KinematicModel& model = claims.model;
  filter::OdometryRows rows(log, filter::OdometryFilter(model.measurement, model.window, claims.errors));
  SetCheck result = check_set(claims, rows);
  const auto declared = [&](const char* key, double stated, const model::NoiseBound& noise, bool taken) {
    if (taken && noise.value && stated < *noise.value) {
      result.failures.push_back(
          fmt::format("kinematic.detector.error_bounds.{} is {}: expected at least {}, as the robot has it", key,
                      stated, *noise.value));
    }
  };
  for (std::size_t i = 0; i < claims.origin.size(); ++i) {
    const bool taken = claims.origin[i] == core::NoiseOrigin::declared;
    const bool yaw = claims.output_names[i] == "yaw", gyro = claims.output_names[i] == "gyro_yaw";
    declared("heading", claims.errors.heading, robot.noise.heading, taken && yaw);
    declared("gyro", claims.errors.gyro, robot.noise.gyro, taken && gyro);
    declared("position", claims.errors.position, robot.noise.position, taken && !yaw && !gyro);
  }
  for (Eigen::Index i = 0; i < model.errors.estimated.size(); ++i) {
    if (model.errors.estimated[i] < claims.errors.estimated[i]) {
      result.failures.push_back(
          fmt::format("kinematic.detector.error_bounds.estimated[{}] is {}: expected at least {}, the noise that the "
                      "bounds are proved with",
                      i, model.errors.estimated[i], claims.errors.estimated[i]));
    }
  }
  return result;
}

// Whether the errors at a risk are no smaller than the robot's, and poses no closer than they take it.
void judge_pose_errors(const detector::PoseErrors& claimed, const Robot& robot, double shortest_step,
                       std::vector<std::string>& failures) {
  const std::optional<detector::PoseErrors> declared = commission::pose_errors(robot, shortest_step);
  if (!declared || !declared->average()) {
    failures.emplace_back("kinematic.at_risk: the robot file declares no errors of the pose that average out");
    return;
  }
  const auto compare = [&](const std::string& key, double stated, double least) {
    if (!(stated >= least)) {
      failures.push_back(fmt::format("kinematic.at_risk.errors.{} is {}: expected at least {}, as the robot has it",
                                     key, stated, least));
    }
  };
  const auto compare_class = [&](const std::string& key, const filter::ErrorClass& stated,
                                 const filter::ErrorClass& least) {
    compare(key + ".bound", stated.bound, least.bound);
    compare(key + ".bias", stated.bias, least.bias);
    compare(key + ".correlation", stated.correlation, least.correlation);
    compare(key + ".deviation", stated.deviation, least.deviation);
  };
  compare_class("position", claimed.position, declared->position);
  compare_class("heading", claimed.heading, declared->heading);
  if (claimed.shortest_step > shortest_step) {
    failures.push_back(fmt::format("kinematic.at_risk.errors.shortest_step is {}, and poses of the log are {} s apart",
                                   claimed.shortest_step, shortest_step));
  }
}

// `guaranteed` is what became of the set that it is a part of.
SetCheck check_pose_at_risk(const KinematicClaims& claims, const SetCheck& guaranteed, const Robot& robot,
                            LogSource& log) {
  constexpr double kRounding = 5e-11;  // half of what a radius allows for that of the sums
  const detector::PoseRiskModel& risk = *claims.model.at_risk;
  detector::KinematicModel wide = claims.model;
  wide.facets = claims.facets;
  wide.box = claims.hull;
  SetCheck result;
  try {
    RegressionBlock rows = commission::pose_sum_rows(log, wide, risk, claims.learning);
    for (std::size_t k = 0; k < rows.instants(); ++k) {
      rows.dy[static_cast<Eigen::Index>(k)] *= rows.sample[k] < claims.facets.size() ? 1.0 : 1.0 - kRounding;
    }
    core::RegressionTable table(std::move(rows));
    result = check_set(*claims.at_risk, table);
  } catch (const InvalidArgument& error) {
    result.failures.push_back(fmt::format("kinematic.at_risk: no sums can be taken: {}", error.what()));
  }
  judge_pose_errors(risk.errors, robot, commission::pose_steps(log, claims.model.measurement).shortest,
                    result.failures);
  if (!guaranteed.failures.empty()) {
    result.failures.emplace_back("the set of kinematic.at_risk stands on kinematic.feasible_set, which is not proved");
  }
  return result;
}

void tell_kinematic_premises(const KinematicClaims& claims, std::vector<std::string>& premises) {
  const auto estimated = std::ranges::count(claims.origin, core::NoiseOrigin::estimated);
  premises.push_back(fmt::format(
      "of wheel radii and yaw gains: their prior, the window of {:g} s, the errors of pose, gyro and wheels ({}) and "
      "the wheels' largest acceleration between samples that the model states; how windows of odometry are made, which "
      "commissioning and this check have in common",
      claims.model.window,
      estimated == 0 ? "declared"
      : estimated == static_cast<std::ptrdiff_t>(claims.origin.size())
          ? "estimated from the residuals of this log"
          : "declared, and some estimated from the residuals"));
  if (claims.at_risk) {
    premises.push_back(fmt::format(
        "of the pose at a risk of {:g}: that its errors are as the robot file says and of no larger mean; the "
        "inequality for their sums (docs/methods/risk.md); that scales, the delay, and the part of the log on which V0 "
        "is "
        "learnt were chosen without this log; and how the sums are made, which commissioning and this check have in "
        "common",
        claims.model.at_risk->risk));
  } else if (claims.model.at_risk) {
    premises.emplace_back(
        "not checked: what is said of the pose at a stated risk, whose proofs this model was written without");
  }
}

// Whether the word *guaranteed* follows from what the model says of its noise and its assumptions.
void judge_warrant(const ModelClaims& claims, ModelCheck& result) {
  if (!claims.guaranteed) {
    return;
  }
  const auto fail = [&](const std::string& why) {
    result.failures.push_back("the bounds are called guaranteed, but " + why);
  };
  for (const core::Assumption& assumption : claims.assumptions) {
    if (assumption.verdict == core::AssumptionVerdict::fails && assumption.id != commission::kMotionInDriving) {
      fail(fmt::format("an assumption fails on the log: {}", assumption.statement));
    }
  }
  const commission::NoiseBudget budget = commission::noise_budget(claims.robot, claims.measurement);
  if (!budget.complete) {
    fail("the robot file that the model states does not declare the noise of motion and effort");
    return;
  }
  const filter::SignalErrors declared =
      filter::propagate(claims.model, claims.filter, claims.measurement, budget.sensors);
  const auto less = [](double stated, double needed) { return stated < needed * (1.0 - 1e-9); };
  for (std::size_t i = 0; i < claims.model.n(); ++i) {
    const double stated = claims.errors.output[static_cast<Eigen::Index>(i)];
    const double needed = declared.output[static_cast<Eigen::Index>(i)];
    if (claims.origin[i] == core::NoiseOrigin::estimated) {
      fail(fmt::format("the error of the {} channel is estimated from the log", claims.model.outputs[i]));
    } else if (less(stated, needed)) {
      fail(
          fmt::format("an error of at most {:.4g} {} in the filtered effort, {} channel, is less than the {:.4g} that "
                      "the declared noise makes",
                      stated, commission::output_unit(claims.robot, claims.model.output_units[i]),
                      claims.model.outputs[i], needed));
    }
  }
  const auto smaller = [&](const Eigen::VectorXd& stated, const Eigen::VectorXd& needed) {
    for (Eigen::Index k = 0; k < needed.size(); ++k) {
      if (less(k < stated.size() ? stated[k] : 0.0, needed[k])) {
        return true;
      }
    }
    return false;
  };
  if (smaller(claims.errors.acceleration, declared.acceleration) || smaller(claims.errors.speed, declared.speed)) {
    fail("the errors of the motion that the model states are less than the declared noise makes");
  }
}

void tell_premises(const ModelClaims& claims, ModelCheck& result) {
  result.premises.push_back(
      "the prior box, the filter, the measurement and the errors of the motion that the model states");
  for (std::size_t i = 0; i < claims.model.n(); ++i) {
    result.premises.push_back(
        fmt::format("an error of at most {:.4g} {} in the filtered effort, {} channel ({})",
                    claims.errors.output[static_cast<Eigen::Index>(i)],
                    commission::output_unit(claims.robot, claims.model.output_units[i]), claims.model.outputs[i],
                    claims.origin[i] == core::NoiseOrigin::declared ? "from the declared bounds of the sensors"
                                                                    : "estimated from the residuals of this log"));
  }
  for (std::size_t j = 0; j < claims.left_out.size(); ++j) {
    if (claims.left_out[j]) {
      result.premises.push_back(fmt::format("that what the log shows of {} is noise alone: its column was left out",
                                            claims.model.parameters[j].name));
    }
  }
  if (claims.at_risk) {
    const bool estimated = claims.at_risk->model.warrant == core::Warrant::extrapolated;
    result.premises.push_back(fmt::format(
        "at a risk of {:g}: that errors are as {} and of no larger mean, independent from joint to "
        "joint; the inequality for their sums (docs/methods/risk.md); that delays, shares of the risk, and the part of "
        "the log "
        "on which a scale is learnt, were chosen without this log; and how elements and sample weights are computed, "
        "which commissioning and this check have in common",
        claims.at_risk->model.risk,
        estimated ? "they were estimated from the log, in all driving to come," : "the robot file says"));
  }
  if (claims.kinematic) {
    tell_kinematic_premises(*claims.kinematic, result.premises);
  } else if (claims.unproved_kinematic) {
    result.premises.emplace_back(
        "not checked: the bounds of wheel radii and yaw gains, whose proofs this model was written without; commission "
        "again to have one that can be checked");
  }
  if (!claims.dropped.empty()) {
    result.premises.push_back(
        fmt::format("that the instants left out as outliers (rows {}) are the wrong ones: this cannot be checked",
                    fmt::join(claims.dropped, ", ")));
  }
}

}  // namespace

ModelCheck check_model(const ModelClaims& claims, LogSource& log, const logs::LogReport& data) {
  ModelCheck result;
  judge_log(claims, data, result);
  judge_prior(claims, result);
  judge_detector(claims, result);
  judge_warrant(claims, result);
  TorqueRows rows(log, RegressorFilter(commission::without_columns(claims.model, claims.left_out), claims.filter,
                                       claims.measurement, claims.errors));
  SetCheck set = check_set(claims, rows);
  result.bounds = std::move(set.bounds);
  result.emptiness = std::move(set.emptiness);
  result.facets = std::move(set.facets);
  const auto add = [&](const std::vector<std::string>& failures) {
    result.failures.insert(result.failures.end(), failures.begin(), failures.end());
  };
  add(set.failures);
  if (claims.set == FeasibleSet::Status::empty) {
    if (claims.at_risk) {
      result.failures.emplace_back("a set at a stated risk is a part of the guaranteed one, which is said to be empty");
    }
  } else if (!set.contradiction) {
    judge_physical(claims, result);
    if (claims.at_risk) {
      result.at_risk = check_at_risk(claims, *claims.at_risk, log, set.proved, set.facet_proved);
      add(result.at_risk->failures);
    }
  }
  if (claims.kinematic) {
    judge_kinematic_prior(*claims.kinematic, claims.robot, result.warnings);
    result.kinematic = check_kinematic(*claims.kinematic, claims.robot, log);
    add(result.kinematic->failures);
    if (claims.kinematic->at_risk) {
      result.pose_at_risk = check_pose_at_risk(*claims.kinematic, *result.kinematic, claims.robot, log);
      add(result.pose_at_risk->failures);
    }
  }
  tell_premises(claims, result);
  return result;
}

std::string proof_scope(const ModelClaims& claims) {
  const auto tested =
      std::ranges::count(claims.assumptions, core::AssumptionVerdict::holds, &core::Assumption::verdict);
  return fmt::format(
      "What is proved is arithmetic: the bounds follow from the rows of the log within the stated noise. "
      "That the assumptions hold is not proved{}. The bounds are {}.",
      claims.assumptions.empty() ? ", and the model does not list them"
                                 : fmt::format(": commissioning took {}, of which {} were tested on the log and held",
                                               claims.assumptions.size(), tested),
      core::warrant_word(claims.warrant));
}

std::string verdict(const ModelCheck& check, const ModelClaims& claims) {
  if (!check.proved()) {
    return fmt::format("not proved: {} statement{} of the model {} not follow from the log", check.failures.size(),
                       check.failures.size() == 1 ? "" : "s", check.failures.size() == 1 ? "does" : "do");
  }
  if (check.emptiness) {
    return fmt::format("proved: no parameters explain {} rows of the log within the stated noise",
                       claims.contradiction.size());
  }
  return fmt::format("proved: all {} bounds and {} facets follow from the rows of the log that they name",
                     check.bounds.size(), claims.facets.size());
}

std::string kinematic_verdict(const SetCheck& check, const KinematicClaims& claims) {
  if (!check.failures.empty()) {
    return fmt::format("wheel radii and yaw gains: not proved, {} statement{} not follow from the log",
                       check.failures.size(), check.failures.size() == 1 ? " does" : "s do");
  }
  return fmt::format(
      "wheel radii and yaw gains: all {} bounds and {} facets follow from the windows of odometry that they name ({})",
      check.bounds.size(), claims.facets.size(), core::warrant_word(claims.model.warrant));
}

std::string pose_risk_verdict(const SetCheck& check, const KinematicClaims& claims) {
  const double risk = claims.model.at_risk->risk;
  if (!check.failures.empty()) {
    return fmt::format("of the pose at a risk of {:g}: not proved, {} statement{} not follow from the log", risk,
                       check.failures.size(), check.failures.size() == 1 ? " does" : "s do");
  }
  return fmt::format(
      "of the pose at a risk of {:g}: all {} bounds and {} facets follow from the guaranteed set and from sums over "
      "the log, at all of which together that risk is run",
      risk, check.bounds.size(), claims.at_risk->facets.size());
}

std::string risk_verdict(const RiskCheck& check, const RiskClaims& claims) {
  if (!check.failures.empty()) {
    return fmt::format("at a risk of {:g}: not proved, {} statement{} not follow from the log", claims.model.risk,
                       check.failures.size(), check.failures.size() == 1 ? " does" : "s do");
  }
  return fmt::format(
      "at a risk of {:g}: all {} bounds and {} facets follow from the guaranteed set and from {} sums over the log, "
      "and "
      "the risks of all {} ellipsoids add up to {:g}",
      claims.model.risk, check.bounds.size(), claims.model.facets.size(), claims.sums.size(), claims.ellipsoids.size(),
      check.spent);
}

namespace {

Json bound_json(const BoundVerdict& verdict, const std::string& parameter, const std::string& unit, std::size_t rows) {
  return {{"parameter", parameter},
          {"unit", unit},
          {"side", files::word_of(kSideWords, verdict.side)},
          {"stated", verdict.stated},
          {"shown", files::or_null(verdict.shown)},
          {"proved", verdict.proved},
          {"shortfall", files::or_null(verdict.shortfall)},
          {"rows", rows},
          {"reason", verdict.reason}};
}

Json bound_json(const BoundVerdict& verdict, const ModelClaims& claims, std::size_t rows) {
  const model::Parameter& parameter = claims.model.parameters[verdict.parameter];
  return bound_json(verdict, parameter.name, commission::parameter_unit(claims.robot, parameter), rows);
}

std::size_t proof_size(const SetClaims& claims, const BoundVerdict& verdict) {
  return (verdict.side == bounds::Side::upper ? claims.upper : claims.lower)[verdict.parameter].proof.size();
}

Json facets_json(const FacetVerdicts& facets, const SetClaims& claims) {
  return {{"stated", claims.facets.size()},
          {"rows", facets.rows},
          {"sides", facets.sides},
          {"implied", facets.implied},
          {"wrong", facets.wrong.size()}};
}

Json kinematic_json(const SetCheck& check, const SetClaims& claims, const detector::KinematicModel& model,
                    const std::string& message, core::Warrant warrant) {
  const std::vector<std::string> units = model.measurement.parameter_units();
  Json bounds = Json::array();
  for (const BoundVerdict& each : check.bounds) {
    bounds.push_back(
        bound_json(each, claims.parameter_names[each.parameter], units[each.parameter], proof_size(claims, each)));
  }
  return {{"proved", check.failures.empty()},
          {"message", message},
          {"warrant", core::warrant_word(warrant)},
          {"facets", facets_json(check.facets, claims)},
          {"bounds", std::move(bounds)}};
}

Json risk_json(const RiskCheck& check, const ModelClaims& claims) {
  const RiskClaims& risk = *claims.at_risk;
  Json bounds = Json::array();
  for (const BoundVerdict& each : check.bounds) {
    const auto& proofs = each.side == bounds::Side::upper ? risk.upper : risk.lower;
    bounds.push_back(bound_json(each, claims, proofs[each.parameter].size()));
  }
  return {{"risk", risk.model.risk},
          {"proved", check.failures.empty()},
          {"message", risk_verdict(check, risk)},
          {"spent", files::or_null(check.spent)},
          {"ellipsoids", risk.ellipsoids.size()},
          {"sums", {{"stated", risk.sums.size()}, {"proved", check.sums}}},
          {"facets", {{"stated", risk.model.facets.size()}, {"proved", check.facets}}},
          {"bounds", std::move(bounds)}};
}

}  // namespace

Json to_json(const ModelCheck& check, const ModelClaims& claims, const logs::LogReport& data, const CheckedFiles& files,
             const std::string& software) {
  Json bounds = Json::array();
  for (const BoundVerdict& each : check.bounds) {
    bounds.push_back(bound_json(each, claims, proof_size(claims, each)));
  }
  Json json = {
      {"schema", "wheelwright/check/1"},
      {"software", software},
      {"model", files.model},
      {"proved", check.proved()},
      {"message", verdict(check, claims)},
      {"warrant", core::warrant_word(claims.warrant)},
      {"scope", proof_scope(claims)},
      {"data",
       {{"same", check.same_log}, {"rows", data.rows}, {"segments", data.segments}, {"files", files_json(data)}}},
      {"bounds", bounds},
      {"facets", facets_json(check.facets, claims)},
      {"failures", check.failures},
      {"warnings", check.warnings},
      {"premises", check.premises},
      {"assumptions", assumptions_json(claims.assumptions)}};
  if (check.at_risk) {
    json["at_risk"] = risk_json(*check.at_risk, claims);
  }
  if (check.kinematic) {
    const KinematicClaims& kinematic = *claims.kinematic;
    json["kinematic"] = kinematic_json(*check.kinematic, kinematic, kinematic.model,
                                       kinematic_verdict(*check.kinematic, kinematic), kinematic.model.warrant);
    if (check.pose_at_risk) {
      json["pose_at_risk"] =
          kinematic_json(*check.pose_at_risk, *kinematic.at_risk, kinematic.model,
                         pose_risk_verdict(*check.pose_at_risk, kinematic), kinematic.model.at_risk->warrant);
    }
  }
  if (check.emptiness) {
    json["contradiction"] = {{"rows", claims.contradiction.size()},
                             {"proved", check.emptiness->proved},
                             {"shortfall", files::or_null(check.emptiness->shortfall)}};
  }
  return json;
}

}  // namespace wheelwright::results
