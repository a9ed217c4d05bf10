// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/pose_at_risk.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include <wheelwright/commission/sum_spread.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright::commission {
namespace {

constexpr double kForesight = 0.2;          // s, at least
constexpr double kForesightSteps = 6.0;     // from pose to pose, at least
constexpr double kLeastCuttingScale = 1.0;  // s, of sums that cut the set
constexpr std::size_t kCutsAtOnce = 256;
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

// The set cut by half-spaces, a few hundred at a time.
class Cutter {
 public:
  explicit Cutter(const detector::LearntSet& set) : facets_(set.facets), box_(set.box) {}

  void add(const Eigen::VectorXd& row, double observed, double radius) {
    const std::span<const double> a{row.data(), static_cast<std::size_t>(row.size())};
    const Eigen::VectorXd opposite = -row;
    if (box_.support(a) > observed + radius) {
      waiting_.push_back({row, observed + radius, {}});
    }
    if (box_.support({opposite.data(), a.size()}) > radius - observed) {
      waiting_.push_back({opposite, radius - observed, {}});
    }
    if (waiting_.size() >= kCutsAtOnce) {
      cut();
    }
  }
  void cut() {
    if (empty_ || waiting_.empty()) {
      return;
    }
    waiting_.insert(waiting_.end(), facets_.begin(), facets_.end());
    auto set = bounds::Polytope::intersect(waiting_, box_);
    waiting_.clear();
    if (std::holds_alternative<bounds::Polytope>(set)) {
      facets_ = std::get<bounds::Polytope>(set).facets();
      box_ = std::get<bounds::Polytope>(set).hull();
    } else {
      empty_ = true;
    }
  }
  [[nodiscard]] bool empty() const { return empty_; }
  [[nodiscard]] const std::vector<bounds::HalfSpace>& facets() const { return facets_; }
  [[nodiscard]] const Box& box() const { return box_; }

 private:
  std::vector<bounds::HalfSpace> facets_, waiting_;
  Box box_;
  bool empty_ = false;
};

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
  const std::vector<std::size_t> pick = core::positions_of(log, measurement.columns());
  std::vector<double> steps, pose(pick.size() - 2), last(pose.size());
  double before = 0.0;
  bool any = false;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    for (std::size_t c = 2; c < pick.size(); ++c) {
      pose[c - 2] = block.columns[pick[c]][k];
    }
    any = any && !starts;
    if (any && measurement.held_pose && pose == last) {
      return;
    }
    if (any) {
      steps.push_back(block.t[k] - before);
    }
    any = true;
    before = block.t[k];
    last = pose;
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

PoseAtRisk pose_at_risk(LogSource& log, const detector::KinematicModel& guaranteed, const detector::PoseErrors& errors,
                        double seconds, const PoseAtRiskOptions& options) {
  PoseAtRisk result;
  const PoseSteps steps = pose_steps(log, guaranteed.measurement);
  detector::KinematicModel model = guaranteed;
  detector::PoseRiskModel& risk = model.at_risk.emplace();
  risk.risk = options.risk;
  risk.errors = errors;
  risk.facets = model.facets;
  risk.box = model.box;
  std::ranges::copy_if(options.scales, std::back_inserter(risk.scales),
                       [&](double scale) { return scale >= kFewestSteps * steps.median; });
  risk.delay = std::max({kForesight, kForesightSteps * steps.median,
                         0.5 * std::max(errors.position.correlation, errors.heading.correlation)});
  if (!(steps.shortest > 0.0) || risk.scales.empty()) {
    result.detail = "the log has too few poses";
    return result;
  }
  const auto usual_between = [&](double from, double until) {
    detector::UsualPoseVariances usual = detector::usual_pose_variances(log, model, from, until);
    risk.usual_position = std::move(usual.position);
    risk.usual_heading = std::move(usual.heading);
  };
  const double learnt = time_at(log, options.learning);
  usual_between(-core::kInfinity, learnt);
  {
    detector::PoseSumDetector sums(model, {.false_alarms = options.risk / std::max(seconds, 1.0)});
    Cutter cutter(model);
    walk_poses(log, sums, learnt, core::kInfinity, [&] {
      for (const detector::SumState& look : sums.looks()) {
        if (sums.scales()[look.scale] >= kLeastCuttingScale && std::isfinite(look.radius)) {
          const Eigen::VectorXd row = sums.regressor(look);
          cutter.add(row, look.value + row.dot(model.estimate), look.radius);
        }
      }
    });
    cutter.cut();
    if (cutter.empty()) {
      result.verdict = core::AssumptionVerdict::fails;
      result.detail = "no wheel radii and yaw gains are left";
      return result;
    }
    risk.facets = cutter.facets();
    risk.box = cutter.box();
  }
  usual_between(-core::kInfinity, core::kInfinity);
  test_on_log(log, model, seconds, options, result);
  if (result.verdict == core::AssumptionVerdict::holds) {
    result.model = std::move(model.at_risk);
  }
  return result;
}

void learn_pose_at_risk(LogSource& log, Commissioning& result, const PoseAtRiskOptions& options) {
  KinematicCommissioning& kinematic = result.kinematic;
  if (!result.has_model() || !kinematic.model || !kinematic.model->measurement.heading) {
    return;
  }
  const Robot& robot = result.model.robot;
  const auto errors = pose_errors(robot, pose_steps(log, kinematic.model->measurement).shortest);
  if (!errors || !errors->average()) {
    return;
  }
  core::Assumption assumption = assumed_pose(robot);
  if (kinematic.model->warrant != core::Warrant::guaranteed) {
    assumption.detail = kinematic.model->measurement.gyro
                            ? "the gyro's errors are not declared, and the wheels' set stands on them"
                            : "the bounds of radii and yaw gains are not guaranteed";
  } else {
    PoseAtRisk said = pose_at_risk(log, *kinematic.model, *errors, result.survey.seconds, options);
    assumption.verdict = said.verdict;
    assumption.detail = said.detail;
    if (said.verdict == core::AssumptionVerdict::fails) {
      result.notes.push_back(fmt::format(
          "nothing is said of the pose at a stated risk, the worst case stands alone: {}; a larger `bias` or "
          "`correlation` of `noise: position` or `noise: heading` in the robot file would allow for it",
          said.detail));
    }
    kinematic.model->at_risk = said.model;
    if (result.model.kinematic) {
      result.model.kinematic->at_risk = std::move(said.model);
    }
  }
  result.assumptions.push_back(assumption);
  result.model.assumptions = result.assumptions;
}

}  // namespace wheelwright::commission
