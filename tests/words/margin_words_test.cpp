// SPDX-License-Identifier: Apache-2.0
// Sizes in words are still certain: two digits, upwards, whatever their magnitude.
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "results/words/detect_words.hpp"

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

TEST(MarginWords, OddsAreNoBetterThanTheChance) {
  EXPECT_EQ(odds_words(1.7e-9), "one in 580 million");
  EXPECT_EQ(odds_words(1e-3), "one in " + count(1000));
  EXPECT_EQ(odds_words(0.03), "one in 33");
}

// The larger of both sides, of each side the better residual.
TEST(MarginWords, CurvesOfDetectionTakeTheHarderSide) {
  const auto margins = [](double side, std::vector<double> certain) {
    detector::FaultMargins m;
    m.fault = {.name = "wheel_radius", .unit = "1", .range = {-0.5, 0.5}};
    m.side = side;
    m.onsets.resize(1);
    m.onsets[0].certain = std::move(certain);
    return m;
  };
  constexpr double none = std::numeric_limits<double>::infinity();
  commission::MarginSurvey survey;
  survey.windows = {1.0, 5.0};
  survey.residuals.resize(2);
  survey.residuals[0].margins = {margins(1.0, {0.2, 0.1}), margins(-1.0, {none, 0.3})};
  survey.residuals[1].margins = {margins(1.0, {0.05, 0.05}), margins(-1.0, {none, 0.2})};
  const auto curves = detection_curves(survey, {"wheel_radius"});
  ASSERT_EQ(curves.size(), 1U);
  const std::vector<std::pair<double, double>> expected = {{5.0, 0.2}};
  EXPECT_EQ(curves[0].every_noise, expected);
  EXPECT_TRUE(curves[0].at_risk.empty());
  EXPECT_EQ(DetectionCurve::size_within(curves[0].every_noise, 20.0), 0.2);
  EXPECT_EQ(DetectionCurve::size_within(curves[0].every_noise, 1.0), none);
}

}  // namespace
}  // namespace wheelwright::words::margin_words_test
