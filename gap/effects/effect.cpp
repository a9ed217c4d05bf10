// SPDX-License-Identifier: Apache-2.0
#include "gap/effects/effect.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "model/effect_law.hpp"
#include "model/filter/kernel.hpp"

namespace wheelwright::gap {
namespace {

std::vector<double> points(const ShapeParameter& shape, const Drive& drive) {
  const Interval bounds = shape_bounds(shape, drive);
  std::vector<double> result;
  for (std::size_t k = 0; k < shape.scan; ++k) {
    const double part = shape.scan > 1 ? static_cast<double>(k) / static_cast<double>(shape.scan - 1) : 0.5;
    result.push_back(shape.logarithmic ? bounds.lower * std::pow(bounds.upper / bounds.lower, part)
                                       : bounds.lower + part * (bounds.upper - bounds.lower));
  }
  if (shape.both_signs) {
    std::vector<double> mirrored(result.rbegin(), result.rend());
    std::ranges::transform(mirrored, mirrored.begin(), std::negate<>());
    result.insert(result.begin(), mirrored.begin(), mirrored.end());
  }
  return result;
}

}  // namespace

void validate(const Effect& effect) {
  check::that(!effect.name.empty(), "Effect::name", "a name");
  check::that(static_cast<bool>(effect.columns), effect.name + ": columns", "a function");
  check::that(!effect.unit_coefficient || effect.parameters.empty(), effect.name + ": parameters",
              "none beside a unit coefficient");
  check::that(effect.unit_coefficient || !effect.parameters.empty(), effect.name + ": parameters", "at least one");
  for (const ShapeParameter& shape : effect.shapes) {
    const std::string what = effect.name + ": shape " + shape.name;
    check::that(shape.lower <= shape.upper, what, "lower <= upper");
    check::that(!shape.logarithmic || shape.lower > 0.0, what, "lower > 0 for a logarithmic grid");
    check::that(shape.scan >= 1, what, "at least one grid point");
  }
}

Applicability applicability(const Effect& effect, const Drive& drive) {
  return effect.applies ? effect.applies(drive) : Applicability{};
}

Interval shape_bounds(const ShapeParameter& shape, const Drive& drive) {
  const double scale = shape.scale ? shape.scale(drive) : 1.0;
  return {shape.lower * scale, shape.upper * scale};
}

std::vector<std::vector<double>> shape_grid(const Effect& effect, const Drive& drive) {
  std::vector<std::vector<double>> grid(1);
  for (const ShapeParameter& shape : effect.shapes) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : grid) {
      for (const double value : points(shape, drive)) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    }
    grid = std::move(longer);
  }
  return grid;
}

}  // namespace wheelwright::gap

namespace wheelwright::gap::catalogue {
namespace {

void add_to(Eigen::VectorXd& to, double factor, const Eigen::VectorXd& signal) {
  if (signal.size() == 0 || factor == 0.0) {
    return;
  }
  if (to.size() == 0) {
    to = factor * signal;
  } else {
    to += factor * signal;
  }
}

std::vector<Eigen::VectorXd> outputs_of(const Drive& drive, const std::vector<Eigen::VectorXd>& effort) {
  std::vector<Eigen::VectorXd> outputs(drive.model.n());
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (std::size_t j = 0; j < effort.size(); ++j) {
      add_to(outputs[i], drive.model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), effort[j]);
    }
  }
  return outputs;
}

void add_all(std::vector<Eigen::VectorXd>& a, const std::vector<Eigen::VectorXd>& b) {
  a.resize(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < b.size(); ++i) {
    add_to(a[i], 1.0, b[i]);
  }
}

}  // namespace

double deviation(const Eigen::VectorXd& signal) { return std::sqrt((signal.array() - signal.mean()).square().mean()); }

Eigen::VectorXd soft_sign(const Eigen::VectorXd& signal, double width) {
  return (signal / width).array().tanh().matrix();
}

double typical_speed(const Drive& drive) {
  return std::max({deviation(drive.joints[0].smooth_speed), drive.count, 1e-12});
}

double typical_effort(const Drive& drive) { return std::max(deviation(drive.joints[0].smooth_effort), 1e-12); }

Eigen::VectorXd lagged(const Drive& drive, const Eigen::VectorXd& signal, double T) {
  const filter::StepWeights w(1.0 / T, drive.step);
  Eigen::VectorXd y(signal.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    y[first] = signal[first];
    for (Eigen::Index k = first + 1; k < last; ++k) {
      y[k] = w.decay() * y[k - 1] + (w.begin1() * signal[k - 1] + w.end1() * signal[k]) / T;
    }
  }
  return y;
}

Eigen::VectorXd followed(const Drive& drive, const Eigen::VectorXd& signal, double rate) {
  const double most = rate * drive.step;
  Eigen::VectorXd y = signal;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 1; k < last; ++k) {
      y[k] = y[k - 1] + std::clamp(signal[k] - y[k - 1], -most, most);
    }
  }
  return y;
}

double sign_width(const Drive& drive) { return std::max(0.006 * typical_speed(drive), 0.4 * drive.count); }

Eigen::VectorXd speed_sign(const Drive& drive, std::size_t joint) {
  return soft_sign(drive.joints[joint].smooth_speed, sign_width(drive));
}

Column at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort) {
  Column column;
  column.effort = outputs_of(drive, effort);
  return column;
}

Column rate_at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort) {
  Column column;
  column.effort_rate = outputs_of(drive, effort);
  return column;
}

std::vector<Eigen::VectorXd> only(const Drive& drive, std::size_t joint, Eigen::VectorXd signal) {
  std::vector<Eigen::VectorXd> signals(drive.joints.size());
  signals[joint] = std::move(signal);
  return signals;
}

namespace {

// The share of a term's effort that follows unseen motion: all of an inertia's, `friction` of a viscous one's.
double share_of(const Term& term, double friction) {
  return term.kind == Term::Kind::acceleration ? 1.0 : term.kind == Term::Kind::speed ? friction : 0.0;
}

}  // namespace

Column unseen_motion(const Drive& drive, const std::vector<Eigen::VectorXd>& speed, double friction) {
  Column column;
  column.effort.resize(drive.model.n());
  column.effort_rate.resize(drive.model.n());
  for (const Term& term : drive.model.terms) {
    const double share = share_of(term, friction);
    if (share > 0.0) {
      auto& group = term.kind == Term::Kind::acceleration ? column.effort_rate : column.effort;
      const double factor = share * drive.theta[static_cast<Eigen::Index>(term.parameter)] * term.scale;
      add_to(group[term.output], factor, speed[term.coordinate]);
    }
  }
  if (drive.two_wheels()) {
    column.forward = speed[0];
    column.yaw = speed[1];
  }
  return column;
}

Column unseen_rim_speeds(const Drive& drive, const Eigen::VectorXd& right, const Eigen::VectorXd& left,
                         double friction) {
  Eigen::VectorXd forward, yaw;
  add_to(forward, 0.5, right);
  add_to(forward, 0.5, left);
  add_to(yaw, 1.0 / drive.track_width, right);
  add_to(yaw, -1.0 / drive.track_width, left);
  return unseen_motion(drive, {forward, yaw}, friction);
}

std::vector<Eigen::VectorXd> inertial_efforts(const Drive& drive, double friction) {
  const auto n = static_cast<Eigen::Index>(drive.model.n());
  Eigen::MatrixXd outputs = Eigen::MatrixXd::Zero(drive.rows(), n);
  for (const Term& term : drive.model.terms) {
    const double share = share_of(term, friction);
    if (share > 0.0) {
      const CoordinateSignals& moves = drive.coordinates[term.coordinate];
      outputs.col(static_cast<Eigen::Index>(term.output)) +=
          share * drive.theta[static_cast<Eigen::Index>(term.parameter)] * term.scale *
          (term.kind == Term::Kind::acceleration ? moves.smooth_acceleration : moves.smooth_speed);
    }
  }
  const Eigen::MatrixXd inverse = core::inverse(drive.model.input);
  std::vector<Eigen::VectorXd> joints;
  for (Eigen::Index j = 0; j < inverse.rows(); ++j) {
    joints.push_back(outputs * inverse.row(j).transpose());
  }
  return joints;
}

Column base_column(const Drive& drive, std::string_view name) {
  Column column;
  column.effort.resize(drive.model.n());
  column.effort_rate.resize(drive.model.n());
  for (const Term& term : drive.model.terms) {
    const model::Parameter& parameter = drive.model.parameters[term.parameter];
    if (parameter.physical != name || term.kind == Term::Kind::function) {
      continue;
    }
    auto& group = term.kind == Term::Kind::acceleration ? column.effort_rate : column.effort;
    add_to(group[term.output], term.scale * parameter.per_physical, drive.coordinates[term.coordinate].speed);
  }
  return column;
}

void add(Column& a, const Column& b) {
  add_all(a.effort, b.effort);
  add_all(a.effort_rate, b.effort_rate);
  add_to(a.forward, 1.0, b.forward);
  add_to(a.lateral, 1.0, b.lateral);
  add_to(a.yaw, 1.0, b.yaw);
}

ShapeParameter side() {
  return {.name = "side_right0_left1", .unit = "1", .lower = 0.0, .upper = 1.0, .scan = 2, .discrete = true};
}

ShapeParameter side_or_opposite() {
  return {.name = "right0_left1_opposite2", .unit = "1", .lower = 0.0, .upper = 2.0, .scan = 3, .discrete = true};
}

ShapeParameter friction_on_body() {
  return {
      .name = "friction_on_body", .unit = "1", .lower = 0.0, .upper = 1.0, .scan = 3, .discrete = true, .beside = true};
}

double friction_on_body(const Effect& effect, std::span<const double> shape) {
  const std::string name = friction_on_body().name;
  for (std::size_t s = 0; s < std::min(effect.shapes.size(), shape.size()); ++s) {
    if (effect.shapes[s].name == name) {
      return shape[s];
    }
  }
  return 1.0;
}

Eigen::Vector2d side_factors(std::span<const double> shape) {
  const double side = shape.empty() ? 0.0 : shape[0];
  return side > 1.5 ? Eigen::Vector2d(1.0, -1.0) : side < 0.5 ? Eigen::Vector2d(1.0, 0.0) : Eigen::Vector2d(0.0, 1.0);
}

std::vector<Eigen::VectorXd> on_side(double side, const Eigen::VectorXd& right, const Eigen::VectorXd& left) {
  const bool opposite = side > 1.5;
  return {opposite || side < 0.5 ? right : Eigen::VectorXd(), opposite     ? Eigen::VectorXd(-left)
                                                              : side < 0.5 ? Eigen::VectorXd()
                                                                           : left};
}

Applicability needs_two_wheels(const Drive& drive) {
  return drive.two_wheels() ? Applicability{} : Applicability{false, "the robot is not on two driven wheels"};
}

Applicability needs_heading(const Drive& drive) {
  if (!drive.two_wheels()) {
    return needs_two_wheels(drive);
  }
  return drive.has_heading() ? Applicability{} : Applicability{false, "the log has no heading"};
}

Applicability needs_no(const Drive& drive, std::string_view name) {
  const auto same = [name](const model::Parameter& parameter) { return parameter.physical == name; };
  return std::ranges::none_of(drive.model.parameters, same)
             ? Applicability{}
             : Applicability{false, "the base model has " + std::string(name) + " itself"};
}

}  // namespace wheelwright::gap::catalogue

namespace wheelwright::gap {
namespace {

std::vector<Effect> catalogue_of(const Model& model) {
  std::vector<Effect> all = friction_effects(model.joints.size());
  const auto append = [&all](std::vector<Effect> more) {
    all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  append(geometry_effects(model.joints.size()));
  append(actuator_effects(model.joints.size()));
  append(effects_by_law(model, all));
  return all;
}

}  // namespace

std::vector<Effect> effect_catalogue() {
  Robot robot;
  robot.wheel_radius = robot.track_width = 1.0;
  return catalogue_of(model::make_model(robot));
}

std::vector<Effect> effect_catalogue(const Model& model) { return catalogue_of(model); }

const Effect* find_effect(const std::vector<Effect>& catalogue, std::string_view name) {
  const auto found = std::ranges::find(catalogue, name, &Effect::name);
  return found == catalogue.end() ? nullptr : &*found;
}

std::string catalogue_noun(std::string_view name) {
  const auto law = std::ranges::find(model::effect_laws(), name, &model::EffectLaw::name);
  if (law != model::effect_laws().end()) {
    return law->noun;
  }
  static const std::vector<Effect> catalogue = effect_catalogue();
  const Effect* effect = find_effect(catalogue, name);
  return effect != nullptr ? effect->noun : std::string();
}

std::string family_noun(std::string_view family) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kNouns{
      {{"late_torque", "late torque"},
       {"rolling_distance", "the rolling distance per count of one wheel"},
       {"dry_friction", "dry friction"}}};
  const auto known = std::ranges::find(kNouns, family, &std::pair<std::string_view, std::string_view>::first);
  std::string noun(known != kNouns.end() ? known->second : family);
  std::ranges::replace(noun, '_', ' ');
  return noun;
}

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
