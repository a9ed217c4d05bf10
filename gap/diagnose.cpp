// SPDX-License-Identifier: Apache-2.0
#include "gap/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/words.hpp"
#include "gap/causes/answers.hpp"
#include "gap/causes/confidence.hpp"
#include "gap/causes/confusion.hpp"
#include "gap/causes/estimates.hpp"
#include "gap/causes/fast_band.hpp"
#include "gap/causes/selection.hpp"
#include "gap/causes/visibility.hpp"
#include "gap/effort_units.hpp"
#include "gap/improved_robot.hpp"
#include "gap/next/further_drive.hpp"
#include "gap/prepared.hpp"
#include "gap/regimes.hpp"
#include "gap/rollout.hpp"
#include "gap/rows/drive.hpp"
#include "gap/shrink.hpp"
#include "gap/where.hpp"

namespace wheelwright::gap {
namespace {

constexpr std::size_t kShownOfEachSize = 8;
constexpr double kWidePrior = 1e6;  // times the nominal value: a side of the prior that nobody gave

GapVerdict verdict_of(const Selection& found, std::size_t alternatives) {
  if (!found.reaches_floor || found.theta_moved) {
    return GapVerdict::unexplained;
  }
  if (!found.any_cause) {
    return GapVerdict::no_gap;
  }
  return alternatives > 1 ? GapVerdict::ambiguous : GapVerdict::explained;
}

bool are_listed(const std::vector<CredibleCauses>& credible, const std::vector<std::string>& effects) {
  return std::ranges::any_of(
      credible, [&](const CredibleCauses& other) { return std::ranges::is_permutation(other.effects, effects); });
}

// Leaves out what does as well with one of its causes steady in time, but for the best.
void leave_out_unsteady(std::vector<CredibleCauses>& credible, const std::vector<Effect>& catalogue) {
  const auto needless = [&](const CredibleCauses& set) {
    for (std::size_t k = 0; k < set.effects.size(); ++k) {
      std::vector<std::string> effects = set.effects;
      for (const std::string& steady : std::ranges::find(catalogue, set.effects[k], &Effect::name)->steady) {
        effects[k] = steady;
        if (are_listed(credible, effects)) {
          return true;
        }
      }
    }
    return false;
  };
  std::vector<CredibleCauses> kept;
  for (const CredibleCauses& set : credible) {
    if (kept.empty() || !needless(set)) {
      kept.push_back(set);
    }
  }
  credible = std::move(kept);
}

// Reported causes whose share of the gap, with that of their common part, is nothing in two decimals.
std::vector<std::string> trifles_of(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                    const CredibleSet& member) {
  const auto name_of = [&](std::size_t c) { return table.names[table.candidates[c].effect]; };
  std::vector<std::string> trifles = reported_names(table, catalogue, member.set);
  for (const std::size_t c : member.principal) {
    std::erase_if(trifles, [&](const std::string& name) {
      return name == name_of(c) || find_effect(catalogue, name)->common == name_of(c);
    });
  }
  return trifles;
}

// Returns the number of answers among them.
std::size_t list_credible(Diagnosis& result, const Selection& found, const CandidateTable& table,
                          const std::vector<Effect>& catalogue) {
  for (const CredibleSet& member : found.credible) {
    CredibleCauses causes{reported_names(table, catalogue, member.set), member.set.held_out_error, member.p_value};
    causes.trifles = trifles_of(table, catalogue, member);
    if (!are_listed(result.credible, causes.effects)) {
      result.credible.push_back(std::move(causes));
    }
  }
  leave_out_unsteady(result.credible, catalogue);
  return number_answers(result.credible, catalogue);
}

// What was left out of the causes since their share of the gap is nothing and the log does not tell between them.
void tell_trifles(Diagnosis& result, const Selection& found, const CandidateTable& table,
                  const std::vector<Effect>& catalogue) {
  std::vector<std::string> names;
  for (const CredibleSet& member : found.trifles) {
    for (std::string& name : trifles_of(table, catalogue, member)) {
      if (std::ranges::find(names, name) == names.end()) {
        names.push_back(std::move(name));
      }
    }
  }
  if (!names.empty()) {
    result.notes.push_back("less than half a per cent of the gap may be " + core::listed(names, " or ") +
                           ": this log does not tell between them, and they are left out");
  }
}

void list_looked_at(Diagnosis& result, const Selection& found, const CandidateTable& table) {
  std::size_t of_this_size = 0;
  for (std::size_t k = 0; k < found.looked_at.size(); ++k) {
    const CauseSet& set = found.looked_at[k];
    of_this_size = k > 0 && set.members.size() == found.looked_at[k - 1].members.size() ? of_this_size + 1 : 0;
    if (of_this_size < kShownOfEachSize) {
      result.looked_at.push_back({names_of(table, set), set.held_out_error, 0.0});
    }
  }
}

void list_causes(Diagnosis& result, const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set,
                 const FittedCauses& fitted, const std::vector<double>& shares) {
  const std::vector<bool> shown = reported(problem.table, prepared.catalogue, set);
  for (std::size_t k = 0; k < set.members.size(); ++k) {
    if (!shown[k]) {
      continue;
    }
    const Effect& effect = prepared.catalogue[problem.table.candidates[set.members[k]].effect];
    GapCause cause{effect.name, effect.sentence, effect.parametric, fitted.numbers[k], shares[k]};
    for (std::size_t other = 0; other < set.members.size(); ++other) {
      if (effect.common == problem.table.names[problem.table.candidates[set.members[other]].effect]) {
        cause.share += shares[other];
      }
    }
    result.causes.push_back(std::move(cause));
  }
  std::stable_sort(result.causes.begin(), result.causes.end(),
                   [](const GapCause& a, const GapCause& b) { return a.share > b.share; });
}

// What cannot be negative is not told as negative.
void leave_out_impossible(Diagnosis& result, const Model& model) {
  std::vector<std::string> names;
  for (std::size_t j = 0; j < result.parametric.size(); ++j) {
    ParameterShift& shift = result.parametric[j];
    if (model.parameters[j].prior.lower < 0.0) {
      continue;
    }
    if (!(shift.without_causes > 0.0)) {
      shift.without_causes = std::numeric_limits<double>::quiet_NaN();
    }
    shift.lower = std::max(shift.lower, 0.0);
    shift.upper = std::max(shift.upper, 0.0);
    if (!(shift.estimate > 0.0)) {
      shift.estimate = std::numeric_limits<double>::quiet_NaN();
      names.push_back(shift.parameter);
    }
  }
  if (!names.empty()) {
    result.notes.push_back(fmt::format(
        "this log does not tell {} from 0: drive with more of what {} (accelerations, turns, speeds), and have "
        "`wheelwright doctor` look at the efforts' signs, units and delay",
        core::enumerated(names), names.size() == 1 ? "it acts on" : "they act on"));
  }
}

// Shares of a gap that is smaller than what its causes, which act against each other, explain.
std::vector<double> shares_of_one(std::vector<double> shares) {
  double sum = 0.0;
  for (double& share : shares) {
    share = std::max(share, 0.0);
    sum += share;
  }
  for (double& share : shares) {
    share /= std::max(sum, 1.0);
  }
  return shares;
}

// Efforts without their sign, of which the model explains too little to say where the motors braked: nothing that was
// fitted to them holds.
bool braking_unknown(const Drive& drive, const std::vector<ResidualSeries>& series) {
  constexpr double kTellsEnough = 0.1;  // of the efforts' mean square: what may be left
  return drive.efforts_unsigned && std::ranges::any_of(series, [](const ResidualSeries& s) {
           return s.space == GapSpace::dynamic && s.refitted.squaredNorm() > kTellsEnough * s.signal.squaredNorm();
         });
}

void withdraw_causes(Diagnosis& result) {
  result.verdict = GapVerdict::unexplained;
  result.causes.clear();
  result.credible.clear();
  result.fitted.clear();
  result.improved.reset();
  result.shrink = {};
  result.parametric.clear();
  result.remaining = 1.0;
  result.notes.push_back(
      "only the size of the efforts is logged, and the model explains too little of it to say when the motors braked: "
      "no cause can be told from a wrong sign; log the efforts with their sign, or leave them out and log a pose");
}

// Whether some channel of some space is above its floor, though all together are not: by the largest mean square.
bool some_channel_above(const std::vector<ResidualSeries>& series, double tolerated) {
  return std::ranges::any_of(series, [tolerated](const ResidualSeries& s) {
    return s.after.size() > 0 && s.floor > 0.0 &&
           s.after.squaredNorm() > (1.0 + tolerated) * s.floor * s.floor * static_cast<double>(s.after.size());
  });
}

// What the band above the filter's adds to the verdict: play, or that there is a gap.
void add_fast_band(Diagnosis& result, const FastBand& fast, const std::vector<Effect>& catalogue) {
  const auto play = std::ranges::find(catalogue, true, &Effect::above_band);
  // What acts at the same instants is known no sharper than its column has it.
  const bool known = std::ranges::any_of(result.causes, [&](const GapCause& cause) {
    const Effect* const effect = find_effect(catalogue, cause.effect);
    return effect != nullptr && effect->after_reversals;
  });
  const auto has_play = [&](const CredibleCauses& set) {
    return std::ranges::find(set.effects, play->name) != set.effects.end();
  };
  const double left = result.remaining * result.gap;
  if (fast.play && play != catalogue.end() && !known) {
    GapCause cause{play->name, play->sentence, play->parametric, {}, 0.0};
    const double whole = result.gap + fast.effort_square;
    for (GapCause& other : result.causes) {
      other.share *= whole > 0.0 ? result.gap / whole : 0.0;
    }
    cause.share = whole > 0.0 ? fast.effort_square / whole : 0.0;
    if (result.verdict == GapVerdict::no_gap) {
      result.verdict = GapVerdict::explained;
      cause.share = 1.0;
    }
    result.remaining *= whole > 0.0 ? result.gap / whole : 1.0;
    result.structural += fast.effort_square;
    result.gap = whole;
    result.causes.push_back(std::move(cause));
    std::stable_sort(result.causes.begin(), result.causes.end(),
                     [](const GapCause& a, const GapCause& b) { return a.share > b.share; });
    if (result.credible.empty()) {
      result.credible.push_back({{}, 1.0, 1.0});
    }
    for (CredibleCauses& set : result.credible) {
      if (!has_play(set)) {
        set.effects.push_back(play->name);
      }
    }
    result.notes.push_back(fmt::format(
        "between {:.0f} and {:.0f} 1/s, above the filter's band, the mean square of what the model leaves is {:.2f} "
        "times the healthy log's just after reversals of the torque and {:.2f} times elsewhere, while it changes as "
        "fast: play. How wide it is cannot be said without the rotor's inertia",
        result.beta, fast.beta, fast.after_reversals, fast.elsewhere));
  } else if (fast.above && result.verdict == GapVerdict::no_gap) {
    result.verdict = GapVerdict::unexplained;
    result.notes.push_back(fmt::format(
        "between {:.0f} and {:.0f} 1/s, above the filter's band, the model leaves {:.2f} times the healthy log's mean "
        "square, and not only after reversals of the torque: something fast that no cause here explains",
        result.beta, fast.beta, fast.left));
  }
  if (fast.play && play != catalogue.end() && result.verdict == GapVerdict::unexplained && left <= fast.effort_square &&
      !result.credible.empty() && has_play(result.credible.front())) {
    std::erase_if(result.credible, [&](const CredibleCauses& set) { return !has_play(set); });
    result.verdict = number_answers(result.credible, catalogue) > 1 ? GapVerdict::ambiguous : GapVerdict::explained;
    result.notes.push_back(
        fmt::format("{:.0f} % of the gap stay below that band, no more than what play adds in it: they are taken for "
                    "what its contact does there, which no formula here has",
                    100.0 * result.remaining));
  }
}

std::string unit_of(const PreparedGap& prepared, const GapRows& rows, std::size_t space) {
  if (rows.kinds[space] == GapSpace::dynamic) {
    return prepared.drive.model.output_units[space];
  }
  return rows.spaces[space].name == "yaw" ? "rad" : "m";
}

std::vector<ResidualSeries> series_of(const PreparedGap& prepared, const GapProblem& problem,
                                      const FittedCauses& fitted) {
  const BlockGram& gram = *problem.table.gram;
  const Subset refit = subset_of(problem.table, {}, BaseModel::refitted);
  const std::vector<Eigen::VectorXd> refitted = residuals(problem.rows, refit, gram.fit(refit).coefficients);
  const std::vector<Eigen::VectorXd> after = residuals(problem.rows, fitted.subset, fitted.coefficients);
  std::vector<ResidualSeries> all;
  for (std::size_t s = 0; s < problem.rows.spaces.size(); ++s) {
    const RowSpace& space = problem.rows.spaces[s];
    ResidualSeries series;
    series.space = problem.rows.kinds[s];
    series.channel = space.name;
    series.unit = unit_of(prepared, problem.rows, s);
    series.t = space.t;
    series.signal = problem.rows.signal[s];
    series.nominal = space.response;
    series.refitted = refitted[s];
    series.after = after[s];
    series.floor = space.floor;
    all.push_back(std::move(series));
  }
  return all;
}

// The prior box of θ with finite sides.
Box finite_prior(const Robot& robot, const PreparedGap& prepared) {
  const model::PriorBox prior = model::prior_box(robot, prepared.drive.model);
  Box box;
  for (std::size_t j = 0; j < prior.bounds.size(); ++j) {
    const double wide = kWidePrior * std::max(std::abs(prepared.theta[static_cast<Eigen::Index>(j)]), 1e-6);
    box.sides.push_back({std::max(prior.bounds[j].lower, -wide), std::min(prior.bounds[j].upper, wide)});
  }
  return box;
}

// Mean square of the efforts in units of the floors, or of the pose's increments where there are no efforts: what
// shares of the gap are shares of.
double signal_square(const GapProblem& problem, bool efforts) {
  double sum = 0.0, rows = 0.0;
  for (std::size_t s = 0; s < problem.rows.spaces.size(); ++s) {
    rows += static_cast<double>(problem.rows.spaces[s].t.size());
    if (problem.rows.kinds[s] == GapSpace::dynamic || !efforts) {
      sum += problem.rows.signal[s].squaredNorm() / std::pow(problem.rows.spaces[s].floor, 2);
    }
  }
  return sum / rows;
}

}  // namespace

Diagnosis diagnose(LogSource& log, LogSource* baseline, const Robot& robot, const DiagnoseOptions& options) {
  const auto tell = [&options](std::string_view stage, double share) {
    if (options.progress) {
      options.progress(stage, share);
    }
  };
  tell("reading", 0.0);
  PreparedGap prepared = prepare_gap(log, baseline, robot, options);
  BlockOptions blocks = options.blocks;
  blocks.threads = options.threads;
  SelectionOptions selection = options.selection;
  selection.threads = options.threads;
  selection.seed = options.seed;
  if (prepared.reference != GapReference::healthy_log) {
    selection.tolerated_floor = std::max(selection.tolerated_floor, options.sensor_floor);
  }
  const Robot& seen = prepared.view.robot;
  const bool trusted = std::any_of(prepared.trusted.begin(), prepared.trusted.end(), [](bool t) { return t; });
  const auto problem_with = [&](const ShapeGrids& shapes) {
    return make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted, prepared.catalogue, shapes,
                        prepared.row_options);
  };
  tell("trying every effect", 0.2);
  const ShapeGrids coarse = all_shapes(prepared.catalogue, prepared.drive);
  GapProblem problem = problem_with(coarse);
  {
    const BlockGram gram(problem.rows.spaces, blocks);
    problem.table.gram = &gram;
    problem.table.spaces = &problem.rows.spaces;
    const Selection first = select_causes(problem.table, problem.kinds, trusted, 1.0, selection);
    ShapeGrids finer = finer_shapes(prepared.catalogue, coarse, problem.table, first.looked_at);
    TuneOptions tune;
    tune.seed = options.seed;
    tune.threads = options.threads;
    add_tuned_shapes(finer, prepared, problem, first.looked_at, tune);
    if (trusted) {
      add_shapes_with_theta_held(finer, prepared, problem, first.structural);
    }
    expect_efforts(prepared, problem, first.structural);
    problem = problem_with(finer);
  }
  tell("comparing combinations", 0.4);
  const BlockGram gram(problem.rows.spaces, blocks);
  problem.table.gram = &gram;
  problem.table.spaces = &problem.rows.spaces;
  const Selection found = select_causes(problem.table, problem.kinds, trusted, 1.0, selection);

  Diagnosis result;
  const std::size_t answers = list_credible(result, found, problem.table, prepared.catalogue);
  list_looked_at(result, found, problem.table);
  result.verdict = verdict_of(found, answers);
  result.beta = prepared.row_options.beta;
  result.floor_origin = prepared.floor_origin;
  result.reference = prepared.reference;
  result.floor_error =
      prepared.reference == GapReference::healthy_log ? 0.0 : std::sqrt(1.0 + options.sensor_floor) - 1.0;
  result.notes = prepared.notes;
  if (!found.enough_time) {
    result.notes.push_back(
        "the log is too short for any cause to stand out from chance: drive longer, or look for fewer effects");
  }
  const double square = signal_square(problem, prepared.drive.has_efforts);
  result.gap = std::max(found.nominal_excess, 0.0) / square;
  result.structural = std::max(found.refitted_excess, 0.0) / square;
  const double whole = std::max(found.nominal_excess, found.refitted_excess);
  result.remaining = whole > 0.0 ? std::clamp(found.left / whole, 0.0, 1.0) : 0.0;

  tell("estimating", 0.55);
  const BaseModel base = found.base;
  const FittedCauses fitted = fit_causes(prepared, problem, found.all, base, blocks);
  list_causes(result, prepared, problem, found.all, fitted,
              shares_of_one(
                  shapley_shares(problem.table, found.all, trusted ? BaseModel::nominal : BaseModel::refitted, whole)));
  add_laws(result, found, prepared, problem, base, blocks);
  tell_trifles(result, found, problem.table, prepared.catalogue);
  result.series = series_of(prepared, problem, fitted);
  result.theta = fitted.theta;
  result.fitted = fitted.effects;
  if (result.verdict == GapVerdict::no_gap && some_channel_above(result.series, 2.0 * selection.tolerated_floor)) {
    result.verdict = GapVerdict::unexplained;
    result.notes.push_back("one channel is above its noise floor, though all of them together are not");
  }
  if (const std::optional<FastBand> fast = look_at_fast_band(prepared, fitted.effects, {.blocks = blocks})) {
    add_fast_band(result, *fast, prepared.catalogue);
  }
  if (result.verdict == GapVerdict::no_gap) {
    Baseline now{found.nominal_excess, evaluate(problem.table, {}, BaseModel::refitted).held_out_error - 1.0, {}};
    for (const ResidualSeries& series : result.series) {
      now.left.push_back(series.refitted);
    }
    result.visible = visible_sizes(prepared, problem, now, selection);
  }
  result.misfit = prepared.misfit;
  if (result.misfit && result.verdict == GapVerdict::no_gap) {
    result.verdict = GapVerdict::unexplained;
  }
  tell("locating", 0.65);
  WhereOptions where_to_look;
  where_to_look.beta = prepared.row_options.beta;
  where_to_look.seed = options.seed;
  result.where = locate_gap(prepared.drive, result.series, where_to_look);
  if (result.verdict != GapVerdict::no_gap) {
    const std::vector<double> floors(prepared.floor.efforts.data(),
                                     prepared.floor.efforts.data() + prepared.floor.efforts.size());
    const Contradictions contradictions = find_contradictions(
        prepared.drive, prepared.row_options.beta,
        settled(prepared.drive, prepared.row_options.beta) && moving(prepared.drive, prepared.row_options.beta), floors,
        finite_prior(seen, prepared));
    result.contradictions = contradictions.rows;
    if (!contradictions.rows.empty()) {
      result.notes.push_back(contradictions.statement);
    }
  }
  const BaseModel alike = trusted ? BaseModel::nominal : BaseModel::refitted;
  const std::vector<std::optional<Signature>> on_log = signatures(problem.table, alike);
  result.confusable = confusable_pairs(problem.table, on_log, alike);
  judge_pairs(result.confusable, problem.table, on_log, alike, prepared, seen, blocks);
  result.not_excited = not_excited(problem.table, prepared.catalogue, prepared.drive);
  result.parametric = parameter_shifts(seen, prepared.drive, problem.table, found.structural.members);

  std::string why_not;
  if (!found.all.members.empty() && found.reaches_floor) {
    result.improved = improved_robot(seen, prepared.drive, fitted.theta, fitted.effects, fitted.intervals, why_not);
    if (!result.improved) {
      result.notes.push_back(why_not);
    }
  }
  if (options.shrink && !found.all.members.empty()) {
    tell("measuring how far it shrinks", 0.75);
    ShrinkOptions how;
    how.blocks = blocks;
    how.seed = options.seed;
    how.threads = options.threads;
    result.shrink = measure_shrink(seen, prepared, {fitted.effects, base, result.improved}, how, result.notes);
  }
  if (braking_unknown(prepared.drive, result.series)) {
    withdraw_causes(result);
  }
  from_torques(result, robot, prepared.view);
  leave_out_impossible(result, prepared.drive.model);
  const bool counted = prepared.reference == GapReference::healthy_log && prepared.drive.has_efforts &&
                       prepared.drive.has_pose() && !options.catalogue && options.without.empty();
  if (counted && !result.misfit && result.credible.size() == answers_among(result.credible)) {
    rate(result);
  }
  tell("done", 1.0);
  return result;
}

namespace {

constexpr Eigen::Index kBlocks = 24;

// Roots of the mean squares of equal parts of `left`.
Eigen::VectorXd roots_of_parts(const Eigen::VectorXd& left) {
  const Eigen::Index count = std::min(kBlocks, left.size());
  Eigen::VectorXd roots(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index first = k * left.size() / count, last = (k + 1) * left.size() / count;
    roots[k] = std::sqrt(left.segment(first, last - first).squaredNorm() / static_cast<double>(last - first));
  }
  return roots;
}

}  // namespace

std::string_view to_string(GapVerdict verdict) {
  switch (verdict) {
    case GapVerdict::no_gap: return "no_gap";
    case GapVerdict::explained: return "explained";
    case GapVerdict::ambiguous: return "ambiguous";
    case GapVerdict::unexplained: return "unexplained";
  }
  return "";
}

std::size_t answers_among(const std::vector<CredibleCauses>& credible) {
  std::size_t count = 0;
  for (const CredibleCauses& set : credible) {
    count = std::max(count, set.answer + 1);
  }
  return count;
}

std::vector<ShrinkFigure> torque_on(LogSource& fresh, LogSource* baseline, const Robot& robot, const Diagnosis& found,
                                    const DiagnoseOptions& options) {
  DiagnoseOptions same = options;
  same.beta = found.beta;
  PreparedGap prepared = prepare_gap(fresh, baseline, robot, same);
  Drive& drive = prepared.drive;
  if (!drive.has_efforts) {
    return {};
  }
  expect_efforts(drive, found.theta, found.fitted);
  const GapRows rows = make_gap_rows(drive, prepared.floor, prepared.healthy, prepared.row_options);
  std::vector<std::vector<Eigen::VectorXd>> causes;
  for (const FittedEffect& cause : found.fitted) {
    causes.push_back(rows_of(drive, rows, cause, prepared.row_options));
  }
  std::vector<ShrinkFigure> figures;
  for (std::size_t s = 0; s < drive.model.n(); ++s) {
    const RowSpace& space = rows.spaces[s];
    Eigen::VectorXd left = space.response;
    for (std::size_t j = 0; j < rows.parameters; ++j) {
      if (space.columns[j].size() > 0) {
        left -=
            (found.theta[static_cast<Eigen::Index>(j)] - drive.theta[static_cast<Eigen::Index>(j)]) * space.columns[j];
      }
    }
    for (const std::vector<Eigen::VectorXd>& parts : causes) {
      if (parts[s].size() > 0) {
        left -= parts[s];
      }
    }
    const RolloutRms after = rollout_rms(roots_of_parts(left), options.seed);
    const auto count = static_cast<double>(left.size());
    figures.push_back({drive.model.outputs[s], drive.model.output_units[s],
                       std::sqrt(space.response.squaredNorm() / count), std::sqrt(left.squaredNorm() / count),
                       prepared.floor.efforts[static_cast<Eigen::Index>(s)], after.lower, after.upper});
  }
  return figures;
}

}  // namespace wheelwright::gap
