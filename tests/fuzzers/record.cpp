// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/fleet_json.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// A robot's record that is read is written as one that is read as the same, and can be judged in a fleet of six.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    study::RobotRecord record = results::record_from_text(fuzz::text_of(data, size), "record");
    fuzz::promised([&] {
      const std::string text = results::record_text(record);
      fuzz::require(results::record_from_text(text, "again") == record && text.find('\n') == std::string::npos);
      static_cast<void>(results::fleet_csv_rows(record));
      study::FleetResult fleet;
      for (int k = 0; k < 6; ++k) {
        record.robot += 'b';
        study::take(fleet, record);
      }
      study::judge_fleet(fleet);
      fuzz::require(results::to_json(fleet, "list.csv", "fuzz").is_object());
      static_cast<void>(results::pooled_prior_yaml(fleet, "fuzz"));
    });
  });
}
