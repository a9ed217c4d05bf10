// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/noise_levels.hpp"

#include <gtest/gtest.h>

namespace wheelwright::inference::noise_choice_test {
namespace {

identify::DifferenceNoise differences(identify::DifferenceNoise::Kind kind, double sd) {
  identify::DifferenceNoise n;
  n.kind = kind;
  n.sd = sd;
  n.relative_sd = 0.05;
  n.level_from = 4;
  return n;
}

StandstillNoise standstill(StandstillNoise::Kind kind, double sd) {
  StandstillNoise n;
  n.kind = kind;
  n.sd = sd;
  n.relative_sd = 0.05;
  n.bound.bound = 100.0 * sd;
  return n;
}

using Kind = identify::DifferenceNoise::Kind;
using Rest = StandstillNoise::Kind;

struct Case {
  NoiseEvidence evidence;
  NoiseMethod method;
  NoiseMeaning meaning;
};

TEST(NoiseChoice, FollowsItsRules) {
  const auto white = differences(Kind::white, 1.0);
  const Case cases[] = {
      {{{}, white}, NoiseMethod::differences, NoiseMeaning::estimate},
      {{standstill(Rest::noisy, 0.7), white}, NoiseMethod::differences, NoiseMeaning::estimate},
      {{standstill(Rest::noisy, 1.5), white}, NoiseMethod::standstill, NoiseMeaning::estimate},
      {{standstill(Rest::constant, 0.0), white}, NoiseMethod::differences, NoiseMeaning::estimate},
      {{standstill(Rest::noisy, 0.5), differences(Kind::smooth, 3.0)},
       NoiseMethod::standstill,
       NoiseMeaning::lower_limit},
      {{{}, differences(Kind::rough, 3.0)}, NoiseMethod::differences, NoiseMeaning::upper_limit},
      {{{}, differences(Kind::smooth, 3.0)}, NoiseMethod::none, NoiseMeaning::unknown},
      {{standstill(Rest::constant, 0.0), differences(Kind::none, 0.0)}, NoiseMethod::none, NoiseMeaning::unknown},
      {{}, NoiseMethod::none, NoiseMeaning::unknown},
  };
  int index = 0;
  for (const Case& c : cases) {
    const NoiseChoice choice = choose_noise(c.evidence);
    EXPECT_EQ(choice.method, c.method) << index;
    EXPECT_EQ(choice.meaning, c.meaning) << index;
    EXPECT_FALSE(choice.reason.empty()) << index;
    EXPECT_EQ(choice.assumption.empty(), c.method == NoiseMethod::none) << index;
    EXPECT_EQ(choice.sd > 0.0, c.method != NoiseMethod::none) << index;
    ++index;
  }
}

TEST(NoiseChoice, MakesItsBoundAsItSays) {
  const ErrorBoundOptions options{NoiseLaw::uniform, 1e3, 0.01};
  const NoiseChoice a = choose_noise({{}, differences(Kind::white, 0.3)}, options);
  EXPECT_EQ(a.bound.bound, bound_of_sd(0.3, 0.05, options).bound);
  const NoiseChoice b = choose_noise({standstill(Rest::noisy, 0.3), {}}, options);
  EXPECT_EQ(b.bound.bound, 30.0);
}

}  // namespace
}  // namespace wheelwright::inference::noise_choice_test
