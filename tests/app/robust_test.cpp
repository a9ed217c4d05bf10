// SPDX-License-Identifier: Apache-2.0
// Nothing lost, nothing let in: a stream that goes blind says so, places that are no files stay what they are, and what
// is interrupted leaves nothing behind.
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <thread>

#include "formats/files/temporary.hpp"
#include "tests/app/program.hpp"

namespace wheelwright::app::robust_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Robust : public testing::ProgramTest {
 protected:
  /// The shipped log with its rows from `from` on (the header is row 0) changed by `change`, which may drop them.
  void put_changed(std::size_t from, std::size_t to,
                   const std::function<std::string(std::size_t, std::string)>& change) {
    std::vector<std::string> lines;
    const std::vector<std::string> healthy = healthy_lines();
    for (std::size_t k = 0; k < healthy.size(); ++k) {
      lines.push_back(k >= from && k < to ? change(k, healthy[k]) : healthy[k]);
    }
    std::erase(lines, "");
    put_lines("log.csv", lines);
  }
  static std::string with_time(const std::string& line, double t) {
    return fmt::format("{}{}", t, line.substr(line.find(',')));
  }
};

constexpr std::size_t kHalf = 6001, kAll = 20000;

TEST_F(Robust, AStreamThatGoesBlindSaysSinceWhenAndWhy) {
  commission_shipped();
  const std::vector<std::string> healthy = healthy_lines();
  const double half = std::stod(healthy[kHalf]);
  struct Case {
    std::string name, reason;
    std::function<std::string(std::size_t, std::string)> change;
  };
  const std::vector<Case> cases = {
      {"all values", "NaN or infinite",
       [](std::size_t, const std::string& line) {
         return line.substr(0, line.find(',')) + ",nan,nan,nan,nan,nan,nan";
       }},
      {"one sensor", "column tau_l",
       [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; }},
      {"a clock that stands", "the same time stamp",
       [&](std::size_t, const std::string& line) { return with_time(line, half); }},
      {"a clock that hardly goes on", "less than a hundredth",
       [&](std::size_t k, const std::string&) {
         return with_time(healthy[kHalf], half + 1e-9 * static_cast<double>(k - kHalf));
       }},
      {"a clock that runs backwards", "time goes backwards",
       [&](std::size_t k, const std::string& line) {
         return with_time(line, half - 0.01 * static_cast<double>(k - kHalf));
       }},
      {"rows swapped", "time goes backwards",
       [&](std::size_t k, const std::string&) {
         return healthy[std::min(kHalf + ((k - kHalf) ^ 1U), healthy.size() - 1)];
       }},
      {"every sixth row", "gaps longer than",
       [](std::size_t k, const std::string& line) { return k % 6 == 0 ? line : ""; }},
      {"text", "could not be read", [](std::size_t, const std::string&) { return std::string("E: sensor lost"); }},
  };
  for (const Case& each : cases) {
    put_changed(kHalf, kAll, each.change);
    const Outcome text = run("detect --follow --model model/model.json", "log.csv");
    EXPECT_EQ(text.code, 2) << each.name;
    EXPECT_THAT(text.out, AllOf(AnyOf(HasSubstr("blind since t = 59.99"), HasSubstr("blind since t = 60.0")),
                                HasSubstr(each.reason)))
        << each.name;
    EXPECT_THAT(text.err, HasSubstr("standard input ended blind since t = ")) << each.name;
    EXPECT_LE(testing::lines_of(text.err).size(), 12U) << each.name << ": thousands of rows are not told one by one";
    const Outcome json = run("detect --follow --model model/model.json --json", "log.csv");
    const std::vector<std::string> told = testing::lines_of(json.out);
    ASSERT_EQ(told.size(), 1u) << each.name << json.out;
    const Json blind = Json::parse(told.front()).at("blind");
    EXPECT_NEAR(blind.at("since").get<double>(), half, 0.05) << each.name;
    EXPECT_TRUE(blind.at("until").is_null());
    EXPECT_THAT(blind.at("reason").get<std::string>(), HasSubstr(each.reason)) << each.name;
  }
}

// A robot at rest, whose seconds are read as thousandths of them: "no fault in 0.0 s".
TEST_F(Robust, ALogByAClockThatHardlyGoesOnIsNotDecided) {
  commission_shipped();
  const std::vector<std::string> healthy = healthy_lines();
  put_changed(1, kAll,
              [&](std::size_t k, const std::string&) { return with_time(healthy[1], 1e-5 * static_cast<double>(k)); });
  const Outcome outcome = run("detect log.csv --model model/model.json --out watch");
  EXPECT_EQ(outcome.code, 2) << outcome.out;
  EXPECT_THAT(outcome.err, HasSubstr("a clock that hardly goes on"));
  EXPECT_THAT(
      bytes(path("watch/report.html")),
      AllOf(HasSubstr("Not decided"), HasSubstr("a clock that hardly goes on"), Not(HasSubstr("No fault was seen"))));
}

TEST_F(Robust, AStreamThatSeesAgainSaysSoAndIsAnswered) {
  commission_shipped();
  put_changed(4000, 5000,
              [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; });
  const Outcome json = run("detect --follow --model model/model.json --json", "log.csv");
  EXPECT_EQ(json.code, 0) << json.err;
  const std::vector<std::string> told = testing::lines_of(json.out);
  ASSERT_EQ(told.size(), 2u) << json.out;
  const Json noticed = Json::parse(told[0]).at("blind"), over = Json::parse(told[1]).at("blind");
  EXPECT_EQ(noticed.at("since"), over.at("since"));
  EXPECT_GE(over.at("until").get<double>(), 49.99);
  EXPECT_GE(over.at("rows").get<int>(), 1000);
  EXPECT_THAT(over.at("reason").get<std::string>(), HasSubstr("column tau_l"));
}

TEST_F(Robust, AShortLossOfASensorIsNoBlindness) {
  commission_shipped();
  put_changed(4000, 4050,
              [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; });
  const Outcome text = run("detect --follow --model model/model.json", "log.csv");
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, IsEmpty());
}

TEST_F(Robust, AStreamOfWhichNoRowsComeSaysSoAndSaysWhenTheyComeAgain) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  // 2000 rows, then nothing while the pipe is open, then the rest, which the clock of the robot did not wait for.
  const std::string sender = "(head -n 2001 log.csv; sleep 6; tail -n +2002 log.csv) |";
  const Outcome json = run("detect --follow --model model/model.json --json", "/dev/stdin", sender);
  EXPECT_EQ(json.code, 0) << json.err;
  const std::vector<std::string> told = testing::lines_of(json.out);
  ASSERT_EQ(told.size(), 2u) << json.out;
  const Json noticed = Json::parse(told[0]).at("silent"), over = Json::parse(told[1]).at("silent");
  EXPECT_NEAR(noticed.at("since").get<double>(), std::stod(healthy_lines()[2000]), 1e-9);
  EXPECT_TRUE(noticed.at("until").is_null());
  EXPECT_NEAR(noticed.at("seconds").get<double>(), 5.0, 0.9);
  EXPECT_EQ(noticed.at("since"), over.at("since"));
  EXPECT_NEAR(over.at("until").get<double>(), std::stod(healthy_lines()[2001]), 1e-9);
  EXPECT_GE(over.at("seconds").get<double>(), noticed.at("seconds").get<double>());  // less than 6 where it began late
}

TEST_F(Robust, ALogOfWhichMostCannotBeDecidedIsNotHealthy) {
  commission_shipped();
  put_changed(2000, kAll,
              [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; });
  const Outcome text = run("detect log.csv --model model/model.json --out found");
  EXPECT_EQ(text.code, 2);
  EXPECT_THAT(text.err, AllOf(HasSubstr("of 12001 rows could be decided on"), HasSubstr("column tau_l")));
  EXPECT_THAT(files::read_json(path("found/detection.json")).at("undecided").get<std::string>(),
              HasSubstr("column tau_l"));
}

TEST_F(Robust, AStreamSaysThatItIsWatchedAndKeepsItsEvents) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  const std::string follow = "detect --follow --model model/model.json --heartbeat 30 --out watch";
  const Outcome text = run(follow, "log.csv");
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out,
              AllOf(HasSubstr("watching at 30 s: 3001 rows, "), HasSubstr("watching at 120 s: 12001 rows, ")));
  EXPECT_EQ(testing::lines_of(text.out).size(), 4U);
  const Outcome json = run(follow + " --json", "log.csv");
  EXPECT_EQ(json.code, 0) << json.err;
  // Both runs, each behind a line that says what it is.
  const std::vector<std::string> kept = testing::lines_of(bytes(path("watch/events.jsonl")));
  ASSERT_EQ(kept.size(), 10U);
  for (const std::size_t first : {std::size_t{0}, std::size_t{5}}) {
    EXPECT_EQ(Json::parse(kept[first]).at("schema"), "wheelwright/events/1");
    EXPECT_EQ(Json::parse(kept[first + 1]).at("watching").at("t"), 30.0);
    EXPECT_FALSE(Json::parse(kept[first + 4]).at("watching").at("blind").get<bool>());
  }
  EXPECT_EQ(json.out, kept[6] + "\n" + kept[7] + "\n" + kept[8] + "\n" + kept[9] + "\n");

  put("watch/events.jsonl", "mine\n");
  EXPECT_EQ(run(follow, "log.csv").code, 2) << "a file of somebody else's";
  EXPECT_EQ(bytes(path("watch/events.jsonl")), "mine\n");
  EXPECT_EQ(run(follow + " --force", "log.csv").code, 0);
  EXPECT_EQ(testing::lines_of(bytes(path("watch/events.jsonl"))).size(), 5U);
  EXPECT_EQ(run("detect log.csv --model model/model.json --heartbeat 30").code, 2);
  EXPECT_EQ(run("detect --follow --model model/model.json --out /dev/full/x", "log.csv").code, 2);
}

TEST_F(Robust, ALineWithoutEndEndsTheStreamBeforeItFillsTheMemory) {
  commission_shipped();
  put("log.csv", healthy_lines().front() + "\n" + std::string(std::size_t{1} << 20, '1'));
  const Outcome text = run("detect --follow --model model/model.json", "log.csv");
  EXPECT_EQ(text.code, 2);
  EXPECT_THAT(text.err, HasSubstr("standard input:2: a line of more than 262144 bytes"));
}

TEST_F(Robust, APipeIsNoLogAndIsNotWaitedFor) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  const Outcome outcome = run("doctor pipe --robot robot.yaml", "/dev/null", "timeout 60");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("pipe: is a pipe or a device"), HasSubstr("--follow")));
}

TEST_F(Robust, OutputGoesIntoPipesAndThroughLinks) {
  const std::string scenario = "'" + (examples() / "scenarios" / "shipped.yaml").string() + "'";
  simulate("shipped.yaml", "plain.csv");
  const Outcome piped = run("simulate " + scenario + " --out /dev/stdout --quiet");
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(piped.out, bytes(path("plain.csv")));
  EXPECT_TRUE(fs::is_symlink("/dev/stdout"));

  put("real.csv", "old");
  fs::create_symlink("real.csv", path("link.csv"));
  EXPECT_EQ(run("simulate " + scenario + " --out link.csv").code, 2);
  EXPECT_EQ(bytes(path("real.csv")), "old");
  EXPECT_EQ(run("simulate " + scenario + " --out link.csv --force").code, 0);
  EXPECT_TRUE(fs::is_symlink(path("link.csv")));
  EXPECT_EQ(bytes(path("real.csv")), bytes(path("plain.csv")));
}

TEST_F(Robust, ALinkThatLeadsToNothingIsRefusedBeforeTheWork) {
  simulate("shipped.yaml", "plain.csv");
  fs::create_directory(path("found"));
  for (const char* name : {"model.json", "report.html"}) {
    fs::create_symlink(path("elsewhere"), path("found") / name);
    const Outcome outcome =
        run("commission plain.csv --robot '" + (examples() / "robot.yaml").string() + "' --out found");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("which is not there"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(path("elsewhere")));
    EXPECT_EQ(std::distance(fs::directory_iterator(path("found")), fs::directory_iterator()), 1);
    fs::remove(path("found") / name);
  }
}

TEST_F(Robust, WhatIsReadIsNotReplaced) {
  fs::copy_file(examples() / "scenarios" / "shipped.yaml", path("drive.yaml"));
  fs::create_hard_link(path("drive.yaml"), path("same.csv"));
  const Outcome outcome = run("simulate drive.yaml --out same.csv");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("same.csv: is what is read: expected another name"));
}

TEST_F(Robust, AnInterruptedSimulationLeavesNothing) {
  put("long.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: straight, speed: 0.6, period: 6}\nduration: 900000\n");
  for (const auto& [signal, code] : {std::pair{"TERM", 143}, std::pair{"INT", 130}}) {
    fs::create_directory(path("out"));
    const Outcome outcome = run("simulate long.yaml --out out/long.csv", "/dev/null",
                                fmt::format("timeout --foreground -s {} --preserve-status 2", signal));
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_THAT(names_in("out"), IsEmpty());
    fs::remove_all(path("out"));
  }
}

TEST_F(Robust, AFleetWithLinksToItselfIsRead) {
  fs::create_directories(path("fleet/amy"));
  fs::copy_file(examples() / "healthy.csv.gz", path("fleet/amy/monday.csv.gz"));
  fs::create_directory_symlink(path("fleet"), path("fleet/amy/fleet"));
  fs::create_symlink("loop.csv", path("fleet/loop.csv"));
  const Outcome outcome = run("fleet fleet --robot robot.yaml --json --quiet");
  EXPECT_LE(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("amy"));
}

TEST_F(Robust, AFleetListWithAControlCharacterIsRefused) {
  for (const std::string& row : {std::string("amy,mon\0day.csv\n", 16), std::string("a\0my,monday.csv\n", 16),
                                 std::string("a\xC2\x9B"
                                             "31my,monday.csv\n")}) {
    put("fleet.csv", "robot,log\n" + row);
    const Outcome outcome = run("fleet fleet.csv --robot robot.yaml");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("fleet.csv:2: a control character"));
  }
}

TEST_F(Robust, AModelWithImpossibleNumbersIsNeitherUsedNorProved) {
  commission_shipped();
  const Json model = files::read_json(path("model/model.json"));
  const std::string log = "'" + (examples() / "healthy.csv.gz").string() + "'";
  const std::vector<std::pair<std::string, Json>> cases = {{"/detector/error_bounds/output/0", -0.1},
                                                           {"/filter/order", (std::uint64_t{1} << 32) + 2},
                                                           {"/at_risk/errors/effort/correlation", 1e12}};
  for (const auto& [pointer, value] : cases) {
    Json changed = model;
    changed.at(Json::json_pointer(pointer)) = value;
    put("changed.json", changed.dump());
    for (const std::string& command : {"detect " + log + " --model changed.json", "check changed.json " + log}) {
      const Outcome outcome = run(command);
      EXPECT_EQ(outcome.code, 2) << command;
      EXPECT_THAT(outcome.err, HasSubstr("changed.json: " + pointer.substr(0, 12))) << command;
    }
  }
}

// A part of the memory was as large as the jump: 2.3 GB for 1.7e9 s, not enough of it for 1e10.
TEST_F(Robust, AClockThatJumpsByDecadesIsDiagnosed) {
#ifdef __SANITIZE_ADDRESS__
  const std::string little_memory;  // the sanitizer reserves terabytes of addresses
#else
  const std::string little_memory = "ulimit -v 1000000;";
#endif
  for (const double jump : {1.7e9, 1e10}) {
    std::vector<std::string> lines = healthy_lines();
    for (std::size_t k = 4000; k < lines.size(); ++k) {
      lines[k] = fmt::format("{:.2f}{}", jump + 0.01 * static_cast<double>(k), lines[k].substr(lines[k].find(',')));
    }
    put_lines("log.csv", lines);
    const Outcome outcome = run("gap log.csv --robot robot.yaml --no-manoeuvre --no-shrink --json --quiet --threads 2",
                                "/dev/null", little_memory);
    EXPECT_LE(outcome.code, 1) << outcome.err;
    EXPECT_THAT(Json::parse(outcome.out).at("schema"), "wheelwright/gap/1");
  }
}

#ifndef __SANITIZE_ADDRESS__
// Threads without an arena of their own called the system for every allocation, and a command of a second took minutes.
TEST_F(Robust, WithLittleMemoryACommandEnds) {
  put_lines("log.csv", healthy_lines());
  bool done = false;
  for (const int kilobytes : {60000, 90000, 120000, 150000, 200000, 300000}) {
    const Outcome outcome = run("commission log.csv --robot robot.yaml --quiet --out " + std::to_string(kilobytes),
                                "/dev/null", fmt::format("ulimit -t 20; ulimit -v {};", kilobytes));
    EXPECT_THAT(outcome.code, AnyOf(0, 2, 3, 127)) << kilobytes << ": " << outcome.err;
    done = done || outcome.code == 0;
  }
  EXPECT_TRUE(done);
}
#endif

// Half a log without a sensor was "no fault", and nothing said that half of it was not seen.
TEST_F(Robust, WhatWasNotDecidedOnIsTold) {
  commission_shipped();
  put_changed(kHalf, kAll,
              [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; });
  const Outcome half = run("detect log.csv --model model/model.json --out found");
  EXPECT_THAT(half.out, HasSubstr("not watched: 50 % of the 12001 rows could not be decided on")) << half.err;
  const Json found = files::read_json(path("found/detection.json"));
  EXPECT_NEAR(found.at("undecided_share").get<double>(), 0.5, 0.001);
  if (has_validator()) {
    EXPECT_EQ(misfit("detection.schema.json", "found/detection.json"), "");
  }
  put_lines("log.csv", healthy_lines());
  ASSERT_EQ(run("detect log.csv --model model/model.json --out found").code, 0);
  EXPECT_FALSE(files::read_json(path("found/detection.json")).contains("undecided_share"));

  // A stream that sees again at its end and was blind for most of it is not healthy.
  put_changed(1000, 11800,
              [](std::size_t, const std::string& line) { return line.substr(0, line.rfind(',')) + ",nan"; });
  const Outcome stream = run("detect --follow --model model/model.json", "log.csv");
  EXPECT_EQ(stream.code, 2);
  EXPECT_THAT(stream.err, AllOf(HasSubstr("of 12001 rows could be decided on"), HasSubstr("standard input: only ")));
}

// With standard output closed the file of events had its number, and what was printed went into it.
TEST_F(Robust, AClosedStreamIsNoFileOfTheRun) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  const std::string follow = "detect --follow --model model/model.json --heartbeat 60 --out ";
  ASSERT_EQ(run(follow + "whole", "log.csv").code, 0);
  const std::vector<std::string> expected = testing::lines_of(bytes(path("whole/events.jsonl")));
  const auto closed = [&](const std::string& stream, const std::string& out) {
    return run(follow + out, "log.csv", "sh -c 'exec \"$@\" " + stream + "' sh").code;
  };
  EXPECT_EQ(closed(">&-", "one"), 2);
  const std::vector<std::string> kept = testing::lines_of(bytes(path("one/events.jsonl")));
  ASSERT_FALSE(kept.empty());
  EXPECT_TRUE(std::equal(kept.begin(), kept.end(), expected.begin())) << bytes(path("one/events.jsonl"));
  EXPECT_EQ(closed("2>&-", "two"), 0);
  EXPECT_EQ(testing::lines_of(bytes(path("two/events.jsonl"))), expected);
  EXPECT_EQ(closed("<&-", "none"), 2);
  EXPECT_EQ(closed("<&- >&- 2>&-", "nothing"), 2);
}

// It watched on to the end of the stream with nobody told of anything.
TEST_F(Robust, AStreamThatNobodyIsToldOfEnds) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  const Outcome outcome = run("detect --follow --model model/model.json --heartbeat 10 --out watch", "log.csv",
                              "sh -c 'exec \"$@\" > /dev/full' sh");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("standard output: cannot be written (No space left on device)"));
  // The header, and the one line that could not be told.
  EXPECT_EQ(testing::lines_of(bytes(path("watch/events.jsonl"))).size(), 2U);
}

// A full disk left half a line, and the next run wrote its header behind it.
TEST_F(Robust, TheFileOfEventsHoldsWholeLines) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  const std::string follow = "detect --follow --model model/model.json --heartbeat 1 --out watch";
  const Outcome full = run(follow, "log.csv", "trap '' XFSZ; ulimit -f 4;");
  EXPECT_EQ(full.code, 2);
  EXPECT_THAT(full.err, HasSubstr("watch/events.jsonl: cannot be written (File too large)"));
  EXPECT_TRUE(bytes(path("watch/events.jsonl")).ends_with("}\n"));
  const std::size_t before = testing::lines_of(bytes(path("watch/events.jsonl"))).size();
  // A run that was killed.
  std::ofstream(path("watch/events.jsonl"), std::ios::app) << R"({"watching":{"t":)";
  EXPECT_EQ(run(follow, "log.csv").code, 0);
  const std::vector<std::string> lines = testing::lines_of(bytes(path("watch/events.jsonl")));
  EXPECT_GT(lines.size(), before + 100);
  for (const std::string& line : lines) {
    EXPECT_FALSE(Json::parse(line, nullptr, false).is_discarded()) << line;
  }
  put("watch/events.jsonl", R"({"schema":"wheelwright/events/1","soft)");
  EXPECT_EQ(run(follow, "log.csv").code, 0);
  EXPECT_EQ(Json::parse(testing::lines_of(bytes(path("watch/events.jsonl"))).front()).at("robot"), "example");
}

// Two at once cut each other's lines, and --force took the file from under the first.
TEST_F(Robust, AFileOfEventsHasOneWriter) {
  commission_shipped();
  put_lines("log.csv", healthy_lines());
  const std::string follow = "detect --follow --model model/model.json --heartbeat 30 --out watch";
  EXPECT_EQ(run(follow, "log.csv").code, 0);
  const std::string kept = bytes(path("watch/events.jsonl"));
  {
    const files::PathLock other(path("watch/events.jsonl"), files::PathLock::Kind::alone);
    for (const char* const more : {"", " --force"}) {
      const Outcome second = run(follow + more, "log.csv");
      EXPECT_EQ(second.code, 2);
      EXPECT_THAT(second.err,
                  AllOf(HasSubstr("watch/events.jsonl: another run is writing"), HasSubstr("another --out")));
      EXPECT_EQ(bytes(path("watch/events.jsonl")), kept);
    }
  }
  EXPECT_EQ(run(follow + " --force", "log.csv").code, 0);
  EXPECT_EQ(bytes(path("watch/events.jsonl")), kept);
  EXPECT_EQ(run(follow, "log.csv").code, 0);
  EXPECT_EQ(bytes(path("watch/events.jsonl")), kept + kept);

  std::filesystem::remove(path("watch/events.jsonl"));
  std::filesystem::create_directories(path("watch/events.jsonl/mine"));
  const Outcome none = run(follow + " --force", "log.csv");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("watch/events.jsonl: cannot be written (Is a directory)"));
}

}  // namespace
}  // namespace wheelwright::app::robust_test
