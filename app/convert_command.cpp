// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/units.hpp"
#include "core/error.hpp"
#include "core/interval.hpp"
#include "formats/logs/log_file.hpp"

namespace wheelwright::app {
namespace convert_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> paths;
  std::vector<std::string> without;
  std::filesystem::path robot;
  logs::McapCompression compression = logs::McapCompression::zstd;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Reads a log and writes it in another format: CSV (plain, .gz, .zst), rosbag2 (.mcap, .db3, or a directory), HDF5 "
    "(.h5). The log is cleaned as every command cleans it, topics of a bag are brought to one clock, and what was "
    "repaired, left out or interpolated is said.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright convert drive.mcap drive.csv\n"
    "  wheelwright convert vesc.csv drive.csv --robot robot.yaml\n"
    "  wheelwright convert my_bag/ drive.h5 --map omega_r=/joints.velocity[right_wheel]\n"
    "  wheelwright convert monday.csv tuesday.csv.gz both.mcap --compression lz4\n"
    "  wheelwright convert drive.csv rest.csv --without 60:65.2 --without 80:81\n\n"
    "Exit code: 0 written, 2 bad input.";

// "60:65.2" as the stretch from 60 s to 65.2 s.
Interval stretch(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) {
    throw InputError(
        fmt::format("--without {}: expected FROM:TO, times of the log in s, e.g. 60:65.2", files::shown(text)));
  }
  const Interval s{quantity(text.substr(0, colon), "s", "--without"),
                   quantity(text.substr(colon + 1), "s", "--without")};
  if (!(s.lower <= s.upper)) {
    throw InputError(fmt::format("--without {}: expected FROM:TO with FROM <= TO", files::shown(text)));
  }
  return s;
}

// What is written of a log.
struct Written {
  std::size_t rows = 0, left_out = 0, segments = 0;
  double seconds = 0.0;
};

// Writes the rows of `log` that lie in none of `left_out`.
Written write_rows(logs::RecordedLog& log, const std::vector<Interval>& left_out, logs::LogWriter& writer,
                   const std::function<void(std::size_t)>& told) {
  Written written;
  LogBlock block, kept;
  kept.columns.resize(log.columns().size());
  double last = 0.0;
  bool starts = true;
  std::size_t rows = 0;
  while (log.next(block)) {
    kept.t.clear();
    for (std::vector<double>& column : kept.columns) {
      column.clear();
    }
    for (std::size_t k = 0; k < block.rows(); ++k) {
      starts = starts || std::ranges::binary_search(block.segment_starts, k);
      const double t = block.t[k];
      if (std::ranges::any_of(left_out, [&](const Interval& s) { return s.lower <= t && t <= s.upper; })) {
        ++written.left_out;
        starts = true;
        continue;
      }
      written.segments += starts ? 1 : 0;
      written.seconds += starts ? 0.0 : t - last;
      starts = false;
      last = t;
      kept.t.push_back(t);
      for (std::size_t c = 0; c < kept.columns.size(); ++c) {
        kept.columns[c].push_back(block.columns[c][k]);
      }
    }
    if (kept.rows() > 0) {
      writer.write(kept);
    }
    written.rows += kept.rows();
    told(rows += block.rows());
  }
  return written;
}

int run(const Arguments& a) {
  std::vector<Interval> left_out(a.without.size());
  std::ranges::transform(a.without, left_out.begin(), stretch);
  std::vector<std::filesystem::path> from = a.paths;
  const std::filesystem::path to = from.back();
  from.pop_back();
  keep_inputs(to, from);
  keep_existing(a.common, to);
  leave_standard_output(a.common, to);
  make_directory(a.common, {"convert.json"});
  logs::LogOptions reader = reader_options(a.common);
  reader.leaps = true;
  const std::unique_ptr<logs::RecordedLog> log = logs::open_log(from, reader);
  const logs::LogReport& report = log->report();
  logs::LogWriteOptions options;
  options.compression = a.compression;
  options.time_origin = report.files.front().time_origin;
  Progress progress(a.common.quiet);
  const auto writer = create_output(to, log->columns(), options);
  const Written written = write_rows(*log, left_out, *writer, [&](std::size_t rows) {
    progress.tell("writing", static_cast<double>(rows) / static_cast<double>(report.rows));
  });
  if (written.rows == 0) {
    throw InputError(fmt::format("{}: --without leaves no row of it", from.front().string()));
  }
  writer->commit();
  std::vector<std::string> said = logs::sentences(report);
  if (!left_out.empty()) {
    said.push_back(fmt::format("{} rows were left out (--without)", written.left_out));
  }
  const Json json = {{"schema", "wheelwright/convert/1"},
                     {"file", to.string()},
                     {"rows", written.rows},
                     {"rows_read", report.rows_read},
                     {"segments", written.segments},
                     {"seconds", written.seconds},
                     {"columns", log->columns()},
                     {"notes", said}};
  publish(a.common, json, "convert.json", {});
  if (!a.common.json && !a.common.quiet) {
    print_log(said);
    say("wrote {}: {} rows, {:.6g} s in {} segment{}, columns t", to.string(), written.rows, written.seconds,
        written.segments, written.segments == 1 ? "" : "s");
    for (const std::string& name : log->columns()) {
      say(", {}", name);
    }
    say("\n");
  }
  return kDone;
}

}  // namespace
}  // namespace convert_command

Run add_convert(CLI::App& program) {
  using namespace convert_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("convert", kHelp);
  command.add_option("IN OUT", a->paths, "Logs to read (several are taken together), and last the file to write")
      ->required()
      ->expected(-2);
  repeatable(*command.add_option("--without", a->without,
                                 "Leave out the rows of this stretch, times of the log in s (repeatable), e.g. where a "
                                 "signal stood still"))
      .type_name("FROM:TO");
  command.add_option("--compression", a->compression, "Of an MCAP file's chunks: none, zstd or lz4")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, logs::McapCompression>{{"none", logs::McapCompression::none},
                                                                               {"zstd", logs::McapCompression::zstd},
                                                                               {"lz4", logs::McapCompression::lz4}})
              .description("{none,zstd,lz4}"))
      ->type_name("KIND");
  command.add_option("--robot", a->robot, "Robot file (YAML) or model.json whose `columns:` name the log's columns")
      ->type_name("FILE");
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app
