// SPDX-License-Identifier: Apache-2.0
// `wheelwright margins`, as a user runs it: on the drive that was commissioned with, a pose beside it.
#include <limits>

#include "tests/app/program.hpp"

namespace wheelwright::app::margins_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Margins : public testing::ProgramTest {
 protected:
  // A drive with a pose, commissioned; a straight one to be judged.
  void prepare() const {
    const std::string sensors =
        "sensors: {effort: 0.02, position: 0.002, heading: 0.003, encoder_counts_per_turn: 4096, log: [angles, "
        "pose]}\n";
    const std::string robot =
        "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n";
    put("learn.yaml",
        robot + "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 5}\nduration: 30\n" + sensors);
    put("straight.yaml", robot + "trajectory: {kind: straight, speed: 0.5}\nduration: 10\n" + sensors);
    for (const std::string name : {"learn", "straight"}) {
      ASSERT_EQ(run("simulate " + name + ".yaml --out " + name + ".csv --quiet").code, 0);
    }
    const Outcome done = run("commission learn.csv --robot robot.yaml --quiet --out model");
    ASSERT_EQ(done.code, 0) << done.err;
  }

  static const Json& fault(const Json& residual, const std::string& name, const std::string& side) {
    for (const Json& each : residual.at("faults")) {
      if (each.at("fault") == name && each.at("side") == side) {
        return each;
      }
    }
    throw std::out_of_range(name);
  }
};

TEST_F(Margins, SayBeforehandWhatWillBeSeen) {
  prepare();
  const Outcome told =
      run("margins --model model/model.json --fault unmatched --fault wheel_radius straight.csv --out margins --quiet");
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, IsEmpty());
  EXPECT_THAT(names_in("margins"), ::testing::ElementsAre("margins.json", "report.html"));
  const Json json = files::read_json(path("margins/margins.json"));
  if (has_validator()) {
    EXPECT_EQ(misfit("margins.schema.json", "margins/margins.json"), "");
  }
  ASSERT_EQ(json.at("residuals").size(), 2u);
  const Json &torque = json.at("residuals")[0], &kinematic = json.at("residuals")[1];
  std::size_t cruising = 0;
  for (const std::string side : {"positive", "negative"}) {
    for (const Json& row : fault(torque, "unmatched", side).at("summary")) {
      if (row.at("manoeuvre") == "cruising") {
        EXPECT_TRUE(row.at("best").is_null()) << row;
        ++cruising;
      }
    }
    for (const Json& row : fault(kinematic, "unmatched", side).at("summary")) {
      if (row.at("manoeuvre") == "cruising" && row.at("window") == 1.0) {
        EXPECT_LT(row.at("worst").get<double>(), 0.2) << row;
        EXPECT_EQ(row.at("worst_by_output").at("lateral"), row.at("worst"));
        ++cruising;
      }
    }
    // A longer wait never asks for a larger fault.
    for (const Json& onset : fault(torque, "wheel_radius", side).at("onsets")) {
      double before = std::numeric_limits<double>::infinity();
      for (const Json& size : onset.at("certain")) {
        const double now = size.is_null() ? std::numeric_limits<double>::infinity() : size.get<double>();
        EXPECT_LE(now, before);
        before = now;
      }
    }
  }
  EXPECT_GT(cruising, 4u);
  const std::string page = bytes(path("margins/report.html"));
  EXPECT_THAT(page, AllOf(HasSubstr("Wheel radius, growing"), HasSubstr("Kinematic residual")));
}

TEST_F(Margins, TellWhatIsWrongWithAQuestion) {
  prepare();
  const Outcome fault = run("margins straight.csv --model model/model.json --fault wheel_radios");
  EXPECT_EQ(fault.code, 2);
  EXPECT_THAT(fault.err, AllOf(HasSubstr("wheel_radios"), HasSubstr("wheel_radius_right")));
  std::string rows = "t,phi_r,phi_l,tau_r,tau_l\n";
  for (int k = 0; k < 30; ++k) {
    rows += fmt::format("{},{},{},0.1,0.1\n", 0.01 * k, 1.0 + 0.1 * k, 1.0 + 0.1 * k);
  }
  put("short.csv", rows);
  const Outcome brief = run("margins short.csv --model model/model.json");
  EXPECT_EQ(brief.code, 2);
  EXPECT_THAT(brief.err, HasSubstr("settle"));
  const Outcome window = run("margins straight.csv --model model/model.json --window -1");
  EXPECT_EQ(window.code, 2);
  EXPECT_THAT(window.err, HasSubstr("--window"));
}

}  // namespace
}  // namespace wheelwright::app::margins_test
