// SPDX-License-Identifier: Apache-2.0
/// \file
/// The half-spaces that a model names, built again from the log.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/results/model_file.hpp>

namespace wheelwright::results {

/// The rows of the log's regression that the claims of a model name, filtered again with the claimed filter and errors.
class RebuiltRows {
 public:
  /// Walks `log` once; keeps the named instants only. `claims` must outlive it. Throws InvalidArgument when the log
  /// lacks a column.
  RebuiltRows(const ModelClaims& claims, LogSource& log);

  /// True if a column is noisy and `box` leaves the sign of its parameter open: the rows then depend on the box.
  [[nodiscard]] bool depends_on(const Box& box) const;

  /// The half-space that holds for every admissible θ of `box` (SlabRows; sides are those of the prior). Nothing where
  /// this log has no such row, or one at another time, or where it was left out: `why` says which.
  [[nodiscard]] std::optional<bounds::HalfSpace> row(const bounds::RowOrigin& origin, const Box& box,
                                                     std::string& why) const;

  /// The rows of a proof, in their order. One that cannot be built takes no part (a multiplier of 0); the first of them
  /// is told in `why`.
  [[nodiscard]] std::vector<bounds::WeightedRow> proof(const std::vector<NamedRow>& named, const Box& box,
                                                       std::string& why) const;

 private:
  const ModelClaims& claims_;
  RegressionBlock instants_;
};

}  // namespace wheelwright::results
