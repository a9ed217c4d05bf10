// SPDX-License-Identifier: Apache-2.0
// wheelwright check: what was commissioned is proved; whatever is changed in the model or the log is found and named.
#include <algorithm>
#include <cmath>
#include <functional>

#include "core/words.hpp"
#include "tests/app/program.hpp"

namespace wheelwright::app::check_test {

using files::read_json;

namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;

class Check : public testing::ProgramTest {
 protected:
  std::string shipped() const { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }

  /// The shipped log's model with one change, checked against the shipped log.
  Outcome changed(const std::function<void(Json&)>& change, const std::string& options = "") const {
    Json model = read_json(path("model/model.json"));
    change(model);
    files::write_json(path("changed.json"), model);
    return run("check changed.json " + shipped() + " " + options);
  }

  /// The failures of a change, which must be found.
  std::string failures(const std::function<void(Json&)>& change) const {
    const Outcome outcome = changed(change, "--json");
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    const Json result = Json::parse(outcome.out, nullptr, false);
    EXPECT_FALSE(result.at("proved").get<bool>());
    EXPECT_FALSE(result.at("failures").empty());
    return result.at("failures").dump();
  }

  static Json& proof(Json& model, int parameter, const std::string& side) {
    return model["parameters"][parameter]["binding_samples"][side];
  }
};

TEST_F(Check, WhatWasCommissionedIsProved) {
  commission_shipped();
  const Outcome outcome = run("check model/model.json " + shipped() + " --out result");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("proved: all 8 bounds"), HasSubstr("r_mass >= "), Not(HasSubstr("NOT")),
                                 HasSubstr("given: an error of at most")));
  EXPECT_THAT(names_in("result"), ElementsAre("check.json", "report.html"));
  EXPECT_THAT(bytes(path("result/report.html")), HasSubstr("Proved: all 8 bounds"));
  const Json result = read_json(path("result/check.json"));
  EXPECT_EQ(result.at("schema"), "wheelwright/check/1");
  EXPECT_TRUE(result.at("data").at("same").get<bool>());
  EXPECT_EQ(result.at("facets").at("wrong"), 0);
  EXPECT_EQ(result.at("facets").at("rows").get<int>() + result.at("facets").at("sides").get<int>(),
            result.at("facets").at("stated").get<int>());
  for (const Json& bound : result.at("bounds")) {
    EXPECT_TRUE(bound.at("proved").get<bool>());
    EXPECT_LE(bound.at("rows").get<int>(), 5) << "p + 1";
    EXPECT_LE(bound.at("shortfall").get<double>(), 0.0);
  }
  EXPECT_THAT(outcome.out, HasSubstr("at a risk of 1e-09: all 8 bounds and "));
  EXPECT_THAT(bytes(path("result/report.html")), HasSubstr("At a risk of 1e-09: all 8 bounds and "));
  EXPECT_TRUE(result.at("at_risk").at("proved").get<bool>());
  EXPECT_LE(result.at("at_risk").at("spent").get<double>(), result.at("at_risk").at("risk").get<double>());
  EXPECT_EQ(run("check model/model.json " + shipped() + " --json").out, bytes(path("result/check.json")));
  const Outcome quiet = run("check model/model.json " + shipped() + " --quiet");
  EXPECT_EQ(quiet.code, 0);
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
}

TEST_F(Check, ABoundMovedInwardIsRefusedOneMovedOutwardIsNot) {
  commission_shipped();
  const Json model = read_json(path("model/model.json"));
  for (int j = 0; j < 4; ++j) {
    const Json& p = model.at("parameters").at(static_cast<std::size_t>(j));
    const double lower = p.at("lower").get<double>(), upper = p.at("upper").get<double>();
    const double step = 1e-9 * (upper - lower);
    const std::string name = p.at("name").get<std::string>();
    EXPECT_THAT(
        failures([&](Json& m) { m["parameters"][j]["lower"] = lower + step; }),
        AllOf(HasSubstr(name + " >= "), HasSubstr(fmt::format("falls short of it by {:.1e}", step).substr(0, 22))));
    EXPECT_THAT(failures([&](Json& m) { m["parameters"][j]["upper"] = upper - step; }), HasSubstr(name + " <= "));
    // The detector stands on the hull, people on the physical bounds.
    EXPECT_THAT(failures([&](Json& m) { m["feasible_set"]["hull"][j][0] = lower + step; }),
                HasSubstr("feasible_set.hull of " + name));
    EXPECT_THAT(failures([&](Json& m) {
                  Json& mass = m["physical"]["mass"]["upper"];
                  mass = mass.get<double>() * (1.0 - 1e-12);
                }),
                HasSubstr("the physical mass"));
  }
  const Outcome outward = changed([](Json& m) {
    m["parameters"][0]["lower"] = m["parameters"][0]["lower"].get<double>() - 0.1;
    m["feasible_set"]["hull"][0][0] = m["feasible_set"]["hull"][0][0].get<double>() - 0.1;
    m["physical"]["mass"]["lower"] = 0.0;
  });
  EXPECT_EQ(outward.code, 0) << outward.out;
}

/// A model with a kinematic residual, at a stated risk too.
class CheckPose : public Check {
 protected:
  void commission_posed() {
    std::string robot = bytes(examples() / "robot.yaml"), scenario = bytes(examples() / "scenarios" / "healthy.yaml");
    core::replace_all(robot, "position: 0.002, heading: 0.003",
                      "position: {bound: 0.002, bias: 0.0001}, heading: {bound: 0.003, bias: 0.0001}");
    core::replace_all(scenario, "../robot.yaml", "robot.yaml");
    core::replace_all(scenario, "duration: 60", "duration: 40");
    put("robot.yaml", robot);
    put("drive.yaml", scenario);
    ASSERT_EQ(run("simulate drive.yaml --out drive.csv").code, 0);
    const Outcome outcome = run("commission drive.csv --robot robot.yaml --out model");
    ASSERT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  }
  std::string failures(const std::function<void(Json&)>& change) const {
    Json model = read_json(path("model/model.json"));
    change(model.at("kinematic"));
    files::write_json(path("changed.json"), model);
    const Outcome outcome = run("check changed.json drive.csv --json");
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    return Json::parse(outcome.out).at("failures").dump();
  }
};

TEST_F(CheckPose, WheelRadiiAndYawGainsAreProvedToo) {
  commission_posed();
  const Outcome outcome = run("check model/model.json drive.csv --out result");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("wheel radii and yaw gains: all 8 bounds"), HasSubstr("radius_right >= "),
                                 HasSubstr("of the pose at a risk of 1e-09: all 8 bounds"), Not(HasSubstr("NOT"))));
  const std::string page = bytes(path("result/report.html"));
  EXPECT_TRUE(page.find("Wheel radii and yaw gains: all 8 bounds") != std::string::npos);
  EXPECT_TRUE(page.find("Of the pose at a risk of 1e-09: all 8 bounds") != std::string::npos);
  const Json result = read_json(path("result/check.json")), model = read_json(path("model/model.json"));
  for (const char* part : {"kinematic", "pose_at_risk"}) {
    EXPECT_TRUE(result.at(part).at("proved").get<bool>());
    EXPECT_EQ(result.at(part).at("bounds").size(), 8U);
    EXPECT_EQ(result.at(part).at("facets").at("wrong"), 0);
  }
  for (std::size_t j = 0; j < 4; ++j) {
    const Json& p = model.at("kinematic").at("parameters").at(j);
    const double lower = p.at("lower").get<double>(), upper = p.at("upper").get<double>();
    const double step = 1e-9 * (upper - lower);
    const std::string name = p.at("name").get<std::string>();
    EXPECT_THAT(failures([&](Json& k) { k["parameters"][j]["lower"] = lower + step; }), HasSubstr(name + " >= "));
    EXPECT_THAT(failures([&](Json& k) { k["parameters"][j]["upper"] = upper - step; }), HasSubstr(name + " <= "));
    EXPECT_THAT(failures([&](Json& k) { k["feasible_set"]["hull"][j][1] = upper - step; }),
                HasSubstr("kinematic.feasible_set.hull of " + name));
    EXPECT_THAT(failures([&](Json& k) {
                  Json& end = k["at_risk"]["feasible_set"]["hull"][j][0];
                  end = end.get<double>() + step;
                }),
                HasSubstr(name + " >= "));
  }
}

TEST_F(CheckPose, AFacetThatIsNotWhatItNamesIsRefused) {
  commission_posed();
  for (const char* part : {"", "at_risk"}) {
    const auto set = [&](Json& k) -> Json& { return (*part == 0 ? k : k[part])["feasible_set"]; };
    Json kinematic = read_json(path("model/model.json")).at("kinematic");
    const Json& origin = set(kinematic).at("origin");
    const auto first = static_cast<std::size_t>(
        std::ranges::find_if(origin, [](const Json& each) { return each.contains("row"); }) - origin.begin());
    ASSERT_LT(first, origin.size());
    const std::string name =
        fmt::format("row {} of kinematic.{}feasible_set.A is not proved", first, *part == 0 ? "" : "at_risk.");
    EXPECT_THAT(failures([&](Json& k) { set(k)["b"][first] = set(k)["b"][first].get<double>() - 1e-7; }),
                HasSubstr(name));
    EXPECT_THAT(failures([&](Json& k) {
                  Json& row = set(k)["origin"][first]["row"];
                  row = row.get<int>() + 1;
                }),
                HasSubstr(name));
  }
}

TEST_F(CheckPose, SmallerErrorsThanTheRobotsAreRefused) {
  commission_posed();
  EXPECT_THAT(failures([](Json& k) { k["detector"]["error_bounds"]["heading"] = 1e-4; }),
              HasSubstr("error_bounds.heading is 0.0001: expected at least 0.003, as the robot has it"));
  EXPECT_THAT(failures([](Json& k) { k["at_risk"]["errors"]["position"]["bias"] = 0.0; }),
              HasSubstr("kinematic.at_risk.errors.position.bias is 0: expected at least 0.0001, as the robot has it"));
  EXPECT_THAT(failures([](Json& k) { k["at_risk"]["errors"]["shortest_step"] = 0.1; }),
              HasSubstr("shortest_step is 0.1"));
  EXPECT_THAT(failures([](Json& k) { k["at_risk"]["risk"] = 1e-15; }), HasSubstr("kinematic.at_risk.feasible_set.A"));
}

TEST_F(CheckPose, ANarrowerPriorOfTheWheelsIsTold) {
  commission_posed();
  Json model = read_json(path("model/model.json"));
  Json& side = model.at("kinematic").at("feasible_set").at("prior").at(0);
  side[0] = 0.09;
  files::write_json(path("changed.json"), model);
  const Outcome outcome = run("check changed.json drive.csv");
  EXPECT_THAT(outcome.out, HasSubstr("the prior of radius_right, [0.09, "));
}

TEST_F(CheckPose, AnOlderModelIsSaidNotToBeChecked) {
  commission_posed();
  Json model = read_json(path("model/model.json"));
  Json& kinematic = model.at("kinematic");
  kinematic["at_risk"].erase("binding");
  files::write_json(path("changed.json"), model);
  const Outcome partly = run("check changed.json drive.csv");
  EXPECT_EQ(partly.code, 0) << partly.out << partly.err;
  EXPECT_THAT(partly.out, HasSubstr("not checked: what is said of the pose at a stated risk"));
  kinematic["feasible_set"].erase("origin");
  for (Json& parameter : kinematic["parameters"]) {
    parameter.erase("binding_samples");
  }
  files::write_json(path("changed.json"), model);
  const Outcome outcome = run("check changed.json drive.csv");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("not checked: the bounds of wheel radii and yaw gains"));
}

TEST_F(Check, AnotherCertificateIsNone) {
  commission_shipped();
  const auto first = [](Json& model) -> Json& { return proof(model, 0, "lower")[0]; };
  EXPECT_THAT(failures([&](Json& m) { first(m)["multiplier"] = first(m)["multiplier"].get<double>() * (1 + 1e-6); }),
              AllOf(HasSubstr("r_mass >= "), HasSubstr("falls short")));
  EXPECT_THAT(failures([&](Json& m) { first(m)["multiplier"] = -first(m)["multiplier"].get<double>(); }),
              AllOf(HasSubstr("r_mass >= "), HasSubstr("multiplier -"), HasSubstr("expected a finite one >= 0")));
  EXPECT_THAT(failures([&](Json& m) { first(m)["row"] = first(m)["row"].get<int>() + 1; }), HasSubstr("s in this log"));
  EXPECT_THAT(failures([&](Json& m) {
                first(m)["row"] = 5000;
                first(m)["t"] = 50.0;
              }),
              AllOf(HasSubstr("r_mass >= "), HasSubstr("falls short")));
  EXPECT_THAT(failures([&](Json& m) { first(m)["row"] = 12001; }), HasSubstr("row 12001 is no instant"));
  EXPECT_THAT(failures([&](Json& m) { first(m)["row"] = 0; }), HasSubstr("row 0 is no instant")) << "not settled";
  EXPECT_THAT(failures([&](Json& m) { first(m)["output"] = "difference"; }), HasSubstr("r_mass >= "));
  EXPECT_THAT(
      failures([&](Json& m) { first(m)["side"] = first(m)["side"].get<std::string>() == "upper" ? "lower" : "upper"; }),
      HasSubstr("r_mass >= "));
  EXPECT_THAT(failures([&](Json& m) { proof(m, 0, "lower") = Json::array(); }), HasSubstr("r_mass >= "));
  EXPECT_THAT(failures([&](Json& m) {
                for (int k = 0; k < 6; ++k) {
                  proof(m, 0, "lower").push_back(first(m));
                }
              }),
              HasSubstr("rows: expected at most 5"));
}

TEST_F(Check, FacetsAreTheRowsThatTheyName) {
  commission_shipped();
  const auto moved = [](int digit) {
    return [digit](Json& m) {
      Json& b = m["feasible_set"]["b"][3];
      b = std::nextafter(b.get<double>(), digit * 1e9);
    };
  };
  EXPECT_THAT(failures(moved(-1)), AllOf(HasSubstr("row 3 of feasible_set.A"), HasSubstr("inward")));
  EXPECT_EQ(changed(moved(1)).code, 0);
  EXPECT_THAT(failures([](Json& m) {
                for (Json& a : m["feasible_set"]["A"][3]) {
                  a = a.get<double>() * 1.001;
                }
              }),
              AllOf(HasSubstr("row 3 of feasible_set.A"), HasSubstr("coefficients are not those of row")));
  // Other coefficients, but so loose a b that the row named implies it.
  const Outcome loose = changed(
      [](Json& m) {
        m["feasible_set"]["A"][3][0] = m["feasible_set"]["A"][3][0].get<double>() * 1.001;
        m["feasible_set"]["b"][3] = m["feasible_set"]["b"][3].get<double>() + 10.0;
      },
      "--json");
  EXPECT_EQ(loose.code, 0) << loose.out;
  EXPECT_EQ(Json::parse(loose.out).at("facets").at("implied"), 1);
}

TEST_F(Check, PremisesMayNotBeNarrowed) {
  commission_shipped();
  // Less noise makes other rows than those that are stated.
  EXPECT_THAT(failures([](Json& m) {
                Json& bound = m["noise"]["outputs"][0]["learning"];
                bound = bound.get<double>() * 1.01;
              }),
              HasSubstr("r_mass"));
  EXPECT_THAT(failures([](Json& m) { m["filter"]["beta"] = m["filter"]["beta"].get<double>() * 1.0001; }),
              HasSubstr("r_mass"));
  const Outcome prior = changed([](Json& m) { m["feasible_set"]["prior"][0] = {1.0, 3.0}; });
  EXPECT_EQ(prior.code, 0);
  EXPECT_THAT(prior.out, HasSubstr("warning: the prior of r_mass, [1, 3], is narrower than the default"));
  EXPECT_THAT(failures([](Json& m) {
                m["robot"]["prior"]["mass"] = {5.0, 60.0};
                m["feasible_set"]["prior"][0] = {1.0, 3.0};
              }),
              HasSubstr("the prior of r_mass, [1, 3], is narrower than the robot's"));
}

// What a robot does between two samples widens its thresholds. A model whose detector takes nothing of it, so that a
// healthy robot raises alarms, was said to be proved.
TEST_F(Check, TheDetectorTakesTheMotionBetweenSamplesThatTheSetIsProvedWith) {
  commission_shipped();
  const auto between = [](Json& m) -> Json& { return m["detector"]["error_bounds"]["between_samples"]; };
  EXPECT_THAT(failures([&](Json& m) { between(m) = nullptr; }), HasSubstr("detector.error_bounds.between_samples"));
  EXPECT_THAT(failures([&](Json& m) { between(m)["effort"][1] = 0.0; }),
              HasSubstr("detector.error_bounds.between_samples.effort[1] is 0: expected at least"));
  EXPECT_THAT(failures([&](Json& m) { between(m)["mobility"][1][1] = 0.0; }),
              HasSubstr("between_samples.mobility[3] is 0"));
  EXPECT_THAT(failures([&](Json& m) { between(m)["mobility"] = between(m)["largest"] = Json::array(); }),
              HasSubstr("between_samples.mobility[0] is 0"));
  EXPECT_THAT(failures([&](Json& m) { between(m)["largest"][2] = 0.0; }), HasSubstr("between_samples.largest[2] is 0"));
  EXPECT_THAT(failures([&](Json& m) {
                between(m)["acceleration"] = {0.0, 0.0};
              }),
              HasSubstr("between_samples.acceleration[0] is 0"));
}

// tests/results/risk_check_test.cpp tries every kind of change.
TEST_F(Check, WhatIsSaidAtARiskIsProvedOrRefused) {
  commission_shipped();
  EXPECT_THAT(failures([](Json& m) { m["at_risk"]["risk"] = 1e-10; }), HasSubstr("ellipsoids add up to 1e-09"));
  for (int j = 0; j < 4; ++j) {
    const std::string name = read_json(path("model/model.json"))["parameters"][j]["name"].get<std::string>();
    EXPECT_THAT(failures([&](Json& m) {
                  Json& upper = m["at_risk"]["feasible_set"]["hull"][j][1];
                  upper = upper.get<double>() * (1.0 - 1e-6);
                }),
                HasSubstr("at a risk of 1e-09: " + name + " <= "));
  }
  // The log of another drive makes other sums.
  simulate("healthy.yaml", "other.csv");
  EXPECT_THAT(run("check model/model.json other.csv --json").out, HasSubstr("is sharper than the log makes it"));
  std::string bare = bytes(path("robot.yaml"));
  const std::string with = "{bound: 0.02, bias: 0.0001}";
  ASSERT_NE(bare.find(with), std::string::npos);
  put("bare.yaml", bare.replace(bare.find(with), with.size(), "0.02"));
  ASSERT_EQ(run("commission " + shipped() + " --robot bare.yaml --out bare --quiet").code, 0);
  const Outcome silent = run("check bare/model.json " + shipped());
  EXPECT_EQ(silent.code, 0) << silent.out;
  EXPECT_THAT(silent.out, Not(HasSubstr("risk")));
}

// A prior that leaves the sign of a noisy column open makes weaker rows; what they prove decides the sign again.
TEST_F(Check, SignsThatTheRowsDecideAreFound) {
  commission_shipped();
  const Outcome outcome = changed([](Json& m) { m["feasible_set"]["prior"][2] = {-1.0, 10000.0}; });
  EXPECT_EQ(outcome.code, 0) << outcome.out;
}

TEST_F(Check, OutliersThatWereLeftOutAreNamedAndProveNothing) {
  commission_shipped();
  const Outcome outcome = changed([](Json& m) { m["feasible_set"]["dropped"] = {4711}; });
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.out, HasSubstr("given: that the instants left out as outliers (rows 4711)"));
  EXPECT_THAT(failures([](Json& m) { m["feasible_set"]["dropped"] = {proof(m, 0, "lower")[0]["row"]}; }),
              AllOf(HasSubstr("r_mass >= "), HasSubstr("left out as outliers")));
}

// A held torque that acts in the last step alone is in no row but the last.
TEST_F(Check, ALogWithAnOutlierIsProvedWithoutIt) {
  std::vector<std::string> lines = healthy_lines();
  lines.resize(3001);
  // The left wheel's torque leaps and does not come back, so that it is not left out on reading. The last row acts on
  // nothing.
  for (std::string* const line : {&lines[lines.size() - 2], &lines.back()}) {
    *line = line->substr(0, line->rfind(',') + 1) + "500";
  }
  put_lines("spike.csv", lines);
  ASSERT_EQ(run("commission spike.csv --robot robot.yaml --outliers 1 --out model --quiet").code, 0);
  EXPECT_EQ(read_json(path("model/model.json")).at("feasible_set").at("dropped"), Json::array({2999}));
  const Outcome outcome = run("check model/model.json spike.csv");
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("given: that the instants left out as outliers (rows 2999)"));
}

TEST_F(Check, AnotherLogIsNamed) {
  commission_shipped();
  simulate("healthy.yaml", "other.csv");
  const Outcome other = run("check model/model.json other.csv");
  EXPECT_EQ(other.code, 1);
  EXPECT_THAT(other.out, AllOf(HasSubstr("other.csv ("), HasSubstr("is not the log that was commissioned"),
                               HasSubstr("it has 6001 usable rows"), HasSubstr("NOT PROVED")));
  std::vector<std::string> lines = healthy_lines();
  put_lines("plain.csv", lines);
  const Outcome plain = run("check model/model.json plain.csv");
  EXPECT_EQ(plain.code, 0) << "the same numbers, not packed";
  EXPECT_THAT(plain.out, HasSubstr("warning: plain.csv ("));
  // One value just before a row that a bound stands on: raised or lowered, one of the two makes the stated row too
  // strong.
  const Json model = read_json(path("model/model.json"));
  const auto row = model["parameters"][0]["binding_samples"]["lower"][0]["row"].get<std::size_t>();
  std::string& line = lines.at(row - 9);
  const std::string whole = line;
  std::string refused;
  for (const std::string more : {"", "-"}) {
    line = whole.substr(0, whole.rfind(',') + 1) + more + "1";
    put_lines("digit.csv", lines);
    const Outcome digit = run("check model/model.json digit.csv");
    refused += digit.code == 1 ? digit.out : "";
  }
  EXPECT_THAT(refused, AllOf(HasSubstr(fmt::format("row {} (", row)), HasSubstr("of feasible_set.A is not proved")));
  line = whole;
  lines.pop_back();
  put_lines("short.csv", lines);
  EXPECT_THAT(run("check model/model.json short.csv").out, HasSubstr("it has 12000 usable rows"));
}

TEST_F(Check, SeveralFilesInTheirOrder) {
  simulate("healthy.yaml", "a.csv");
  ASSERT_EQ(run("simulate '" + (examples() / "scenarios/healthy.yaml").string() + "' --seed 5 --out b.csv").code, 0);
  ASSERT_EQ(run("commission a.csv b.csv --robot robot.yaml --out model --quiet").code, 0);
  EXPECT_EQ(run("check model/model.json a.csv b.csv").code, 0);
  EXPECT_EQ(run("check model/model.json b.csv a.csv").code, 1);
}

TEST_F(Check, EveryKindOfModel) {
  simulate("healthy.yaml", "whole.csv");
  std::vector<std::string> lines = testing::lines_of(bytes(path("whole.csv")));
  lines.resize(2501);
  put_lines("log.csv", lines);
  put("line.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: straight, speed: 0.6, period: 6}\nduration: 30\n"
      "sensors: {wheel_speed: 0.02, effort: 0.02, encoder_counts_per_turn: 4096}\n");
  ASSERT_EQ(run("simulate line.yaml --out line.csv").code, 0);
  const std::string bare =
      "model: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\n"
      "effort: {hold: zero_order, changes: at_samples}\n";
  const std::string declared = bytes(path("robot.yaml"));
  put("estimated.yaml", bare + "noise: estimate\n");
  put("friction.yaml", bare +
                           "friction: anisotropic\nparameters: [mass, yaw_inertia, viscous_x, viscous_y, viscous_yaw]\n"
                           "prior: {mass: [10, 30]}\nnoise: {wheel_speed: 0.02, effort: 0.02, heading: 0.003}\n"
                           "encoder_counts_per_turn: 4096\n");
  put("heavy.yaml", declared + "prior: {mass: [40, 60]}\n");
  const std::vector<std::tuple<std::string, std::string, std::string>> cases = {
      {"log.csv", "estimated.yaml", "done"},
      {"log.csv", "friction.yaml", "done"},
      {"line.csv", "robot.yaml", "partial"},
      {"line.csv", "estimated.yaml", "partial"},
      {"log.csv", "heavy.yaml", "empty"}};
  for (const auto& [log, robot, status] : cases) {
    const Outcome commissioned = run(fmt::format("commission {} --robot {} --out model --quiet", log, robot));
    ASSERT_EQ(commissioned.code, status == "empty" ? 1 : 0) << commissioned.err;
    EXPECT_EQ(read_json(path("model/model.json")).at("status"), status) << robot;
    const Outcome outcome = run(fmt::format("check model/model.json {} --out result", log));
    EXPECT_EQ(outcome.code, 0) << log << " " << robot << "\n" << outcome.out << outcome.err;
    if (has_validator()) {
      EXPECT_EQ(misfit("check.schema.json", "result/check.json"), "");
      EXPECT_EQ(misfit("model.schema.json", "model/model.json"), "");
    }
  }
  // The last is a contradiction: its certificate is checked as every other.
  EXPECT_THAT(run("check model/model.json log.csv").out, HasSubstr("proved: no parameters explain"));
  Json model = read_json(path("model/model.json"));
  model["feasible_set"]["contradiction"].erase(0);
  files::write_json(path("changed.json"), model);
  const Outcome less = run("check changed.json log.csv");
  EXPECT_EQ(less.code, 1);
  EXPECT_THAT(less.out, HasSubstr("that no parameters explain the log is not proved"));
}

TEST_F(Check, BadInput) {
  commission_shipped();
  const auto message = [&](const std::function<void(Json&)>& change) {
    const Outcome outcome = changed(change);
    EXPECT_EQ(outcome.code, 2) << outcome.out;
    EXPECT_THAT(outcome.out, IsEmpty());
    return outcome.err;
  };
  EXPECT_THAT(message([](Json& m) { m["noise"].erase("motion"); }),
              AllOf(HasSubstr("changed.json: /noise"), HasSubstr("before models carried certificates")));
  EXPECT_THAT(message([](Json& m) { proof(m, 0, "lower")[0].erase("multiplier"); }),
              HasSubstr("changed.json: /parameters/0/binding_samples/lower/0: no member 'multiplier'"));
  EXPECT_THAT(message([](Json& m) { proof(m, 0, "lower")[0]["multiplier"] = "much"; }), HasSubstr("a number"));
  EXPECT_THAT(message([](Json& m) { proof(m, 0, "lower")[0]["output"] = "left"; }), HasSubstr("a name of the robot"));
  EXPECT_THAT(message([](Json& m) { m["feasible_set"]["origin"].erase(0); }), HasSubstr("/feasible_set/origin"));
  EXPECT_THAT(message([](Json& m) { m["noise"]["outputs"][0]["learning"] = -1.0; }), HasSubstr("bounds >= 0"));
  EXPECT_THAT(message([](Json& m) { m["parameters"].erase(0); }), HasSubstr("/parameters"));
  EXPECT_THAT(message([](Json& m) { m["schema"] = "wheelwright/gap/1"; }), HasSubstr("expected a model"));
  EXPECT_THAT(run("check no.json " + shipped()).err, HasSubstr("no.json: no such file"));
  EXPECT_THAT(run("check model/model.json no.csv").err, HasSubstr("no.csv: no such file"));
  EXPECT_EQ(run("check model/model.json").code, 2);
  std::vector<std::string> lines = healthy_lines();
  lines.front() = "t,angle_1,angle_2,omega_r,omega_l,tau_r,tau_l";
  put_lines("renamed.csv", lines);
  EXPECT_EQ(run("check model/model.json renamed.csv").code, 2);
  EXPECT_EQ(run("check model/model.json renamed.csv --map phi_r=angle_1 --map phi_l=angle_2").code, 0);
}

// A detector needs no certificate: a model that was written before there were any is read as ever.
TEST_F(Check, AModelWithoutCertificatesStillDetects) {
  commission_shipped();
  Json model = read_json(path("model/model.json"));
  model["noise"].erase("motion");
  for (const std::string key : {"prior", "sign_parts", "convexified", "dropped"}) {
    model["feasible_set"].erase(key);
  }
  for (Json& parameter : model["parameters"]) {
    for (Json& side : parameter["binding_samples"]) {
      for (Json& row : side) {
        row.erase("multiplier");
      }
    }
  }
  files::write_json(path("old.json"), model);
  if (has_validator()) {
    EXPECT_EQ(misfit("model.schema.json", "old.json"), "");
  }
  EXPECT_EQ(run("detect " + shipped() + " --model old.json").code, 0);
  EXPECT_EQ(run("check old.json " + shipped()).code, 2);
}

}  // namespace
}  // namespace wheelwright::app::check_test
