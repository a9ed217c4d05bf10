// SPDX-License-Identifier: Apache-2.0
#include "results/words/text.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "results/report/page.hpp"

namespace wheelwright::words {
namespace {

// Reads what the text functions write; no exponents.
double value(std::string text) {
  for (const auto& [from, to] : {std::pair{"−", "-"}, {"\u202f", ""}}) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from)) {
      text.replace(at, std::string(from).size(), to);
    }
  }
  return std::stod(text);
}

TEST(EscapeWithCode, TurnsBackticksIntoCode) {
  EXPECT_EQ(escape_with_code("say `a < b` & `c`"), "say <code>a &lt; b</code> &amp; <code>c</code>");
  EXPECT_EQ(escape_with_code("one ` alone"), "one ` alone");
  EXPECT_EQ(escape_with_code("`<script>`"), "<code>&lt;script&gt;</code>");
}

TEST(Escape, LeavesNothingThatMarkupWouldRead) {
  EXPECT_EQ(escape("<b a=\"1\" c='2'>&amp;"), "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;amp;");
  EXPECT_EQ(escape("τ_f µ — plain"), "τ_f µ — plain");
  EXPECT_EQ(escape(std::string("a\0b\x07", 4)), "a\ufffdb\ufffd");
}

TEST(Number, HasTheDigitsThatWereAskedFor) {
  EXPECT_EQ(number(21.34), "21.3");
  EXPECT_EQ(number(21.0, 4), "21.00");
  EXPECT_EQ(number(-0.020951), "−0.0210");
  EXPECT_EQ(number(9.996), "10.0");
  EXPECT_EQ(number(0.0), "0");
  EXPECT_EQ(number(1.2e-7), "1.20·10⁻⁷");
  EXPECT_EQ(number(-3.0e8, 2), "−3.0·10⁸");
  EXPECT_EQ(number(12345.0), "12\u202f345");
  EXPECT_EQ(number(std::nan("")), "–");
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "–");
}

TEST(Number, IsWithinHalfAUnitOfItsLastDigit) {
  std::mt19937_64 generator(1);
  for (int i = 0; i < 2000; ++i) {
    const double exponent = -3.0 + 7.0 * std::ldexp(static_cast<double>(generator() >> 11), -53);
    const double x = std::pow(10.0, exponent);
    EXPECT_NEAR(value(number(x)) / x, 1.0, 0.5e-2 + 1e-12) << x;
  }
}

TEST(Outward, ContainsTheInterval) {
  std::mt19937_64 generator(2);
  const auto uniform = [&] { return std::ldexp(static_cast<double>(generator() >> 11), -53); };
  for (int i = 0; i < 2000; ++i) {
    const double lower = -50.0 + 100.0 * uniform();
    const double upper = lower + std::pow(10.0, -3.0 + 4.0 * uniform());
    const auto [a, b] = outward(lower, upper);
    // The text of a decimal is read back with a relative error of 2⁻⁵³; the bound itself is allowed 1e-9 of a unit.
    const double slack = 1e-9 * (upper - lower);
    EXPECT_LE(value(a), lower + slack) << a;
    EXPECT_GE(value(b), upper - slack) << b;
    EXPECT_LE(value(b) - value(a), 1.25 * (upper - lower)) << a << " to " << b;
  }
}

TEST(Outward, KeepsADecimalAsItIs) {
  EXPECT_EQ(outward(20.9, 21.7), (std::pair<std::string, std::string>("20.90", "21.70")));
}

TEST(Percent, NeverCallsAPartTheWhole) {
  EXPECT_EQ(percent(0.0414), "4.14 %");
  EXPECT_EQ(percent(1.0), "100 %");
  EXPECT_EQ(percent(0.0), "0 %");
  EXPECT_EQ(percent(0.99999), "99.999 %");
  EXPECT_EQ(percent(std::nan("")), "–");
}

TEST(Plural, CountsInWords) {
  EXPECT_EQ(plural(0, "event"), "no events");
  EXPECT_EQ(plural(1, "event"), "1 event");
  EXPECT_EQ(plural(12000, "event"), "12\u202f000 events");
  EXPECT_EQ(core::enumerated({"a", "b", "c"}), "a, b and c");
}

TEST(TimeAxis, CountsFromTheStartOfAnEpochClock) {
  const TimeAxis epoch({1.7e9 + 0.25, 1.7e9 + 1.25});
  EXPECT_EQ(epoch.origin(), 1.7e9);
  EXPECT_EQ(epoch.text(1.7e9 + 1.25), "1.250\u00a0s");
  EXPECT_EQ(TimeAxis({3.0, 4.0}).origin(), 0.0);
}

TEST(TimeAxis, LaysRunsEndToEnd) {
  const std::vector<double> t = {0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.5, 1.5};
  const TimeAxis axis(t);
  EXPECT_TRUE(axis.repeats());
  const std::vector<double> laid = axis.lay(t);
  for (std::size_t i = 1; i < laid.size(); ++i) {
    EXPECT_GT(laid[i], laid[i - 1]) << i;
  }
  EXPECT_DOUBLE_EQ(laid[5] - laid[3], 2.0);  // within a run nothing is stretched
  EXPECT_FALSE(TimeAxis({0.0, 1.0}).repeats());
}

}  // namespace
}  // namespace wheelwright::words
