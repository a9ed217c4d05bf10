// SPDX-License-Identifier: Apache-2.0
// Sizes in words are still certain: two digits, upwards, whatever their magnitude.
#include <limits>

#include <gtest/gtest.h>

#include <wheelwright/words/detect_words.hpp>

namespace wheelwright::words::margin_words_test {
namespace {

TEST(MarginWords, AreTwoDigitsUpwards) {
  const FaultType share{.name = "share", .unit = "1"}, mass{.name = "mass", .unit = "kg"};
  EXPECT_EQ(magnitude_words(share, 0.0461), "4.7 %");
  EXPECT_EQ(magnitude_words(share, 0.05), "5 %");
  EXPECT_EQ(magnitude_words(share, 0.991), "100 %");
  EXPECT_EQ(magnitude_words(mass, 181.0), "190 kg");
  EXPECT_EQ(magnitude_words(mass, 12345.0), "13000 kg");
  EXPECT_EQ(magnitude_words(mass, 0.00301), "0.0031 kg");
  EXPECT_EQ(magnitude_words(mass, std::numeric_limits<double>::infinity()), "–");
}

}  // namespace
}  // namespace wheelwright::words::margin_words_test
