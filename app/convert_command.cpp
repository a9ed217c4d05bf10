// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "core/error.hpp"
#include "formats/logs/log_file.hpp"

namespace wheelwright::app {
namespace convert_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> paths;
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
    "  wheelwright convert monday.csv tuesday.csv.gz both.mcap --compression lz4\n\n"
    "Exit code: 0 written, 2 bad input.";

int run(const Arguments& a) {
  std::vector<std::filesystem::path> from = a.paths;
  const std::filesystem::path to = from.back();
  from.pop_back();
  keep_inputs(to, from);
  keep_existing(a.common, to);
  leave_standard_output(a.common, to);
  make_directory(a.common, {"convert.json"});
  const std::unique_ptr<logs::RecordedLog> log = logs::open_log(from, reader_options(a.common));
  const logs::LogReport& report = log->report();
  logs::LogWriteOptions options;
  options.compression = a.compression;
  options.time_origin = report.files.front().time_origin;
  Progress progress(a.common.quiet);
  const auto writer = create_output(to, log->columns(), options);
  LogBlock block;
  std::size_t rows = 0;
  while (log->next(block)) {
    writer->write(block);
    rows += block.rows();
    progress.tell("writing", static_cast<double>(rows) / static_cast<double>(report.rows));
  }
  writer->commit();
  const std::vector<std::string> said = logs::sentences(report);
  const Json json = {{"schema", "wheelwright/convert/1"},
                     {"file", to.string()},
                     {"rows", report.rows},
                     {"rows_read", report.rows_read},
                     {"segments", report.segments},
                     {"seconds", report.seconds},
                     {"columns", log->columns()},
                     {"notes", said}};
  publish(a.common, json, "convert.json", {});
  if (!a.common.json && !a.common.quiet) {
    print_log(said);
    say("wrote {}: {} rows, {:.6g} s in {} segment{}, columns t", to.string(), report.rows, report.seconds,
        report.segments, report.segments == 1 ? "" : "s");
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
