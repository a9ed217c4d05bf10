// SPDX-License-Identifier: Apache-2.0
#include "follow.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/io/csv.hpp>

#include "summary.hpp"

namespace wheelwright::app {
namespace {

constexpr double kMerge = 0.5;  // s, as detect() on a whole log

std::vector<std::size_t> pick_columns(const CsvRowParser& parser, const Measurement& measurement) {
  std::vector<std::size_t> pick;
  for (const std::string& name : measurement.columns()) {
    const auto& columns = parser.columns();
    const auto it = std::find(columns.begin(), columns.end(), name);
    if (it == columns.end()) {
      throw InputError("standard input: no column '" + name + "', which the model was commissioned on");
    }
    pick.push_back(static_cast<std::size_t>(it - columns.begin()));
  }
  return pick;
}

}  // namespace

bool follow(std::istream& in, std::ostream& out, Detector detector, const CommissionedModel& model,
            const CsvOptions& reader, bool json) {
  std::string line;
  do {
    if (!std::getline(in, line)) {
      throw InputError("standard input: expected a header line with the names of the columns, found its end");
    }
  } while (!is_csv_content(line));
  CsvRowParser parser(line, reader, model.measurement.nominal_step);
  const std::vector<std::size_t> pick = pick_columns(parser, model.measurement);
  std::vector<double> sample(pick.size());
  EventRecorder recorder(model.model.n(), kMerge);
  LogBlock row;
  std::size_t number = 0;
  while (std::getline(in, line)) {
    try {
      if (!parser.parse(line, row)) {
        continue;
      }
    } catch (const InputError& error) {
      fmt::print(stderr, "wheelwright detect: {} (row left out)\n", error.what());
      continue;
    }
    if (!row.segment_starts.empty()) {
      detector.restart();
    }
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = row.columns[pick[c]][0];
    }
    const Decision& decision = detector.step(row.t[0], sample);
    for (std::size_t i = 0; decision.valid && i < decision.channels.size(); ++i) {
      const ChannelDecision& c = decision.channels[i];
      if (recorder.add(i, number, row.t[0], c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm)) {
        const Event& event = recorder.events().back();
        out << (json ? json_text(to_json(event, model), -1) : event_line(event, model)) << std::endl;
      }
    }
    ++number;
  }
  return !recorder.events().empty();
}

}  // namespace wheelwright::app
