// SPDX-License-Identifier: Apache-2.0
#include "gap/prepared.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/linear_algebra.hpp"
#include "gap/causes/selection.hpp"
#include "gap/effects/effect.hpp"
#include "gap/noise_floor.hpp"
#include "gap/rows/drive.hpp"
#include "gap/where.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kUsualBeta = 10.0;  // 1/s
constexpr const char* kTiming = "timing";

// The columns that hold the joints' efforts.
std::vector<std::string> effort_columns(const Robot& robot) {
  std::vector<std::string> names;
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.push_back(model::effort_column(joint, robot.effort));
  }
  return names;
}

// A log with a heading and none of the efforts is compared by its pose alone.
bool by_pose_alone(const std::vector<std::string>& columns, const std::vector<std::string>& efforts) {
  const auto logged = [&columns](const std::string& name) { return std::ranges::find(columns, name) != columns.end(); };
  return std::ranges::none_of(efforts, logged) && (logged("theta") || logged("gyro_z"));
}

// Zeros stand for efforts that are not there.
Drive drive_of(const LogTable& log, const TorqueView& view) {
  const Robot& robot = view.robot;
  const Model model = model::make_model(robot);
  const std::vector<std::string> efforts = effort_columns(robot);
  if (!by_pose_alone(log.names, efforts)) {
    TableSource source(log);
    Drive drive = make_drive(log, robot, filter::find_measurement(source, robot, model, 2));
    tell_units(drive, view);
    return drive;
  }
  LogTable padded = log;
  for (const std::string& name : efforts) {
    padded.names.push_back(name);
    padded.columns.emplace_back(log.rows(), 0.0);
  }
  TableSource source(padded);
  Drive drive = make_drive(padded, robot, filter::find_measurement(source, robot, model, 2));
  drive.has_efforts = false;
  tell_units(drive, view);
  return drive;
}

// Nothing is known of efforts that are not there: any number stands for their noise.
NoiseFloor without_efforts(NoiseFloor floor, const Drive& drive) {
  if (!drive.has_efforts) {
    floor.efforts = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(drive.model.n()));
  }
  return floor;
}

std::vector<Effect> chosen_catalogue(const Model& model, const DiagnoseOptions& options) {
  std::vector<Effect> all = options.catalogue ? *options.catalogue : effect_catalogue(model);
  for (const Effect& effect : all) {
    validate(effect);
  }
  for (const std::string& name : options.without) {
    const auto gone = std::remove_if(all.begin(), all.end(), [&](const Effect& e) { return e.name == name; });
    if (gone == all.end()) {
      std::vector<std::string> names;
      std::ranges::transform(all, std::back_inserter(names), &Effect::name);
      throw InvalidArgument(fmt::format("DiagnoseOptions::without: there is no effect called {}; there are {}", name,
                                        fmt::join(names, ", ")));
    }
    all.erase(gone, all.end());
  }
  return all;
}

NoiseFloor floor_of(const std::vector<Eigen::VectorXd>& left, const GapRows& rows) {
  NoiseFloor floor;
  std::vector<double> efforts;
  for (std::size_t s = 0; s < left.size(); ++s) {
    const double rms = core::rms(left[s]);
    const std::string& name = rows.spaces[s].name;
    if (rows.kinds[s] == GapSpace::dynamic) {
      efforts.push_back(rms);
    } else {
      (name == "forward"   ? floor.increments.forward
       : name == "lateral" ? floor.increments.lateral
                           : floor.increments.yaw) = rms;
    }
  }
  floor.efforts = Eigen::Map<const Eigen::VectorXd>(efforts.data(), static_cast<Eigen::Index>(efforts.size()));
  return floor;
}

// The effects of `set` with the coefficients of `fit`.
std::vector<FittedEffect> fitted_effects(const CandidateTable& table, const CauseSet& set, const BlockFit& fit,
                                         const std::vector<Effect>& catalogue) {
  std::vector<FittedEffect> effects;
  auto next = static_cast<Eigen::Index>(table.base.size());
  for (const std::size_t c : set.members) {
    const Candidate& candidate = table.candidates[c];
    FittedEffect effect{catalogue[candidate.effect], candidate.shape, {}};
    if (!candidate.unit_coefficient) {
      effect.coefficients = fit.coefficients.segment(next, static_cast<Eigen::Index>(candidate.columns.size()));
      next += effect.coefficients.size();
    }
    effects.push_back(std::move(effect));
  }
  return effects;
}

// The clocks of effort and speed differ by a little in every log (a command that is held for the sampling step of the
// robot's own controller): an effort that comes later by δ leaves −δ τ̇. δ is fitted to what is `left`, and taken from
// it.
FittedEffect timing_of(const Drive& drive, const GapRows& rows, std::vector<Eigen::VectorXd>& left,
                       const GapRowOptions& options) {
  Effect timing;
  timing.name = kTiming;
  timing.parameters = {{"delay", "s", 0}};
  timing.columns = [](const Drive& d, std::span<const double>) { return std::vector{clock_column(d)}; };
  const std::vector<Eigen::VectorXd> column = rows_of(drive, rows, timing.columns(drive, {}).front(), options);
  double along = 0.0, square = 0.0;
  for (std::size_t s = 0; s < left.size(); ++s) {
    if (column[s].size() > 0) {
      const double weight = 1.0 / std::pow(rows.spaces[s].floor, 2);
      along += weight * column[s].dot(left[s]);
      square += weight * column[s].squaredNorm();
    }
  }
  const double delay = square > 0.0 ? along / square : 0.0;
  for (std::size_t s = 0; s < left.size(); ++s) {
    if (column[s].size() > 0) {
      left[s] -= delay * column[s];
    }
  }
  return {timing, {}, Eigen::VectorXd::Constant(1, delay)};
}

// What the sensors' noise makes of the rows of the log, and its origin in words.
void floor_by_sensors(PreparedGap& prepared) {
  const Drive& drive = prepared.drive;
  prepared.floor = without_efforts(
      noise_floor(drive, signal_noise(drive), prepared.row_options.beta, prepared.row_options.window), drive);
  prepared.floor_origin = "the noise of the sensors, found from the log's own differences";
  const Windows windows = make_windows(drive, prepared.row_options.window);
  const IncrementNoise repeated = repeatability(drive, windows, pose_gap(drive, windows));
  IncrementNoise& increments = prepared.floor.increments;
  if (repeated.yaw > increments.yaw || repeated.forward > increments.forward || repeated.lateral > increments.lateral) {
    increments = {std::max(increments.forward, repeated.forward), std::max(increments.lateral, repeated.lateral),
                  std::max(increments.yaw, repeated.yaw)};
    prepared.floor_origin += "; of the pose also how much it differs where the wheels did the same again";
  }
}

// Root of the sum of squares, channel by channel; channels that one of them lacks have none.
NoiseFloor together(const NoiseFloor& a, const NoiseFloor& b) {
  const auto both = [](double x, double y) { return x > 0.0 && y > 0.0 ? std::hypot(x, y) : 0.0; };
  NoiseFloor sum;
  sum.efforts = (a.efforts.array().square() + b.efforts.array().square()).sqrt();
  sum.increments = {both(a.increments.forward, b.increments.forward), both(a.increments.lateral, b.increments.lateral),
                    both(a.increments.yaw, b.increments.yaw)};
  return sum;
}

// A fit of θ and of effects to the rows of a drive.
struct BaselineFit {
  GapProblem problem;
  Subset subset;
  BlockFit fit;
};

// Columns of effects grow with θ: those of the first fit are of the θ that it corrects. Fits what was found again about
// itself until it stays, so that another drive, whose columns are made of the final θ, finds the same robot. `found`:
// where in the catalogue each of the healthy effects stands.
void settle(PreparedGap& prepared, const std::vector<std::size_t>& found, const NoiseFloor& sensors,
            const BlockOptions& blocks, BaselineFit& last) {
  constexpr int rounds = 30;
  constexpr double enough = 1e-6;  // of each parameter
  Drive& drive = *prepared.healthy_drive;
  for (int round = 0; round < rounds && drive.has_efforts && !prepared.healthy.empty(); ++round) {
    predict_efforts(drive, prepared.theta);
    ShapeGrids shapes(prepared.catalogue.size());
    std::vector<FittedEffect*> fitted(prepared.catalogue.size(), nullptr);
    for (std::size_t k = 0; k < found.size(); ++k) {
      FittedEffect& effect = prepared.healthy[k];
      if (effect.coefficients.size() > 0) {
        shapes[found[k]] = {effect.shape};
        fitted[found[k]] = &effect;
      }
    }
    BaselineFit next{make_problem(drive, sensors, prepared.healthy, std::vector<bool>(drive.model.p(), false),
                                  prepared.catalogue, shapes, prepared.row_options),
                     {},
                     {}};
    const CandidateTable& table = next.problem.table;
    std::vector<std::size_t> all(table.candidates.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    next.subset = subset_of(table, all, BaseModel::refitted);
    const auto effect_of = [&](std::size_t c) { return fitted[table.candidates[c].effect]; };
    // A coefficient may go either way, unless it is at its bound already.
    std::size_t at = table.base.size();
    for (const std::size_t c : all) {
      for (const double value : effect_of(c)->coefficients) {
        int& sign = next.subset.sign[at++];
        sign = value == 0.0 ? sign : 0;
      }
    }
    const BlockGram gram(next.problem.rows.spaces, blocks);
    next.fit = gram.fit(next.subset);
    const auto p = prepared.theta.size();
    double largest = 0.0;
    for (Eigen::Index j = 0; j < p; ++j) {
      largest = std::max(largest, std::abs(next.fit.coefficients[j]) / std::max(std::abs(prepared.theta[j]), 1e-300));
    }
    prepared.theta += next.fit.coefficients.head(p);
    Eigen::Index from = p;
    for (const std::size_t c : all) {
      Eigen::VectorXd& coefficients = effect_of(c)->coefficients;
      coefficients += next.fit.coefficients.segment(from, coefficients.size());
      from += coefficients.size();
    }
    last = std::move(next);
    if (largest < enough) {
      return;
    }
  }
}

// What to write into the robot file, so that a large slip in turns is not left to effects of first order; else empty.
std::string track_hint(const FittedEffect& effect, const Drive& drive) {
  if (!effect.effect.physical) {
    return "";
  }
  const std::vector<double> coefficients(effect.coefficients.begin(), effect.coefficients.end());
  for (const PhysicalValue& value : effect.effect.physical(coefficients, effect.shape)) {
    if (value.name == kTrackInEffect && value.value > 1.02) {
      return fmt::format(
          "; it turns as a track of {0:.3g} m would have it: with `track_width: {0:.3g}` in the robot file, what else "
          "there is shows more sharply",
          value.value * drive.track_width);
    }
  }
  return "";
}

// Effects that beside `found` would take off at least a tenth of what it leaves above the floor, the best two, most
// first.
std::vector<std::string> helping_beside(const CauseSet& found, const CandidateTable& table) {
  constexpr double kHelps = 0.1;
  constexpr std::size_t kMost = 2;
  const double left = found.held_out_error - 1.0;
  const std::vector<std::string> has = names_of(table, found);
  std::map<std::string, double> taken;
  for (std::size_t c = 0; c < table.candidates.size() && left > 0.0; ++c) {
    const std::string& name = table.names[table.candidates[c].effect];
    if (std::ranges::find(has, name) != has.end()) {
      continue;
    }
    std::vector<std::size_t> members = found.members;
    members.push_back(c);
    std::ranges::sort(members);
    const double share =
        (found.held_out_error - evaluate(table, std::move(members), BaseModel::refitted).held_out_error) / left;
    if (share > kHelps) {
      taken[name] = std::max(taken[name], share);
    }
  }
  std::vector<std::string> names;
  while (names.size() < kMost && !taken.empty()) {
    const auto best = std::ranges::max_element(taken, {}, &std::pair<const std::string, double>::second);
    names.push_back(best->first);
    taken.erase(best);
  }
  return names;
}

// What the model leaves of the healthy robot's efforts, if that is more than 5 % of their mean square beyond the noise
// of the sensors: `left` and the floor that `sensors` make, by space of `rows`.
std::optional<HealthyMisfit> misfit_of(const Drive& drive, const GapRows& rows,
                                       const std::vector<Eigen::VectorXd>& left, const NoiseFloor& sensors,
                                       double beta) {
  constexpr double kFits = 0.05;
  double beyond = 0.0, signal = 0.0, largest = 0.0;
  std::size_t channel = 0;
  for (std::size_t s = 0; s < drive.model.n() && drive.has_efforts; ++s) {
    const auto i = static_cast<Eigen::Index>(s);
    // Outputs are sums over the joints: by their weights there all are squares of the joints' efforts.
    const double weight = 1.0 / drive.model.input.row(i).squaredNorm();
    const auto count = static_cast<double>(left[s].size());
    const double own = weight * (left[s].squaredNorm() / count - std::pow(sensors.efforts[i], 2));
    beyond += std::max(own, 0.0);
    signal += weight * rows.signal[s].squaredNorm() / count;
    if (own > largest) {
      largest = own;
      channel = s;
    }
  }
  if (!(beyond > kFits * signal)) {
    return std::nullopt;
  }
  HealthyMisfit misfit{drive.model.outputs[channel], beyond / signal, {}, {}, {}};
  const RowSpace& space = rows.spaces[channel];
  ResidualSeries series;
  series.channel = space.name;
  series.t = space.t;
  series.signal = rows.signal[channel];
  series.nominal = series.refitted = series.after = left[channel];
  series.floor = sensors.efforts[static_cast<Eigen::Index>(channel)];
  WhereOptions where;
  where.beta = beta;
  for (const GapShare& share : locate_gap(drive, {series}, where)) {
    if (misfit.regime.empty() && share.kind != "channel" && share.kind != "time" && is_finding(share)) {
      misfit.regime = share.regime;
    }
  }
  return misfit;
}

// Whether an effect that robots have as they are built is fitted by this candidate: of effects of one wheel or of both
// with opposite signs by the latter, whose mean is θ's.
bool is_as_built(const Candidate& candidate, const Effect& effect) {
  return effect.as_built && !effect.free_form && (effect.shapes.empty() || candidate.shape == std::vector{2.0});
}

// `set` with those effects that robots have as they are built that the log tells from nothing: of three standard errors
// or more beside all others, which of three effects that are not there one is on one log in fifty (Student's t of 24
// blocks). Another drive would make more of an error than this one.
CauseSet with_as_built(const CauseSet& set, const CandidateTable& table, const std::vector<Effect>& catalogue) {
  constexpr double kTold = 3.0;
  std::vector<std::size_t> members = set.members, added;
  const auto has = [&](const Effect& effect) {
    return std::ranges::any_of(set.members, [&](std::size_t c) {
      const Effect& member = catalogue[table.candidates[c].effect];
      return member.name == effect.name || std::ranges::find(member.stands_for, effect.name) != member.stands_for.end();
    });
  };
  for (std::size_t c = 0; c < table.candidates.size(); ++c) {
    const Effect& effect = catalogue[table.candidates[c].effect];
    if (is_as_built(table.candidates[c], effect) && !has(effect)) {
      added.push_back(c);
    }
  }
  while (!added.empty()) {
    std::vector<std::size_t> all = members;
    all.insert(all.end(), added.begin(), added.end());
    std::ranges::sort(all);
    const Subset subset = subset_of(table, all, BaseModel::refitted);
    const BlockFit fit = table.gram->fit(subset);
    const auto times_its_error = [&](std::size_t c) {
      const auto at = std::ranges::find(subset.columns, table.candidates[c].columns.front()) - subset.columns.begin();
      const double variance = fit.covariance(at, at);
      return variance > 0.0 ? std::abs(fit.coefficients[at]) / std::sqrt(variance) : 0.0;
    };
    const auto least = std::ranges::min_element(added, {}, times_its_error);
    if (times_its_error(*least) >= kTold) {
      return evaluate(table, std::move(all), BaseModel::refitted);
    }
    added.erase(least);
  }
  return set;
}

// θ, floor and effects of the healthy robot, or of the simulator.
void learn_healthy(PreparedGap& prepared, const DiagnoseOptions& options) {
  Drive& drive = *prepared.healthy_drive;
  const double beta = prepared.row_options.beta;
  const bool simulated = prepared.reference == GapReference::simulator;
  prepared.theta = fit_base(drive, beta);
  predict_efforts(drive, prepared.theta);
  NoiseFloor sensors =
      without_efforts(noise_floor(drive, signal_noise(drive), beta, prepared.row_options.window), drive);
  if (simulated) {
    // What the simulator has below the noise of the robot's sensors is nothing to them.
    predict_efforts(prepared.drive, prepared.theta);
    floor_by_sensors(prepared);
    sensors = together(sensors, prepared.floor);
  }
  draw_effort_noise(drive, signal_noise(drive), sensors, beta, options.seed);
  GapProblem problem = make_problem(drive, sensors, {}, std::vector<bool>(drive.model.p(), false), prepared.catalogue,
                                    all_shapes(prepared.catalogue, drive), prepared.row_options);
  BlockOptions blocks = options.blocks;
  blocks.threads = options.threads;
  const BlockGram gram(problem.rows.spaces, blocks);
  problem.table.gram = &gram;
  problem.table.spaces = &problem.rows.spaces;
  SelectionOptions selection = options.selection;
  selection.threads = options.threads;
  const Selection found = select_causes(problem.table, problem.kinds, false, 1.0, selection);
  const CauseSet own =
      simulated ? found.structural : with_as_built(found.structural, problem.table, prepared.catalogue);
  const Subset subset = subset_of(problem.table, own.members, BaseModel::refitted);
  const BlockFit fit = gram.fit(subset);
  prepared.theta += fit.coefficients.head(prepared.theta.size());
  prepared.healthy = fitted_effects(problem.table, own, fit, prepared.catalogue);
  std::vector<std::size_t> places;
  for (const std::size_t c : own.members) {
    places.push_back(problem.table.candidates[c].effect);
  }
  constexpr double kFarAbove = 4.0;  // floors
  const std::vector<std::string> helping =
      fit.held_out_error > kFarAbove ? helping_beside(own, problem.table) : std::vector<std::string>();
  BaselineFit last{std::move(problem), subset, fit};
  for (JointSignals& joint : drive.joints) {
    joint.effort_noise.resize(0);  // the floor is what is left, whatever the effects took of the noise
  }
  settle(prepared, places, sensors, blocks, last);
  std::vector<Eigen::VectorXd> left = residuals(last.problem.rows, last.subset, last.fit.coefficients);
  const FittedEffect timing = timing_of(drive, last.problem.rows, left, prepared.row_options);
  // Held out, as the errors of other logs are that are measured by it.
  const double held_out = std::sqrt(std::max(last.fit.held_out_error / std::max(last.fit.mean_square, 1e-300), 1.0));
  for (Eigen::VectorXd& rows : left) {
    rows *= held_out;
  }
  const NoiseFloor floor = without_efforts(floor_of(left, last.problem.rows), drive);
  if (!simulated) {
    prepared.misfit = misfit_of(drive, last.problem.rows, left, sensors, beta);
  }
  if (prepared.misfit) {
    prepared.misfit->helping = helping;
    for (const FittedEffect& effect : prepared.healthy) {
      prepared.misfit->known.push_back(effect.effect.name);
    }
  }
  for (const FittedEffect& effect : prepared.healthy) {
    prepared.notes.push_back((simulated ? "the simulator has " : "the healthy log shows ") + effect.effect.name +
                             " already: what is reported is in addition to it" + track_hint(effect, drive));
  }
  if (simulated) {
    prepared.floor = together(floor, prepared.floor);
    prepared.floor_origin += ", and what the model leaves of the simulator's log";
    return;
  }
  prepared.healthy.push_back(timing);
  prepared.floor = floor;
  prepared.floor_origin = "what the model leaves of the healthy log";
}

}  // namespace

Eigen::VectorXd fit_base(const Drive& drive, double beta) {
  if (!drive.has_efforts) {
    return Eigen::VectorXd::Zero(static_cast<Eigen::Index>(drive.model.p()));
  }
  const std::vector<Eigen::VectorXd> y = filtered_outputs(drive, beta);
  const std::vector<std::vector<Eigen::VectorXd>> Y = filtered_regressor(drive, beta);
  const Mask use = settled(drive, beta) && moving(drive, beta);
  const auto n = static_cast<Eigen::Index>(drive.model.n());
  const auto p = static_cast<Eigen::Index>(drive.model.p());
  const Eigen::Index instants = use.count();
  if (instants < 10 * p) {
    throw InputError("the log has " + std::to_string(instants) + " instants in motion after the filter has settled: " +
                     std::to_string(10 * p) + " are needed; " + why_few_rows(drive, beta));
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(instants * n, p);
  Eigen::VectorXd b(instants * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::Index row = i * instants;
    for (Eigen::Index k = 0; k < drive.rows(); ++k) {
      if (!use[k]) {
        continue;
      }
      b[row] = y[static_cast<std::size_t>(i)][k];
      for (Eigen::Index j = 0; j < p; ++j) {
        const Eigen::VectorXd& column = Y[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
        if (column.size() > 0) {
          A(row, j) = column[k];
        }
      }
      ++row;
    }
  }
  Eigen::VectorXd theta = A.colPivHouseholderQr().solve(b);
  const Eigen::VectorXd left = b - A * theta;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double weight =
        1.0 / std::max(left.segment(i * instants, instants).norm(), 1e-12 * b.segment(i * instants, instants).norm());
    if (std::isfinite(weight)) {
      A.middleRows(i * instants, instants) *= weight;
      b.segment(i * instants, instants) *= weight;
    }
  }
  theta = A.colPivHouseholderQr().solve(b);
  return theta;
}

GapProblem make_problem(const Drive& drive, const NoiseFloor& floor, const std::vector<FittedEffect>& healthy,
                        const std::vector<bool>& trusted, const std::vector<Effect>& catalogue,
                        const ShapeGrids& shapes, const GapRowOptions& options) {
  GapProblem problem;
  problem.rows = make_gap_rows(drive, floor, healthy, options);
  problem.table = add_catalogue(problem.rows, drive, catalogue, shapes, options);
  for (std::size_t j = 0; j < trusted.size(); ++j) {
    if (!trusted[j]) {
      problem.table.unknown.push_back(j);
    }
  }
  for (std::size_t j = 0; j < drive.model.p(); ++j) {
    const double nominal = drive.theta[static_cast<Eigen::Index>(j)];
    const bool of_acceleration = std::ranges::any_of(drive.model.terms, [j](const Term& term) {
      return term.parameter == j && term.kind == Term::Kind::acceleration;
    });
    if (of_acceleration && nominal > 0.0) {
      problem.table.inertias.emplace_back(j, nominal);
    }
  }
  const bool pose = std::ranges::find(problem.rows.kinds, GapSpace::kinematic) != problem.rows.kinds.end();
  for (const Effect& effect : catalogue) {
    problem.table.free_form.push_back(effect.free_form);
    EffectKind kind{effect.inexact, {}, effect.parametric, !pose && effect.measured_by == DirectMeasurement::lengths};
    for (std::size_t e = 0; e < catalogue.size(); ++e) {
      if (std::ranges::find(effect.stands_for, catalogue[e].name) != effect.stands_for.end()) {
        kind.stands_for.push_back(e);
      }
    }
    problem.kinds.push_back(std::move(kind));
  }
  return problem;
}

Column clock_column(const Drive& drive) {
  Column column;
  column.effort_rate.resize(drive.model.n());
  for (std::size_t i = 0; i < drive.model.n(); ++i) {
    column.effort_rate[i] = Eigen::VectorXd::Zero(drive.rows());
    for (std::size_t j = 0; j < drive.joints.size(); ++j) {
      column.effort_rate[i] += drive.model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *
                               drive.joints[j].predicted_effort;
    }
  }
  return column;
}

std::vector<FittedEffect> robots_own(const std::vector<FittedEffect>& healthy) {
  std::vector<FittedEffect> own = healthy;
  std::erase_if(own, [](const FittedEffect& effect) { return effect.effect.name == kTiming; });
  return own;
}

void expect_efforts(Drive& drive, const Eigen::VectorXd& theta, const std::vector<FittedEffect>& causes) {
  const Eigen::MatrixXd inverse = core::inverse(drive.model.input);
  Eigen::MatrixXd outputs = Eigen::MatrixXd::Zero(drive.rows(), static_cast<Eigen::Index>(drive.model.n()));
  for (const FittedEffect& cause : causes) {
    if (cause.effect.unit_coefficient) {
      continue;
    }
    const std::vector<Column> columns = cause.effect.columns(drive, cause.shape);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double factor = cause.coefficients[static_cast<Eigen::Index>(c)];
      for (std::size_t i = 0; i < columns[c].effort.size(); ++i) {
        if (columns[c].effort[i].size() > 0) {
          outputs.col(static_cast<Eigen::Index>(i)) += factor * columns[c].effort[i];
        }
      }
    }
  }
  const Eigen::VectorXd nominal = drive.theta;
  predict_efforts(drive, theta);
  std::vector<Eigen::VectorXd> expected;
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    expected.emplace_back(drive.joints[j].predicted_effort +
                          outputs * inverse.row(static_cast<Eigen::Index>(j)).transpose());
  }
  predict_efforts(drive, nominal);
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    drive.joints[j].expected_effort = std::move(expected[j]);
  }
}

void expect_efforts(PreparedGap& prepared, const GapProblem& problem, const CauseSet& set) {
  Drive& drive = prepared.drive;
  const BlockFit fit = problem.table.gram->fit(subset_of(problem.table, set.members, BaseModel::refitted));
  expect_efforts(drive, drive.theta + fit.coefficients.head(drive.theta.size()),
                 fitted_effects(problem.table, set, fit, prepared.catalogue));
}

std::vector<Eigen::VectorXd> residuals(const GapRows& rows, const Subset& subset, const Eigen::VectorXd& coefficients) {
  std::vector<Eigen::VectorXd> left;
  for (const RowSpace& space : rows.spaces) {
    left.push_back(residual(space, subset, coefficients));
  }
  return left;
}

std::vector<std::string> required_columns(const LogSource& log, const Robot& robot) {
  std::vector<std::string> names;
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.push_back(joint.speed + "|" + joint.angle);
  }
  const std::vector<std::string> efforts = effort_columns(robot);
  if (!by_pose_alone(log.columns(), efforts)) {
    names.insert(names.end(), efforts.begin(), efforts.end());
  }
  return names;
}

PreparedGap prepare_gap(LogSource& log, LogSource* baseline, const Robot& robot, const DiagnoseOptions& options) {
  PreparedGap prepared;
  prepared.view = in_torques(robot);
  prepared.log = read_all(log);
  to_torques(prepared.log, prepared.view);
  prepared.drive = drive_of(prepared.log, prepared.view);
  const Model& model = prepared.drive.model;
  prepared.catalogue = chosen_catalogue(model, options);
  prepared.row_options.window = options.window;
  prepared.row_options.threads = options.threads;
  if (baseline != nullptr) {
    prepared.baseline_log = read_all(*baseline);
    to_torques(*prepared.baseline_log, prepared.view);
    prepared.healthy_drive = drive_of(*prepared.baseline_log, prepared.view);
    prepared.reference = options.baseline_simulated ? GapReference::simulator : GapReference::healthy_log;
  }
  if (!prepared.drive.has_efforts) {
    prepared.notes.push_back(
        "the log has no efforts: only its pose is compared with what the wheels say, and effects that change the "
        "torque "
        "alone cannot be seen; log " +
        effort_columns(robot).front() + " and its like to see them");
    if (prepared.healthy_drive && prepared.healthy_drive->has_efforts) {
      throw InputError(
          fmt::format("the {} log has efforts and the other one has none: log them in both, or leave them out",
                      prepared.reference == GapReference::simulator ? "simulator's" : "healthy"));
    }
  }
  // The filter is for the noise of the robot's sensors.
  const Drive& noisy = prepared.reference == GapReference::healthy_log ? *prepared.healthy_drive : prepared.drive;
  const double wish = options.beta ? *options.beta : kUsualBeta;
  prepared.row_options.beta = options.beta ? *options.beta : choose_gap_beta(noisy, signal_noise(noisy), wish);
  const auto draw_noise = [&] {
    draw_effort_noise(prepared.drive, signal_noise(prepared.drive), prepared.floor, prepared.row_options.beta,
                      options.seed);
  };
  if (prepared.healthy_drive) {
    learn_healthy(prepared, options);
    prepared.trusted.assign(model.p(), true);
    predict_efforts(prepared.drive, prepared.theta);
    draw_noise();
    return prepared;
  }
  prepared.theta = fit_base(prepared.drive, prepared.row_options.beta);
  prepared.trusted.assign(model.p(), false);
  for (std::size_t j = 0; j < model.p(); ++j) {
    const auto nominal = prepared.view.robot.nominal.find(model.parameters[j].physical);
    if (nominal != prepared.view.robot.nominal.end()) {
      prepared.theta[static_cast<Eigen::Index>(j)] = nominal->second * model.parameters[j].per_physical;
      prepared.trusted[j] = true;
    }
  }
  predict_efforts(prepared.drive, prepared.theta);
  floor_by_sensors(prepared);
  draw_noise();
  return prepared;
}

}  // namespace wheelwright::gap
