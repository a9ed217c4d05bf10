// SPDX-License-Identifier: Apache-2.0
// What stands where a command is to write: its own earlier result is replaced, nothing else is.
#include <sys/stat.h>

#include <chrono>
#include <thread>

#include "formats/files/temporary.hpp"
#include "tests/app/program.hpp"

namespace wheelwright::app::out_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

// Files of at most 50 kB: some of a result fit, and some do not.
const std::string kFullDisk = "trap '' XFSZ; ulimit -f 100;";

class Out : public testing::ProgramTest {
 protected:
  std::string healthy() const {
    return "'" + (examples() / "healthy.csv.gz").string() + "' --robot robot.yaml --quiet";
  }

  void refuses(const std::string& command, const std::string& file, const std::string& whose) const {
    const std::string before = bytes(path(file));
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.code, 2) << command;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(file + ": is there already"), HasSubstr(whose), HasSubstr("--force")));
    EXPECT_EQ(bytes(path(file)), before) << command;
  }
};

TEST_F(Out, ACommandReplacesItsOwnResultAndNoOther) {
  const std::string doctor = "doctor " + healthy() + " --out out", identify = "identify " + healthy() + " --out out";
  ASSERT_EQ(run(doctor).code, 0);
  const std::string first = bytes(path("out/report.html"));
  EXPECT_EQ(run(doctor).code, 0);
  EXPECT_EQ(bytes(path("out/report.html")), first);

  refuses(identify, "out/report.html", "the page of `wheelwright doctor`");
  EXPECT_THAT(names_in("out"), ElementsAre("doctor.json", "report.html"));
  EXPECT_EQ(run(identify + " --force").code, 0);
  EXPECT_NE(bytes(path("out/report.html")), first);
  refuses(doctor, "out/report.html", "the page of `wheelwright identify`");
}

TEST_F(Out, AFailurePageIsOnesOwn) {
  put("log.csv", "t,omega_r,omega_l\n0,1,1\n1,1,1\n");
  for (int time = 0; time < 2; ++time) {
    const Outcome outcome = run("commission log.csv --robot robot.yaml --out out --quiet");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("is there already")));
  }
}

// The page of a run that failed replaced that of the model beside it.
TEST_F(Out, ARunThatFailsLeavesAnEarlierResultWithItsPage) {
  commission_shipped();
  const std::string model = bytes(path("model/model.json")), page = bytes(path("model/report.html"));
  std::string still = "t,phi_r,phi_l,tau_r,tau_l\n";
  for (int k = 0; k < 2000; ++k) {
    still += fmt::format("{},0,0,0,0\n", 0.01 * k);
  }
  put("still.csv", still);
  put("first.yaml", bytes(path("robot.yaml")) + "filter: {order: 1}\n");  // which needs more than angles
  const std::string fails = "commission still.csv --robot first.yaml --quiet --out ";
  EXPECT_EQ(run(fails + "model").code, 2);
  EXPECT_THAT(names_in("model"), ElementsAre("model.json", "report.html"));
  EXPECT_EQ(bytes(path("model/model.json")), model);
  EXPECT_EQ(bytes(path("model/report.html")), page);
  for (int time = 0; time < 2; ++time) {
    EXPECT_EQ(run(fails + "none").code, 2);
    EXPECT_THAT(names_in("none"), ElementsAre("report.html"));
  }

  // A no is an answer, too: all files are of this run.
  EXPECT_EQ(run("commission still.csv --robot robot.yaml --quiet --out model").code, 1);
  EXPECT_EQ(files::read_json(path("model/model.json")).at("status"), "nothing");
  EXPECT_NE(bytes(path("model/report.html")), page);
}

// The edited file of an earlier run stood beside a result that knew nothing of it.
TEST_F(Out, WhatAnEarlierRunWroteBesideItsResultGoesWithIt) {
  fs::create_directory(path("out"));
  put("out/gap.json",
      "{\n  \"schema\": \"wheelwright/gap/1\", \"simulators\": [{\"file\": \"mine_improved.xml\"}, {\"file\": "
      "\"../robot.yaml\"}, {\"file\": null}]}");
  for (const char* const name : {"mine_improved.xml", "next_manoeuvre.csv", "robot_improved.yaml", "notes.txt"}) {
    put(fmt::format("out/{}", name), "of an earlier run");
  }
  put_lines("log.csv", healthy_lines());
  const Outcome done = run("gap log.csv --robot robot.yaml --no-manoeuvre --no-shrink --quiet --out out");
  ASSERT_EQ(done.code, 0) << done.err;
  const std::vector<std::string> names = names_in("out");
  EXPECT_THAT(names, ::testing::IsSupersetOf({"gap.json", "notes.txt", "report.html", "residuals.csv"}));
  EXPECT_THAT(names, ::testing::Not(::testing::Contains("mine_improved.xml")));
  EXPECT_THAT(names, ::testing::Not(::testing::Contains("next_manoeuvre.csv")));
  EXPECT_TRUE(fs::exists(path("robot.yaml")));
}

// What the system refuses was called a bug of the program.
TEST_F(Out, ANameThatTheSystemRefusesIsBadInput) {
  const Outcome outcome = run("try '" + (examples() / "healthy.csv.gz").string() + "' --out " + std::string(300, 'a'));
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("aaa/robot.yaml: File name too long"), ::testing::Not(HasSubstr("bug"))));
}

// Two runs at once left the page of one beside the result of the other. This one waits in the middle of writing, for a
// reader of its page.
TEST_F(Out, AnotherRunIsRefusedWhileOneWrites) {
  put_lines("log.csv", healthy_lines());
  fs::create_directory(path("out"));
  ASSERT_EQ(mkfifo(path("out/report.html").c_str(), 0600), 0);
  const std::string doctor =
      fmt::format("cd '{}' && timeout 60 '{}' doctor log.csv --robot robot.yaml --quiet --out out", directory_.string(),
                  WHEELWRIGHT_PROGRAM);
  std::thread first([&] { EXPECT_EQ(std::system(doctor.c_str()), 0); });
  const auto locked = [&] { return files::PathLock(path("out"), files::PathLock::Kind::shared).taken(); };
  for (int look = 0; look < 2000 && !locked(); ++look) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  for (const char* const command : {"doctor", "identify"}) {
    const Outcome second = run(fmt::format("{} {} --out ./out/", command, healthy()));
    EXPECT_EQ(second.code, 2);
    EXPECT_THAT(second.err,
                AllOf(HasSubstr("--out ./out/: another run is writing into it"), HasSubstr("another --out")));
  }
  const std::string page = locked() ? bytes(path("out/report.html")) : "nobody writes it";
  first.join();
  EXPECT_THAT(page, HasSubstr("log.csv"));
  EXPECT_THAT(names_in("out"), ElementsAre("doctor.json", "report.html"));
  EXPECT_EQ(files::read_json(path("out/doctor.json")).at("logs").at(0), "log.csv");
  fs::remove(path("out/report.html"));
  EXPECT_EQ(run(fmt::format("doctor {} --out out", healthy())).code, 0) << "the other one has ended";
}

TEST_F(Out, ShardsWriteIntoOneDirectoryAtOnce) {
  fs::create_directories(path("robots"));
  fs::create_directories(path("out"));
  fs::copy_file(examples() / "healthy.csv.gz", path("robots/amy.csv.gz"));
  const std::string fleet = "fleet robots --robot robot.yaml --quiet --out out ";
  {
    const files::PathLock other(path("out"), files::PathLock::Kind::shared);
    EXPECT_EQ(run(fleet + "--shard 1/1").code, 0);
    EXPECT_THAT(run(fleet + "--merge").err, HasSubstr("another run is writing"));
    EXPECT_THAT(run(fleet).err, HasSubstr("another run is writing"));
  }
  EXPECT_LE(run(fleet + "--merge").code, 1);
  const files::PathLock other(path("out"), files::PathLock::Kind::alone);
  EXPECT_THAT(run(fleet + "--shard 1/1").err, HasSubstr("another run is writing"));
}

TEST_F(Out, WhatAUserWroteStays) {
  fs::create_directory(path("out"));
  for (const auto& [file, whose] : {std::pair{"out/doctor.json", "no result of `wheelwright doctor`"},
                                    std::pair{"out/report.html", "not written by `wheelwright doctor`"}}) {
    put(file, "mine");
    refuses("doctor " + healthy() + " --out out", file, whose);
    fs::remove(path(file));
  }
  put("mine.html", "mine");
  fs::create_symlink("../mine.html", path("out/report.html"));
  refuses("doctor " + healthy() + " --out out", "out/report.html", "not written");
  EXPECT_EQ(bytes(path("mine.html")), "mine");
}

TEST_F(Out, WhatAUserChangedStays) {
  const std::string design =
      "design --robot robot.yaml --for bounds --speed 8 --acceleration 20 --duration 4 --stages 1 --rate 50 --quiet "
      "--out plan";
  ASSERT_EQ(run(design).code, 0);
  ASSERT_EQ(run(design).code, 0);
  put("plan/manoeuvre.csv", "t,command_r\n");
  const auto written = fs::last_write_time(path("plan/design.json"));
  fs::last_write_time(path("plan/manoeuvre.csv"), written + std::chrono::minutes(1));
  refuses(design, "plan/manoeuvre.csv", "changed since `wheelwright design` wrote it");
  EXPECT_EQ(run(design + " --force").code, 0);
}

TEST_F(Out, ALogIsNotReplaced) {
  simulate("shipped.yaml", "log.csv");
  const std::string again = "simulate '" + (examples() / "scenarios/shipped.yaml").string() + "' --out log.csv";
  refuses(again, "log.csv", "expected a new name");
  EXPECT_EQ(run(again + " --force --quiet").code, 0);
  ASSERT_EQ(mkfifo(path("pipe.csv").c_str(), 0600), 0);
  EXPECT_EQ(run("simulate '" + (examples() / "scenarios/shipped.yaml").string() + "' --out pipe.csv --quiet",
                "/dev/null", "timeout 60 sh -c 'cat pipe.csv > piped.csv & \"$@\"; wait' sh")
                .code,
            0);
  EXPECT_EQ(bytes(path("piped.csv")), bytes(path("log.csv")));
}

TEST_F(Out, AHeaderAndManualPagesOfOnesOwnAreWrittenAgain) {
  commission_shipped();
  const std::string header = "export model/model.json --language c --out firmware --quiet";
  ASSERT_EQ(run(header).code, 0);
  EXPECT_EQ(run(header).code, 0);
  put("firmware/wheelwright.h", "#pragma once\n");
  refuses(header, "firmware/wheelwright.h", "expected a new name");
  ASSERT_EQ(run("man --out pages").code, 0);
  EXPECT_EQ(run("man --out pages").code, 0);
  put("pages/wheelwright-check.1", "mine");
  refuses("man --out pages", "pages/wheelwright-check.1", "expected a new name");

  // The series is a log, too; and a model's directory is not another command's.
  put("series.csv", "t\n");
  const std::string detect =
      "detect '" + (examples() / "healthy.csv.gz").string() + "' --model model/model.json --quiet";
  refuses(detect + " --series series.csv", "series.csv", "expected a new name");
  refuses(detect + " --out model", "model/report.html", "the page of `wheelwright commission`");
}

// A full disk left residuals.csv without gap.json, and the next run was refused: it was "not written by `gap`".
TEST_F(Out, AFullDiskLeavesAllOfAnEarlierResultOrNothing) {
  put_lines("log.csv", healthy_lines());
  const std::string gap = "gap log.csv --robot robot.yaml --no-manoeuvre --no-shrink --quiet --out out/gap";
  const Outcome first = run(gap, "/dev/null", kFullDisk);
  EXPECT_EQ(first.code, 2) << first.err;
  EXPECT_FALSE(fs::exists(path("out")));
  ASSERT_EQ(run(gap).code, 0);
  const std::vector<std::string> names = names_in("out/gap");
  EXPECT_THAT(names, ::testing::IsSupersetOf({"gap.json", "report.html", "residuals.csv"}));
  std::vector<std::string> before;
  for (const std::string& name : names) {
    before.push_back(bytes(path("out/gap/" + name)));
  }
  EXPECT_EQ(run(gap, "/dev/null", kFullDisk).code, 2);
  EXPECT_EQ(names_in("out/gap"), names);
  for (std::size_t k = 0; k < names.size(); ++k) {
    EXPECT_EQ(bytes(path("out/gap/" + names[k])), before[k]) << names[k];
  }
  EXPECT_EQ(run(gap).code, 0);

  fs::create_directory(path("robots"));
  fs::copy_file(examples() / "healthy.csv.gz", path("robots/amy.csv.gz"));
  const std::string fleet = "fleet robots --robot robot.yaml --quiet --out out/fleet";
  EXPECT_EQ(run(fleet, "/dev/null", kFullDisk).code, 2);
  EXPECT_THAT(names_in("out/fleet"), ElementsAre("results.sqlite"));  // from which it goes on
  EXPECT_LE(run(fleet).code, 1);
  EXPECT_THAT(names_in("out/fleet"), ::testing::IsSupersetOf({"fleet.csv", "fleet.json", "pooled_prior.yaml"}));
}

TEST_F(Out, AFailedRunLeavesNoDirectory) {
  EXPECT_EQ(run("doctor no.csv --robot robot.yaml --out a/b").code, 2);
  EXPECT_FALSE(fs::exists(path("a")));
  // A directory within another one that failed, and the robot file that `try` made for itself: the next `try` took it
  // for the user's.
  put_lines("log.csv", healthy_lines());
  const std::string first_try = "try log.csv --wheel-radius 0.0975 --track-width 0.381 --out a/b";
  const Outcome outcome = run(first_try, "/dev/null", "trap '' XFSZ; ulimit -f 8;");
  EXPECT_EQ(outcome.code, 2) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("a/b/doctor"));
  EXPECT_FALSE(fs::exists(path("a")));
  // Nor its own in place of the robot file of an earlier run.
  const std::string tried = "try log.csv --quiet --out a/b --track-width 0.381 --wheel-radius ";
  ASSERT_LE(run(tried + "0.0975").code, 1);
  const std::string robot = bytes(path("a/b/robot.yaml"));
  EXPECT_EQ(run(tried + "0.05", "/dev/null", "trap '' XFSZ; ulimit -f 8;").code, 2);
  EXPECT_EQ(bytes(path("a/b/robot.yaml")), robot);
  EXPECT_LE(run(tried + "0.05").code, 1);
  EXPECT_NE(bytes(path("a/b/robot.yaml")), robot);
}

TEST_F(Out, WhatIsReadIsNotReplacedByForce) {
  const std::string urdf = "<robot name=\"r\"><link name=\"base\"/><link name=\"left\"/><link name=\"right\"/></robot>";
  put("robot.urdf", urdf);
  for (const char* const option : {"--urdf", "--ros2-control"}) {
    const Outcome outcome = run(fmt::format("robot {} robot.urdf --out-file ./robot.urdf --force", option));
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("robot.urdf: is what is read: expected another name"));
    EXPECT_EQ(bytes(path("robot.urdf")), urdf);
  }
  put_lines("log.csv", healthy_lines());
  const std::string log = bytes(path("log.csv"));
  EXPECT_THAT(run("convert log.csv log.csv --force").err, HasSubstr("log.csv: is what is read"));
  EXPECT_EQ(bytes(path("log.csv")), log);
}

}  // namespace
}  // namespace wheelwright::app::out_test
