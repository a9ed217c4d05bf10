// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "formats/logs/csv.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::csv_streams_test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

TEST(CsvStreamFinder, GroupsColumnsByTheRowsTheyFill) {
  CsvStreamFinder finder({"x", "omega_r", "y", "tau_r", "gyro_z", "theta"});
  for (int k = 0; k < 100; ++k) {
    const double pose = k % 4 == 1 ? 1.0 : missing, gyro = k % 2 == 1 ? 1.0 : missing;
    const double row[] = {pose, 1.0, pose, k == 50 ? missing : 1.0, gyro, missing};
    finder.add(0.01 * k, row);
  }
  const std::vector<CsvStream> streams = finder.streams();
  ASSERT_EQ(streams.size(), 3U);
  EXPECT_THAT(streams[0].columns, ElementsAre(1U, 3U)) << "one field missing is a defect, not a rate";
  EXPECT_THAT(streams[1].columns, ElementsAre(0U, 2U));
  EXPECT_THAT(streams[2].columns, ElementsAre(4U));
  EXPECT_EQ(streams[0].median_step, 10'000'000);
  EXPECT_EQ(streams[1].median_step, 40'000'000);
  EXPECT_NEAR(streams[1].filled, 0.25, 1e-12);
}

class MergedCsv : public testing::ScratchTest {
 protected:
  static double x_at(double t) { return std::sin(0.9 * t); }

  LogTable read(const std::string& text) {
    CsvLog log({put("log.csv", text)});
    report = log.report();
    return read_all(log);
  }
  LogReport report;
};

TEST_F(MergedCsv, ASlowPoseInTheSameRowsIsInterpolatedAndNoRowIsLost) {
  std::string text = "t,omega_r,tau_r,x\n";
  for (int k = 0; k <= 400; ++k) {
    const double t = 0.01 * k;
    text += fmt::format("{},{},1,{}\n", t, t, k % 5 == 0 ? fmt::format("{}", x_at(t)) : k % 2 == 0 ? "" : "nan");
  }
  const LogTable table = read(text);
  EXPECT_EQ(table.rows(), 401U);
  EXPECT_TRUE(report.clean());
  ASSERT_EQ(report.files[0].interpolated.size(), 1U);
  const double bound = report.files[0].interpolated[0].error;
  EXPECT_LE(bound, 1.13 * 0.81 * 0.05 * 0.05 / 8.0);
  for (std::size_t k = 0; k < table.rows(); ++k) {
    EXPECT_EQ(table.t[k], 0.01 * static_cast<double>(k));
    EXPECT_EQ(table.column("omega_r")[k], table.t[k]);
    EXPECT_LE(std::abs(table.column("x")[k] - x_at(table.t[k])), bound + 1e-15);
  }
  EXPECT_THAT(sentences(report),
              Contains(HasSubstr("x was interpolated between the samples of the rows that have it")));
}

TEST_F(MergedCsv, RowsOfTheirOwnAreBroughtToThoseOfTheEfforts) {
  std::string text = "t,x,omega_r,tau_r\n";
  std::size_t efforts = 0;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.001 * k;
    if (k % 7 == 3) {
      text += fmt::format("{},{},,\n", t, x_at(t));
    } else if (k % 10 == 0) {
      text += fmt::format("{},,{},2\n", t, t);
      ++efforts;
    }
  }
  const LogTable table = read(text);
  EXPECT_EQ(table.rows() + report.uncovered.count, efforts);
  EXPECT_LE(report.uncovered.count, 2U) << "before the first x and behind the last";
  EXPECT_THAT(report.uncovered.first, HasSubstr("log.csv:2, column x"));
  EXPECT_EQ(report.segments, 1U);
  for (std::size_t k = 0; k < table.rows(); ++k) {
    EXPECT_NEAR(table.column("x")[k], x_at(table.t[k]), 1e-5);
    EXPECT_EQ(table.column("omega_r")[k], table.t[k]);
  }
}

TEST_F(MergedCsv, DefectsAreStillToldWithTheirLine) {
  std::string text = "t,omega_r,tau_r,x\n";
  for (int k = 0; k < 100; ++k) {
    text += fmt::format("{},{},1,{}\n", 0.01 * k, k == 40 ? "" : "2", k % 4 == 0 ? "3" : "");
  }
  EXPECT_EQ(read(text).rows(), 99U - 3U) << "behind the last x nothing is made up";
  EXPECT_EQ(report.empty.count, 1U);
  EXPECT_THAT(report.empty.first, HasSubstr("log.csv:42"));
  EXPECT_EQ(report.uncovered.count, 3U);
  EXPECT_THAT(testing::input_error([&] { read(text + "1,2,torque,\n"); }),
              HasSubstr("log.csv:102: column 'tau_r': 'torque'"));
}

TEST_F(MergedCsv, ATimeThatNanosecondsCannotTellIsRefused) {
  std::string text = "t,omega_r,x\n";
  for (int k = 0; k < 30; ++k) {
    text += fmt::format("{},2,{}\n", k == 11 ? 1e10 : 0.02 * k, k % 3 == 0 ? "3" : "");
  }
  EXPECT_THAT(testing::input_error([&] { read(text); }), HasSubstr("log.csv:13: time 10000000000 s"));
  std::string apart = "t,omega_r,x\n";
  for (int k = 0; k < 61; ++k) {
    apart += fmt::format("{},2,{}\n", 4e9 * (k / 30.0 - 1.0), k % 3 == 0 ? "3" : "");
  }
  EXPECT_EQ(read(apart).rows() + report.uncovered.count, 61U) << "steps of years are none that overflow";
}

TEST_F(MergedCsv, AnInfiniteSampleIsNoneAndNothingIsInterpolatedToIt) {
  std::string text = "t,omega_r,x\n";
  for (int k = 0; k < 100; ++k) {
    text += fmt::format("{},2,{}\n", 0.02 * k, k == 60 ? "1e999" : k % 3 == 0 ? "3" : "");
  }
  const LogTable table = read(text);
  EXPECT_EQ(table.rows(), 100U);
  EXPECT_THAT(table.column("x"), ::testing::Each(3.0));
}

}  // namespace
}  // namespace wheelwright::logs::csv_streams_test
