// SPDX-License-Identifier: Apache-2.0
#include "commission/identification.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <ceres/jet.h>
#include <fmt/format.h>

#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "commission/setting_rows.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/linear_algebra.hpp"
#include "identify/inference/constrained.hpp"
#include "identify/noise_level.hpp"
#include "identify/time_shift.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

using Jet = ceres::Jet<double, 1>;

// exp(−(|ω|/ω_s)²) sgn ω
Jet stribeck(double omega, const Jet& omega_s) {
  if (omega == 0.0) {
    return Jet(0.0);
  }
  const Jet ratio = omega / omega_s;
  return (omega > 0.0 ? 1.0 : -1.0) * exp(-ratio * ratio);
}

}  // namespace

StribeckRows::StribeckRows(LogSource& log, RegressorFilter filter)
    : kernel_(filter.design(), filter.measurement().motion, filter.measurement().nominal_step),
      input_(filter.model().input) {
  const auto joints = filter.model().joints.size();
  std::vector<double> speeds, Y, y;
  std::size_t seen = 0;
  core::for_each_sample(log, filter.measurement().columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      filter.restart();
      seen = 0;
    }
    const bool gives_row = filter.step(sample.t, sample.values);
    if (filter.instants() != 0 && filter.instants() != seen) {
      instants_.push_back({filter.step_length(), filter.instants() == 1, gives_row});
      const Eigen::VectorXd& speed = filter.joint_speed();
      speeds.insert(speeds.end(), speed.data(), speed.data() + speed.size());
    }
    seen = filter.instants();
    if (gives_row) {
      const filter::FilteredRow& row = filter.row();
      Y.insert(Y.end(), row.Y.data(), row.Y.data() + row.Y.size());
      y.insert(y.end(), row.y.data(), row.y.data() + row.y.size());
    }
  });
  check::that(!y.empty(), "log", "at least one filtered row");
  response_ = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
  Y_ = Eigen::Map<const core::RowMatrix>(Y.data(), response_.size(), static_cast<Eigen::Index>(filter.model().p()));
  speed_ = Eigen::Map<const Eigen::MatrixXd>(speeds.data(), static_cast<Eigen::Index>(joints),
                                             static_cast<Eigen::Index>(instants_.size()));
}

bool StribeckRows::evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const {
  if (!(shape[0] > 0.0)) {
    return false;
  }
  const Jet omega_s(shape[0], 0);
  const Eigen::Index p = Y_.cols();
  const auto n = input_.rows();
  at.offset.resize(0);
  at.offset_by.clear();
  at.columns.resize(response_.size(), p + 1);
  at.columns.leftCols(p) = Y_;
  at.columns_by.assign(derivatives ? 1 : 0, Eigen::MatrixXd::Zero(response_.size(), p + 1));
  const auto joints = static_cast<std::size_t>(speed_.rows());
  std::vector<filter::KernelState> value(joints), slope(joints);
  std::vector<Jet> before(joints);
  Eigen::VectorXd filtered(speed_.rows()), filtered_slope(speed_.rows());
  filter::FilterKernel kernel = kernel_;
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < instants_.size(); ++k) {
    const Instant& instant = instants_[k];
    double share_before = 0.0;
    const double share = 0.5 * instant.length;
    if (!instant.begins) {
      kernel.prepare(instant.length);
      share_before = kernel.nodes() ? 0.5 * instants_[k - 1].length : share;
    }
    for (std::size_t j = 0; j < joints; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const Jet now = stribeck(speed_(i, static_cast<Eigen::Index>(k)), omega_s);
      if (instant.begins) {
        value[j] = slope[j] = {};
      } else {
        kernel.take(value[j], share_before * before[j].a + share * now.a);
        kernel.take(slope[j], share_before * before[j].v[0] + share * now.v[0]);
      }
      before[j] = now;
      filtered[i] = kernel.value(value[j]);
      filtered_slope[i] = kernel.value(slope[j]);
    }
    if (instant.gives_row) {
      at.columns.col(p).segment(next, n) = input_ * filtered;
      if (derivatives) {
        at.columns_by[0].col(p).segment(next, n) = input_ * filtered_slope;
      }
      next += n;
    }
  }
  return true;
}

namespace {

constexpr double kMostBias = 0.5;  // standard errors, by noise of the motion: more could pass for a lag
constexpr double kRisk = 1e-3;     // of Fit::plausible, which is not looked at here
constexpr double kSlowestStribeck = 0.01, kFastestStribeck = 0.5;  // of the largest joint speed

std::string motion_unit(const Setting& s) {
  const bool linear = !model::on_two_wheels(s.robot);  // its own unit: m or rad
  return s.measurement.motion == MotionKind::angle ? (linear ? "m or rad" : "rad") : (linear ? "per s" : "rad/s");
}

// What the robot file or the encoder says of a motion column.
std::optional<KnownNoise> known_motion_noise(const Setting& s) {
  const auto bound = motion_error(s.robot, s.measurement);
  if (!bound) {
    return std::nullopt;
  }
  const bool counts = s.measurement.count > 0.0 || s.robot.encoder_counts_per_turn;
  const bool of_angles = s.measurement.motion != MotionKind::speed;
  const bool linear = !model::on_two_wheels(s.robot);
  return KnownNoise{*bound, of_angles ? (linear ? "m or rad" : "rad") : motion_unit(s),
                    of_angles && counts ? "half an encoder count" : "as declared"};
}

std::vector<ColumnNoise> find_noise(LogSource& log, const Setting& s) {
  std::vector<std::string> columns = s.measurement.motion_columns;
  columns.insert(columns.end(), s.measurement.effort_columns.begin(), s.measurement.effort_columns.end());
  const std::vector<identify::DifferenceNoise> differences = identify::difference_noise(log, columns);
  const inference::Standstill standstill =
      inference::standstill_noise(log, inference::standstill_signs(log, s.model), columns);
  std::vector<ColumnNoise> noise;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    ColumnNoise of_column;
    of_column.column = columns[c];
    const bool motion = c < s.measurement.motion_columns.size();
    const bool axis = !model::on_two_wheels(s.robot);
    of_column.unit = motion ? motion_unit(s) : output_unit(s.robot, axis ? s.model.output_units.front() : "N·m");
    if (motion) {
      of_column.known = known_motion_noise(s);
    } else if (s.robot.noise.effort.value) {
      of_column.known = KnownNoise{*s.robot.noise.effort.value, of_column.unit, "as declared"};
    }
    of_column.evidence.differences = differences[c];
    of_column.evidence.standstill = standstill.columns[c];
    of_column.choice = inference::choose_noise(of_column.evidence);
    noise.push_back(std::move(of_column));
  }
  return noise;
}

std::vector<inference::PhysicalQuantity> quantities(const Model& model) {
  std::vector<inference::PhysicalQuantity> list;
  for (const model::Parameter& p : model.parameters) {
    list.push_back({p.physical, p.per_physical, p.physical_unit, p.never_negative});
  }
  return list;
}

std::vector<inference::ParameterWords> parameter_words(const Setting& s, bool physical) {
  std::vector<inference::ParameterWords> list;
  for (const model::Parameter& p : s.model.parameters) {
    std::string name = physical ? p.physical : p.name;
    if (physical) {
      std::ranges::replace(name, '_', ' ');
    }
    list.push_back({std::move(name), physical ? p.physical_unit : parameter_unit(s.robot, p), p.excite,
                    inference::kind_of(p.physical)});
  }
  return list;
}

// From θ_L to physical quantities: θ_L,j = (physical quantity + offset)/scale.
void to_physical(inference::IdentifiabilityInput& input, const std::vector<PhysicalScale>& scales) {
  Eigen::VectorXd scale(static_cast<Eigen::Index>(scales.size()));
  for (std::size_t j = 0; j < scales.size(); ++j) {
    scale[static_cast<Eigen::Index>(j)] = scales[j].scale;
  }
  const Eigen::VectorXd per = scale.cwiseInverse();
  input.factor = input.factor * per.asDiagonal();
  if (input.noise.size() > 0) {
    input.noise = per.asDiagonal() * input.noise * per.asDiagonal();
  }
  if (input.covariance.size() > 0) {
    input.covariance = scale.asDiagonal() * input.covariance * scale.asDiagonal();
  }
  input.size = input.size.cwiseProduct(scale.cwiseAbs());
}

inference::Identifiability judge(const Setting& s, const Fit& fit, const identify::RegressionMoments& moments) {
  const auto scales = physical_scales(s.robot, s.model);
  inference::IdentifiabilityInput input =
      inference::identifiability_input(fit.factor, parameter_words(s, scales.has_value()));
  const auto p = static_cast<Eigen::Index>(s.model.p());
  if (const auto noise = row_noise(s)) {
    input.noise = Eigen::MatrixXd::Zero(p, p);
    for (std::size_t i = 0; i < noise->YY.size(); ++i) {
      const double w = fit.weights[static_cast<Eigen::Index>(i)];
      input.noise += static_cast<double>(moments.instants()) * w * w * noise->YY[i];
    }
  }
  input.covariance = fit.residuals.covariance;
  input.size = fit.estimate.cwiseAbs();
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& prior = s.prior.sides[static_cast<std::size_t>(j)];
    const bool known = s.prior_declared[static_cast<std::size_t>(j)] || !(input.size[j] > 0.0);
    input.size[j] = known ? 0.5 * (prior.upper - prior.lower) : input.size[j];
    if (!(input.size[j] > 0.0)) {
      input.size[j] = 1.0;
    }
  }
  if (scales) {
    to_physical(input, *scales);
  }
  return inference::identifiability(input);
}

// The shape at its best and along all that was searched; `reference` is the weighted rss without it.
ShapeFinding finding(ShapeKind kind, std::string name, std::string unit, const identify::SeparableModel& model,
                     identify::VariableProjectionOptions options, const Fit& fit, double reference,
                     std::size_t points) {
  options.weights = fit.weights;
  const identify::SeparableFit found = identify::variable_projection(model, options);
  const auto ratio = [&](double rss) { return reference > 0.0 ? std::sqrt(rss / reference) : 1.0; };
  ShapeFinding f;
  f.kind = kind;
  f.name = std::move(name);
  f.unit = std::move(unit);
  f.searched = {options.lower[0], options.upper[0]};
  f.converged = found.end == identify::SearchEnd::converged;
  if (found.end != identify::SearchEnd::failed) {
    f.state = found.state[0];
    f.estimate = found.shape[0];
    f.standard_error = found.standard_error[0];
    f.freedom = found.freedom;
    f.residual_ratio = ratio(found.weighted_rss);
    f.curve.push_back({f.estimate, f.residual_ratio});
  }
  for (const identify::CostPoint& point :
       identify::cost_curve(model, Eigen::VectorXd::Constant(1, f.searched.lower), 0, f.searched.lower,
                            f.searched.upper, points, fit.weights)) {
    f.curve.push_back({point.shape, ratio(point.weighted_rss)});
  }
  std::ranges::stable_sort(f.curve, {}, &ShapePoint::shape);
  return f;
}

// Weighted residual sum of squares of `model` with its shape held at `shape`.
double rss_at(const identify::SeparableModel& model, double shape, const Fit& fit) {
  const Eigen::VectorXd at = Eigen::VectorXd::Constant(1, shape);
  return identify::cost_curve(model, at, 0, shape, shape + 1e-9, 2, fit.weights).front().weighted_rss;
}

// The physically consistent θ nearest to the chosen estimate, in the metric of its covariance. Parameters that are not
// excited stay at zero.
inference::ConstrainedFit nearest_consistent(const Fit& fit,
                                             const std::vector<inference::LinearConstraint>& constraints) {
  const auto p = fit.estimate.size();
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(p, p);
  std::vector<Eigen::Index> in;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (fit.residuals.standard_error[j] > 0.0 && std::isfinite(fit.residuals.standard_error[j])) {
      in.push_back(j);
    }
  }
  if (!in.empty()) {
    const Eigen::MatrixXd covariance = fit.residuals.covariance(in, in);
    const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt();
    const Eigen::MatrixXd correlation =
        scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
    const core::EigenPairs eigen = core::symmetric_eigen(correlation);
    const Eigen::VectorXd lengths = eigen.values.cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    precision(in, in) =
        lengths.asDiagonal() * eigen.vectors.transpose() * Eigen::MatrixXd(scale.cwiseInverse().asDiagonal());
  }
  RegressionBlock rows;
  rows.resize(static_cast<std::size_t>(p), 1, static_cast<std::size_t>(p));
  rows.Y = precision;
  rows.y = precision * fit.estimate;
  identify::LeastSquares metric(static_cast<std::size_t>(p));
  metric.add(rows);
  return inference::constrained_least_squares(metric, constraints, fit.residuals.covariance);
}

void find_shapes(LogSource& log, const Setting& s, const Fit& fit, const IdentificationOptions& options,
                 Identification& result) {
  TorqueRows stream = make_rows(log, s);
  const RegressionBlock rows = read_all(stream);
  const auto look = [&](ShapeKind kind, const char* name, identify::TimeEffect effect, double lower) {
    try {
      const identify::TimeShiftedRows model(rows, effect, lower, options.longest_delay);
      result.shapes.push_back(
          finding(kind, name, "s", model, model.options(), fit, rss_at(model, 0.0, fit), options.curve_points));
    } catch (const InvalidArgument& error) {
      result.notes.push_back(fmt::format("{} was not looked for: {}", name, error.what()));
    }
  };
  look(ShapeKind::delay, "delay", identify::TimeEffect::delay, -options.longest_delay);
  look(ShapeKind::effort_lag, "effort_lag", identify::TimeEffect::effort_lag, 0.0);
  look(ShapeKind::actuator_lag, "actuator_lag", identify::TimeEffect::actuator_lag, 0.0);
  const double fastest = *std::ranges::max_element(s.survey.largest_speed);
  if (fastest > 0.0) {
    const StribeckRows model(log, RegressorFilter(s.model, s.filter, s.measurement));
    identify::VariableProjectionOptions search;
    search.lower = Eigen::VectorXd::Constant(1, kSlowestStribeck * fastest);
    search.upper = Eigen::VectorXd::Constant(1, kFastestStribeck * fastest);
    const char* unit = !model::on_two_wheels(s.robot) ? "m/s or rad/s" : "rad/s";
    result.shapes.push_back(finding(ShapeKind::stribeck_speed, "stribeck_speed", unit, model, search, fit,
                                    fit.squares.weighted_rss, options.curve_points));
  }
}

// Adds wheel speeds where there are angles in their place: the mean speed from the sample before to the one behind.
void add_speeds(LogTable& log) {
  for (const auto& [speed, angle] : {std::pair("omega_r", "phi_r"), std::pair("omega_l", "phi_l")}) {
    if (log.find(speed) != nullptr) {
      continue;
    }
    const std::vector<double>& phi = log.column(angle);
    std::vector<double> omega(log.rows(), 0.0);
    for (std::size_t s = 0; s < log.segment_starts.size(); ++s) {
      const std::size_t first = log.segment_starts[s];
      const std::size_t last = (s + 1 < log.segment_starts.size() ? log.segment_starts[s + 1] : log.rows()) - 1;
      for (std::size_t k = first; k <= last && first < last; ++k) {
        const std::size_t before = std::max(k, first + 1) - 1, behind = std::min(k + 1, last);
        omega[k] = (phi[behind] - phi[before]) / (log.t[behind] - log.t[before]);
      }
    }
    log.names.emplace_back(speed);
    log.columns.push_back(std::move(omega));
  }
}

bool has_effort(const LogSource& log, const Robot& robot, const Model& model) {
  return std::ranges::any_of(model.joints, [&](const model::Joint& joint) {
    return log.find(model::effort_column(joint, robot.effort)).has_value();
  });
}

void calibrate(LogSource& log, const Robot& robot, Identification& result) {
  if (!shows_kinematics(log, robot)) {
    return;
  }
  inference::KinematicOptions options;
  options.wheel_radius = robot.wheel_radius;
  options.track_width = robot.track_width;
  const bool position = log.find("x").has_value() && log.find("y").has_value();
  options.radius = options.axle_offset = position;
  try {
    LogTable table = read_all(log);
    add_speeds(table);
    result.kinematics = inference::calibrate_kinematics(table, options);
  } catch (const InvalidArgument& error) {
    result.notes.push_back(fmt::format("the kinematics were not calibrated: {}", error.what()));
  }
  log.rewind();
}

}  // namespace

bool shows_kinematics(const LogSource& log, const Robot& robot) {
  const auto either = [&](const char* speed, const char* angle) {
    return log.find(speed).has_value() || log.find(angle).has_value();
  };
  return model::on_two_wheels(robot) && log.find("theta") && either("omega_r", "phi_r") && either("omega_l", "phi_l");
}

Identification identify(LogSource& log, const Robot& robot, const IdentificationOptions& options) {
  check::that(options.curve_points >= 2, "curve_points", "at least 2");
  Identification result;
  result.confidence = options.confidence;
  const auto tell = [&](std::string_view stage, double share) {
    if (options.progress) {
      options.progress(stage, share);
    }
  };
  if (const Model model = model::make_model(robot); !has_effort(log, robot, model) && shows_kinematics(log, robot)) {
    tell("kinematics", 0.1);
    result.effort = false;
    result.setting.robot = robot;
    result.setting.model = model;
    result.notes.emplace_back("the log has no efforts: mass, inertia and friction were not looked for");
    calibrate(log, robot, result);
    return result;
  }
  SettingOptions settle_options = options.setting;
  settle_options.progress = options.progress;
  result.setting = settle(log, robot, settle_options);
  const Setting& s = result.setting;
  result.notes = s.notes;

  tell("identifying", 0.25);
  result.fit = fit_log(log, s, Part::everything, kRisk);
  tell("noise of the sensors", 0.4);
  result.noise = find_noise(log, s);

  tell("robust and constrained fits", 0.5);
  const std::vector<inference::LinearConstraint> constraints =
      inference::physical_consistency(quantities(s.model), s.robot.footprint_radius);
  result.constrained = nearest_consistent(result.fit, constraints);
  TorqueRows rows = make_rows(log, s);
  inference::RobustOptions robust;
  robust.constraints = constraints;
  result.robust = inference::robust_fit(rows, robust);

  tell("confidence regions", 0.65);
  const identify::RegressionMoments moments = log_moments(log, s, Part::everything);
  if (!result.fit.choice.candidates.empty() && result.fit.choice.best().usable) {
    inference::RegionOptions regions;
    regions.confidence = options.confidence;
    regions.bootstrap.seed = regions.sign_perturbed.seed = options.seed;
    regions.bootstrap.estimator.weights = regions.sign_perturbed.estimator.weights = result.fit.weights;
    std::vector<bool> excluded;
    for (const identify::ExcitationFinding& finding : result.fit.excitation) {
      excluded.push_back(finding.state == identify::Excitation::not_excited);
    }
    regions.bootstrap.estimator.excluded = regions.sign_perturbed.estimator.excluded = excluded;
    result.regions = inference::compare_regions(moments, result.fit.choice.best(), regions);
  }
  tell("what the log can tell", 0.75);
  result.identifiability = judge(s, result.fit, moments);
  inference::InformationOptions information;
  information.weights = result.fit.weights;
  result.information = inference::information_over_time(moments, information);

  const identify::EstimatorChoice& choice = result.fit.choice;
  const bool noisy =
      choice.in_doubt || choice.predicted_bias.size() == 0 || choice.predicted_bias.cwiseAbs().maxCoeff() > kMostBias;
  if (noisy) {
    result.notes.push_back(
        "the robust fit does without instruments and shares the bias of least squares by noise of the motion");
  }
  if (options.shapes && noisy) {
    result.notes.push_back(
        "delay, lags and Stribeck speed were not looked for: noise of the motion would pass for a lag");
  } else if (options.shapes && s.survey.rows <= options.most_rows) {
    tell("delays and lags", 0.85);
    find_shapes(log, s, result.fit, options, result);
  } else if (options.shapes) {
    result.notes.push_back(
        fmt::format("delay, lags and Stribeck speed were not looked for: the log has {} rows, more than {}",
                    s.survey.rows, options.most_rows));
  }
  tell("kinematics", 0.95);
  calibrate(log, robot, result);
  log.rewind();
  tell("done", 1.0);
  return result;
}

}  // namespace wheelwright::commission
