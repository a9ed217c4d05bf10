// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/csv.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::logs::csv_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::IsEmpty;

/// A log of `rows` rows t, omega_r, omega_l, tau_r, tau_l, theta at 100 Hz with a gap after a third and a reset after
/// two thirds.
LogTable sample_table(std::size_t rows, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  LogTable table;
  table.names = {"omega_r", "omega_l", "tau_r", "tau_l", "theta"};
  table.columns.resize(5);
  double t = 0.0, theta = 0.0;
  for (std::size_t k = 0; k < rows; ++k) {
    const bool gap = k == rows / 3, reset = k == 2 * rows / 3;
    t = reset ? 0.25 : t + (gap ? 3.0 : 0.01 + 0.001 * uniform());
    theta = reset || gap ? uniform() : theta + 0.3 * uniform();
    if (k == 0 || gap || reset) {
      table.segment_starts.push_back(k);
    }
    table.t.push_back(t);
    for (std::size_t c = 0; c < 4; ++c) {
      table.columns[c].push_back(20.0 * uniform());
    }
    table.columns[4].push_back(theta);
  }
  return table;
}

void expect_same(const LogTable& a, const LogTable& b) {
  EXPECT_EQ(a.names, b.names);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.columns, b.columns);
  EXPECT_EQ(a.segment_starts, b.segment_starts);
}

std::string rows_of(int first, int last, const std::string& rest = ",1,2") {
  std::string text;
  for (int k = first; k < last; ++k) {
    text += std::to_string(k) + rest + "\n";
  }
  return text;
}

class Csv : public testing::ScratchTest {
 protected:
  LogTable read(const std::string& text, const CsvOptions& options = {}) {
    CsvLog log({put("log.csv", text)}, options);
    report = log.report();
    return read_all(log);
  }
  LogReport report;
};

using CsvError = Csv;

TEST_F(Csv, ReadsBackWhatWasWrittenInEveryPacking) {
  const LogTable table = sample_table(3000);
  for (const char* name : {"log.csv", "log.csv.gz", "log.csv.zst"}) {
    write_csv(path(name), table);
    CsvLog log({path(name)});
    expect_same(read_all(log), table);
    EXPECT_EQ(log.report().rows, 3000u);
    EXPECT_EQ(log.report().segments, 3u);
    EXPECT_EQ(log.report().gaps.count, 1u);
    EXPECT_EQ(log.report().resets.count, 1u);
    EXPECT_EQ(log.report().files[0].bytes, std::filesystem::file_size(path(name)));
  }
  CsvLog plain({path("log.csv")}), gzip({path("log.csv.gz")}), zstd({path("log.csv.zst")});
  EXPECT_EQ(plain.report().files[0].packing, "plain");
  EXPECT_EQ(gzip.report().files[0].packing, "gzip");
  EXPECT_EQ(zstd.report().files[0].packing, "zstd");
  EXPECT_LT(gzip.report().files[0].bytes, plain.report().files[0].bytes);
  EXPECT_EQ(files(), 3u) << "temporaries were left behind";
}

TEST_F(Csv, ReadsPackedFilesOfSeveralMembers) {
  write_csv(path("whole.csv.gz"), sample_table(300));
  const std::string text = "\n\n# end\n";
  LogTable nothing;
  write_csv(path("more.csv.gz"), nothing);  // a second gzip member: the line "t"
  put("two.csv", bytes(path("whole.csv.gz")) + bytes(path("more.csv.gz")));
  EXPECT_THAT(input_error([&] { CsvLog log({path("two.csv")}); }), HasSubstr("two.csv:302: 1 fields: expected 6"));
}

TEST_F(Csv, BlocksDoNotDependOnTheirSize) {
  const LogTable table = sample_table(1000);
  write_csv(path("log.csv"), table);
  for (const std::size_t rows : {1, 2, 7, 333, 334, 999, 1000, 1001, 100000}) {
    CsvOptions options;
    options.block_rows = rows;
    CsvLog log({path("log.csv")}, options);
    expect_same(read_all(log), table);
    expect_same(read_all(log), table);
    LogBlock block;
    std::size_t expected_first = 0;
    while (log.next(block)) {
      EXPECT_EQ(block.first_row, expected_first);
      EXPECT_LE(block.rows(), rows);
      expected_first += block.rows();
    }
    EXPECT_EQ(expected_first, 1000u);
    EXPECT_EQ(block.rows(), 0u);
  }
}

TEST_F(Csv, EachFileBeginsASegmentAndSharedColumnsAreKept) {
  put("a.csv", "t,omega_r,tau_r\n" + rows_of(0, 30));
  put(
      "b.csv", "tau_r;t;x\n" + [] {
        std::string text;
        for (int k = 30; k < 50; ++k) {
          text += "5;" + std::to_string(k) + ";7\n";
        }
        return text;
      }());
  CsvLog log({path("a.csv"), path("b.csv")});
  const LogTable table = read_all(log);
  EXPECT_THAT(table.names, ElementsAre("tau_r"));
  EXPECT_THAT(table.segment_starts, ElementsAre(0u, 30u));
  EXPECT_EQ(table.columns[0][29], 2.0);
  EXPECT_EQ(table.columns[0][30], 5.0);
  ASSERT_EQ(log.report().files.size(), 2u);
  EXPECT_EQ(log.report().files[0].rows, 30u);
  EXPECT_EQ(log.report().files[0].seconds, 29.0);
  EXPECT_EQ(log.report().files[1].rows, 20u);
  EXPECT_EQ(log.report().seconds, 29.0 + 19.0);
  EXPECT_THAT(log.report().files[0].ignored, ElementsAre("omega_r"));
}

TEST_F(Csv, ReadsEveryDressOfTheSameTable) {
  const std::string lines = rows_of(0, 40);
  const LogTable expected = read("t,omega_r,tau_r\n" + lines);
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
    return text;
  };
  const std::string plain = "t,omega_r,tau_r\n" + lines;
  expect_same(read(replaced(plain, ",", ";")), expected);
  expect_same(read(replaced(plain, ",", "\t")), expected);
  expect_same(read(replaced(plain, ",", " , ")), expected);
  expect_same(read(replaced(plain, "\n", "\r\n")), expected);
  expect_same(read("\xEF\xBB\xBF" + plain), expected);
  expect_same(read("# recorded on Monday\n\n" + replaced(plain, "\n", "\n# note, with, commas\n\n")), expected);
  expect_same(read(plain.substr(0, plain.size() - 1)), expected);
  expect_same(read(replaced(plain, "\n", ",\n")), expected);
  expect_same(read(replaced(plain, "t,omega_r,tau_r\n", "\"t\",\"omega_r\",\"tau_r\"\n")), expected);
  expect_same(read(replaced(lines, ",1,2", ",\"a, b\",\"1\",+2.0e0").insert(0, "t,note,omega_r,tau_r\n")), expected);
  expect_same(read("Time [s],Right Wheel Speed (rad/s),Torque-R [N*m]\n" + lines), expected);
}

TEST_F(Csv, UnderstandsOtherNames) {
  const LogTable table =
      read("stamp,wheel_right_vel,left_wheel_speed,abs_current_r,yaw,battery\n" + rows_of(0, 20, ",1,2,3,0.5,full"));
  EXPECT_THAT(table.names, ElementsAre("omega_r", "omega_l", "current_r", "theta"));
  EXPECT_THAT(report.files[0].ignored, ElementsAre("battery"));
}

TEST_F(Csv, MapsAndExtraColumns) {
  CsvOptions options;
  options.map = {{"tau_r", "motor A"}, {"battery", "U bat"}};
  options.extra = {"temperature"};
  const LogTable table = read("t,motor A,U bat,temperature,tau_r\n" + rows_of(0, 20, ",1,2,3,4"), options);
  EXPECT_THAT(table.names, ElementsAre("tau_r", "battery", "temperature"));
  EXPECT_EQ(table.column("tau_r")[0], 1.0);
  EXPECT_EQ(table.column("battery")[0], 2.0);
}

TEST_F(Csv, AFactorBehindAColumnsNameConvertsItsNumbers) {
  // As VESC Tool writes them: ms of the day, electrical turns a minute, beyond what rad/s may be, an end without a
  // name.
  std::string text = "ms_today;erpm;q_axis_current;a*2;\n";
  for (int k = 0; k < 30; ++k) {
    text += fmt::format("{};{};\"-2.5\";{};\n", 36000000 + 20 * k, 42000 + k, k);
  }
  CsvOptions options;
  options.map = {
      {"t", "ms_today*0.001"}, {"velocity", "erpm * 0.005"}, {"effort", "q_axis_current*-2"}, {"position", "a*2"}};
  const LogTable table = read(text, options);
  ASSERT_EQ(table.rows(), 30U);
  EXPECT_NEAR(table.t[1] - table.t[0], 0.02, 1e-9);
  EXPECT_DOUBLE_EQ(table.column("velocity")[3], 42003 * 0.005);
  EXPECT_DOUBLE_EQ(table.column("effort")[3], 5.0);
  EXPECT_DOUBLE_EQ(table.column("position")[3], 3.0);  // a column that is called so
  EXPECT_THAT(report.files[0].notes, ::testing::Contains(HasSubstr("velocity is erpm times 0.005")));

  for (const char* raw : {"erpm*5", "erpm*zero"}) {  // beyond what a speed may be; no factor
    options.map["velocity"] = raw;
    EXPECT_THAT(input_error([&] { read(text, options); }), AllOf(HasSubstr("log.csv"), HasSubstr("erpm")));
  }
}

TEST_F(CsvError, LogsOfKnownProgramsSayWhatToWrite) {
  EXPECT_THAT(
      input_error([&] { read("ms_today;q_axis_current;erpm;\n1;2;3;\n"); }),
      AllOf(HasSubstr("VESC Tool"), HasSubstr("t: ms_today*0.001, velocity: erpm*F, effort: q_axis_current*K")));
  CsvOptions options;
  options.extra = {"odrv0.axis0.encoder.vel_estimate"};
  const CsvLog odrive(
      {put("odrive.csv", "t,odrv0.axis0.encoder.vel_estimate,odrv0.axis1.encoder.vel_estimate\n" + rows_of(0, 30))},
      options);
  EXPECT_THAT(input_error([&] { require_columns(odrive, {"omega_r|phi_r"}); }),
              AllOf(HasSubstr("ODrive"), HasSubstr("omega_l: odrv0.axis1.encoder.vel_estimate*F")));
}

TEST_F(Csv, OnlyWantedColumnsMatter) {
  CsvOptions options;
  options.only = {"omega_r"};
  const LogTable table = read("t,omega_r,x\n" + rows_of(0, 20, ",1,lost"), options);
  EXPECT_THAT(table.names, ElementsAre("omega_r"));
  EXPECT_TRUE(report.clean());
}

TEST_F(Csv, CountsEveryRowThatItDrops) {
  const LogTable table =
      read("t,omega_r,tau_r\n" + rows_of(0, 10) + "10,,2\n10.2,nan,2\n10.4,1,-inf\n10.5,1,NA\n11,1,2\n" +
           "11,3,4\n11.0,5,6\n" + rows_of(12, 30) + "30,1");
  EXPECT_EQ(table.rows(), 10u + 1u + 18u);
  EXPECT_EQ(report.rows, table.rows());
  EXPECT_EQ(report.rows_read, table.rows() + 7u);
  EXPECT_EQ(report.empty.count, 2u);
  EXPECT_THAT(report.empty.first, HasSubstr("log.csv:12, column omega_r"));
  EXPECT_EQ(report.not_finite.count, 2u);
  EXPECT_THAT(report.not_finite.first, HasSubstr("log.csv:13, column omega_r"));
  EXPECT_EQ(report.duplicates.count, 2u);
  EXPECT_THAT(report.duplicates.first, HasSubstr("log.csv:17"));
  EXPECT_EQ(report.truncated.count, 1u);
  EXPECT_THAT(report.truncated.first, HasSubstr("log.csv:37"));
  EXPECT_EQ(table.column("omega_r")[10], 1.0) << "the first of equal time stamps stays";
  EXPECT_EQ(sentences(report).size(), 4u);
  EXPECT_FALSE(report.clean());
}

TEST_F(Csv, TheFirstTimeIsLookedAtLikeEveryOther) {
  for (const std::string nothing : {"nan", "inf", " nan"}) {
    const LogTable table = read("t,omega_r\n" + nothing + ",7\n" + rows_of(0, 20, ",1"));
    EXPECT_EQ(table.rows(), 20u) << nothing;
    EXPECT_EQ(table.t[0], 0.0);
    EXPECT_EQ(report.not_finite.count, 1u);
    EXPECT_THAT(report.not_finite.first, HasSubstr("log.csv:2, column t"));
  }
  EXPECT_EQ(read("t,omega_r\nnan,7\n" + rows_of(0, 30, "0000000,1").insert(0, "1700000000000000000,1\n")).t[0], 0.0)
      << "a clock begins with the first time that is one";
  for (const std::string far : {"1e30", " -1e12", "1e15"}) {
    EXPECT_THAT(input_error([&] { read("t,omega_r\n" + far + ",7\n" + rows_of(0, 20, ",1")); }),
                HasSubstr("log.csv:2: column 't'"));
  }
}

TEST_F(Csv, CountsOfAClockAreSubtractedWithoutOverflow) {
  const LogTable table =
      read("t,omega_r\n1700000000000000000,1\n-9223372036854775808,1\n" + rows_of(0, 20, "00000000,1"));
  EXPECT_NEAR(table.t[1], -9.223372036854775808e9 - 1.7e9, 1e-5);
  EXPECT_EQ(report.resets.count, 1u);
}

TEST_F(Csv, DropsACutNumberAtTheEndOnly) {
  EXPECT_EQ(read("t,omega_r\n" + rows_of(0, 20, ",1") + "20,-1.5e").rows(), 20u);
  EXPECT_EQ(report.truncated.count, 1u);
  EXPECT_THAT(input_error([&] { read("t,omega_r\n" + rows_of(0, 20, ",1") + "20,-1.5e\n"); }),
              HasSubstr(":22: column"));
  EXPECT_EQ(read("t,omega_r\n" + rows_of(0, 20, ",1") + "20,-\n").rows(), 20u) << "a dash says that it is missing";
  EXPECT_EQ(report.empty.count, 1u);
}

TEST_F(Csv, SplitsAtGapsOfMoreThanFiveSteps) {
  const LogTable table = read("t,omega_r\n" + rows_of(0, 15, ",1") + rows_of(19, 30, ",1") + rows_of(36, 40, ",1"));
  EXPECT_THAT(table.segment_starts, ElementsAre(0u, 26u)) << "a step of 5 is none, a step of 7 is one";
  EXPECT_EQ(report.gaps.count, 1u);
  EXPECT_THAT(report.gaps.first, HasSubstr("log.csv:28"));
  EXPECT_EQ(report.median_step, 1.0);
}

TEST_F(Csv, SplitsWhereTimeGoesBack) {
  const LogTable table = read("t,omega_r\n" + rows_of(0, 15, ",1") + rows_of(3, 20, ",1"));
  EXPECT_THAT(table.segment_starts, ElementsAre(0u, 15u));
  EXPECT_EQ(report.resets.count, 1u);
  EXPECT_THAT(report.resets.first, HasSubstr("log.csv:17"));
  EXPECT_EQ(report.rows, report.rows_read);
}

TEST_F(Csv, UnwrapsTheHeadingInsideSegments) {
  std::string text = "t,theta\n";
  for (int k = 0; k < 200; ++k) {
    text += std::to_string(k + (k >= 100 ? 50 : 0)) + "," +
            std::to_string(std::remainder(0.7 * k, 2.0 * std::numbers::pi)) + "\n";
  }
  const LogTable table = read(text);
  ASSERT_EQ(table.segment_starts.size(), 2u);
  const auto& theta = table.column("theta");
  for (std::size_t k = 1; k < 200; ++k) {
    if (k != 100) {
      ASSERT_NEAR(theta[k] - theta[k - 1], 0.7, 2e-6) << k;
    }
  }
  EXPECT_LE(std::abs(theta[100]), std::numbers::pi) << "a segment begins with the heading as logged";
  EXPECT_GE(report.wraps.count, 20u);
}

TEST_F(Csv, WheelAnglesWrappedAtATurnAreUnwrappedAndCounted) {
  for (const bool from_zero : {false, true}) {
    std::string text = "t,phi_r,phi_l\n";
    const double turn = 2.0 * std::numbers::pi;
    for (int k = 0; k < 400; ++k) {
      const double right = 0.3 * k, left = 40.0 * std::sin(0.02 * k);
      const auto wrapped = [&](double angle) {
        return from_zero ? angle - turn * std::floor(angle / turn) : std::remainder(angle, turn);
      };
      text += fmt::format("{},{:.9f},{:.9f}\n", 0.01 * k, wrapped(right), wrapped(left));
    }
    const LogTable table = read(text);
    for (std::size_t k = 1; k < table.rows(); ++k) {
      ASSERT_NEAR(table.column("phi_r")[k] - table.column("phi_r")[k - 1], 0.3, 1e-8) << k;
      const double left =
          40.0 * (std::sin(0.02 * static_cast<double>(k)) - std::sin(0.02 * static_cast<double>(k - 1)));
      ASSERT_NEAR(table.column("phi_l")[k] - table.column("phi_l")[k - 1], left, 1e-8) << k;
    }
    EXPECT_GE(report.angle_wraps.count, 30u);
    EXPECT_EQ(report.rows, 400u);
    const std::vector<std::string> told = sentences(report);
    EXPECT_TRUE(std::ranges::any_of(told, [](const std::string& s) { return s.find("wrapped") != std::string::npos; }));
  }
}

// A wheel so fast that a step is most of a turn, and a counter that is set back: neither is a wrap.
TEST_F(Csv, WheelAnglesThatAreNotWrappedStayAsTheyAre) {
  std::string text = "t,phi_r,phi_l\n";
  for (int k = 0; k < 200; ++k) {
    text += fmt::format("{},{},{}\n", 0.1 * k, 5.5 * k, k < 100 ? 0.5 * k : 0.5 * k - 50.0);
  }
  const LogTable table = read(text);
  for (std::size_t k = 0; k < table.rows(); ++k) {
    ASSERT_EQ(table.column("phi_r")[k], 5.5 * static_cast<double>(k));
    ASSERT_EQ(table.column("phi_l")[k], 0.5 * static_cast<double>(k) - (k < 100 ? 0.0 : 50.0));
  }
  EXPECT_EQ(report.angle_wraps.count, 0u);
  EXPECT_EQ(report.jumps.count, 1u);
  EXPECT_THAT(report.jumps.first, HasSubstr("log.csv:102, column phi_l"));
  EXPECT_THAT(table.segment_starts, ElementsAre(0u, 100u));
}

// The range of a counter: some turns, 2^16 or 2^32 counts. The first jump could be a counter that was set back.
TEST_F(Csv, AWheelAngleWrappedAtTheRangeOfItsCounterIsUnwrappedFromTheSecondJumpOn) {
  struct Counter {
    double counts, range;  // a turn, in counts
  };
  for (const auto& [counts, range] :
       {Counter{4096.0, 0x1p16}, Counter{500.0, 0x1p16}, Counter{8192.0, 0x1p16}, Counter{32768.0, 0x1p16}}) {
    for (const double sign : {1.0, -1.0}) {
      const double count = 2.0 * std::numbers::pi / counts;
      std::string text = "t,phi_r,phi_l\n";
      std::vector<double> truth;
      const double fast = range * count / 40.0;  // a wrap in 40 rows: turns a row are no matter here
      double angle = 0.3 * range * count, t = 0.0;
      for (int k = 0; k < 400; ++k, t += 1.0) {
        angle += k % 50 == 0 ? sign * count : sign * fast * (1.0 + 0.002 * std::sin(0.1 * k));
        const double whole = std::floor(angle / count);
        truth.push_back(whole * count);
        text += fmt::format("{},{:.12g},0\n", t * fast / 20.0, (whole - range * std::floor(whole / range)) * count);
      }
      const LogTable table = read(text);
      EXPECT_EQ(report.jumps.count, 1u) << counts << ' ' << range;
      ASSERT_EQ(table.segment_starts.size(), 2u);
      const std::size_t first = table.segment_starts[1];
      for (std::size_t k = first; k < table.rows(); ++k) {
        ASSERT_NEAR(table.column("phi_r")[k] - table.column("phi_r")[first], truth[k] - truth[first],
                    1e-9 * std::abs(truth[k]))
            << counts << ' ' << k;
      }
    }
  }
}

// Drives that wrap at ±12.5 rad or at 27 rad, degrees, and a counter that is set behind its first sample.
TEST_F(Csv, AWheelAngleThatJumpsAsNoWheelTurnsBeginsASegment) {
  const auto wrapped = [](double angle, double from, double period) {
    return angle - period * std::floor((angle - from) / period);
  };
  const auto rows = [&](auto&& angle, double step = 0.01) {
    std::string text = "t,phi_r,phi_l\n";
    for (int k = 0; k < 400; ++k) {
      text += fmt::format("{},{},{}\n", step * k, angle(step * k), 3.0 * step * k);
    }
    return read(text);
  };
  for (const auto& [from, period] : {std::pair{-12.5, 25.0}, std::pair{0.0, 27.0}}) {
    const LogTable table = rows([&](double t) { return wrapped(-20.0 * t - 1.0, from, period); });
    EXPECT_EQ(report.jumps.count, table.segment_starts.size() - 1) << period;
    EXPECT_GE(report.jumps.count, 2u) << period;
    for (std::size_t k = 1; k < table.rows(); ++k) {
      const bool starts = std::ranges::count(table.segment_starts, k) > 0;
      ASSERT_EQ(starts, std::abs(table.column("phi_r")[k] - table.column("phi_r")[k - 1]) > 1.0) << k;
    }
  }
  EXPECT_EQ(rows([&](double t) { return wrapped(900.0 * t, 0.0, 360.0); }).segment_starts.size(), 10u);
  EXPECT_THAT(rows([](double t) { return t == 0.0 ? 500.0 : 2.0 * t; }).segment_starts, ElementsAre(0u, 2u));
  // As rough as wheels get: from standstill to 60 rad/s within a sample of 20 Hz, and an encoder of four counts a turn.
  EXPECT_EQ(rows([](double t) { return t < 5.0 ? 0.0 : 60.0 * (t - 5.0); }, 0.05).segment_starts.size(), 1u);
  EXPECT_EQ(rows([](double t) { return 0.5 * std::numbers::pi * std::floor(7.0 * t); }, 0.001).segment_starts.size(),
            1u);
}

TEST_F(Csv, MedianStepIsThatOfTheFirstSteps) {
  EXPECT_EQ(read("t\n" + rows_of(0, 25, "")).rows(), 25u);
  EXPECT_EQ(report.median_step, 1.0);
  const LogTable table = sample_table(500);
  write_csv(path("t.csv"), table);
  CsvLog log({path("t.csv")});
  std::vector<double> steps;
  for (std::size_t k = 1; k < 500; ++k) {
    if (table.t[k] > table.t[k - 1]) {
      steps.push_back(table.t[k] - table.t[k - 1]);
    }
  }
  std::sort(steps.begin(), steps.end());
  EXPECT_EQ(log.median_step(), steps[steps.size() / 2]);
}

TEST_F(CsvError, FilesThatAreNone) {
  const auto error = [&](const std::filesystem::path& file) { return input_error([&] { CsvLog log({file}); }); };
  EXPECT_THAT(error(path("absent.csv")), HasSubstr("absent.csv: no such file"));
  EXPECT_THAT(error(directory_), HasSubstr("is a directory: expected a file"));
  EXPECT_THAT(error(put("empty.csv", "")), HasSubstr("empty.csv: is empty"));
  EXPECT_THAT(error(put("comments.csv", "# nothing\n\n")), HasSubstr("comments.csv: no header line"));
  EXPECT_THAT(error(put("binary.csv", std::string("\x01\x02\x00\x07\xFF,\n", 8))),
              HasSubstr("binary.csv:1: binary data: expected a header line"));
  EXPECT_THAT(error(put("bag.csv", std::string("SQLite format 3\0abc", 19))), HasSubstr("is an SQLite file"));
  EXPECT_THAT(error(put("a.zip", "PK\x03\x04zzzzzzzzz")), HasSubstr("is a zip archive: expected text"));
  EXPECT_THAT(error(put("long.csv", "t," + std::string(400000, 'x'))), HasSubstr("long.csv:1: a line of more than"));
  EXPECT_THAT(error("/dev/null"), HasSubstr("pipe or a device"));
}

TEST_F(CsvError, DamagedPacking) {
  write_csv(path("log.csv.gz"), sample_table(2000));
  write_csv(path("log.csv.zst"), sample_table(2000));
  for (const char* name : {"log.csv.gz", "log.csv.zst"}) {
    const std::string good = bytes(path(name));
    put("cut", good.substr(0, good.size() / 2));
    EXPECT_THAT(input_error([&] { CsvLog log({path("cut")}); }), HasSubstr("stream ends early"));
    std::string bad = good;
    for (std::size_t k = bad.size() / 2; k < bad.size() / 2 + 50; ++k) {
      bad[k] = static_cast<char>(~bad[k]);
    }
    put("bad", bad);
    EXPECT_THAT(input_error([&] { CsvLog log({path("bad")}); }), HasSubstr("bad"));
  }
}

TEST_F(CsvError, Headers) {
  const auto error = [&](const std::string& header, const CsvOptions& options = {}) {
    return input_error([&] { read(header + "\n" + rows_of(0, 30), options); });
  };
  EXPECT_THAT(error("0.1,2.5,3"), AllOf(HasSubstr("log.csv:1"), HasSubstr("expected a header line")));
  EXPECT_THAT(error("tme,omega_r,tau_r"), AllOf(HasSubstr("log.csv:1: no column for t (time, s)"),
                                                HasSubstr("tme, omega_r, tau_r"), HasSubstr("did you mean 'tme'?")));
  EXPECT_THAT(error("t,w_r,wheel_right_vel"),
              AllOf(HasSubstr("'w_r' and 'wheel_right_vel' both mean omega_r"), HasSubstr("--map omega_r=COLUMN")));
  EXPECT_THAT(error("t,omega_r,omega_r"), HasSubstr("two columns are called 'omega_r'"));
  CsvOptions map;
  map.map = {{"tau_r", "torq"}};
  EXPECT_THAT(error("t,omega_r,torque", map),
              AllOf(HasSubstr("no column 'torq'"), HasSubstr("--map tau_r=torq"), HasSubstr("did you mean 'torque'?")));
  CsvOptions extra;
  extra.extra = {"batery"};
  EXPECT_THAT(error("t,omega_r,battery", extra), AllOf(HasSubstr("no column 'batery'"), HasSubstr("'battery'?")));
  CsvOptions twice;
  twice.map = {{"tau_r", "a"}, {"tau_l", "a"}};
  EXPECT_THAT(error("t,omega_r,a", twice), HasSubstr("column 'a' is taken for"));
  // Which of two columns a name means is not guessed.
  EXPECT_THAT(error("t,omega_r,torq,torq", map), HasSubstr("column 'torq' stands there twice: expected one"));
  EXPECT_THAT(error("t,omega_r,Torq,TORQ", map), HasSubstr("no column 'torq'"));
}

TEST_F(CsvError, Rows) {
  const std::string head = "t,omega_r,tau_r\n" + rows_of(0, 30);
  const auto error = [&](const std::string& row) { return input_error([&] { read(head + row + "\n40,1,2\n"); }); };
  EXPECT_THAT(error("31,fast,2"), HasSubstr("log.csv:32: column 'omega_r': 'fast': expected a number"));
  EXPECT_THAT(error("31,1.5x,2"), HasSubstr("'1.5x': expected a number"));
  EXPECT_THAT(error("12:30:01,1,2"), HasSubstr("log.csv:32: column 't': '12:30:01': expected a number"));
  EXPECT_THAT(error("31,1"), AllOf(HasSubstr("log.csv:32: 2 fields: expected 3"), HasSubstr("'31,1'")));
  EXPECT_THAT(error("31,1,2,3"), HasSubstr("log.csv:32: 4 fields: expected 3"));
  EXPECT_THAT(
      error("31,57000,2"),
      HasSubstr("log.csv:32: column 'omega_r': '57000': expected speed of the right wheel in rad/s, of magnitude "
                "at most 10000"));
  EXPECT_THAT(error("1.7e18,1,2"), HasSubstr("column 't': '1.7e18': expected time in s"));
  EXPECT_THAT(error(std::string("31,\0\0\0,2", 8)), HasSubstr("expected a number"));
  EXPECT_THAT(input_error([&] { read("t;omega_r\n0.5;0,5\n1;0,7\n"); }),
              HasSubstr("'0,5': expected a number with a decimal point"));
}

TEST_F(CsvError, TooFewRowsAndNoTime) {
  EXPECT_THAT(input_error([&] { read("t,omega_r\n" + rows_of(0, 19, ",1") + "19,nan\n"); }),
              AllOf(HasSubstr("19 usable rows of 20: expected at least 20"), HasSubstr("NaN or infinite")));
  EXPECT_THAT(input_error([&] { read("t,omega_r\n"); }), HasSubstr("0 usable rows"));
  std::string back = "t,omega_r\n";
  for (int k = 50; k > 0; --k) {
    back += std::to_string(k) + ",1\n";
  }
  EXPECT_THAT(input_error([&] { read(back); }), HasSubstr("column t never increases"));
}

TEST_F(CsvError, MissingColumnsAreNamedWithTheNearest) {
  put("log.csv", "t,omega_r,torqe_r\n" + rows_of(0, 20));
  CsvLog log({path("log.csv")});
  require_columns(log, {"t", "omega_r", "omega_r|phi_r", "phi_r|omega_r"});
  EXPECT_THAT(input_error([&] {
                require_columns(log, {"omega_r", "tau_r|torque_r", "x"});
              }),
              AllOf(HasSubstr("log.csv: no column for tau_r (torque at the right wheel, N·m) or torque_r; x"),
                    HasSubstr("the file has t, omega_r, torqe_r"), HasSubstr("did you mean 'torqe_r'?")));
  const LogTable table = sample_table(30);
  TableSource source(table);
  EXPECT_THAT(input_error([&] { require_columns(source, {"tau_rr"}, "table"); }),
              AllOf(HasSubstr("table: no column for tau_rr"), HasSubstr("omega_r, omega_l, tau_r, tau_l, theta")));
}

TEST_F(CsvError, MissingInOneOfSeveralFilesNamesThatFile) {
  put("a.csv", "t,omega_r,tau_r\n" + rows_of(0, 20));
  put("b.csv", "t,omega_r,tau\n" + rows_of(0, 20));
  CsvLog log({path("a.csv"), path("b.csv")});
  EXPECT_THAT(input_error([&] { require_columns(log, {"tau_r"}); }), HasSubstr("b.csv: no column for tau_r"));
}

TEST_F(CsvError, Writing) {
  const LogTable table = sample_table(30);
  EXPECT_THAT(input_error([&] { write_csv(path("no/such/directory.csv"), table); }), HasSubstr("directory.csv"));
  EXPECT_THAT(input_error([&] { write_csv(directory_, table); }), HasSubstr("is a directory"));
  LogTable bad = table;
  bad.columns[1][3] = NAN;
  put("old.csv", "old");
  EXPECT_THROW(write_csv(path("old.csv"), bad), InvalidArgument);
  EXPECT_EQ(bytes(path("old.csv")), "old");
  EXPECT_EQ(files(), 1u);
  EXPECT_THROW(CsvLog({}), InvalidArgument);
}

TEST(CsvRowParser, CleansAsTheFileReaderDoes) {
  const std::string lines[] = {"0,0.5,3.0", "1,0.6,3.1", "# note", "1,0.7,3.1", "2,nan,3.1",     "3,0.8,-3.1",
                               "",          "4,,1",      "5,1,-3", "20,1,3",    "21,1,-3.1\r\n", "2,1,0"};
  CsvRowParser parser("t,omega_r,theta\n", {}, 1.0);
  EXPECT_THAT(parser.columns(), ElementsAre("omega_r", "theta"));
  LogTable streamed;
  streamed.names = parser.columns();
  streamed.columns.resize(2);
  LogBlock block;
  for (const std::string& line : lines) {
    if (parser.parse(line, block)) {
      ASSERT_EQ(block.rows(), 1u);
      ASSERT_EQ(block.first_row, streamed.rows());
      if (!block.segment_starts.empty()) {
        streamed.segment_starts.push_back(streamed.rows());
      }
      streamed.t.push_back(block.t[0]);
      streamed.columns[0].push_back(block.columns[0][0]);
      streamed.columns[1].push_back(block.columns[1][0]);
    }
  }
  EXPECT_THAT(streamed.t, ElementsAre(0, 1, 3, 5, 20, 21, 2));
  EXPECT_THAT(streamed.segment_starts, ElementsAre(0u, 4u, 6u));
  EXPECT_EQ(parser.report().duplicates.count, 1u);
  EXPECT_EQ(parser.report().not_finite.count, 1u);
  EXPECT_EQ(parser.report().empty.count, 1u);
  EXPECT_EQ(parser.report().gaps.count, 1u);
  EXPECT_EQ(parser.report().resets.count, 1u);
  EXPECT_EQ(parser.report().segments, 3u);
  EXPECT_NEAR(streamed.columns[1][2], 2.0 * std::numbers::pi - 3.1, 1e-15);
}

TEST(CsvRowParser, GoesOnAfterAnError) {
  CsvRowParser parser("t,omega_r", {}, 1.0, "pipe");
  LogBlock block;
  ASSERT_TRUE(parser.parse("1,2", block));
  EXPECT_THAT(input_error([&] { parser.parse("2,x", block); }), HasSubstr("pipe:3: column 'omega_r': 'x'"));
  EXPECT_THAT(input_error([&] { parser.parse("2", block); }), HasSubstr("pipe:4: 1 fields: expected 2"));
  ASSERT_TRUE(parser.parse("3,2", block));
  EXPECT_THAT(block.segment_starts, IsEmpty());
}

TEST(CsvRowParser, LearnsTheMedianStep) {
  CsvRowParser parser("t,omega_r");
  LogBlock block;
  for (int k = 0; k <= 10; ++k) {
    ASSERT_TRUE(parser.parse(std::to_string(0.01 * k) + ",1", block));
  }
  ASSERT_TRUE(parser.parse("1,1", block));
  EXPECT_THAT(block.segment_starts, IsEmpty()) << "too early to call it a gap";
  for (int k = 1; k <= 20; ++k) {
    ASSERT_TRUE(parser.parse(std::to_string(1 + 0.01 * k) + ",1", block));
  }
  EXPECT_NEAR(parser.report().median_step, 0.01, 1e-12);
  ASSERT_TRUE(parser.parse("2,1", block));
  EXPECT_THAT(block.segment_starts, ElementsAre(0u));
}

}  // namespace
}  // namespace wheelwright::logs::csv_test
