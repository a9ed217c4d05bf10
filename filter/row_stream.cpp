// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/row_stream.hpp>

namespace wheelwright {

std::vector<std::size_t> positions_of(const LogSource& log, const std::vector<std::string>& columns,
                                      const std::string& why) {
  std::vector<std::size_t> positions;
  for (const std::string& name : columns) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'" + why);
    positions.push_back(*column);
  }
  return positions;
}

template class RowStream<RegressorFilter>;
template class RowStream<OdometryFilter>;

}  // namespace wheelwright
