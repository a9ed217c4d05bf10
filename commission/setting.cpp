// SPDX-License-Identifier: Apache-2.0
#include "commission/setting.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "commission/setting_rows.hpp"
#include "core/check.hpp"
#include "identify/instruments.hpp"
#include "identify/noise_level.hpp"
#include "model/effect_law.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::size_t kFewestLearned = 50;

void tell(const SettingOptions& options, std::string_view stage, double share) {
  if (options.progress) {
    options.progress(stage, share);
  }
}

// The widest model that the robot may have, where its file leaves the parameters open.
Setting widened(const Setting& s) {
  Setting wide = s;
  if (!s.robot.parameters) {
    wide.robot.parameters = model::possible_parameters(s.robot);
    wide.model = model::make_model(wide.robot);
  }
  return wide;
}

// Dry friction (and an offset) are taken in where the robot file leaves it open and they are worth it.
void settle_parameters(LogSource& log, Setting& s) {
  const std::size_t basic = s.model.p();
  const Setting wide = widened(s);
  if (wide.model.p() == basic) {
    return;
  }
  TorqueRows rows = make_rows(log, wide, {});
  const ParameterChoice choice = choose_parameters(rows, basic, s.survey.rows, s.folds);
  if (choice.full) {
    std::vector<std::string> added;
    for (std::size_t j = basic; j < wide.model.p(); ++j) {
      added.push_back(wide.model.parameters[j].physical);
    }
    s.robot.parameters = wide.robot.parameters;
    s.model = wide.model;
    s.notes.push_back(
        fmt::format("the model was given {}: on held-out blocks the relative error falls from {:.3g} to "
                    "{:.3g} (`parameters:` in the robot file decides otherwise)",
                    fmt::join(added, " and "), choice.nrmse_basic, choice.nrmse_full));
  }
}

// Samples of a signal show their noise in differences; a bound is only a limit.
std::optional<MotionNoise> find_motion_noise(LogSource& log, const Setting& s) {
  if (s.measurement.motion != MotionKind::mean_speed) {
    double squares = 0.0, relative = 0.0;
    bool white = true;
    const auto noises = identify::difference_noise(log, s.measurement.motion_columns);
    for (const identify::DifferenceNoise& noise : noises) {
      white = white && (noise.kind == identify::DifferenceNoise::Kind::white ||
                        noise.kind == identify::DifferenceNoise::Kind::none);
      squares += noise.sd * noise.sd / static_cast<double>(noises.size());
      relative = std::max(relative, std::hypot(noise.relative_sd, noise.hidden));
    }
    if (white) {
      const double sd = std::sqrt(squares);
      const char* unit = s.measurement.motion == MotionKind::angle ? "rad" : "rad/s";
      return MotionNoise{sd, relative, false, fmt::format("{:.2g} {} by differences", sd, unit)};
    }
  }
  if (const auto bound = motion_error(s.robot, s.measurement)) {
    const bool encoder = s.measurement.count > 0.0 || s.robot.encoder_counts_per_turn;
    return MotionNoise{*bound / std::sqrt(3.0), 0.0, true, encoder ? "half an encoder count" : "as declared"};
  }
  return std::nullopt;
}

// What a simulator can have, but a log cannot be corrected for.
void refuse_simulated(const Robot& robot) {
  for (const model::RobotEffect& effect : robot.effects) {
    const model::EffectLaw& law = model::effect_law(effect.name);
    if (law.mechanism == model::EffectMechanism::simulation) {
      throw InvalidArgument(fmt::format("effects.{} is for `simulate` only: from a log {}", effect.name, law.remedy));
    }
  }
}

}  // namespace

TorqueRows make_rows(LogSource& log, const Setting& s, const filter::SignalErrors& errors) {
  return TorqueRows(log, RegressorFilter(s.model, s.filter, s.measurement, errors));
}

Setting settle(LogSource& log, const Robot& robot, const SettingOptions& options) {
  refuse_simulated(robot);
  Setting s;
  s.robot = robot;
  s.model = model::make_model(robot);
  const int order = robot.filter.order.value_or(2);
  s.measurement = filter::find_measurement(log, robot, s.model, order);
  tell(options, "looking at the log", 0.05);
  s.survey = survey(log, s.measurement);
  check::that(s.survey.rows >= kFewestLearned, "log",
              fmt::format("at least {} rows (it has {})", kFewestLearned, s.survey.rows));
  if (robot.filter.beta) {
    const double beta = *robot.filter.beta;
    s.filter = {.order = order, .alpha = robot.filter.alpha.value_or(beta), .beta = beta};
  } else {
    tell(options, "choosing the filter", 0.1);
    s.filter_choice = choose_filter(log, widened(s).model, s.measurement, order, s.survey, options.filter_choice);
    s.filter = s.filter_choice.design;
    if (robot.filter.alpha) {
      s.filter.alpha = *robot.filter.alpha;
    }
  }
  filter::validate(s.filter);
  s.folds = options.folds;
  // As long as the filter remembers, but never the better part of a block.
  const double block = s.survey.seconds / static_cast<double>(s.folds.blocks);
  s.folds.purge = std::min(0.5 * s.filter.settle / s.filter.beta, 0.3 * block);
  settle_parameters(log, s);

  const model::PriorBox prior = model::prior_box(s.robot, s.model);
  s.prior.sides = prior.bounds;
  s.prior_declared = prior.declared;
  s.motion_noise = find_motion_noise(log, s);
  if (const auto commands = identify::commanded_motion(log, s.model)) {
    s.commands_are_noisy = identify::share_noise(log, commands->columns, s.measurement.motion_columns);
    if (s.commands_are_noisy) {
      s.notes.push_back(
          "the commanded speeds carry the noise of the measured motion (they were made from it): they are not used as "
          "instruments");
    }
  }
  const NoiseBudget budget = noise_budget(s.robot, s.measurement);
  s.noise_complete = budget.complete;
  if (budget.complete) {
    s.declared = filter::propagate(s.model, s.filter, s.measurement, budget.sensors,
                                   {.mode = options.noise_mode,
                                    .confidence = options.confidence,
                                    .rows = static_cast<double>(s.survey.rows),
                                    .largest_step = s.survey.largest_step});
    s.declared.motion.limit =
        coordinate_limit(s.model, acceleration_limit(s.robot, s.survey, s.measurement.motion, budget.sensors.motion));
  } else {
    s.declared.interpolates = loses_often(s.survey);  // noise is learnt from rows of a fit, and the set is of the same
  }
  return s;
}

std::optional<identify::RowNoise> row_noise(const Setting& s) {
  if (!s.motion_noise) {
    return std::nullopt;
  }
  const double variance = s.motion_noise->sd * s.motion_noise->sd;
  const filter::NoiseGram gram = filter::noise_gram(s.model, s.filter, s.measurement, s.survey.median_step);
  identify::RowNoise noise;
  noise.relative_sd = s.motion_noise->relative_sd;
  for (const Eigen::MatrixXd& motion : gram.motion) {
    noise.YY.push_back(variance * motion);
  }
  if (s.robot.noise.effort.value) {
    noise.yy = gram.effort * (*s.robot.noise.effort.value * *s.robot.noise.effort.value / 3.0);
  }
  return noise;
}

}  // namespace wheelwright::commission
