// SPDX-License-Identifier: Apache-2.0
// Help, suggestions, completion and manual pages of every command, and units.
#include <map>
#include <regex>
#include <set>

#include "app/common.hpp"
#include "app/units.hpp"
#include "formats/files/words.hpp"
#include "tests/app/program.hpp"

namespace wheelwright::app::manners_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::lines_of;
using ::testing::Not;
using testing::Outcome;

class Manners : public testing::ProgramTest {
 protected:
  /// Names of the commands, as the help of the program lists them.
  std::vector<std::string> commands() const {
    std::vector<std::string> out;
    bool listed = false;
    for (const std::string& line : lines_of(run("--help").out)) {
      if (listed && line.starts_with("  ") && line[2] != ' ') {
        out.push_back(line.substr(2, line.find(' ', 2) - 2));
      }
      listed = listed || line == "Subcommands:";
    }
    return out;
  }

  /// Long options that the help of `command` lists.
  std::set<std::string> options(const std::string& command) const {
    std::set<std::string> out;
    const std::regex option("^  (?:-[a-zA-Z],)?(--[a-z0-9-]+)");
    for (const std::string& line : lines_of(run(command + " --help").out)) {
      if (std::smatch found; std::regex_search(line, found, option)) {
        out.insert(found[1]);
      }
    }
    return out;
  }

  static bool has_program(const std::string& name) {
    return std::system(("command -v " + name + " > /dev/null").c_str()) == 0;
  }

  /// What bash offers for the words, the last of which is being typed.
  std::vector<std::string> offered(const std::vector<std::string>& words) const {
    std::string array;
    for (const std::string& word : words) {
      array += " '" + word + "'";
    }
    put("ask.sh", fmt::format("source ./completion.bash\nCOMP_WORDS=({})\nCOMP_CWORD={}\n_wheelwright\nprintf '%s\\n' "
                              "\"${{COMPREPLY[@]}}\"\n",
                              array, words.size() - 1));
    EXPECT_EQ(std::system(fmt::format("cd '{}' && bash ask.sh > answer", directory_.string()).c_str()), 0);
    return lines_of(bytes(path("answer")));
  }
};

TEST_F(Manners, EveryCommandHasExamples) {
  const std::vector<std::string> all = commands();
  ASSERT_THAT(all, AllOf(Contains("commission"), Contains("robot"), Contains("man")));
  for (const std::string& command : all) {
    const std::string help = run(command + " --help").out;
    std::size_t examples = 0;
    for (const std::string& line : lines_of(help)) {
      examples += line.starts_with("  ") && line.find("wheelwright " + command + " ") != std::string::npos ? 1 : 0;
    }
    EXPECT_GE(examples, 2u) << help;
    EXPECT_THAT(help, HasSubstr("Examples:\n"));
    EXPECT_THAT(help, Not(HasSubstr("->"))) << "an enumeration shows its insides";
  }
}

TEST_F(Manners, MisspeltWordsAreUnderstood) {
  for (const auto& [words, meant] :
       {std::pair{"comission x.csv", "did you mean 'commission' instead of 'comission'?"},
        {"detect x.csv --modle m.json", "did you mean '--model' instead of '--modle'?"},
        {"detect --qiuet x.csv", "'--quiet'"},
        {"--verison", "'--version'"},
        {"frobnicate", "there is no command 'frobnicate': expected one of try, commission"},
        {"man dettect", "did you mean 'detect'?"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_THAT(outcome.err, HasSubstr(meant)) << words;
  }
  EXPECT_THAT(run("detect x.csv").err, Not(HasSubstr("did you mean")));
}

TEST_F(Manners, BashOffersWhatTheHelpLists) {
  put("completion.bash", run("completion bash").out);
  EXPECT_EQ(std::system(fmt::format("bash -n '{}'", path("completion.bash").string()).c_str()), 0);
  EXPECT_EQ(offered({"wheelwright", ""}), commands());
  EXPECT_THAT(offered({"wheelwright", "det"}), ::testing::ElementsAre("detect"));
  for (const std::string& command : commands()) {
    std::set<std::string> words;
    for (const std::string& word : offered({"wheelwright", command, "--"})) {
      words.insert(word);
    }
    EXPECT_EQ(words, options(command)) << command;
  }
  EXPECT_THAT(offered({"wheelwright", "design", "--for", "de"}), ::testing::ElementsAre("detection"));
  EXPECT_THAT(offered({"wheelwright", "completion", ""}), ::testing::ElementsAre("bash", "zsh", "fish"));
  EXPECT_THAT(offered({"wheelwright", "detect", "--set", ""}), ::testing::UnorderedElementsAre("polytope", "box"));
  put("a file.json", "{}");
  EXPECT_THAT(offered({"wheelwright", "detect", "--model", "a"}), Contains("a file.json"));
  std::filesystem::create_directory(path("a folder"));
  EXPECT_THAT(offered({"wheelwright", "detect", "--out", "a"}), ::testing::ElementsAre("a folder"));
}

TEST_F(Manners, OtherShellsHaveEveryOption) {
  const std::string zsh = run("completion zsh").out, fish = run("completion fish").out;
  EXPECT_TRUE(zsh.starts_with("#compdef wheelwright\n"));
  for (const std::string& command : commands()) {
    EXPECT_THAT(zsh, HasSubstr("\n      " + command + ")\n"));
    for (const std::string& option : options(command)) {
      EXPECT_THAT(zsh, HasSubstr(option + "["));
      EXPECT_THAT(fish, HasSubstr(fmt::format("'__fish_seen_subcommand_from {}' -l {} ", command, option.substr(2))));
    }
  }
}

TEST_F(Manners, ShellsReadTheirScripts) {
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    if (testing_support::skip_unless(has_program(shell), "there is no " + shell)) {
      return;
    }
    put("script", run("completion " + shell).out);
    EXPECT_EQ(std::system(fmt::format("cd '{}' && {} -n script", directory_.string(), shell).c_str()), 0) << shell;
  }
}

TEST_F(Manners, ManualPagesAreOneForEachCommandWithTheUsualSections) {
  ASSERT_EQ(run("man --out pages").code, 0);
  std::vector<std::string> expected = {"wheelwright.1"};
  for (const std::string& command : commands()) {
    expected.push_back("wheelwright-" + command + ".1");
  }
  EXPECT_THAT(names_in("pages"), ::testing::UnorderedElementsAreArray(expected));
  for (const std::string& command : commands()) {
    const std::string page = bytes(path("pages/wheelwright-" + command + ".1"));
    EXPECT_EQ(page, run("man " + command).out);
    std::size_t at = 0;
    for (const std::string section :
         {".TH ", ".SH NAME", ".SH SYNOPSIS", ".SH DESCRIPTION", ".SH OPTIONS", ".SH EXAMPLES", ".SH SEE ALSO"}) {
      const std::size_t next = page.find(section);
      EXPECT_NE(next, std::string::npos) << command << " " << section;
      at = section == ".SH EXAMPLES" ? at : std::max(at, next);
      EXPECT_TRUE(section == ".SH EXAMPLES" || next == at) << command << " " << section << " out of order";
    }
    for (const char c : page) {
      ASSERT_LT(static_cast<unsigned char>(c), 0x80) << command << ": roff of its own letters only";
    }
  }
}

TEST_F(Manners, ManualPagesFormatWithoutAWarning) {
  if (testing_support::skip_unless(has_program("man") && has_program("groff"), "there is no man, or no groff")) {
    return;
  }
  ASSERT_EQ(run("man --out pages").code, 0);
  EXPECT_EQ(std::system(fmt::format("cd '{}' && for page in pages/*; do LC_ALL=C.UTF-8 MANROFFOPT= man --warnings -l "
                                    "$page 2>> warnings > $page.txt || exit 1; done",
                                    directory_.string())
                            .c_str()),
            0);
  EXPECT_THAT(bytes(path("warnings")), IsEmpty());
  const std::string detect = bytes(path("pages/wheelwright-detect.1.txt"));
  for (const std::string& option : options("detect")) {
    EXPECT_THAT(detect, HasSubstr(option));
  }
  EXPECT_THAT(detect, HasSubstr("robot_driver | wheelwright detect --follow"));
}

TEST_F(Manners, NoEscapesWhereNobodyWatches) {
  const std::string log = (examples() / "healthy.csv.gz").string();
  const Outcome outcome = run("commission '" + log + "' --robot robot.yaml --out model");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ((outcome.out + outcome.err).find('\033'), std::string::npos);
}

// A result that did not arrive is no success, and a message that nobody can read ends no program.
TEST_F(Manners, AFullOutputIsAnExitCode) {
  const std::filesystem::path program = WHEELWRIGHT_PROGRAM;
  const auto code = [&](const std::string& arguments) {
    const int status =
        std::system(fmt::format("cd '{}' && '{}' {}", directory_.string(), program.string(), arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  put_lines("log.csv", healthy_lines());
  for (const char* const command : {"doctor log.csv --robot robot.yaml --json", "doctor log.csv --robot robot.yaml",
                                    "completion bash", "simulate --scenario none.yaml"}) {
    EXPECT_EQ(code(std::string(command) + " > /dev/full 2> '" + path("err").string() + "'"), 2) << command;
    EXPECT_THAT(bytes(path("err")), HasSubstr("wheelwright")) << command;
    EXPECT_EQ(code(std::string(command) + " >&- 2> /dev/null"), 2) << command;
  }
  EXPECT_EQ(code("doctor none.csv --robot robot.yaml > /dev/null 2> /dev/full"), 2);
  EXPECT_EQ(code("doctor none.csv --robot robot.yaml > /dev/null 2>&-"), 2);
}

// --json of some commands went into a full stream and came out as a success.
TEST_F(Manners, AResultThatDidNotArriveIsNoSuccessOfAnyCommand) {
  std::vector<std::string> some = healthy_lines();
  some.resize(3001);
  put_lines("log.csv", some);
  put("drive.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 3}\nduration: 5\nrate: 50\n"
      "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02}\n");
  const std::string wheel =
      "<link name='{0}'/><joint name='{0}' type='continuous'><parent link='base'/><child link='{0}'/>"
      "<axis xyz='0 1 0'/><origin xyz='0 {1} 0'/></joint>";
  put("robot.urdf",
      "<robot name='r'><link name='base'><inertial><mass value='9'/>"
      "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>" +
          fmt::format(fmt::runtime(wheel), "left_wheel", 0.2) + fmt::format(fmt::runtime(wheel), "right_wheel", -0.2) +
          "</robot>");
  std::filesystem::create_directory(path("fleet"));
  std::filesystem::copy_file(path("log.csv"), path("fleet/amy.csv"));
  put("study.yaml",
      "scenario: drive.yaml\ninputs: {duration: [4, 6]}\nquantities: [width]\n"
      "methods: {one_at_a_time: {levels: 2}}\n");
  ASSERT_LE(run("commission log.csv --robot robot.yaml --out model --quiet").code, 1);
  const std::map<std::string, std::string> arguments = {
      {"try", "log.csv --wheel-radius 0.0975 --track-width 0.381"},
      {"commission", "log.csv --robot robot.yaml"},
      {"detect", "log.csv --model model/model.json"},
      {"doctor", "log.csv --robot robot.yaml"},
      {"check", "model/model.json log.csv"},
      {"compare", "model/model.json model/model.json"},
      {"identify", "log.csv --robot robot.yaml"},
      {"margins", "log.csv --model model/model.json --fault wheel_radius --window 1"},
      {"sensitivity", "study.yaml"},
      {"export", "model/model.json --language c --out header"},
      {"design", "--robot robot.yaml --for bounds --speed 8 --acceleration 20 --duration 4 --stages 1 --rate 50"},
      {"simulate", "drive.yaml --out made.csv"},
      {"choose", "log.csv --robot robot.yaml"},
      {"gap", "log.csv --robot robot.yaml --no-manoeuvre --no-shrink"},
      {"fleet", "fleet --robot robot.yaml"},
      {"convert", "log.csv other.csv"},
      {"robot", "--urdf robot.urdf --wheel-radius 0.1 --massless left_wheel --massless right_wheel"}};
  for (const std::string& command : commands()) {
    if (!options(command).contains("--json")) {
      continue;
    }
    ASSERT_TRUE(arguments.contains(command)) << command << ": how is it called?";
    const std::string line = command + " " + arguments.at(command) + " --json --quiet --force";
    const Outcome whole = run(line);
    EXPECT_LE(whole.code, 1) << line << "\n" << whole.err;
    EXPECT_FALSE(whole.out.empty()) << line;
    EXPECT_EQ(run(line, "/dev/null", "sh -c 'exec \"$@\" > /dev/full' sh").code, 2) << line;
  }
}

// A file's name that holds a line end made a line that the program seemed to have said.
TEST_F(Manners, NamesMakeNoLinesOfTheirOwn) {
  const std::string name = "a.csv\nThe log can be commissioned: \xFF.csv";
  put_lines(name, healthy_lines());
  const Outcome done = run("doctor '" + name + "' --robot robot.yaml --out found");
  EXPECT_EQ(done.code, 0) << done.err;
  for (const std::string& text : {done.out, run("doctor '" + name + ".gz' --robot robot.yaml").err}) {
    for (const std::string& line : lines_of(text)) {
      EXPECT_FALSE(line.starts_with("The log can be commissioned: ")) << text;
    }
  }
  EXPECT_TRUE(files::is_utf8(bytes(path("found/report.html"))));
  EXPECT_TRUE(files::is_utf8(bytes(path("found/doctor.json"))));

  std::filesystem::create_directories(path("fleet/amy\n\x1B[31mbob"));
  put_lines("fleet/amy\n\x1B[31mbob/log.csv", healthy_lines());
  EXPECT_LE(run("fleet fleet --robot robot.yaml --out found --force --quiet").code, 1);
  const std::string csv = bytes(path("found/fleet.csv"));
  EXPECT_THAT(csv, HasSubstr("\namy\\x0A\\x1B[31mbob,"));
  EXPECT_EQ(csv.find('\x1B'), std::string::npos);
}

// Keys of answers.json become words of a shell.
TEST_F(Manners, WithheldCasesHaveNamesOfOurs) {
  std::filesystem::create_directory(path("set"));
  put("set/answers.json", R"json({"$(touch pwned)": {"effects": []}})json");
  const std::string script = std::string(WHEELWRIGHT_SOURCE_DIR) + "/tests/campaigns/withheld.sh";
  const int status =
      std::system(fmt::format("cd '{}' && sh '{}' --out out set > said 2>&1", directory_.string(), script).c_str());
  EXPECT_NE(status, 0);
  EXPECT_THAT(bytes(path("said")), HasSubstr("expected a name of letters, digits, _ and -"));
  EXPECT_FALSE(std::filesystem::exists(path("pwned")));
}

TEST_F(Manners, WhatFilesSayIsNoCommandToTheTerminal) {
  put("esc.yaml", "\"\\e[31mred\": 1\n");
  for (const std::string& arguments : {std::string("doctor '\x1B]0;title\x07\xFF.csv' --robot robot.yaml"),
                                       std::string("doctor log.csv --robot esc.yaml"),
                                       std::string("doctor log.csv --robot robot.yaml --map 'x\x1B[2J=\x9B'")}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.err.find_first_of("\x1B\x07\x9B\xFF"), std::string::npos) << outcome.err;
    EXPECT_EQ(files::printable(outcome.err), outcome.err);
  }
}

TEST(Units, AreThoseOfTheQuantity) {
  using app::quantity;
  EXPECT_EQ(quantity("120", "s"), 120.0);
  EXPECT_EQ(quantity("2min", "s"), 120.0);
  EXPECT_EQ(quantity(" 2 min", "s"), 120.0);
  EXPECT_EQ(quantity("5 cm", "m"), 0.05);  // the nearest double
  EXPECT_EQ(quantity("97.5mm", "m"), 0.0975);
  EXPECT_EQ(quantity("20 Hz", "Hz"), 20.0);
  EXPECT_EQ(quantity("1 kHz", "Hz"), 1000.0);
  EXPECT_EQ(quantity("180deg", "rad"), M_PI);
  EXPECT_DOUBLE_EQ(quantity("60 rpm", "rad/s"), 2.0 * M_PI);
  for (const char* text : {"3 rad/s²", "3 rad/s^2", "3rad/s2"}) {
    EXPECT_EQ(quantity(text, "rad/s²"), 3.0) << text;
  }
  for (const char* text : {"0.2 N·m", "0.2 N*m", "0.2Nm"}) {
    EXPECT_EQ(quantity(text, "N·m"), 0.2) << text;
  }
  EXPECT_EQ(quantity("3 %", "1"), 0.03);
  EXPECT_EQ(quantity("4 N·s²/m", "N·s²/m"), 4.0);
  for (const char* text : {"", "s", "2 parsec", "2 m", "nan", "inf", "1e400", "2min3", "2 M", "--2", "1e308 h"}) {
    EXPECT_THAT(testing::input_error([&] { static_cast<void>(quantity(text, "s")); }),
                AllOf(HasSubstr("expected a number in s"), HasSubstr("s, ms, us, min, h")))
        << text;
  }
}

TEST(Progress, SaysWhatIsLeftWhenThatCanBeKnown) {
  using app::progress_line;
  EXPECT_EQ(progress_line("fitting", 0.4, 12.0), " 40 %  fitting (12 s, about 18 s left)");
  EXPECT_EQ(progress_line("fitting", 0.1, 60.0), " 10 %  fitting (1 min, about 9 min left)");
  EXPECT_EQ(progress_line("fitting", 0.05, 600.0), "  5 %  fitting (10 min, about 3 h 10 min left)");
  EXPECT_EQ(progress_line("fitting", 0.5, 1.0), " 50 %  fitting (1 s)");     // too early
  EXPECT_EQ(progress_line("fitting", 0.01, 30.0), "  1 %  fitting (30 s)");  // too little
  EXPECT_EQ(progress_line("done", 1.0, 30.0), "100 %  done (30 s)");
}

}  // namespace
}  // namespace wheelwright::app::manners_test
