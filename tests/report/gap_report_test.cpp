// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "results/report/gap_report.hpp"
#include "results/words/gap_words.hpp"
#include "tests/report/example.hpp"
#include "tests/report/gap_example.hpp"

namespace wheelwright::report::gap_report_test {
using namespace words;
namespace {

namespace example = report_example;

std::size_t times(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++n;
  }
  return n;
}

std::string all_sentences(const Diagnosis& d, const std::string& next = {}) {
  std::string out = gap_verdict(d);
  for (const std::string& sentence : gap_sentences(d, next)) {
    out += "\n" + sentence;
  }
  return out;
}

TEST(GapWords, AnExplainedGapSaysCauseShareSizeAndWhatItFallsTo) {
  const std::string words = all_sentences(gap_example::explained());
  EXPECT_TRUE(example::holds(
      words, {"Dry friction, which the model lacks, explains 93\u00a0% of the gap: 0.312\u00a0N·m [0.290, 0.330].",
              // the signal's root mean square is 1/√2
              "from 12\u00a0% to 1.1\u00a0%", "noise floor is 1.0\u00a0%", "reversal of the right wheel"}));
  EXPECT_EQ(times(words, "Dry friction"), 1U);
}

TEST(GapWords, EachVerdictHasItsOwnWords) {
  EXPECT_TRUE(example::holds(all_sentences(gap_example::no_gap()), {"No gap", "noise alone leaves"}));
  EXPECT_TRUE(example::lacks(all_sentences(gap_example::no_gap()), {"cause", "adding"}));
  EXPECT_TRUE(example::holds(all_sentences(gap_example::ambiguous(), "Turn on the spot."),
                             {"one of 2 causes", "dry friction, or a dragging castor", "Turn on the spot."}));
  EXPECT_TRUE(example::holds(all_sentences(gap_example::unexplained()), {"not explained", "60\u00a0% of it stays"}));
  const std::string two = all_sentences(gap_example::two_causes());
  EXPECT_TRUE(example::holds(two, {"Dry friction and a slope of the ground together explain 95\u00a0% of the gap.",
                                   "accounts for 60\u00a0%", "accounts for 35\u00a0%", "After adding them"}));
  Diagnosis nothing = gap_example::unexplained();
  nothing.causes.clear();
  EXPECT_TRUE(example::holds(all_sentences(nothing), {"no effect of the catalogue explains it"}));
}

// From all of the gap each step takes off what the one before it left, down to what stays.
TEST(GapWords, StepsGoFromAllOfTheGapToWhatIsLeft) {
  for (Diagnosis d :
       {gap_example::explained(), gap_example::two_causes(), gap_example::late_torque(), gap_example::unexplained()}) {
    const std::vector<GapStep> steps = gap_steps(d);
    ASSERT_GE(steps.size(), d.causes.size() + 2);
    EXPECT_EQ(steps.front().to - steps.front().from, 1.0);
    double left = 1.0;
    for (std::size_t k = 1; k + 1 < steps.size(); ++k) {
      EXPECT_EQ(steps[k].to, left);
      left = steps[k].from;
      if (k <= d.causes.size()) {
        EXPECT_NEAR(steps[k].to - steps[k].from, d.causes[k - 1].share, 1e-12);
      }
    }
    EXPECT_EQ(steps.back().from, 0.0);
    EXPECT_EQ(steps.back().to, d.remaining);
    EXPECT_NEAR(left, d.remaining, 0.01);
    EXPECT_EQ(times(step_bars(d), "<rect"), steps.size());
  }
  EXPECT_TRUE(gap_steps(gap_example::no_gap()).empty());
  EXPECT_TRUE(step_bars(gap_example::no_gap()).empty());
}

TEST(GapWords, LawsOfAFamilyAreOneCause) {
  const std::string words = all_sentences(gap_example::late_torque());
  EXPECT_TRUE(example::holds(words, {"Late torque, which the model lacks, explains 93\u00a0% of the gap.",
                                     "does not tell by which law: a delay of the torque (0.0210\u00a0s [",
                                     ", or a lag of the actuators (0.0240\u00a0s ["}));
  EXPECT_TRUE(example::lacks(words, {"one of", "would do as well"}));
  const std::string page = gap_report(gap_example::late_torque(), "r", {});
  EXPECT_TRUE(example::holds(page, {"Late torque", "<code>late_torque</code>", "either a lag of the actuators"}));
}

TEST(GapWords, WithoutAGapTheSmallestThatWouldHaveShown) {
  const std::string words = all_sentences(gap_example::no_gap());
  EXPECT_TRUE(
      example::holds(words, {"would have shown: dry friction from 0.021\u00a0N·m, a payload from 0.32\u00a0kg."}));
  EXPECT_TRUE(
      example::holds(gap_report(gap_example::no_gap(), "r", {}), {"What would have been seen", "0.50\u00a0N·m"}));
  EXPECT_TRUE(example::lacks(all_sentences(gap_example::explained()), {"would have shown"}));
}

TEST(GapWords, AModelThatDoesNotFitTheHealthyRobotIsSaidToBeNone) {
  const std::string words = all_sentences(gap_example::misfit());
  EXPECT_TRUE(example::holds(
      words, {"This model does not fit the healthy robot", "mean square 23", "scrubbing of the tyres in turns",
              "difference channel (turning on the spot)", "dry friction that fades with speed would help most"}));
  EXPECT_TRUE(example::lacks(words, {"No gap", "were right", "no effect of the catalogue explains it"}));
}

std::size_t words_in(const std::string& sentence) {
  return static_cast<std::size_t>(std::ranges::count(sentence, ' ')) + 1;
}

TEST(GapWords, TheFirstSentenceIsShort) {
  Diagnosis many = gap_example::explained();
  for (int k = 0; k < 12; ++k) {
    many.causes[0].parameters.push_back(many.causes[0].parameters[0]);
  }
  for (const Diagnosis& d :
       {gap_example::explained(), gap_example::ambiguous(), gap_example::two_causes(), gap_example::unexplained(),
        gap_example::no_gap(), gap_example::late_torque(), gap_example::misfit(), many}) {
    EXPECT_LE(words_in(gap_verdict(d)), 25U) << gap_verdict(d);
  }
  EXPECT_TRUE(example::holds(all_sentences(many), {"0.312"}));
}

// Of the sum channel's 71 % four fifths.
TEST(GapWords, WhereSaysHowMuchOfTheGapLiesThere) {
  Diagnosis d = gap_example::explained();
  d.structural = d.gap;
  EXPECT_TRUE(
      example::holds(all_sentences(d), {"Where: the driving torque at 0.2 to 0.5 Hz holds 41\u00a0%, the driving "
                                        "torque (reversal of the right wheel) holds 37\u00a0% and",
                                        "holds 22\u00a0% of the gap."}));
  d.where = {{gap::GapSpace::kinematic, "lateral", "all", "channel", 1.0, 1.0, 0.001},
             {gap::GapSpace::kinematic, "lateral", "below 0.2 Hz", "frequency", 1.0, 0.14, 0.001}};
  EXPECT_TRUE(example::holds(all_sentences(d), {"Where: lateral motion below 0.2 Hz holds all of the gap."}));
  d.structural = 0.5 * d.gap;
  EXPECT_TRUE(example::holds(all_sentences(d), {"holds all of what no other parameters make up."}));
}

TEST(GapWords, TheRecordOfSuchAnswersIsToldWhereThereIsOne) {
  Diagnosis d = gap_example::ambiguous();
  EXPECT_TRUE(example::lacks(all_sentences(d), {"withheld"}));
  d.record = gap::TrackRecord{.logs = 29, .first = 17, .other = 4, .causes = 45, .present = 31};
  EXPECT_TRUE(example::holds(all_sentences(d),
                             {"Of 29 such answers", "the first was right in 17, another in 4, and none in 8."}));
  d.verdict = gap::GapVerdict::explained;
  EXPECT_TRUE(example::holds(all_sentences(d), {"17 were right; 31 of the 45 causes they named were there."}));
  d.verdict = gap::GapVerdict::unexplained;
  EXPECT_TRUE(example::holds(all_sentences(d), {"Of 45 causes", "31 were there."}));
}

TEST(GapWords, WithoutEffortsNothingIsSaidOfTheTorque) {
  Diagnosis pose = gap_example::no_gap();
  ASSERT_FALSE(pose.series.empty());
  for (gap::ResidualSeries& series : pose.series) {
    series.space = gap::GapSpace::kinematic;
  }
  EXPECT_TRUE(example::holds(all_sentences(pose), {"No gap in the pose", "of the torque nothing is known"}));
  EXPECT_TRUE(example::lacks(all_sentences(gap_example::no_gap()), {"in the pose"}));
}

TEST(GapWords, AnUnknownEffectIsCalledByItsName) {
  EXPECT_EQ(effect_noun("my_own_effect"), "my own effect");
  EXPECT_EQ(effect_nouns({}), "none");
}

TEST(GapReport, HoldsEverySectionOfWhatIsKnown) {
  const std::string page =
      gap_report(gap_example::ambiguous(), "example robot", example::context(3000), "Turn on the spot for 20 s.");
  for (const char* id :
       {"causes", "residual", "shrink", "apart", "where", "place", "parameters", "contradiction", "data"}) {
    EXPECT_TRUE(example::holds(page, {std::string("<section id=\"") + id + "\""}));
  }
  EXPECT_TRUE(example::holds(page, {"Sim-to-real gap of example robot", "Turn on the spot for 20 s.",
                                    "class=\"result caution\"", "\"contradiction\"", "12.500\u00a0s"}));
  EXPECT_EQ(times(page, "<figure class=\"chart\">"),
            2U + 4U);  // residuals, and the raw signals  // one for each channel
  EXPECT_TRUE(example::lacks(page, {">nan<", ">inf<", "nan &", "−nan", "nan %", "inf %"}));
}

TEST(GapReport, ADiagnosisOfNothingIsAPage) {
  const std::string page = gap_report(Diagnosis{}, "r", {});
  EXPECT_TRUE(example::holds(page, {"No gap", "</html>"}));
}

TEST(GapReport, TextsAreEscaped) {
  Diagnosis d = gap_example::explained();
  d.causes[0].effect = "<script>alert(1)</script>";
  d.causes[0].sentence = d.notes[0] = d.confusable[0].reason = d.where[3].regime = d.series[0].unit = "<b>&";
  d.confusable[0].first = d.causes[0].parameters[0].name = d.shrink.rollout[0].name = "<b>";
  const std::string page = gap_report(d, "<i>robot", example::context(600), "<u>next");
  EXPECT_TRUE(example::lacks(page, {"<script>alert", "<b>", "<i>robot", "<u>next"}));
}

TEST(GapDrawings, AFindingLooksOtherThanChance) {
  gap::GapShare finding{gap::GapSpace::dynamic, "sum", "reversals", "reversal", 0.5, 0.1, 0.001}, chance = finding;
  chance.p_value = 0.5;
  EXPECT_TRUE(example::holds(share_bars({finding}), {"class=\"full\"", "50 % in 10 %"}));
  EXPECT_TRUE(example::lacks(share_bars({chance}), {"class=\"full\""}));
  EXPECT_TRUE(share_bars({}).empty());
}

TEST(GapDrawings, AMatrixHasACellForEachPairAndPrintsItsNumber) {
  const std::string drawing = confusability_matrix(gap_example::explained().confusable);
  EXPECT_TRUE(example::holds(drawing, {">82</text>", ">100</text>", "stroke-width:2"}));
  EXPECT_EQ(times(drawing, "<rect"), 21U);  // seven causes
  EXPECT_TRUE(confusability_matrix({}).empty());
}

TEST(GapDrawings, AMapNeedsAPlace) {
  const gap::ResidualSeries s = gap_example::explained().series[0];
  EXPECT_FALSE(position_map(s, example::signals(3000), 0.2).empty());
  LogTable still = example::signals(3000);
  for (auto& column : still.columns) {
    std::fill(column.begin(), column.end(), 1.0);
  }
  EXPECT_TRUE(position_map(s, still, 0.2).empty());
  EXPECT_TRUE(position_map(s, {}, 0.2).empty());
}

TEST(GapDrawings, ASpectrumNeedsALog) {
  EXPECT_TRUE(
      example::holds(spectrum_drawing(gap_example::explained().series[0], 10.0), {"noise floor", "frequency, Hz"}));
  EXPECT_TRUE(spectrum_drawing(gap::ResidualSeries{}, 10.0).empty());
}

}  // namespace
}  // namespace wheelwright::report::gap_report_test
