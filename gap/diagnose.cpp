// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/diagnose.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/gap/catalogue.hpp>
#include <wheelwright/gap/prepared.hpp>
#include <wheelwright/gap/selection.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kShownOfEachSize = 8;

GapVerdict verdict_of(const Selection& found) {
  if (!found.reaches_floor) {
    return GapVerdict::unexplained;
  }
  if (!found.any_cause) {
    return GapVerdict::no_gap;
  }
  return found.theta_moved ? GapVerdict::unexplained
                           : (found.credible.size() > 1 ? GapVerdict::ambiguous : GapVerdict::explained);
}

}  // namespace

Diagnosis diagnose(LogSource& log, LogSource* baseline, const Robot& robot, const DiagnoseOptions& options) {
  const PreparedGap prepared = prepare_gap(log, baseline, robot, options);
  BlockOptions blocks = options.blocks;
  blocks.threads = options.threads;
  const auto problem_with = [&](const ShapeGrids& shapes) {
    return make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted, prepared.catalogue, shapes,
                        prepared.row_options);
  };
  const ShapeGrids coarse = all_shapes(prepared.catalogue, prepared.drive);
  GapProblem problem = problem_with(coarse);
  {
    const BlockGram gram(problem.rows.spaces, blocks);
    problem.table.gram = &gram;
    const std::vector<std::vector<CauseSet>> levels = search_causes(problem.table, {.threads = options.threads});
    problem = problem_with(finer_shapes(prepared.catalogue, prepared.drive, coarse, problem.table, levels));
  }
  const BlockGram gram(problem.rows.spaces, blocks);
  problem.table.gram = &gram;
  SelectionOptions selection = options.selection;
  selection.threads = options.threads;
  selection.seed = options.seed;
  const bool trusted = std::any_of(prepared.trusted.begin(), prepared.trusted.end(), [](bool t) { return t; });
  const Selection found = select_causes(problem.table, problem.kinds, trusted, 1.0, selection);

  Diagnosis result;
  result.verdict = verdict_of(found);
  result.beta = prepared.row_options.beta;
  result.floor_origin = prepared.floor_origin;
  result.notes = prepared.notes;
  for (const std::size_t c : found.all.members) {
    GapCause cause;
    cause.effect = problem.table.names[problem.table.candidates[c].effect];
    result.causes.push_back(std::move(cause));
  }
  for (const CredibleSet& member : found.credible) {
    result.credible.push_back({names_of(problem.table, member.set), member.set.held_out_error, member.p_value});
  }
  std::size_t of_this_size = 0;
  for (std::size_t k = 0; k < found.looked_at.size(); ++k) {
    const CauseSet& set = found.looked_at[k];
    of_this_size = k > 0 && set.members.size() == found.looked_at[k - 1].members.size() ? of_this_size + 1 : 0;
    if (of_this_size < kShownOfEachSize) {
      result.looked_at.push_back({names_of(problem.table, set), set.held_out_error, 0.0});
    }
  }
  result.gap = found.nominal_excess;
  result.structural = found.refitted_excess;
  result.remaining = found.left;
  return result;
}

}  // namespace wheelwright
