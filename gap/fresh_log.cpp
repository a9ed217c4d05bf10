// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/fresh_log.hpp>

#include <cmath>

#include <wheelwright/gap/prepared.hpp>
#include <wheelwright/gap/rollout.hpp>

namespace wheelwright {
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

}  // namespace wheelwright
