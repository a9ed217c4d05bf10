// SPDX-License-Identifier: Apache-2.0
#include "formats/files/words.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace wheelwright::files::number_test {
namespace {

std::uint64_t bits(double value) { return std::bit_cast<std::uint64_t>(value); }

TEST(Number, ReadsWhatTheCLibraryReads) {
  std::mt19937_64 random(1);
  char text[64];
  for (int k = 0; k < 200000; ++k) {
    const double mantissa = static_cast<double>(static_cast<std::int64_t>(random())) / 9.3e18;
    const int exponent = static_cast<int>(random() % 60) - 30;
    const double value = k % 7 == 0 ? std::bit_cast<double>(random()) : std::ldexp(mantissa, exponent);
    if (!std::isfinite(value)) {
      continue;
    }
    const int digits = static_cast<int>(random() % 20);
    const char* formats[] = {"%.*f", "%.*e", "%.*g", "%+.*e"};
    const char* format = formats[std::abs(value) > 1e40 ? 1 + random() % 3 : random() % 4];
    std::snprintf(text, sizeof text, format, digits, value);
    const auto read = to_number(text);
    ASSERT_TRUE(read.has_value()) << text;
    ASSERT_EQ(bits(*read), bits(std::strtod(text, nullptr))) << text;
  }
}

// Numbers as logs have them: the shortest text of a double, and any 17 or 18 digits.
TEST(Number, ReadsLongNumbersOfLogs) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 300000; ++k) {
    const std::uint64_t digits = random() % 1000000000000000000;
    std::string text = std::to_string(digits);
    if (k % 2 == 0) {
      text = number_text(std::ldexp(static_cast<double>(digits) / 1e18, static_cast<int>(random() % 80) - 60));
    } else if (k % 3 == 0) {
      text += "e-" + std::to_string(random() % 30);
    } else {
      text.insert(random() % text.size(), ".");
    }
    ASSERT_EQ(bits(to_number(text).value()), bits(std::strtod(text.c_str(), nullptr))) << text;
  }
}

// In the middle between two doubles, and a digit to either side of it.
TEST(Number, RoundsTheMiddleOfTwoDoublesToEven) {
  std::mt19937_64 random(4);
  for (int k = 0; k < 100000; ++k) {
    const std::uint64_t whole = (std::uint64_t{1} << 52) + random() % (std::uint64_t{1} << 52);
    const std::string halves = std::to_string(whole) + ".5";
    const std::string quarters = std::to_string(whole / 2) + (k % 2 == 0 ? ".25" : ".75");
    for (const std::string& text : {halves, quarters, halves + "1", std::to_string(whole) + ".49"}) {
      ASSERT_EQ(bits(to_number(text).value()), bits(std::strtod(text.c_str(), nullptr))) << text;
    }
  }
}

TEST(Number, RoundsHalfwayCasesToEven) {
  for (const char* text :
       {"9007199254740993", "9007199254740991", "1.00000000000000011102230246251565", "0.1e23", "1e23",
        "123456789012345678", "8.5e-22", "0.3", "2.2250738585072011e-308", "4.9e-324", "-0.0", "-0"}) {
    ASSERT_EQ(bits(to_number(text).value()), bits(std::strtod(text, nullptr))) << text;
  }
}

TEST(Number, BeyondTheRangeIsInfinityOrZero) {
  EXPECT_EQ(to_number("1e999").value(), INFINITY);
  EXPECT_EQ(to_number("-1e99999").value(), -INFINITY);
  EXPECT_EQ(to_number("1e-999").value(), 0.0);
  EXPECT_EQ(to_number("0.0001e400").value(), INFINITY);
  EXPECT_EQ(to_number(std::string(400, '9')).value(), INFINITY);
  EXPECT_EQ(to_number("0." + std::string(400, '0') + "1").value(), 0.0);
}

TEST(Number, KnowsNanAndInfinity) {
  for (const char* text : {"nan", "NaN", "-nan", "NAN"}) {
    EXPECT_TRUE(std::isnan(to_number(text).value())) << text;
  }
  EXPECT_EQ(to_number("inf").value(), INFINITY);
  EXPECT_EQ(to_number("-Infinity").value(), -INFINITY);
}

TEST(Number, RejectsWhatIsNoNumber) {
  for (const char* text : {"", " ", "abc", "1,5", "1.2.3", "0x10", "--1", "+-1", "-", "+", ".", "e5", "1e", "1e+",
                           "1 2", "12:30", "1_000", "1.5m"}) {
    EXPECT_FALSE(to_number(text).has_value()) << text;
  }
}

TEST(Number, TextReadsBackExactly) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 100000; ++k) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) {
      ASSERT_EQ(bits(to_number(number_text(value)).value()), bits(value));
    }
  }
  EXPECT_EQ(number_text(0.1), "0.1");
}

}  // namespace
}  // namespace wheelwright::files::number_test
