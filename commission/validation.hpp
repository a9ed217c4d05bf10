// SPDX-License-Identifier: Apache-2.0
/// \file
/// Validation of a commissioned detector on held-out blocks of a log.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/regression.hpp"
#include "core/warrant.hpp"

namespace wheelwright::detector {
class ThresholdRule;
}  // namespace wheelwright::detector

namespace wheelwright::commission {

/// Division of rows into training and held-out blocks. Samples of a filtered regression are autocorrelated: blocks are
/// contiguous, and a held-out block begins with a purge as long as the memory of the filter, so that it shares nothing
/// with its neighbour.
struct FoldOptions {
  std::size_t blocks = 10;         ///< the log's rows in this many contiguous blocks
  std::size_t hold_out_every = 3;  ///< blocks 3, 6, 9, … are held out
  double purge = 0.6;              ///< s dropped at the beginning of every block
};

/// Part of a log.
enum class Part { everything, training, held_out };

/// The rows of one part of a source, which must outlive it.
class FoldedSource final : public core::RegressionSource {
 public:
  /// `log_rows`: number of rows of the log (RegressionBlock::sample runs below it).
  FoldedSource(core::RegressionSource& rows, Part part, std::size_t log_rows, FoldOptions options = {});
  [[nodiscard]] std::size_t outputs() const override { return source_->outputs(); }
  [[nodiscard]] std::size_t parameters() const override { return source_->parameters(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;

 private:
  core::RegressionSource* source_;
  Part part_;
  std::size_t log_rows_;
  FoldOptions options_;
  std::size_t current_ = static_cast<std::size_t>(-1);
  double block_start_ = 0.0;
};

/// Validation of one output.
struct OutputValidation {
  std::size_t instants = 0;
  std::size_t outside = 0;           ///< instants with ε outside [l, u]: false alarms, since the log is fault-free
  double coverage = 0.0;             ///< share of instants with ε inside [l, u]
  double coverage_noise_free = 0.0;  ///< share with τ_f inside the range of Y_f θ over the feasible set alone
  double nrmse = 0.0;                ///< rms ε / rms τ_f
  double utilisation = 0.0;          ///< max |ε − middle| / half width: near 0, the threshold can never fire
  double torque_rms = 0.0;           ///< unit of the output
  double residual_rms = 0.0;         ///< unit of the output
  double median_width = 0.0;         ///< median of u − l, unit of the output
  double median_width_box = 0.0;     ///< the same with the interval hull in place of the set
  double smallest_kappa = 0.0;  ///< smallest |κ| of ζ = κ·Yθ that some instant shows for certain, both directions
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of the threshold that was tried
};

/// |κ| of a fault that is as large as the effort itself.
inline constexpr double whole_effort = 1.0;

/// Smallest |κ| over the outputs that held-out driving shows for certain; nothing where it shows none.
[[nodiscard]] std::optional<double> smallest_certain_kappa(const std::vector<OutputValidation>& validation);

/// Whether driving was held out and shows no fault for certain that is smaller than the effort itself.
[[nodiscard]] bool sees_nothing(const std::vector<OutputValidation>& validation);

/// Walks `rows` and compares every instant with its threshold. κ: an instant shows ζ = κ·Yθ for certain when
/// |κ|·min|Yθ| exceeds u − l, the minimum taken over the feasible set; a constant change δ1 of the wheel radius r has κ
/// = (1 + δ1/r)² − 1.
[[nodiscard]] std::vector<OutputValidation> validate_on(core::RegressionSource& rows,
                                                        const detector::ThresholdRule& rule);

}  // namespace wheelwright::commission
