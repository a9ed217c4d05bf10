// SPDX-License-Identifier: Apache-2.0
// Guaranteed is said of what stands on declared bounds, and of nothing else: all that the program says is searched.
#include <algorithm>

#include "tests/app/program.hpp"

namespace wheelwright::app::warrant_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Outcome;

class Warrants : public testing::ProgramTest {
 protected:
  /// A drive with a pose, 30 s.
  void drive() const {
    put("learn.yaml",
        "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
        "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 5}\nduration: 30\n"
        "sensors: {effort: 0.02, position: 0.002, heading: 0.003, encoder_counts_per_turn: 4096, log: [angles, "
        "pose]}\n");
    ASSERT_EQ(run("simulate learn.yaml --out learn.csv --quiet").code, 0);
  }

  /// The shipped robot without its declared noise.
  void forget_noise() const {
    std::string text;
    for (const std::string& line : testing::lines_of(bytes(path("robot.yaml")))) {
      text += line.starts_with("noise:") || line.starts_with("encoder_counts_per_turn:") ? "" : line + "\n";
    }
    put("learnt.yaml", text + "noise: estimate\n");
  }

  /// All that commissioning with `robot` and the commands that take its model write and print, by command.
  std::vector<std::pair<std::string, std::string>> all_that_is_said(const std::string& robot) const {
    const std::string model = " --model m/model.json ";
    const std::vector<std::pair<std::string, std::string>> commands = {
        {"commission learn.csv --robot " + robot + " --out m", "m"},
        {"detect learn.csv" + model + "--out d", "d"},
        {"margins learn.csv" + model + "--fault wheel_radius --out g", "g"},
        {"check m/model.json learn.csv --out c", "c"},
        {"design --for bounds" + model + "--duration 4 --stages 1 --speed 8 --acceleration 20 --radius 1 --out p", "p"},
        {"choose learn.csv --robot " + robot + " --fault wheel_radius --out o", "o"}};
    std::vector<std::pair<std::string, std::string>> said;
    for (const auto& [command, folder] : commands) {
      const Outcome told = run(command);
      EXPECT_LE(told.code, 1) << command << "\n" << told.err;
      said.emplace_back(command, told.out);
      for (const std::string& name : names_in(folder)) {
        said.emplace_back(command + ": " + name, bytes(path(folder) / name));
      }
    }
    return said;
  }

  static std::string in_small_letters(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
  }
};

TEST_F(Warrants, OfBoundsThatWereLearntNothingSaysGuaranteed) {
  drive();
  forget_noise();
  for (const auto& [where, text] : all_that_is_said("learnt.yaml")) {
    const std::string small = in_small_letters(text);
    EXPECT_EQ(small.find("guaranteed"), std::string::npos)
        << where << ": …"
        << text.substr(small.find("guaranteed") - std::min<std::size_t>(small.find("guaranteed"), 60), 120);
  }
  EXPECT_THAT(run("commission learn.csv --robot learnt.yaml").out,
              AllOf(HasSubstr("extrapolated interval"), HasSubstr("Extrapolated: ")));
  EXPECT_THAT(run("margins learn.csv --model m/model.json --fault wheel_radius").out,
              HasSubstr("“Certain” is extrapolated"));
  EXPECT_THAT(run("detect learn.csv --model m/model.json").out, HasSubstr("thresholds: extrapolated"));
  EXPECT_THAT(run("export m/model.json --language c").out, HasSubstr("thresholds extrapolated"));
  for (const std::string file : {"m/model.json", "d/detection.json", "c/check.json", "p/design.json"}) {
    EXPECT_EQ(files::read_json(path(file)).at("warrant"), "extrapolated") << file;
  }
  const Json margins = files::read_json(path("g/margins.json"));
  for (const Json& residual : margins.at("residuals")) {
    EXPECT_EQ(residual.at("warrant"), "extrapolated");
  }
}

TEST_F(Warrants, OfDeclaredBoundsEveryCommandSaysGuaranteed) {
  drive();
  std::vector<std::string> silent;
  for (const auto& [where, text] : all_that_is_said("robot.yaml")) {
    const bool numbers = !where.ends_with(".csv") && !where.ends_with(".mcap") && !where.ends_with(".yaml") &&
                         where.find(": ") != std::string::npos;
    if (numbers && in_small_letters(text).find("guaranteed") == std::string::npos) {
      silent.push_back(where);
    }
  }
  EXPECT_THAT(silent, ::testing::IsEmpty());
  EXPECT_THAT(run("commission learn.csv --robot robot.yaml").out, HasSubstr("guaranteed interval"));
  EXPECT_THAT(run("commission learn.csv --robot robot.yaml --statistical").out, HasSubstr("statistical interval"));
}

TEST_F(Warrants, CheckSaysThatItProvesArithmeticAndListsWhatWasAssumed) {
  drive();
  ASSERT_EQ(run("commission learn.csv --robot robot.yaml --out m --quiet").code, 0);
  const Outcome told = run("check m/model.json learn.csv --out c");
  EXPECT_EQ(told.code, 0) << told.out;
  EXPECT_THAT(told.out,
              AllOf(HasSubstr("What is proved is arithmetic"), HasSubstr("That the assumptions hold is not proved")));
  const Json model = files::read_json(path("m/model.json")), check = files::read_json(path("c/check.json"));
  EXPECT_EQ(check.at("assumptions"), model.at("assumptions"));
  EXPECT_GT(model.at("assumptions").size(), 8u);
  for (const Json& assumption : model.at("assumptions")) {
    EXPECT_THAT(told.out, HasSubstr(assumption.at("statement").get<std::string>()));
  }
  EXPECT_THAT(check.at("scope").get<std::string>(), HasSubstr("arithmetic"));
  if (has_validator()) {
    EXPECT_EQ(misfit("check.schema.json", "c/check.json"), "");
    EXPECT_EQ(misfit("model.schema.json", "m/model.json"), "");
  }
}

}  // namespace
}  // namespace wheelwright::app::warrant_test
