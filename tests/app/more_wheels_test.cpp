// SPDX-License-Identifier: Apache-2.0
// A robot that skids in turns (docs/use/more_wheels.md): in its kinematics it is one whose track is wider than the tape
// measure says, here 1.4 times, and whose wheels are 3 % smaller.
#include "core/words.hpp"

#include "tests/app/program.hpp"

namespace wheelwright::app::more_wheels_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Outcome;

constexpr double kTrack = 0.533, kRadius = 0.0946;  // m, as it turns and rolls

class SkidSteer : public testing::ProgramTest {
 protected:
  SkidSteer() {
    std::string truth = bytes(path("robot.yaml"));
    core::replace_all(truth, "track_width: 0.381", fmt::format("track_width: {}", kTrack));
    core::replace_all(truth, "wheel_radius: 0.0975", fmt::format("wheel_radius: {}", kRadius));
    put("truth.yaml", truth);
    std::string measured = bytes(path("robot.yaml"));
    core::replace_all(measured, "track_width: 0.381", "track_width: 0.533");
    put("measured.yaml", measured);
  }

  void drive(const std::string& name, int seed, const std::string& mass = "21.0") const {
    put(name + ".yaml", "robot: truth.yaml\nparameters: {mass: " + mass +
                            ", yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
                            "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 8}\n"
                            "sensors: {effort: 0.02, position: 0.002, heading: 0.003, "
                            "encoder_counts_per_turn: 4096, log: [angles, pose]}\nrate: 100\nduration: 50\n" +
                            fmt::format("seed: {}\n", seed));
    ASSERT_EQ(run(fmt::format("simulate {0}.yaml --out {0}.csv --quiet", name)).code, 0);
  }

  Json gap(const std::string& log, const std::string& robot) const {
    const Outcome told = run(fmt::format("gap {}.csv --robot {}.yaml --baseline healthy.csv --json", log, robot));
    EXPECT_EQ(told.code, 0) << told.err;
    return Json::parse(told.out, nullptr, false);
  }
};

TEST_F(SkidSteer, EffectiveTrackAndSlipAreParametersWithBounds) {
  drive("healthy", 5);
  const Outcome told = run("identify healthy.csv --robot robot.yaml");
  std::string words = told.out;
  core::replace_all(words, "\n  ", " ");
  EXPECT_THAT(words, HasSubstr("turns as a track width of 0.5"));
  ASSERT_EQ(run("commission healthy.csv --robot robot.yaml --out tape --quiet").code, 0);
  const Json model = files::read_json(path("tape/model.json"));
  EXPECT_EQ(model.at("warrant"), "extrapolated") << "the tape measure's track is not the one it turns by";
  std::size_t seen = 0;
  for (const Json& parameter : model.at("kinematic").at("parameters")) {
    const std::string name = parameter.at("name").get<std::string>();
    const double truth = name.starts_with("radius") ? kRadius : kRadius / kTrack;
    if (name.starts_with("radius") || name.starts_with("yaw_gain")) {
      EXPECT_LE(parameter.at("lower").get<double>(), truth) << name;
      EXPECT_GE(parameter.at("upper").get<double>(), truth) << name;
      EXPECT_LT(parameter.at("upper").get<double>() / parameter.at("lower").get<double>(), 1.05) << name;
      ++seen;
    }
  }
  EXPECT_EQ(seen, 4U);
}

// A healthy log that turns by another track than the robot file's was a payload to `gap`, of itself too: columns of the
// slip were those of a yaw inertia that its own fit had corrected.
TEST_F(SkidSteer, AHealthyRobotIsNotSaidToHaveChanged) {
  drive("healthy", 5);
  drive("again", 6);
  const Json itself = gap("healthy", "robot");
  EXPECT_EQ(itself.at("verdict"), "no_gap") << itself.at("summary");
  const Json again = gap("again", "robot");
  EXPECT_EQ(again.at("verdict"), "no_gap") << again.at("summary");
  EXPECT_THAT(again.at("notes").dump(), AllOf(HasSubstr("slip in turns"), HasSubstr("track_width: 0.5")));
  EXPECT_EQ(gap("again", "measured").at("verdict"), "no_gap");
}

// A drive at constant speed hardly excites the mass: fitted again it is worse than known, and what that left, held out,
// was a gap without a cause in 13 of 13 such drives.
TEST_F(SkidSteer, ADriveThatExcitesLittleIsNoGap) {
  drive("healthy", 5);
  std::string eight = bytes(path("healthy.yaml"));
  core::replace_all(eight, "{kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 8}",
                    "{kind: figure_eight, speed: 0.6, period: 12}");
  put("eight.yaml", eight);
  for (const std::string robot : {"robot", "measured"}) {
    for (const int seed : {1, 2, 3}) {
      ASSERT_EQ(run(fmt::format("simulate eight.yaml --seed {} --out eight.csv --quiet --force", seed)).code, 0);
      const Json found = gap("eight", robot);
      EXPECT_EQ(found.at("verdict"), "no_gap") << robot << seed << found.at("summary");
    }
  }
}

TEST_F(SkidSteer, ALoadIsToldWithEitherTrack) {
  drive("healthy", 5);
  drive("loaded", 6, "23.0");
  for (const std::string robot : {"robot", "measured"}) {
    const Json found = gap("loaded", robot);
    EXPECT_EQ(found.at("verdict"), "explained") << robot << found.at("summary");
    ASSERT_EQ(found.at("causes").size(), 1U);
    EXPECT_EQ(found.at("causes")[0].at("effect"), "payload") << robot;
    const Json& mass = found.at("causes")[0].at("parameters").at("mass_kg");
    // In the mass of the robot file's radius: 2 kg times (0.0946/0.0975).
    EXPECT_NEAR(mass.at("estimate").get<double>(), 2.0 * kRadius / 0.0975, 0.1) << robot;
  }
}

}  // namespace
}  // namespace wheelwright::app::more_wheels_test
