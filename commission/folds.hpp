// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log divided into contiguous blocks: some to learn from, some held out.
#pragma once

#include <cstddef>

#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// How rows are divided. Samples of a filtered regression are autocorrelated: blocks are contiguous, and a held-out block
/// begins with a purge as long as the filter remembers, so that it shares nothing with its neighbour.
struct FoldOptions {
  std::size_t blocks = 10;         ///< the log's rows in this many contiguous blocks
  std::size_t hold_out_every = 3;  ///< blocks 3, 6, 9, … are held out
  double purge = 0.6;              ///< s dropped at the beginning of every block
};

/// Which part of a log.
enum class Part { everything, training, held_out };

/// The rows of one part of a source, which must outlive it.
class FoldedSource final : public RegressionSource {
 public:
  /// `log_rows`: number of rows of the log (RegressionBlock::sample runs below it).
  FoldedSource(RegressionSource& rows, Part part, std::size_t log_rows, FoldOptions options = {});
  [[nodiscard]] std::size_t outputs() const override { return source_->outputs(); }
  [[nodiscard]] std::size_t parameters() const override { return source_->parameters(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;

 private:
  RegressionSource* source_;
  Part part_;
  std::size_t log_rows_;
  FoldOptions options_;
  std::size_t current_ = static_cast<std::size_t>(-1);
  double block_start_ = 0.0;
};

}  // namespace wheelwright
