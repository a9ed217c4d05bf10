// SPDX-License-Identifier: Apache-2.0
#include "core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include "core/check.hpp"

namespace wheelwright::core {

namespace bm = boost::math;

namespace {

double freedoms(double value) { return check::positive(value, "degrees of freedom"); }

double student_freedom(double value) {
  check::that(value > 0.0, "degrees of freedom", "a number > 0");
  return value;
}

// Of a variable that is never negative.
double outcome(double x) {
  check::that(x >= 0.0, "x", "a number >= 0");
  return x;
}

double probability(double value) {
  check::that(value > 0.0 && value < 1.0, "probability", "a number inside (0, 1)");
  return value;
}

}  // namespace

double order_statistic(std::vector<double> values, std::size_t rank) {
  check::that(rank < values.size(), "rank", "less than the number of values");
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) {
    return 0.0;
  }
  const auto rank = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1));
  return order_statistic(std::move(values), rank);
}

double median(std::vector<double> values) {
  const std::size_t middle = values.size() / 2;
  return order_statistic(std::move(values), middle);
}

double normal_upper_quantile(double risk) { return bm::quantile(bm::complement(bm::normal(), probability(risk))); }

double chi_squared_tail(double freedom, double x) {
  const bm::chi_squared variable(freedoms(freedom));
  return std::isinf(outcome(x)) ? 0.0 : bm::cdf(bm::complement(variable, x));
}
double chi_squared_quantile(double freedom, double p) {
  return bm::quantile(bm::chi_squared(freedoms(freedom)), probability(p));
}
double chi_squared_median(double freedom) { return bm::median(bm::chi_squared(freedoms(freedom))); }

double student_tail(double freedom, double t) {
  check::that(!std::isnan(t), "t", "a number");
  return bm::cdf(bm::complement(bm::students_t(student_freedom(freedom)), t));
}
double student_quantile_below(double freedom, double p) {
  return bm::quantile(bm::students_t(student_freedom(freedom)), probability(p));
}

double student_quantile(double confidence, double freedom) {
  check::that(confidence > 0.0 && confidence < 1.0, "confidence", "a number inside (0, 1)");
  return student_quantile_below(freedom, 0.5 + 0.5 * confidence);
}

double fisher_tail(double above, double below, double x) {
  const bm::fisher_f variable(freedoms(above), freedoms(below));
  return std::isinf(outcome(x)) ? 0.0 : bm::cdf(bm::complement(variable, x));
}
double fisher_upper_quantile(double above, double below, double risk) {
  return bm::quantile(bm::complement(bm::fisher_f(freedoms(above), freedoms(below)), probability(risk)));
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double running = 0.0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double left = static_cast<double>(order.size() - k);
    running = std::max(running, std::min(1.0, left * p[order[k]]));
    adjusted[order[k]] = running;
  }
  return adjusted;
}

}  // namespace wheelwright::core
