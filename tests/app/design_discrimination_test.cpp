// SPDX-License-Identifier: Apache-2.0
// The manoeuvre that tells causes apart, from names and from a gap.json.
#include "tests/app/program.hpp"

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
              ::testing::ElementsAre("design.json", "figure_eight.csv", "manoeuvre.csv", "manoeuvre_cmd_vel.csv",
                                     "manoeuvre_cmd_vel.mcap", "report.html"));
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

TEST_F(DesignDiscrimination, CurrentsArePlannedAsTheirTorques) {
  // The same robot with its torques as currents: every bound of an effort is 1/(k_t N) of what it was.
  const std::string robot =
      "name: r\nmodel: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\n"
      "nominal: {mass: 19.0, yaw_inertia: 1.0, viscous_linear: 3.0, viscous_yaw: 0.4}\n";
  put("torque.yaml", robot + "effort: {kind: torque}\nnoise: {wheel_speed: 0.02, effort: 0.03}\n");
  put("current.yaml", robot +
                          "effort: {kind: current}\nnoise: {wheel_speed: 0.02, effort: 0.02}\n"
                          "motor: {torque_constant: 0.05, gear_ratio: 30}\n");
  put("gap.json", kGap);
  const std::string drive =
      " --for discrimination --speed 8 --acceleration 20 --radius 1 --duration 4 --stages 1 --rate 50 --json ";
  for (const std::string rivals : {"--gap gap.json", "--between coulomb --between caster_drag --size coulomb=0.2"}) {
    std::vector<Json> designs;
    for (const auto& [file, limit] : {std::pair{"torque.yaml", "6"}, {"current.yaml", "4"}}) {
      const Outcome done = run(std::string("design --robot ") + file + drive + rivals + " --effort " + limit);
      ASSERT_EQ(done.code, 0) << done.err;
      designs.push_back(Json::parse(done.out));
    }
    for (std::size_t k = 0; k < 2; ++k) {
      const auto of = [&](std::size_t which) { return designs[which].at("rivals")[k].at("causes")[0]; };
      EXPECT_EQ(of(0).at("effect"), of(1).at("effect"));
      EXPECT_EQ(of(0).at("coefficients").size(), of(1).at("coefficients").size());
    }
    for (std::size_t k = 0; k < designs[0].at("pairs").size(); ++k) {
      const double of_torques = designs[0].at("pairs")[k].at("promised").at("deviations").get<double>();
      EXPECT_NEAR(designs[1].at("pairs")[k].at("promised").at("deviations").get<double>(), of_torques,
                  1e-6 * of_torques);
    }
  }
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
