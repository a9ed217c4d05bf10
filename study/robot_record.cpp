// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/robot_record.hpp>

#include <limits>

namespace wheelwright::study {

std::size_t column_of(FleetTable& table, const RecordedParameter& parameter) {
  for (std::size_t j = 0; j < table.columns.size(); ++j) {
    if (table.columns[j].name == parameter.name && table.columns[j].unit == parameter.unit) {
      table.columns[j].warrant = core::weaker(table.columns[j].warrant, parameter.warrant);
      return j;
    }
  }
  table.columns.push_back({.name = parameter.name,
                           .unit = parameter.unit,
                           .is_prior_key = parameter.is_prior_key,
                           .warrant = parameter.warrant});
  return table.columns.size() - 1;
}

void add(FleetTable& table, const RobotRecord& record) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const std::size_t robot = table.robots.size();
  table.robots.push_back(record.robot);
  table.status.push_back(record.commissioning.status);
  for (const RecordedParameter& p : record.commissioning.parameters) {
    const std::size_t column = column_of(table, p);
    table.columns[column].entries.push_back({.robot = robot,
                                             .estimate = p.estimate.value_or(none),
                                             .standard_error = p.standard_error.value_or(none),
                                             .freedom = p.freedom.value_or(std::numeric_limits<double>::infinity()),
                                             .lower = p.lower,
                                             .upper = p.upper,
                                             .prior = p.prior});
  }
}

}  // namespace wheelwright::study
