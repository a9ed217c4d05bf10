// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "core/log.hpp"
#include "formats/logs/recorded_log.hpp"
#include "results/comparison_json.hpp"
#include "results/model_check.hpp"
#include "results/model_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// Rows of a drive with all columns that a model may ask for.
LogTable drive() {
  LogTable table;
  table.names = {"omega_r", "omega_l", "tau_r", "tau_l", "phi_r", "phi_l", "theta", "x", "y"};
  table.columns.resize(table.names.size());
  for (int k = 0; k < 40; ++k) {
    table.t.push_back(0.02 * k);
    for (std::size_t j = 0; j < table.names.size(); ++j) {
      table.columns[j].push_back(0.01 * k + 0.1 * static_cast<double>(j));
    }
  }
  table.segment_starts = {0};
  return table;
}

void require_sizes(const results::SetClaims& claims) {
  const std::size_t p = claims.parameter_names.size();
  fuzz::require(claims.lower.size() == p && claims.upper.size() == p && claims.prior.sides.size() == p);
  for (const bounds::HalfSpace& facet : claims.facets) {
    fuzz::require(static_cast<std::size_t>(facet.a.size()) == p);
  }
}

}  // namespace

// Claims that are read have a number for each parameter, and can be checked against whatever log has their columns.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  const auto path = fuzz::on_disk(text, ".claims.json");
  fuzz::clean([&] { static_cast<void>(results::compared_model(path.string())); });
  return fuzz::clean([&] {
    const results::ModelClaims claims = results::claims_from_json(files::parse_json(text, "model.json"), "model.json");
    require_sizes(claims);
    if (claims.kinematic) {
      require_sizes(*claims.kinematic);
    }
    static const LogTable table = drive();
    const auto there = [&](const std::string& name) {
      return std::ranges::find(table.names, name) != table.names.end();
    };
    if (!std::ranges::all_of(claims.measurement.columns(), there) ||
        (claims.kinematic && !std::ranges::all_of(claims.kinematic->model.measurement.columns(), there))) {
      return;
    }
    fuzz::promised([&] {
      core::TableSource log(table);
      logs::LogReport report;
      report.rows = table.rows();
      const results::ModelCheck check = results::check_model(claims, log, report);
      fuzz::require(!check.proved());
      static_cast<void>(results::verdict(check, claims));
    });
  });
}
