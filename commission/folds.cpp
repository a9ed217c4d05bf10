// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/folds.hpp>

#include <algorithm>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

FoldedSource::FoldedSource(RegressionSource& rows, Part part, std::size_t log_rows, FoldOptions options)
    : source_(&rows), part_(part), log_rows_(std::max<std::size_t>(log_rows, 1)), options_(options) {
  check::that(options.blocks >= 2 && options.hold_out_every >= 2 && options.hold_out_every <= options.blocks, "folds",
              "at least two blocks, of which some but not all are held out");
  check::non_negative(options.purge, "folds purge");
}

void FoldedSource::rewind() {
  source_->rewind();
  current_ = static_cast<std::size_t>(-1);
}

bool FoldedSource::next(RegressionBlock& block) {
  if (!source_->next(block)) {
    return false;
  }
  if (part_ == Part::everything) {
    return true;
  }
  const auto n = static_cast<Eigen::Index>(block.outputs);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < block.instants(); ++k) {
    const std::size_t fold = block.sample[k] * options_.blocks / log_rows_;
    if (fold != current_) {
      current_ = fold;
      block_start_ = block.t[k];
    }
    const bool held_out = fold % options_.hold_out_every == options_.hold_out_every - 1;
    const bool purged = fold > 0 && block.t[k] >= block_start_ && block.t[k] < block_start_ + options_.purge;
    if (purged || held_out != (part_ == Part::held_out)) {
      continue;
    }
    if (kept != k) {
      const auto to = static_cast<Eigen::Index>(kept) * n;
      const auto from = static_cast<Eigen::Index>(k) * n;
      block.sample[kept] = block.sample[k];
      block.t[kept] = block.t[k];
      for (Eigen::Index i = 0; i < n; ++i) {
        block.Y.row(to + i) = block.Y.row(from + i);
        block.dY.row(to + i) = block.dY.row(from + i);
        block.y[to + i] = block.y[from + i];
        block.dy[to + i] = block.dy[from + i];
      }
    }
    ++kept;
  }
  block.sample.resize(kept);
  block.t.resize(kept);
  const auto rows = block.rows();
  block.Y.conservativeResize(rows, Eigen::NoChange);
  block.dY.conservativeResize(rows, Eigen::NoChange);
  block.y.conservativeResize(rows);
  block.dy.conservativeResize(rows);
  return true;
}

}  // namespace wheelwright
