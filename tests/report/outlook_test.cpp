// SPDX-License-Identifier: Apache-2.0
// The first screen of a detector's page: size over time to detection, a line for each guarantee, and what each is
// worth.
#include "results/report/outlook.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/report/commission_report.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/text.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::report::outlook_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Looked {
  Commissioning result;
  commission::MarginSurvey seen;
};

Looked looked(bool averaging) {
  Scenario s = testing_support::noisy_drive(2, 30.0);
  s.robot.effort_changes = model::EffortChanges::at_samples;
  if (averaging) {
    s.robot.noise.effort.bias = 0.0;
  }
  Simulation log(s);
  Looked looked{commission_robot(log, s.robot), {}};
  looked.seen = commission::first_look(log, looked.result.model).value();
  return looked;
}

std::size_t times(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++n;
  }
  return n;
}

TEST(Outlook, APageBeginsWithBothGuarantees) {
  const Looked l = looked(true);
  ASSERT_TRUE(l.seen.at_risk);
  const std::string html = outlook(l.seen, l.result.model);
  EXPECT_EQ(times(html, "<svg"), 3U);
  EXPECT_EQ(times(html, "<small>every noise</small>"), 3U);
  EXPECT_EQ(times(html, "<small>at the stated risk</small>"), 3U);
  EXPECT_THAT(html, HasSubstr("never missed"));
  EXPECT_THAT(html, HasSubstr("(one in "));
  EXPECT_THAT(html, HasSubstr("one false alarm is to be expected in 10 years"));
  CommissionContext context;
  context.seen = l.seen;
  const std::string page = commission_report(l.result, context);
  const std::size_t first = page.find("What this detector will see");
  ASSERT_NE(first, std::string::npos);
  EXPECT_LT(first, page.find(words::escape_with_code(words::commission_words(l.result).front())));
}

TEST(Outlook, SaysWhyThereIsNoLineAtARisk) {
  const Looked l = looked(false);
  const std::string html = outlook(l.seen, l.result.model);
  EXPECT_THAT(html, HasSubstr("Nothing is said at a stated risk: "));
  EXPECT_THAT(html, Not(HasSubstr("<small>at the stated risk</small>")));
}

}  // namespace
}  // namespace wheelwright::report::outlook_test
