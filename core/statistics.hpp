// SPDX-License-Identifier: Apache-2.0
/// \file
/// Order statistics, and quantiles and tail probabilities of the distributions of classical tests.
///
/// Tail probabilities are computed as such, not as 1 minus the other tail: small risks keep their digits. Degrees of
/// freedom are > 0 and finite (Student's may be infinite: the normal distribution), probabilities inside (0, 1), and
/// other arguments where the variable can be, infinity included; else InvalidArgument.
#pragma once

#include <cstddef>
#include <vector>

namespace wheelwright::core {

/// The value of this rank, 0 the smallest. `rank` is less than the number of values.
[[nodiscard]] double order_statistic(std::vector<double> values, std::size_t rank);

/// The value of rank q (n − 1), rounded down; 0 where there are no values.
[[nodiscard]] double quantile(std::vector<double> values, double q);

/// The median of `values`, of two middle ones the larger. At least one value.
[[nodiscard]] double median(std::vector<double> values);

/// Upper quantile of the standard normal distribution: exceeded with probability `risk`.
[[nodiscard]] double normal_upper_quantile(double risk);

/// The probability that a chi-squared variable exceeds `x`.
[[nodiscard]] double chi_squared_tail(double freedom, double x);
/// Quantile `p` of the chi-squared distribution.
[[nodiscard]] double chi_squared_quantile(double freedom, double p);
[[nodiscard]] double chi_squared_median(double freedom);

/// The probability that Student's variable exceeds `t`.
[[nodiscard]] double student_tail(double freedom, double t);
/// Quantile `p` of Student's t distribution.
[[nodiscard]] double student_quantile_below(double freedom, double p);
/// The factor of a two-sided interval: |Student's variable| stays below it with probability `confidence`.
[[nodiscard]] double student_quantile(double confidence, double freedom);

/// The probability that Fisher's variable with freedoms `above` and `below` exceeds `x`.
[[nodiscard]] double fisher_tail(double above, double below, double x);
/// Upper quantile of Fisher's F distribution: exceeded with probability `risk`.
[[nodiscard]] double fisher_upper_quantile(double above, double below, double risk);

/// Holm's step-down adjustment (`holm1979`): rejecting where the adjusted p is at most α errs anywhere with a
/// probability of at most α, however the tests depend on one another. The order of `p` is kept; values are in [0, 1].
[[nodiscard]] std::vector<double> holm(const std::vector<double>& p);

}  // namespace wheelwright::core
