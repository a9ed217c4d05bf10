// SPDX-License-Identifier: Apache-2.0
/// \file
/// gap.json: the result of `wheelwright gap`, with rival causes; and the residuals behind it as a table.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/files/json.hpp"
#include "gap/diagnosis.hpp"
#include "gap/rival.hpp"

namespace wheelwright::gap {
struct Drive;
struct NextDrive;
struct PlannedNoise;
}  // namespace wheelwright::gap

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kGapSchema = "wheelwright/gap/1";

/// A manoeuvre that would tell the causes apart.
struct NextManoeuvre {
  std::string file;      ///< with the wheel-speed commands
  std::string sentence;  ///< what it is and what it promises
};

/// Input files of a diagnosis, and the files of its parts.
struct GapFiles {
  std::string robot;              ///< the robot file as it was named
  std::vector<std::string> logs;  ///< the logs as they were named
  std::string baseline;           ///< of the healthy robot; empty: none
  std::string simulator;          ///< the simulator's log; empty: none
  std::string residuals;          ///< file of write_residuals(); empty: none
  std::optional<NextManoeuvre> next_manoeuvre;
  std::string software;  ///< name and version
};

/// The diagnosis as JSON (results/gap.schema.json). Of `where`, the channels, the frequency bands and the regimes that
/// are findings (is_finding) are written; its series are not: see write_residuals().
[[nodiscard]] Json to_json(const Diagnosis& diagnosis, const GapFiles& files);

/// Writes `series` as CSV with the header space,channel,unit,t,signal,nominal,refitted,after,floor: one line per row
/// and channel, seven significant digits (time: microseconds); a signal that a series lacks is empty. The file appears
/// whole or not at all. Throws InputError when it cannot be written.
void write_residuals(const std::filesystem::path& path, const std::vector<gap::ResidualSeries>& series);

/// Members of the credible set of a gap.json. Parameters are those of credible_set[].parameters, keyed
/// "effect.parameter", else of `causes` where the effects are the same; a member without any is as large as
/// typical_rival() makes it. The laws that have these parameters become the first of their names in `catalogue`. Noise
/// and filter of the analysed log, where the file has them, take the place of those in `noise`. Throws InputError where
/// fewer than two members are left that the catalogue knows.
[[nodiscard]] std::vector<gap::Rival> rivals_of_gap(const std::filesystem::path& file, std::vector<Effect>& catalogue,
                                                    const gap::Drive& drive, gap::PlannedNoise& noise);

/// The same from JSON; `file` is for messages.
[[nodiscard]] std::vector<gap::Rival> rivals_of_gap(const Json& json, const std::string& file,
                                                    std::vector<Effect>& catalogue, const gap::Drive& drive,
                                                    gap::PlannedNoise& noise);

/// Adds the parameters of the rivals to the members of the credible set of a gap.json: `design --gap` begins from them.
void add_rivals(Json& result, const gap::NextDrive& next);

}  // namespace wheelwright::results
