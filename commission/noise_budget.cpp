// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/noise_budget.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace wheelwright::commission {

OutputNoise estimated_noise(const identify::OutputResidual& residual, std::size_t instants, double plausible,
                            const identify::ExtrapolationOptions& options) {
  OutputNoise noise;
  noise.how = identify::extrapolate(residual, instants, options);
  noise.learning = plausible;
  noise.bound = std::max(noise.how.bound, plausible);
  return noise;
}

double raise_until_explained(std::vector<OutputNoise>& noise, core::RegressionSource& rows, const Box& prior,
                             const std::function<bool(const std::vector<OutputNoise>&)>& explained) {
  bounds::MinimaxOptions options;
  for (const OutputNoise& o : noise) {
    options.weights.push_back(std::max(o.learning, std::numeric_limits<double>::min()));
  }
  const double factor = noise_that_leaves_a_set(bounds::minimax_fit(rows, prior, options), [&](double by) {
    std::vector<OutputNoise> more = noise;
    for (OutputNoise& o : more) {
      o.learning *= by;
    }
    return explained(more);
  });
  for (OutputNoise& o : noise) {
    o.learning *= factor;
    o.bound = std::max(o.bound, o.learning);
  }
  return factor;
}

double noise_that_leaves_a_set(const bounds::MinimaxFit& fit, const std::function<bool(double)>& leaves_a_set) {
  constexpr double kAbove = 1.05;
  double lower = std::max(1.0, fit.lower), upper = fit.upper;
  while (!fit.converged && upper > kAbove * lower) {
    const double middle = std::sqrt(lower * upper);
    (leaves_a_set(middle) ? upper : lower) = middle;
  }
  return kAbove * upper;
}

std::optional<double> motion_error(const Robot& robot, const Measurement& measurement) {
  const bool axis = !model::on_two_wheels(robot);
  switch (measurement.motion) {
    case MotionKind::mean_speed:
      if (measurement.count > 0.0) {
        return 0.5 * measurement.count * measurement.nominal_step;
      }
      break;
    case MotionKind::angle: {
      const model::NoiseBound& declared = axis ? robot.noise.position : robot.noise.wheel_angle;
      if (declared.value) {
        return declared.value;
      }
      break;
    }
    case MotionKind::speed: return robot.noise.wheel_speed.value;
  }
  if (robot.encoder_counts_per_turn) {
    return std::numbers::pi / *robot.encoder_counts_per_turn;
  }
  return std::nullopt;
}

NoiseBudget noise_budget(const Robot& robot, const Measurement& measurement) {
  NoiseBudget budget;
  const auto motion = motion_error(robot, measurement);
  const bool declared_motion = robot.noise.wheel_speed.value || robot.noise.wheel_angle.value ||
                               robot.noise.position.value || robot.encoder_counts_per_turn;
  if (!motion || !declared_motion || !robot.noise.effort.value) {
    return budget;
  }
  budget.complete = true;
  budget.sensors.motion = *motion;
  budget.sensors.effort = *robot.noise.effort.value;
  budget.sensors.heading = robot.noise.heading.value.value_or(0.0);
  return budget;
}

filter::ErrorClasses classes_with(const Robot& robot, const Measurement& measurement, double motion,
                                  const filter::ErrorClass& effort) {
  filter::ErrorClasses classes;
  classes.shortest_step = measurement.shortest_step > 0.0 ? measurement.shortest_step : measurement.nominal_step;
  classes.effort = effort;
  const model::NoiseBound& angle = model::on_two_wheels(robot) ? robot.noise.wheel_angle : robot.noise.position;
  const bool speed = measurement.motion == MotionKind::speed;
  const model::NoiseBound& declared = speed ? robot.noise.wheel_speed : angle;
  classes.motion.bound = motion;
  if (speed || (measurement.motion == MotionKind::angle && angle.value)) {
    classes.motion.bias = std::min(declared.bias.value_or(motion), motion);
    classes.motion.correlation = declared.correlation;
    classes.motion.deviation = declared.deviation.value_or(core::kInfinity);
  } else {
    classes.count = 2.0 * motion;
  }
  return classes;
}

std::optional<filter::ErrorClasses> error_classes(const Robot& robot, const Measurement& measurement) {
  const NoiseBudget budget = noise_budget(robot, measurement);
  const model::NoiseBound& effort = robot.noise.effort;
  if (!budget.complete || !effort.bias) {
    return std::nullopt;
  }
  return classes_with(robot, measurement, budget.sensors.motion,
                      {budget.sensors.effort, std::min(*effort.bias, budget.sensors.effort), effort.correlation,
                       effort.deviation.value_or(core::kInfinity)});
}

Eigen::VectorXd coordinate_limit(const Model& model, const std::vector<double>& joint_limit) {
  return model.motion.cwiseAbs() *
         Eigen::Map<const Eigen::VectorXd>(joint_limit.data(), static_cast<Eigen::Index>(joint_limit.size()));
}

}  // namespace wheelwright::commission
