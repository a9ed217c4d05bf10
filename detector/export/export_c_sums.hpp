// SPDX-License-Identifier: Apache-2.0
/// \file
/// ScaleDetector as C99, with only what one model and one measurement need.
#pragma once

#include <string>

#include "detector/export/export_c_filter.hpp"
#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::exporter::c_text {

/// Writes the parts of a header that stand for a detector at a stated risk. Each gives text with `pfx` for the prefix
/// (export_c_text.hpp), on top of the elements of a FilterWriter, of pfx_support_of_hull and, for a polytope, of the
/// tables and the function pfx_risk_support that the caller writes. The C has the library's operations in its order.
class SumsWriter {
 public:
  /// Both are referred to.
  SumsWriter(const detector::ScaleDetector& sums, const FilterWriter& elements);

  /// Lines of the header's comment: what is watched, and how it is used.
  [[nodiscard]] std::string words() const;
  [[nodiscard]] std::string constants() const;
  /// Types up to pfx_sums, its state.
  [[nodiscard]] std::string types() const;
  /// Tables but for those of the set.
  [[nodiscard]] std::string tables() const;
  /// Functions, pfx_sums_restart, pfx_sums_init and pfx_sums_step among them.
  [[nodiscard]] std::string functions() const;

 private:
  [[nodiscard]] std::string foresee() const;
  [[nodiscard]] std::string weigh() const;
  [[nodiscard]] std::string left_out() const;
  [[nodiscard]] std::string worst() const;
  [[nodiscard]] std::string take() const;
  [[nodiscard]] std::string look() const;
  [[nodiscard]] std::string interface() const;

  const detector::ScaleDetector& sums_;
  const FilterWriter& elements_;
  const detector::RiskModel& risk_;
  const Model& model_;
  detector::SumConstants constants_;
  bool varied_;    // the variance proxy of an effort depends on its weight
  bool polytope_;  // θ of the set itself, not of its box
};

}  // namespace wheelwright::exporter::c_text
