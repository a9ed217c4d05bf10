// SPDX-License-Identifier: Apache-2.0
// Oracle: the simulator, which knows what it did. Laws, sizes and noise are drawn from the seeds below; no drawn log
// was looked at before the rules were made.
#include "gap/causes/answers.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gap/diagnose.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::answers_test {
namespace {

using gap_example::counted_robot;
using gap_example::healthy_scenario;
using gap_example::noisy_scenario;
using gap_example::robot_with;

using Names = std::vector<std::string>;

CredibleCauses set_of(Names effects, Names trifles = {}) {
  CredibleCauses set{std::move(effects), 1.0, 1.0};
  set.trifles = std::move(trifles);
  return set;
}

TEST(Answers, LawsOfAFamilyAndTriflesMakeNoOtherAnswer) {
  const std::vector<Effect> catalogue = effect_catalogue();
  std::vector<CredibleCauses> credible{set_of({"coulomb", "delay"}),
                                       set_of({"actuator_lag", "coulomb"}),
                                       set_of({"coulomb", "delay", "slope"}, {"slope"}),
                                       set_of({"coulomb", "slope"}),
                                       set_of({"wheel_radius_asymmetric"}),
                                       set_of({"encoder_scale"}),
                                       set_of({"wheel_radius"})};
  EXPECT_EQ(number_answers(credible, catalogue), 4u);
  std::vector<std::size_t> numbers;
  for (const CredibleCauses& set : credible) {
    numbers.push_back(set.answer);
  }
  EXPECT_EQ(numbers, (std::vector<std::size_t>{0, 0, 0, 1, 2, 2, 3}));
  EXPECT_EQ(answers_among(credible), 4u);
  EXPECT_EQ(answers_among({}), 0u);
}

TEST(Answers, AUsersOwnFamilyIsOne) {
  std::vector<Effect> catalogue = effect_catalogue();
  for (const char* name : {"spring", "rubber"}) {
    Effect own = catalogue.front();
    own.name = name;
    own.family = "tether";
    catalogue.push_back(own);
  }
  std::vector<CredibleCauses> credible{set_of({"spring"}), set_of({"rubber"})};
  EXPECT_EQ(number_answers(credible, catalogue), 1u);
  EXPECT_EQ(family_noun("tether"), "tether");
  EXPECT_EQ(family_noun("late_torque"), "late torque");
}

// A slope can be driven from another side, an offset of the torque cannot: they are two causes.
TEST(Answers, ASlopeIsNoOffsetOfTheTorque) {
  std::vector<CredibleCauses> credible{set_of({"slope"}), set_of({"torque_bias"})};
  EXPECT_EQ(number_answers(credible, effect_catalogue()), 2u);
}

Diagnosis diagnosis_of(const Scenario& scenario, const Scenario& before, const std::vector<std::string>& without = {}) {
  DiagnoseOptions options;
  options.shrink = false;
  options.without = without;
  Simulation log(scenario), healthy(before);
  return diagnose(log, &healthy, counted_robot(), options);
}

Names laws_of(const GapCause& cause) {
  Names names{cause.effect};
  for (const GapLaw& law : cause.laws) {
    if (law.effect != cause.effect) {
      names.push_back(law.effect);
    }
  }
  return names;
}

// One answer, explained, of which the true law is one. Returns whether the log left several.
bool is_one_answer(const Diagnosis& found, const std::string& effect, const std::string& family) {
  EXPECT_EQ(found.verdict, GapVerdict::explained);
  EXPECT_EQ(answers_among(found.credible), 1u);
  if (found.causes.size() != 1) {
    ADD_FAILURE() << found.causes.size() << " causes";
    return false;
  }
  const GapCause& cause = found.causes[0];
  EXPECT_EQ(cause.family, family);
  const Names laws = laws_of(cause);
  EXPECT_NE(std::ranges::find(laws, effect), laws.end()) << effect << " is not among the laws";
  for (const GapLaw& law : cause.laws) {
    EXPECT_FALSE(law.parameters.empty()) << law.effect;
    EXPECT_FALSE(law.sentence.empty()) << law.effect;
    for (const GapEstimate& estimate : law.parameters) {
      EXPECT_TRUE(std::isfinite(estimate.estimate)) << law.effect;
      EXPECT_LE(estimate.lower, estimate.upper) << law.effect;
    }
  }
  if (cause.laws.empty()) {
    return false;
  }
  EXPECT_EQ(cause.laws.front().effect, cause.effect);
  EXPECT_EQ(cause.laws.front().parameters.size(), cause.parameters.size());
  EXPECT_FALSE(found.record) << "answers of several laws were not counted";
  return true;
}

TEST(Answers, LateTorqueIsOneAnswerWhateverItsLaw) {
  std::mt19937_64 generator(5901);
  std::uniform_real_distribution<double> uniform;
  int of_several = 0;
  for (unsigned k = 0; k < 6; ++k) {
    const bool lag = k % 2 == 0;
    const double late = 0.012 * std::pow(5.0, uniform(generator));
    Scenario log = noisy_scenario(robot_with(lag ? "actuator_lag" : "delay", {{lag ? "T" : "T_d", late}}),
                                  static_cast<unsigned>(generator()));
    log.sensors.effort *= 1.0 + 5.0 * uniform(generator);
    Scenario healthy = healthy_scenario(log);
    healthy.sensors = log.sensors;
    SCOPED_TRACE((lag ? "lag of " : "delay of ") + std::to_string(late) + " s, noise of " +
                 std::to_string(log.sensors.effort));
    of_several += is_one_answer(diagnosis_of(log, healthy), lag ? "actuator_lag" : "delay", "late_torque") ? 1 : 0;
  }
  EXPECT_GT(of_several, 0);
}

TEST(Answers, OneWheelsRollingDistanceIsOneAnswer) {
  std::mt19937_64 generator(5902);
  std::uniform_real_distribution<double> uniform;
  for (unsigned k = 0; k < 4; ++k) {
    const bool radius = k % 2 == 0;
    const double size = (uniform(generator) < 0.5 ? -1.0 : 1.0) * (0.004 + 0.016 * uniform(generator));
    const Robot world =
        radius ? robot_with("wheel_radius_asymmetric", {{"eps", size}}) : robot_with("encoder_scale", {{"s_R", size}});
    const Scenario log = noisy_scenario(world, static_cast<unsigned>(generator()));
    SCOPED_TRACE((radius ? "radius by " : "encoder by ") + std::to_string(size));
    is_one_answer(diagnosis_of(log, healthy_scenario(log)), radius ? "wheel_radius_asymmetric" : "encoder_scale",
                  "rolling_distance");
  }
}

}  // namespace
}  // namespace wheelwright::gap::answers_test
