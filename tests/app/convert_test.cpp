// SPDX-License-Identifier: Apache-2.0
// `wheelwright convert`, as a user runs it: the same log in every format is the same log.
#include "core/words.hpp"

#include "tests/app/program.hpp"

namespace wheelwright::app::convert_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;

class Convert : public testing::ProgramTest {
 protected:
  static std::string shipped() { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }

  // model.json without what names the files.
  Json model_of(const std::string& log) {
    const Outcome done = run("commission " + log + " --robot robot.yaml --json");
    EXPECT_EQ(done.code, 0) << done.err;
    Json model = Json::parse(done.out, nullptr, false);
    model.erase("data");
    return model;
  }
};

TEST_F(Convert, TheModelIsTheSameToTheLastDigitFromEveryFormat) {
  const Json model = model_of(shipped());
  ASSERT_TRUE(model.contains("parameters"));
  for (const std::string to :
       {"drive.csv.zst", "drive.h5", "none.mcap --compression none", "zstd.mcap --compression zstd",
        "lz4.mcap --compression lz4", "drive.db3", "recording"}) {
    const Outcome done = run("convert " + shipped() + " " + to);
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr(": 12001 rows, 120 s in 1 segment"));
    EXPECT_EQ(model_of(to.substr(0, to.find(' '))), model) << to;
  }
  // And back.
  ASSERT_EQ(run("convert recording back.csv --quiet").code, 0);
  EXPECT_EQ(testing::lines_of(bytes(path("back.csv"))).size(), 12002U);
  EXPECT_EQ(model_of("back.csv"), model);
}

TEST_F(Convert, SaysWhatItRepaired) {
  std::vector<std::string> lines = healthy_lines();
  lines.resize(400);
  lines.insert(lines.begin() + 10, lines[10]);
  put_lines("drive.csv", lines);
  const Outcome done = run("convert drive.csv drive.mcap");
  EXPECT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("1 row dropped: the same time stamp as the row before (first at drive.csv:12)"));
  const Json json = Json::parse(run("convert drive.csv again.mcap --json").out);
  EXPECT_EQ(json.at("schema"), "wheelwright/convert/1");
  EXPECT_EQ(json.at("rows"), 399);
  EXPECT_EQ(json.at("rows_read"), 400);
}

TEST_F(Convert, ReadsColumnsByTheRobotFileAndItsOwnNamesWithTheSameFile) {
  std::vector<std::string> lines = healthy_lines();
  lines.resize(400);
  put_lines("named.csv", lines);
  core::replace_all(lines[0], "omega_r", "right speed");
  put_lines("drive.csv", lines);
  put("mapped.yaml", bytes(path("robot.yaml")) + "columns: {omega_r: right speed}\n");
  const Outcome done = run("convert drive.csv one.csv --robot mapped.yaml");
  EXPECT_EQ(done.code, 0) << done.err;
  const Outcome again = run("convert one.csv two.csv --robot mapped.yaml");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("omega_r was read by its own name"));
  EXPECT_EQ(bytes(path("two.csv")), bytes(path("one.csv")));
  EXPECT_EQ(run("doctor one.csv --robot mapped.yaml").err, "");
}

TEST_F(Convert, SecondsSince1970StayWhatTheyWereDigitForDigit) {
  std::vector<std::string> lines = healthy_lines();
  lines.resize(400);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    lines[k] = fmt::format("{}.{:02}{}", 1'795'941'600 + k / 100, k % 100, lines[k].substr(lines[k].find(',')));
  }
  put_lines("drive.csv", lines);
  ASSERT_EQ(run("convert drive.csv recording").code, 0);
  for (const char* from : {"drive.csv", "recording"}) {
    ASSERT_EQ(run(fmt::format("convert {} back.csv --force", from)).code, 0);
    const std::vector<std::string> back = testing::lines_of(bytes(path("back.csv")));
    ASSERT_EQ(back.size(), lines.size());
    EXPECT_THAT(back[1], ::testing::StartsWith("1795941600.01,")) << from;
    EXPECT_THAT(back[399], ::testing::StartsWith("1795941603.99,")) << from;
  }
}

TEST_F(Convert, ARos1BagIsNamedByEveryCommand) {
  put("drive.bag", std::string("#ROSBAG V2.0\nE\0\0\0\x0c", 18) + std::string(4000, '\0'));
  for (const char* command :
       {"convert drive.bag out.csv", "doctor drive.bag", "commission drive.bag --robot robot.yaml",
        "identify drive.bag --robot robot.yaml", "try drive.bag --wheel-radius 0.1 --track-width 0.4 --out tried"}) {
    const Outcome told = run(command);
    EXPECT_EQ(told.code, 2) << command;
    EXPECT_THAT(told.err,
                AllOf(HasSubstr("is a ROS 1 bag"), HasSubstr("rosbags-convert --src drive.bag --dst drive_ros2")))
        << command;
  }
}

TEST_F(Convert, ReplacesNothingUnasked) {
  put("drive.csv", "mine");
  const Outcome refused = run("convert " + shipped() + " drive.csv");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("drive.csv: is there already: expected a new name, or --force"));
  EXPECT_EQ(bytes(path("drive.csv")), "mine");
  EXPECT_EQ(run("convert " + shipped() + " drive.csv --force").code, 0);
  EXPECT_EQ(run("convert " + shipped()).code, 2);
}

TEST_F(Convert, DetectWritesItsSeriesForOthersToPlot) {
  commission_shipped();
  const Outcome done = run("detect " + shipped() + " --model model/model.json --series residual.mcap");
  EXPECT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("wrote residual.mcap"));
  ASSERT_EQ(run("convert residual.mcap nothing.csv").code, 2) << "residuals are no columns of a log";
  const Outcome table = run("detect " + shipped() + " --model model/model.json --series residual.csv --quiet");
  EXPECT_EQ(table.code, 0);
  const std::vector<std::string> lines = testing::lines_of(bytes(path("residual.csv")));
  EXPECT_THAT(lines.at(0), AllOf(HasSubstr("t,residual_"), HasSubstr(",lower_"), HasSubstr(",alarm_")));
  EXPECT_GT(lines.size(), 11000U);
  // A fault-free log stays between its thresholds, row by row.
  for (std::size_t k = 1; k < lines.size(); ++k) {
    double t = 0.0, residual = 0.0, lower = 0.0, upper = 0.0;
    ASSERT_EQ(std::sscanf(lines[k].c_str(), "%lf,%lf,%lf,%lf", &t, &residual, &lower, &upper), 4);
    ASSERT_LE(lower, residual);
    ASSERT_LE(residual, upper);
  }
}

// A pose brings a second file, and both have layouts, whose every name is a topic and a field of the recordings.
TEST_F(Convert, LayoutsShowWhatTheSeriesHave) {
  for (const std::string name : {"healthy", "wheel_radius_fault"}) {
    std::string scenario = bytes(examples() / "scenarios" / (name + ".yaml"));
    core::replace_all(scenario, "../robot.yaml", "robot.yaml");
    put(name + ".yaml", scenario);
    ASSERT_EQ(run(fmt::format("simulate {0}.yaml --out {0}.csv --quiet", name)).code, 0);
  }
  ASSERT_EQ(run("commission healthy.csv --robot robot.yaml --out model --quiet").code, 0);
  const Outcome done = run("detect wheel_radius_fault.csv --model model/model.json --series residual.mcap --layouts");
  EXPECT_EQ(done.code, 1) << "the fault";
  EXPECT_THAT(done.out, AllOf(HasSubstr("wrote residual.mcap"), HasSubstr("wrote residual_kinematic.mcap"),
                              HasSubstr("wrote residual.plotjuggler.xml"), HasSubstr("wrote residual.foxglove.json")));

  // The definitions stand unpacked in the summary at a recording's end.
  const std::string recordings = bytes(path("residual.mcap")) + bytes(path("residual_kinematic.mcap"));
  const Json layout = files::read_json(path("residual.foxglove.json"));
  std::size_t curves = 0;
  std::vector<std::string> panels;
  for (const auto& [id, panel] : layout.at("configById").items()) {
    panels.push_back(id);
    for (const Json& path : panel.at("paths")) {
      const std::string value = path.at("value").get<std::string>();
      const std::size_t dot = value.find('.');
      ASSERT_NE(dot, std::string::npos) << value;
      EXPECT_NE(recordings.find(value.substr(0, dot)), std::string::npos) << value;
      EXPECT_NE(recordings.find("float64 " + value.substr(dot + 1) + "\n"), std::string::npos) << value;
      ++curves;
    }
  }
  EXPECT_GE(curves, 16U) << "two outputs of the efforts and two or more of the pose, three lines and an alarm each";
  const std::string placed = layout.at("layout").dump();
  for (const std::string& panel : panels) {
    EXPECT_THAT(placed, HasSubstr("\"" + panel + "\"")) << "every panel has its place";
  }
  const std::string juggler = bytes(path("residual.plotjuggler.xml"));
  std::size_t named = 0;
  for (std::size_t at = juggler.find("<curve name=\""); at != std::string::npos;
       at = juggler.find("<curve name=\"", at + 1)) {
    const std::string name = juggler.substr(at + 13, juggler.find('"', at + 13) - at - 13);
    const std::size_t slash = name.rfind('/');
    EXPECT_NE(recordings.find(name.substr(0, slash)), std::string::npos) << name;
    EXPECT_NE(recordings.find("float64 " + name.substr(slash + 1) + "\n"), std::string::npos) << name;
    ++named;
  }
  EXPECT_EQ(named, curves);
  EXPECT_EQ(run("detect wheel_radius_fault.csv --model model/model.json --layouts").code, 2) << "of which series?";
  EXPECT_EQ(run("detect wheel_radius_fault.csv --model model/model.json --series residual.mcap").code, 2)
      << "it is there already";
}

}  // namespace
}  // namespace wheelwright::app::convert_test
