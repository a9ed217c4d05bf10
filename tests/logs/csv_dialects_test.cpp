// SPDX-License-Identifier: Apache-2.0
// Tables as spreadsheets, pandas, MATLAB, PlotJuggler and ROS write them: one drive in every dialect is one table.
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "formats/logs/csv.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/wall_clock.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::csv_dialects_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int rows = 60;
constexpr std::int64_t start = 1'795'941'600;  // 2026-11-29 08:40:00 UTC

double speed(int k) { return 0.25 * k - 3.5; }
double torque(int k) { return -0.125 * (k % 7); }
std::int64_t ns_of(int k) { return 10'000'000LL * k; }

class CsvDialects : public testing::ScratchTest {
 protected:
  LogTable read(const std::string& text, const CsvOptions& options = {}) {
    CsvLog log({put("log.csv", text)}, options);
    report = log.report();
    said = sentences(report);
    return read_all(log);
  }
  void expect_drive(const LogTable& table, double tolerance, const std::string& dialect) {
    ASSERT_EQ(table.rows(), static_cast<std::size_t>(rows)) << dialect;
    ASSERT_EQ(table.names, (std::vector<std::string>{"omega_r", "tau_r"})) << dialect;
    for (int k = 0; k < rows; ++k) {
      const auto at = static_cast<std::size_t>(k);
      EXPECT_NEAR(table.t[at] - table.t[0], 0.01 * k, tolerance) << dialect;
      EXPECT_EQ(table.columns[0][at], speed(k)) << dialect;
      EXPECT_EQ(table.columns[1][at], torque(k)) << dialect;
    }
  }
  LogReport report;
  std::vector<std::string> said;
};

std::string with_comma(std::string number) {
  for (char& c : number) {
    c = c == '.' ? ',' : c;
  }
  return number;
}

struct TimeSpelling {
  const char* name;
  std::function<std::string(int)> text;
  double tolerance = 1e-9;
  bool comma_too = true;   ///< a decimal comma may stand in it
  const char* clock = "";  ///< of the first row
};

std::string fraction_of(int k, int digits) {
  return fmt::format("{:09}", ns_of(k) % 1'000'000'000).substr(0, static_cast<std::size_t>(digits));
}
int second_of(int k) { return static_cast<int>(ns_of(k) / 1'000'000'000); }

std::vector<TimeSpelling> time_spellings() {
  const auto date = [](const char* before, const char* behind, int digits) {
    return [=](int k) { return fmt::format("{}:{:02}.{}{}", before, second_of(k), fraction_of(k, digits), behind); };
  };
  return {
      {"seconds", [](int k) { return fmt::format("{:.6f}", 0.01 * k); }},
      {"pandas", date("2026-11-29 08:40", "", 6), 1e-9, true, "2026-11-29 08:40:00.000"},
      {"pandas of UTC", date("2026-11-29 08:40", "+00:00", 6), 1e-9, true, "2026-11-29 08:40:00.000 UTC"},
      {"ISO 8601", date("2026-11-29T08:40", "Z", 3), 1e-9, true, "2026-11-29 08:40:00.000 UTC"},
      {"ISO with an offset", date("2026-11-29T09:40", "+0100", 9), 1e-9, true, "2026-11-29 08:40:00.000 UTC"},
      {"ISO, basic", [](int k) { return fmt::format("20261129T0840{:02}.{}Z", second_of(k), fraction_of(k, 3)); }, 1e-9,
       true, "2026-11-29 08:40:00.000 UTC"},
      {"German", date("29.11.2026 08:40", "", 3), 1e-9, true, "2026-11-29 08:40:00.000"},
      {"French", date("29/11/2026 08:40", "", 3), 1e-9, true, "2026-11-29 08:40:00.000"},
      {"American", date("11/29/2026 8:40", " AM", 3), 1e-9, true, "2026-11-29 08:40:00.000"},
      {"MATLAB", date("29-Nov-2026 08:40", "", 3), 1e-9, true, "2026-11-29 08:40:00.000"},
      {"time of the day", date("08:40", "", 3)},
      {"timedelta", date("0 days 00:00", "", 6)},
      {"MATLAB's duration", [](int k) { return fmt::format("{:g} sec", 0.01 * k); }, 1e-9, false},
      {"s since 1970", [](int k) { return fmt::format("{}.{}", start + second_of(k), fraction_of(k, 9)); }, 1e-9, true,
       "2026-11-29 08:40:00.000 UTC"},
      {"ms since 1970", [](int k) { return fmt::format("{}", start * 1000 + ns_of(k) / 1'000'000); }, 1e-9, true,
       "2026-11-29 08:40:00.000 UTC"},
      {"µs since 1970", [](int k) { return fmt::format("{}", start * 1'000'000 + ns_of(k) / 1000); }, 1e-9, true,
       "2026-11-29 08:40:00.000 UTC"},
      {"ns since 1970", [](int k) { return fmt::format("{}", start * 1'000'000'000 + ns_of(k)); }, 1e-9, true,
       "2026-11-29 08:40:00.000 UTC"},
  };
}

struct Dialect {
  std::string separator, line_end = "\n";
  bool comma = false, quoted = false;
  std::vector<std::string> header{"t", "omega_r", "tau_r"};
  std::string before{}, units{};  ///< lines before and behind the header
};

std::string written(const Dialect& d, const TimeSpelling& time) {
  const auto field = [&](const std::string& text) { return d.quoted ? "\"" + text + "\"" : text; };
  const auto join = [&](const std::vector<std::string>& fields) {
    std::string line;
    for (const std::string& each : fields) {
      line += (line.empty() ? "" : d.separator) + field(each);
    }
    return line + d.line_end;
  };
  std::string text = d.before + join(d.header) + d.units;
  for (int k = 0; k < rows; ++k) {
    std::vector<std::string> fields = {time.text(k), fmt::format("{:.3f}", speed(k)), fmt::format("{:.3f}", torque(k))};
    for (std::string& each : fields) {
      const bool is_time = &each == &fields.front();
      each = d.comma && (!is_time || time.comma_too) && (!is_time || each.find('-') == std::string::npos) &&
                     (!is_time || each.find('.') == each.rfind('.'))
                 ? with_comma(each)
                 : each;
    }
    text += join(fields);
  }
  return text;
}

TEST_F(CsvDialects, EveryWayToWriteTimesAndNumbersIsTheSameDrive) {
  const std::vector<Dialect> dialects = {
      {","},
      {";", "\r\n"},
      {"\t"},
      {";", "\r\n", true},
      {"\t", "\n", true},
      {",", "\n", true, true},
      {",", "\n", false, true},
      {";", "\r\n", true, true, {"t [s]", "omega_r [rad/s]", "tau_r [Nm]"}},
      {";", "\n", true, false, {"t", "omega_r", "tau_r"}, "sep=;\r\n", ""},
      {";", "\n", true, false, {"t", "omega_r", "tau_r"}, "", "s;rad/s;N m\n"},
      {",",
       "\n",
       false,
       false,
       {"__time", "/joint_states/right_wheel_joint/velocity", "/joint_states/right_wheel_joint/effort"}},
      {",", "\n", false, false, {"t", "omega_r", "tau_r"}, "", "[s],[rad/s],[Nm]\n"},
  };
  for (std::size_t d = 0; d < dialects.size(); ++d) {
    for (const TimeSpelling& time : time_spellings()) {
      const std::string name = fmt::format("dialect {}, {}", d, time.name);
      expect_drive(read(written(dialects[d], time)), time.tolerance, name);
      EXPECT_EQ(clock_time(report.files[0], 0.0), time.clock) << name;
    }
  }
}

/// `text` (ASCII) as UTF-16.
std::string utf16(const std::string& text, bool big_endian, bool marked) {
  std::string out;
  const auto add = [&](unsigned unit) {
    const char low = static_cast<char>(unit & 0xFFU), high = static_cast<char>(unit >> 8U);
    out += big_endian ? high : low;
    out += big_endian ? low : high;
  };
  if (marked) {
    add(0xFEFF);
  }
  for (const char c : text) {
    add(static_cast<unsigned char>(c));
  }
  return out;
}

TEST_F(CsvDialects, EncodingsOfSpreadsheetsAreTheSameTable) {
  const TimeSpelling time = time_spellings().front();
  const std::string text = written({"\t", "\r\n", true}, time);
  expect_drive(read("\xEF\xBB\xBF" + text), time.tolerance, "UTF-8 with its mark");
  for (const bool big_endian : {false, true}) {
    for (const bool marked : {false, true}) {
      expect_drive(read(utf16(text, big_endian, marked)), time.tolerance,
                   fmt::format("UTF-16 {} {}", big_endian, marked));
    }
  }
  const std::string odd = utf16(text, false, true);
  EXPECT_EQ(read(odd.substr(0, odd.size() - 1)).rows(), static_cast<std::size_t>(rows - 1)) << "its last line is cut";
}

TEST_F(CsvDialects, UnitsInNamesAreConvertedAndSaid) {
  struct Case {
    const char* column;
    const char* unit;
    double factor;
  };
  constexpr double pi = 3.14159265358979323846;
  const std::vector<Case> cases = {{"omega_r", "rpm", pi / 30.0},
                                   {"omega_r", "U/min", pi / 30.0},
                                   {"omega_r", "deg/s", pi / 180.0},
                                   {"omega_r", "°/s", pi / 180.0},
                                   {"phi_r", "deg", pi / 180.0},
                                   {"phi_r", "turns", 2.0 * pi},
                                   {"tau_r", "Ncm", 0.01},
                                   {"tau_r", "N·cm", 0.01},
                                   {"tau_r", "mNm", 1e-3},
                                   {"tau_r", "Nmm", 1e-3},
                                   {"current_r", "mA", 1e-3},
                                   {"x", "mm", 1e-3},
                                   {"y", "cm", 1e-2},
                                   {"gyro_z", "dps", pi / 180.0},
                                   {"accel_x", "g", 9.80665},
                                   {"velocity", "rpm", pi / 30.0},
                                   {"position", "mm", 1e-3}};
  for (const Case& c : cases) {
    const auto numbers = [](int k) { return fmt::format("{:.2f},{}", 0.01 * k, 2 + k % 3); };
    for (const char* form : {"{} [{}]", "{} ({})", "{} / {}", "\"{} [{}]\"", "second line"}) {
      const bool below = std::string(form) == "second line";
      std::string text = below ? fmt::format("t,{}\ns,{}\n", c.column, c.unit)
                               : "t," + fmt::format(fmt::runtime(form), c.column, c.unit) + "\n";
      for (int k = 0; k < rows; ++k) {
        text += numbers(k) + "\n";
      }
      const LogTable table = read(text);
      ASSERT_EQ(table.names, std::vector<std::string>{c.column}) << c.unit << form;
      EXPECT_NEAR(table.columns[0][1] / 3.0 / c.factor, 1.0, 1e-12) << c.unit << form;
      EXPECT_THAT(said, Contains(AllOf(HasSubstr(fmt::format("{} is {}", c.column, c.column)), HasSubstr("times"))))
          << c.unit << form;
    }
  }
}

TEST_F(CsvDialects, TimesInANamedUnitAreSeconds) {
  for (const auto& [unit, per_second] :
       {std::pair("ms", 1e3), std::pair("us", 1e6), std::pair("ns", 1e9), std::pair("min", 1.0 / 60.0),
        std::pair("h", 1.0 / 3600.0), std::pair("days", 1.0 / 86400.0)}) {
    std::string text = fmt::format("Time [{}],omega_r\n", unit);
    for (int k = 0; k < rows; ++k) {
      text += fmt::format("{:.17g},1\n", 0.01 * k * per_second);
    }
    const LogTable table = read(text);
    ASSERT_EQ(table.rows(), static_cast<std::size_t>(rows)) << unit;
    EXPECT_NEAR(table.t.back() - table.t.front(), 0.59, 1e-9) << unit;
  }
  std::string text = "stamp [ns],omega_r\n";
  for (int k = 0; k < rows; ++k) {
    text += fmt::format("{},1\n", start * 1'000'000'000 + ns_of(k) + 7);
  }
  EXPECT_NEAR(read(text).t[1], 0.010000007, 1e-12) << "ns since 1970 keep their digits";
  EXPECT_EQ(clock_time(report.files[0], 0.5), "2026-11-29 08:40:00.500 UTC");
}

TEST_F(CsvDialects, DaysOfASpreadsheetThatAreMappedAreMoments) {
  std::string text = "t,omega_r\n";
  for (int k = 0; k < rows; ++k) {
    text += fmt::format("{:.10f},1\n", 46355.0 + (8.0 * 3600.0 + 40.0 * 60.0 + 0.01 * k) / 86400.0);
  }
  CsvOptions options;
  options.map = {{"t", "t*86400"}};
  const LogTable table = read(text, options);
  EXPECT_NEAR(table.t[59] - table.t[0], 0.59, 2e-5);
  EXPECT_THAT(clock_time(report.files[0], table.t[10]), HasSubstr("2026-11-29 08:40:00.1"));
}

TEST_F(CsvDialects, ATimeThatMayBeALeastTimeIsNone) {
  EXPECT_THAT(input_error([&] { read("t_min,omega_r\n0,1\n"); }), HasSubstr("no column for t"));
}

TEST_F(CsvDialects, PointsAndCommasInOneFileAreRefused) {
  const auto table = [](const char* first, const char* second) {
    std::string text = "t;omega_r\n";
    for (int k = 0; k < rows; ++k) {
      text += fmt::format("{};{}\n", k, k == 30 ? second : first);
    }
    return text;
  };
  EXPECT_THAT(input_error([&] { read(table("1.5", "1,234")); }),
              AllOf(HasSubstr("log.csv:32"), HasSubstr("'1,234': expected a number with a decimal point")));
  EXPECT_THAT(input_error([&] { read(table("1,5", "1.234")); }),
              AllOf(HasSubstr("log.csv:32"), HasSubstr("expected a number with a decimal comma")));
  EXPECT_EQ(read(table("1,5", "1.234,5")).columns[0][30], 1234.5);  // a group of thousands
  EXPECT_THAT(input_error([&] { read("t,omega_r,tau_r\n0,01,1,5,2,5\n"); }), HasSubstr("decimal commas"));
}

TEST_F(CsvDialects, TimesThatAreCoarserThanTheRowsAreRefused) {
  std::string text = "time,omega_r\n";
  for (int k = 0; k < 3000; ++k) {
    text += fmt::format("29.11.2026 08:40:{:02},1\n", k / 100);
  }
  EXPECT_THAT(input_error([&] { read(text); }),
              AllOf(HasSubstr("2970 of 3000 rows have the time of the row before"), HasSubstr("more decimals")));
}

TEST_F(CsvDialects, MomentsThatAreNoneAreText) {
  for (const char* none : {"40:00.1", "2026-11-29", "2026-13-01 08:40:00", "2026-11-29 25:00:00", "08:40", "12 apples",
                           "29.11.2026", "-", "2026-11-29 08:40:00 CET"}) {
    EXPECT_FALSE(parse_moment(none)) << none;
  }
  EXPECT_EQ(parse_moment("12:00:00 AM")->ns, 0);
  EXPECT_EQ(parse_moment("2 days 00:00:01")->ns, 172'801'000'000'000);
  EXPECT_TRUE(parse_moment("03/04/2026 08:40:00")->day_or_month);
  EXPECT_EQ(moment_text(start, -0.001, ""), "2026-11-29 08:39:59.999");
}

TEST_F(CsvDialects, FilesOfOneMorningKeepTheirOrder) {
  const auto part = [&](const char* name, std::int64_t from) {
    std::string text = "t,omega_r\n";
    for (int k = 0; k < rows; ++k) {
      text += fmt::format("{}.{},1\n", from + second_of(k), fraction_of(k, 6));
    }
    return put(name, text);
  };
  const auto log = open_log({part("a.csv", start), part("b.csv", start + 600)});
  const LogTable table = read_all(*log);
  EXPECT_EQ(table.t[0], 0.0);
  EXPECT_EQ(table.t[60], 600.0);
  EXPECT_EQ(log->report().files[1].time_origin, static_cast<double>(start));
}

TEST_F(CsvDialects, RosTopicEchoIsNamedWithWhatMakesATableOfIt) {
  const std::string line = "1795941600,10000000,base,left_wheel,right_wheel,0.1,0.2,1.5,1.6,0.3,0.4\n";
  const std::string error = input_error([&] { read(line + line); });
  EXPECT_THAT(error, AllOf(HasSubstr("expected a header line"), HasSubstr("ros2 topic echo --csv"),
                           HasSubstr("echo \"t,phi_l,omega_l,tau_l,phi_r,omega_r,tau_r\""),
                           HasSubstr("$1,$2,$6,$8,$10,$7,$9,$11")));
  EXPECT_THAT(input_error([&] { read("1795941600,10000000,base,0.1\n"); }), HasSubstr("ros2 bag record"));
}

TEST_F(CsvDialects, HeadersBehindTitlesAndInCommentsAndColumnsBetweenBlanksAreRead) {
  const auto table = [](const std::string& head, const std::string& separator, const std::string& end = "\n") {
    std::string text = head;
    for (int k = 0; k < rows; ++k) {
      text += fmt::format("{:.2f}{}{}{}{}{}", 0.01 * k, separator, speed(k), separator, torque(k), end);
    }
    return text;
  };
  for (const std::string& text :
       {table("# t,omega_r,tau_r\n", ","), table("# made by me\n#t;omega_r;tau_r\n", ";"),
        table("# t omega_r tau_r\n", " "), table("t   omega_r  tau_r\n", "   "), table("t|omega_r|tau_r\n", "|"),
        table("Data logger v1.3\nDate: 2026-01-02\nt,omega_r,tau_r\n", ","),
        table("t,omega_r,tau_r\n", ",") + "t,omega_r,tau_r\n"}) {
    expect_drive(read(text), 1e-9, text.substr(0, 40));
  }
}

TEST_F(CsvDialects, NumbersOfAllCountriesAreTheSame) {
  const auto text = [](const std::string& header, const std::function<std::string(double)>& number) {
    std::string out = header;
    for (int k = 0; k < rows; ++k) {
      out += fmt::format("{};{};{}\n", number(1234.0 + 0.01 * k), number(speed(k)), number(torque(k)));
    }
    return out;
  };
  const auto replaced = [](std::string number, const std::string& from, const std::string& to) {
    const std::size_t at = number.find(from);
    return at == std::string::npos ? number : number.replace(at, from.size(), to);
  };
  const std::string header = "t;omega_r;tau_r\n";
  const auto plain = [](double v) { return fmt::format("{:.4f}", v); };
  const auto grouped = [&](const std::string& group, const std::string& decimal) {
    return [=](double v) {
      const std::string number = plain(v);
      return replaced(replaced(number, ".", decimal), "1234", "1" + group + "234");
    };
  };
  for (const auto& number : std::vector<std::function<std::string(double)>>{
           grouped(".", ","), grouped(",", "."), grouped("'", "."), grouped("\u202f", ","), grouped("\u00a0", ","),
           [&](double v) { return replaced(plain(v), "-", "\u2212"); },
           [](double v) { return fmt::format("{:.8e}", v).replace(fmt::format("{:.8e}", v).find('e'), 1, "D"); }}) {
    expect_drive(read(text(header, number)), 1e-6, number(-1234.5));
  }
}

TEST_F(CsvDialects, AFactorAloneMultipliesTheColumnThatIsFound) {
  CsvOptions options;
  options.map = {{"omega_r", "*2"}, {"t", "*0.001"}};
  std::string text = "time,right_wheel_velocity,tau_r\n";
  for (int k = 0; k < rows; ++k) {
    text += fmt::format("{},{},{}\n", 10 * k, 0.5 * speed(k), torque(k));
  }
  expect_drive(read(text, options), 1e-9, "factors");
  options.map = {{"gyro_z", "*2"}};
  EXPECT_THAT(input_error([&] { read(text, options); }), HasSubstr("no column for gyro_z, which --map gyro_z=*2"));
}

TEST_F(CsvDialects, MillisecondsSince1970MayHaveDecimals) {
  std::string text = "t,omega_r,tau_r\n";
  for (int k = 0; k < rows; ++k) {
    text += fmt::format("{:.3f},{},{}\n", 1e3 * static_cast<double>(start) + 10.0 * k, speed(k), torque(k));
  }
  expect_drive(read(text), 1e-5, "ms");
}

TEST_F(CsvDialects, WhatMakesTimesIsSaidWhereNoColumnHasThem) {
  EXPECT_THAT(input_error([&] { read("stamp.sec,stamp.nanosec,omega_r,tau_r\n1,0,1,1\n"); }),
              HasSubstr("sprintf(\"%d.%09d\",$1,$2)"));
  EXPECT_THAT(input_error([&] { read(",omega_r,tau_r\n0,1,1\n"); }), HasSubstr("sed '1s/^/t/'"));
  EXPECT_THAT(input_error([&] { read("index,omega_r,tau_r\n0,1,1\n"); }), HasSubstr("--map t=\"index*0.01\""));
  std::string back = "t,omega_r,tau_r\n";
  for (int k = 0; k < rows; ++k) {
    back += fmt::format("{:.2f},{},{}\n", 0.01 * (k ^ 1), speed(k), torque(k));
  }
  EXPECT_THAT(input_error([&] { read(back); }), AllOf(HasSubstr("time goes back"), HasSubstr("sort -g")));
}

TEST_F(CsvDialects, ARobotFilesColumnsAlsoTakeATableUnderItsOwnNames) {
  CsvOptions options;
  options.map = {{"omega_r", "erpm*0.005"}, {"t", "ms_today*0.001"}};
  options.or_by_name = {"omega_r", "t"};
  const TimeSpelling time = time_spellings().front();
  expect_drive(read(written({","}, time), options), time.tolerance, "by name");
  EXPECT_THAT(said, Contains(HasSubstr("there is no erpm, which `columns:` names")));
  options.or_by_name.clear();
  EXPECT_THAT(input_error([&] { read(written({","}, time), options); }), HasSubstr("no column 'erpm"));
}

TEST_F(CsvDialects, ARos1BagIsNamedWithWhatConvertsIt) {
  std::filesystem::create_directory(path("old"));
  put("old/drive.bag", std::string("#ROSBAG V2.0\nE\0\0\0\x0c", 18) + std::string(4000, '\0'));
  for (const std::filesystem::path& log : {path("old/drive.bag"), path("old")}) {
    EXPECT_THAT(input_error([&] { (void)open_log({log}); }),
                AllOf(HasSubstr("drive.bag: is a ROS 1 bag"), HasSubstr("rosbags-convert --src"), HasSubstr("--dst"),
                      HasSubstr("drive_ros2")));
  }
}

}  // namespace
}  // namespace wheelwright::logs::csv_dialects_test
