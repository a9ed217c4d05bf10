// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/statistics.hpp"

namespace wheelwright::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(Statistics, OrderStatistics) {
  const std::vector<double> values = {3.0, -1.0, 4.0, 1.0, -5.0, 9.0};
  EXPECT_EQ(order_statistic(values, 0), -5.0);
  EXPECT_EQ(order_statistic(values, 5), 9.0);
  EXPECT_EQ(median(values), 3.0);  // of the two middle ones the larger
  EXPECT_EQ(median({2.0, 7.0, 1.0}), 2.0);
  EXPECT_THROW(static_cast<void>(order_statistic(values, 6)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(median({})), InvalidArgument);
}

// NIST/SEMATECH e-Handbook of Statistical Methods, tables 1.3.6.7.1 to 1.3.6.7.4.
TEST(Statistics, PublishedTables) {
  EXPECT_NEAR(normal_upper_quantile(0.025), 1.960, 5e-4);
  EXPECT_NEAR(student_quantile_below(10.0, 0.975), 2.228, 5e-4);
  EXPECT_NEAR(student_quantile_below(1.0, 0.999), 318.313, 5e-3);
  EXPECT_NEAR(chi_squared_quantile(5.0, 0.95), 11.070, 5e-4);
  EXPECT_NEAR(chi_squared_quantile(10.0, 0.025), 3.247, 5e-4);
  EXPECT_NEAR(fisher_upper_quantile(3.0, 10.0, 0.05), 3.708, 5e-4);
  EXPECT_NEAR(fisher_upper_quantile(10.0, 20.0, 0.01), 3.368, 5e-4);
}

// Closed forms: Student's with one and two degrees of freedom, chi-squared with two, Fisher's with two above.
TEST(Statistics, TailsKeepTheirDigits) {
  for (const double t : {-3.0, 0.0, 0.5, 7.0, 1e3, 1e8}) {
    EXPECT_NEAR(student_tail(1.0, t) / (std::atan2(1.0, t) / M_PI), 1.0, 1e-12) << t;
  }
  for (const double t : {0.5, 7.0, 1e3, 1e6}) {
    const double root = std::sqrt(2.0 + t * t);
    EXPECT_NEAR(student_tail(2.0, t) * (root * (root + t)), 1.0, 1e-12) << t;
  }
  for (const double x : {0.0, 1.0, 40.0, 1200.0}) {
    EXPECT_NEAR(chi_squared_tail(2.0, x) / std::exp(-0.5 * x), 1.0, 1e-12) << x;
    EXPECT_NEAR(fisher_tail(2.0, 6.0, x) * std::pow(1.0 + x / 3.0, 3.0), 1.0, 1e-12) << x;
  }
  EXPECT_NEAR(chi_squared_median(2.0), 2.0 * std::log(2.0), 1e-14);
}

TEST(Statistics, QuantilesTakeBackTails) {
  for (const double risk : {0.4, 1e-3, 1e-9}) {
    EXPECT_NEAR(std::erfc(normal_upper_quantile(risk) / std::sqrt(2.0)) / (2.0 * risk), 1.0, 1e-12);
    EXPECT_NEAR(fisher_tail(3.0, 8.0, fisher_upper_quantile(3.0, 8.0, risk)) / risk, 1.0, 1e-10);
  }
  EXPECT_EQ(student_quantile(0.95, 7.0), student_quantile_below(7.0, 0.975));
  EXPECT_NEAR(student_quantile_below(kInfinity, 0.975), normal_upper_quantile(0.025), 1e-14);
}

TEST(Statistics, WhatIsOutsideTheRangeIsRefused) {
  for (const double p : {-0.1, 0.0, 1.0, kNaN}) {
    EXPECT_THROW(static_cast<void>(normal_upper_quantile(p)), InvalidArgument) << p;
    EXPECT_THROW(static_cast<void>(student_quantile(p, 3.0)), InvalidArgument) << p;
    EXPECT_THROW(static_cast<void>(chi_squared_quantile(3.0, p)), InvalidArgument) << p;
    EXPECT_THROW(static_cast<void>(fisher_upper_quantile(3.0, 3.0, p)), InvalidArgument) << p;
  }
  for (const double freedom : {-1.0, 0.0, kNaN}) {
    EXPECT_THROW(static_cast<void>(student_tail(freedom, 1.0)), InvalidArgument) << freedom;
    EXPECT_THROW(static_cast<void>(chi_squared_median(freedom)), InvalidArgument) << freedom;
    EXPECT_THROW(static_cast<void>(fisher_tail(freedom, 1.0, 1.0)), InvalidArgument) << freedom;
  }
  EXPECT_THROW(static_cast<void>(student_tail(1.0, kNaN)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(chi_squared_tail(1.0, -1.0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(fisher_tail(1.0, 1.0, kNaN)), InvalidArgument);
}

TEST(Statistics, InfiniteOutcomesHaveNoTail) {
  EXPECT_EQ(student_tail(3.0, kInfinity), 0.0);
  EXPECT_EQ(student_tail(3.0, -kInfinity), 1.0);
  EXPECT_EQ(chi_squared_tail(3.0, kInfinity), 0.0);
  EXPECT_EQ(fisher_tail(3.0, 4.0, kInfinity), 0.0);
}

TEST(Holm, IsTheTextbookExample) {
  // Holm 1979: 4·0.01, then 3·0.02 and so on, never falling.
  const std::vector<double> adjusted = holm({0.02, 0.01, 0.9, 0.03});
  EXPECT_DOUBLE_EQ(adjusted[1], 0.04);
  EXPECT_DOUBLE_EQ(adjusted[0], 0.06);
  EXPECT_DOUBLE_EQ(adjusted[3], 0.06);
  EXPECT_DOUBLE_EQ(adjusted[2], 0.9);
  EXPECT_TRUE(holm({}).empty());
}

}  // namespace
}  // namespace wheelwright::core
