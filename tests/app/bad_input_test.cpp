// SPDX-License-Identifier: Apache-2.0
// Every kind of bad input ends in exit code 2 and a message with file, line or key, value and expectation; what can be
// repaired is repaired, counted and told.
#include <functional>

#include "tests/app/program.hpp"

namespace wheelwright::app::bad_input_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;

class BadInput : public testing::ProgramTest {
 protected:
  /// Runs `commission LOG`, which must be refused without a word on standard output and without a model.
  std::string refused(const std::string& log, const std::string& more = "--robot robot.yaml") const {
    return refused_command("commission " + log + " " + more + " --out result");
  }

  std::string refused_command(const std::string& arguments) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << "\n" << outcome.err;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(path("result/model.json")));
    return outcome.err;
  }

  /// The first rows of the shipped log as `log.csv`, with line `number` (from 1, the header) rewritten.
  void put_log(std::size_t number, const std::function<std::string(const std::string&)>& change,
               std::size_t rows = 3000) const {
    std::vector<std::string> lines = healthy_lines();
    lines.resize(rows + 1);
    lines.at(number - 1) = change(lines.at(number - 1));
    put_lines("log.csv", lines);
  }

  /// `line` with field `index` (from 0; −1 is the last) put as `value`.
  static std::string with_field(const std::string& line, int index, const std::string& value) {
    std::vector<std::string> fields;
    std::istringstream in(line);
    for (std::string field; std::getline(in, field, ',');) {
      fields.push_back(field);
    }
    fields.at(index < 0 ? fields.size() - 1 : static_cast<std::size_t>(index)) = value;
    std::string out;
    for (const std::string& field : fields) {
      out += (out.empty() ? "" : ",") + field;
    }
    return out;
  }

  /// robot.yaml with the line that begins with `key` replaced.
  void put_robot(const std::string& key, const std::string& replacement) const {
    std::string text;
    for (const std::string& line : testing::lines_of(bytes(path("robot.yaml")))) {
      text += (line.starts_with(key) ? replacement : line) + "\n";
    }
    put("changed.yaml", text);
  }
};

TEST_F(BadInput, LogThatIsMissing) { EXPECT_THAT(refused("no.csv"), HasSubstr("no.csv: no such file")); }

TEST_F(BadInput, LogThatIsADirectory) {
  std::filesystem::create_directory(path("folder"));
  EXPECT_THAT(refused("folder"), HasSubstr("folder: is a directory: expected a file"));
}

TEST_F(BadInput, LogThatIsEmpty) {
  put("log.csv", "");
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv: is empty: expected text"));
}

TEST_F(BadInput, LogThatIsBinary) {
  put("log.csv", std::string("\x7f"
                             "ELF\x02\x01\x01\0\0\0\0",
                             11));
  EXPECT_THAT(refused("log.csv"), AllOf(HasSubstr("log.csv"), HasSubstr("expected text")));
  put("log.csv", std::string("t,a\0b\n1,2\n", 10));
  EXPECT_THAT(refused("log.csv"), AllOf(HasSubstr("log.csv"), HasSubstr("expected")));
}

TEST_F(BadInput, PackedLogThatIsCutOff) {
  put("log.csv.gz", bytes(examples() / "healthy.csv.gz").substr(0, 20000));
  EXPECT_THAT(refused("log.csv.gz"), HasSubstr("log.csv.gz: gzip stream ends early: expected a complete file"));
}

TEST_F(BadInput, TextInANumber) {
  put_log(500, [](const std::string& line) { return with_field(line, -1, "1.2abc"); });
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv:500: column 'tau_l': '1.2abc': expected a number"));
}

TEST_F(BadInput, WrongFieldCount) {
  put_log(500, [](const std::string& line) { return line + ",1"; });
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv:500: 8 fields: expected 7, as the header has"));
  put_log(500, [](const std::string& line) { return line.substr(0, line.rfind(',')); });
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv:500: 6 fields: expected 7, as the header has"));
}

TEST_F(BadInput, WheelThatTurnsTooFast) {
  put_log(500, [](const std::string& line) { return with_field(line, 3, "10001"); });
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv:500: column 'omega_r': '10001': expected speed of the right wheel "
                                            "in rad/s, of magnitude at most 10000"));
}

TEST_F(BadInput, TooFewSamples) {
  put_log(
      1, [](const std::string& line) { return line; }, 11);
  EXPECT_THAT(refused("log.csv"), HasSubstr("log.csv: 11 usable rows of 11: expected at least 20"));
}

TEST_F(BadInput, MissingEffortColumn) {
  put_log(1, [](const std::string& line) { return with_field(line, 5, "tau_rr"); });
  EXPECT_THAT(refused("log.csv"), AllOf(HasSubstr("log.csv: no column for tau_r (torque at the right wheel, N·m)"),
                                        HasSubstr("did you mean 'tau_rr'? Then add --map tau_r=tau_rr")));
}

TEST_F(BadInput, MissingMotionColumn) {
  put_log(1, [](const std::string&) { return std::string("t,a,b,omega_rr,d,tau_r,tau_l"); });
  EXPECT_THAT(refused("log.csv"), AllOf(HasSubstr("log.csv: no column for omega_r"), HasSubstr("or phi_r"),
                                        HasSubstr("did you mean 'omega_rr'?")));
}

TEST_F(BadInput, OneWheelInAnglesTheOtherInSpeeds) {
  put_log(1, [](const std::string&) { return std::string("t,phi_r,b,c,omega_l,tau_r,tau_l"); });
  EXPECT_THAT(refused("log.csv"), HasSubstr("expected the motion of every joint"));
}

TEST_F(BadInput, NaNAndInfinityAreDroppedAndCounted) {
  for (const std::string value : {"nan", "-inf"}) {
    put_log(500, [&](const std::string& line) { return with_field(line, -1, value); });
    const Outcome outcome = run("commission log.csv --robot robot.yaml --out result");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out,
                HasSubstr("1 row dropped: a value that is needed is NaN or infinite (first at log.csv:500, "
                          "column tau_l)"));
    const Json model = files::read_json(path("result/model.json"));
    EXPECT_EQ(model.at("data").at("rows"), 2999);
    EXPECT_THAT(model.at("data").at("repairs").dump(), HasSubstr("1 row dropped"));
    EXPECT_THAT(bytes(path("result/report.html")), HasSubstr("1 row dropped"));
  }
}

TEST_F(BadInput, TimeThatGoesBackwardsIsCounted) {
  put_log(500, [](const std::string& line) { return with_field(line, 0, "1.005"); });
  const Outcome outcome = run("commission log.csv --robot robot.yaml --out result");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("1 new segment where time goes backwards (first at log.csv:500)"));
  EXPECT_EQ(files::read_json(path("result/model.json")).at("data").at("segments"), 3);  // back, and forth again
}

TEST_F(BadInput, TimeThatIsRepeatedIsCounted) {
  const std::string before = healthy_lines().at(498);
  put_log(500, [&](const std::string& line) { return with_field(line, 0, before.substr(0, before.find(','))); });
  const Outcome outcome = run("commission log.csv --robot robot.yaml --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json data = Json::parse(outcome.out).at("data");
  EXPECT_EQ(data.at("rows"), 2999);
  EXPECT_THAT(data.at("repairs").dump(), HasSubstr("log.csv:500"));
}

TEST_F(BadInput, LastLineThatIsCutOffIsCounted) {
  put_log(1, [](const std::string& line) { return line; });
  const std::string text = bytes(path("log.csv"));
  put("log.csv", text.substr(0, text.rfind(',')));
  const Outcome outcome = run("commission log.csv --robot robot.yaml --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json data = Json::parse(outcome.out).at("data");
  EXPECT_EQ(data.at("rows"), 2999);
  EXPECT_THAT(data.at("repairs").dump(), HasSubstr("log.csv:3001"));
}

TEST_F(BadInput, RobotFile) {
  put_log(1, [](const std::string& line) { return line; });
  const auto message = [&](const std::string& key, const std::string& replacement) {
    put_robot(key, replacement);
    return refused("log.csv", "--robot changed.yaml");
  };
  EXPECT_THAT(refused("log.csv", "--robot no.yaml"), HasSubstr("no.yaml: no such file"));
  EXPECT_THAT(message("track_width", "tack_width: 0.381"),
              AllOf(HasSubstr("changed.yaml:6: unknown key 'tack_width'"), HasSubstr("did you mean 'track_width'?")));
  EXPECT_THAT(message("wheel_radius", "wheel_radius: big"),
              HasSubstr("changed.yaml:5: wheel_radius: 'big': expected metres, > 0"));
  EXPECT_THAT(message("wheel_radius", "wheel_radius: -0.1"),
              HasSubstr("changed.yaml:5: wheel_radius: '-0.1': expected metres, > 0"));
  EXPECT_THAT(message("wheel_radius", "wheel_radius: .nan"), HasSubstr("changed.yaml:5: wheel_radius: '.nan'"));
  EXPECT_THAT(message("wheel_radius", ""), HasSubstr("no key wheel_radius: expected it (m)"));
  EXPECT_THAT(message("model", "model: hovercraft"), HasSubstr("changed.yaml:4: model: 'hovercraft'"));
  EXPECT_THAT(message("nominal", "prior: {mass: [60, 5]}"), HasSubstr("changed.yaml:8: prior.mass"));
}

TEST_F(BadInput, OrderOneOnAnglesAlone) {
  put_log(1, [](const std::string&) { return std::string("t,phi_r,phi_l,c,d,tau_r,tau_l"); });
  put_robot("nominal", "filter: {order: 1}");
  EXPECT_THAT(refused("log.csv", "--robot changed.yaml"),
              AllOf(HasSubstr("order is 1"), HasSubstr("the log has angles only (phi_r, phi_l)"),
                    HasSubstr("expected order 2, or a log with omega_r, omega_l")));
  // The log was read, so that people can look at it.
  EXPECT_THAT(names_in("result"), ElementsAre("report.html"));
  EXPECT_THAT(bytes(path("result/report.html")), AllOf(HasSubstr("angles only"), HasSubstr("phi_r")));
}

TEST_F(BadInput, ModelFile) {
  put_log(1, [](const std::string& line) { return line; });
  const auto message = [&](const std::string& content) {
    put("model.json", content);
    return refused_command("detect log.csv --model model.json");
  };
  EXPECT_THAT(refused_command("detect log.csv --model no.json"), HasSubstr("no.json: no such file"));
  EXPECT_THAT(message("{not json"), AllOf(HasSubstr("model.json:1:"), HasSubstr("expected JSON")));
  for (const char* other : {"not json", "[]", "name: robot\n"}) {
    EXPECT_THAT(message(other),
                HasSubstr("model.json: is no model.json: expected the file that `wheelwright commission`"));
  }
  for (const char* const mark : {"", "\xEF\xBB\xBF"}) {
    EXPECT_THAT(message(mark + std::string(R"( {"schema": "wheelwright/model/1", "message": "says nothing"})")),
                HasSubstr("model.json: holds no model: says nothing"));
  }
  EXPECT_THAT(message(std::string("{\"schema\": \"wheelwright/model/1\"}\n\0 {}", 38)),
              HasSubstr("model.json: binary data: expected JSON"));
  EXPECT_THAT(message(R"({"schema": "wheelwright/gap/1"})"), HasSubstr("\"schema\": \"wheelwright/model/1\""));
  EXPECT_THAT(message(R"({"schema": "wheelwright/model/1", "message": "says nothing"})"),
              HasSubstr("model.json: holds no model: says nothing"));
}

TEST_F(BadInput, DetectNeedsTheColumnsOfTheModel) {
  commission_shipped();
  put_log(1, [](const std::string& line) { return with_field(line, 5, "tau_rr"); });
  EXPECT_THAT(refused_command("detect log.csv --model model/model.json"),
              AllOf(HasSubstr("log.csv: no column for tau_r"), HasSubstr("did you mean 'tau_rr'?")));
}

TEST_F(BadInput, Options) {
  put_log(1, [](const std::string& line) { return line; });
  const auto message = [&](const std::string& more) { return refused("log.csv", "--robot robot.yaml " + more); };
  EXPECT_THAT(message("--map omega_r"), HasSubstr("--map 'omega_r': expected NAME=COLUMN"));
  EXPECT_THAT(message("--map =omega_r"), HasSubstr("--map '=omega_r': expected NAME=COLUMN"));
  EXPECT_THAT(message("--map omega_r=no"), AllOf(HasSubstr("no column 'no'"), HasSubstr("expected one of t, phi_r")));
  EXPECT_THAT(message("--map omega_q=phi_r"),
              AllOf(HasSubstr("'omega_q' is no column of a log"), HasSubstr("did you mean 'omega_")));
  for (const std::string rule : {"5/3", "0/3", "3", "3/", "/5", "3/5x", "abc", "1/65", "-1/5"}) {
    EXPECT_THAT(message("--persistence " + rule), HasSubstr("expected K/N with 1 <= K <= N <= 64")) << rule;
  }
  EXPECT_THAT(message("--persistence ''"), HasSubstr("--persistence: is empty: expected a value"));
  EXPECT_THAT(message("--threads 0"), HasSubstr("--threads"));
  EXPECT_THAT(message("--seed x"), HasSubstr("--seed"));
  EXPECT_THAT(message("--no-such-option"), HasSubstr("--no-such-option"));
}

TEST_F(BadInput, ResultDirectoryThatCannotBe) {
  put_log(1, [](const std::string& line) { return line; });
  for (const std::string place : {"log.csv", "log.csv/result", "/dev/null/result"}) {
    const Outcome outcome = run("commission log.csv --robot robot.yaml --out " + place);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err,
                AllOf(HasSubstr("--out " + place + ": cannot make this directory"), HasSubstr("expected")));
  }
  EXPECT_THAT(run("simulate '" + (examples() / "scenarios/fault.yaml").string() + "' --out /dev/null/log.csv").err,
              HasSubstr("/dev/null/log.csv: cannot be written"));
}

TEST_F(BadInput, NothingHalfWrittenStaysWhenTheDiskIsFull) {
  put_log(1, [](const std::string& line) { return line; });
  std::filesystem::create_directory(path("result"));
  put("result/model.json", "the result of yesterday\n");
  // The shell's limit on the size of a file stands for the full disk; with SIGXFSZ ignored a write beyond it fails.
  const Outcome outcome =
      run("commission log.csv --robot robot.yaml --out result --force", "/dev/null", "trap '' XFSZ; ulimit -f 16;");
  EXPECT_EQ(outcome.code, 2) << outcome.out;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("result/"), HasSubstr("expected enough room on the disk")));
  EXPECT_THAT(names_in("result"), ElementsAre("model.json"));
  EXPECT_EQ(bytes(path("result/model.json")), "the result of yesterday\n");
}

TEST_F(BadInput, NothingUnderTheFinalNameWhenKilledWhileWriting) {
  const Outcome outcome = run("simulate '" + (examples() / "scenarios/fault.yaml").string() + "' --out log.csv",
                              "/dev/null", "ulimit -f 16; ulimit -c 0;");
  EXPECT_NE(outcome.code, 0);
  EXPECT_FALSE(std::filesystem::exists(path("log.csv")));
}

TEST_F(BadInput, ScenarioFile) {
  EXPECT_THAT(refused_command("simulate no.yaml --out z.csv"), HasSubstr("no.yaml: no such file"));
  put("s.yaml",
      "robot: robot.yaml\nparameters: {mass: 21, yaw_inertia: 1, viscous_linear: 4, viscous_yaw: 1}\nratte: 3\n");
  EXPECT_THAT(refused_command("simulate s.yaml --out z.csv"),
              AllOf(HasSubstr("s.yaml:3: unknown key 'ratte'"), HasSubstr("did you mean 'rate'?")));
  EXPECT_FALSE(std::filesystem::exists(path("z.csv")));
}

TEST_F(BadInput, FollowNamesTheRowsItLeavesOut) {
  commission_shipped();
  put_log(500, [](const std::string& line) { return with_field(line, -1, "1.2abc"); });
  const Outcome outcome = run("detect --follow --model model/model.json", path("log.csv"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("500: column 'tau_l': '1.2abc': expected a number"), HasSubstr("left out")));
  EXPECT_EQ(run("detect --follow --model model/model.json").code, 2) << "standard input without a header";
  put("names.csv", "t,phi_r,phi_l\n");
  EXPECT_THAT(run("detect --follow --model model/model.json", path("names.csv")).err,
              HasSubstr("standard input: no column 'tau_r'"));
}

}  // namespace
}  // namespace wheelwright::app::bad_input_test
