// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "formats/logs/bag_write.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/hdf5_log.hpp"
#include "formats/logs/ros_messages.hpp"
#include "formats/logs/row_log.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::logs::log_file_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::UnorderedElementsAre;

constexpr std::int64_t ms = 1'000'000;

// A drive of 20 s at 100 Hz with a pause, in whole microseconds, with every kind of column.
LogTable drive() {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise;
  LogTable table;
  table.names = {"omega_r", "omega_l", "tau_r",   "tau_l",     "x",        "y",
                 "theta",   "gyro_z",  "accel_x", "current_r", "voltage_l"};
  table.columns.resize(table.names.size());
  for (std::int64_t k = 0; k < 2000; ++k) {
    table.t.push_back(static_cast<double>(10'000 * k + (k < 700 ? 0 : 1'500'000)) / 1e6);
    for (auto& column : table.columns) {
      column.push_back(noise(random));
    }
    table.columns[6].back() = 3.0 * std::sin(0.4 * table.t.back());
  }
  table.segment_starts = {0, 700};
  return table;
}

std::vector<LogBlock> blocks_of(LogSource& log) {
  std::vector<LogBlock> all;
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    all.push_back(block);
  }
  EXPECT_EQ(block.rows(), 0U);
  return all;
}

void expect_alike(const std::vector<LogBlock>& a, const std::vector<LogBlock>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].first_row, b[k].first_row);
    EXPECT_EQ(a[k].t, b[k].t);
    EXPECT_EQ(a[k].columns, b[k].columns);
    EXPECT_EQ(a[k].segment_starts, b[k].segment_starts);
  }
}

class LogFile : public testing::ScratchTest {
 protected:
  std::filesystem::path write(const std::string& name, const LogTable& table, const LogWriteOptions& options = {}) {
    TableSource source(table);
    const auto writer = create_log(path(name), table.names, options);
    LogBlock block;
    while (source.next(block)) {
      writer->write(block);
    }
    writer->commit();
    return path(name);
  }

  LogTable read(const std::vector<std::filesystem::path>& paths, const LogOptions& options = {}) {
    const auto log = open_log(paths, options);
    report = log->report();
    return read_all(*log);
  }

  LogReport report;
};

void expect_same(const LogTable& read, const LogTable& written, double theta) {
  EXPECT_EQ(read.t, written.t);
  EXPECT_EQ(read.segment_starts, written.segment_starts);
  ASSERT_EQ(read.names.size(), written.names.size());
  for (const std::string& name : written.names) {
    if (name != "theta" || theta == 0.0) {
      EXPECT_EQ(read.column(name), written.column(name)) << name;
      continue;
    }
    for (std::size_t k = 0; k < written.rows(); ++k) {
      ASSERT_NEAR(read.column(name)[k], written.column(name)[k], theta);
    }
  }
}

// Rows that are kept are those that would be read anew, and can be walked by two at once.
TEST_F(LogFile, KeptRowsAreThoseOfTheFile) {
  write("log.csv", drive());
  write("log.h5", drive());
  for (const std::string name : {"log.csv", "log.h5"}) {
    const auto open = [&](std::size_t kept_bytes) {
      std::vector<std::unique_ptr<RowFile>> files;
      for (int k = 0; k < 2; ++k) {
        files.push_back(name == "log.csv" ? csv_file(path(name), {}, {}) : hdf5_file(path(name), {}, {}));
      }
      return RowLog(std::move(files), {.block_rows = 300, .kept_bytes = kept_bytes});
    };
    RowLog kept = open(std::size_t{1} << 29), read = open(0), little = open(12 * 8 * 4199);
    const std::vector<LogBlock> rows = blocks_of(read);
    EXPECT_EQ(rows.size(), 14U);
    EXPECT_EQ(read.another_walk(), nullptr);
    EXPECT_EQ(little.another_walk(), nullptr) << "of 14 blocks the last does not fit";
    expect_alike(blocks_of(little), rows);
    expect_alike(blocks_of(kept), rows);
    expect_alike(blocks_of(kept), rows);
    LogBlock block;
    kept.rewind();
    ASSERT_TRUE(kept.next(block));
    std::unique_ptr<LogSource> other = kept.another_walk();
    ASSERT_NE(other, nullptr);
    EXPECT_EQ(other->columns(), kept.columns());
    EXPECT_EQ(other->median_step(), kept.median_step());
    ASSERT_TRUE(kept.next(block));
    EXPECT_EQ(block.first_row, 300U);
    expect_alike(blocks_of(*other), rows);
    std::filesystem::remove(path(name));
    expect_alike(blocks_of(*other->another_walk()), rows);
    write(name, drive());
  }
}

TEST_F(LogFile, EveryFormatGivesBackWhatWasWritten) {
  const LogTable table = drive();
  for (const std::string name : {"a.csv", "a.csv.gz", "a.csv.zst", "a.h5", "a.hdf5"}) {
    expect_same(read({write(name, table)}), table, 0.0);
    EXPECT_TRUE(report.clean()) << name;
  }
  for (const McapCompression packing : {McapCompression::none, McapCompression::zstd, McapCompression::lz4}) {
    LogWriteOptions options;
    options.compression = packing;
    expect_same(read({write("a" + std::to_string(static_cast<int>(packing)) + ".mcap", table, options)}), table, 1e-14);
    EXPECT_TRUE(report.clean());
    EXPECT_EQ(report.files.at(0).format, "mcap");
  }
  expect_same(read({write("a.db3", table)}), table, 1e-14);
  EXPECT_EQ(report.files.at(0).format, "sqlite3");
  expect_same(read({write("bag", table)}), table, 1e-14);
}

TEST_F(LogFile, AnAxisGoesThroughABagToo) {
  LogTable table = drive();
  table.names = {"position", "velocity", "effort"};
  table.columns.resize(3);
  expect_same(read({write("axis.mcap", table)}), table, 0.0);
}

TEST_F(LogFile, FormatsMayBeMixedAndKeepTheColumnsThatAllHave) {
  const LogTable table = drive();
  LogTable fewer = table;
  fewer.names.resize(4);
  fewer.columns.resize(4);
  const LogTable both = read({write("a.mcap", table), write("b.csv", fewer), write("c.h5", table)});
  EXPECT_EQ(both.rows(), 3 * table.rows());
  EXPECT_THAT(both.names, UnorderedElementsAre("omega_r", "omega_l", "tau_r", "tau_l"));
  EXPECT_EQ(both.segment_starts.size(), 6U);
}

TEST_F(LogFile, TimesOfAWallClockAreCountedFromAWholeSecondAndKeepTheirNanoseconds) {
  const LogTable table = drive();
  LogWriteOptions options;
  options.time_origin = 1'763'769'600.0;
  expect_same(read({write("a.mcap", table, options)}), table, 1e-14);
  EXPECT_EQ(report.files.at(0).time_origin, options.time_origin);
  EXPECT_THAT(sentences(report), Contains(HasSubstr("times are counted from 1763769600 s")));
}

TEST_F(LogFile, OnlyWantedColumnsAreRead) {
  const LogTable table = drive();
  LogOptions options;
  options.only = {{"tau_r", "theta"}};
  for (const std::string name : {"a.csv", "a.h5", "a.mcap"}) {
    const LogTable some = read({write(name, table)}, options);
    EXPECT_EQ(some.names.size(), 2U) << name;
    EXPECT_EQ(some.column("tau_r"), table.column("tau_r")) << name;
  }
}

// Wheels at 200 Hz and a pose at 47 Hz whose stamps are 1 ms off the wheels', recorded late.
class TwoTopics : public LogFile {
 protected:
  static double x_at(double t) { return 0.8 * std::sin(1.3 * t); }
  static double theta_at(double t) { return 4.0 * std::sin(0.7 * t) + 2.0 * t; }

  std::filesystem::path record(const std::string& name, double pose_from, double pose_to, std::int64_t pose_clock = 0) {
    BagWriter bag(path(name));
    const auto add = [&](const std::string& topic, const char* type) {
      return bag.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
    };
    const std::size_t joints = add("/joint_states", RosJointState::type), poses = add("/pose", RosPoseStamped::type);
    RosEncoder encoder;
    RosJointState joint;
    joint.name = {"left_wheel", "right_wheel"};
    RosPoseStamped pose;
    std::int64_t next_pose = ms;
    const std::int64_t start = 1'700'000'000'000 * ms;
    for (std::int64_t at = 0; at < 10'000 * ms; at += 5 * ms) {
      for (; next_pose < at; next_pose += 1000 * ms / 47) {
        const double t = 1e-9 * static_cast<double>(next_pose);
        if (t < pose_from || t > pose_to) {
          continue;
        }
        pose.header.stamp = start + next_pose + pose_clock;
        pose.pose.position[0] = x_at(t);
        pose.pose.orientation = {0.0, 0.0, std::sin(0.5 * theta_at(t)), std::cos(0.5 * theta_at(t))};
        bag.write(poses, start + next_pose + 3 * ms, encoder.encode(pose));
      }
      joint.header.stamp = start + at;
      joint.velocity = {1.0, 2.0 + 1e-9 * static_cast<double>(at)};
      joint.effort = {0.1, 0.2};
      bag.write(joints, start + at + 2 * ms, encoder.encode(joint));
    }
    bag.commit();
    return path(name);
  }
};

TEST_F(TwoTopics, OtherTopicsComeToTheTimesOfTheWheelsWithinTheirBound) {
  const LogTable table = read({record("two.mcap", 0.0, 20.0)});
  ASSERT_EQ(report.files[0].interpolated.size(), 3U);
  const double bound = report.files[0].interpolated[0].error, heading = report.files[0].interpolated[2].error;
  EXPECT_LE(bound, 1.125001 * 0.8 * 1.3 * 1.3 / (47.0 * 47.0 * 8.0));
  double worst = 0.0, worst_heading = 0.0;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    EXPECT_NEAR(table.column("omega_r")[k], 2.0 + table.t[k], 1e-9);
    worst = std::max(worst, std::abs(table.column("x")[k] - x_at(table.t[k])));
    worst_heading =
        std::max(worst_heading,
                 std::abs(std::remainder(table.column("theta")[k] - theta_at(table.t[k]), 2.0 * std::numbers::pi)));
  }
  EXPECT_LE(worst, bound);
  EXPECT_LE(worst_heading, heading);
  for (std::size_t k = 1; k < table.rows(); ++k) {
    ASSERT_LT(std::abs(table.column("theta")[k] - table.column("theta")[k - 1]), 0.1) << "unwrapped";
  }
  EXPECT_LE(report.uncovered.count, 9U) << "before the first pose and behind the last";
  EXPECT_EQ(report.rows + report.uncovered.count, report.rows_read);

  Robot robot;
  robot.noise.position.value = 0.002;
  const Robot widened = model::with_column_errors(robot, interpolation_errors(report));
  EXPECT_DOUBLE_EQ(*widened.noise.position.value, 0.002 + bound);
  EXPECT_FALSE(widened.noise.heading.value) << "an estimate stays one";
}

TEST_F(TwoTopics, RowsWithoutAPoseAreDroppedAndCountedNotMadeUp) {
  const LogTable table = read({record("two.mcap", 2.0, 5.0)});
  EXPECT_GE(table.t.front(), 2.0);
  EXPECT_LE(table.t.back(), 5.0);
  EXPECT_EQ(report.uncovered.count, 2000U - table.rows());
  EXPECT_THAT(report.uncovered.first, AllOf(HasSubstr("two.mcap: /joint_states, message 1"), HasSubstr("column x")));
  LogOptions wheels;
  wheels.only = {{"omega_r", "tau_r"}};
  EXPECT_EQ(read({path("two.mcap")}, wheels).rows(), 2000U) << "a pose that is not wanted does no harm";
}

TEST_F(TwoTopics, AnotherClockIsBroughtToThatOfTheWheels) {
  const LogTable table = read({record("two.mcap", 0.0, 20.0, -1'600'000'000'000 * ms)});
  EXPECT_THAT(report.files[0].notes, Contains(HasSubstr("/pose: its time stamps are of another clock")));
  for (std::size_t k = 0; k < table.rows(); ++k) {
    // The two topics are recorded 2 and 3 ms late: that difference is what the shift cannot know.
    ASSERT_NEAR(table.column("x")[k], x_at(table.t[k] - 1e-3), 2e-4);
  }
}

TEST_F(LogFile, WhatIsNoLogIsSaid) {
  LogOptions options;
  const auto error = [&](const std::filesystem::path& file) {
    return input_error([&] { (void)open_log({file}, options); });
  };
  {
    BagWriter bag(path("chatter.mcap"));
    const std::size_t topic =
        bag.add_topic("/chatter", "geometry_msgs/msg/TwistStamped",
                      ros_definition_text(*bundled_ros_definition("geometry_msgs/msg/TwistStamped")));
    RosEncoder encoder;
    bag.write(topic, 5, encoder.encode(RosTwistStamped{}));
    bag.commit();
  }
  EXPECT_THAT(error(path("chatter.mcap")),
              AllOf(HasSubstr("chatter.mcap: no topic has a column of a log"),
                    HasSubstr("/chatter (geometry_msgs/msg/TwistStamped)"), HasSubstr("--map NAME=TOPIC.FIELD")));
  LogTable table = drive();
  table.names[0] = "a";
  write("a.h5", table);
  options.map = {{"omega_r", "b"}};
  EXPECT_THAT(error(path("a.h5")), HasSubstr("a.h5: no dataset 'b' for column omega_r: the file has /log/a"));
  EXPECT_THAT(input_error([&] { (void)create_log(path("a.xlsx"), {"x"}); }), HasSubstr("a.xlsx: unknown ending"));
  std::filesystem::create_directory(path("empty"));
  EXPECT_THAT(error(path("empty")),
              HasSubstr("empty: is a directory: expected a file, or a directory with a recording"));
  EXPECT_THROW((void)open_log({}), InvalidArgument);
}

TEST_F(LogFile, AnHdf5FileDoesNotSayWhenItWasWritten) {
  const hid_t opened = H5Fopen(write("a.h5", drive()).c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (const char* object : {"/log", "/log/t", "/log/omega_r"}) {
    H5O_info_t info{};
    ASSERT_GE(H5Oget_info_by_name(opened, object, &info, H5P_DEFAULT), 0);
    EXPECT_EQ(info.atime + info.mtime + info.ctime + info.btime, 0) << object;
  }
  H5Fclose(opened);
}

TEST_F(LogFile, ADatasetInAnotherUnitIsNotTakenAndThatIsSaid) {
  const std::filesystem::path file = write("a.h5", drive());
  {
    const hid_t opened = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t dataset = H5Dopen2(opened, "/log/omega_r", H5P_DEFAULT);
    H5Adelete(dataset, "units");
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, 5);
    const hid_t unit = H5Acreate2(dataset, "units", type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(unit, type, "deg/s"), 0);
    H5Aclose(unit);
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(dataset);
    H5Fclose(opened);
  }
  EXPECT_EQ(read({file}).names.size(), drive().names.size() - 1);
  EXPECT_THAT(report.files[0].notes,
              Contains(HasSubstr("/log/omega_r was not taken as omega_r: its unit is 'deg/s', expected rad/s")));
  LogOptions options;
  options.map = {{"omega_r", "omega_r"}};
  EXPECT_EQ(read({file}, options).names.size(), drive().names.size()) << "asked for by name, it is";
}

/// An HDF5 file that is made as other programs make theirs.
class Hdf5File {
 public:
  explicit Hdf5File(const std::filesystem::path& path, bool newest = false) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (newest) {
      H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    }
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
  }
  ~Hdf5File() { H5Fclose(file_); }
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  void group(const std::string& name) {
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  /// A dataset whose unit is a string of variable length, behind as many other attributes.
  void put(const std::string& name, const std::vector<double>& values, const std::string& unit, int before = 0) {
    const hsize_t rows = values.size();
    const hid_t line = H5Screate_simple(1, &rows, nullptr), one = H5Screate(H5S_SCALAR), type = H5Tcopy(H5T_C_S1);
    const hid_t data = H5Dcreate2(file_, name.c_str(), H5T_NATIVE_DOUBLE, line, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Tset_size(type, H5T_VARIABLE);
    const char* const text = unit.c_str();
    for (int k = 0; k <= before; ++k) {
      const std::string called = k == before ? "units" : "note" + std::to_string(k);
      const hid_t attribute = H5Acreate2(data, called.c_str(), type, one, H5P_DEFAULT, H5P_DEFAULT);
      EXPECT_GE(H5Awrite(attribute, type, &text), 0);
      H5Aclose(attribute);
    }
    H5Dclose(data);
    H5Tclose(type);
    H5Sclose(one);
    H5Sclose(line);
  }

 private:
  hid_t file_ = -1;
};

TEST_F(LogFile, Hdf5OfOtherProgramsIsReadInTheOldAndTheNewestFormat) {
  const LogTable table = drive();
  for (const bool newest : {false, true}) {
    for (const int before : {0, 6}) {
      {
        Hdf5File file(path("a.h5"), newest);
        file.put("time", table.t, "s", before);
        file.put("omega_r", table.column("omega_r"), "rad/s", before);
        file.put("omega_l", table.column("omega_l"), "deg/s", before);
      }
      const LogTable got = read({path("a.h5")});
      EXPECT_EQ(got.t, table.t);
      ASSERT_EQ(got.names, std::vector<std::string>{"omega_r"}) << newest << before;
      EXPECT_EQ(got.column("omega_r"), table.column("omega_r"));
      EXPECT_THAT(report.files[0].notes, Contains(HasSubstr("its unit is 'deg/s', expected rad/s")));
    }
  }
}

TEST_F(LogFile, OfSeveralLogsInAnHdf5FileAMapOfTheTimesTakesOne) {
  const LogTable table = drive();
  {
    Hdf5File file(path("a.h5"));
    for (const auto& [name, column] : {std::pair{"/first", "omega_l"}, std::pair{"/second", "omega_r"}}) {
      file.group(name);
      file.put(name + std::string("/t"), table.t, "s");
      file.put(name + std::string("/omega_r"), table.column(column), "rad/s");
    }
  }
  EXPECT_EQ(read({path("a.h5")}).column("omega_r"), table.column("omega_l"));
  EXPECT_THAT(report.files[0].notes, Contains(HasSubstr("there are several logs in it (/first/, /second/)")));
  LogOptions options;
  options.map = {{"t", "/second/t"}};
  EXPECT_EQ(read({path("a.h5")}, options).column("omega_r"), table.column("omega_r"));
}

TEST_F(LogFile, ADatasetOfAnotherLengthThanTheTimesIsRefused) {
  const LogTable table = drive();
  {
    Hdf5File file(path("a.h5"));
    file.put("t", table.t, "s");
    file.put("omega_r", std::vector<double>(table.rows() - 1, 1.0), "rad/s");
  }
  EXPECT_THAT(input_error([&] { read({path("a.h5")}); }),
              AllOf(HasSubstr("a.h5: /omega_r has 1999 values and /t has 2000"), HasSubstr("as many values as times")));
}

TEST_F(LogFile, AFactorBehindAColumnMultipliesItInEveryFormat) {
  const LogTable table = drive();
  const std::vector<std::pair<std::string, std::string>> places{{"a.csv", "omega_r"},
                                                                {"a.h5", "omega_r"},
                                                                {"a.h5", "/log/omega_r"},
                                                                {"a.mcap", "/joint_states.velocity[right_wheel]"},
                                                                {"a.db3", "/joint_states.velocity[right_wheel]"}};
  for (const auto& [name, place] : places) {
    const std::filesystem::path file = write(name, table);
    for (const std::string factor : {"*-2", " * 0.25"}) {
      LogOptions options;
      options.map = {{"omega_r", place + factor}};
      const LogTable found = read({file}, options);
      const double times = factor == "*-2" ? -2.0 : 0.25;
      for (std::size_t k = 0; k < table.rows(); ++k) {
        ASSERT_EQ(found.column("omega_r")[k], times * table.column("omega_r")[k]) << name << factor;
      }
      EXPECT_EQ(found.column("omega_l"), table.column("omega_l")) << name;
      EXPECT_THAT(report.files[0].notes, Contains(HasSubstr(fmt::format(" times {:g}", times)))) << name;
    }
    LogOptions none;
    none.map = {{"omega_r", place + "*fast"}};
    EXPECT_THROW(read({file}, none), InputError) << name;
  }
}

TEST_F(LogFile, AFailedWriteLeavesNothing) {
  LogTable table = drive();
  for (const std::string name : {"a.csv", "a.h5", "a.mcap", "a.db3", "bag"}) {
    {
      const auto writer = create_log(path(name), table.names);
      LogBlock block;
      TableSource source(table);
      source.next(block);
      block.columns[0][3] = NAN;
      EXPECT_THROW(writer->write(block), InvalidArgument) << name;
    }
    EXPECT_EQ(files(), 0U) << name;
  }
}

TEST_F(LogFile, ARecordingHoldsNoTimesBeyondThoseOfItsClock) {
  LogBlock block;
  for (const double t : {2e9, -2.0}) {
    block = {};
    block.t = {t};
    block.columns = {{1.0}};
    block.segment_starts = {0};
    for (const std::string name : {"a.mcap", "a.db3"}) {
      {
        const auto writer = create_log(path(name), {"omega_r"});
        EXPECT_THAT(input_error([&] { writer->write(block); }),
                    AllOf(HasSubstr(name), HasSubstr("a recording holds times from 0 to 2e9 s")));
      }
      EXPECT_EQ(files(), 0U) << name;
    }
  }
}

// A recording that was cut off gives the rows before the cut; one with wrong bytes gives rows or a message. Neither is
// silent about it.
TEST_F(LogFile, DamagedRecordingsAreReadAsFarAsTheyGo) {
  const LogTable table = drive();
  std::mt19937_64 random(12);
  for (const std::string ending : {"mcap", "db3"}) {
    const std::string content = bytes(write("whole." + ending, table));
    const std::string name = "damaged." + ending;
    std::size_t salvaged = 0;
    for (int trial = 0; trial < 100; ++trial) {
      std::string damaged = content;
      const bool cut = trial % 2 == 0;
      if (cut) {
        damaged.resize(8 + random() % (damaged.size() - 8));
      } else {
        for (int k = 0; k < 1 + trial / 10; ++k) {
          damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
        }
      }
      put(name, damaged);
      try {
        const LogTable some = read({path(name)});
        if (cut) {
          ++salvaged;
          ASSERT_FALSE(report.files[0].notes.empty()) << damaged.size();
          ASSERT_LE(some.rows(), table.rows());
          const std::vector<double>& whole = table.column("tau_r");
          ASSERT_TRUE(std::ranges::equal(some.column("tau_r"), std::span(whole).first(some.rows()))) << damaged.size();
        }
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(name));
      }
    }
    EXPECT_GT(salvaged, 5U) << ending;
  }
}

TEST_F(LogFile, ATopicWithoutMessagesTakesNoRows) {
  BagWriter bag(path("silent.mcap"));
  const auto add = [&](const std::string& topic, const char* type) {
    return bag.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
  };
  const std::size_t joints = add("/joint_states", RosJointState::type);
  add("/mocap", RosPoseStamped::type);
  RosEncoder encoder;
  RosJointState joint;
  joint.name = {"left", "right"};
  joint.velocity = {1.0, 2.0};
  for (int k = 1; k <= 50; ++k) {
    joint.header.stamp = k * 10 * ms;
    bag.write(joints, joint.header.stamp, encoder.encode(joint));
  }
  bag.commit();
  EXPECT_EQ(read({path("silent.mcap")}).rows(), 50U);
}

// Damaged HDF5 files are read, or refused with the file's name: the library may not crash on them.
TEST_F(LogFile, DamagedHdf5IsReadOrRefused) {
  LogTable table = drive();
  const std::filesystem::path whole = write("whole.h5", table);
  const std::string content = bytes(whole);
  std::mt19937_64 random(11);
  for (int trial = 0; trial < 200; ++trial) {
    std::string damaged = content;
    if (trial % 2 == 0) {
      damaged.resize(8 + random() % (damaged.size() - 8));
    } else {
      for (int k = 0; k < 1 + trial / 20; ++k) {
        damaged[8 + random() % (damaged.size() - 8)] = static_cast<char>(random());
      }
    }
    put("damaged.h5", damaged);
    try {
      read({path("damaged.h5")});
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("damaged.h5"));
    }
  }
}

// The library would divide by 0.
TEST_F(LogFile, ADatasetInChunksWithoutSizeIsRefused) {
  std::string content = bytes(write("whole.h5", drive()));
  const std::size_t layout = content.find(std::string("\x08\x00\x18\x00\x00\x00\x00\x00\x03\x02\x02", 11));
  ASSERT_NE(layout, std::string::npos);
  content.replace(layout + 8 + 3 + 8, 4, 4, '\0');  // behind version, dimensions, class and address
  const auto file = put("damaged.h5", content);
  EXPECT_THAT(input_error([&] { read({file}); }), HasSubstr("is stored in chunks with a side of 0"));
}

// The library would read what stands behind the attribute.
TEST_F(LogFile, ADatasetWithDamagedAttributesIsRefused) {
  const std::string content = bytes(write("whole.h5", drive()));
  const std::size_t name = content.find("units");
  ASSERT_NE(name, std::string::npos);
  for (const std::string damage : {"\xf8\xff", "\xf8\xff\x8a\x97"}) {  // of the bytes of its dataspace, and of its name
    std::string damaged = content;
    const auto file = put("damaged.h5", damaged.replace(name - 2, damage.size(), damage));
    EXPECT_THAT(input_error([&] { read({file}); }), HasSubstr("has an attribute that ends outside of itself"));
  }
}

/// A file of HDF5 with a dataset for each column, of this type and made as `how` says; of the last column the `places`
/// values from `left_out` on are not written.
void write_columns(const std::filesystem::path& path,
                   const std::vector<std::pair<std::string, std::vector<double>>>& columns, hid_t type,
                   const std::function<void(hid_t)>& how = {}, hsize_t left_out = 0, hsize_t places = 0) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t made = H5Pcreate(H5P_DATASET_CREATE);
  if (how) {
    how(made);
  }
  for (const auto& [name, values] : columns) {
    const hsize_t rows = values.size();
    const hid_t space = H5Screate_simple(1, &rows, nullptr);
    const hid_t data = H5Dcreate2(file, name.c_str(), type, space, H5P_DEFAULT, made, H5P_DEFAULT);
    if (places > 0 && name == columns.back().first) {
      H5Sselect_hyperslab(space, H5S_SELECT_NOTB, &left_out, nullptr, &places, nullptr);
    }
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, space, space, H5P_DEFAULT, values.data()), 0);
    H5Dclose(data);
    H5Sclose(space);
  }
  H5Pclose(made);
  H5Fclose(file);
}

// The library brings bytes back in order by the size that the file gives, and one changed bit made numbers of others.
TEST_F(LogFile, ADatasetShuffledInAnotherSizeIsRefused) {
  std::string content = bytes(write("whole.h5", drive()));
  const std::size_t name = content.find("shuffle");
  ASSERT_NE(name, std::string::npos);
  ASSERT_EQ(content[name + 8], '\x08');
  content[name + 8] = '\x48';
  const auto file = put("damaged.h5", content);
  EXPECT_THAT(input_error([&] { read({file}); }), HasSubstr("has values of 8 bytes, shuffled as such of 72"));
}

// Columns behind the damage were missing, and nothing was said.
TEST_F(LogFile, AnHdf5FileThatCannotBeListedIsRefused) {
  const std::string content = bytes(write("whole.h5", drive()));
  const std::size_t members = content.rfind("SNOD");
  ASSERT_NE(members, std::string::npos);
  std::string damaged = content;
  damaged[members + 8 + 40 + 8 + 4] = '\x01';  // of the second member the address, 4 GiB further on
  const auto file = put("damaged.h5", damaged);
  EXPECT_THAT(input_error([&] { read({file}); }),
              AllOf(HasSubstr("damaged.h5: is damaged: the HDF5 library lists"), HasSubstr("finds no way to others")));
  {
    const hid_t opened = H5Fopen(write("type.h5", drive()).c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Ldelete(opened, "/log/omega_r", H5P_DEFAULT);
    const hid_t type = H5Tcopy(H5T_IEEE_F64LE);
    EXPECT_GE(H5Tcommit2(opened, "/log/omega_r", type, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), 0);
    H5Tclose(type);
    H5Fclose(opened);
  }
  EXPECT_THAT(input_error([&] { read({path("type.h5")}); }), HasSubstr("/log/omega_r is no dataset"));
}

// Numbers came out that nobody had written.
TEST_F(LogFile, NumbersOfAnHdf5FileHaveAFormatOfMachines) {
  const std::string content = bytes(write("whole.h5", drive()));
  // Class and sign; size; offset and precision; places and sizes of exponent and mantissa; bias.
  const std::string doubles("\x11\x20\x3f\0\x08\0\0\0\0\0\x40\0\x34\x0b\0\x34\xff\x03\0\0", 20);
  const std::size_t at = content.find(doubles);
  ASSERT_NE(at, std::string::npos);
  std::size_t read_otherwise = 0;
  const LogTable sound = read({path("whole.h5")});
  for (std::size_t k = 0; k < 8 * doubles.size(); ++k) {
    std::string damaged = content;
    damaged[at + k / 8] = static_cast<char>(damaged[at + k / 8] ^ 1 << k % 8);
    put("damaged.h5", damaged);
    try {
      const LogTable got = read({path("damaged.h5")});
      read_otherwise += got.names == sound.names && (got.t != sound.t || got.columns != sound.columns) ? 1 : 0;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("damaged.h5"));
    }
  }
  EXPECT_LE(read_otherwise, 1U) << "the order of bytes cannot be told from another";

  std::vector<double> t(64), omega(64);
  for (std::size_t k = 0; k < t.size(); ++k) {
    t[k] = static_cast<double>(k);
    omega[k] = static_cast<double>(k % 7);
  }
  for (const hid_t type : {H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64BE, H5T_NATIVE_LDOUBLE, H5T_STD_I16BE,
                           H5T_STD_I64LE, H5T_STD_U32LE, H5T_STD_I8LE}) {
    write_columns(path("a.h5"), {{"t", t}, {"omega_r", omega}}, type);
    EXPECT_EQ(read({path("a.h5")}).column("omega_r"), omega);
  }
}

TEST_F(LogFile, WhatIsNamedLikeAColumnAndIsNoneIsSaid) {
  const LogTable table = drive();
  {
    Hdf5File file(path("a.h5"));
    file.put("t", table.t, "s");
    file.put("omega_l", table.column("omega_l"), "rad/s");
  }
  const hid_t file = H5Fopen(path("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hsize_t sides[] = {3, 4};
  const hid_t plane = H5Screate_simple(2, sides, nullptr), line = H5Screate_simple(1, sides, nullptr);
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, 8);
  H5Dclose(H5Dcreate2(file, "omega_r", H5T_NATIVE_DOUBLE, plane, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Dclose(H5Dcreate2(file, "tau_r", text, line, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Dclose(H5Dcreate2(file, "note", text, line, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Tclose(text);
  H5Sclose(line);
  H5Sclose(plane);
  H5Fclose(file);
  EXPECT_EQ(read({path("a.h5")}).names, std::vector<std::string>{"omega_l"});
  EXPECT_THAT(report.files[0].notes,
              ::testing::UnorderedElementsAre("/omega_r was not taken as omega_r: it has 2 dimensions: expected 1",
                                              "/tau_r was not taken as tau_r: it holds no numbers"));
  LogOptions options;
  options.map = {{"omega_r", "/omega_r"}};
  EXPECT_THAT(input_error([&] { read({path("a.h5")}, options); }), HasSubstr("/omega_r has 2 dimensions: expected 1"));
}

TEST_F(LogFile, ALinkLikeAColumnIsSaidAndNotFollowed) {
  const LogTable table = drive();
  {
    Hdf5File file(path("a.h5"));
    for (const char* name : {"raw_t", "raw_l", "raw_r", "tau_l"}) {
      file.put(name, name == std::string("raw_t") ? table.t : table.column("omega_l"), "");
    }
  }
  const auto link = [&](const char* name, const char* to, bool soft) {
    const hid_t file = H5Fopen(path("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    if (soft) {
      H5Lcreate_soft(to, file, name, H5P_DEFAULT, H5P_DEFAULT);
    } else {
      H5Lcreate_hard(file, to, file, name, H5P_DEFAULT, H5P_DEFAULT);
    }
    H5Fclose(file);
  };
  link("time", "/raw_t", true);
  EXPECT_THAT(input_error([&] { read({path("a.h5")}); }),
              AllOf(HasSubstr("no dataset of times"), HasSubstr("/time is a link"), HasSubstr("--map t=")));

  link("omega_l", "/raw_l", true);
  link("omega_r", "/raw_r", false);  // raw_r comes behind it: the dataset is listed by the name of a column
  link("tau_r", "/nothing", true);
  LogOptions options;
  options.map = {{"t", "/raw_t"}};
  EXPECT_THAT(read({path("a.h5")}, options).names, ::testing::UnorderedElementsAre("omega_r", "tau_l"));
  EXPECT_THAT(report.files[0].notes,
              ::testing::UnorderedElementsAre(::testing::StartsWith("/omega_l was not taken as omega_l: it is a link"),
                                              ::testing::StartsWith("/tau_r was not taken as tau_r: it is a link")));
  options.map["omega_l"] = "/omega_l";
  EXPECT_THAT(input_error([&] { read({path("a.h5")}, options); }), HasSubstr("/omega_l is a link"));
  options.map["omega_l"] = "/raw_l";
  EXPECT_EQ(read({path("a.h5")}, options).column("omega_l"), table.column("omega_l"));
}

// The library read what stands in memory behind them.
TEST_F(LogFile, ValuesInAHeaderAreAsManyAsItHolds) {
  std::vector<double> values(64);
  std::iota(values.begin(), values.end(), 0.0);
  for (const H5D_layout_t layout : {H5D_COMPACT, H5D_CONTIGUOUS}) {
    write_columns(path("a.h5"), {{"t", values}, {"omega_r", values}}, H5T_IEEE_F64LE,
                  [&](hid_t how) { H5Pset_layout(how, layout); });
    EXPECT_EQ(read({path("a.h5")}).t.size(), values.size());
    std::string content = bytes(path("a.h5"));
    // 64 values become 1,088, in both extents of a dataspace.
    for (std::size_t at = 0;
         (at = content.find(std::string("\x01\x01\x01\0\0\0\0\0\x40\0\0\0", 12), at)) != std::string::npos; ++at) {
      content[at + 9] = content[at + 17] = '\x04';
    }
    const auto file = put("damaged.h5", content);
    EXPECT_THAT(input_error([&] { read({file}); }), HasSubstr("has 1088 values of 8 bytes in 512 bytes"));
  }
}

// What is not there is read as zeros.
TEST_F(LogFile, PiecesOfHdf5ThatWereNeverWrittenAreRefused) {
  const LogTable table = drive();
  const hsize_t piece = 10, rows = table.t.size();
  ASSERT_GT(rows, 3 * piece);
  const auto make = [&](hsize_t left_out, hsize_t places) {
    write_columns(
        path("a.h5"), {{"t", table.t}, {"omega_r", table.column("omega_r")}}, H5T_IEEE_F64LE,
        [&](hid_t how) { H5Pset_chunk(how, 1, &piece); }, left_out, places);
  };
  make(0, 0);
  EXPECT_EQ(read({path("a.h5")}).column("omega_r"), table.column("omega_r"));
  for (const hsize_t left_out : {hsize_t{0}, 2 * piece, (rows - 1) / piece * piece}) {
    make(left_out, std::min(piece, rows - left_out));
    EXPECT_THAT(
        input_error([&] { read({path("a.h5")}); }),
        AllOf(HasSubstr(fmt::format("a.h5: /omega_r has {} values, of which row {} and others", rows, left_out + 1)),
              HasSubstr("--trust")));
    LogOptions trust;
    trust.trust = true;
    EXPECT_EQ(read({path("a.h5")}, trust).column("omega_r").at(left_out), 0.0);
  }
  // The way to the last piece is lost where the key behind it, which says where the pieces end, is damaged.
  make(0, 0);
  std::string content = bytes(path("a.h5"));
  const std::size_t tree = content.rfind(std::string("TREE\x01", 5)),
                    pieces = static_cast<unsigned char>(content[tree + 6]);
  const std::size_t key = tree + 24 + 32 * pieces;  // of 24 bytes, each with a place of 8 behind it
  content.replace(key + 8, 8, 8, '\0');
  const auto file = put("damaged.h5", content);
  EXPECT_THAT(input_error([&] { read({file}); }), HasSubstr("were never written or are lost"));
}

// Of speeds and efforts that leap in a row or two at known places: what is left are all other rows, as they were, in
// any blocks.
TEST_F(LogFile, RowsThatLeapAreLeftOutAndCountedOnRequest) {
  std::string text = "t,omega_r,omega_l,tau_r,tau_l\n";
  const std::vector<int> leaps = {40, 41, 60, 90, 150, 300, 302, 398};
  for (int k = 0; k < 400; ++k) {
    const bool leap = std::ranges::find(leaps, k) != leaps.end();
    const double t = 0.01 * k + (k < 200 ? 0.0 : 5.0), speed = 5.0 * std::sin(t);
    text += fmt::format("{:.2f},{},{},{},1\n", t, leap && k % 2 == 0 && k != 60 ? 400.0 : speed,
                        leap && k % 2 == 1 ? -90.0 : speed, k == 60 ? 99.0 : 1.0);
  }
  const auto file = put("leaps.csv", text);
  const LogTable as_logged = read_all(*open_log({file}));
  ASSERT_EQ(as_logged.rows(), 400U);
  for (const std::size_t block_rows : {7U, 4096U}) {
    LogOptions options;
    options.leaps = false;
    options.block_rows = block_rows;
    const auto log = open_log({file}, options);
    const LogTable left = read_all(*log);
    std::size_t row = 0;
    for (std::size_t k = 0; k < 400; ++k) {
      if (std::ranges::find(leaps, static_cast<int>(k)) != leaps.end()) {
        continue;
      }
      ASSERT_LT(row, left.rows());
      EXPECT_EQ(left.t[row], as_logged.t[k]);
      EXPECT_EQ(left.columns[0][row], as_logged.columns[0][k]);
      EXPECT_EQ(left.columns[2][row], as_logged.columns[2][k]);
      ++row;
    }
    EXPECT_EQ(left.rows(), row);
    EXPECT_EQ(left.segment_starts, (std::vector<std::size_t>{0, 195}));
    EXPECT_EQ(log->report().leaps.count, leaps.size());
    EXPECT_EQ(log->report().rows, row);
    EXPECT_EQ(log->report().rows_read, 400U);
    EXPECT_THAT(log->report().leaps.first, AllOf(HasSubstr("leaps.csv"), HasSubstr("t = 0.4 s, column omega_r")));
  }
}

// An angle that leaps and is back cuts nothing, and a counter that is set back does.
TEST_F(LogFile, AnglesThatLeapAreLeftOutAndCutNothing) {
  std::string text = "t,phi_r,phi_l,tau_r,tau_l\n";
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k, angle = 5.0 * t - (k >= 250 ? 10.0 : 0.0);
    text += fmt::format("{:.2f},{:.6f},{:.6f},{},1\n", t, angle + (k == 100 || k == 101 ? 80.0 : 0.0),
                        5.0 * t - (k == 300 ? 60.0 : 0.0), std::sin(t));
  }
  LogOptions options;
  options.leaps = false;
  const auto log = open_log({put("angles.csv", text)}, options);
  EXPECT_EQ(log->report().leaps.count, 3U);
  EXPECT_EQ(log->report().jumps.count, 1U);
  const LogTable left = read_all(*log);
  EXPECT_EQ(left.rows(), 397U);
  EXPECT_EQ(left.segment_starts, (std::vector<std::size_t>{0, 248}));
}

// Efforts may leap for longer, as a robot that starts and stops does.
TEST_F(LogFile, EffortsThatLeapForATenthOfASecondAndMoreStay) {
  for (const double step : {0.01, 0.1}) {
    std::string text = "t,omega_r,omega_l,tau_r,tau_l\n";
    for (int k = 0; k < 2000; ++k) {
      text += fmt::format("{:.2f},{},{},{},1\n", step * k, std::sin(0.01 * k), std::cos(0.01 * k),
                          k == 900 ? 99.0 : std::sin(0.01 * k));
    }
    LogOptions options;
    options.leaps = false;
    EXPECT_EQ(open_log({put(fmt::format("efforts_{}.csv", step), text)}, options)->report().leaps.count,
              step < 0.05 ? 1U : 0U);
  }
}

// Bursts of rows are no gaps, wherever the row of a burst comes.
TEST_F(LogFile, BurstsOfRowsAreOneSegment) {
  for (const int burst : {3, 5}) {
    std::string text = "t,phi_r,phi_l\n";
    for (int k = 0; k < 400; ++k) {
      text += fmt::format("{:.6f},{:.3f},{:.3f}\n", 0.1 * (k / burst * burst + burst) + 0.001 * (k % burst), 0.8 * k,
                          40.0 * std::sin(0.01 * k));
    }
    const auto log = open_log({put("bursts.csv", text)});
    EXPECT_EQ(log->report().segments, 1U) << burst;
    EXPECT_EQ(log->report().jumps.count + log->report().angle_wraps.count, 0U) << burst;
    EXPECT_EQ(log->report().rows, 400U);
  }
}

}  // namespace
}  // namespace wheelwright::logs::log_file_test
