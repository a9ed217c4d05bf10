// SPDX-License-Identifier: Apache-2.0
// The manoeuvre that tells causes apart, from names and from a gap.json.
#include "app/program.hpp"

namespace wheelwright::app::design_discrimination_test {
namespace {

using ::testing::HasSubstr;
using testing::Outcome;

class DesignDiscrimination : public testing::ProgramTest {};

constexpr const char* kDrive =
    "design --robot robot.yaml --for discrimination --speed 8 --acceleration 20 --effort 6 --radius 1 --duration 4 "
    "--stages 1 --rate 50 --quiet ";

constexpr const char* kGap = R"({"schema": "wheelwright/gap/1",
  "filter": {"order": 2, "alpha": 5, "beta": 5},
  "shrink": {"torque_rms": {"sum": {"floor": 0.05}, "difference": {"floor": 0.01}}},
  "causes": [{"effect": "actuator_lag", "parameters": {"T": {"estimate": 0.04}}}],
  "credible_set": [{"effects": ["actuator_lag"]},
                   {"effects": ["delay"], "parameters": {"delay.T_d": {"estimate": 0.037}}},
                   {"effects": ["of_my_own"]}]})";

TEST_F(DesignDiscrimination, TellsNamedCausesApart) {
  const Outcome done =
      run(std::string(kDrive) + "--between coulomb --between caster_drag --size coulomb=0.2 --out plan");
  ASSERT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(names_in("plan"),
              ::testing::ElementsAre("design.json", "figure_eight.csv", "manoeuvre.csv", "report.html"));
  const Json design = files::read_json(path("plan/design.json"));
  EXPECT_EQ(design.at("for"), "discrimination");
  EXPECT_DOUBLE_EQ(design.at("rivals")[0].at("causes")[0].at("coefficients")[0].get<double>(), 0.2);
  EXPECT_EQ(design.at("pairs").size(), 2U);
  for (const auto& [limit, share] : design.at("use").items()) {
    EXPECT_LE(share.get<double>(), 1.0) << limit;
  }
}

TEST_F(DesignDiscrimination, TakesTheCredibleSetOfAGap) {
  put("gap.json", kGap);
  const Outcome done = run(std::string(kDrive) + "--gap gap.json --json");
  ASSERT_EQ(done.code, 0) << done.err;
  const Json design = Json::parse(done.out);
  ASSERT_EQ(design.at("rivals").size(), 2U);  // the one that the catalogue does not know is left out
  EXPECT_EQ(design.at("rivals")[0].at("causes")[0].at("shape")[0], 0.04);
  EXPECT_EQ(design.at("rivals")[1].at("causes")[0].at("shape")[0], 0.037);
}

TEST_F(DesignDiscrimination, SaysWhatIsWrong) {
  EXPECT_THAT(run(std::string(kDrive) + "--between coulomb").err, HasSubstr("at least twice"));
  EXPECT_THAT(run(std::string(kDrive) + "--between coulomb --between gremlins").err, HasSubstr("gremlins"));
  EXPECT_THAT(run(std::string(kDrive) + "--between coulomb --between delay --size coulomb.nonsense=1").err,
              HasSubstr("no parameter 'nonsense'"));
  EXPECT_THAT(run(std::string(kDrive) + "--between coulomb --between delay --size slope=1").err, HasSubstr("slope"));
  EXPECT_EQ(run("design --robot robot.yaml --for bounds --gap gap.json").code, 2);
}

}  // namespace
}  // namespace wheelwright::app::design_discrimination_test
