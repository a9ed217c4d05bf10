// SPDX-License-Identifier: Apache-2.0
/// \file
/// A sensitivity study: inputs, quantities, and the methods that relate them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "study/global_sensitivity.hpp"
#include "study/study_case.hpp"
#include "study/study_quantity.hpp"

namespace wheelwright::study {

/// Methods of a study.
struct StudyMethods {
  bool local = false;                           ///< derivatives of the bounds (bound_derivatives.hpp)
  std::optional<Eigen::Index> one_at_a_time{};  ///< levels
  std::optional<MorrisOptions> morris{};
  std::optional<SobolOptions> sobol{};
  std::optional<Grid> grid{};  ///< `nominal` is set by the study
};

/// Everything that a study file says.
struct Study {
  std::string name;
  StudyCase subject;
  std::vector<StudyInput> inputs;
  std::vector<StudyQuantity> quantities;
  StudyMethods methods;
  EvaluateOptions evaluate;
};

/// Gives a filter that is chosen from the data the constants chosen for the subject as it is, where an input of the
/// study is a filter constant: what is varied must have a value. Returns a sentence that says so; empty where nothing
/// was done.
std::string settle_filter(StudyCase& subject, const std::vector<std::string>& inputs);

/// Coordinates of the nominal values.
[[nodiscard]] Eigen::VectorXd nominal_point(const std::vector<StudyInput>& inputs);

/// The points of all methods, one below the other in the order of StudyMethods. Methods share points: each differing
/// one is an item of work.
struct StudyDesign {
  /// Rows of one method.
  struct Part {
    Eigen::Index first = 0;
    Eigen::Index count = 0;
  };
  Eigen::MatrixXd points;  ///< in the unit cube, points × inputs
  Part one_at_a_time, morris, sobol, grid;
  std::vector<std::size_t> items;  ///< of each row, the item that it is
  std::vector<std::size_t> rows;   ///< of each item, the first row that it is
};

/// Throws InvalidArgument as the methods' designs do, and for a study with neither points nor local derivatives.
[[nodiscard]] StudyDesign design_of(const Study& study);

/// The subject with the inputs at a point of the unit cube.
[[nodiscard]] StudyCase case_at(const Study& study, const Eigen::VectorXd& point);

/// "noise.effort = 0.02, filter.beta = 12.5": the inputs at a point, with all their digits.
[[nodiscard]] std::string name_of_point(const Study& study, const Eigen::VectorXd& point);

/// Evaluates a point. An input that cannot have its value there is a finding, too.
[[nodiscard]] CaseResult evaluate_point(const Study& study, const Eigen::VectorXd& point);

/// A result as text, and back: every number reads back exactly. case_result() throws InvalidArgument for a text that is
/// none.
[[nodiscard]] std::string text_of(const CaseResult& result);
[[nodiscard]] CaseResult case_result(std::string_view text);

/// Why points gave no model, and how many of them.
struct StudyFinding {
  std::string sentence;
  std::size_t points = 0;
};

/// Results of the methods; [quantity] or [quantity][input].
struct StudyResult {
  std::vector<OneAtATime> one_at_a_time;
  std::vector<std::vector<ElementaryEffects>> morris;
  std::vector<SobolIndices> sobol;
  Eigen::MatrixXd grid;                ///< points of the grid × quantities
  std::size_t points = 0;              ///< that were evaluated
  std::vector<StudyFinding> findings;  ///< the most frequent first
};

/// Takes the results of a design's items and makes the methods' results of them.
class StudyValues {
 public:
  StudyValues(const Study& study, const StudyDesign& design);
  /// The result of an item. Throws InvalidArgument for a number of values that is not that of the quantities.
  void put(std::size_t item, const CaseResult& result);
  /// The methods' results; points that were not put have no value.
  [[nodiscard]] StudyResult result() const;

 private:
  const Study* study_;
  const StudyDesign* design_;
  Eigen::MatrixXd values_;  // items × quantities
  std::vector<StudyFinding> findings_;
};

}  // namespace wheelwright::study
