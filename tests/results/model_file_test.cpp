// SPDX-License-Identifier: Apache-2.0
// model.json gives back the detector that was commissioned, bit for bit, and refuses what is not one.
#include <bit>
#include <cstdint>
#include <memory>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "detector/detector.hpp"
#include "detector/detector_options.hpp"
#include "detector/online_model.hpp"
#include "model/sim/simulation.hpp"
#include "results/model_file.hpp"
#include "results/scenario_file.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::results::model_file_test {

using robots::model_from_json;

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Scenario scenario_of(const std::string& trajectory, double duration, const std::string& robot_more,
                     const std::string& sensors) {
  return parse_scenario(
      "robot: {model: differential_drive, wheel_radius: 0.0975, track_width: 0.381, "
      "encoder_counts_per_turn: 4096" +
          robot_more +
          "}\n"
          "parameters: {mass: 21, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}\n"
          "trajectory: {kind: " +
          trajectory +
          ", speed: 0.6, yaw_rate: 1.2, period: 6}\n"
          "duration: " +
          std::to_string(duration) + "\nsensors: {" + sensors + "}\n",
      "scenario");
}

constexpr const char* kDeclared = ", noise: {wheel_speed: 0.02, effort: 0.02, heading: 0.003}";
constexpr const char* kSensors = "wheel_speed: 0.02, effort: 0.02, heading: 0.003, encoder_counts_per_turn: 4096";

Commissioning commissioned(const Scenario& scenario) {
  Simulation log(scenario);
  commission::CommissionOptions options;
  options.persistence = {2, 3};
  return commission_robot(log, scenario.robot, options);
}

/// The bits of all numbers and flags of all decisions along `log`.
std::vector<std::uint64_t> decisions(const OnlineModel& model, const LogTable& log, detector::DetectorOptions options) {
  Detector detector = make_detector(model, options);
  std::vector<std::uint64_t> bits;
  std::vector<double> sample;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    sample.clear();
    for (const std::string& name : model.measurement.columns()) {
      sample.push_back(log.column(name)[k]);
    }
    const Decision& decision = detector.step(log.t[k], sample);
    bits.push_back(decision.valid ? 1 : 0);
    for (const detector::ChannelDecision& c : decision.channels) {
      for (const double value : {c.residual, c.predicted, c.threshold.lower, c.threshold.upper, c.dead_zone}) {
        bits.push_back(std::bit_cast<std::uint64_t>(value));
      }
      bits.push_back((c.outside ? 2u : 0u) + (c.alarm ? 1u : 0u));
    }
  }
  return bits;
}

void expect_same_detector(const Scenario& scenario) {
  const Commissioning result = commissioned(scenario);
  ASSERT_FALSE(result.model.facets.empty()) << result.message;
  const std::string text = files::json_text(to_json(result, logs::LogReport{}, "test"));
  const OnlineModel back = model_from_json(files::parse_json(text, "model.json"), "model.json");

  Scenario faulty = scenario;
  faulty.seed = 7;
  faulty.faults = {{model::Fault::Kind::wheel_radius, -0.03, {.onset = 0.5 * scenario.duration}}};
  const LogTable log = sim::simulate(faulty);
  for (const detector::ParameterSetKind set : {detector::ParameterSetKind::polytope, detector::ParameterSetKind::box}) {
    detector::DetectorOptions options;
    options.set = set;
    EXPECT_EQ(decisions(result.model, log, options), decisions(back, log, options));
  }
}

TEST(ModelFile, GivesBackTheDetectorOnAngles) {
  expect_same_detector(scenario_of("commissioning", 40.0, kDeclared, kSensors));
}

TEST(ModelFile, GivesBackTheDetectorOfThePaper) {
  expect_same_detector(scenario_of("commissioning", 40.0, std::string(kDeclared) + ", filter: {order: 1, beta: 8}",
                                   std::string(kSensors) + ", log: [speeds]"));
}

TEST(ModelFile, GivesBackTheDetectorOnCountDifferences) {
  expect_same_detector(scenario_of("commissioning", 40.0, ", noise: {effort: 0.02}",
                                   std::string(kSensors) + ", sampling: interval, log: [speeds]"));
}

TEST(ModelFile, GivesBackTheDetectorWithEstimatedNoise) {
  expect_same_detector(scenario_of("multi_sine", 40.0, "", kSensors));
}

TEST(ModelFile, GivesBackTheDetectorOfAPartialModel) {
  const Scenario scenario = scenario_of("straight", 30.0, kDeclared, kSensors);
  ASSERT_EQ(commissioned(scenario).status, Commissioning::Status::partial);
  expect_same_detector(scenario);
}

TEST(ModelFile, GivesBackTheDetectorWithFrictionOfTheWorldAxes) {
  expect_same_detector(
      scenario_of("commissioning", 60.0, std::string(kDeclared) + ", friction: anisotropic", kSensors));
}

// What is checked later is what was found: bounds, proofs, facets and premises, bit for bit.
TEST(ModelFile, GivesBackTheClaimsWithTheirProofs) {
  const Commissioning result = commissioned(scenario_of("commissioning", 40.0, kDeclared, kSensors));
  const std::string text = files::json_text(to_json(result, logs::LogReport{}, "test"));
  const ModelClaims claims = claims_from_json(files::parse_json(text, "model.json"), "model.json");
  const auto expect_bounds = [](const std::vector<PublishedBound>& read,
                                const std::vector<bounds::CertifiedBound>& found) {
    ASSERT_EQ(read.size(), found.size());
    for (std::size_t j = 0; j < read.size(); ++j) {
      EXPECT_EQ(read[j].value, found[j].value);
      std::vector<bounds::WeightedRow> rows = found[j].binding;
      std::erase_if(rows, [](const bounds::WeightedRow& row) { return !(row.multiplier > 0.0); });
      ASSERT_EQ(read[j].proof.size(), rows.size());
      for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_EQ(read[j].proof[i].origin, rows[i].row.origin);
        EXPECT_EQ(read[j].proof[i].multiplier, rows[i].multiplier);
      }
    }
  };
  expect_bounds(claims.lower, result.feasible.lower);
  expect_bounds(claims.upper, result.feasible.upper);
  ASSERT_EQ(claims.facets.size(), result.model.facets.size());
  for (std::size_t k = 0; k < claims.facets.size(); ++k) {
    EXPECT_EQ(claims.facets[k].a, result.model.facets[k].a);
    EXPECT_EQ(claims.facets[k].b, result.model.facets[k].b);
    EXPECT_EQ(claims.facets[k].origin, result.model.facets[k].origin);
  }
  EXPECT_EQ(claims.hull, result.feasible.hull);
  EXPECT_EQ(claims.prior.sides, model::prior_box(result.model.robot, result.model.model).bounds);
  EXPECT_EQ(claims.set, FeasibleSet::Status::nonempty);
  for (std::size_t i = 0; i < result.noise.size(); ++i) {
    EXPECT_EQ(claims.errors.output[static_cast<Eigen::Index>(i)], result.noise[i].learning);
    EXPECT_EQ(claims.origin[i], core::NoiseOrigin::declared);
  }
  EXPECT_EQ(claims.errors.acceleration, result.model.errors.acceleration);
  EXPECT_EQ(claims.errors.speed, result.model.errors.speed);
  EXPECT_EQ(claims.rows, result.survey.rows);
}

TEST(ModelFile, GivesBackWhatItsNumbersStandOn) {
  const Commissioning declared = commissioned(scenario_of("multi_sine", 20.0, kDeclared, kSensors));
  const Commissioning learnt = commissioned(scenario_of("multi_sine", 20.0, "", kSensors));
  for (const auto& [result, warrant] :
       {std::pair(&declared, core::Warrant::guaranteed), std::pair(&learnt, core::Warrant::extrapolated)}) {
    ASSERT_EQ(result->model.warrant, warrant) << result->message;
    Json json = to_json(*result, logs::LogReport{}, "test");
    const std::string word(core::warrant_word(warrant));
    EXPECT_EQ(json.at("warrant"), word);
    for (const Json& parameter : json.at("parameters")) {
      EXPECT_EQ(parameter.at("warrant"), word);
    }
    for (const auto& quantity : json.at("physical").items()) {
      EXPECT_EQ(quantity.value().at("warrant"), word);
    }
    EXPECT_EQ(model_from_json(json, "f").warrant, warrant);
    EXPECT_EQ(model_from_json(json, "f").assumptions, result->assumptions);
    EXPECT_EQ(claims_from_json(json, "f").warrant, warrant);
    EXPECT_EQ(claims_from_json(json, "f").assumptions, result->assumptions);
    if (warrant == core::Warrant::extrapolated) {
      EXPECT_EQ(files::json_text(json).find("guarantee"), std::string::npos);
    }

    // A model from before warrants were told: what its noise says, and no assumptions.
    json.erase("warrant");
    json.erase("assumptions");
    EXPECT_EQ(model_from_json(json, "f").warrant, warrant);
    EXPECT_TRUE(model_from_json(json, "f").assumptions.empty());
    json["noise"]["mode"] = "statistical";
    EXPECT_EQ(model_from_json(json, "f").warrant,
              warrant == core::Warrant::guaranteed ? core::Warrant::statistical : core::Warrant::extrapolated);
    json.erase("noise");
    EXPECT_EQ(model_from_json(json, "f").warrant, core::Warrant::extrapolated);
  }
}

class ModelFileErrors : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    written_ = std::make_unique<Json>(
        to_json(commissioned(scenario_of("multi_sine", 20.0, kDeclared, kSensors)), logs::LogReport{}, "test"));
  }
  static void TearDownTestSuite() { written_.reset(); }

  /// The message for the model with one value changed (removed where `value` is discarded).
  static std::string message(const std::string& pointer, const Json& value) {
    Json changed = *written_;
    const Json::json_pointer place(pointer);
    if (value.is_discarded()) {
      changed.at(place.parent_pointer()).erase(place.back());
    } else {
      changed.at(place) = value;
    }
    return testing::input_error([&] { (void)model_from_json(changed, "robot7/model.json"); });
  }
  static Json nothing() { return Json(Json::value_t::discarded); }

  static std::unique_ptr<Json> written_;
};

std::unique_ptr<Json> ModelFileErrors::written_;

TEST_F(ModelFileErrors, WrongSchema) {
  for (const Json& schema : {Json("wheelwright/model/2"), Json("wheelwright/gap/1"), nothing()}) {
    EXPECT_THAT(message("/schema", schema), AllOf(HasSubstr("robot7/model.json: expected a model"),
                                                  HasSubstr("\"schema\": \"wheelwright/model/1\"")));
  }
  EXPECT_THAT(message("/schema", 1), HasSubstr("robot7/model.json: /schema: '1': expected a string"));
}

TEST_F(ModelFileErrors, EveryMissingKeyIsNamed) {
  for (const std::string parent :
       {"", "/filter", "/measurement", "/detector", "/detector/error_bounds", "/detector/persistence"}) {
    const Json object = written_->at(Json::json_pointer(parent));
    for (const auto& member : object.items()) {
      Json changed = *written_;
      changed.at(Json::json_pointer(parent)).erase(member.key());
      try {
        (void)model_from_json(changed, "robot7/model.json");
      } catch (const InputError& error) {
        const std::string what = error.what();
        EXPECT_THAT(what, AllOf(HasSubstr("robot7/model.json"),
                                ::testing::AnyOf(HasSubstr(member.key()), HasSubstr("holds no model"))));
        continue;
      }
      // What a detector does without is the record of how it came about, and the second residual.
      const std::vector<std::string> record = {
          "software", "status", "message", "noise", "parameters", "physical", "identification", "validation",    "data",
          "notes",    "delay",  "chosen",  "curve", "kinematic",  "warrant",  "assumptions",    "contradictions"};
      EXPECT_THAT(record, ::testing::Contains(member.key()));
    }
  }
}

TEST_F(ModelFileErrors, WrongTypesAndValuesAreNamed) {
  const std::vector<std::tuple<std::string, Json, std::string>> cases = {
      {"/filter/beta", "fast", R"(/filter/beta: '"fast"': expected a number)"},
      {"/filter/beta", -1.0, "/filter"},
      {"/filter/order", 3, "/filter"},
      {"/filter/order", 1.5, "/filter/order"},
      {"/filter/order", (std::uint64_t{1} << 32) + 2, "/filter/order: '4294967298': expected an integer from 0 to 2"},
      {"/measurement/nominal_step", -0.01, "/measurement/nominal_step"},
      {"/measurement/motion", "smell", R"(/measurement/motion: '"smell"': expected one of angle)"},
      {"/measurement/motion_columns", Json::array({"phi_r"}), "/measurement"},
      {"/measurement/effort_unsigned", 1, "/measurement/effort_unsigned"},
      {"/detector/estimate", Json::array({1.0}), "/detector/estimate"},
      {"/detector/estimate/0", nullptr, "/detector/estimate"},
      {"/detector/persistence/k", -1, "/detector/persistence/k"},
      {"/detector/persistence/k", 5, "/detector/persistence"},
      {"/detector/persistence/n", (std::uint64_t{1} << 32) + 1, "/detector/persistence/n"},
      {"/detector/error_bounds/output", Json::array(), "/detector/error_bounds/output"},
      {"/detector/error_bounds/output/1", -0.1, "/detector/error_bounds/output"},
      {"/detector/error_bounds/acceleration/0", -0.1, "/detector/error_bounds/acceleration"},
      {"/detector/error_bounds/speed/0", -0.1, "/detector/error_bounds/speed"},
      {"/detector/error_bounds/speed_sample/0", -0.1, "/detector/error_bounds/speed_sample"},
      {"/detector/error_bounds/joint_sample", -0.1, "/detector/error_bounds/joint_sample"},
      {"/detector/error_bounds/heading", -0.1, "/detector/error_bounds/heading"},
      {"/feasible_set/A/0", Json::array({1.0}), "/feasible_set/A/0"},
      {"/feasible_set/b", Json::array({1.0}), "/feasible_set/b"},
      {"/feasible_set/hull", Json::array(), "/feasible_set/hull"},
      {"/feasible_set/hull/0", Json::array({2.0, 1.0}), "/feasible_set/hull/0"},
      {"/robot/wheel_radius", -1.0, "wheel_radius"},
      {"/robot", "a robot", "/robot"},
      {"/warrant", "certain", R"(/warrant: '"certain"': expected one of guaranteed, extrapolated, statistical)"},
      {"/assumptions/0/verdict", "maybe", "/assumptions/0/verdict"},
  };
  for (const auto& [pointer, value, expected] : cases) {
    EXPECT_THAT(message(pointer, value), AllOf(HasSubstr("robot7/model.json"), HasSubstr(expected))) << pointer;
  }
}

TEST_F(ModelFileErrors, ALogThatShowsNothingMakesNoModel) {
  Scenario scenario = scenario_of("multi_sine", 20.0, kDeclared, kSensors);
  scenario.trajectory.speed = scenario.trajectory.yaw_rate = 0.0;
  const Commissioning result = commissioned(scenario);
  ASSERT_EQ(result.status, Commissioning::Status::nothing);
  const Json json = to_json(result, logs::LogReport{}, "test");
  EXPECT_THAT(testing::input_error([&] { (void)model_from_json(json, "still.json"); }),
              HasSubstr("still.json: holds no model: " + result.message));
}

}  // namespace
}  // namespace wheelwright::results::model_file_test
