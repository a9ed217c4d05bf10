// SPDX-License-Identifier: Apache-2.0
// What a run reads stays, what it is to write is written or refused, and standard output holds one thing.
#include <unistd.h>

#include "core/words.hpp"
#include "tests/app/program.hpp"
#include "tests/app/stock_robots.hpp"

namespace wheelwright::app::outputs_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;
using ::testing::StartsWith;

class Outputs : public testing::ProgramTest {
 protected:
  void put_log(std::size_t rows = 6000) const {
    std::vector<std::string> lines = healthy_lines();
    lines.resize(std::min(lines.size(), rows));
    put_lines("h.csv", lines);
  }

  void refuses(const std::string& command, const std::string& expected, const std::string& before = "") const {
    const Outcome outcome = run(command, "/dev/null", before);
    EXPECT_EQ(outcome.code, 2) << command;
    EXPECT_THAT(outcome.out, IsEmpty()) << command;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(expected), Not(HasSubstr("bug")))) << command;
  }

  // `command` is refused as it would replace `file`, which it reads.
  void keeps(const std::string& command, const std::string& file) const {
    const std::string read = bytes(path(file));
    refuses(command, fs::path(file).filename().string() + ": is what is read: expected another directory");
    EXPECT_EQ(bytes(path(file)), read) << command;
  }
};

// The robot file that an earlier run had improved was removed by the run that read it.
TEST_F(Outputs, ARobotFileInOutIsNeitherRemovedNorReplaced) {
  put_log();
  const std::string gap = "gap h.csv --no-manoeuvre --no-shrink --quiet --out gap --robot ";
  ASSERT_EQ(run(gap + "robot.yaml").code, 0);
  fs::copy_file(path("robot.yaml"), path("gap/robot_improved.yaml"), fs::copy_options::overwrite_existing);
  fs::last_write_time(path("gap/robot_improved.yaml"), fs::last_write_time(path("gap/gap.json")));
  keeps(gap + "gap/robot_improved.yaml", "gap/robot_improved.yaml");
  keeps(gap + "./gap/../gap/robot_improved.yaml --force", "gap/robot_improved.yaml");
}

TEST_F(Outputs, ADescriptionThatAnEarlierRunEditedIsReadAndStays) {
  put_log();
  fs::create_directory(path("gap"));
  put("gap/r_improved.urdf",
      testing::stock_urdf("r", 15.0, 0.4, 0.0975, 0.4, {{"left_wheel", {0.0, 0.19}}, {"right_wheel", {0.0, -0.19}}}));
  put("gap/gap.json",
      "{\n  \"schema\": \"wheelwright/gap/1\", \"simulators\": [{\"file\": \"r_improved.urdf\"}, {\"file\": "
      "\"s_improved.urdf\"}]}");
  put("gap/s_improved.urdf", "<robot/>");
  const std::string read = bytes(path("gap/r_improved.urdf"));
  const Outcome done =
      run("gap h.csv --robot robot.yaml --no-manoeuvre --no-shrink --quiet --out gap --write-urdf gap/r_improved.urdf");
  EXPECT_EQ(bytes(path("gap/r_improved.urdf")), read) << done.err;
  EXPECT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(names_in("gap"), Not(Contains("s_improved.urdf")));
}

TEST_F(Outputs, NoResultTakesThePlaceOfWhatIsReadByForce) {
  commission_shipped();
  put_log();
  put("fleet.csv", "robot,log\na,h.csv\n");
  keeps("fleet fleet.csv --robot robot.yaml --out . --force", "fleet.csv");
  put("list.csv", "robot,log\na,fleet.csv\n");
  keeps("fleet list.csv --robot robot.yaml --out . --force", "fleet.csv");
  fs::copy_file(path("model/model.json"), path("check.json"));
  keeps("check check.json h.csv --out . --force", "check.json");
  fs::copy_file(path("h.csv"), path("residuals.csv"));
  fs::copy_file(path("robot.yaml"), path("robot_improved.yaml"));
  keeps("gap h.csv --robot robot_improved.yaml --out . --force", "robot_improved.yaml");
  keeps("gap h.csv --robot robot.yaml --baseline residuals.csv --out . --force", "residuals.csv");
}

TEST_F(Outputs, AFileOfARecordingThatIsReadIsNotReplaced) {
  put_log();
  ASSERT_EQ(run("convert h.csv bag --quiet").code, 0);
  std::string file;
  for (const std::string& name : names_in("bag")) {
    file = name.ends_with(".mcap") ? name : file;
  }
  ASSERT_FALSE(file.empty());
  const std::string before = bytes(path("bag/" + file));
  refuses("convert bag bag/" + file + " --force", file + ": is what is read");
  EXPECT_EQ(bytes(path("bag/" + file)), before);
}

// --series was forgotten beside --follow: exit code 0, and no file.
TEST_F(Outputs, AStreamWritesNoSeriesAndSaysSo) {
  commission_shipped();
  const std::string follow = "detect --follow --model model/model.json ";
  refuses(follow + "--series s.csv", "--series: expected a LOG instead of --follow");
  refuses(follow + "--layouts", "--layouts: expected a LOG instead of --follow");
  EXPECT_FALSE(fs::exists(path("s.csv")));
}

// A shell variable that was not set: the result went nowhere, and the exit code was 0.
TEST_F(Outputs, AnEmptyNameIsNotNone) {
  put_log();
  for (const char* const command :
       {"commission h.csv --robot robot.yaml", "doctor h.csv", "design --for bounds --robot robot.yaml", "fleet h.csv",
        "export m.json --language c", "robot --urdf r.urdf", "man", "try h.csv", "sensitivity s.yaml"}) {
    refuses(std::string(command) + " --out ''", "--out: is empty: expected a directory");
  }
  refuses("doctor --out= h.csv", "--out: is empty: expected a value");
  refuses("detect h.csv --model m.json --series ''", "--series: is empty: expected a file");
  refuses("gap h.csv --robot robot.yaml --write-urdf ''", "--write-urdf: is empty: expected a file");
  refuses("robot --urdf r.urdf --out-file ''", "--out-file: is empty: expected a file");
  refuses("doctor ''", "LOG: is empty: expected a file");
  refuses("convert h.csv ''", "is empty: expected a file");
  refuses("compare '' b.json", "BEFORE: is empty: expected a file");
  refuses("robot --urdf r.urdf --controller ''", "--controller: is empty: expected a value");
}

TEST_F(Outputs, ConvertWritesWhatItFoundIntoOut) {
  put_log(100);
  EXPECT_EQ(run("convert h.csv o.csv --out results --quiet").code, 0);
  EXPECT_EQ(Json::parse(bytes(path("results/convert.json"))).at("rows"), 99);
}

// The signal of a limit ended the program and left half a file.
TEST_F(Outputs, ALimitOfTheSizeOfFilesIsToldAndLeavesNothing) {
  put_log();
  refuses("convert h.csv o.csv", "o.csv: cannot be written (File too large)", "ulimit -f 50;");
  for (const auto& entry : fs::directory_iterator(directory_)) {
    EXPECT_THAT(entry.path().filename().string(), Not(StartsWith("o.csv")));
  }
}

// Threads whose stacks are larger than all memory that the process may have cannot be started.
TEST_F(Outputs, WithoutThreadsTheProgramSaysSo) {
#ifndef __SANITIZE_ADDRESS__  // which takes 15 TB of addresses
  const std::string none = "ulimit -s 4000000 && ulimit -v 3000000 &&";
  refuses("--version", "no thread can be started", none);
  refuses("doctor h.csv", "ulimit -u", none);
#endif
}

TEST_F(Outputs, CountsHaveNoSignAndDoNotWrap) {
  put_log();
  const std::string expected = ": expected a whole number from 0 to 18446744073709551615";
  const std::string commission = "commission h.csv --robot robot.yaml ";
  refuses(commission + "--outliers=-1", "--outliers: '-1'" + expected);
  refuses(commission + "--seed=99999999999999999999", "--seed: '99999999999999999999'" + expected);
  refuses("simulate s.yaml --out s.csv --seed=-1", "--seed: '-1'" + expected);
  refuses("doctor h.csv --rows=-18446744073709551615", "--rows: '-18446744073709551615'" + expected);
  EXPECT_LE(run("doctor h.csv --quiet --seed 18446744073709551615").code, 1);
}

TEST_F(Outputs, TheSecondSeriesHasTheWholeEndingOfTheFirst) {
  std::string scenario = bytes(examples() / "scenarios" / "healthy.yaml");
  core::replace_all(scenario, "../robot.yaml", "robot.yaml");
  put("healthy.yaml", scenario);
  ASSERT_EQ(run("simulate healthy.yaml --out log.csv --quiet").code, 0);
  ASSERT_EQ(run("commission log.csv --robot robot.yaml --out model --quiet").code, 0);
  for (const auto& [first, second] :
       {std::pair("s.csv.gz", "s_kinematic.csv.gz"), {"t.csv.zst", "t_kinematic.csv.zst"}, {"bag/", "bag_kinematic"}}) {
    const Outcome done = run(fmt::format("detect log.csv --model model/model.json --layouts --series {}", first));
    EXPECT_LE(done.code, 1) << done.err;
    EXPECT_TRUE(fs::exists(path(second))) << second;
  }
  for (const char* const layout : {"s.foxglove.json", "t.plotjuggler.xml", "bag.foxglove.json"}) {
    EXPECT_TRUE(fs::exists(path(layout))) << layout;
  }
}

// The second run took fleet.csv of the first, and the directory of its results, for robots.
TEST_F(Outputs, AFleetDoesNotTakeItsOwnResultsForRobots) {
  put_log();
  for (const std::string out : {"logs", "logs/result"}) {
    fs::remove_all(path("logs"));
    fs::create_directories(path("logs/bob"));
    fs::copy_file(path("h.csv"), path("logs/amy.csv"));
    fs::copy_file(path("h.csv"), path("logs/bob/monday.csv"));
    const std::string fleet = "fleet logs --robot robot.yaml --out " + out;
    ASSERT_LE(run(fleet).code, 1);
    const std::string first = bytes(path(out + "/fleet.csv"));
    const Outcome again = run(fleet);
    EXPECT_LE(again.code, 1) << again.err;
    EXPECT_EQ(bytes(path(out + "/fleet.csv")), first);
    EXPECT_THAT(again.err, HasSubstr(out + "/fleet.csv: left out: a result of this command"));
  }
  refuses("fleet logs --robot robot.yaml --out logs/bob", "--out logs/bob: holds logs of the robot 'bob'");
}

TEST_F(Outputs, NoLogIsPutIntoTheRecordingThatItComesFrom) {
  put_log(500);
  ASSERT_EQ(run("convert h.csv bag/ --quiet").code, 0);
  const std::vector<std::string> before = names_in("bag");
  refuses("convert bag bag/more.mcap", "bag/more.mcap: would be one of the files of the recording that is read");
  refuses("convert bag/ ./bag/../bag/more.db3", "would be one of the files of the recording that is read");
  EXPECT_EQ(names_in("bag"), before);
  EXPECT_EQ(run("convert bag bag/table.csv --quiet").code, 0);
}

TEST_F(Outputs, ASimulationDoesNotReplaceWhatItsScenarioNames) {
  put("table.csv", "t,command_r,command_l\n0,1,1\n1,2,1\n2,1,1\n");
  put("s.yaml",
      "robot: robot.yaml\nparameters: {mass: 21, yaw_inertia: 1, viscous_linear: 4, viscous_yaw: 1}\n"
      "trajectory: {kind: table, file: table.csv}\n");
  for (const std::string file : {"table.csv", "robot.yaml", "s.yaml"}) {
    const std::string read = bytes(path(file));
    refuses("simulate s.yaml --force --out ./" + file, file + ": is what is read: expected another name");
    EXPECT_EQ(bytes(path(file)), read);
  }
  EXPECT_EQ(run("simulate s.yaml --out log.csv").code, 0);
}

TEST_F(Outputs, ALogBesideFollowIsRefused) {
  commission_shipped();
  put_log(500);
  refuses("detect h.csv --follow --model model/model.json",
          "h.csv: a LOG beside --follow, which reads standard input: expected one of them");
}

TEST_F(Outputs, WhatIsReplacedHandsOnItsMode) {
  put_log(500);
  const auto mode_of = [&](const std::string& file) { return fs::status(path(file)).permissions(); };
  const std::string convert = "convert h.csv out.csv --force --quiet --out result";
  ASSERT_EQ(run(convert).code, 0);
  for (const fs::perms mode : {fs::perms(0600), fs::perms(0660), fs::perms(0644)}) {
    for (const std::string file : {"out.csv", "result/convert.json"}) {
      fs::permissions(path(file), mode);
    }
    ASSERT_EQ(run(convert).code, 0);
    EXPECT_EQ(mode_of("out.csv"), mode);
    EXPECT_EQ(mode_of("result/convert.json"), mode);
  }
}

// By a user who may write into the directories and not into the files; as root the program is another user's.
TEST_F(Outputs, WhatMayNotBeWrittenIsNotReplaced) {
  put_log(500);
  ASSERT_EQ(run("convert h.csv out.csv --quiet --out result").code, 0);
  for (const std::string file : {"out.csv", "result/convert.json"}) {
    fs::permissions(path(file), fs::perms(0444));
  }
  for (const std::string folder : {".", "result"}) {
    fs::permissions(path(folder), fs::perms(0777));
  }
  const std::string other = geteuid() == 0 ? "setpriv --reuid 65534 --clear-groups" : "";
  const std::string read = bytes(path("result/convert.json"));
  refuses("convert h.csv out.csv --force", "out.csv: cannot be replaced (Permission denied)", other);
  refuses("convert h.csv new.csv --force --out result", "result/convert.json: cannot be written (Permission denied)",
          other);
  EXPECT_EQ(bytes(path("result/convert.json")), read);
  const Outcome done = run("convert h.csv other.csv --quiet", "/dev/null", other);
  EXPECT_EQ(done.code, 0) << done.err;
}

TEST_F(Outputs, StandardOutputTakesALogAndNothingElse) {
  put_log();
  ASSERT_EQ(run("convert h.csv plain.csv --quiet").code, 0);
  const Outcome converted = run("convert h.csv /dev/stdout");
  EXPECT_EQ(converted.code, 0);
  EXPECT_TRUE(converted.out == bytes(path("plain.csv"))) << converted.out.size();
  EXPECT_THAT(converted.err, HasSubstr("wrote /dev/stdout"));
  EXPECT_TRUE(run("convert h.csv /proc/self/fd/1").out == converted.out);
  refuses("convert h.csv /dev/stdout --json", "/dev/stdout: is the standard output, where --json prints");

  simulate("shipped.yaml", "s.csv");
  const std::string scenario = "'" + (examples() / "scenarios" / "shipped.yaml").string() + "'";
  const Outcome simulated = run("simulate " + scenario + " --out /dev/stdout");
  EXPECT_TRUE(simulated.out == bytes(path("s.csv"))) << simulated.out.size();
  EXPECT_THAT(simulated.err, HasSubstr("wrote /dev/stdout"));
}

TEST_F(Outputs, StandardOutputTakesASeriesAndNothingElse) {
  commission_shipped();
  put_log();
  const std::string detect = "detect h.csv --model model/model.json --series ";
  const Outcome file = run(detect + "s.csv"), stream = run(detect + "/dev/stdout");
  EXPECT_EQ(stream.code, file.code) << stream.err;
  EXPECT_TRUE(stream.out == bytes(path("s.csv"))) << stream.out.size();
  EXPECT_THAT(stream.err, HasSubstr("wrote /dev/stdout"));
  refuses(detect + "/dev/stdout --layouts", "--layouts: expected --series FILE");
}

}  // namespace
}  // namespace wheelwright::app::outputs_test
