// SPDX-License-Identifier: Apache-2.0
// Mutated and truncated inputs: either InputError or something clean.
#include <cmath>
#include <random>
#include <string>

#include <nlohmann/json.hpp>

#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::fuzz_test {
namespace {

using Fuzz = testing::ScratchTest;

std::string mutated(std::string text, std::mt19937_64& random, const std::string& spice) {
  if (random() % 4 == 0) {
    text.resize(random() % (text.size() + 1));
  }
  for (std::uint64_t left = random() % 6; left > 0 && !text.empty(); --left) {
    const std::size_t at = random() % text.size();
    switch (random() % 5) {
      case 0: text[at] = static_cast<char>(random()); break;
      case 1: text.erase(at, 1 + random() % 8); break;
      case 2: text.insert(at, 1, spice[random() % spice.size()]); break;
      case 3: text.insert(at, text.substr(random() % text.size(), random() % 40)); break;
      default: text[at] = spice[random() % spice.size()];
    }
  }
  return text;
}

void expect_clean(const LogTable& table) {
  TableSource source(table);  // throws on NaN, unequal columns, and times that do not increase in a segment
  ASSERT_GE(table.rows(), 1u);
  ASSERT_EQ(table.segment_starts.front(), 0u);
}

TEST_F(Fuzz, Csv) {
  std::mt19937_64 random(11);
  std::string good = "t,omega_r,note,theta\n# comment\n";
  for (int k = 0; k < 40; ++k) {
    good += std::to_string(0.01 * k) + "," + std::to_string(0.1 * k) + ",\"a,b\"," + std::to_string(k % 6) + "\n";
  }
  int clean = 0, rejected = 0;
  for (int k = 0; k < 4000; ++k) {
    const auto file = put("log.csv", mutated(good, random, ",;\t\"\r\n#-+.eE0123456789naif \xEF"));
    try {
      CsvOptions options;
      options.block_rows = 1 + random() % 50;
      CsvLog log({file}, options);
      const LogTable table = read_all(log);
      expect_clean(table);
      const LogReport& report = log.report();
      ASSERT_EQ(report.rows, table.rows());
      ASSERT_EQ(report.rows_read, report.rows + report.empty.count + report.not_finite.count + report.duplicates.count +
                                      report.truncated.count);
      ASSERT_EQ(report.segments, table.segment_starts.size());
      ++clean;
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("log.csv"), std::string::npos) << error.what();
      ++rejected;
    }
  }
  EXPECT_GT(clean, 100);
  EXPECT_GT(rejected, 100);
}

TEST_F(Fuzz, PackedCsv) {
  std::mt19937_64 random(12);
  LogTable table;
  table.names = {"omega_r"};
  table.columns.resize(1);
  for (int k = 0; k < 200; ++k) {
    table.t.push_back(0.01 * k);
    table.columns[0].push_back(std::sin(0.1 * k));
  }
  for (const char* name : {"a.csv.gz", "a.csv.zst"}) {
    write_csv(path(name), table);
    const std::string good = bytes(path(name));
    for (int k = 0; k < 1000; ++k) {
      const auto file = put("log.csv", mutated(good, random, std::string("\x00\xFF\x1F\x8B", 4)));
      try {
        CsvLog log({file});
        expect_clean(read_all(log));
      } catch (const InputError&) {
      }
    }
  }
}

TEST_F(Fuzz, RowParser) {
  std::mt19937_64 random(13);
  CsvRowParser parser("t,omega_r,theta");
  LogBlock block;
  std::size_t rows = 0;
  for (int k = 0; k < 20000; ++k) {
    const std::string line = std::to_string(0.01 * k) + ",1.5,0.25";
    try {
      if (parser.parse(random() % 2 == 0 ? line : mutated(line, random, ",;\"\r\n#-+.e0123456789nai "), block)) {
        ++rows;
        ASSERT_TRUE(std::isfinite(block.t[0]) && std::isfinite(block.columns[0][0]) &&
                    std::isfinite(block.columns[1][0]));
      }
    } catch (const InputError&) {
    }
  }
  EXPECT_EQ(parser.report().rows, rows);
  EXPECT_GT(rows, 5000u);
}

TEST_F(Fuzz, Robot) {
  std::mt19937_64 random(14);
  const std::string good =
      "name: r\nmodel: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\nlever_arm: half_track\n"
      "effort: {kind: torque, hold: zero_order}\nnominal: {mass: 21.0, yaw_inertia: 0.9}\nprior:   {mass: [5, 60]}\n"
      "noise:   {wheel_speed: 0.02, effort: estimate}\nfilter:  {order: 2, alpha: 20, beta: 20}\nlimits: {effort: 6}\n";
  int accepted = 0, rejected = 0;
  for (int k = 0; k < 5000; ++k) {
    const std::string text = mutated(good, random, ":{}[],-&*!|>'\"%@`#? \n\t.0123456789eE~");
    try {
      const Robot robot = robots::parse_robot(text, "robot.yaml");
      ASSERT_EQ(robots::to_json(robots::robot_from_json(robots::to_json(robot), "r")), robots::to_json(robot));
      ++accepted;
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("robot.yaml"), std::string::npos) << error.what();
      ++rejected;
    }
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(rejected, 100);
}

TEST_F(Fuzz, JsonText) {
  std::mt19937_64 random(15);
  const std::string good =
      R"({"schema": "wheelwright/model/1", "parameters": [{"name": "m", "lower": 1.5}], "x": null})";
  for (int k = 0; k < 5000; ++k) {
    try {
      const Json value = files::parse_json(mutated(good, random, "{}[],:\"\\0123456789eE-+.tfn "), "m.json");
      ASSERT_EQ(files::parse_json(files::json_text(value), "again"), value);
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("m.json"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace wheelwright::logs::fuzz_test
