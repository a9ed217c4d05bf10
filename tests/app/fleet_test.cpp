// SPDX-License-Identifier: Apache-2.0
// A small fleet through the program: what it finds, and that it finds the same however it is run.
#include <thread>

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include "tests/app/program.hpp"

namespace wheelwright::app::fleet_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::lines_of;
using testing::Outcome;

const std::vector<std::string> kFiles = {"fleet.csv", "fleet.json", "pooled_prior.yaml", "report.html"};

class FleetCommand : public testing::ProgramTest {
 protected:
  /// `robots` simulated robots, each with a log to commission with and `checks` later ones, in the directory `fleet`.
  void make(int robots, int checks, double seconds) const {
    const std::string command = fmt::format("'{}' '{}' --robots {} --checks {} --seconds {}", WHEELWRIGHT_MAKE_FLEET,
                                            path("fleet").string(), robots, checks, seconds);
    ASSERT_EQ(std::system(command.c_str()), 0);
  }

  /// The rows of a log of the fleet, its efforts multiplied by `factor`: as a robot with everything heavier would have.
  void scale_efforts(const std::string& log, double factor) const {
    std::vector<std::string> lines = lines_of(bytes(path(log)));
    const auto fields = [](const std::string& line) {
      std::vector<std::string> out(1);
      for (const char c : line) {
        c == ',' ? out.emplace_back() : out.back() += c;
      }
      return out;
    };
    const std::vector<std::string> header = fields(lines[0]);
    for (std::size_t k = 1; k < lines.size(); ++k) {
      std::vector<std::string> row = fields(lines[k]);
      std::string text;
      for (std::size_t c = 0; c < row.size(); ++c) {
        if (header[c].starts_with("tau_")) {
          row[c] = fmt::format("{}", factor * std::stod(row[c]));
        }
        text += (c == 0 ? "" : ",") + row[c];
      }
      lines[k] = text;
    }
    put_lines(log, lines);
  }

  Outcome fleet(const std::string& out, const std::string& more = "") const {
    return run("fleet fleet/fleet.csv --robot fleet/robot.yaml --quiet --out " + out + " " + more);
  }

  /// For run(): touches `file` all the time that the program runs.
  static std::string touching(const std::string& file) {
    return "sh -c '(while :; do touch " + file + "; done) & \"$@\"; code=$?; kill $!; exit $code' sh";
  }

  /// The result files of `out`.
  std::vector<std::string> results(const std::string& out) const {
    std::vector<std::string> all;
    for (const std::string& name : kFiles) {
      all.push_back(bytes(path(out + "/" + name)));
      EXPECT_FALSE(all.back().empty()) << name;
    }
    return all;
  }
};

TEST_F(FleetCommand, FindsWhatIsWrongAndStopsForNothing) {
  make(7, 1, 12);
  scale_efforts("fleet/logs/robot_2_0.csv", 2.0);  // twice as heavy from the beginning
  scale_efforts("fleet/logs/robot_2_1.csv", 2.0);
  scale_efforts("fleet/logs/robot_3_1.csv", 1.5);  // heavier a week later
  put("fleet/logs/robot_4_0.csv", std::string("\0\1garbage\n\xff\n", 12));
  std::filesystem::remove(path("fleet/logs/robot_5_1.csv"));
  const Outcome done = fleet("result", "--json");
  EXPECT_EQ(done.code, 1) << done.err;
  const Json json = Json::parse(done.out);
  EXPECT_EQ(json["robots"]["all"], 7);
  EXPECT_EQ(json["robots"]["status"]["unreadable"], 1);
  EXPECT_EQ(json["robots"]["status"]["commissioned"], 6);
  EXPECT_EQ(json["robots"]["drifting_for_certain"], 1);
  EXPECT_EQ(json["drift"][0]["robot"], "robot_3");
  EXPECT_EQ(json["drift"][0]["per"], "week");
  ASSERT_FALSE(json["alarms"].empty());
  EXPECT_EQ(json["alarms"][0]["robot"], "robot_3");
  ASSERT_FALSE(json["outside"].empty());
  EXPECT_EQ(json["outside"][0]["robot"], "robot_2");
  EXPECT_TRUE(json["outside"][0]["certain"]);
  std::vector<std::string> failed;
  for (const Json& entry : json["failed"]) {
    failed.push_back(entry["robot"]);
  }
  EXPECT_THAT(failed, ::testing::Contains("robot_4"));
  EXPECT_THAT(failed, ::testing::Contains("robot_5"));
  EXPECT_THAT(json["pooled_prior"]["message"], HasSubstr("are needed"));
  EXPECT_THAT(names_in("result"),
              ElementsAre("fleet.csv", "fleet.json", "pooled_prior.yaml", "report.html", "results.sqlite"));
  if (has_validator()) {
    EXPECT_EQ(misfit("fleet.schema.json", "result/fleet.json"), "");
    Json changed = json;
    changed["robots"]["all"] = -1;
    files::write_json(path("changed.json"), changed);
    EXPECT_NE(misfit("fleet.schema.json", "changed.json"), "");
  }
  const std::string page = bytes(path("result/report.html"));
  for (const char* word : {"robot_2", "robot_3", "robot_4", "Population", "Pooled prior", "6 of 7 robots"}) {
    EXPECT_THAT(page, HasSubstr(word));
  }
}

// A layout of HDF5 in chunks without dimensions made the library divide by zero, which ended the whole run; a hostile
// journal beside the results let SQLite delete any file.
TEST_F(FleetCommand, AHostileFileEndsNeitherTheRunNorAnotherFile) {
  std::filesystem::create_directories(path("fleet/sound"));
  ASSERT_EQ(run("convert '" + (examples() / "healthy.csv.gz").string() + "' fleet/sound/monday.h5").code, 0);
  std::string log = bytes(path("fleet/sound/monday.h5"));
  const std::string sizes("\0\x20\0\0\x08\0\0\0", 8);
  std::size_t changed = 0;
  for (std::size_t at = log.find(sizes); at != std::string::npos; at = log.find(sizes, at + 1)) {
    if (at >= 11 && log.compare(at - 11, 3, "\x03\x02\x02") == 0) {
      log[at - 9] = '\1';
      ++changed;
    }
  }
  ASSERT_GT(changed, 0u);
  std::filesystem::create_directories(path("fleet/hostile"));
  put("fleet/hostile/monday.h5", log);
  const Outcome done = run("fleet fleet --robot robot.yaml --quiet --json --out result");
  EXPECT_EQ(done.code, 1) << done.err;
  const Json json = Json::parse(done.out);
  EXPECT_EQ(json["robots"]["status"]["commissioned"], 1);
  EXPECT_EQ(json["robots"]["status"]["unreadable"], 1);
  ASSERT_EQ(json["failed"].size(), 1u);
  EXPECT_EQ(json["failed"][0]["robot"], "hostile");

  const auto victim = put("victim.txt", "dear to somebody");
  put("result/results.sqlite-journal", victim.string() + std::string("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8));
  const Outcome refused = run("fleet fleet --robot robot.yaml --quiet --out result");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("results.sqlite-journal: names another file"));
  EXPECT_TRUE(std::filesystem::exists(victim));
}

TEST_F(FleetCommand, HoweverItIsRunTheResultsAreTheSame) {
  make(6, 0, 10);
  ASSERT_EQ(fleet("one").code, 0);
  const std::vector<std::string> one = results("one");
  ASSERT_EQ(fleet("two", "--threads 2").code, 0);
  EXPECT_EQ(results("two"), one);
  for (const char* shard : {"--shard 3/3", "--shard 1/3", "--shard 2/3"}) {
    ASSERT_EQ(fleet("shards", shard).code, 0);
  }
  ASSERT_EQ(fleet("shards", "--merge").code, 0);
  EXPECT_EQ(results("shards"), one);
  // Again: nothing is left to do, and a log that changed is examined anew.
  ASSERT_EQ(fleet("one").code, 0);
  EXPECT_EQ(results("one"), one);
  scale_efforts("fleet/logs/robot_6_0.csv", 1.02);
  (void)fleet("one");
  EXPECT_NE(results("one")[0], one[0]);
}

// A log that was still being written ended the whole run with exit code 2, all other robots with it.
TEST_F(FleetCommand, ALogThatIsWrittenToIsItsRobotsFinding) {
  make(3, 0, 10);
  const std::string written = "fleet/logs/robot_2_0.csv";
  const std::string words = "fleet fleet/fleet.csv --robot fleet/robot.yaml --json --out ";
  const Outcome told = run(words + "result", "/dev/null", touching(written));
  ASSERT_EQ(told.code, 1) << told.err;
  const Json json = Json::parse(told.out);
  EXPECT_EQ(json["robots"]["status"]["commissioned"], 2);
  EXPECT_EQ(json["robots"]["status"]["unreadable"], 1);
  ASSERT_EQ(json["failed"].size(), 1U);
  EXPECT_EQ(json["failed"][0]["robot"], "robot_2");
  EXPECT_THAT(json["failed"][0]["reason"].get<std::string>(), AllOf(HasSubstr(written), HasSubstr("written to while")));
  EXPECT_THAT(bytes(path("result/report.html")), HasSubstr("written to while"));
  // Then it is as whole as if nothing had been.
  ASSERT_EQ(run(words + "result").code, 0);
  ASSERT_EQ(run(words + "whole").code, 0);
  EXPECT_EQ(results("result"), results("whole"));

  const std::string shard = "fleet fleet/fleet.csv --robot fleet/robot.yaml --out shards ";
  const Outcome first = run(shard + "--shard 1/1", "/dev/null", touching("fleet/logs/robot_3_0.csv"));
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.out, AllOf(HasSubstr("not kept: 'robot_3"), HasSubstr("run this shard again")));
  const Outcome missing = run(shard + "--merge");
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, AllOf(HasSubstr("1 of 3 items are missing"), HasSubstr("robot_3")));
  EXPECT_THAT(run(shard + "--shard 1/1").out, HasSubstr("1 items evaluated, 2 were there"));
  ASSERT_EQ(run(shard + "--merge").code, 0);
  EXPECT_EQ(results("shards"), results("whole"));
}

TEST_F(FleetCommand, KilledInTheMiddleItGoesOn) {
  make(12, 0, 10);
  ASSERT_EQ(fleet("whole").code, 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const int nowhere = open("/dev/null", O_RDWR);
    dup2(nowhere, 1);
    dup2(nowhere, 2);
    if (chdir(directory_.c_str()) == 0) {
      execl(WHEELWRIGHT_PROGRAM, "wheelwright", "fleet", "fleet/fleet.csv", "--robot", "fleet/robot.yaml", "--quiet",
            "--out", "killed", static_cast<char*>(nullptr));
    }
    _exit(127);
  }
  // Once it has begun to keep results; where it was quicker than that, there is nothing left to kill.
  while (!std::filesystem::exists(path("killed/results.sqlite")) && waitpid(child, nullptr, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ASSERT_EQ(fleet("killed").code, 0);
  EXPECT_EQ(results("killed"), results("whole"));
}

TEST_F(FleetCommand, BadUsageIsTold) {
  put("list.csv", "robot,logs\n");
  const Outcome wrong = run("fleet list.csv --robot robot.yaml --out result");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("list.csv:1: unknown column 'logs'"));
  EXPECT_EQ(run("fleet nowhere --robot robot.yaml").code, 2);
  put("good.csv", "robot,log\namy,gone.csv\n");
  const Outcome lost = run("fleet good.csv --json");
  EXPECT_EQ(lost.code, 1) << "a robot that could not be examined is a finding";
  EXPECT_THAT(lost.out, HasSubstr("gone.csv: no such file"));
}

TEST_F(FleetCommand, TellsWhyNothingCouldBeExamined) {
  put("a.csv", "t\n0\n");
  put("b.csv", "t\n0\n");
  put("list.csv", "robot,log\namy,a.csv\nbob,b.csv\ncleo,gone.csv\n");
  const Outcome told = run("fleet list.csv");
  EXPECT_EQ(told.code, 1);
  EXPECT_THAT(told.out, HasSubstr("  amy, a.csv and 2 more: no robot file: expected --robot"));
  EXPECT_THAT(told.out, HasSubstr("  cleo: gone.csv: no such file"));
}

}  // namespace
}  // namespace wheelwright::app::fleet_test
