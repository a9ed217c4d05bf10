// SPDX-License-Identifier: Apache-2.0
#include "study/study_work.hpp"

#include "commission/commission.hpp"
#include "core/error.hpp"

namespace wheelwright::study {
namespace {

// The inputs that have local derivatives: those of the robot file.
std::vector<std::string> local_inputs(const Study& study) {
  std::vector<std::string> names;
  for (const StudyInput& input : study.inputs) {
    for (const char* family :
         {"noise.", "declared.", "filter.", "wheel_radius", "track_width", "encoder_counts_per_turn", "prior."}) {
      if (input.name.starts_with(family)) {
        names.push_back(input.name);
      }
    }
  }
  return names;
}

}  // namespace

Eigen::VectorXd point_of(const StudyDesign& design, std::size_t item) {
  return design.points.row(static_cast<Eigen::Index>(design.rows[item]));
}

Work work_of(const Study& study, const StudyDesign& design) {
  return {design.rows.size(), [&](std::size_t item) { return text_of(evaluate_point(study, point_of(design, item))); }};
}

std::optional<LocalSensitivity> nominal_derivatives(const Study& study, std::vector<std::string>& notes) {
  const std::vector<std::string> inputs = local_inputs(study);
  if (!study.methods.local || inputs.empty()) {
    if (study.methods.local) {
      notes.push_back("no local derivatives: none of the inputs stands in the robot file");
    }
    return std::nullopt;
  }
  try {
    const StudyCase nominal = case_at(study, nominal_point(study.inputs));
    const LogTable table = drive_of_case(nominal);
    TableSource log(table);
    commission::CommissionOptions options;
    options.outliers = nominal.outliers_allowed;
    const Commissioning commissioning = commission_robot(log, nominal.robot, options);
    return local_derivatives(log, commissioning, {.inputs = inputs});
  } catch (const Error& error) {
    notes.push_back(std::string("no local derivatives: ") + error.what());
    return std::nullopt;
  }
}

}  // namespace wheelwright::study
