// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <string>

#include <gtest/gtest.h>

#include "gap/causes/confidence.hpp"

namespace wheelwright::gap::confidence_test {
namespace {

// A diagnosis that names `causes` first and lists `sets` credible sets.
Diagnosis said(GapVerdict verdict, std::size_t causes, std::size_t sets) {
  Diagnosis d;
  d.verdict = verdict;
  for (std::size_t k = 0; k < causes; ++k) {
    d.causes.emplace_back().effect = "effect " + std::to_string(k);
  }
  for (std::size_t k = 0; k < sets; ++k) {
    d.credible.push_back({{"set " + std::to_string(k)}, 1.0, 1.0});
  }
  return d;
}

class Confidence : public ::testing::TestWithParam<GapVerdict> {};

TEST_P(Confidence, OfAllSetsAndOfNoneOfThemIsOne) {
  for (const std::size_t causes : {0, 1, 2, 3}) {
    for (const std::size_t sets : {0, 1, 2, 5, 30}) {
      Diagnosis d = said(GetParam(), causes, sets);
      rate(d);
      ASSERT_TRUE(d.record);
      EXPECT_LE(d.record->first + d.record->other, d.record->logs);
      EXPECT_LE(d.record->present, d.record->causes);
      double sum = 0.0;
      for (const CredibleCauses& set : d.credible) {
        ASSERT_TRUE(set.probability);
        EXPECT_GT(*set.probability, 0.0);
        sum += *set.probability;
      }
      EXPECT_LT(sum, 1.0);
    }
  }
}

TEST_P(Confidence, OfWhatIsNamedFirstIsNoLessThanOfAnyOther) {
  for (const std::size_t causes : {1, 2}) {
    for (const std::size_t sets : {2, 5, 30}) {
      Diagnosis d = said(GetParam(), causes, sets);
      rate(d);
      for (const CredibleCauses& set : d.credible) {
        EXPECT_LE(*set.probability, *d.credible.front().probability);
      }
    }
  }
}

// A cause is there wherever the causes named first are just those that are there.
TEST_P(Confidence, OfACauseIsNoLessThanOfItsSet) {
  for (const std::size_t causes : {1, 2}) {
    Diagnosis d = said(GetParam(), GetParam() == GapVerdict::no_gap ? 0 : causes, 3);
    rate(d);
    for (const GapCause& cause : d.causes) {
      EXPECT_GE(*cause.probability, *d.credible.front().probability - 0.01);  // smoothed with other weights
      EXPECT_LT(*cause.probability, 1.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Verdicts, Confidence,
                         ::testing::Values(GapVerdict::no_gap, GapVerdict::explained, GapVerdict::ambiguous,
                                           GapVerdict::unexplained));

TEST(Confidence, IsLargerTheMoreIsSettled) {
  const auto first = [](GapVerdict verdict, std::size_t causes, std::size_t sets) {
    Diagnosis d = said(verdict, causes, sets);
    rate(d);
    return *d.credible.front().probability;
  };
  EXPECT_GT(first(GapVerdict::explained, 1, 1), first(GapVerdict::explained, 2, 1));
  EXPECT_GT(first(GapVerdict::explained, 2, 1), first(GapVerdict::ambiguous, 2, 3));
  EXPECT_GT(first(GapVerdict::ambiguous, 1, 2), first(GapVerdict::unexplained, 1, 2));
}

}  // namespace
}  // namespace wheelwright::gap::confidence_test
