// SPDX-License-Identifier: Apache-2.0
// Help, exit codes, and what goes to which stream.
#include "tests/app/program.hpp"

namespace wheelwright::app::usage_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Usage : public testing::ProgramTest {};

TEST_F(Usage, HelpOfTheProgramNamesItsCommands) {
  const Outcome outcome = run("--help");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("commission"), HasSubstr("detect"), HasSubstr("check"),
                                 HasSubstr("simulate"), HasSubstr("identify"), HasSubstr("design"),
                                 HasSubstr("wheelwright commission LOG --robot robot.yaml --out result")));
  EXPECT_THAT(run("--version").out, HasSubstr("wheelwright "));
}

TEST_F(Usage, HelpOfEachCommandNamesOptionsAndExamples) {
  const std::string commission = run("commission --help").out;
  const std::string detect = run("detect --help").out;
  const std::string check = run("check --help").out;
  const std::string simulate = run("simulate --help").out;
  const std::string identify = run("identify --help").out;
  const std::string design = run("design --help").out;
  for (const std::string& help : {commission, detect, check, simulate, identify, design}) {
    for (const std::string option : {"--help", "--out", "--json", "--threads", "--seed", "--quiet", "Examples:\n"}) {
      EXPECT_THAT(help, HasSubstr(option));
    }
  }
  for (const std::string option : {"LOG", "--robot", "--map", "--statistical", "--outliers", "--persistence",
                                   "Exit code:", "  wheelwright commission drive.csv"}) {
    EXPECT_THAT(commission, HasSubstr(option));
  }
  for (const std::string option : {"LOG", "--model", "--map", "--follow", "--set", "--test", "--persistence",
                                   "Exit code:", "  wheelwright detect drive.csv"}) {
    EXPECT_THAT(detect, HasSubstr(option));
  }
  for (const std::string option : {"MODEL", "LOG", "--map", "Exit code:", "  wheelwright check result/model.json"}) {
    EXPECT_THAT(check, HasSubstr(option));
  }
  for (const std::string option :
       {"LOG", "--robot", "--map", "--no-shapes", "Exit code:", "  wheelwright identify drive.csv"}) {
    EXPECT_THAT(identify, HasSubstr(option));
  }
  for (const std::string option : {"--for", "--model", "--robot", "--speed", "--acceleration", "--effort", "--radius",
                                   "--box", "--duration", "  wheelwright design --model"}) {
    EXPECT_THAT(design, HasSubstr(option));
  }
  EXPECT_THAT(simulate, AllOf(HasSubstr("SCENARIO"), HasSubstr("  wheelwright simulate ")));
}

TEST_F(Usage, BadUsageIsTwo) {
  for (const std::string words : {"", "frobnicate", "commission", "commission x.csv", "commission --robot robot.yaml",
                                  "detect", "detect --model m.json", "check", "check m.json", "simulate",
                                  "commission --out", "identify", "identify x.csv", "design"}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.out, IsEmpty()) << words;
    EXPECT_FALSE(outcome.err.empty()) << words;
  }
}

TEST_F(Usage, OptionsThatNeedOthersSayWhich) {
  put("list.csv", "robot,log\na,a.csv\n");
  put("a.csv", "t,omega_r\n");
  for (const auto& [words, expected] : std::initializer_list<std::pair<std::string, std::string>>{
           {"robot --urdf a.urdf --controller drive", "--controller: expected --ros2-control FILE with it"},
           {"robot --urdf a.urdf --out-file r.yaml --out d", "--out-file and --out: two places for one file"},
           {"fleet list.csv --robot robot.yaml --shard 1/2", "--shard: expected --out DIR"},
           {"fleet list.csv --robot robot.yaml --merge", "--merge: expected --out DIR"},
           {"fleet list.csv --robot robot.yaml --fresh", "--fresh: expected --out DIR"},
           {"fleet list.csv --robot robot.yaml --out o --shard 1/2 --merge",
            "--shard and --merge: expected one of them"},
           {"fleet list.csv --robot robot.yaml --out o --shard 3/2", "--shard '3/2': expected I/N"},
           {"fleet list.csv --robot robot.yaml --out o --merge", "no shard-I-of-N.sqlite"},
           {"gap a.csv --robot robot.yaml --without viscos", "did you mean 'viscous'?"},
           {"gap a.csv --robot robot.yaml --left a --right b", "--left and --right: expected --write-mjcf"},
           {"gap a.csv --robot robot.yaml --write-urdf a.urdf", "--write-urdf: expected --out DIR with it"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.out, IsEmpty()) << words;
    EXPECT_THAT(outcome.err, HasSubstr(expected)) << words;
  }
  commission_shipped();
  for (const auto& [words, expected] : std::initializer_list<std::pair<std::string, std::string>>{
           {"--heartbeat 1", "--heartbeat: expected --follow"},
           {"", "expected a LOG, or --follow"},
           {"a.csv --layouts", "--layouts: expected --series FILE"}}) {
    const Outcome outcome = run("detect --model model/model.json " + words);
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.err, HasSubstr(expected)) << words;
  }
}

TEST_F(Usage, ExitCodeAnswersTheQuestion) {
  commission_shipped();
  simulate("healthy.yaml", "healthy.csv");
  simulate("fault.yaml", "fault.csv");
  EXPECT_EQ(run("detect healthy.csv --model model/model.json").code, 0);
  const Outcome fault = run("detect fault.csv --model model/model.json");
  EXPECT_EQ(fault.code, 1);
  EXPECT_THAT(fault.out, HasSubstr("fault event"));
  // Bounds that exclude the robot: no model.
  put("heavy.yaml", bytes(path("robot.yaml")) + "prior: {mass: [40, 60]}\n");
  const Outcome none = run("commission healthy.csv --robot heavy.yaml --out heavy");
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.out, AllOf(HasSubstr("no parameters explain the log"), HasSubstr("contradict")));
  const Outcome useless = run("detect fault.csv --model heavy/model.json");
  EXPECT_EQ(useless.code, 2);
  EXPECT_THAT(useless.err, HasSubstr("heavy/model.json: holds no model"));
}

TEST_F(Usage, JsonIsAllThatGoesToStandardOutput) {
  const Outcome simulated =
      run("simulate '" + (examples() / "scenarios/fault.yaml").string() + "' --out fault.csv --json");
  EXPECT_EQ(Json::parse(simulated.out).at("rows"), 6001);
  const std::string shipped = fmt::format("'{}'", (examples() / "healthy.csv.gz").string());
  const Outcome commissioned = run("commission " + shipped + " --robot robot.yaml --json --out model");
  EXPECT_EQ(Json::parse(commissioned.out), files::read_json(path("model/model.json")));
  const Outcome detected = run("detect fault.csv --model model/model.json --json --out result");
  EXPECT_EQ(Json::parse(detected.out), files::read_json(path("result/detection.json")));
  const Outcome followed = run("detect --follow --model model/model.json --json", path("fault.csv"));
  std::size_t events = 0, at_risk = 0;
  for (const std::string& line : testing::lines_of(followed.out)) {
    const Json event = Json::parse(line);
    if (event.contains("incident")) {
      continue;
    }
    EXPECT_TRUE(event.contains("alarm") || event.at("at_risk").contains("alarm")) << line;
    ++(event.contains("alarm") ? events : at_risk);
  }
  EXPECT_EQ(events, Json::parse(detected.out).at("events").size());
  EXPECT_EQ(at_risk, Json::parse(detected.out).at("at_risk").at("events").size());
}

TEST_F(Usage, QuietIsSilent) {
  const Outcome outcome =
      run("commission '" + (examples() / "healthy.csv.gz").string() + "' --robot robot.yaml --quiet --out model");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.out + outcome.err, IsEmpty());
}

}  // namespace
}  // namespace wheelwright::app::usage_test
