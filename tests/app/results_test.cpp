// SPDX-License-Identifier: Apache-2.0
// Results: the truth inside its bounds, the same digits each time, batch and stream of one mind, and files that fit
// their schemas.
#include <algorithm>
#include <cmath>

#include "tests/app/program.hpp"

namespace wheelwright::app::results_test {

using files::read_json;

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;

class Results : public testing::ProgramTest {
 protected:
  std::string shipped() const { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }

  /// What two detections of one log must agree on, event by event: only a finished event has an end and a peak.
  // Events of a stream, a line each, and the times and sums of those at a stated risk.
  static std::pair<Json, Json> streamed(const std::string& lines) {
    Json events = Json::array(), at_risk = Json::array();
    for (const std::string& line : testing::lines_of(lines)) {
      const Json event = Json::parse(line);
      if (event.contains("at_risk")) {
        at_risk.push_back(event.at("at_risk"));
      } else if (!event.contains("incident")) {
        events.push_back(event);
      }
    }
    return {events, sums_of(at_risk)};
  }
  static Json sums_of(const Json& events) {
    Json sums = Json::array();
    for (const Json& e : events) {
      sums.push_back({e.at("alarm"), e.at("weight"), e.at("scale")});
    }
    return sums;
  }
  static Json alarms_of(const Json& events) {
    Json alarms = Json::array();
    for (const Json& e : events) {
      alarms.push_back({e.at("output"), e.at("start"), e.at("alarm"), e.at("start_row")});
    }
    return alarms;
  }
};

TEST_F(Results, ShippedLogGivesTheTruthBetweenItsBounds) {
  commission_shipped();
  const Json physical = read_json(path("model/model.json")).at("physical");
  const std::vector<std::pair<std::string, double>> truth = {
      {"mass", 21.0}, {"yaw_inertia", 0.9}, {"viscous_linear", 4.0}, {"viscous_yaw", 0.5}};  // scenarios/shipped.yaml
  for (const auto& [name, value] : truth) {
    EXPECT_LE(physical.at(name).at("lower").get<double>(), value) << name;
    EXPECT_GE(physical.at(name).at("upper").get<double>(), value) << name;
  }
  EXPECT_TRUE(std::filesystem::exists(path("model/report.html")));
}

TEST_F(Results, SameInputSameBytes) {
  for (const std::string options : {"--out a", "--out b", "--out c --threads 2", "--out d --threads 1 --seed 9"}) {
    ASSERT_EQ(run("commission " + shipped() + " --robot robot.yaml --quiet " + options).code, 0);
  }
  const std::string first = bytes(path("a/model.json"));
  EXPECT_FALSE(first.empty());
  for (const std::string other : {"b", "c", "d"}) {
    EXPECT_EQ(bytes(path(other) / "model.json"), first) << other;
  }
}

TEST_F(Results, PackingDoesNotMatter) {
  put_lines("plain.csv", healthy_lines());
  ASSERT_EQ(run("commission plain.csv --robot robot.yaml --quiet --out plain").code, 0);
  commission_shipped();
  Json plain = read_json(path("plain/model.json")), packed = read_json(path("model/model.json"));
  EXPECT_NE(plain.at("data").at("files"), packed.at("data").at("files"));
  plain.at("data").erase("files");
  packed.at("data").erase("files");
  EXPECT_EQ(plain, packed);
}

TEST_F(Results, ColumnNamesDoNotMatter) {
  std::vector<std::string> lines = healthy_lines();
  lines.front() = "t,angle_1,angle_2,omega_r,omega_l,tau_r,tau_l";
  put_lines("renamed.csv", lines);
  ASSERT_EQ(
      run("commission renamed.csv --robot robot.yaml --quiet --out renamed --map phi_r=angle_1 --map phi_l=angle_2")
          .code,
      0);
  commission_shipped();
  EXPECT_EQ(read_json(path("renamed/model.json")).at("parameters"),
            read_json(path("model/model.json")).at("parameters"));
}

TEST_F(Results, FollowTellsWhatBatchTells) {
  commission_shipped();
  simulate("fault.yaml", "fault.csv");
  for (const std::string options : {"", " --persistence 3/5", " --set box --test symmetric"}) {
    const Outcome batch = run("detect fault.csv --model model/model.json --json" + options);
    const Outcome stream = run("detect --follow --model model/model.json --json" + options, path("fault.csv"));
    EXPECT_EQ(batch.code, 1);
    EXPECT_EQ(stream.code, 1);
    const auto [events, at_risk] = streamed(stream.out);
    EXPECT_FALSE(events.empty());
    EXPECT_FALSE(at_risk.empty());
    EXPECT_EQ(alarms_of(events), alarms_of(Json::parse(batch.out).at("events"))) << options;
    EXPECT_EQ(at_risk, sums_of(Json::parse(batch.out).at("at_risk").at("events"))) << options;
  }
}

TEST_F(Results, OneFaultIsOneIncidentAndOneSentence) {
  commission_shipped();
  simulate("fault.yaml", "fault.csv");
  const Outcome batch = run("detect fault.csv --model model/model.json --json --out found");
  const Json result = Json::parse(batch.out);
  if (has_validator()) {
    EXPECT_EQ(misfit("detection.schema.json", "found/detection.json"), "");
  }
  EXPECT_GT(result.at("events").size(), 8u);
  ASSERT_EQ(result.at("incidents").size(), 1u);
  const Json& incident = result.at("incidents").at(0);
  EXPECT_EQ(incident.at("events"), result.at("events").size());
  // The left tyre loses 2 cm of 9.75 cm between 30 and 32 s.
  const Json& likeliest = incident.at("candidates").at(0);
  EXPECT_EQ(likeliest.at("fault"), "wheel_radius_left");
  EXPECT_LE(likeliest.at("magnitude").at(0), -0.205);
  EXPECT_GE(likeliest.at("magnitude").at(1), -0.206);
  // It takes two seconds to come: it is told as what grew, not as a step with an onset.
  EXPECT_EQ(likeliest.at("course"), "growing");
  EXPECT_NEAR(likeliest.at("guess").get<double>(), -0.205, 0.01);
  EXPECT_TRUE(
      incident.at("sentence").get<std::string>().starts_with("the left wheel's radius changes, a fault that grew"))
      << incident.at("sentence");
  EXPECT_THAT(incident.at("sentence").get<std::string>(),
              HasSubstr("whether it is a step or not: present no later than"));
  // It grows smoothly over these two seconds: what is said of its size over time is true at every instant.
  const auto truth = [](double t) {
    return -0.02 / 0.0975 * 0.5 * (1.0 - std::cos(std::acos(-1.0) * std::clamp((t - 30.0) / 2.0, 0.0, 1.0)));
  };
  bool sized = false;
  for (const Json& size : incident.at("sizes")) {
    if (size.at("fault") == "wheel_radius_left") {
      sized = true;
      EXPECT_FALSE(size.at("growing_excluded").get<bool>());
      for (const Json& at : size.at("growing")) {
        const double t = at.at("t");
        EXPECT_LE(at.at("lower").get<double>(), truth(t)) << t;
        EXPECT_GE(at.at("upper").get<double>(), truth(t)) << t;
      }
      EXPECT_LT(size.at("growing").back().at("upper").get<double>(), -0.1);
    }
  }
  EXPECT_TRUE(sized);
  std::vector<std::string> changes;
  for (const std::string& line :
       testing::lines_of(run("detect --follow --model model/model.json --json", path("fault.csv")).out)) {
    const Json told = Json::parse(line);
    if (told.contains("incident")) {
      changes.push_back(told.at("incident").at("change"));
    }
  }
  ASSERT_FALSE(changes.empty());
  EXPECT_EQ(changes.front(), "opened");
  EXPECT_EQ(changes.back(), "closed");
  EXPECT_EQ(std::count(changes.begin(), changes.end(), "opened"), 1);
}

TEST_F(Results, FollowTellsWhatBatchTellsOfADamagedLog) {
  commission_shipped();
  simulate("fault.yaml", "whole.csv");
  std::vector<std::string> lines = testing::lines_of(bytes(path("whole.csv")));
  lines.at(500) = lines.at(499);                             // a repeated row
  lines.at(700).replace(0, lines.at(700).find(','), "nan");  // a missing time
  lines.erase(lines.begin() + 3500, lines.begin() + 3600);   // a gap of a second
  put_lines("fault.csv", lines);
  put("fault.csv", bytes(path("fault.csv")) + lines.back().substr(0, lines.back().rfind(',')));  // a last line cut off
  const Outcome batch = run("detect fault.csv --model model/model.json --json");
  const Outcome stream = run("detect --follow --model model/model.json --json", path("fault.csv"));
  const auto [events, at_risk] = streamed(stream.out);
  EXPECT_EQ(batch.code, 1);
  EXPECT_EQ(stream.code, 1);
  EXPECT_EQ(alarms_of(events), alarms_of(Json::parse(batch.out).at("events")));
  EXPECT_EQ(at_risk, sums_of(Json::parse(batch.out).at("at_risk").at("events")));
}

TEST_F(Results, PersistenceOnTheCommandLineGoesBeforeTheModels) {
  simulate("fault.yaml", "fault.csv");
  ASSERT_EQ(run("commission " + shipped() + " --robot robot.yaml --persistence 40/40 --out patient").code, 0);
  commission_shipped();
  const auto first_alarm = [&](const std::string& arguments) {
    return Json::parse(run("detect fault.csv --json " + arguments).out).at("events").at(0).at("alarm").get<double>();
  };
  const double at_once = first_alarm("--model model/model.json");
  const double late = first_alarm("--model patient/model.json");
  EXPECT_GE(late, at_once + 0.389);  // the fortieth instant outside, at 100 Hz
  EXPECT_EQ(first_alarm("--model patient/model.json --persistence 1/1"), at_once);
  EXPECT_EQ(first_alarm("--model model/model.json --persistence 40/40"), late);
}

TEST_F(Results, SeveralLogsAreTakenTogether) {
  simulate("healthy.yaml", "more.csv");
  const Outcome outcome = run("commission " + shipped() + " more.csv --robot robot.yaml --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json data = Json::parse(outcome.out).at("data");
  EXPECT_EQ(data.at("files").size(), 2u);
  EXPECT_EQ(data.at("rows"), 12001 + 6001);
  EXPECT_EQ(data.at("segments"), 2);
}

// Held commands read as if they were measured are half a step early: two holds would give two disjoint sets.
TEST_F(Results, AContradictedLogLeavesNoModelThatADetectorBelieves) {
  put("measured.yaml",
      "model: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\nnoise: estimate\n"
      "effort: {kind: torque, hold: first_order}\n");
  const Outcome outcome = run("commission " + shipped() + " --robot measured.yaml --out late");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("before the motion"));
  EXPECT_THAT(outcome.out, HasSubstr("hold: zero_order"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("guaranteed interval")));
  const Json model = read_json(path("late/model.json"));
  EXPECT_EQ(model.at("status"), "contradicted");
  EXPECT_EQ(model.at("contradictions").at(0).at("id"), "effort_timing");
  EXPECT_FALSE(model.contains("detector"));
  if (has_validator()) {
    EXPECT_EQ(misfit("model.schema.json", "late/model.json"), "");
  }
  const Outcome refused = run("detect " + shipped() + " --model late/model.json");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("holds no model"));
}

// One short push in half a minute of standing: every parameter shows, and held-out driving shows no fault.
TEST_F(Results, ADriveThatTeachesLittleIsNotPraised) {
  std::vector<std::string> table = {"t,command_r,command_l"};
  for (int k = 0; k <= 300; ++k) {
    const double t = 0.1 * k, push = t > 2.0 && t < 4.0 ? 5.0 * std::pow(std::sin(1.5707963 * (t - 2.0)), 2) : 0.0;
    const double turn = t > 5.0 && t < 7.0 ? 3.0 * std::pow(std::sin(1.5707963 * (t - 5.0)), 2) : 0.0;
    table.push_back(fmt::format("{:.1f},{:.6f},{:.6f}", t, push + turn, push - turn));
  }
  put_lines("table.csv", table);
  put("push.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: table, file: table.csv}\nduration: 30\n"
      "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02, encoder_counts_per_turn: 4096, log: [angles]}\n");
  ASSERT_EQ(run("simulate push.yaml --out push.csv --quiet").code, 0);
  const Outcome outcome = run("commission push.csv --robot robot.yaml --out push");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json model = read_json(path("push/model.json"));
  EXPECT_EQ(model.at("status"), "done");
  const std::string message = model.at("message");
  EXPECT_THAT(message, AllOf(HasSubstr("little was learned"), HasSubstr("design --for bounds")));
  EXPECT_THAT(outcome.out, HasSubstr(message));
  EXPECT_EQ(model.at("little_learned").at("remedies").empty(), false);
  EXPECT_THAT(bytes(path("push/report.html")), HasSubstr("Little was learned"));
}

// Time in ms, rows six times sparser than the model's, and a log that is over before the filter has settled.
TEST_F(Results, ALogOfWhichNothingIsDecidedIsAnAnswer) {
  commission_shipped();
  const std::vector<std::string> lines = healthy_lines();
  std::vector<std::string> in_ms = {lines[0]}, sparse = {lines[0]};
  std::vector<std::string> brief(lines.begin() + 3000, lines.begin() + 3060);  // in motion
  brief.insert(brief.begin(), lines[0]);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    const std::size_t comma = lines[k].find(',');
    in_ms.push_back(fmt::format("{:.10g}", 1e3 * std::stod(lines[k].substr(0, comma))) + lines[k].substr(comma));
    if (k % 6 == 0) {
      sparse.push_back(lines[k]);
    }
  }
  put_lines("ms.csv", in_ms);
  put_lines("sparse.csv", sparse);
  put_lines("brief.csv", brief);
  const Outcome follow_ms = run("detect --follow --model model/model.json", "ms.csv");
  EXPECT_EQ(follow_ms.code, 2);
  EXPECT_THAT(follow_ms.err, HasSubstr("is their time in ms?"));
  const Outcome follow_sparse = run("detect --follow --model model/model.json", "sparse.csv");
  EXPECT_EQ(follow_sparse.code, 2);
  EXPECT_THAT(follow_sparse.err, HasSubstr("6 times as far"));
  const Outcome ms = run("detect ms.csv --model model/model.json --out ms --json");
  if (Json::parse(ms.out).at("instants") == 0) {
    EXPECT_EQ(ms.code, 2);
    EXPECT_THAT(ms.err, HasSubstr("is their time in ms?"));
  }
  const Outcome too_short = run("detect brief.csv --model model/model.json --out brief");
  EXPECT_EQ(too_short.code, 2);
  EXPECT_THAT(too_short.err, HasSubstr("no instant was decided"));
  EXPECT_THAT(read_json(path("brief/detection.json")).at("undecided").get<std::string>(), HasSubstr("too few"));
  if (has_validator()) {
    EXPECT_EQ(misfit("detection.schema.json", "brief/detection.json"), "");
  }
}

TEST_F(Results, FitTheirSchemas) {
  if (testing_support::skip_unless(has_validator(), "python3-jsonschema is not installed")) {
    return;
  }
  commission_shipped();
  EXPECT_EQ(misfit("model.schema.json", "model/model.json"), "");

  put("line.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: straight, speed: 0.6, period: 6}\nduration: 30\n"
      "sensors: {wheel_speed: 0.02, effort: 0.02, encoder_counts_per_turn: 4096}\n");
  ASSERT_EQ(run("simulate line.yaml --out line.csv").code, 0);
  EXPECT_EQ(run("commission line.csv --robot robot.yaml --out partial").code, 0);
  EXPECT_EQ(read_json(path("partial/model.json")).at("status"), "partial");
  EXPECT_EQ(misfit("model.schema.json", "partial/model.json"), "");

  put("estimated.yaml",
      "model: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\nnoise: estimate\n"
      "effort: {kind: torque, hold: zero_order}\n");
  EXPECT_EQ(run("commission line.csv --robot estimated.yaml --out estimated").code, 0);
  EXPECT_EQ(misfit("model.schema.json", "estimated/model.json"), "");

  put("heavy.yaml", bytes(path("robot.yaml")) + "prior: {mass: [40, 60]}\n");
  EXPECT_EQ(run("commission line.csv --robot heavy.yaml --out empty").code, 1);
  EXPECT_EQ(read_json(path("empty/model.json")).at("status"), "empty");
  EXPECT_EQ(misfit("model.schema.json", "empty/model.json"), "");

  std::string still = "t,phi_r,phi_l,tau_r,tau_l\n";
  for (int k = 0; k < 2000; ++k) {
    still += std::to_string(0.01 * k) + ",0,0,0,0\n";
  }
  put("still.csv", still);
  EXPECT_EQ(run("commission still.csv --robot robot.yaml --out nothing").code, 1);
  EXPECT_EQ(read_json(path("nothing/model.json")).at("status"), "nothing");
  EXPECT_EQ(misfit("model.schema.json", "nothing/model.json"), "");
  EXPECT_THAT(run("detect line.csv --model nothing/model.json").err, HasSubstr("nothing/model.json: holds no model"));

  simulate("fault.yaml", "fault.csv");
  for (const std::string log : {"fault.csv", "line.csv", "still.csv"}) {
    (void)run("detect " + log + " --model model/model.json --out " + log + ".result");
    EXPECT_EQ(misfit("detection.schema.json", log + ".result/detection.json"), "") << log;
  }
}

TEST_F(Results, SchemasRefuseWhatIsNotThere) {
  if (testing_support::skip_unless(has_validator(), "python3-jsonschema is not installed")) {
    return;
  }
  commission_shipped();
  Json model = read_json(path("model/model.json"));
  const auto refused = [&](const std::string& pointer, const Json& value) {
    Json changed = model;
    changed[Json::json_pointer(pointer)] = value;
    files::write_json(path("changed.json"), changed);
    return misfit("model.schema.json", "changed.json") != "";
  };
  EXPECT_TRUE(refused("/schema", "wheelwright/model/2"));
  EXPECT_TRUE(refused("/unheard_of", 1));
  EXPECT_TRUE(refused("/parameters/0/lower", "low"));
  EXPECT_TRUE(refused("/parameters/0/excitation", "great"));
  EXPECT_TRUE(refused("/robot/wheel_radius", -1));
  EXPECT_TRUE(refused("/detector/persistence/n", 65));
  EXPECT_TRUE(refused("/status", "empty")) << "a detector where there is no model";
  model.erase("feasible_set");
  EXPECT_TRUE(refused("/schema", "wheelwright/model/1")) << "a missing key";
}

}  // namespace
}  // namespace wheelwright::app::results_test
