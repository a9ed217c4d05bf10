// SPDX-License-Identifier: Apache-2.0
// What a power cut leaves is what was there or what is new, either whole: the bytes of a file are on disk before it
// gets its name, and the name is on disk before the command ends.
#include <algorithm>
#include <map>
#include <set>

#include "tests/app/program.hpp"

namespace wheelwright::app::power_cut_test {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;
using testing::Outcome;

const std::string kDrive =
    "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
    "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 3}\nduration: 20\nrate: 50\n"
    "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02}\n";

std::string wheel(const std::string& name, double y) {
  return fmt::format(
      "<link name='{0}'/><joint name='{0}' type='continuous'><parent link='base'/><child link='{0}'/>"
      "<axis xyz='0 1 0'/><origin xyz='0 {1} 0'/></joint>",
      name, y);
}

class PowerCut : public testing::ProgramTest {
 protected:
  /// Runs a command with its calls recorded (files/recorded_calls.cpp), `more` of that library's variables beside.
  Outcome recorded(const std::string& arguments, const std::string& more = "") const {
    fs::remove(path("calls"));
    return run(arguments, "/dev/null",
               fmt::format("env ASAN_OPTIONS=\"$ASAN_OPTIONS:verify_asan_link_order=0\" RECORDED_CALLS='{}' {} "
                           "LD_PRELOAD='{}'",
                           path("calls").string(), more, WHEELWRIGHT_RECORDED_CALLS));
  }

  /// What a power cut could lose of the last recorded run: renamed files whose bytes were not all on disk, and
  /// directories whose names were not when it ended.
  std::vector<std::string> at_risk() const {
    std::vector<std::string> out;
    std::map<std::string, std::string> on_disk;  // bytes, by path
    std::set<std::string> changed;               // directories
    for (const std::string& line : testing::lines_of(bytes(path("calls")))) {
      std::vector<std::string> words;
      std::istringstream in(line);
      for (std::string word; std::getline(in, word, '\t');) {
        words.push_back(word);
      }
      if (words.at(0) == "sync") {
        on_disk[words.at(1)] = words.at(2);
        changed.erase(words.at(1));
      } else {
        const std::string &from = words.at(1), &to = words.at(2), &size = words.at(3);
        if (!on_disk.contains(from) || on_disk.at(from) != size) {
          out.push_back("renamed before its bytes are on disk: " + to);
        }
        on_disk[to] = size;
        changed.insert(fs::path(to).parent_path());
      }
    }
    for (const std::string& directory : changed) {
      out.push_back("names not on disk: " + directory);
    }
    return out;
  }

  /// Names of the test's directory that files were renamed to in the last recorded run.
  std::vector<std::string> renamed() const {
    std::vector<std::string> out;
    for (const std::string& line : testing::lines_of(bytes(path("calls")))) {
      if (line.starts_with("move\t")) {
        const std::string rest = line.substr(line.find('\t', 5) + 1);
        out.push_back(fs::path(rest.substr(0, rest.find('\t'))).lexically_relative(fs::canonical(directory_)));
      }
    }
    return out;
  }

  void keeps(const std::string& arguments, const std::vector<std::string>& files) const {
    const Outcome outcome = recorded(arguments);
    ASSERT_EQ(outcome.code, 0) << arguments << "\n" << outcome.err;
    EXPECT_THAT(renamed(), ::testing::IsSupersetOf(files)) << arguments;
    EXPECT_THAT(at_risk(), IsEmpty()) << arguments;
  }
};

// The bytes were brought to disk, the new name was not: a power cut after the command could bring the old file back.
TEST_F(PowerCut, EveryFileIsOnDiskBeforeItHasItsNameAndItsNameBeforeTheEnd) {
  put("drive.yaml", kDrive);
  keeps("simulate drive.yaml --out log.csv", {"log.csv"});
  for (const std::string name : {"other.csv", "log.csv.gz", "log.csv.zst", "log.mcap", "log.db3", "log.h5"}) {
    keeps("convert log.csv " + name, {name});
  }
  keeps("convert log.csv bag", {"bag"});
  put("robot.urdf",
      "<robot name='r'><link name='base'><inertial><mass value='9'/>"
      "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>" +
          wheel("left", 0.2) + wheel("right", -0.2) + "</robot>");
  keeps("robot --urdf robot.urdf --wheel-radius 0.1 --massless left --massless right --out-file made.yaml",
        {"made.yaml"});
  keeps("man --out pages", {"pages/wheelwright.1", "pages/wheelwright-gap.1"});
  ASSERT_EQ(run("commission log.csv --robot robot.yaml --out model").code, 0);
  keeps("export model/model.json --language c --out firmware", {"firmware/wheelwright.h"});
  keeps("detect log.csv --model model/model.json --layouts --series drawn.csv",
        {"drawn.csv", "drawn.plotjuggler.xml", "drawn.foxglove.json"});
  for (const std::string name : {"series.csv", "series.mcap", "series.db3", "series.h5"}) {
    keeps("detect log.csv --model model/model.json --series " + name, {name});
  }
}

// At each of these calls the run is killed, or the call fails.
TEST_F(PowerCut, ARunThatEndsAtAnyCallLeavesTheOldFileOrTheNewOne) {
  put("drive.yaml", kDrive);
  ASSERT_EQ(run("simulate drive.yaml --out log.csv").code, 0);
  for (const std::string name : {"made.csv", "made.mcap", "made.db3"}) {
    const std::string convert = "convert log.csv " + name + " --force";
    ASSERT_EQ(recorded(convert).code, 0);
    const std::string whole = bytes(path(name));
    const std::size_t calls = testing::lines_of(bytes(path("calls"))).size();
    ASSERT_GE(calls, 3U);
    for (const std::string how : {"KILL", "FAIL"}) {
      for (std::size_t call = 1; call <= calls; ++call) {
        put(name, "old");
        const Outcome outcome = recorded(convert, fmt::format("RECORDED_CALLS_{}={}", how, call));
        EXPECT_TRUE(how == "KILL" ? outcome.code != 0 : outcome.code == 2) << outcome.code << outcome.err;
        EXPECT_EQ(bytes(path(name)), call < calls ? "old" : whole) << how << " at call " << call;
        ASSERT_EQ(run(convert).code, 0);
        EXPECT_EQ(bytes(path(name)), whole);
        EXPECT_THAT(names_in("."), ::testing::Each(::testing::Not(::testing::HasSubstr("part"))));
      }
    }
  }
}

// A run that was killed, interrupted or failed between the renames of its files left some of them without the result,
// and the next was refused for them: "not written by `wheelwright gap`".
TEST_F(PowerCut, AResultIsPutInItsPlaceTogether) {
  put("drive.yaml", kDrive);
  ASSERT_EQ(run("simulate drive.yaml --out log.csv").code, 0);
  const std::string gap = "gap log.csv --robot robot.yaml --no-manoeuvre --no-shrink --out out";
  keeps(gap, {"out/report.html", "out/residuals.csv", "out/gap.json"});
  const std::vector<std::string> whole = names_in("out");
  const std::size_t calls = testing::lines_of(bytes(path("calls"))).size();
  for (const std::string how : {"KILL", "FAIL"}) {
    for (std::size_t call = calls - whole.size(); call <= calls; ++call) {
      fs::remove_all(path("out"));
      EXPECT_NE(recorded(gap, fmt::format("RECORDED_CALLS_{}={}", how, call)).code, 0);
      if (how == "FAIL") {
        EXPECT_EQ(fs::exists(path("out")), call == calls) << "all of it or nothing";
      }
      const Outcome next = run(gap);
      EXPECT_EQ(next.code, 0) << how << " at call " << call << "\n" << next.err;
      EXPECT_EQ(names_in("out"), whole);
    }
  }
}

}  // namespace
}  // namespace wheelwright::app::power_cut_test
