// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/pose_at_risk.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "commission/at_risk/sum_spread.hpp"
#include "core/regression.hpp"
#include "core/statistics.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kForesight = 0.2;          // s, at least
constexpr double kForesightSteps = 6.0;     // from pose to pose, at least
constexpr double kLeastCuttingScale = 1.0;  // s, of sums that cut the set
constexpr double kFacetRounding = 1e-12;
constexpr double kFewestSteps = 2.0;  // in a scale

// The time at which `share` of the time from the first row of `log` to the last is over.
double time_at(LogSource& log, double share) {
  double first = core::kInfinity, last = -core::kInfinity;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool) {
    first = std::min(first, block.t[k]);
    last = std::max(last, block.t[k]);
  });
  return first + share * (last - first);
}

// Rows |y − Yϑ| <= dy, one after the other.
class RowTable {
 public:
  explicit RowTable(const Box& box) : box_(box) {}

  // `number` is told as RegressionBlock::sample.
  void add(std::size_t number, double t, const Eigen::VectorXd& Y, double y, double dy) {
    numbers_.push_back(number);
    t_.push_back(t);
    Y_.insert(Y_.end(), Y.begin(), Y.end());
    y_.push_back(y);
    dy_.push_back(dy);
  }
  // Of the box, in the direction.
  [[nodiscard]] double support(const Eigen::VectorXd& a) const {
    return box_.support({a.data(), static_cast<std::size_t>(a.size())});
  }
  [[nodiscard]] RegressionBlock block() const {
    const auto p = static_cast<Eigen::Index>(box_.dimension()), rows = static_cast<Eigen::Index>(t_.size());
    RegressionBlock block;
    block.outputs = 1;
    block.parameters = box_.dimension();
    block.sample = numbers_;
    block.t = t_;
    block.Y = Eigen::Map<const core::RowMatrix>(Y_.data(), rows, p);
    block.dY = core::RowMatrix::Zero(rows, p);
    block.y = Eigen::Map<const Eigen::VectorXd>(y_.data(), rows);
    block.dy = Eigen::Map<const Eigen::VectorXd>(dy_.data(), rows);
    return block;
  }

 private:
  const Box& box_;
  std::vector<std::size_t> numbers_;
  std::vector<double> t_, Y_, y_, dy_;
};

// Steps within segments, s.
double driven(LogSource& log) {
  double seconds = 0.0, before = 0.0;
  bool any = false;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    seconds += any && !starts ? block.t[k] - before : 0.0;
    before = block.t[k];
    any = true;
  });
  return seconds;
}

void learn_usual(LogSource& log, detector::KinematicModel& model, double until) {
  detector::UsualPoseVariances usual = detector::usual_pose_variances(log, model, -core::kInfinity, until);
  model.at_risk->usual_position = std::move(usual.position);
  model.at_risk->usual_heading = std::move(usual.heading);
}

// Half of the test's risk each: a sum too large, and too many large ones.
void test_on_log(LogSource& log, const detector::KinematicModel& model, double seconds,
                 const PoseAtRiskOptions& options, PoseAtRisk& result) {
  const detector::PoseSumOptions own{.false_alarms = 0.5 * options.test_risk / std::max(seconds, 1.0)};
  detector::PoseSumDetector detector(model, own);
  const detector::PoseRiskModel& risk = *model.at_risk;
  // Errors of position and heading of one pose may depend on each other: V of both together is twice their sum.
  SumSpread spread(2.0 * (risk.usual_position + risk.usual_heading), own.checks, 0.5 * options.test_risk);
  double utilisation = 0.0;
  detector::SumState worst;
  walk_poses(log, detector, -core::kInfinity, core::kInfinity, [&] {
    const Eigen::MatrixXd variances = 2.0 * (detector.position_variances() + detector.heading_variances());
    for (const detector::SumState& look : detector.looks()) {
      spread.add(look, variances);
      if (std::abs(look.value) > utilisation * look.threshold) {
        utilisation = std::abs(look.value) / look.threshold;
        worst = look;
      }
    }
  });
  const auto [widest, scale] = spread.largest();
  result.verdict = core::AssumptionVerdict::holds;
  if (utilisation > 1.0) {
    result.detail = fmt::format("over {:g} s odometry leaves {:.2g} times as much of the pose ({}) as such errors can",
                                risk.scales[worst.scale], utilisation, detector.weights()[worst.weight].name);
  } else if (widest > 1.0) {
    result.detail =
        fmt::format("over {:g} s what odometry leaves of the pose spreads wider, time and again, than such errors can",
                    risk.scales[scale]);
  }
  if (!result.detail.empty()) {
    result.verdict = core::AssumptionVerdict::fails;
  }
}

core::Assumption assumed_pose(const Robot& robot) {
  std::string statement;
  const auto add = [&](const char* name, const char* unit, const model::NoiseBound& noise) {
    if (!noise.bias) {
      return;
    }
    statement += fmt::format(
        "{}Whatever happened {}before a pose, the mean error of its {} is {}{}.", statement.empty() ? "" : " ",
        noise.correlation > 0.0 ? fmt::format("up to {:g} s ", noise.correlation) : "", name,
        *noise.bias > 0.0 ? fmt::format("at most {:.3g} {}", *noise.bias, unit) : "zero",
        noise.deviation
            ? fmt::format(", the root of its mean square about it at most {:.3g} {}", *noise.deviation, unit)
            : "");
  };
  add("position", "m", robot.noise.position);
  add("heading", "rad", robot.noise.heading);
  return {.id = kPoseNoiseAverages,
          .statement = std::move(statement),
          .declared_by = "noise.position.bias, noise.heading.bias",
          .test = "sums of what odometry leaves of the pose, over all scales, are as small as such errors make them",
          .verdict = core::AssumptionVerdict::not_tested,
          .detail = {}};
}

}  // namespace

PoseSteps pose_steps(LogSource& log, const filter::OdometryMeasurement& measurement) {
  std::vector<double> steps, last;
  double before = 0.0;
  bool any = false;
  core::for_each_sample(log, measurement.columns(), [&](const core::LogSample& sample) {
    const std::span<const double> pose = sample.values.subspan(2);
    any = any && !sample.starts;
    if (any && measurement.held_pose && std::ranges::equal(pose, last)) {
      return;
    }
    if (any) {
      steps.push_back(sample.t - before);
    }
    any = true;
    before = sample.t;
    last.assign(pose.begin(), pose.end());
  });
  PoseSteps result;
  if (!steps.empty()) {
    result.shortest = *std::ranges::min_element(steps);
    result.median = core::median(std::move(steps));
  }
  return result;
}

std::optional<detector::PoseErrors> pose_errors(const Robot& robot, double shortest_step) {
  const model::NoiseBound &position = robot.noise.position, &heading = robot.noise.heading;
  if (!position.value || !heading.value || !(position.bias || heading.bias)) {
    return std::nullopt;
  }
  const auto error_class = [](const model::NoiseBound& noise) -> filter::ErrorClass {
    return {*noise.value, std::min(noise.bias.value_or(*noise.value), *noise.value),
            noise.bias ? noise.correlation : 0.0,
            noise.bias ? noise.deviation.value_or(core::kInfinity) : core::kInfinity};
  };
  return detector::PoseErrors{error_class(position), error_class(heading), shortest_step};
}

RegressionBlock pose_sum_rows(LogSource& log, const detector::KinematicModel& guaranteed,
                              const detector::PoseRiskModel& risk, double learning) {
  detector::KinematicModel model = guaranteed;
  model.at_risk = risk;
  model.at_risk->facets = model.facets;
  model.at_risk->box = model.box;
  RowTable rows(model.box);
  for (std::size_t k = 0; k < model.facets.size(); ++k) {
    const Eigen::VectorXd opposite = -model.facets[k].a;
    const double upper = model.facets[k].b, lower = std::min(upper, -rows.support(opposite));
    const double half = 0.5 * (upper - lower) * (1.0 + kFacetRounding) + kFacetRounding * std::abs(upper);
    rows.add(k, 0.0, model.facets[k].a, 0.5 * (upper + lower), half);
  }
  const double learnt = time_at(log, learning);
  learn_usual(log, model, learnt);
  detector::PoseSumDetector sums(model, {.false_alarms = risk.risk / std::max(driven(log), 1.0)});
  std::size_t number = model.facets.size();
  walk_poses(log, sums, learnt, core::kInfinity, [&] {
    for (const detector::SumState& look : sums.looks()) {
      if (sums.scales()[look.scale] < kLeastCuttingScale || !std::isfinite(look.radius)) {
        continue;
      }
      const Eigen::VectorXd Y = sums.regressor(look), opposite = -Y;
      const double y = look.value + Y.dot(model.estimate);
      if (rows.support(Y) > y + look.radius || rows.support(opposite) > look.radius - y) {
        rows.add(number, sums.now(), Y, y, look.radius);
      }
      ++number;
    }
  });
  return rows.block();
}

PoseAtRisk pose_at_risk(LogSource& log, const detector::KinematicModel& guaranteed, const detector::PoseErrors& errors,
                        double seconds, const PoseAtRiskOptions& options) {
  PoseAtRisk result;
  const PoseSteps steps = pose_steps(log, guaranteed.measurement);
  detector::KinematicModel model = guaranteed;
  detector::PoseRiskModel& risk = model.at_risk.emplace();
  risk.risk = options.risk;
  risk.errors = errors;
  std::ranges::copy_if(options.scales, std::back_inserter(risk.scales),
                       [&](double scale) { return scale >= kFewestSteps * steps.median; });
  risk.delay = std::max({kForesight, kForesightSteps * steps.median,
                         0.5 * std::max(errors.position.correlation, errors.heading.correlation)});
  if (!(steps.shortest > 0.0) || risk.scales.empty()) {
    result.detail = "the log has too few poses";
    return result;
  }
  core::RegressionTable rows(pose_sum_rows(log, guaranteed, risk, options.learning));
  FeasibleSet set = feasible_set(rows, guaranteed.box);
  if (set.status == FeasibleSet::Status::empty) {
    result.verdict = core::AssumptionVerdict::fails;
    result.detail = "no wheel radii and yaw gains are left";
    return result;
  }
  risk.facets = set.polytope->facets();
  risk.box = set.hull;
  learn_usual(log, model, core::kInfinity);
  test_on_log(log, model, seconds, options, result);
  if (result.verdict == core::AssumptionVerdict::holds) {
    result.model = std::move(model.at_risk);
    result.proof = {std::move(set.lower), std::move(set.upper), options.learning};
  }
  return result;
}

namespace {

// What is asked of the pose's errors; nothing where nothing can be said at a risk.
std::optional<detector::PoseErrors> errors_that_average(LogSource& log, const Robot& robot,
                                                        const std::optional<detector::KinematicModel>& model) {
  if (!model || !model->measurement.heading) {
    return std::nullopt;
  }
  const auto errors = pose_errors(robot, pose_steps(log, model->measurement).shortest);
  return errors && errors->average() ? errors : std::nullopt;
}

}  // namespace

KinematicPart make_kinematic_part(LogSource& log, const Robot& robot, const CommissionOptions& options) {
  const Model model = model::make_model(robot);
  const Measurement measurement = filter::find_measurement(log, robot, model, robot.filter.order.value_or(2));
  const Survey seen = survey(log, measurement);
  KinematicPart part{commission_kinematics(log, robot, filter::find_odometry(log, robot, model, measurement), seen,
                                           kinematic_options(robot, options)),
                     {}};
  if (options.at_risk != CommissionOptions::AtRisk::nothing) {
    if (const auto errors = errors_that_average(log, robot, part.residual.model)) {
      part.at_risk = pose_at_risk(log, *part.residual.model, *errors, seen.seconds);
    }
  }
  return part;
}

void learn_pose_at_risk(LogSource& log, Commissioning& result, const PoseAtRiskOptions& options,
                        const std::optional<PoseAtRisk>& made) {
  KinematicCommissioning& kinematic = result.kinematic;
  if (!result.has_model()) {
    return;
  }
  const Robot& robot = result.model.robot;
  const auto errors = errors_that_average(log, robot, kinematic.model);
  if (!errors) {
    return;
  }
  core::Assumption assumption = assumed_pose(robot);
  if (kinematic.model->warrant != core::Warrant::guaranteed) {
    assumption.detail = kinematic.model->measurement.gyro
                            ? "the gyro's errors are not declared, and the wheels' set stands on them"
                            : "the bounds of radii and yaw gains are not guaranteed";
  } else {
    PoseAtRisk said = made ? *made : pose_at_risk(log, *kinematic.model, *errors, result.survey.seconds, options);
    assumption.verdict = said.verdict;
    assumption.detail = said.detail;
    if (said.verdict == core::AssumptionVerdict::fails) {
      result.notes.push_back(fmt::format(
          "nothing is said of the pose at a stated risk, the worst case stands alone: {}; a larger `bias` or "
          "`correlation` of `noise: position` or `noise: heading` in the robot file would allow for it",
          said.detail));
    }
    kinematic.model->at_risk = said.model;
    kinematic.at_risk = std::move(said.proof);
    if (result.model.kinematic) {
      result.model.kinematic->at_risk = std::move(said.model);
    }
  }
  result.assumptions.push_back(assumption);
  result.model.assumptions = result.assumptions;
}

}  // namespace wheelwright::commission
