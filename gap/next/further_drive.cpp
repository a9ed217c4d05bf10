// SPDX-License-Identifier: Apache-2.0
#include "gap/next/further_drive.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include <fmt/format.h>

#include "commission/design/stages.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/linear_algebra.hpp"
#include "core/random.hpp"
#include "gap/next/discrimination_design.hpp"
#include "gap/prepared.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kShortestRest = 0.1;  // s
constexpr double kStill = 1e-9;        // of the largest speed

Mask rests(const Eigen::VectorXd& speed, double step) {
  Mask still = speed.array().abs() <= kStill * speed.cwiseAbs().maxCoeff();
  const auto fewest = static_cast<Eigen::Index>(std::ceil(kShortestRest / step * (1.0 - 1e-9)));
  for (Eigen::Index k = 0; k < still.size();) {
    Eigen::Index end = k;
    while (end < still.size() && still[end]) {
      ++end;
    }
    if (end - k < fewest) {
      still.segment(k, end - k).setConstant(false);
    }
    k = std::max(end, k + 1);
  }
  return still;
}

}  // namespace

Drive planned_drive(const design::Plan& plan, const design::DesignSubject& subject) {
  const Model& model = subject.model;
  const Robot& robot = subject.robot;
  check::that(plan.samples() >= 3, "plan", "at least three samples");
  check::that(plan.speed.rows() == model.motion.rows(), "plan", "a speed for each coordinate of the model");
  Drive drive;
  drive.model = model;
  drive.step = check::positive(plan.step, "plan.step");
  drive.window = 1;
  if (robot.wheel_radius > 0.0 && robot.track_width > 0.0) {
    drive.wheel_radius = robot.wheel_radius;
    drive.track_width = robot.track_width;
    drive.lever_arm = robot.lever_arm_is_track ? robot.track_width : 0.5 * robot.track_width;
  }
  drive.t = Eigen::VectorXd::LinSpaced(plan.samples(), 0.0, plan.t(plan.samples() - 1));
  drive.segment_starts = {0};
  const Eigen::MatrixXd inverse = core::pseudo_inverse(model.motion);
  const Eigen::MatrixXd speed = inverse * plan.speed, acceleration = inverse * plan.acceleration;
  for (Eigen::Index j = 0; j < speed.rows(); ++j) {
    JointSignals joint;
    joint.speed = joint.smooth_speed = speed.row(j).transpose();
    joint.smooth_acceleration = acceleration.row(j).transpose();
    joint.angle = Eigen::VectorXd::Zero(plan.samples());
    for (Eigen::Index k = 1; k < plan.samples(); ++k) {
      joint.angle[k] = joint.angle[k - 1] + 0.5 * plan.step * (joint.speed[k - 1] + joint.speed[k]);
    }
    joint.resting = rests(joint.speed, plan.step);
    drive.joints.push_back(std::move(joint));
  }
  for (Eigen::Index c = 0; c < plan.speed.rows(); ++c) {
    const Eigen::VectorXd v = plan.speed.row(c).transpose();
    drive.coordinates.push_back({v, v, plan.acceleration.row(c).transpose()});
  }
  if (model.heading_coordinate >= 0) {
    drive.x = plan.pose.row(0).transpose();
    drive.y = plan.pose.row(1).transpose();
    drive.heading = plan.pose.row(2).transpose();
  }
  predict_efforts(drive, subject.theta);
  for (JointSignals& joint : drive.joints) {
    joint.effort = joint.smooth_effort = joint.predicted_effort;
  }
  return drive;
}

namespace {

constexpr double kPlannedEffort = 0.8;               // of the limit
constexpr double kShortest = 20.0, kLongest = 60.0;  // s; between them a third of the log that was analysed
constexpr double kShortestTravel = 0.5;              // m
constexpr int kProbeDrives = 3;                      // random manoeuvres
constexpr std::size_t kStages = 8;                   // of each
constexpr double kImitated = 1e-3;                   // share of a signature

double largest(const Drive& drive, Eigen::VectorXd JointSignals::*signal) {
  double value = 0.0;
  for (const JointSignals& joint : drive.joints) {
    value = std::max(value, (joint.*signal).cwiseAbs().maxCoeff());
  }
  return value;
}

// Whether each column of `a` is a sum of columns of `b`, which has more.
bool special_case(const CandidateTable& table, const Signature& a, const Signature& b, BaseModel base) {
  const std::size_t count = own_columns(table.candidates[a.candidate]).size();
  if (count >= own_columns(table.candidates[b.candidate]).size()) {
    return false;
  }
  const auto n = static_cast<Eigen::Index>(count);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (made_up(table, {a.candidate, Eigen::VectorXd::Unit(n, k)}, b, base) < 1.0 - kImitated) {
      return false;
    }
  }
  return true;
}

// What one pair is on some manoeuvres.
struct Judged {
  bool separable = false;
  bool first_is_special = true, second_is_special = true;
};

std::string reason_for(const Judged& pair, const Effect& first, const Effect& second,
                       const std::vector<Effect>& catalogue) {
  if (pair.first_is_special || pair.second_is_special) {
    const Effect& simple = pair.first_is_special ? first : second;
    const Effect& general = pair.first_is_special ? second : first;
    return simple.name + " is a special case of " + general.name +
           ", which shows only in what goes beyond it: " + general.excite;
  }
  if (pair.separable) {
    return "not excited: " + first.excite + (second.excite == first.excite ? "" : "; " + second.excite);
  }
  return "inseparable by any log of these sensors: " +
         splitting_measurement({{{first.name, {}, {}}}}, {{{second.name, {}, {}}}}, catalogue);
}

Drive random_drive(const design::StageFamily& family, const design::DesignSubject& subject, const Drive& like,
                   std::mt19937_64& generator) {
  std::vector<double> x(family.dimension());
  std::ranges::generate(x, [&] { return core::uniform(generator); });
  Drive drive = planned_drive(family.plan(x, subject.step), subject);
  drive.has_efforts = like.has_efforts;
  if (!like.has_pose()) {
    drive.x = drive.y = drive.heading = {};
  }
  return drive;
}

}  // namespace

design::DesignSubject subject_of(const PreparedGap& prepared, const Robot& robot, const Eigen::VectorXd& theta) {
  design::DesignSubject subject;
  subject.robot = robot;
  subject.model = prepared.drive.model;
  if (prepared.drive.has_efforts) {
    TableSource source(prepared.log);
    subject.measurement = filter::find_measurement(source, robot, subject.model, 2);
  }
  subject.filter = {2, prepared.row_options.beta, prepared.row_options.beta};
  subject.theta = theta;
  for (const double value : theta) {
    subject.effort_box.sides.push_back({value, value});
  }
  subject.prior.sides = model::prior_box(robot, subject.model).bounds;
  subject.step = prepared.drive.step;
  return subject;
}

design::MotionLimits limits_within(const PreparedGap& prepared, const Robot& robot) {
  const Drive& drive = prepared.drive;
  design::MotionLimits limits = design::limits_of(robot);
  limits.duration = std::clamp(static_cast<double>(drive.rows()) * drive.step / 3.0, kShortest, kLongest);
  if (!(limits.joint_speed > 0.0)) {
    limits.joint_speed = largest(drive, &JointSignals::smooth_speed);
  }
  if (limits.effort) {
    limits.effort = kPlannedEffort * *limits.effort;
  }
  if (!limits.joint_acceleration) {
    limits.joint_acceleration = largest(drive, &JointSignals::smooth_acceleration);
  }
  if (drive.has_pose()) {
    double travel = 0.0;
    for (std::size_t k = 0; k < drive.segment_starts.size(); ++k) {
      const auto [first, last] = drive.segment(k);
      for (Eigen::Index i = first; i < last; ++i) {
        travel = std::max(travel, std::hypot(drive.x[i] - drive.x[first], drive.y[i] - drive.y[first]));
      }
    }
    limits.radius = std::max(travel, kShortestTravel);
  }
  return limits;
}

void judge_pairs(std::vector<ConfusablePair>& pairs, const CandidateTable& table,
                 const std::vector<std::optional<Signature>>& on_log, BaseModel base, const PreparedGap& prepared,
                 const Robot& robot, const BlockOptions& blocks) {
  ShapeGrids shapes(prepared.catalogue.size());
  for (const ConfusablePair& pair : pairs) {
    for (const std::string& name : {pair.first, pair.second}) {
      const std::size_t e = first_of_name(table, on_log, name);
      shapes[e] = {table.candidates[on_log[e]->candidate].shape};
    }
  }
  const design::DesignSubject subject = subject_of(prepared, robot, prepared.theta);
  std::optional<design::StageFamily> family;
  try {
    family.emplace(subject, limits_within(prepared, robot), kStages);
  } catch (const InvalidArgument&) {
    return;
  }
  std::mt19937_64 generator(1);
  std::vector<Judged> judged(pairs.size());
  for (int probe = 0; probe < kProbeDrives; ++probe) {
    const Drive drive = random_drive(*family, subject, prepared.drive, generator);
    GapProblem problem =
        make_problem(drive, prepared.floor, {}, prepared.trusted, prepared.catalogue, shapes, prepared.row_options);
    const BlockGram gram(problem.rows.spaces, blocks);
    problem.table.gram = &gram;
    std::vector<Signature> here(table.names.size());
    for (std::size_t c = 0; c < problem.table.candidates.size(); ++c) {
      const std::size_t e = problem.table.candidates[c].effect;
      here[e] = {c, on_log[e]->weights};
    }
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Signature &a = here[first_of_name(table, on_log, pairs[k].first)],
                      &b = here[first_of_name(table, on_log, pairs[k].second)];
      judged[k].separable = judged[k].separable || made_up(problem.table, a, b, base) < 1.0 - kImitated ||
                            made_up(problem.table, b, a, base) < 1.0 - kImitated;
      judged[k].first_is_special = judged[k].first_is_special && special_case(problem.table, a, b, base);
      judged[k].second_is_special = judged[k].second_is_special && special_case(problem.table, b, a, base);
    }
  }
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Effect& first = prepared.catalogue[first_of_name(table, on_log, pairs[k].first)];
    const Effect& second = prepared.catalogue[first_of_name(table, on_log, pairs[k].second)];
    pairs[k].reason = reason_for(judged[k], first, second, prepared.catalogue);
    pairs[k].inseparable = !judged[k].separable && !judged[k].first_is_special && !judged[k].second_is_special;
  }
}

}  // namespace wheelwright::gap
