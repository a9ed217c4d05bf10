// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exact rational oracles for small sets: every number of a test is a double, hence a rational.
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <boost/multiprecision/cpp_int.hpp>

#include "bounds/certificate.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds::exact {

using Rational = boost::multiprecision::cpp_rational;

/// The double as the rational that it is.
inline Rational rational(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  const auto integer = static_cast<long long>(std::ldexp(mantissa, 53));
  exponent -= 53;
  const boost::multiprecision::cpp_int power = boost::multiprecision::cpp_int(1) << std::abs(exponent);
  return exponent >= 0 ? Rational(integer) * Rational(power) : Rational(integer) / Rational(power);
}

struct Row {
  std::vector<Rational> a;
  Rational b;
};

inline std::vector<Row> rows_of(std::span<const HalfSpace> rows, const Box& box) {
  std::vector<Row> result;
  const auto take = [&](const HalfSpace& row) {
    Row exact{{}, rational(row.b)};
    for (const double x : row.a) {
      exact.a.push_back(rational(x));
    }
    result.push_back(std::move(exact));
  };
  for (const HalfSpace& row : rows) {
    take(row);
  }
  for (const HalfSpace& side : sides_as_rows(box)) {
    take(side);
  }
  return result;
}

/// The point where the chosen rows meet, or nothing where they are dependent (Gauss and Jordan).
inline std::optional<std::vector<Rational>> meet(const std::vector<Row>& rows, const std::vector<std::size_t>& chosen) {
  const std::size_t p = chosen.size();
  std::vector<Row> m;
  for (const std::size_t i : chosen) {
    m.push_back(rows[i]);
  }
  for (std::size_t c = 0; c < p; ++c) {
    std::size_t pivot = c;
    while (pivot < p && m[pivot].a[c] == 0) {
      ++pivot;
    }
    if (pivot == p) {
      return std::nullopt;
    }
    std::swap(m[c], m[pivot]);
    for (std::size_t r = 0; r < p; ++r) {
      if (r != c && m[r].a[c] != 0) {
        const Rational f = m[r].a[c] / m[c].a[c];
        for (std::size_t k = c; k < p; ++k) {
          m[r].a[k] -= f * m[c].a[k];
        }
        m[r].b -= f * m[c].b;
      }
    }
  }
  std::vector<Rational> x(p);
  for (std::size_t c = 0; c < p; ++c) {
    x[c] = m[c].b / m[c].a[c];
  }
  return x;
}

inline Rational dot(const std::vector<Rational>& a, const std::vector<Rational>& x) {
  Rational sum = 0;
  for (std::size_t j = 0; j < a.size(); ++j) {
    sum += a[j] * x[j];
  }
  return sum;
}

/// The smallest double that is not below x.
inline double rounded_up(const Rational& x) {
  auto guess = static_cast<double>(x);
  while (rational(guess) < x) {
    guess = core::round_up(guess);
  }
  while (rational(core::round_down(guess)) >= x) {
    guess = core::round_down(guess);
  }
  return guess;
}

/// The smallest double >= |y − Y·θ|: a bound on the noise of a row that θ meets exactly.
inline double noise_of(const std::vector<double>& Y, const std::vector<double>& theta, double y) {
  Rational rest = rational(y);
  for (std::size_t j = 0; j < Y.size(); ++j) {
    rest -= rational(Y[j]) * rational(theta[j]);
  }
  return rounded_up(abs(rest));
}

/// True if θ satisfies every row exactly.
inline bool satisfies(std::span<const HalfSpace> rows, std::span<const double> theta) {
  for (const HalfSpace& row : rows) {
    Rational left = 0;
    for (std::size_t j = 0; j < theta.size(); ++j) {
      left += rational(row.a[static_cast<Eigen::Index>(j)]) * rational(theta[j]);
    }
    if (left > rational(row.b)) {
      return false;
    }
  }
  return true;
}

/// `at`, which is a point of { row·θ <= b } but for rounding, moved towards the inner point `inside` until it is one.
inline std::vector<double> pulled_inside(std::span<const HalfSpace> rows, std::span<const double> at,
                                         std::span<const double> inside) {
  std::vector<double> point(at.begin(), at.end());
  for (double step = 0x1p-53; step <= 1.0 && !satisfies(rows, point); step *= 2.0) {
    for (std::size_t j = 0; j < point.size(); ++j) {
      point[j] = at[j] + step * (inside[j] - at[j]);
    }
  }
  return point;
}

/// a·θ.
inline Rational dot(std::span<const double> a, std::span<const double> theta) {
  Rational sum = 0;
  for (std::size_t j = 0; j < a.size(); ++j) {
    sum += rational(a[j]) * rational(theta[j]);
  }
  return sum;
}

/// All vertices of { row·θ <= b }: every p-subset of rows is tried. For p <= 3 and tens of rows.
inline std::vector<std::vector<Rational>> vertices(const std::vector<Row>& rows, std::size_t p) {
  std::vector<std::vector<Rational>> found;
  std::vector<std::size_t> chosen(p);
  for (std::size_t i = 0; i < p; ++i) {
    chosen[i] = i;
  }
  while (true) {
    if (const auto x = meet(rows, chosen)) {
      bool inside = true;
      for (const Row& row : rows) {
        inside = inside && dot(row.a, *x) <= row.b;
      }
      if (inside) {
        found.push_back(*x);
      }
    }
    std::size_t k = p;
    while (k > 0 && chosen[k - 1] == rows.size() - p + k - 1) {
      --k;
    }
    if (k == 0) {
      return found;
    }
    ++chosen[k - 1];
    for (std::size_t i = k; i < p; ++i) {
      chosen[i] = chosen[i - 1] + 1;
    }
  }
}

/// True if Σ λ(b − a·θ) < 0 for every θ of the box, in exact arithmetic: the rows contradict each other.
inline bool contradict(std::span<const WeightedRow> members, const Box& box) {
  std::vector<Rational> combined(box.dimension(), 0);
  Rational bound = 0;
  for (const WeightedRow& weighted : members) {
    const Rational lambda = rational(weighted.multiplier);
    if (lambda < 0) {
      return false;
    }
    bound += lambda * rational(weighted.row.b);
    for (std::size_t j = 0; j < box.dimension(); ++j) {
      combined[j] += lambda * rational(weighted.row.a[static_cast<Eigen::Index>(j)]);
    }
  }
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    const Rational lower = -combined[j] * rational(box.sides[j].lower),
                   upper = -combined[j] * rational(box.sides[j].upper);
    bound += lower > upper ? lower : upper;
  }
  return bound < 0;
}

}  // namespace wheelwright::bounds::exact
