// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include <wheelwright/gap/effect.hpp>
#include <wheelwright/model/effect_law.hpp>

namespace wheelwright::gap {
namespace {

using Shape = std::span<const double>;

std::string sentence_of(const model::EffectLaw& law) {
  std::string text = law.noun + ".";
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

// The robot of `drive` with the one effect: its linear parameters 1, the others as the shape has them.
Robot robot_with(const model::EffectLaw& law, const Model& model, double wheel_radius, double track_width,
                 Shape shape) {
  Robot robot;
  robot.model = model.name;
  robot.wheel_radius = wheel_radius;
  robot.track_width = track_width;
  model::RobotEffect effect{law.name, {}};
  std::size_t next = 0;
  for (const model::EffectParameterLaw& parameter : law.parameters_of(robot)) {
    const double value = parameter.linear ? 1.0 : shape[next++];
    effect.parameters[parameter.name] = {value, value};
  }
  robot.effects = {std::move(effect)};
  return robot;
}

// One signal per output of what the terms of parameter `j` ask for.
Column column_of(const Drive& drive, const Model& terms, std::size_t j, const Eigen::VectorXd& heading) {
  Column column;
  column.effort.resize(terms.n());
  column.effort_rate.resize(terms.n());
  const auto put = [&](std::vector<Eigen::VectorXd>& signals, const Term& term, const Eigen::VectorXd& signal) {
    Eigen::VectorXd& at = signals[term.output];
    at = at.size() > 0 ? Eigen::VectorXd(at + term.scale * signal) : Eigen::VectorXd(term.scale * signal);
  };
  const std::size_t joints = drive.joints.size(), coordinates = drive.coordinates.size();
  const std::vector<double> joint_error(joints, catalogue::sign_width(drive));
  std::vector<double> speed_error(coordinates), speed(coordinates), joint_speed(joints);
  for (std::size_t i = 0; i < coordinates; ++i) {
    speed_error[i] = terms.motion.row(static_cast<Eigen::Index>(i)).cwiseAbs().sum() * catalogue::sign_width(drive);
  }
  for (const Term& term : terms.terms) {
    if (term.parameter != j) {
      continue;
    }
    if (term.kind == Term::Kind::speed) {
      put(column.effort, term, drive.coordinates[term.coordinate].smooth_speed);
    } else if (term.kind == Term::Kind::acceleration) {
      put(column.effort_rate, term, drive.coordinates[term.coordinate].speed);
    } else {
      Eigen::VectorXd values(drive.rows());
      for (Eigen::Index k = 0; k < drive.rows(); ++k) {
        for (std::size_t i = 0; i < coordinates; ++i) {
          speed[i] = drive.coordinates[i].smooth_speed[k];
        }
        for (std::size_t i = 0; i < joints; ++i) {
          joint_speed[i] = drive.joints[i].smooth_speed[k];
        }
        values[k] = model::softened(term.function, {.speed = speed,
                                                    .speed_error = speed_error,
                                                    .joint_speed = joint_speed,
                                                    .joint_error = joint_error,
                                                    .heading = heading.size() > 0 ? heading[k] : 0.0});
      }
      put(column.effort, term, values);
    }
  }
  return column;
}

std::vector<Column> columns_of(const model::EffectLaw& law, const Drive& drive, Shape shape) {
  Robot robot = robot_with(law, drive.model, drive.wheel_radius, drive.track_width, shape);
  robot.lever_arm_is_track = drive.lever_arm == drive.track_width && drive.track_width > 0.0;
  const Model terms = model::effect_terms(drive.model, robot);
  const Eigen::VectorXd heading = terms.heading_used ? heading_or_odometry(drive) : Eigen::VectorXd();
  const auto& known = law.parameters_of(robot);
  std::vector<Column> columns;
  for (std::size_t j = 0; j < terms.p(); ++j) {
    Column column = column_of(drive, terms, j, heading);
    const auto parameter = std::ranges::find(known, terms.parameters[j].physical, &model::EffectParameterLaw::physical);
    const double factor = terms.parameters[j].per_physical * (parameter->times_mass ? drive.physical("mass") : 1.0);
    for (auto* const signals : {&column.effort, &column.effort_rate}) {
      for (Eigen::VectorXd& signal : *signals) {
        signal *= factor;
      }
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

Effect effect_of(const model::EffectLaw& law, const Model& model) {
  Effect effect;
  effect.name = law.name;
  effect.noun = law.noun;
  effect.sentence = sentence_of(law);
  Robot robot;
  robot.model = model.name;
  std::vector<double> shape;
  for (const model::EffectParameterLaw& parameter : law.parameters_of(robot)) {
    if (parameter.linear) {
      effect.parameters.push_back({parameter.name, parameter.unit, parameter.lower == 0.0 ? 1 : 0});
      continue;
    }
    effect.shapes.push_back({.name = parameter.name,
                             .unit = parameter.unit,
                             .lower = parameter.search.lower,
                             .upper = parameter.search.upper,
                             .scan = 6,
                             .logarithmic = true});
    shape.push_back(parameter.search.lower);
  }
  const Model terms = model::effect_terms(model, robot_with(law, model, 1.0, 1.0, shape));
  for (const model::Parameter& parameter : terms.parameters) {
    effect.excite += (effect.excite.empty() ? "" : "; ") + parameter.excite;
  }
  effect.applies = terms.heading_used    ? catalogue::needs_heading
                   : model.on_two_wheels ? catalogue::needs_two_wheels
                                         : std::function<Applicability(const Drive&)>{};
  effect.columns = [&law](const Drive& drive, Shape at) { return columns_of(law, drive, at); };
  return effect;
}

}  // namespace

std::vector<Effect> effects_by_law(const Model& model, const std::vector<Effect>& own) {
  std::vector<Effect> effects;
  Robot robot;
  robot.model = model.name;
  if (model::on_two_wheels(robot) != model.on_two_wheels) {
    return effects;
  }
  for (const model::EffectLaw& law : model::effect_laws()) {
    const bool terms = (model.on_two_wheels ? law.add_terms : law.add_terms_of_axis) != nullptr;
    if (terms && std::ranges::find(own, law.name, &Effect::name) == own.end()) {
      effects.push_back(effect_of(law, model));
    }
  }
  return effects;
}

}  // namespace wheelwright::gap
