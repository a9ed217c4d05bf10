// SPDX-License-Identifier: Apache-2.0
#include "commission/noise_budget.hpp"

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

bool cover_untold_outputs(std::vector<OutputNoise>& noise, core::RegressionSource& rows, const Box& prior,
                          const std::vector<identify::ExcitationFinding>& excitation,
                          const std::vector<bool>& noise_alone, const Eigen::MatrixXd& input) {
  if (std::ranges::count(excitation, identify::Excitation::not_excited, &identify::ExcitationFinding::state) == 0) {
    return false;
  }
  const auto n = static_cast<Eigen::Index>(noise.size()), p = static_cast<Eigen::Index>(prior.dimension());
  const Eigen::VectorXd most = prior.magnitudes();
  Eigen::VectorXd most_noise = Eigen::VectorXd::Zero(p);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(n), largest_noise = Eigen::VectorXd::Zero(n);
  std::vector<bool> told(noise.size(), false), moves(noise.size(), false);
  for (Eigen::Index j = 0; j < p; ++j) {
    most_noise[j] = noise_alone[static_cast<std::size_t>(j)] ? most[j] : 0.0;
  }
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      const auto i = static_cast<std::size_t>(r % n);
      const auto row = block.Y.row(r).cwiseAbs();
      largest[r % n] = std::max(largest[r % n], std::abs(block.y[r]) + row.dot(most));
      largest_noise[r % n] = std::max(largest_noise[r % n], row.dot(most_noise));
      for (Eigen::Index j = 0; j < p; ++j) {
        if (block.Y(r, j) != 0.0) {
          moves[i] = true;
          told[i] = told[i] || excitation[static_cast<std::size_t>(j)].state != identify::Excitation::not_excited;
        }
      }
    }
  });
  bool any = false;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    for (std::size_t k = 0; k < noise.size() && !told[i]; ++k) {
      if (told[k]) {
        const double share = input.row(at).norm() / input.row(static_cast<Eigen::Index>(k)).norm();
        noise[i].bound = std::max(noise[i].bound, share * noise[k].bound);
        noise[i].learning = std::max(noise[i].learning, share * noise[k].learning);
      }
    }
    if (told[i]) {
      any = any || largest_noise[at] > 0.0;
      noise[i].bound += largest_noise[at];
    } else if (moves[i]) {
      any = true;
      noise[i].learning = std::max(noise[i].learning, (1.0 + 1e-9) * largest[at]);
      noise[i].bound = std::max(noise[i].bound, noise[i].learning);
    }
  }
  return any;
}

namespace {

// The point of `prior` nearest to an estimate, in its own covariance; sides that were met once are kept.
Eigen::VectorXd inside(const Box& prior, Eigen::VectorXd theta, Eigen::MatrixXd covariance) {
  for (Eigen::Index step = 0; step < theta.size(); ++step) {
    Eigen::Index worst = -1;
    double most = 0.0, by = 0.0;
    for (Eigen::Index j = 0; j < theta.size(); ++j) {
      const Interval& side = prior.sides[static_cast<std::size_t>(j)];
      const double back = std::clamp(theta[j], side.lower, side.upper) - theta[j];
      const double far = covariance(j, j) > 0.0 ? std::abs(back) / std::sqrt(covariance(j, j)) : core::kInfinity;
      if (back != 0.0 && far > most) {
        worst = j, most = far, by = back;
      }
    }
    if (worst < 0) {
      break;
    }
    if (covariance(worst, worst) > 0.0) {
      const Eigen::VectorXd gain = covariance.col(worst) / covariance(worst, worst);
      theta += by * gain;
      covariance -= gain * covariance.row(worst).eval();
    }
    covariance.row(worst).setZero();
    covariance.col(worst).setZero();
  }
  for (Eigen::Index j = 0; j < theta.size(); ++j) {
    const Interval& side = prior.sides[static_cast<std::size_t>(j)];
    theta[j] = std::clamp(theta[j], side.lower, side.upper);
  }
  return theta;
}

}  // namespace

double raise_until_explained(std::vector<OutputNoise>& noise, core::RegressionSource& rows, const Box& prior,
                             const EstimateInPrior& fit,
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
  const Eigen::VectorXd plausible = identify::largest_plausible_error(
      rows, inside(prior, fit.estimate, fit.residuals.covariance), fit.residuals, fit.risk);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    noise[i].learning = std::max(noise[i].learning * factor, plausible[static_cast<Eigen::Index>(i)]);
    noise[i].bound = std::max(noise[i].bound, noise[i].learning);
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
  double gain = 0.0;
  for (std::size_t j = 0; j < measurement.effort_columns.size(); ++j) {
    gain = std::max(gain, measurement.effort_gain(j));
  }
  // An effort that is sharpened holds the error of the row before, too.
  const double memory = measurement.smoothing.upper > 0.0 ? measurement.longest_step() : 0.0;
  return classes_with(robot, measurement, budget.sensors.motion,
                      {gain * budget.sensors.effort, gain * std::min(*effort.bias, budget.sensors.effort),
                       effort.correlation + memory, gain * effort.deviation.value_or(core::kInfinity)});
}

Eigen::VectorXd coordinate_limit(const Model& model, const std::vector<double>& joint_limit) {
  return model.motion.cwiseAbs().rowwise().sum() * *std::ranges::max_element(joint_limit);
}

}  // namespace wheelwright::commission
