// SPDX-License-Identifier: Apache-2.0
// What a model says at a stated risk is proved from its log; what is sharper than the log makes it is found and named.
#include "commission/commission.hpp"
#include "detector/detector_options.hpp"
#include "results/model_check.hpp"

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/exact_axis.hpp"
#include "tests/support/named_axes.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::results::risk_check_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing_support::ErrorLaw;
using testing_support::ExactAxis;
using testing_support::NamedAxes;
using testing_support::NamedAxis;

// A log of an axis and the model that it was commissioned to, as it is written.
struct Commissioned {
  LogTable log;
  Json model;
};

// As a robot file can say it: a position has a bound, and its errors do not average out.
Robot robot_file(const ExactAxis& axis) {
  Robot robot = robot_of(axis);
  robot.noise.position.bias.reset();
  return robot;
}

Commissioned commissioned(const ExactAxis& axis, const Robot& robot) {
  Commissioned result{drive(axis, 1), {}};
  TableSource source(result.log);
  result.model = to_json(commission_robot(source, robot), logs::LogReport{}, "test");
  return result;
}

ModelCheck check(const Commissioned& made, const Json& model) {
  const ModelClaims claims = claims_from_json(model, "model.json");
  TableSource source(made.log);
  logs::LogReport report;
  report.rows = made.log.rows();
  report.segments = 1;
  return check_model(claims, source, report);
}

std::vector<NamedAxis> worlds() {
  NamedAxes add(40.0);
  add("two_point", [](ExactAxis&) {});
  add("biased", [](ExactAxis& a) { a.bias = 0.1 * a.bound; });
  add("together", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.05;
    a.bound = 1.0;
  });
  add("feedback", [](ExactAxis& a) { a.feedback = 30.0; });
  add("uneven_steps", [](ExactAxis& a) { a.jitter = 0.3; });
  add("together_at_uneven_steps", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.05;
    a.bound = 1.0;
    a.jitter = 0.3;
  });
  add("slow_clock", [](ExactAxis& a) { a.rate = 20.0; });
  return std::move(add).all();
}

class HonestModel : public ::testing::TestWithParam<NamedAxis> {};

TEST_P(HonestModel, IsProved) {
  const Commissioned made = commissioned(GetParam().axis, robot_file(GetParam().axis));
  ASSERT_TRUE(made.model.contains("at_risk")) << made.model.at("notes");
  const ModelCheck result = check(made, made.model);
  EXPECT_THAT(result.failures, IsEmpty());
  ASSERT_TRUE(result.at_risk);
  EXPECT_EQ(result.at_risk->bounds.size(), 2 * made.model.at("parameters").size());
  for (const BoundVerdict& bound : result.at_risk->bounds) {
    EXPECT_TRUE(bound.proved) << bound.reason;
  }
  const Json& said = made.model.at("at_risk");
  EXPECT_EQ(result.at_risk->sums, said.at("sums").size());
  EXPECT_EQ(result.at_risk->facets, said.at("feasible_set").at("A").size());
  EXPECT_EQ(result.at_risk->spent, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Worlds, HonestModel, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

// One of the two ends of an interval moved inward by a share of its width.
void narrow(Json& interval, std::size_t end, double share) {
  const double lower = interval[0], upper = interval[1];
  interval[end] = end == 0 ? lower + share * (upper - lower) : upper - share * (upper - lower);
}

void scale(Json& number, double by) { number = number.get<double>() * by; }

struct Tampering {
  std::string name;
  std::function<void(Json& model, Json& at_risk)> change;
  std::string named;  // in a failure
};
void PrintTo(const Tampering& t, std::ostream* out) { *out << t.name; }

std::vector<Tampering> tamperings() {
  std::vector<Tampering> all;
  const auto add = [&](const std::string& name, const std::string& named, auto change) {
    all.push_back({name, change, named});
  };
  for (const std::size_t end : {0u, 1u}) {
    const std::string which = end == 0 ? "lower" : "upper";
    add("sharper_" + which + "_end", "inertia",
        [end](Json&, Json& r) { narrow(r["feasible_set"]["hull"][0], end, 1e-6); });
    add("published_" + which + "_end", "the interval of inertia",
        [end](Json& m, Json&) { narrow(m["parameters"][0]["at_risk"], end, 1e-6); });
    add("physical_" + which + "_end", "the interval of inertia",
        [end](Json& m, Json&) { narrow(m["physical"]["inertia"]["at_risk"], end, 1e-6); });
    add("box_" + which + "_end", "the box of inertia",
        [end](Json&, Json& r) { narrow(r["feasible_set"]["box"][0], end, 1e-6); });
  }
  add("sharper_facet", "row 0 of its set is not proved: it does not follow from", [](Json&, Json& r) {
    Json& b = r["feasible_set"]["b"][0];
    b = b.get<double>() - 1e-8 * std::abs(b.get<double>());
  });
  add("turned_facet", "row 0 of its set is not proved",
      [](Json&, Json& r) { scale(r["feasible_set"]["A"][0][0], 1.001); });
  add("facet_of_another_side", "row 0 of its set is not proved", [](Json&, Json& r) {
    Json& side = r["feasible_set"]["origin"][0]["side"];
    side = side.get<std::string>() == "upper" ? "lower" : "upper";
  });
  add("sharper_sum", "side of sum 0 is sharper", [](Json&, Json& r) { scale(r["sums"][0]["dy"], 1.0 - 1e-6); });
  add("moved_sum", "side of sum 0 is sharper", [](Json&, Json& r) {
    r["sums"][0]["y"] = r["sums"][0]["y"].get<double>() + 1e-3 * r["sums"][0]["dy"].get<double>();
  });
  add("turned_sum", "side of sum 0 is sharper", [](Json&, Json& r) { scale(r["sums"][0]["Y"][0], 1.0001); });
  add("exact_regressor", "side of sum 0 is sharper", [](Json&, Json& r) {
    for (Json& each : r["sums"][0]["dY"]) {
      each = 0.0;
    }
  });
  add("smaller_radius", "the radius of sum 0", [](Json&, Json& r) { scale(r["sums"][0]["radius"], 1.0 - 1e-6); });
  add("less_that_stays", "the straight of sum 0", [](Json&, Json& r) { scale(r["sums"][0]["straight"], 1.0 - 1e-6); });
  add("smaller_worst", "the worst of sum 0", [](Json&, Json& r) { scale(r["sums"][0]["worst"], 1.0 - 1e-6); });
  add("other_weights", "side of sum 0 is sharper", [](Json&, Json& r) { scale(r["sums"][0]["weights"][0], 1.01); });
  add("another_ellipsoid", "side of sum 0 is sharper", [](Json&, Json& r) {
    const auto now = r["sums"][0]["ellipsoid"].get<std::size_t>();
    r["sums"][0]["ellipsoid"] = now < 3 ? now + 3 : now - 3;  // of another delay
  });
  add("smaller_risk", "the risks of its 12 ellipsoids add up to 1e-09, more than the stated 1e-10",
      [](Json&, Json& r) { r["risk"] = 1e-10; });
  add("smaller_risk_of_all", "the squared_radius of ellipsoid 0", [](Json&, Json& r) {
    r["risk"] = 1e-12;
    for (Json& e : r["ellipsoids"]) {
      e["risk"] = 8e-14;
    }
  });
  add("smaller_part", "ellipsoid 1 takes 1e-11 of the risk",
      [](Json&, Json& r) { r["ellipsoids"][1]["risk"] = 1e-11; });
  add("larger_part", "the risks of its 12 ellipsoids add up to", [](Json&, Json& r) {
    Json& risk = r["ellipsoids"][2]["risk"];
    risk = risk.get<double>() * (1.0 + 1e-9);
  });
  add("smaller_ellipsoid", "the squared_radius of ellipsoid 3",
      [](Json&, Json& r) { scale(r["ellipsoids"][3]["squared_radius"], 1.0 - 1e-6); });
  add("smaller_volume", "the log_volume of ellipsoid 3",
      [](Json&, Json& r) { scale(r["ellipsoids"][3]["log_volume"], 1.0 - 1e-6); });
  add("ellipsoids_left_out", "ellipsoid", [](Json&, Json& r) {
    Json kept = Json::array();
    for (const Json& sum : r["sums"]) {
      const Json& e = r["ellipsoids"][sum["ellipsoid"].get<std::size_t>()];
      if (std::ranges::find(kept, e) == kept.end()) {
        kept.push_back(e);
      }
    }
    for (Json& sum : r["sums"]) {
      const Json& e = r["ellipsoids"][sum["ellipsoid"].get<std::size_t>()];
      sum["ellipsoid"] = static_cast<std::size_t>(std::ranges::find(kept, e) - kept.begin());
    }
    r["ellipsoids"] = kept;
  });
  add("one_ellipsoid_twice", "its ellipsoids are not one for every delay",
      [](Json&, Json& r) { r["ellipsoids"][3]["delay"] = r["ellipsoids"][2]["delay"]; });
  add("another_delay", "is sharper than the log makes it", [](Json&, Json& r) {
    for (Json& e : r["ellipsoids"]) {
      scale(e["delay"], 1.1);
    }
  });
  add("another_beginning", "is sharper than the log makes it", [](Json&, Json& r) { r["learning"] = 0.02; });
  add("no_beginning", "no sums can be taken", [](Json&, Json& r) { r["learning"] = 1.5; });
  add("smaller_bias", "errors.effort.bias is 0.0, not 0.02",
      [](Json&, Json& r) { r["errors"]["effort"]["bias"] = 0.0; });
  add("smaller_bound", "errors.effort.bound is 1.0, not 2.0",
      [](Json&, Json& r) { r["errors"]["effort"]["bound"] = 1.0; });
  add("smaller_errors_of_the_robot", "errors.effort.bound is 2.0, not 3.0",
      [](Json& m, Json&) { m["robot"]["noise"]["effort"]["bound"] = 3.0; });
  add("a_robot_without_bias", "the robot file declares no errors that average out",
      [](Json& m, Json&) { m["robot"]["noise"]["effort"] = 2.0; });
  add("other_multiplier", "inertia",
      [](Json&, Json& r) { scale(r["binding"][0]["lower"][0]["multiplier"], 1.0 - 1e-3); });
  add("negative_multiplier",
      "inertia >= ", [](Json&, Json& r) { scale(r["binding"][0]["lower"][0]["multiplier"], -1.0); });
  add("no_multipliers", "inertia >= ", [](Json&, Json& r) { r["binding"][0]["lower"] = Json::array(); });
  add("guaranteed_facet_that_is_none", "row", [](Json& m, Json& r) {
    // A facet at risk that stands on a row of the guaranteed set, which is no row of the log.
    Json& b = m["feasible_set"]["b"][0];
    b = b.get<double>() - 1e-3 * std::abs(b.get<double>());
    r["feasible_set"]["A"].push_back(m["feasible_set"]["A"][0]);
    r["feasible_set"]["b"].push_back(b);
    r["feasible_set"]["origin"].push_back({{"facet", 0}});
  });
  return all;
}

class CheckAtRisk : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ExactAxis axis;
    axis.seconds = 40.0;
    axis.bias = 0.01 * axis.bound;
    made_ = std::make_unique<Commissioned>(commissioned(axis, robot_file(axis)));
  }
  static void TearDownTestSuite() { made_.reset(); }
  static std::unique_ptr<Commissioned> made_;
};

std::unique_ptr<Commissioned> CheckAtRisk::made_;

class TamperedModel : public CheckAtRisk, public ::testing::WithParamInterface<Tampering> {};

TEST_P(TamperedModel, IsRefusedAndItIsSaidWhy) {
  ASSERT_TRUE(made_->model.contains("at_risk")) << made_->model.at("notes");
  Json model = made_->model;
  GetParam().change(model, model["at_risk"]);
  const ModelCheck result = check(*made_, model);
  ASSERT_TRUE(result.at_risk);
  EXPECT_FALSE(result.proved());
  EXPECT_THAT(result.at_risk->failures,
              ::testing::Contains(AllOf(HasSubstr("at a risk of 1e-"), HasSubstr(GetParam().named))))
      << ::testing::PrintToString(result.failures);
  const ModelClaims claims = claims_from_json(model, "model.json");
  const std::string said = risk_verdict(*result.at_risk, *claims.at_risk);
  EXPECT_THAT(said, HasSubstr("not proved"));
}

INSTANTIATE_TEST_SUITE_P(Kinds, TamperedModel, ::testing::ValuesIn(tamperings()),
                         [](const auto& each) { return each.param.name; });

// The word follows from the noise that the robot file declares and from the tests of the assumptions.
TEST_F(CheckAtRisk, BoundsAreCalledGuaranteedWhereThatFollows) {
  ASSERT_EQ(made_->model.at("warrant"), "guaranteed");
  const auto called = ::testing::Contains(HasSubstr("called guaranteed, but"));
  EXPECT_THAT(check(*made_, made_->model).failures, IsEmpty());
  const auto failures = [&](const std::function<void(Json&)>& change) {
    Json model = made_->model;
    change(model);
    return check(*made_, model).failures;
  };
  EXPECT_THAT(failures([](Json& m) {
                for (Json& sensor : m["robot"]["noise"]) {
                  sensor = "estimate";
                }
              }),
              called);
  EXPECT_THAT(failures([](Json& m) { m["robot"]["noise"]["effort"]["bound"] = 4.0; }), called);
  EXPECT_THAT(failures([](Json& m) { m["noise"]["outputs"][0]["origin"] = "estimated"; }), called);
  EXPECT_THAT(failures([](Json& m) { scale(m["noise"]["outputs"][0]["learning"], 0.5); }), called);
  for (std::size_t k = 0; k < made_->model.at("assumptions").size(); ++k) {
    const bool driving = made_->model.at("assumptions")[k].at("id") == "motion_in_driving";
    const auto said = failures([&](Json& m) { m["assumptions"][k]["verdict"] = "fails"; });
    EXPECT_THAT(said, driving ? ::testing::Matcher<const std::vector<std::string>&>(::testing::Not(called)) : called);
  }
  // What is called less than it could be is no false claim.
  EXPECT_THAT(failures([](Json& m) {
                m["warrant"] = "extrapolated";
                for (Json& p : m["parameters"]) {
                  p["warrant"] = "extrapolated";
                }
                m["assumptions"][0]["verdict"] = "fails";
              }),
              ::testing::Not(called));
}

// Narrower thresholds than the proof's noise would promise what was never proved; wider ones promise less.
TEST_F(CheckAtRisk, ADetectorWithSmallerErrorsThanTheProofIsNotProved) {
  const Json::json_pointer output("/detector/error_bounds/output/0");
  for (const double share : {0.0, 0.5, 0.999, 1.0, 1.5}) {
    Json model = made_->model;
    model[output] = share * model.at(output).get<double>();
    const auto named = ::testing::Contains(HasSubstr("detector.error_bounds.output[0]"));
    if (share < 1.0) {
      EXPECT_THAT(check(*made_, model).failures, named) << share;
    } else {
      EXPECT_THAT(check(*made_, model).failures, IsEmpty()) << share;
    }
  }
}

class WeakerModel : public TamperedModel {};

// Claims that say less than the log allows are proved as well.
TEST_P(WeakerModel, IsProved) {
  Json model = made_->model;
  GetParam().change(model, model["at_risk"]);
  EXPECT_THAT(check(*made_, model).failures, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, WeakerModel,
    ::testing::Values(
        Tampering{"wider_hull", [](Json&, Json& r) { narrow(r["feasible_set"]["hull"][0], 0, -0.1); }, {}},
        Tampering{"wider_interval", [](Json& m, Json&) { narrow(m["parameters"][0]["at_risk"], 1, -0.1); }, {}},
        Tampering{"wider_sum", [](Json&, Json& r) { scale(r["sums"][0]["dy"], 1.1); }, {}},
        Tampering{"larger_radius", [](Json&, Json& r) { scale(r["sums"][0]["radius"], 1.1); }, {}},
        Tampering{"wider_facet",
                  [](Json&, Json& r) {
                    Json& b = r["feasible_set"]["b"][0];
                    b = b.get<double>() + 0.1 * std::abs(b.get<double>());
                  },
                  {}},
        Tampering{"fewer_facets",
                  [](Json&, Json& r) {
                    for (const char* key : {"A", "b", "origin"}) {
                      r["feasible_set"][key].erase(0);
                    }
                  },
                  {}}),
    [](const auto& each) { return each.param.name; });

TEST_F(CheckAtRisk, SaysWhatIsProvedAndWhatIsTakenOnTrust) {
  const ModelCheck result = check(*made_, made_->model);
  const ModelClaims claims = claims_from_json(made_->model, "model.json");
  EXPECT_THAT(risk_verdict(*result.at_risk, *claims.at_risk),
              AllOf(HasSubstr("at a risk of 1e-09: all 4 bounds and "), HasSubstr(" sums over the log"),
                    HasSubstr("the risks of all 12 ellipsoids add up to 1e-09")));
  EXPECT_THAT(result.premises,
              ::testing::Contains(AllOf(HasSubstr("at a risk of 1e-09: that errors are as the robot "
                                                  "file says"),
                                        HasSubstr("which commissioning and this check have in common"))));
  const Json json = to_json(result, claims, logs::LogReport{}, {"model.json", {"log.csv"}}, "test");
  EXPECT_TRUE(json.at("at_risk").at("proved").get<bool>());
  EXPECT_EQ(json.at("at_risk").at("spent"), 1e-9);
  EXPECT_EQ(json.at("at_risk").at("ellipsoids"), 12);
}

// Equal parts, as doubles: seven of the double next to a seventh may be more than the whole.
TEST_F(CheckAtRisk, PartsOfARiskDoNotAddUpToMore) {
  const ModelClaims claims = claims_from_json(made_->model, "model.json");
  TableSource source(made_->log);
  for (const double risk : {1e-9, 0.3, 1e-2}) {
    for (const std::size_t count : {1u, 3u, 7u, 11u}) {
      commission::RiskSetOptions options{.risk = risk, .delays = std::vector<double>(count, 0.4)};
      std::vector<double> parts;
      for (const commission::RiskEllipsoid& e :
           risk_sums(source, claims.model, claims.measurement, claims.errors, claims.at_risk->model.errors,
                     claims.at_risk->box, options, {})
               .ellipsoids) {
        parts.push_back(e.risk);
      }
      ASSERT_EQ(parts.size(), 3 * count);  // an ellipsoid at each of three scales of V0
      EXPECT_LE(bounds::exact_sum(parts), risk) << count;
      EXPECT_GT(bounds::exact_sum(parts), risk * (1.0 - 1e-15)) << count;
    }
  }
}

TEST_F(CheckAtRisk, WithoutItsProofIsBadInput) {
  const auto message = [](const std::function<void(Json&)>& change) {
    Json model = made_->model;
    change(model);
    return testing::input_error([&] { (void)claims_from_json(model, "model.json"); });
  };
  EXPECT_THAT(message([](Json& m) { m["at_risk"].erase("sums"); }),
              AllOf(HasSubstr("model.json: /at_risk: no member 'sums'"), HasSubstr("commission again")));
  EXPECT_THAT(message([](Json& m) { m.erase("at_risk"); }), HasSubstr("no member 'at_risk'"));
  EXPECT_THAT(message([](Json& m) { m["at_risk"]["feasible_set"].erase("origin"); }), HasSubstr("origin"));
  EXPECT_THAT(message([](Json& m) { m["at_risk"]["feasible_set"]["origin"].erase(0); }),
              HasSubstr("one entry for each"));
  EXPECT_THAT(message([](Json& m) {
                m["at_risk"]["feasible_set"]["origin"][0] = {{"sum", 99}, {"side", "upper"}};
              }),
              HasSubstr("/at_risk/feasible_set/origin/0/sum"));
  EXPECT_THAT(message([](Json& m) {
                m["at_risk"]["feasible_set"]["origin"][0] = {{"facet", 999}};
              }),
              HasSubstr("rows of feasible_set.A"));
  EXPECT_THAT(message([](Json& m) { m["at_risk"]["sums"][0]["ellipsoid"] = 12; }), HasSubstr("at_risk.ellipsoids"));
  EXPECT_THAT(message([](Json& m) { m["at_risk"]["sums"][0]["weights"] = {1.0}; }), HasSubstr("an array of 2 numbers"));
  EXPECT_THAT(message([](Json& m) { m["at_risk"]["binding"].erase(0); }), HasSubstr("/at_risk/binding"));
}

// Errors that are alike for 0.05 s: with steps of 0.01 s in the log, sums that take them for 0.03 s count too few.
TEST(CorrelatedErrors, AreCountedByTheStepsOfTheLog) {
  ExactAxis axis;
  axis.seconds = 40.0;
  axis.law = ErrorLaw::together;
  axis.correlation = 0.05;
  axis.bound = 1.0;
  const Commissioned made = commissioned(axis, robot_file(axis));
  Json model = made.model;
  model["measurement"]["shortest_step"] = 0.03;
  model["at_risk"]["errors"]["shortest_step"] = 0.03;
  EXPECT_THAT(check(made, model).failures,
              ::testing::Contains(HasSubstr("2 samples of the effort take no more than 0.02 s, and its errors are "
                                            "correlated over 0.05 s")));
}

// A robot file that declares no bias has no such part, and nothing is said of it.
TEST(ModelWithoutBias, SaysNothingAtARisk) {
  ExactAxis axis;
  axis.seconds = 40.0;
  Robot robot = robot_file(axis);
  robot.noise.effort.bias.reset();
  const Commissioned made = commissioned(axis, robot);
  const ModelCheck result = check(made, made.model);
  EXPECT_THAT(result.failures, IsEmpty());
  EXPECT_FALSE(result.at_risk);
  const ModelClaims claims = claims_from_json(made.model, "model.json");
  EXPECT_THAT(files::json_text(to_json(result, claims, logs::LogReport{}, {"model.json", {"log.csv"}}, "test")),
              Not(HasSubstr("risk")));
}

}  // namespace
}  // namespace wheelwright::results::risk_check_test
