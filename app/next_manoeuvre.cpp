// SPDX-License-Identifier: Apache-2.0
#include "next_manoeuvre.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/design/limits.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/gap/estimates.hpp>
#include <wheelwright/gap/prepared.hpp>
#include <wheelwright/report/gap_words.hpp>

namespace wheelwright::app {
namespace {

constexpr std::size_t kMostRivals = 4;               // pairs grow with the square
constexpr double kPlannedEffort = 0.8;               // of the limit
constexpr double kShortest = 20.0, kLongest = 60.0;  // s; between them a third of the log that was analysed
constexpr double kShortestTravel = 0.5;              // m

// The best fit of a set of effects at any of their shapes.
CauseSet best_set(const CandidateTable& table, const std::vector<std::string>& effects, BaseModel base) {
  CauseSearchOptions search;
  search.base = base;
  for (const std::string& name : table.names) {
    search.allowed.push_back(std::ranges::find(effects, name) != effects.end());
  }
  for (const std::vector<CauseSet>& level : search_causes(table, search)) {
    if (!level.empty() && level.front().members.size() == effects.size()) {
      return level.front();
    }
  }
  throw InvalidArgument("these causes are in no table: " + fmt::format("{}", fmt::join(effects, ", ")));
}

Rival rival_of(const FittedCauses& fitted, const std::vector<Effect>& catalogue, const Drive& drive) {
  Rival rival;
  for (const FittedEffect& effect : fitted.effects) {
    const Eigen::VectorXd& c = effect.coefficients;
    RivalCause cause{effect.effect.name, {c.data(), c.data() + c.size()}, effect.shape};
    if (c.size() > 0 && c.isZero()) {
      cause = typical_rival({cause.effect}, catalogue, drive).causes.front();
    }
    rival.causes.push_back(std::move(cause));
  }
  return rival;
}

// Each member of the credible set fitted to the drive; θ beside the first of them goes to `theta`.
std::vector<Rival> fitted_rivals(const PreparedGap& prepared, const Diagnosis& diagnosis,
                                 const DiagnoseOptions& options, Eigen::VectorXd& theta) {
  const bool trusted = std::ranges::find(prepared.trusted, true) != prepared.trusted.end();
  std::vector<Rival> rivals;
  for (const CredibleCauses& member : diagnosis.credible) {
    if (member.effects.empty() || rivals.size() == kMostRivals) {
      continue;
    }
    ShapeGrids shapes = all_shapes(prepared.catalogue, prepared.drive);
    bool parametric = false;
    for (std::size_t e = 0; e < prepared.catalogue.size(); ++e) {
      const bool here = std::ranges::find(member.effects, prepared.catalogue[e].name) != member.effects.end();
      parametric = parametric || (here && prepared.catalogue[e].parametric);
      if (!here) {
        shapes[e].clear();
      }
    }
    GapProblem problem = make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted,
                                      prepared.catalogue, shapes, prepared.row_options);
    BlockOptions blocks = options.blocks;
    blocks.threads = options.threads;
    const BlockGram gram(problem.rows.spaces, blocks);
    problem.table.gram = &gram;
    const BaseModel base = parametric && trusted ? BaseModel::nominal : BaseModel::refitted;
    const FittedCauses fitted =
        fit_causes(prepared, problem, best_set(problem.table, member.effects, base), base, blocks);
    if (rivals.empty()) {
      theta = fitted.theta;
    }
    rivals.push_back(rival_of(fitted, prepared.catalogue, prepared.drive));
  }
  return rivals;
}

DesignSubject subject_of(const PreparedGap& prepared, const Robot& robot, const Eigen::VectorXd& theta) {
  DesignSubject subject;
  subject.robot = robot;
  subject.model = prepared.drive.model;
  TableSource source(prepared.log);
  subject.measurement = find_measurement(source, robot, subject.model, 2);
  subject.filter = {2, prepared.row_options.beta, prepared.row_options.beta};
  subject.theta = theta;
  for (const double value : theta) {
    subject.effort_box.sides.push_back({value, value});
  }
  subject.prior.sides = prior_box(robot, subject.model).bounds;
  subject.step = prepared.drive.step;
  return subject;
}

double largest(const Drive& drive, Eigen::VectorXd JointSignals::*signal) {
  double value = 0.0;
  for (const JointSignals& joint : drive.joints) {
    value = std::max(value, (joint.*signal).cwiseAbs().maxCoeff());
  }
  return value;
}

MotionLimits limits_within(const Drive& drive, const Robot& robot) {
  MotionLimits limits = limits_of(robot);
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

std::string joined(const std::vector<std::string>& sentences) { return fmt::format("{}", fmt::join(sentences, " ")); }

}  // namespace

NextDrive next_drive(LogSource& log, LogSource* baseline, const Robot& robot, const Diagnosis& diagnosis,
                     const DiagnoseOptions& options) {
  const PreparedGap prepared = prepare_gap(log, baseline, robot, options);
  NextDrive next;
  Eigen::VectorXd theta = prepared.theta;
  next.rivals = fitted_rivals(prepared, diagnosis, options, theta);
  if (next.rivals.size() < 2) {
    return next;
  }
  const DesignSubject subject = subject_of(prepared, robot, theta);
  PlannedNoise noise;
  noise.beta = prepared.row_options.beta;
  noise.output = {prepared.floor.efforts.data(), prepared.floor.efforts.data() + prepared.floor.efforts.size()};
  noise.pose = prepared.floor.increments;
  noise.window = prepared.row_options.window;
  DesignOptions search;
  search.samples = 60;
  search.descents = 2;
  search.steps = 120;
  search.seed = options.seed;
  search.threads = options.threads;
  search.progress = [&](std::string_view, double share) {
    if (options.progress) {
      options.progress("designing the next manoeuvre", share);
    }
  };
  const MotionLimits limits = limits_within(prepared.drive, robot);
  const DiscriminationDesign design =
      design_for_discrimination(subject, limits, next.rivals, prepared.catalogue, noise, search, &prepared.drive);
  next.sentence = in_words(joined(design.sentences), prepared.catalogue);
  if (design.worst()) {
    next.commands = command_table(design.manoeuvre.plan, subject.model);
    next.sentence = fmt::format("A drive of {:.0f} s within {:.2g} m of its start. {}", limits.duration,
                                design.manoeuvre.plan.pose.topRows<2>().colwise().norm().maxCoeff(), next.sentence);
  }
  return next;
}

std::string in_words(std::string text, const std::vector<Effect>& catalogue) {
  const auto of_a_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at;
    while (end < text.size() && of_a_name(text[end])) {
      ++end;
    }
    const std::string word = text.substr(at, end - at);
    const bool effect = std::ranges::find(catalogue, word, &Effect::name) != catalogue.end();
    out += effect ? report::effect_noun(word) : word;
    if (effect && text.compare(end, 3, " + ") == 0) {
      out += " with ";
      end += 3;
    } else if (end < text.size()) {
      out += text[end++];
    }
    at = end;
  }
  return out;
}

}  // namespace wheelwright::app
