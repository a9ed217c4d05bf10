// SPDX-License-Identifier: Apache-2.0
// `wheelwright doctor`, as a user runs it.
#include "tests/app/program.hpp"

namespace wheelwright::app::doctor_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;

class Doctor : public testing::ProgramTest {
 protected:
  static std::string shipped() { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }
};

TEST_F(Doctor, FindsTheShippedLogFitToBeCommissioned) {
  const Outcome told = run("doctor " + shipped() + " --robot robot.yaml");
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("The log can be commissioned."));
  EXPECT_THAT(told.out, Not(HasSubstr("warning")));
  EXPECT_THAT(run("doctor " + shipped() + " --robot robot.yaml --all").out, HasSubstr("fine: time.rate"));
  // Without a robot file it is said what was assumed, and that its efforts are held commands.
  const Outcome alone = run("doctor " + shipped());
  EXPECT_EQ(alone.code, 0) << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("no robot file"));
  EXPECT_THAT(alone.out, HasSubstr("Set effort.hold to"));
}

TEST_F(Doctor, PlacesOfAWallClockAreSecondsOfTheLogAndMoments) {
  std::vector<std::string> lines = healthy_lines(), kept = {lines[0]};
  for (std::size_t k = 1; k < 3000; ++k) {
    const std::size_t comma = lines[k].find(',');
    if (k % 1000 < 500 || k % 1000 > 502) {
      kept.push_back(
          fmt::format("{:.6f}{}", 1'795'941'600.0 + std::stod(lines[k].substr(0, comma)), lines[k].substr(comma)));
    }
  }
  put_lines("drive.csv", kept);
  const Outcome told = run("doctor drive.csv --robot robot.yaml");
  EXPECT_THAT(told.out, HasSubstr("times are counted from 1795941600 s of its own clock, 2026-11-29 08:40:00.000 UTC"));
  EXPECT_THAT(told.out, HasSubstr("at t = 4.98 to 5.02 s (2026-11-29 08:40:04.980 UTC)"));
  EXPECT_THAT(told.out, Not(HasSubstr("e+09")));
}

TEST_F(Doctor, DaysAreRefusedByEveryCommandWithWhatMakesSecondsOfThem) {
  std::vector<std::string> lines = healthy_lines();
  lines.resize(3000);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    const std::size_t comma = lines[k].find(',');
    lines[k] =
        fmt::format("{:.11f}{}", 46110.0 + std::stod(lines[k].substr(0, comma)) / 86400.0, lines[k].substr(comma));
  }
  put_lines("drive.csv", lines);
  for (const char* command : {"doctor", "commission", "identify"}) {
    const Outcome told =
        run(fmt::format("{} drive.csv --robot robot.yaml", command), "/dev/null", "ulimit -v 2000000;");
    EXPECT_NE(told.code, 0);
    EXPECT_THAT(told.out + told.err, HasSubstr("look like days")) << command;
    EXPECT_THAT(told.out + told.err, HasSubstr("--map t=\"t*86400\"")) << command;
    EXPECT_THAT(told.err, Not(HasSubstr("\\x0A"))) << command;
  }
}

TEST_F(Doctor, WritesWhatItFound) {
  const Outcome done = run("doctor " + shipped() + " --robot robot.yaml --out examined --quiet");
  ASSERT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(done.out, IsEmpty());
  EXPECT_THAT(names_in("examined"), ElementsAre("doctor.json", "report.html"));
  const Json json = files::read_json(path("examined/doctor.json"));
  EXPECT_EQ(json.at("verdict"), "commission");
  EXPECT_EQ(json.at("rows"), 12001);
  EXPECT_EQ(Json::parse(run("doctor " + shipped() + " --robot robot.yaml --json").out), json);
  if (has_validator()) {
    EXPECT_EQ(misfit("doctor.schema.json", "examined/doctor.json"), "");
  }
}

TEST_F(Doctor, SaysNoToALogThatCannotBeCommissioned) {
  // tau_l (the last column) is dead, and two rows stand twice.
  std::vector<std::string> lines = healthy_lines();
  for (std::size_t k = 1; k < lines.size(); ++k) {
    lines[k] = lines[k].substr(0, lines[k].rfind(',')) + ",0";
  }
  lines.insert(lines.begin() + 10, lines[10]);
  lines.insert(lines.begin() + 20, lines[20]);
  put_lines("dead.csv", lines);
  const Outcome told = run("doctor dead.csv --robot robot.yaml --out examined");
  EXPECT_EQ(told.code, 1) << told.err;
  EXPECT_THAT(told.out, HasSubstr("fatal: signals.constant"));
  EXPECT_THAT(told.out, HasSubstr("notice: time.duplicates"));
  EXPECT_EQ(files::read_json(path("examined/doctor.json")).at("verdict"), "unusable");
  if (has_validator()) {
    EXPECT_EQ(misfit("doctor.schema.json", "examined/doctor.json"), "");
  }
}

TEST_F(Doctor, NamesMissingColumnsAndBadInput) {
  std::vector<std::string> lines = healthy_lines();
  lines.front() = "t,phi_r,phi_l,omega_r,omega_l,a,b";
  put_lines("nameless.csv", lines);
  const Outcome told = run("doctor nameless.csv --robot robot.yaml");
  EXPECT_EQ(told.code, 1) << told.err;
  EXPECT_THAT(told.out, HasSubstr("The log lacks tau_r, tau_l."));
  EXPECT_EQ(run("doctor absent.csv").code, 2);
  EXPECT_EQ(run("doctor " + shipped() + " --robot absent.yaml").code, 2);
}

}  // namespace
}  // namespace wheelwright::app::doctor_test
