// SPDX-License-Identifier: Apache-2.0
// Oracle: the convolution integral itself, in 60-digit arithmetic, for inputs that are linear between samples.
#include "model/filter/kernel.hpp"

#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_bin_float.hpp>

namespace wheelwright::filter::exact_test {
namespace {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<60>>;

struct Signal {
  std::vector<double> t, u;
};

Signal random_signal(double beta, double beta_h, int samples, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Signal s;
  double t = 0.3;
  for (int k = 0; k < samples; ++k) {
    s.t.push_back(t);
    s.u.push_back(2.0 * unit(rng) - 1.0);
    t += (0.2 + 1.6 * unit(rng)) * beta_h / beta;
  }
  return s;
}

// ∫ e^{−β(T−s)} (T−s)^order ds over one piece by Taylor-free closed forms: with s = T − w, ∫ w^n e^{−βw} dw.
Real power_exponential(int n, const Real& beta, const Real& from, const Real& to) {
  const auto antiderivative = [&](const Real& w) {
    Real sum = 0;
    Real factor = 1;
    for (int k = 0; k <= n; ++k) {
      Real power = 1;
      for (int i = 0; i < n - k; ++i) {
        power *= w;
      }
      sum += factor * power / boost::multiprecision::pow(beta, k + 1);
      factor *= n - k;
    }
    return Real(-exp(-beta * w) * sum);
  };
  return antiderivative(to) - antiderivative(from);
}

// (t^order e^{−βt}) * u at the last sample.
Real convolution(const Signal& s, double beta, int order) {
  const Real b(beta);
  const Real T(s.t.back());
  Real sum = 0;
  for (std::size_t k = 0; k + 1 < s.t.size(); ++k) {
    const Real t0(s.t[k]), t1(s.t[k + 1]), u0(s.u[k]), u1(s.u[k + 1]);
    const Real slope = (u1 - u0) / (t1 - t0);
    const Real near = T - t1;
    const Real far = T - t0;
    // u = u0 + slope (T − w − t0)
    sum += (u0 + slope * (T - t0)) * power_exponential(order, b, near, far);
    sum -= slope * power_exponential(order + 1, b, near, far);
  }
  return sum;
}

class ExactFilter : public testing::TestWithParam<double> {};

TEST_P(ExactFilter, EqualsTheConvolutionIntegral) {
  const double beta_h = GetParam();
  const double beta = 7.0;
  std::mt19937_64 rng(11);
  for (int run = 0; run < 20; ++run) {
    const Signal s = random_signal(beta, beta_h, 60, rng);
    Cascade cascade;
    Cascade magnitude;  // the filter of |u|: the natural scale of a relative error
    for (std::size_t k = 1; k < s.t.size(); ++k) {
      const StepWeights w(beta, s.t[k] - s.t[k - 1]);
      cascade.linear(w, s.u[k - 1], s.u[k]);
      magnitude.linear(w, std::abs(s.u[k - 1]), std::abs(s.u[k]));
    }
    EXPECT_LE(abs(Real(cascade.z1) - convolution(s, beta, 0)).convert_to<double>(), 1e-12 * magnitude.z1);
    EXPECT_LE(abs(Real(cascade.z2) - convolution(s, beta, 1)).convert_to<double>(), 1e-12 * magnitude.z2);
  }
}

INSTANTIATE_TEST_SUITE_P(StepsOfAllSizes, ExactFilter,
                         testing::Values(1e-9, 1e-6, 1e-3, 0.1, 0.99, 1.0, 1.01, 5.0, 30.0, 1e3));

TEST(ExactFilter, IncrementsFilterTheDerivative) {
  const double beta = 5.0;
  std::mt19937_64 rng(3);
  const Signal s = random_signal(beta, 0.2, 200, rng);
  Cascade derivative, level;
  for (std::size_t k = 1; k < s.t.size(); ++k) {
    const StepWeights w(beta, s.t[k] - s.t[k - 1]);
    derivative.increment(w, s.u[k] - s.u[k - 1]);
    level.linear(w, s.u[k - 1], s.u[k]);
  }
  // f * u' = u − β f*u − e^{−βt} u(0), and once more through the filter: t e^{−βt}.
  const double age = s.t.back() - s.t.front();
  const double decayed = std::exp(-beta * age);
  EXPECT_NEAR(derivative.z1, s.u.back() - beta * level.z1 - decayed * s.u.front(), 1e-13);
  EXPECT_NEAR(derivative.z2, level.z1 - beta * level.z2 - age * decayed * s.u.front(), 1e-13);
}

TEST(ExactFilter, HeldInputIsLinearInputWithEqualEnds) {
  const StepWeights w(3.0, 0.17);
  Cascade held, linear;
  for (const double u : {1.0, -2.0, 0.5}) {
    held.held(w, u);
    linear.linear(w, u, u);
  }
  EXPECT_DOUBLE_EQ(held.z1, linear.z1);
  EXPECT_NEAR(held.z2, linear.z2, 1e-16);
}

}  // namespace
}  // namespace wheelwright::filter::exact_test
