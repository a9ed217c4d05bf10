// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/robot_file.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/support/scratch.hpp"

namespace wheelwright::robots::robot_file_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::input_error;

const std::string full = R"(name: my_robot
model: differential_drive
wheel_radius: 0.0975
track_width: 0.381
footprint: {radius: 0.4}
lever_arm: track
effort: {kind: voltage, hold: zero_order, unsigned: true, changes: at_samples, delay: [-0.001, 0.02]}
nominal: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}
prior:   {mass: [5, 60]}
noise:   {wheel_speed: 0.02, effort: estimate, position: 0.002, wheel_angle: 1.0e-3}
filter:  {order: 2, alpha: 20, beta: 25}
encoder_counts_per_turn: 4096
speed_source: encoder_difference
speed_filter: {kind: mean, time: [0.04, 0.05], found: true}
speed_cut: {unit: 0.1, towards: below}
clock: {step: 0.01, drift: 1e-6}
heading_offset: -0.7
pose_source: independent
wheel_directions: checked
limits:  {effort: 6.0, speed: 2}
thresholds: {sum: 0.4, yaw: 0.01}
motor: {torque_constant: 0.0105, resistance: 3.3, back_emf: 0.0105, gear_ratio: 9.69}
parameters: [mass, yaw_inertia]
)";

const std::string least = "model: differential_drive\nwheel_radius: 0.1\ntrack_width: 0.5\n";

TEST(RobotFile, ReadsEveryKey) {
  const Robot robot = parse_robot(full, "robot.yaml");
  EXPECT_EQ(robot.name, "my_robot");
  EXPECT_EQ(robot.wheel_radius, 0.0975);
  EXPECT_EQ(robot.track_width, 0.381);
  EXPECT_EQ(robot.footprint_radius, 0.4);
  EXPECT_TRUE(robot.lever_arm_is_track);
  EXPECT_FALSE(robot.anisotropic_friction);
  EXPECT_EQ(robot.effort, model::EffortKind::voltage);
  EXPECT_EQ(robot.hold, Hold::zero_order);
  EXPECT_TRUE(robot.effort_unsigned);
  EXPECT_EQ(robot.effort_changes, model::EffortChanges::at_samples);
  EXPECT_EQ(robot.effort_delay, (Interval{-0.001, 0.02}));
  EXPECT_EQ(robot.nominal.at("viscous_yaw"), 0.5);
  EXPECT_EQ(robot.prior.at("mass"), (Interval{5.0, 60.0}));
  EXPECT_EQ(robot.noise.wheel_speed.value, 0.02);
  EXPECT_FALSE(robot.noise.effort.value.has_value());
  EXPECT_FALSE(robot.noise.heading.value.has_value());
  EXPECT_EQ(robot.noise.wheel_angle.value, 1e-3);
  EXPECT_EQ(robot.filter.order, 2);
  EXPECT_EQ(robot.filter.alpha, 20.0);
  EXPECT_EQ(robot.filter.beta, 25.0);
  EXPECT_EQ(robot.encoder_counts_per_turn, 4096.0);
  EXPECT_EQ(robot.speed_source, model::SpeedSource::encoder_difference);
  EXPECT_EQ(robot.pose_source, model::PoseSource::independent);
  EXPECT_EQ(robot.speed_filter,
            (model::SpeedFilter{.kind = model::SpeedFilterKind::mean, .time = {0.04, 0.05}, .found = true}));
  EXPECT_EQ(robot.speed_cut, (model::SpeedCut{.unit = 0.1, .down = true}));
  EXPECT_EQ(robot.thresholds, (std::map<std::string, double>{{"sum", 0.4}, {"yaw", 0.01}}));
  EXPECT_EQ(robot.heading_offset, -0.7);
  EXPECT_TRUE(robot.wheel_directions_checked);
  ASSERT_TRUE(robot.clock);
  EXPECT_EQ(robot.clock->step, 0.01);
  EXPECT_EQ(robot.clock->drift, 1e-6);
  EXPECT_EQ(robot.limits.at("effort"), 6.0);
  EXPECT_EQ(robot.limits.at("speed"), 2.0);
  EXPECT_EQ(robot.motor.value().gear_ratio, 9.69);
  EXPECT_EQ(robot.motor.value().resistance, 3.3);
  EXPECT_EQ(robot.parameters.value(), (std::vector<std::string>{"mass", "yaw_inertia"}));
}

TEST(RobotFile, ErrorsOfAPoseThatAverageOutComeBack) {
  const Robot robot = parse_robot(least +
                                      "noise: {position: {bound: 0.01, bias: 0.001, deviation: 0.004, correlation: "
                                      "0.2}, heading: {bound: 0.02, bias: 0}}\n",
                                  "f");
  EXPECT_EQ(robot.noise.position.value, 0.01);
  EXPECT_EQ(robot.noise.position.bias, 0.001);
  EXPECT_EQ(robot.noise.position.deviation, 0.004);
  EXPECT_EQ(robot.noise.position.correlation, 0.2);
  EXPECT_EQ(robot.noise.heading.bias, 0.0);
  EXPECT_EQ(to_json(robot_from_json(to_json(robot), "model.json: /robot")), to_json(robot));
  EXPECT_EQ(to_json(parse_robot(robot_yaml(robot), "f")), to_json(robot));
  EXPECT_THROW((void)parse_robot(least + "noise: {position: {bound: 0.01, bias: 0.02}}\n", "f"), InputError);
  EXPECT_THROW((void)parse_robot(least + "noise: {heading: {bias: 0.02}}\n", "f"), InputError);
}

TEST(RobotFile, DefaultsAreThoseOfRobot) {
  Robot expected;
  expected.wheel_radius = 0.1;
  expected.track_width = 0.5;
  EXPECT_EQ(to_json(parse_robot(least, "f")), to_json(expected));
  EXPECT_EQ(to_json(parse_robot(least + "noise: estimate\nfilter: auto\n", "f")), to_json(expected));
}

TEST(RobotFile, AnEffortsDelayIsANumberOrBoundsAndNoneByDefault) {
  EXPECT_EQ(parse_robot(least, "f").effort_delay, (Interval{0.0, 0.0}));
  EXPECT_EQ(parse_robot(least, "f").effort_changes, model::EffortChanges::between);
  EXPECT_EQ(parse_robot("effort: {delay: 0.005}\n" + least, "f").effort_delay, (Interval{0.005, 0.005}));
}

TEST(RobotFile, SingleAxisAndAnisotropicFriction) {
  const Robot axis = parse_robot(
      "model: single_axis\nparameters: [inertia, viscous, coulomb, offset]\n"
      "prior: {offset: [-10, 10]}\nnominal: {offset: -3, coulomb: 0}\n",
      "f");
  EXPECT_EQ(axis.prior.at("offset"), (Interval{-10.0, 10.0}));
  EXPECT_EQ(axis.parameters.value().size(), 4u);
  const Robot drive = parse_robot("nominal: {viscous_x: 1, viscous_y: 2}\nfriction: anisotropic\n" + least, "f");
  EXPECT_TRUE(drive.anisotropic_friction);
  EXPECT_EQ(drive.nominal.at("viscous_y"), 2.0);
}

class RobotFiles : public testing::ScratchTest {};

TEST_F(RobotFiles, RoundTripsThroughYamlAndJson) {
  for (const std::string& text : {full, least, std::string("model: single_axis\nname: \"a: b, 'c' # \\u00b5 \\\" \"\n"),
                                  "friction: anisotropic\nprior: {viscous_x: [0.1, 0.30000000000000004]}\n" + least,
                                  "name: \"null\"\n" + least, "name: 12\nfilter: {alpha: 3e-7}\n" + least}) {
    const Robot robot = parse_robot(text, "f");
    write_robot(path("robot.yaml"), robot);
    EXPECT_EQ(to_json(read_robot(path("robot.yaml"))), to_json(robot)) << bytes(path("robot.yaml"));
    EXPECT_EQ(to_json(robot_from_json(to_json(robot), "model.json: /robot")), to_json(robot));
    EXPECT_EQ(to_json(robot_from_json(files::parse_json(files::json_text(to_json(robot)), "x"), "x")), to_json(robot));
  }
}

TEST_F(RobotFiles, FilesThatAreNone) {
  EXPECT_THAT(input_error([&] { (void)read_robot(path("absent.yaml")); }), HasSubstr("absent.yaml: no such file"));
  EXPECT_THAT(input_error([&] { (void)read_robot(directory_); }), HasSubstr("is a directory"));
  EXPECT_THAT(input_error([&] { (void)read_robot(put("e.yaml", "")); }), HasSubstr("e.yaml: is empty"));
  EXPECT_THAT(input_error([&] { (void)read_robot(put("b.yaml", std::string("a\0b", 3))); }), HasSubstr("binary data"));
  EXPECT_THAT(input_error([&] { (void)read_robot(put("u.yaml", "name: exam\xD7le\n" + least)); }),
              HasSubstr("u.yaml:1: name: 'exam?le': expected"));
  EXPECT_THAT(input_error([&] { (void)read_robot(put("n.yaml", "name: \"a\\nproved\"\n" + least)); }),
              HasSubstr("n.yaml:1: name: 'a?proved': expected a name without line ends"));
  EXPECT_THAT(input_error([&] { (void)read_robot(put("l.yaml", std::string(2000000, 'a'))); }),
              HasSubstr("longer than"));
}

// The columns were looked for in up to a GiB of a packed robot file, and 90,000 keys were compared with each other.
TEST_F(RobotFiles, ColumnsAreLookedForInNoMoreThanARobotFile) {
  EXPECT_TRUE(
      read_columns(put("l.yaml", least + "columns: {t: time}\n# " + std::string(2'000'000, 'a')), {"t"}).empty());
  std::string many = least;
  for (int k = 0; k < 60'000; ++k) {
    many += fmt::format("k{}: 1\n", k);
  }
  EXPECT_EQ(read_columns(put("m.yaml", many + "columns: {t: time}\n"), {"t"}).at("t"), "time");
  EXPECT_THAT(input_error([&] { (void)read_robot(path("m.yaml")); }), HasSubstr("unknown key 'k0'"));
}

struct Bad {
  std::string line;
  std::string message;
};

class BadRobot : public ::testing::TestWithParam<Bad> {};

TEST_P(BadRobot, NamesFileLineKeyValueAndExpectation) {
  const std::string text = "model: differential_drive\nwheel_radius: 0.1\n" + GetParam().line + "\ntrack_width: 0.5\n";
  EXPECT_THAT(input_error([&] { (void)parse_robot(text, "robot.yaml"); }),
              AllOf(HasSubstr("robot.yaml:3: "), HasSubstr(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadRobot,
    ::testing::Values(
        Bad{"lever_am: track", "unknown key 'lever_am': expected one of name, model"},
        Bad{"lever_am: track", "did you mean 'lever_arm'?"},
        Bad{"wheel_radius: 0.2", "wheel_radius stands there twice: expected it once"},
        Bad{"lever_arm: half", "lever_arm: 'half': expected one of half_track, track"},
        Bad{"lever_arm: [track]", "lever_arm: a list of 1: expected one of half_track, track"},
        Bad{"friction: none", "friction: 'none': expected one of isotropic, anisotropic"},
        Bad{"friction: isotropc",
            "friction: 'isotropc': expected one of isotropic, anisotropic; did you mean 'isotropic'?"},
        Bad{"effort: torque", "effort: 'torque': expected keys with values, of kind, hold, unsigned, changes"},
        Bad{"effort: {kind: torqe}",
            "effort.kind: 'torqe': expected one of torque, current, voltage; did you mean 'torque'?"},
        Bad{"effort: {hold: none}", "effort.hold: 'none': expected one of zero_order, first_order"},
        Bad{"effort: {unsigned: maybe}", "effort.unsigned: 'maybe': expected one of true, false"},
        Bad{"effort: {changes: at_sample}",
            "effort.changes: 'at_sample': expected one of between, at_samples; did you mean 'at_samples'?"},
        Bad{"effort: {delay: 20}", "effort.delay: '20': expected seconds between -1 and 1"},
        Bad{"effort: {delay: late}", "effort.delay: 'late': expected seconds between -1 and 1"},
        Bad{"effort: {delay: .nan}", "effort.delay: '.nan': expected seconds between -1 and 1"},
        Bad{"effort: {delay: [0.01]}", "effort.delay: a list of 1: expected seconds between -1 and 1, or two such"},
        Bad{"effort: {delay: [0.02, 0.01]}", "effort.delay: '0.01': expected seconds between -1 and 1, or two such"},
        Bad{"effort: {knd: torque}",
            "effort: unknown key 'knd': expected one of kind, hold, unsigned, changes, delay, smoothing; did you mean "
            "'kind'?"},
        Bad{"nominal: {mas: 3}", "nominal: unknown key 'mas'"},
        Bad{"nominal: {mass: -3}", "nominal.mass: '-3': expected a number > 0"},
        Bad{"nominal: {mass: heavy}", "nominal.mass: 'heavy': expected a number > 0"},
        Bad{"nominal: {mass: \"3\"}", "nominal.mass: '3': expected a number > 0 without quotes"},
        Bad{"nominal: {viscous_yaw: -1}", "nominal.viscous_yaw: '-1': expected a number >= 0"},
        Bad{"nominal: {viscous_x: 1}", "nominal: unknown key 'viscous_x'"},
        Bad{"nominal: {mass: .nan}", "nominal.mass: '.nan': expected a number > 0"},
        Bad{"nominal: {mass: inf}", "nominal.mass: 'inf': expected a number > 0"},
        Bad{"nominal: {mass: }", "nominal.mass: nothing: expected a number > 0"},
        Bad{"nominal: 5", "nominal: '5': expected keys with values, of mass, yaw_inertia"},
        Bad{"prior: {mass: 5}", "prior.mass: '5': expected two numbers [lo, hi] with 0 <= lo <= hi"},
        Bad{"prior: {mass: [5]}", "prior.mass: a list of 1: expected two numbers"},
        Bad{"prior: {mass: [5, 4]}", "prior.mass: '4': expected two numbers [lo, hi] with 0 <= lo <= hi"},
        Bad{"prior: {mass: [-1, 4]}", "prior.mass: '-1': expected two numbers"},
        Bad{"prior: {mass: [a, 4]}", "prior.mass: 'a': expected two numbers"},
        Bad{"noise: guess", "noise: 'guess': expected estimate"},
        Bad{"noise: {wheel_sped: 1}", "noise: unknown key 'wheel_sped'"},
        Bad{"noise: {effort: -1}", "noise.effort: '-1': expected a bound >= 0, or estimate"},
        Bad{"noise: {effort: auto}", "noise.effort: 'auto': expected a bound >= 0, or estimate"},
        Bad{"filter: manual", "filter: 'manual': expected auto"},
        Bad{"filter: {order: 3}", "filter.order: '3': expected 1, 2 or auto"},
        Bad{"filter: {order: 1.5}", "filter.order: '1.5': expected 1, 2 or auto"},
        Bad{"filter: {alpha: 0}", "filter.alpha: '0': expected a rate > 0 in 1/s, or auto"},
        Bad{"encoder_counts_per_turn: 0", "encoder_counts_per_turn: '0': expected a number > 0"},
        Bad{"speed_filter: {kind: lag}", "speed_filter: a mapping: expected the key time"},
        Bad{"speed_filter: {time: 20}", "speed_filter.time: '20': expected seconds > 0 and at most 1"},
        Bad{"speed_filter: {time: [0.03, 0.02]}", "speed_filter.time: '0.02': expected seconds > 0 and at most 1"},
        Bad{"speed_cut: {towards: up}", "speed_cut.towards: 'up': expected one of zero, below"},
        Bad{"pose_source: wheels", "pose_source: 'wheels': expected one of auto, independent"},
        Bad{"wheel_directions: forward", "wheel_directions: 'forward': expected one of unknown, checked"},
        Bad{"speed_source: encoder", "speed_source: 'encoder': expected one of auto, encoder_difference, measured"},
        Bad{"limits: {torque: 3}", "limits: unknown key 'torque': expected one of effort, speed, acceleration"},
        Bad{"thresholds: 0.4", "thresholds: '0.4': expected keys with values, of sum, difference, longitudinal"},
        Bad{"thresholds: {summ: 1}", "thresholds: unknown key 'summ'"},
        Bad{"thresholds: {sum: 0}", "thresholds.sum: '0': expected a number > 0"},
        Bad{"thresholds: {effort: 1}", "thresholds: unknown key 'effort'"},
        Bad{"footprint: {radius: 0}", "footprint.radius: '0': expected metres, > 0 and at most 100"},
        Bad{"footprint: {radius: 400}", "footprint.radius: '400': expected metres, > 0 and at most 100"},
        Bad{"footprint: 0.4", "footprint: '0.4': expected keys with values, of radius"},
        Bad{"footprint: {}", "footprint: a mapping: expected the key radius"},
        Bad{"footprint: {diameter: 0.8}", "footprint: unknown key 'diameter': expected one of radius"},
        Bad{"limits: {effort: -3}", "limits.effort: '-3': expected a number > 0"},
        Bad{"motor: {kt: 3}", "motor: unknown key 'kt'"},
        Bad{"motor: {resistance: 0}", "motor.resistance: '0': expected a number > 0"},
        Bad{"parameters: mass", "parameters: 'mass': expected a list of mass, yaw_inertia"},
        Bad{"parameters: [mass, mass]", "parameters: 'mass': expected each name once"},
        Bad{"parameters: [offset]", "parameters: 'offset': expected one of mass"},
        Bad{"parameters: []", "parameters: a list of 0: expected at least one of"},
        Bad{"name: {a: b}", "name: a mapping: expected a name"}, Bad{"[a, b]: c", "a list of 2: expected a key"}));

TEST(RobotFile, BadValuesElsewhere) {
  const auto error = [](const std::string& text) {
    return input_error([&] { (void)parse_robot(text, "robot.yaml"); });
  };
  EXPECT_THAT(error("wheel_radius: 97.5\ntrack_width: 0.3\n"),
              HasSubstr("robot.yaml:1: wheel_radius: '97.5': expected metres, > 0 and at most 10"));
  EXPECT_THAT(error("wheel_radius: 0.1\ntrack_width: -2\n"),
              HasSubstr("robot.yaml:2: track_width: '-2': expected metres, > 0 and at most 100"));
  EXPECT_THAT(error("wheel_radius: 0.1\n"), HasSubstr("no key track_width: expected it (m)"));
  EXPECT_THAT(error("track_width: 0.1\n"), HasSubstr("no key wheel_radius: expected it (m)"));
  EXPECT_THAT(error("name: a\nmodel: skid_steer\n"),
              HasSubstr("robot.yaml:2: model: 'skid_steer': expected one of differential_drive, single_axis"));
  EXPECT_THAT(error("model: single_axis\nwheel_radius: 1\n"),
              HasSubstr("robot.yaml:2: wheel_radius: the model single_axis has no wheel_radius"));
  EXPECT_THAT(error("model: single_axis\nfootprint: {radius: 1}\n"),
              HasSubstr("robot.yaml:2: footprint: the model single_axis has no footprint"));
  EXPECT_THAT(error("model: single_axis\nnominal: {mass: 1}\n"), HasSubstr("nominal: unknown key 'mass'"));
  EXPECT_THAT(error("name: a\nname: [\n"), AllOf(HasSubstr("robot.yaml:"), HasSubstr("expected YAML")));
  EXPECT_THAT(error("- a\n- b\n"), HasSubstr("robot.yaml: a list of 2: expected keys with values"));
  EXPECT_THAT(error("just words\n"), HasSubstr("robot.yaml: 'just words': expected keys"));
  EXPECT_THAT(error("# nothing\n"), HasSubstr("robot.yaml: nothing: expected keys"));
  EXPECT_THAT(error("a: &x [*x]\nb: *y\n"), HasSubstr("expected YAML"));
}

TEST(RobotFile, HoldsOneDocument) {
  const auto error = [](const std::string& text) {
    return testing::input_error([&] { (void)parse_robot(text, "robot.yaml"); });
  };
  for (const std::string around : {"---\n", "%YAML 1.2\n---\n"}) {
    EXPECT_EQ(to_json(parse_robot(around + least + "---\n# nothing\n...\n", "f")), to_json(parse_robot(least, "f")));
  }
  EXPECT_THAT(error(least + "---\nfriction: anisotropic\n"),
              HasSubstr("robot.yaml:5: more than one document: expected one"));
  for (const std::string behind : {"]", "}", "] ]", "...\nfriction: anisotropic"}) {
    EXPECT_THAT(error("{model: differential_drive, wheel_radius: 0.1, track_width: 0.5}\n" + behind + "\n"),
                HasSubstr("expected"))
        << behind;
  }
  EXPECT_THAT(error("wheel_radius: 0.1\n---\ntrack_width: 1\n"), HasSubstr("robot.yaml:3: more than one document"));
}

TEST(RobotFile, JsonObjectErrorsNameTheKey) {
  Json object = to_json(parse_robot(least, "f"));
  object["wheel_radius"] = "wide";
  EXPECT_THAT(input_error([&] { (void)robot_from_json(object, "model.json: /robot"); }),
              HasSubstr("model.json: /robot: wheel_radius: 'wide': expected metres"));
  EXPECT_THAT(input_error([&] { (void)robot_from_json(Json::array(), "model.json: /robot"); }),
              HasSubstr("model.json: /robot: a list of 0"));
}

}  // namespace
}  // namespace wheelwright::robots::robot_file_test
