// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "gap/next/discrimination.hpp"
#include "gap/next_drive.hpp"
#include "results/gap_json.hpp"
#include "tests/gap/simulated_gap.hpp"
#include "tests/report/gap_example.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::results::gap_json_test {
namespace {

GapFiles files() {
  GapFiles f;
  f.robot = "robot.yaml";
  f.logs = {"real.csv"};
  f.software = "wheelwright 0.1.0";
  return f;
}

TEST(GapJson, HasTheContractsKeys) {
  const Json json = to_json(report::gap_example::explained(), files());
  for (const char* key : {"schema", "verdict", "causes", "credible_set", "confusable", "where", "shrink", "parametric",
                          "next_manoeuvre"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["schema"], "wheelwright/gap/1");
  EXPECT_EQ(json["verdict"], "explained");
  const Json& cause = json["causes"][0];
  EXPECT_EQ(cause["effect"], "coulomb");
  EXPECT_EQ(cause["parameters"]["coulomb"]["estimate"], 0.3124);
  EXPECT_EQ(cause["parameters"]["coulomb"]["unit"], "N·m");
  EXPECT_EQ(cause["share"], 0.934);
  EXPECT_EQ(json["credible_set"][0]["effects"], Json({"coulomb"}));
  EXPECT_EQ(json["confusable"][0]["effects"], Json({"coulomb", "caster_drag"}));
  EXPECT_EQ(json["shrink"]["torque_rms"]["sum"]["before"], 0.0849);
  EXPECT_TRUE(json["shrink"]["smallest_fault"]["sum"]["before"].is_null());  // no size is certain to be seen
  EXPECT_EQ(json["parametric"][0]["nominal"], 21.0);
  EXPECT_TRUE(json["next_manoeuvre"].is_null());
}

TEST(GapJson, NamesEveryVerdict) {
  EXPECT_EQ(to_json(report::gap_example::no_gap(), files())["verdict"], "no_gap");
  EXPECT_EQ(to_json(report::gap_example::ambiguous(), files())["verdict"], "ambiguous");
  EXPECT_EQ(to_json(report::gap_example::unexplained(), files())["verdict"], "unexplained");
}

TEST(GapJson, HasTheLawsOfAFamilyAndWhatWouldHaveBeenSeen) {
  const Json late = to_json(report::gap_example::late_torque(), files());
  const Json& cause = late["causes"][0];
  EXPECT_EQ(cause["effect"], "delay");
  EXPECT_EQ(cause["family"], "late_torque");
  EXPECT_EQ(cause["laws"][1]["effect"], "actuator_lag");
  EXPECT_EQ(cause["laws"][1]["parameters"]["T"]["estimate"], 0.024);
  EXPECT_EQ(late["credible_set"][1]["effects"], Json({"actuator_lag"}));
  EXPECT_EQ(late["credible_set"][1]["answer"], 0);
  EXPECT_EQ(to_json(report::gap_example::ambiguous(), files())["credible_set"][1]["answer"], 1);
  EXPECT_TRUE(late["healthy_misfit"].is_null());
  const Json none = to_json(report::gap_example::no_gap(), files());
  EXPECT_EQ(none["visible"][1],
            Json({{"effect", "payload"}, {"parameter", "mass_kg"}, {"size", 0.317}, {"unit", "kg"}}));
  EXPECT_TRUE(to_json(report::gap_example::explained(), files())["causes"][0]["family"].is_null());
}

TEST(GapJson, KeepsChannelsBandsAndFindingsInTheirOrder) {
  const Json json = to_json(report::gap_example::explained(), files());
  std::vector<std::string> regimes;
  for (const Json& entry : json["where"]) {
    regimes.push_back(entry["regime"]);
  }
  const std::vector<std::string> expected = {"all", "0.2 to 0.5 Hz", "reversal of the right wheel", "0.5 to 1 Hz",
                                             "all"};
  EXPECT_EQ(regimes, expected);
}

TEST(GapJson, SchemaNamesEveryKeyAndRequiresIt) {
  const Json schema = files::read_json(std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "results" / "gap.schema.json");
  GapFiles f = files();
  f.next_manoeuvre = NextManoeuvre{"next.csv", "Turn on the spot."};
  Diagnosis diagnosis = report::gap_example::two_causes();
  diagnosis.visible = report::gap_example::no_gap().visible;
  diagnosis.misfit = report::gap_example::misfit().misfit;
  diagnosis.causes[0].laws = report::gap_example::late_torque().causes[0].laws;
  const Json json = to_json(diagnosis, f);
  const auto same_keys = [](const Json& object, const Json& rule) {
    std::set<std::string> has, known, required;
    for (const auto& [key, value] : object.items()) {
      has.insert(key);
    }
    for (const auto& [key, value] : rule["properties"].items()) {
      known.insert(key);
    }
    for (const Json& key : rule["required"]) {
      required.insert(key);
    }
    const std::set<std::string> by_the_program = {"improved", "naive", "parameters",
                                                  "simulators"};  // of files and fits it has beside
    for (const std::string& key : known) {
      EXPECT_TRUE(has.contains(key) || by_the_program.contains(key)) << key;
    }
    for (const std::string& key : has) {
      EXPECT_TRUE(known.contains(key)) << key;
      EXPECT_TRUE(required.contains(key) || by_the_program.contains(key)) << key;
    }
    EXPECT_TRUE(std::includes(has.begin(), has.end(), required.begin(), required.end()));
  };
  same_keys(json, schema);
  const Json& properties = schema["properties"];
  for (const char* key : {"causes", "credible_set", "confusable", "where", "parametric", "contradictions", "visible"}) {
    ASSERT_FALSE(json[key].empty()) << key;
    same_keys(json[key][0], properties[key]["items"]);
  }
  same_keys(json["causes"][0]["laws"][0], properties["causes"]["items"]["properties"]["laws"]["items"]);
  same_keys(json["healthy_misfit"], properties["healthy_misfit"]);
  same_keys(json["shrink"], properties["shrink"]);
  same_keys(json["shrink"]["rollout"]["velocity_1s"], schema["definitions"]["figures"]["additionalProperties"]);
  same_keys(json["causes"][0]["parameters"]["coulomb"], schema["definitions"]["estimate"]);
  same_keys(json["next_manoeuvre"], properties["next_manoeuvre"]["anyOf"][1]);
}

using GapJsonFile = testing::ScratchTest;

// An effect can have laws with more parameters and with fewer: a plan begins from the one that was fitted.
TEST_F(GapJsonFile, RivalsKeepTheLawThatWasFitted) {
  const gap::Drive& drive = gap::gap_example::plain_drive();
  const std::vector<Effect> catalogue = gap::effect_catalogue();
  std::size_t looked_at = 0;
  for (std::size_t later = 0; later < catalogue.size(); ++later) {
    const Effect& law = catalogue[later];
    const Effect& first = *std::ranges::find(catalogue, law.name, &Effect::name);
    if (&first == &law || law.name == "coulomb" || !gap::applicability(law, drive).applies ||
        (first.parameters.size() == law.parameters.size() && first.shapes.size() == law.shapes.size())) {
      continue;
    }
    gap::NextDrive next;
    next.laws = {law, *std::ranges::find(catalogue, "coulomb", &Effect::name)};
    next.rivals = {gap::typical_rival({law.name}, next.laws, drive), gap::typical_rival({"coulomb"}, next.laws, drive)};
    Json result = to_json(Diagnosis{}, GapFiles{});
    result["credible_set"] = {{{"effects", {law.name}}}, {{"effects", {"coulomb"}}}};
    add_rivals(result, next);
    std::vector<Effect> laws = catalogue;
    gap::PlannedNoise noise;
    const std::vector<gap::Rival> read = rivals_of_gap(put("gap.json", result.dump()), laws, drive, noise);
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[0].causes[0].coefficients, next.rivals[0].causes[0].coefficients) << law.name << " " << later;
    EXPECT_EQ(read[0].causes[0].shape, next.rivals[0].causes[0].shape) << law.name << " " << later;
    EXPECT_NO_THROW(gap::validate(read[0], laws, drive)) << law.name << " " << later;
    ++looked_at;
  }
  EXPECT_GT(looked_at, 3U);
}

TEST_F(GapJsonFile, HasALinePerRowAndChannel) {
  const auto file = path("residuals.csv");
  Diagnosis d = report::gap_example::explained(1.0);
  d.series[1].after.resize(0);
  write_residuals(file, d.series);
  std::ifstream in(file);
  std::string line;
  std::size_t lines = 0, sums = 0;
  std::getline(in, line);
  EXPECT_EQ(line, "space,channel,unit,t,signal,nominal,refitted,after,floor");
  while (std::getline(in, line)) {
    ++lines;
    std::vector<std::string> fields;
    std::istringstream parts(line);
    for (std::string field; std::getline(parts, field, ',');) {
      fields.push_back(field);
    }
    ASSERT_EQ(fields.size(), 9U);
    const bool sum = fields[1] == "sum";
    EXPECT_EQ(fields[7].empty(), !sum);
    if (sum) {
      EXPECT_NEAR(std::stod(fields[6]), d.series[0].refitted[static_cast<Eigen::Index>(sums)], 1e-8);
      ++sums;
    }
  }
  EXPECT_EQ(lines, 100U);
  EXPECT_EQ(sums, 50U);
}

}  // namespace
}  // namespace wheelwright::results::gap_json_test
