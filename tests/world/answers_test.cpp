// SPDX-License-Identifier: Apache-2.0
// The diagnosis on the independent world: every effect under every law once, each with the least that is expected of
// the answer (tests/long.sh slow). On the seed here; docs/methods/gap.md has drawn ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "formats/robots/robot_file.hpp"
#include "gap/diagnose.hpp"
#include "tests/world/case.hpp"

namespace wheelwright::reality::answers_test {
namespace {

// What an answer is worth, the worst first.
enum class Answer { wrong, healthy, unexplained, beside, among, alone };

constexpr std::string_view name(Answer answer) {
  constexpr std::array<std::string_view, 6> names = {
      "explained by a wrong cause",       "called healthy",    "unexplained or ambiguous without the cause",
      "beside a cause that is not there", "among the answers", "alone and explained"};
  return names[static_cast<std::size_t>(answer)];
}

// A lag, a dead time and a late clock delay efforts all the same: which of them it is depends on the law.
std::string family(const std::string& effect) {
  return effect == "delay" || effect == "sensor_time_offset" ? "actuator_lag" : effect;
}

std::set<std::string> causes_of(const Diagnosis& found) {
  std::set<std::string> causes;
  for (const gap::GapCause& cause : found.causes) {
    causes.insert(family(cause.effect));
  }
  return causes;
}

Answer judge(const Diagnosis& found, const std::string& truth) {
  const std::set<std::string> causes = causes_of(found);
  const bool explained = found.verdict == gap::GapVerdict::explained;
  if (found.verdict == gap::GapVerdict::no_gap) {
    return Answer::healthy;
  }
  if (explained && causes == std::set{truth}) {
    return Answer::alone;
  }
  if (std::ranges::any_of(found.credible, [&](const gap::CredibleCauses& c) {
        return c.effects.size() == 1 && family(c.effects[0]) == truth;
      })) {
    return Answer::among;
  }
  if (causes.contains(truth)) {
    return Answer::beside;
  }
  return explained ? Answer::wrong : Answer::unexplained;
}

// "effect/law", as it is called in docs/methods/gap.md.
std::string called(const Subject& subject) {
  return fmt::format("{}/{}", subject.entry->name, subject.law != nullptr ? subject.law->name : "given");
}

// Laws whose answer is not the effect alone: the least that the answer is worth. None may be `wrong` or `healthy`.
const std::map<std::string, Answer, std::less<>>& less_than_alone() {
  static const std::map<std::string, Answer, std::less<>> laws = {
      // What looks alike on one drive: a radius and its encoder's scale, a payload and what it moves, forces of castors
      // and of scrub.
      {"wheel_radius_asymmetric/given", Answer::among},
      {"encoder_scale/given", Answer::among},
      {"payload/given", Answer::among},
      {"caster_drag/bristle", Answer::among},
      {"lateral_scrub/bristle", Answer::among},
      {"lateral_scrub/side_slip", Answer::among},
      // Slip that only creeps is a clock that lags.
      {"longitudinal_slip/linear_sliding", Answer::among},
      {"longitudinal_slip/contact", Answer::among},
      // The cause's columns come near, and what they leave is above the floor.
      {"coulomb/lugre", Answer::among},
      {"friction_drift/logistic", Answer::among},
      {"caster_drag/swivel", Answer::among},
      {"torque_deadzone/play", Answer::among},
      {"saturation/speed_line", Answer::among},
      {"saturation/table", Answer::among},
      {"backlash/play", Answer::among},
      {"backlash/restitution", Answer::among},
      {"coulomb/atan", Answer::beside},
      {"stribeck/lorentzian", Answer::beside},
      {"quadratic_drag/transition", Answer::beside},
      {"caster_drag/power", Answer::beside},
      {"actuator_lag/second_order", Answer::beside},
      {"saturation/tanh", Answer::beside},
      {"viscous/eyring", Answer::beside},
      // No columns of the catalogue come near at this size: honest, and without the cause.
      {"coulomb_asymmetric/dahl", Answer::unexplained},
      {"quadratic_drag/fluid", Answer::unexplained},
      {"caster_drag/contact", Answer::unexplained},
      {"actuator_lag/rate_limit", Answer::unexplained},
      {"wheel_out_of_round/off_centre", Answer::unexplained},
      {"wheel_out_of_round/flat_spot", Answer::unexplained},
      {"longitudinal_slip/pacejka", Answer::unexplained},
  };
  return laws;
}

// The case of this number, or the next of the same law where the engine cannot follow it.
Case drawn(const Request& request, std::size_t number) {
  try {
    return make_case(request, number);
  } catch (const std::runtime_error&) {
    return make_case(request, number + subjects().size());
  }
}

class SlowGapAnswers : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SlowGapAnswers, IsWorthWhatIsExpected) {
  Request request;
  request.seed = 4711;
  request.low = 3.0;
  request.high = 60.0;
  request.duration = 60.0;
  request.each = true;
  const Case c = drawn(request, GetParam());
  const std::string subject = called(c.causes.at(0).of);
  const Robot robot = robots::parse_robot(robot_yaml(c.robot, "case"), "robot.yaml");
  TableSource real(c.real), healthy(c.baseline);
  gap::DiagnoseOptions options;
  options.shrink = false;
  const Diagnosis found = gap::diagnose(real, &healthy, robot, options);
  const auto listed = less_than_alone().find(subject);
  const Answer expected = listed == less_than_alone().end() ? Answer::alone : listed->second;
  const Answer answer = judge(found, family(std::string(c.causes[0].of.entry->name)));
  fmt::print("{}: {} ({})\n", subject, name(answer), fmt::join(causes_of(found), " + "));
  EXPECT_TRUE(answer >= expected) << "expected: " << name(expected);
}

INSTANTIATE_TEST_SUITE_P(All, SlowGapAnswers, ::testing::Range(std::size_t{0}, subjects().size()),
                         [](const auto& tested) {
                           std::string text = called(subjects()[tested.param]);
                           std::ranges::replace(text, '/', '_');
                           return text;
                         });

}  // namespace
}  // namespace wheelwright::reality::answers_test
