// SPDX-License-Identifier: Apache-2.0
// Events that one fault explains are one incident, and the faults left are those of all its events.
#include <cstddef>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "detector/incidents.hpp"

namespace wheelwright::detector::incidents_test {
namespace {

using Change = IncidentRecorder::Change;
using Verdict = FaultFinding::Verdict;

Event event_at(double t) { return {.start = t, .alarm = t, .end = t + 1.0}; }

FaultFinding may_be(const std::string& name, Interval size, Interval onset, bool earlier = false) {
  FaultFinding finding;
  finding.fault.name = name;
  finding.verdict = Verdict::consistent;
  finding.magnitude = size;
  finding.onset = onset;
  finding.earlier = earlier;
  return finding;
}

Isolation of(std::vector<FaultFinding> findings) { return {.window = {}, .findings = std::move(findings)}; }

TEST(Incidents, AreNarrowedByEveryEvent) {
  IncidentRecorder recorder;
  const Isolation first =
      of({may_be("slip", {0.1, 0.4}, {9.0, 10.0}), may_be("radius", {-0.25, -0.05}, {9.5, 10.0}, true),
          may_be("dropout", {0.0, 1.0}, {9.9, 10.0})});
  EXPECT_EQ(recorder.add(event_at(10.0), &first).change, Change::opened);
  // A jam that began no earlier than 19.9 s is not that of 10 s.
  const Isolation second =
      of({may_be("radius", {-0.2, -0.15}, {17.0, 17.0}, true), may_be("slip", {0.2, 0.5}, {17.0, 18.0}, true),
          may_be("dropout", {0.0, 1.0}, {19.9, 20.0})});
  EXPECT_EQ(recorder.add(event_at(20.0), &second).change, Change::narrowed);
  const Incident& incident = *recorder.open();
  ASSERT_EQ(incident.candidates.size(), 2u);
  EXPECT_EQ(incident.events, 2u);
  EXPECT_EQ(incident.start, 10.0);
  EXPECT_EQ(incident.end, 21.0);
  // Two sizes that both events allow, in the order of their widths; onsets stay those of the first event.
  EXPECT_EQ(incident.candidates[0].finding.fault.name, "radius");
  EXPECT_EQ(incident.candidates[0].finding.magnitude->lower, -0.2);
  EXPECT_EQ(incident.candidates[0].finding.magnitude->upper, -0.15);
  EXPECT_EQ(incident.candidates[0].finding.onset.lower, 9.5);
  EXPECT_TRUE(incident.candidates[0].finding.earlier);
  EXPECT_EQ(incident.candidates[1].finding.magnitude->lower, 0.2);
  EXPECT_EQ(incident.candidates[1].finding.magnitude->upper, 0.4);
}

TEST(Incidents, AFaultThatGrowsIsOneIncidentAndSaysSo) {
  IncidentRecorder recorder;
  const Isolation small = of({may_be("radius", {-0.1, -0.05}, {9.5, 10.0}), may_be("steady", {0.1, 0.2}, {9.5, 10.0})});
  const Isolation large =
      of({may_be("radius", {-0.3, -0.2}, {17.0, 17.0}, true), may_be("steady", {0.1, 0.3}, {17.0, 17.0}, true)});
  recorder.add(event_at(10.0), &small);
  recorder.add(event_at(20.0), &large);
  ASSERT_EQ(recorder.open()->candidates.size(), 2u);
  EXPECT_EQ(recorder.open()->candidates[0].finding.fault.name, "steady");
  EXPECT_TRUE(recorder.open()->candidates[1].changes);
  EXPECT_TRUE(recorder.open()->stays);
  EXPECT_EQ(recorder.open()->candidates[1].finding.magnitude->upper, -0.2);
}

// An event of an incident's own fault is told by its candidates alone: other faults change nothing then.
TEST(Incidents, AnEventGoesOnByTheCandidatesAlone) {
  const Isolation first = of({may_be("left", {0.1, 0.2}, {9.5, 10.0}), may_be("bias", {0.1, 0.2}, {9.5, 10.0})});
  const FaultFinding same = may_be("left", {0.15, 0.3}, {9.0, 9.8}, true),
                     other_onset = may_be("left", {0.1, 0.2}, {11.5, 12.0}),
                     other_size = may_be("left", {0.4, 0.5}, {9.0, 9.8}, true),
                     foreign = may_be("right", {0.1, 0.2}, {9.5, 12.0});
  for (const auto& [finding, time, goes_on] :
       {std::tuple(same, 12.0, true), std::tuple(same, 60.0, true), std::tuple(other_size, 60.0, true),
        std::tuple(other_onset, 12.0, true), std::tuple(other_onset, 60.0, false), std::tuple(foreign, 12.0, false)}) {
    IncidentRecorder some, all;
    EXPECT_FALSE(some.goes_on(event_at(10.0), first)) << "nothing is open";
    some.add(event_at(10.0), &first);
    all.add(event_at(10.0), &first);
    const Isolation asked = of({finding}), everything = of({finding, foreign});
    EXPECT_EQ(some.goes_on(event_at(time), asked), goes_on) << finding.fault.name << ", " << time;
    if (!goes_on) {
      continue;
    }
    EXPECT_EQ(some.add(event_at(time), &asked).change, all.add(event_at(time), &everything).change);
    ASSERT_EQ(some.open()->candidates.size(), all.open()->candidates.size());
    EXPECT_EQ(some.open()->stays, all.open()->stays);
    EXPECT_EQ(some.open()->unexplained, all.open()->unexplained);
    for (std::size_t k = 0; k < some.open()->candidates.size(); ++k) {
      const IncidentCandidate &a = some.open()->candidates[k], &b = all.open()->candidates[k];
      EXPECT_EQ(a.finding.fault.name, b.finding.fault.name);
      EXPECT_EQ(a.finding.magnitude, b.finding.magnitude);
      EXPECT_EQ(a.finding.onset, b.finding.onset);
      EXPECT_EQ(a.changes, b.changes);
    }
  }
}

TEST(Incidents, WhatNoFaultOfTheFirstExplainsIsAnother) {
  IncidentRecorder recorder;
  const Isolation left = of({may_be("left", {0.1, 0.2}, {9.5, 10.0})}), nothing = of({});
  const Isolation right = of({may_be("right", {0.1, 0.2}, {39.5, 40.0})});
  recorder.add(event_at(10.0), &left);
  EXPECT_FALSE(recorder.add(event_at(12.0), &nothing).closed) << "unexplained, but soon";
  EXPECT_EQ(recorder.open()->unexplained, 1u);
  ASSERT_EQ(recorder.open()->candidates.size(), 1u);
  EXPECT_TRUE(recorder.open()->candidates[0].changes);
  EXPECT_FALSE(recorder.open()->stays);
  const auto outcome = recorder.add(event_at(40.0), &right);
  EXPECT_EQ(outcome.change, Change::opened);
  ASSERT_TRUE(outcome.closed);
  EXPECT_EQ(outcome.closed->events, 2u);
  EXPECT_TRUE(recorder.add(event_at(60.0), &nothing).closed) << "unexplained, and late";
  // A first event that nothing explains takes its faults from one that comes soon.
  const Isolation late = of({may_be("left", {0.1, 0.2}, {61.5, 62.0})});
  EXPECT_EQ(recorder.add(event_at(62.0), &late).change, Change::narrowed);
  EXPECT_EQ(recorder.open()->candidates.size(), 1u);
  EXPECT_FALSE(recorder.open()->stays);
}

TEST(Incidents, WhatNoOneFaultThatStaysExplainsIsSaidSo) {
  IncidentRecorder recorder;
  const Isolation first = of({may_be("left", {0.1, 0.2}, {9.5, 10.0}), may_be("bias", {0.1, 0.2}, {9.5, 10.0})});
  const Isolation second = of({may_be("right", {0.1, 0.2}, {11.5, 12.0}), may_be("bias", {0.1, 0.2}, {11.5, 12.0})});
  const Isolation third = of({may_be("right", {0.1, 0.2}, {11.0, 11.0}, true)});
  recorder.add(event_at(10.0), &first);
  EXPECT_TRUE(recorder.open()->stays);
  EXPECT_EQ(recorder.add(event_at(12.0), &second).change, Change::narrowed);
  EXPECT_FALSE(recorder.open()->stays);
  ASSERT_EQ(recorder.open()->candidates.size(), 1u);
  EXPECT_EQ(recorder.open()->candidates[0].finding.fault.name, "bias");
  EXPECT_EQ(recorder.open()->candidates[0].finding.onset.lower, 11.5) << "of the last event that it explains";
  EXPECT_FALSE(recorder.add(event_at(14.0), &third).closed);
  ASSERT_EQ(recorder.open()->candidates.size(), 1u);
  EXPECT_EQ(recorder.open()->candidates[0].finding.fault.name, "right");
  EXPECT_TRUE(recorder.open()->candidates[0].changes);
  EXPECT_EQ(recorder.open()->candidates[0].since, 14.0);
  EXPECT_EQ(recorder.open()->events, 3u);
  // From there on events agree again.
  const Isolation fourth = of({may_be("right", {0.15, 0.3}, {13.0, 13.0}, true)});
  recorder.add(event_at(16.0), &fourth);
  EXPECT_FALSE(recorder.open()->stays);
  EXPECT_EQ(recorder.open()->candidates[0].finding.magnitude, (Interval{0.15, 0.2}));
  EXPECT_EQ(recorder.open()->candidates[0].events, 2u);
  EXPECT_EQ(recorder.open()->candidates[0].since, 14.0);
}

TEST(Incidents, AnEventOfTheSameFaultGoesOnAfterAGap) {
  IncidentRecorder recorder;
  const Isolation first = of({may_be("left", {0.1, 0.3}, {9.5, 10.0})});
  const Isolation later = of({may_be("left", {0.2, 0.4}, {100.0, 100.1}, true)});
  recorder.add(event_at(10.0), &first);
  EXPECT_EQ(recorder.add(event_at(100.0), &later).change, Change::extended);
  EXPECT_TRUE(recorder.open()->stays);
  EXPECT_EQ(recorder.open()->candidates[0].finding.magnitude->lower, 0.2);
  EXPECT_EQ(recorder.open()->candidates[0].finding.magnitude->upper, 0.3);
  EXPECT_EQ(recorder.open()->candidates[0].finding.onset.lower, 9.5);
  EXPECT_FALSE(recorder.open()->candidates[0].finding.earlier);
}

TEST(Incidents, WhatWasNotExaminedSpeaksAgainstNothing) {
  IncidentRecorder recorder;
  recorder.add(event_at(10.0), nullptr, false);
  EXPECT_EQ(recorder.open()->examined, 0u);
  const Isolation left = of({may_be("left", {0.1, 0.2}, {39.5, 40.0})});
  EXPECT_FALSE(recorder.add(event_at(40.0), &left).closed);
  EXPECT_TRUE(recorder.open()->stays);
  EXPECT_FALSE(recorder.add(event_at(90.0), nullptr, false).closed);
  EXPECT_EQ(recorder.open()->events, 3u);
  EXPECT_EQ(recorder.open()->candidates.size(), 1u);
}

TEST(Incidents, OfALongOneFewEventsAreExamined) {
  IncidentRecorder recorder;
  const Isolation first = of({may_be("left", {0.1, 0.2}, {0.5, 1.0})});
  const Isolation later = of({may_be("left", {0.1, 0.2}, {0.0, 0.0}, true)});
  std::size_t asked = 0;
  for (int k = 1; k <= 10000; ++k) {
    const Event event = event_at(k);
    const bool asks = recorder.asks(event);
    asked += asks ? 1 : 0;
    recorder.add(event, !asks ? nullptr : k == 1 ? &first : &later, asks);
  }
  EXPECT_EQ(recorder.open()->events, 10000u);
  EXPECT_LT(asked, 50u);
  EXPECT_EQ(recorder.open()->examined, asked);
}

}  // namespace
}  // namespace wheelwright::detector::incidents_test
