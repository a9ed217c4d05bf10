// SPDX-License-Identifier: Apache-2.0
#include "bounds/check_certificate.hpp"
#include "core/limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include <boost/multiprecision/cpp_int.hpp>

namespace wheelwright::bounds {
namespace {

using Rational = boost::multiprecision::cpp_rational;

constexpr std::size_t kMostNarrowings = 16;
constexpr double kNarrower = 1e-12;  // of its width: a side that gains less is not worth another round

/// The finite double as the rational that it is.
Rational rational(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  const auto digits = static_cast<long long>(std::ldexp(mantissa, 53));
  const boost::multiprecision::cpp_int power = boost::multiprecision::cpp_int(1) << std::abs(exponent - 53);
  return exponent >= 53 ? Rational(digits * power) : Rational(digits, power);
}

/// The smallest double that is not below `x`.
double double_above(const Rational& x) {
  const Rational largest = rational(std::numeric_limits<double>::max());
  if (x > largest || x < -largest) {
    return x > 0 ? core::kInfinity : -std::numeric_limits<double>::max();
  }
  auto guess = x.convert_to<double>();
  while (rational(guess) < x) {
    guess = std::nextafter(guess, core::kInfinity);
  }
  for (double below = guess;
       (below = std::nextafter(guess, -core::kInfinity)) > -core::kInfinity && rational(below) >= x;) {
    guess = below;
  }
  return guess;
}

std::string text(double x) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.3g", x);
  return buffer.data();
}

/// A box in rationals.
struct ExactBox {
  std::vector<Rational> lower, upper;

  explicit ExactBox(const Box& box) {
    for (const Interval& side : box.sides) {
      lower.push_back(rational(side.lower));
      upper.push_back(rational(side.upper));
    }
  }
  /// max r_j θ_j.
  [[nodiscard]] Rational most(std::size_t j, const Rational& r) const { return r * (r > 0 ? upper[j] : lower[j]); }
};

/// λ·b + Σ_j max r_j θ_j, and its terms.
struct Evaluation {
  Rational bound;
  std::vector<Rational> rest;  // r
};

Evaluation evaluate(std::span<const double> a, std::span<const WeightedRow> rows, const ExactBox& box,
                    std::optional<std::size_t> without = {}) {
  Evaluation e;
  for (const double coefficient : a) {
    e.rest.push_back(rational(coefficient));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == without || rows[i].multiplier == 0.0) {
      continue;
    }
    const Rational lambda = rational(rows[i].multiplier);
    e.bound += lambda * rational(rows[i].row.b);
    for (std::size_t j = 0; j < e.rest.size(); ++j) {
      e.rest[j] -= lambda * rational(rows[i].row.a[static_cast<Eigen::Index>(j)]);
    }
  }
  for (std::size_t j = 0; j < e.rest.size(); ++j) {
    e.bound += box.most(j, e.rest[j]);
  }
  return e;
}

CertificateCheck refused(std::string reason, std::optional<std::size_t> row = {}) {
  CertificateCheck check;
  check.bound = check.shortfall = core::kInfinity;
  check.row = row;
  check.reason = std::move(reason);
  return check;
}

/// Why `row` may not take part, or nothing.
std::string objection(const WeightedRow& row, const Box& box, const ExactBox& exact) {
  if (!std::isfinite(row.multiplier) || row.multiplier < 0.0) {
    return "has the multiplier " + text(row.multiplier) + ": expected a finite one >= 0";
  }
  if (row.row.a.size() != static_cast<Eigen::Index>(box.dimension())) {
    return "has " + std::to_string(row.row.a.size()) + " coefficients: expected " + std::to_string(box.dimension());
  }
  if (!row.row.a.allFinite() || !std::isfinite(row.row.b)) {
    return "has a coefficient or a right-hand side that is not finite";
  }
  if (row.row.origin.is_prior) {
    Rational reach = 0;
    for (std::size_t j = 0; j < box.dimension(); ++j) {
      reach += exact.most(j, rational(row.row.a[static_cast<Eigen::Index>(j)]));
    }
    if (reach > rational(row.row.b)) {
      return "is called a side of the box and does not hold in it";
    }
  }
  return {};
}

/// What is wrong with the question itself, or nothing.
std::optional<CertificateCheck> misstated(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box,
                                          double claimed) {
  const std::size_t p = box.dimension();
  if (!std::ranges::all_of(box.sides, [](const Interval& side) {
        return std::isfinite(side.lower) && std::isfinite(side.upper) && side.lower <= side.upper;
      })) {
    return refused("a side of the box is not finite, or its lower end is above its upper end");
  }
  if (a.size() != p || !std::ranges::all_of(a, [](double x) { return std::isfinite(x); })) {
    return refused("expected " + std::to_string(p) + " finite coefficients, one for each side of the box");
  }
  if (!std::isfinite(claimed)) {
    return refused("the claimed bound is not finite");
  }
  if (rows.size() > p + 1) {
    return refused(std::to_string(rows.size()) + " rows: expected at most " + std::to_string(p + 1) +
                   ", one more than parameters");
  }
  const ExactBox exact(box);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (const std::string why = objection(rows[i], box, exact); !why.empty()) {
      return refused("row " + std::to_string(i + 1) + " of the certificate " + why, i);
    }
  }
  return std::nullopt;
}

/// Where a proof that falls short loses most.
void blame(CertificateCheck& check, std::span<const double> a, std::span<const WeightedRow> rows, const ExactBox& box,
           const Evaluation& e) {
  Rational best = e.bound;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (const Rational others = evaluate(a, rows, box, i).bound; others < best) {
      best = others;
      check.row = i;
    }
  }
  // Every parameter's share is below the largest: one that cannot explain the shortfall is not named.
  Rational worst = rational(check.shortfall) / e.rest.size();
  for (std::size_t j = 0; j < e.rest.size(); ++j) {
    const Rational cost = abs(e.rest[j]) * (box.upper[j] - box.lower[j]);
    if (cost >= worst) {
      worst = cost;
      check.parameter = j;
    }
  }
}

std::string explanation(const CertificateCheck& check) {
  return "the certificate falls short of the claim by " + text(check.shortfall) +
         (check.row ? "; row " + std::to_string(*check.row + 1) + " of it spoils the proof" : "");
}

CertificateCheck compare(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box, double claimed,
                         bool strictly) {
  if (auto wrong = misstated(a, rows, box, claimed)) {
    return *std::move(wrong);
  }
  const ExactBox exact(box);
  const Evaluation e = evaluate(a, rows, exact);
  const Rational shortfall = e.bound - rational(claimed);
  CertificateCheck check;
  check.proved = strictly ? shortfall < 0 : shortfall <= 0;
  check.bound = double_above(e.bound);
  check.shortfall = double_above(shortfall);
  if (!check.proved) {
    blame(check, a, rows, exact, e);
    check.reason = explanation(check);
  }
  return check;
}

/// The better of a proof and of what the side of the box proves by itself: ±θ_j <= own.
CertificateCheck with_side(CertificateCheck proof, double own, double claimed) {
  if (!std::isfinite(proof.bound) || proof.bound < own) {
    return proof;
  }
  proof.bound = own;
  proof.shortfall = double_above(rational(own) - rational(claimed));
  proof.proved = own <= claimed;
  if (proof.proved) {
    proof.row.reset();
    proof.parameter.reset();
  }
  proof.reason = proof.proved ? std::string() : explanation(proof);
  return proof;
}

}  // namespace

CertificateCheck check_bound(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box,
                             double claimed) {
  return compare(a, rows, box, claimed, false);
}

CertificateCheck check_emptiness(std::span<const WeightedRow> rows, const Box& box) {
  const std::vector<double> zero(box.dimension(), 0.0);
  return compare(zero, rows, box, 0.0, true);
}

double exact_sum(std::span<const double> parts) {
  Rational sum;
  for (const double part : parts) {
    if (!std::isfinite(part)) {
      return core::kInfinity;
    }
    sum += rational(part);
  }
  return double_above(sum);
}

bool HullCheck::all_proved() const {
  return std::ranges::all_of(lower, &CertificateCheck::proved) && std::ranges::all_of(upper, &CertificateCheck::proved);
}

HullCheck check_hull(std::span<const BoundClaim> lower, std::span<const BoundClaim> upper, const Box& prior) {
  const std::size_t p = prior.dimension();
  check::that(lower.size() == p && upper.size() == p, "claims of a hull", "a lower and an upper one for each side");
  check_finite(prior, "prior box of a hull");
  HullCheck result{
      .lower = std::vector<CertificateCheck>(p), .upper = std::vector<CertificateCheck>(p), .proved = prior};
  bool narrower = true;
  while (narrower && !result.contradiction && !result.all_proved() && result.rounds < kMostNarrowings) {
    narrower = false;
    ++result.rounds;
    for (std::size_t k = 0; k < 2 * p && !result.contradiction; ++k) {
      const std::size_t j = k / 2;
      const bool is_upper = k % 2 != 0;
      const double sign = is_upper ? 1.0 : -1.0;
      const BoundClaim& claim = (is_upper ? upper : lower)[j];
      std::vector<double> axis(p, 0.0);
      axis[j] = sign;
      Interval& side = result.proved.sides[j];
      const double own = is_upper ? side.upper : -side.lower;
      CertificateCheck& check = (is_upper ? result.upper : result.lower)[j];
      check = check_bound(axis, claim.rows, result.proved, sign * claim.value);
      if (check.bound < own) {
        narrower = narrower || own - check.bound > kNarrower * side.width();
        (is_upper ? side.upper : side.lower) = sign * check.bound;
      }
      check = with_side(std::move(check), own, sign * claim.value);
      result.contradiction = side.lower > side.upper;
    }
  }
  if (result.contradiction) {
    CertificateCheck anything;
    anything.proved = true;
    anything.bound = anything.shortfall = -core::kInfinity;
    result.lower.assign(p, anything);
    result.upper.assign(p, anything);
  }
  return result;
}

}  // namespace wheelwright::bounds
