// SPDX-License-Identifier: Apache-2.0
/// \file
/// Each outcome has its sentences.
#include "commission/assumptions.hpp"
#include "model/fault_type.hpp"
#include "results/report/failure_report.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/detect_words.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/report/commission_report.hpp"
#include "results/report/detect_report.hpp"
#include "tests/report/example.hpp"

namespace wheelwright::words {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
namespace example = report::report_example;

std::string spoken(const Commissioning& result) {
  std::string text;
  for (const std::string& sentence : commission_words(result)) {
    text += sentence + "\n";
  }
  return text;
}

TEST(CommissionWords, HaveThreeToSixSentencesForEveryOutcome) {
  for (const Commissioning& c : {example::done(), example::partial(), example::nothing(), example::empty()}) {
    EXPECT_GE(commission_words(c).size(), 3U);
    EXPECT_LE(commission_words(c).size(), 6U);
    for (const std::string& sentence : commission_words(c)) {
      EXPECT_TRUE(sentence.ends_with('.')) << sentence;
    }
  }
}

TEST(CommissionWords, OfAModelSayWhatWasFoundAndWhatItSees) {
  const Commissioning c = example::done();
  EXPECT_EQ(standing(c), Standing::good);
  const std::string text = spoken(c);
  EXPECT_THAT(text, HasSubstr("Mass 21.30\u00a0kg (extrapolated 20.90 to 21.70)"));
  EXPECT_THAT(text, HasSubstr("3500 instants"));
  EXPECT_THAT(text, HasSubstr("no false alarm"));
  EXPECT_THAT(text, HasSubstr("62.0 %"));
  EXPECT_THAT(text, HasSubstr("is 4.10 %"));  // (1 + 0.0837)^(1/2) − 1 = 0.04101, of the output that sees more
  EXPECT_THAT(text, HasSubstr("extrapolated"));
}

TEST(CommissionWords, RadiusChangeInvertsKappa) {
  for (const double share : {1e-3, 0.04, 0.5, 2.0}) {
    EXPECT_NEAR(radius_change((1.0 + share) * (1.0 + share) - 1.0), share, 1e-14);
  }
}

TEST(CommissionWords, SayWhatTheGuaranteeStandsOn) {
  Commissioning c = example::done();
  for (commission::OutputNoise& noise : c.noise) {
    noise.origin = core::NoiseOrigin::declared;
  }
  commission::settle_warrants(c);
  EXPECT_THAT(spoken(c), AllOf(HasSubstr("declared noise bounds"), HasSubstr("every noise"),
                               HasSubstr("(guaranteed 20.90 to 21.70)"), Not(HasSubstr("extrapolated"))));
  c.noise_mode = filter::NoiseMode::statistical;
  commission::settle_warrants(c);
  EXPECT_THAT(spoken(c), AllOf(HasSubstr("confidence"), HasSubstr("(statistical 20.90 to 21.70)"),
                               Not(HasSubstr("uarantee")), Not(HasSubstr("extrapolated"))));
  c.validation.front().outside = 2;
  commission::settle_warrants(c);
  EXPECT_THAT(spoken(c), AllOf(HasSubstr("the log contradicts these"), HasSubstr("(extrapolated 20.90 to 21.70)"),
                               Not(HasSubstr("uarantee"))));
}

TEST(CommissionWords, OfAPartialResultSayWhatToDrive) {
  const std::string text = spoken(example::partial());
  EXPECT_EQ(standing(example::partial()), Standing::caution);
  EXPECT_THAT(text, HasSubstr("says nothing about yaw inertia and viscous yaw"));
  EXPECT_THAT(text, HasSubstr("drive in curves"));
  EXPECT_THAT(text, HasSubstr("Mass 21.30"));
  EXPECT_THAT(text, Not(HasSubstr("Yaw inertia 0.9")));
}

TEST(CommissionWords, OfAnEmptySetSayTheContradictionAndWhatToDo) {
  const Commissioning c = example::empty();
  EXPECT_EQ(standing(c), Standing::bad);
  EXPECT_THAT(spoken(c),
              AllOf(HasSubstr("1.80 times as large"), HasSubstr("2 samples of the log"), HasSubstr("What to do")));
  const std::string page = report::commission_report(c, example::context(300));
  EXPECT_TRUE(example::holds(page, {"12.500\u00a0s", "31.250\u00a0s", "side of the prior"}));
  EXPECT_TRUE(example::holds(page, {"[12.500000,12.500000,\"sum\",0]"}));  // marked on the raw signals
}

TEST(CommissionWords, OfNothingSayWhatToDrive) {
  EXPECT_EQ(standing(example::nothing()), Standing::bad);
  EXPECT_THAT(spoken(example::nothing()), AllOf(HasSubstr("accelerate and brake"), HasSubstr("drive in curves")));
  EXPECT_THAT(verdict(example::nothing()), HasSubstr("No model"));
}

TEST(CommissionWords, FalseAlarmsAndIdleThresholdsAreNotPraised) {
  Commissioning alarms = example::done();
  alarms.validation[1].outside = 3;
  EXPECT_EQ(standing(alarms), Standing::caution);
  EXPECT_THAT(spoken(alarms), AllOf(HasSubstr("3 times"), HasSubstr("What to do"), Not(HasSubstr("no false alarm"))));

  Commissioning idle = example::done();
  idle.validation[0].utilisation = 0.02;
  EXPECT_EQ(standing(idle), Standing::caution);
  EXPECT_THAT(spoken(idle), HasSubstr("threshold of sum is much wider"));

  Commissioning blind = example::done();
  for (commission::OutputValidation& v : blind.validation) {
    v.smallest_kappa = std::numeric_limits<double>::infinity();
  }
  EXPECT_EQ(standing(blind), Standing::caution);
  EXPECT_THAT(spoken(blind), HasSubstr("no change of scale"));
  blind.little = {"no fault is certain to be seen", {"speed up", "drive what `design` plans"}};
  const auto told = AllOf(HasSubstr("Little was learned: no fault is certain"), HasSubstr("speed up; drive what"),
                          Not(HasSubstr("ommissioned")));
  EXPECT_THAT(verdict(blind), told);
  EXPECT_THAT(spoken(blind), AllOf(HasSubstr("too wide to be of use"), Not(HasSubstr("guaranteed"))));
  EXPECT_THAT(report::commission_report(blind, example::context(300)), Not(HasSubstr("class=\"badge")));
  blind.status = Commissioning::Status::partial;
  EXPECT_THAT(verdict(blind), told);

  Commissioning wide = example::done();
  for (commission::OutputValidation& v : wide.validation) {
    v.smallest_kappa = 1469.0;
  }
  EXPECT_THAT(spoken(wide), AllOf(HasSubstr("no change of scale that is smaller"), Not(HasSubstr("coarse")),
                                  Not(HasSubstr("The smallest change"))));

  Commissioning coarse = example::done();
  for (commission::OutputValidation& v : coarse.validation) {
    v.smallest_kappa = 0.97;
  }
  EXPECT_EQ(standing(coarse), Standing::caution);
  EXPECT_THAT(spoken(coarse), HasSubstr("Only coarse faults"));
  EXPECT_THAT(verdict(coarse), Not(HasSubstr("little")));

  Commissioning untried = example::done();
  untried.validation.clear();
  EXPECT_EQ(standing(untried), Standing::caution);
  EXPECT_THAT(spoken(untried), HasSubstr("no held-out driving"));
}

TEST(CommissionWords, DoNotCallABoundOfThePriorOneOfTheLog) {
  Commissioning c = example::done();
  c.parameters[0].lower = 0.0;
  c.parameters[0].lower_is_prior = true;
  EXPECT_THAT(spoken(c), HasSubstr("(extrapolated at most 21.7)"));
  c.parameters[0].upper_is_prior = true;
  EXPECT_THAT(spoken(c), HasSubstr("(bounded by the prior alone)"));
}

TEST(CommissionReport, ShowsNoPhysicalValuesWithoutTheMotorsConstants) {
  Commissioning c = example::done();
  c.model.robot.effort = model::EffortKind::current;
  const std::string page = report::commission_report(c, example::context(300));
  EXPECT_TRUE(example::holds(page, {"not identifiable", "A·s²/m"}));
  EXPECT_TRUE(example::lacks(page, {"\u00a0kg"}));
  EXPECT_TRUE(example::lacks(report::commission_report(example::done(), example::context(300)), {"not identifiable"}));
}

TEST(CommissionReport, BoundsNothingOfAnEmptySet) {
  const report::CommissionContext context = example::context(300);
  EXPECT_TRUE(example::holds(report::commission_report(example::done(), context), {"20.90 to 21.70", "class=\"bar\""}));
  EXPECT_TRUE(example::lacks(report::commission_report(example::empty(), context), {"20.90 to 21.70", "class=\"bar"}));
}

TEST(CommissionReport, PhysicalValuesFollowFromTheta) {
  // θ_1 = r m: 2.13 kg·m at r = 0.1 m is 21.3 kg.
  const std::string page = report::commission_report(example::done(), example::context(300));
  EXPECT_TRUE(example::holds(page, {">21.30<", ">2.130<", "20.90 to 21.70", "2.090 to 2.170"}));
}

TEST(FailureReport, ShowsTheErrorAndTheRawSignals) {
  const std::string page = report::failure_report("the log lacks the column tau_r", example::context(300));
  EXPECT_TRUE(example::holds(page, {"the log lacks the column tau_r", "\"omega_r\"", "Wheel speeds"}));
}

TEST(DetectReport, SaysWhenAndWhereTheFirstEventCame) {
  const OnlineModel model = example::done().model;
  const std::string page = report::detect_report(example::detection(900, true), model, example::context(900));
  EXPECT_TRUE(example::holds(
      page, {"1 event", "first alarm came at 6.020\u00a0s in the output sum",
             "Of 9.000\u00a0s of driving, 3.00\u00a0s in the output sum contradict the fault-free model.",
             "[6.000000,9.000000,\"1\",0]"}));
  const std::string healthy = report::detect_report(example::detection(900, false), model, example::context(900));
  EXPECT_TRUE(example::holds(healthy, {"No fault was seen", "30.0 %"}));
  EXPECT_TRUE(example::lacks(healthy, {"first alarm"}));
}

// What the stated risk leaves leads; where it leaves nothing, that does, and what is not excluded for certain follows.
TEST(IncidentSentence, BeginsWithWhatTheStatedRiskLeaves) {
  const OnlineModel model = example::done().model;
  const model::FaultType fault = model::fault_catalogue(model.model, Eigen::VectorXd::Ones(4)).front();
  detector::Incident incident;
  incident.events = incident.examined = 2;
  for (const bool excluded : {false, true}) {
    detector::IncidentCandidate candidate;
    candidate.finding.fault = fault;
    candidate.finding.verdict = detector::FaultFinding::Verdict::consistent;
    candidate.finding.at_risk.emplace().excluded = excluded;
    incident.candidates.push_back(candidate);
  }
  EXPECT_THAT(incident_sentence(incident), AllOf(HasSubstr("also possible"), Not(HasSubstr("not excluded: "))));
  incident.candidates.erase(incident.candidates.begin());
  EXPECT_THAT(incident_sentence(incident), testing::StartsWith("at the stated risk no fault that was examined"));
  incident.stays = false;
  EXPECT_THAT(incident_sentence(incident), testing::StartsWith("no one fault that stays"));
  incident.candidates.clear();
  EXPECT_THAT(incident_sentence(incident), testing::StartsWith("no one fault of the catalogue that stays"));
  incident.unexplained = incident.examined;
  EXPECT_THAT(incident_sentence(incident), testing::StartsWith("nothing of the catalogue"));
}

// What the fits say: the likeliest first by its course, what is not told from it, and that nothing fits well.
TEST(IncidentSentence, TellsTheLikeliestCourse) {
  const OnlineModel model = example::done().model;
  const std::vector<model::FaultType> faults = model::fault_catalogue(model.model, Eigen::VectorXd::Ones(4));
  detector::Incident incident;
  incident.events = incident.examined = 1;
  for (const std::size_t k : {0, 2, 3}) {
    detector::IncidentCandidate candidate;
    candidate.finding.fault = faults[k];
    candidate.finding.verdict = detector::FaultFinding::Verdict::consistent;
    candidate.course = detector::CourseClass::growing;
    candidate.changes = true;
    candidate.behind = 2.0 * static_cast<double>(k);
    candidate.left = 0.1;
    candidate.guess = -0.205;
    incident.candidates.push_back(candidate);
  }
  incident.stays = false;
  EXPECT_THAT(incident_sentence(incident),
              AllOf(testing::StartsWith(faults[0].sentence + ", a fault that grew, best fit at the end -20.5 %"),
                    HasSubstr("; less likely, not excluded: " + faults[2].sentence), Not(HasSubstr("not tell it"))));
  incident.candidates[1].as_likely = true;
  incident.candidates[0].course = detector::CourseClass::any;
  EXPECT_THAT(incident_sentence(incident),
              AllOf(testing::StartsWith(faults[0].sentence + ", a fault whose size rose and fell"),
                    HasSubstr("; this log does not tell it from: " + faults[2].sentence),
                    HasSubstr("; less likely, not excluded: " + faults[3].sentence)));
  incident.candidates[0].left = 0.9;
  EXPECT_THAT(incident_sentence(incident), testing::StartsWith("no fault of the catalogue fits this well"));
  incident.candidates[0].left = 1.0;
  EXPECT_THAT(incident_sentence(incident),
              AllOf(testing::StartsWith("no fault of the catalogue fits this: another load or ground"),
                    HasSubstr("; 3 faults of the catalogue are not excluded"), Not(HasSubstr("best fit"))));
}

// Sizes over time stand beside the candidate, and faults that only growing explains are named.
TEST(IncidentSentence, TellsSizesOverTime) {
  const OnlineModel model = example::done().model;
  const std::vector<model::FaultType> faults = model::fault_catalogue(model.model, Eigen::VectorXd::Ones(4));
  detector::Incident incident;
  incident.events = incident.examined = 1;
  incident.start = 30.91;
  detector::IncidentCandidate candidate;
  candidate.finding.fault = faults[0];
  candidate.finding.verdict = detector::FaultFinding::Verdict::consistent;
  incident.candidates.push_back(candidate);
  EXPECT_THAT(incident_sentence(incident), Not(HasSubstr("whether it is a step or not")));
  incident.sizes.push_back({.fault = faults[0],
                            .means = {{29.0, 30.0, {-0.1, 0.2}}, {33.0, 34.0, {0.08, 0.12}}, {35.0, 36.0, {0.01, 0.3}}},
                            .growing = {{31.0, {0.0, 0.2}}, {40.0, {0.11, 0.15}}, {41.0, {0.111, 0.4}}}});
  EXPECT_THAT(incident_sentence(incident),
              AllOf(HasSubstr("whether it is a step or not: present no later than 30.91 s"),
                    HasSubstr("whatever its course by 8.0 to 12.0 % on average over the 1.00 s before 34.00 s"),
                    HasSubstr("if it only grew by 11.0 to 15.0 % at 40.00 s")));
  EXPECT_THAT(incident_sentence(incident), Not(HasSubstr("as a fault that grows")));
  incident.sizes.push_back({.fault = faults[2], .growing = {{31.0, {-0.3, -0.1}}}});
  EXPECT_THAT(incident_sentence(incident),
              HasSubstr("as a fault that grows also possible: " + faults[2].sentence + ", if it only grew by -30.0"));
  incident.sizes.back().growing_excluded = true;
  EXPECT_THAT(incident_sentence(incident), Not(HasSubstr("as a fault that grows")));
  // The page draws them.
  const std::string page =
      report::detect_report(example::detection(900, true), model, example::context(900), {}, {}, {}, {incident});
  EXPECT_TRUE(example::holds(page, {"How large, over time", "size of the fault over time"}));
  EXPECT_THAT(report::size_band(incident.sizes.front(), 30.91), AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
  EXPECT_EQ(report::size_band({.fault = faults[0]}, 3.0), "");
}

}  // namespace
}  // namespace wheelwright::words
