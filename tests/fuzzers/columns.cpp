// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// Columns of a robot file, or of the robot in a model.json, have names of the log contract, and are written as a line
// that is read as the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::string> names = logs::log_column_names();
  const auto path = fuzz::on_disk(fuzz::text_of(data, size), ".columns.yaml");
  return fuzz::clean([&] {
    const robots::ColumnMap columns = robots::read_columns(path, names);
    for (const auto& [name, column] : columns) {
      fuzz::require(std::ranges::find(names, name) != names.end());
    }
    fuzz::promised([&] {
      const auto again = fuzz::on_disk(robots::columns_yaml(columns), ".again.yaml");
      fuzz::require(columns.empty() || robots::read_columns(again, names) == columns);
    });
  });
}
