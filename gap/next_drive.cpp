// SPDX-License-Identifier: Apache-2.0
#include "gap/next_drive.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/words.hpp"
#include "gap/causes/estimates.hpp"
#include "gap/diagnose.hpp"
#include "gap/diagnosis.hpp"
#include "gap/next/discrimination_design.hpp"
#include "gap/next/further_drive.hpp"
#include "gap/prepared.hpp"

namespace wheelwright::gap {
namespace {

constexpr std::size_t kMostRivals = 4;   // pairs grow with the square
constexpr std::size_t kMostShapes = 40;  // of a rival's cause: each is tried for every plan that is looked at

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

// Whether a plan can be looked at a hundred times within seconds.
bool quickly_planned(const Rival& rival, const std::vector<Effect>& laws, const Drive& drive) {
  return std::ranges::all_of(rival.causes, [&](const RivalCause& cause) {
    return shape_grid(*std::ranges::find(laws, cause.effect, &Effect::name), drive).size() <= kMostShapes;
  });
}

// The first credible set of each answer fitted to the drive; θ beside the first of them goes to `theta`. An effect
// follows one law in all of them, which is the one in `laws`.
std::vector<Rival> fitted_rivals(const PreparedGap& prepared, const Diagnosis& diagnosis,
                                 const DiagnoseOptions& options, Eigen::VectorXd& theta, std::vector<Effect>& laws) {
  std::map<std::string, std::size_t> law;  // of each effect, its place in prepared.catalogue
  const bool trusted = std::ranges::find(prepared.trusted, true) != prepared.trusted.end();
  std::vector<Rival> rivals;
  std::set<std::size_t> answers;
  for (const CredibleCauses& member : diagnosis.credible) {
    if (member.effects.empty() || rivals.size() == kMostRivals || !answers.insert(member.answer).second) {
      continue;
    }
    ShapeGrids shapes = all_shapes(prepared.catalogue, prepared.drive);
    bool parametric = false;
    for (std::size_t e = 0; e < prepared.catalogue.size(); ++e) {
      const std::string& name = prepared.catalogue[e].name;
      const auto other = law.find(name);
      const bool here =
          std::ranges::find(member.effects, name) != member.effects.end() && (other == law.end() || other->second == e);
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
    const CauseSet set = best_set(problem.table, member.effects, base);
    const FittedCauses fitted = fit_causes(prepared, problem, set, base, blocks);
    if (rivals.empty()) {
      theta = fitted.theta;
    }
    for (const std::size_t c : set.members) {
      const std::size_t e = problem.table.candidates[c].effect;
      if (law.emplace(prepared.catalogue[e].name, e).second) {
        laws.push_back(prepared.catalogue[e]);
      }
    }
    rivals.push_back(rival_of(fitted, laws, prepared.drive));
  }
  return rivals;
}

}  // namespace

NextDrive next_drive(LogSource& log, LogSource* baseline, const Robot& robot, const Diagnosis& diagnosis,
                     const DiagnoseOptions& options) {
  const PreparedGap prepared = prepare_gap(log, baseline, robot, options);
  NextDrive next;
  Eigen::VectorXd theta = prepared.theta;
  next.rivals = fitted_rivals(prepared, diagnosis, options, theta, next.laws);
  if (next.rivals.size() < 2) {
    return next;
  }
  std::vector<Rival> planned;
  std::ranges::copy_if(next.rivals, std::back_inserter(planned),
                       [&](const Rival& rival) { return quickly_planned(rival, next.laws, prepared.drive); });
  if (planned.size() < 2) {
    next.sentence = fmt::format(
        "No drive was designed to tell {} from {}, of which there are too many kinds; what would "
        "split them: {}.",
        next.rivals[0].name(), next.rivals[1].name(), splitting_measurement(next.rivals[0], next.rivals[1], next.laws));
    return next;
  }
  const design::DesignSubject subject = subject_of(prepared, prepared.view.robot, theta);
  PlannedNoise noise;
  noise.beta = prepared.row_options.beta;
  noise.output = {prepared.floor.efforts.data(), prepared.floor.efforts.data() + prepared.floor.efforts.size()};
  noise.pose = prepared.floor.increments;
  noise.window = prepared.row_options.window;
  design::DesignOptions search;
  search.samples = 60;
  search.descents = 2;
  search.steps = 80;
  search.seed = options.seed;
  search.threads = options.threads;
  search.progress = [&](std::string_view, double share) {
    if (options.progress) {
      options.progress("designing the next manoeuvre", share);
    }
  };
  const design::MotionLimits limits = limits_within(prepared, prepared.view.robot);
  const DiscriminationDesign design =
      design_for_discrimination(subject, limits, planned, next.laws, noise, search, &prepared.drive);
  next.sentence = core::listed(design.sentences, " ");
  if (design.worst()) {
    next.commands = design::command_table(design.manoeuvre.plan, subject.model);
    next.sentence = fmt::format("A drive of {:.0f} s within {:.2g} m of its start. {}", limits.duration,
                                design.manoeuvre.plan.reach(), next.sentence);
  }
  return next;
}

NextDrive what_next(LogSource& log, LogSource* baseline, const Robot& robot, Diagnosis& d,
                    const DiagnoseOptions& options) {
  if (d.verdict != GapVerdict::ambiguous) {
    return {};
  }
  try {
    NextDrive next = next_drive(log, baseline, robot, d, options);
    if (!next.commands && !next.sentence.empty()) {
      d.notes.push_back(next.sentence);
    }
    return next;
  } catch (const InvalidArgument& error) {
    d.notes.push_back(std::string("no manoeuvre was designed to tell the causes apart: ") + error.what());
    return {};
  }
}

}  // namespace wheelwright::gap
