// SPDX-License-Identifier: Apache-2.0
// `detect --residual d2`: constant thresholds of the model, as a user has them.
#include <cmath>
#include <cstdlib>
#include <map>

#include "tests/app/program.hpp"

namespace wheelwright::app::constant_threshold_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;

class ConstantThresholds : public testing::ProgramTest {
 protected:
  /// Columns of a CSV file.
  std::map<std::string, std::vector<double>> columns(const std::string& file) const {
    const std::vector<std::string> lines = testing::lines_of(bytes(path(file)));
    std::vector<std::string> names;
    std::map<std::string, std::vector<double>> out;
    for (std::size_t k = 0; k < lines.size(); ++k) {
      std::istringstream fields(lines[k]);
      std::string field;
      for (std::size_t c = 0; std::getline(fields, field, ','); ++c) {
        if (k == 0) {
          names.push_back(field);
        } else {
          out[names.at(c)].push_back(std::strtod(field.c_str(), nullptr));
        }
      }
    }
    return out;
  }
};

TEST_F(ConstantThresholds, AreLearntAndDecideWithoutGuarantee) {
  commission_shipped();
  const Json model = files::read_json(path("model/model.json"));
  const Json& learnt = model.at("detector").at("constant_thresholds");
  EXPECT_GE(learnt.at("blocks"), 10);
  EXPECT_EQ(learnt.at("refuted"), false);
  EXPECT_NEAR(learnt.at("false_alarms").get<double>(), 2.0 / (learnt.at("blocks").get<double>() + 1.0), 1e-12);
  simulate("fault.yaml", "fault.csv");

  const Outcome d1 = run("detect fault.csv --model model/model.json --json --series one.csv");
  const Outcome same = run("detect fault.csv --model model/model.json --residual d1 --json");
  EXPECT_EQ(d1.code, 1);
  EXPECT_EQ(d1.out, same.out) << "d1 is what decides where nothing is said";

  const Outcome d2 = run("detect fault.csv --model model/model.json --residual d2 --out found --json --series two.csv");
  EXPECT_EQ(d2.code, 1) << d2.err;
  const Json found = Json::parse(d2.out);
  EXPECT_EQ(found.at("residual"), "d2");
  EXPECT_EQ(found.at("warrant"), "experiment");
  EXPECT_EQ(found.at("constant_thresholds"), learnt);
  EXPECT_FALSE(found.contains("incidents")) << "isolation stands on bounds";
  EXPECT_FALSE(found.contains("at_risk"));
  EXPECT_FALSE(found.contains("other_parameters"));
  ASSERT_FALSE(found.at("events").empty());
  for (const Json& event : found.at("events")) {
    EXPECT_FALSE(event.contains("isolation"));
    double mu = 0.0;
    for (const Json& output : learnt.at("outputs")) {
      mu = output.at("output") == event.at("output") ? output.at("value").get<double>() : mu;
    }
    EXPECT_NEAR(event.at("peak_ratio").get<double>(), std::abs(event.at("peak_residual").get<double>()) / mu, 1e-9);
  }
  if (has_validator()) {
    put("said.json", d2.out);
    EXPECT_EQ(misfit("detection.schema.json", "said.json"), "");
    EXPECT_EQ(misfit("model.schema.json", "model/model.json"), "");
  }
  const std::string page = bytes(path("found/report.html"));
  EXPECT_THAT(page, AllOf(HasSubstr("Constant thresholds"), HasSubstr("without guarantee"),
                          Not(HasSubstr("What it can be")), Not(HasSubstr("no admissible noise explains"))));
  const Outcome words = run("detect fault.csv --model model/model.json --residual d2");
  EXPECT_THAT(words.out, AllOf(HasSubstr("by experiment, without guarantee"), Not(HasSubstr("incident"))));

  // (35) and (39), row by row.
  const auto one = columns("one.csv"), two = columns("two.csv");
  EXPECT_FALSE(two.contains("d1_sum"));
  std::size_t outside = 0;
  for (const Json& output : learnt.at("outputs")) {
    const std::string name = output.at("output");
    const double mu = output.at("value");
    const auto& residual = one.at("residual_" + name);
    ASSERT_EQ(two.at("residual_" + name), residual);
    for (std::size_t k = 0; k < residual.size(); ++k) {
      const bool left = residual[k] < one.at("lower_" + name)[k] || residual[k] > one.at("upper_" + name)[k];
      ASSERT_EQ(one.at("d1_" + name)[k], left ? std::abs(residual[k]) : 0.0);
      ASSERT_EQ(one.at("d2_" + name)[k], std::abs(residual[k]) > mu ? std::abs(residual[k]) : 0.0);
      ASSERT_EQ(two.at("d2_" + name)[k], one.at("d2_" + name)[k]);
      outside += one.at("d2_" + name)[k] > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(outside, 100U);
}

TEST_F(ConstantThresholds, DecideOnRowsAsTheyCome) {
  commission_shipped();
  simulate("fault.yaml", "fault.csv");
  const Json found = Json::parse(run("detect fault.csv --model model/model.json --residual d2 --json").out);
  const Outcome followed =
      run("detect --follow --model model/model.json --residual d2 --json --out watch", path("fault.csv"));
  EXPECT_EQ(followed.code, 1) << followed.err;
  const std::vector<std::string> lines = testing::lines_of(followed.out);
  ASSERT_EQ(lines.size(), found.at("events").size()) << "events alone: no incidents, no sums";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Json event = Json::parse(lines[k]);
    EXPECT_EQ(event.at("output"), found.at("events")[k].at("output"));
    EXPECT_EQ(event.at("alarm"), found.at("events")[k].at("alarm"));
  }
  const Json header = Json::parse(testing::lines_of(bytes(path("watch/events.jsonl"))).front());
  EXPECT_EQ(header.at("residual"), "d2");
  EXPECT_EQ(header.at("warrant"), "experiment");
}

TEST_F(ConstantThresholds, AreThoseThatTheRobotFileStates) {
  put("robot.yaml", bytes(path("robot.yaml")) + "\nthresholds: {sum: 1000, difference: 1000}\n");
  commission_shipped();
  simulate("fault.yaml", "fault.csv");
  EXPECT_EQ(run("detect fault.csv --model model/model.json").code, 1) << "D1 does not ask for them";
  const Outcome d2 = run("detect fault.csv --model model/model.json --residual d2");
  EXPECT_EQ(d2.code, 0) << d2.out;
  EXPECT_THAT(d2.out, HasSubstr("as the robot file states them, without guarantee"));
}

TEST_F(ConstantThresholds, WithoutThemD2IsRefused) {
  commission_shipped();
  Json model = files::read_json(path("model/model.json"));
  model.at("detector").erase("constant_thresholds");
  files::write_json(path("old.json"), model);
  simulate("fault.yaml", "fault.csv");
  EXPECT_EQ(run("detect fault.csv --model old.json").code, 1) << "a model from before there were any";
  const Outcome refused = run("detect fault.csv --model old.json --residual d2");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("--residual d2"), HasSubstr("old.json"), HasSubstr("expected")));
  EXPECT_EQ(run("detect fault.csv --model model/model.json --residual d3").code, 2);
}

TEST_F(ConstantThresholds, AreExported) {
  commission_shipped();
  const Outcome text = run("export model/model.json --language c --residual d2");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("thresholds constant, by experiment, without guarantee"));
  const Outcome as_json = run("export model/model.json --language c --residual d2 --json");
  const Json said = Json::parse(as_json.out);
  EXPECT_EQ(said.at("residual"), "d2");
  EXPECT_EQ(said.at("warrant"), "experiment");
  if (has_validator()) {
    put("said.json", as_json.out);
    EXPECT_EQ(misfit("export.schema.json", "said.json"), "");
  }
}

}  // namespace
}  // namespace wheelwright::app::constant_threshold_test
