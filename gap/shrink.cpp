// SPDX-License-Identifier: Apache-2.0
#include "gap/shrink.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "commission/commission.hpp"
#include "core/error.hpp"
#include "core/for_all.hpp"
#include "core/statistics.hpp"
#include "gap/improved_robot.hpp"
#include "gap/noise_floor.hpp"
#include "gap/prepared.hpp"
#include "gap/rows/block_gram.hpp"
#include "gap/rows/gap_rows.hpp"
#include "identify/noise_level.hpp"
#include "model/sim/plant.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kConfidence = 0.95;

// θ and the causes' coefficients as one signed least-squares problem on the rows.
struct CauseProblem {
  GapRows rows;
  Subset subset;
  std::size_t of_theta = 0;       // the first of the subset's columns
  double begin = 0.0, end = 0.0;  // s
};

CauseProblem make_cause_problem(const PreparedGap& prepared, const ShrinkCauses& found) {
  CauseProblem p;
  const Drive& drive = prepared.drive;
  p.rows = make_gap_rows(drive, prepared.floor, prepared.healthy, prepared.row_options);
  for (std::size_t j = 0; j < p.rows.parameters; ++j) {
    if (found.base == BaseModel::refitted || !prepared.trusted[j]) {
      p.subset.columns.push_back(j);
    }
  }
  p.of_theta = p.subset.columns.size();
  p.subset.sign.assign(p.of_theta, 0);
  for (const FittedEffect& cause : found.causes) {
    const std::vector<Column> columns = cause.effect.columns(drive, cause.shape);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::size_t at = add_column(p.rows.spaces, rows_of(drive, p.rows, columns[c], prepared.row_options));
      if (cause.effect.unit_coefficient) {
        p.subset.fixed.push_back(at);
      } else {
        p.subset.columns.push_back(at);
        p.subset.sign.push_back(cause.effect.parameters[c].sign);
      }
    }
  }
  p.begin = std::numeric_limits<double>::infinity();
  p.end = -p.begin;
  for (const RowSpace& space : p.rows.spaces) {
    if (space.t.size() > 0) {
      p.begin = std::min(p.begin, space.t[0]);
      p.end = std::max(p.end, space.t[space.t.size() - 1]);
    }
  }
  return p;
}

// Fit to the rows whose times `use` takes.
Eigen::VectorXd fit_rows(const CauseProblem& p, const std::function<bool(double)>& use) {
  const auto n = static_cast<Eigen::Index>(p.subset.columns.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  for (const RowSpace& space : p.rows.spaces) {
    const double weight = 1.0 / space.floor;
    Eigen::VectorXd kept(space.t.size());
    for (Eigen::Index k = 0; k < kept.size(); ++k) {
      kept[k] = use(space.t[k]) ? weight : 0.0;
    }
    Eigen::MatrixXd X = Eigen::MatrixXd::Zero(kept.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::VectorXd& column = space.columns[p.subset.columns[static_cast<std::size_t>(i)]];
      if (column.size() > 0) {
        X.col(i) = column.cwiseProduct(kept);
      }
    }
    A += X.transpose() * X;
    b += X.transpose() * residual(space, p.subset, {}).cwiseProduct(kept);
  }
  const Eigen::VectorXd unit =
      A.diagonal().unaryExpr([](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
  const Eigen::MatrixXd scaled = unit.asDiagonal() * A * unit.asDiagonal();
  return unit.cwiseProduct(signed_least_squares(scaled, unit.cwiseProduct(b), p.subset.sign).x);
}

// Part `k` of `count` equal parts of the rows' duration.
struct Part {
  double begin, end;
  [[nodiscard]] bool holds(double t) const { return t >= begin && t < end; }
  [[nodiscard]] bool near(double t, double purge) const { return t >= begin - purge && t < end + purge; }
};

Part part_of(const CauseProblem& p, std::size_t k, std::size_t count) {
  const double length = (p.end - p.begin) / static_cast<double>(count);
  const double begin = p.begin + static_cast<double>(k) * length;
  return {begin, k + 1 == count ? p.end + length : begin + length};
}

Eigen::VectorXd fit_without(const CauseProblem& p, const Part& part, double purge) {
  return fit_rows(p, [&](double t) { return !part.near(t, purge); });
}

std::vector<ShrinkFigure> torque_figures(const PreparedGap& prepared, const CauseProblem& p,
                                         const ShrinkOptions& options) {
  const std::size_t blocks = std::max<std::size_t>(2, options.blocks.blocks);
  const auto n = static_cast<Eigen::Index>(prepared.drive.model.n());
  const auto count = static_cast<Eigen::Index>(blocks);
  Eigen::MatrixXd before = Eigen::MatrixXd::Zero(count, n), after = before, rows = before;
  core::for_all(blocks, options.threads, [&](std::size_t block) {
    const Part part = part_of(p, block, blocks);
    const Eigen::VectorXd fit = fit_without(p, part, options.blocks.purge);
    const auto at = static_cast<Eigen::Index>(block);
    for (Eigen::Index i = 0; i < n; ++i) {
      const RowSpace& space = p.rows.spaces[static_cast<std::size_t>(i)];
      const Eigen::VectorXd left = residual(space, p.subset, fit);
      for (Eigen::Index k = 0; k < left.size(); ++k) {
        if (part.holds(space.t[k])) {
          before(at, i) += space.response[k] * space.response[k];
          after(at, i) += left[k] * left[k];
          rows(at, i) += 1.0;
        }
      }
    }
  });
  std::vector<ShrinkFigure> figures;
  for (Eigen::Index i = 0; i < n; ++i) {
    // A block counts as one value, the root of its mean square over all blocks' mean number of rows.
    const double mean_rows = rows.col(i).mean();
    const Eigen::VectorXd roots = (after.col(i) / mean_rows).cwiseSqrt();
    const RolloutRms rms = rollout_rms(roots, options.seed);
    figures.push_back({prepared.drive.model.outputs[static_cast<std::size_t>(i)],
                       prepared.drive.model.output_units[static_cast<std::size_t>(i)],
                       std::sqrt(before.col(i).sum() / rows.col(i).sum()), rms.rms, prepared.floor.efforts[i],
                       rms.lower, rms.upper});
  }
  return figures;
}

// The simulator with θ and the causes that `coefficients` stands for.
std::optional<Robot> robot_with(const Robot& robot, const PreparedGap& prepared, const ShrinkCauses& found,
                                const CauseProblem& p, const Eigen::VectorXd& coefficients, std::string& why_not) {
  Eigen::VectorXd theta = prepared.drive.theta;
  for (std::size_t i = 0; i < p.of_theta; ++i) {
    theta[static_cast<Eigen::Index>(p.subset.columns[i])] += coefficients[static_cast<Eigen::Index>(i)];
  }
  std::vector<FittedEffect> causes = robots_own(prepared.healthy);
  auto next = static_cast<Eigen::Index>(p.of_theta);
  for (const FittedEffect& cause : found.causes) {
    FittedEffect fitted = cause;
    if (!cause.effect.unit_coefficient) {
      fitted.coefficients = coefficients.segment(next, std::ssize(cause.effect.parameters));
      next += std::ssize(cause.effect.parameters);
    }
    causes.push_back(std::move(fitted));
  }
  return improved_robot(robot, prepared.drive, theta, causes, {}, why_not);
}

// Streams of noise like that of the sensors.
std::pair<std::vector<Eigen::VectorXd>, std::vector<Eigen::VectorXd>> sensor_noise(const Drive& drive,
                                                                                   std::uint64_t seed) {
  const SignalNoise noise = signal_noise(drive);
  std::pair<std::vector<Eigen::VectorXd>, std::vector<Eigen::VectorXd>> streams;
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    // Uniform on ±b has the standard deviation b/√3; counted speeds have the difference of two such errors.
    const double of_two = noise.counted ? 0.5 : 1.0;
    sim::Noise speed(seed, 2 * j, std::sqrt(3.0 * of_two) * noise.speed[at]);
    sim::Noise effort(seed, 2 * j + 1, std::sqrt(3.0) * noise.effort[at]);
    Eigen::VectorXd of_speed(drive.rows()), of_effort(drive.rows());
    double last = speed.measure(0.0);
    for (Eigen::Index k = 0; k < drive.rows(); ++k) {
      const double now = speed.measure(0.0);
      of_speed[k] = noise.counted ? now - std::exchange(last, now) : now;
      of_effort[k] = effort.measure(0.0);
    }
    streams.first.push_back(std::move(of_speed));
    streams.second.push_back(std::move(of_effort));
  }
  return streams;
}

struct RolloutQuantity {
  const char* name;
  const char* unit;
  Eigen::VectorXd RolloutErrors::*errors;
};
constexpr RolloutQuantity kQuantities[] = {{"velocity", "m/s", &RolloutErrors::velocity},
                                           {"yaw_rate", "rad/s", &RolloutErrors::yaw_rate},
                                           {"position", "m", &RolloutErrors::position},
                                           {"heading", "rad", &RolloutErrors::heading}};

std::string horizon_name(double horizon) {
  const double whole = std::round(horizon);
  std::string text = std::to_string(horizon);
  if (std::abs(horizon - whole) < 1e-9) {
    text = std::to_string(static_cast<long>(whole));
  } else {
    text.erase(text.find_last_not_of('0') + 1);
  }
  return text + "s";
}

std::vector<ShrinkFigure> rollout_figures(const Robot& robot, const PreparedGap& prepared, const ShrinkCauses& found,
                                          const CauseProblem& p, const ShrinkOptions& options,
                                          std::vector<std::string>& notes) {
  const Drive& drive = prepared.drive;
  if (!drive.two_wheels()) {
    notes.push_back("no rollouts: only a robot on two driven wheels can be simulated");
    return {};
  }
  std::string why_not;
  const std::optional<Robot> nominal =
      improved_robot(robot, drive, drive.theta, robots_own(prepared.healthy), {}, why_not);
  std::vector<std::optional<Robot>> fitted;
  const std::size_t folds = std::max<std::size_t>(2, options.rollout_folds);
  double margin = nominal ? rollout_margin(*nominal) : 0.0;
  for (std::size_t k = 0; k < folds && why_not.empty(); ++k) {
    fitted.push_back(
        robot_with(robot, prepared, found, p, fit_without(p, part_of(p, k, folds), options.blocks.purge), why_not));
    margin = fitted.back() ? std::max(margin, rollout_margin(*fitted.back())) : margin;
  }
  if (!why_not.empty()) {
    notes.push_back("no rollouts: " + why_not);
    return {};
  }
  RolloutOptions rolling = options.rollout;
  rolling.threads = options.threads;
  const std::vector<Eigen::Index> starts = rollout_starts(drive, rolling, margin);
  if (starts.empty()) {
    notes.push_back("no rollouts: the log has no segment long enough");
    return {};
  }
  const std::vector<RolloutErrors> before = rollouts(drive, *nominal, starts, rolling);
  std::vector<RolloutErrors> after = before;
  for (std::size_t k = 0; k < folds; ++k) {
    std::vector<Eigen::Index> own, place;
    for (std::size_t w = 0; w < starts.size(); ++w) {
      const double middle = drive.t[starts[w]] + 0.5 * rolling.horizons.back();
      const Part part = part_of(p, k, folds);
      if (part.holds(std::clamp(middle, p.begin, p.end))) {
        own.push_back(starts[w]);
        place.push_back(static_cast<Eigen::Index>(w));
      }
    }
    const std::vector<RolloutErrors> errors = rollouts(drive, *fitted[k], own, rolling);
    for (std::size_t h = 0; h < errors.size(); ++h) {
      for (const RolloutQuantity& q : kQuantities) {
        (after[h].*q.errors)(place) = errors[h].*q.errors;
      }
    }
  }
  Robot plain = *fitted.front();
  plain.effects.clear();
  const auto [speed, effort] = sensor_noise(drive, options.seed);
  const std::vector<RolloutErrors> noise = rollout_noise(drive, plain, starts, speed, effort, rolling);
  IncrementNoise pose;
  if (drive.has_heading()) {
    pose = pose_noise(drive);
  }
  const double smoothing = std::sqrt(2.25 / static_cast<double>(drive.window));  // of a quadratic's middle
  std::vector<ShrinkFigure> figures;
  for (std::size_t h = 0; h < after.size(); ++h) {
    for (const RolloutQuantity& q : kQuantities) {
      const std::string name = q.name;
      const double of_pose = smoothing * (name == "position"  ? std::hypot(pose.forward, pose.lateral)
                                          : name == "heading" ? pose.yaw
                                                              : 0.0);
      const RolloutRms rms = rollout_rms(after[h].*q.errors, options.seed);
      figures.push_back({name + "_" + horizon_name(rolling.horizons[h]), q.unit,
                         rollout_rms(before[h].*q.errors, options.seed).rms, rms.rms,
                         std::hypot(rollout_rms(noise[h].*q.errors, options.seed).rms, of_pose), rms.lower, rms.upper});
    }
  }
  return figures;
}

// What commissioning says of each output; empty where it cannot be done, and why.
struct Commissioned {
  std::vector<commission::OutputValidation> outputs;
  std::string why_not;
};

Commissioned commissioned(const LogTable& log, const Robot& robot) {
  Commissioned result;
  try {
    TableSource source(log);
    commission::CommissionOptions options;
    options.at_risk = commission::CommissionOptions::AtRisk::nothing;
    Commissioning commissioning = commission_robot(source, robot, options);
    result.outputs = std::move(commissioning.validation);
    if (result.outputs.empty()) {
      result.why_not = commissioning.message;
    }
  } catch (const Error& error) {
    result.why_not = error.what();
  }
  return result;
}

// Commissioning chooses parameters of its own where the robot file leaves them open: the model is to stay the one at
// hand.
Robot with_parameters_of(Robot robot, const Model& model) {
  const std::vector<std::string> possible = model::possible_parameters(robot);
  robot.parameters.emplace();
  for (const model::Parameter& parameter : model.parameters) {
    if (std::ranges::find(possible, parameter.physical) != possible.end()) {
      robot.parameters->push_back(parameter.physical);
    }
  }
  return robot;
}

double share_of_radius(double kappa) { return std::sqrt(1.0 + kappa) - 1.0; }

void threshold_figures(GapShrink& shrink, const Robot& robot, const PreparedGap& prepared, const ShrinkCauses& found,
                       const ShrinkOptions& options, std::vector<std::string>& notes) {
  const Model& model = prepared.drive.model;
  std::string why_not;
  const std::optional<Robot> nominal =
      improved_robot(robot, prepared.drive, prepared.drive.theta, robots_own(prepared.healthy), {}, why_not);
  const bool with_floor = prepared.baseline_log && prepared.reference != GapReference::simulator && nominal.has_value();
  std::vector<Commissioned> runs(with_floor ? 3 : 2);
  core::for_all(runs.size(), options.threads, [&](std::size_t k) {
    const LogTable& log = k == 2 ? *prepared.baseline_log : prepared.log;
    runs[k] = commissioned(log, with_parameters_of(k == 0 ? *found.improved : k == 1 ? robot : *nominal, model));
  });
  for (std::size_t k = 0; k < 2; ++k) {
    if (!runs[k].why_not.empty()) {
      notes.push_back("no thresholds of the " + std::string(k == 0 ? "improved" : "nominal") +
                      " model: " + runs[k].why_not);
      return;
    }
  }
  for (std::size_t i = 0; i < model.n(); ++i) {
    const commission::OutputValidation &after = runs[0].outputs[i], &before = runs[1].outputs[i];
    const commission::OutputValidation* const floor =
        with_floor && !runs[2].outputs.empty() ? &runs[2].outputs[i] : nullptr;
    shrink.threshold_width.push_back({model.outputs[i], model.output_units[i], before.median_width, after.median_width,
                                      floor != nullptr ? floor->median_width : 0.0, after.median_width,
                                      after.median_width});
    if (!std::isfinite(before.smallest_kappa) || !std::isfinite(after.smallest_kappa)) {
      notes.push_back("no change of the wheels' radius is certain to be seen in the " + model.outputs[i] +
                      " channel with the " +
                      (std::isfinite(after.smallest_kappa) ? "nominal model" : "improved model"));
      continue;
    }
    const double share = share_of_radius(after.smallest_kappa);
    const bool known = floor != nullptr && std::isfinite(floor->smallest_kappa);
    shrink.smallest_fault.push_back({model.outputs[i], "1", share_of_radius(before.smallest_kappa), share,
                                     known ? share_of_radius(floor->smallest_kappa) : 0.0, share, share});
  }
}

}  // namespace

GapShrink measure_shrink(const Robot& robot, const PreparedGap& prepared, const ShrinkCauses& found,
                         const ShrinkOptions& options, std::vector<std::string>& notes) {
  const CauseProblem problem = make_cause_problem(prepared, found);
  GapShrink shrink;
  if (!prepared.drive.has_efforts) {
    notes.push_back("how far the gap shrinks is measured in the torque: the log has no efforts");
    return shrink;
  }
  shrink.torque_rms = torque_figures(prepared, problem, options);
  shrink.rollout = rollout_figures(robot, prepared, found, problem, options, notes);
  if (options.commissioning && found.improved) {
    threshold_figures(shrink, robot, prepared, found, options, notes);
  }
  return shrink;
}

std::vector<ParameterShift> parameter_shifts(const Robot& robot, const Drive& drive, const CandidateTable& table,
                                             const std::vector<std::size_t>& structural) {
  if (!drive.has_efforts) {
    return {};
  }
  const BlockFit without = table.gram->fit(subset_of(table, {}, BaseModel::refitted));
  const BlockFit with = table.gram->fit(subset_of(table, structural, BaseModel::refitted));
  const double t = core::student_quantile(kConfidence, static_cast<double>(table.gram->blocks()) - 1.0);
  std::vector<ParameterShift> shifts;
  for (std::size_t j = 0; j < drive.model.p(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const model::Parameter& parameter = drive.model.parameters[j];
    ParameterShift shift;
    shift.parameter = parameter.physical;
    shift.unit = parameter.physical_unit;
    if (const auto nominal = robot.nominal.find(parameter.physical); nominal != robot.nominal.end()) {
      shift.nominal = nominal->second;
    }
    shift.without_causes = (drive.theta[at] + without.coefficients[at]) / parameter.per_physical;
    shift.estimate = (drive.theta[at] + with.coefficients[at]) / parameter.per_physical;
    const double half = t * std::sqrt(std::max(0.0, with.covariance(at, at))) / parameter.per_physical;
    shift.lower = shift.estimate - half;
    shift.upper = shift.estimate + half;
    shifts.push_back(std::move(shift));
  }
  return shifts;
}

}  // namespace wheelwright::gap
