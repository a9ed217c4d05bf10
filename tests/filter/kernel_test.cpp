// SPDX-License-Identifier: Apache-2.0
// Oracle: KernelState, one signal by itself.
#include "model/filter/kernel.hpp"

#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace wheelwright::filter::kernel_test {
namespace {

class Bank : public testing::TestWithParam<std::tuple<int, MotionKind, double>> {
 protected:
  [[nodiscard]] static FilterKernel kernel() {
    const auto& [order, motion, nominal] = GetParam();
    return FilterKernel({.order = order, .alpha = 9.0, .beta = 7.0}, motion, nominal);
  }
};

TEST_P(Bank, GivesTheDigitsOfEverySignalByItself) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  FilterKernel kernel = this->kernel();
  for (std::size_t signals = 1; signals <= 9; ++signals) {
    KernelBank bank(signals);
    std::vector<KernelState> alone(signals);
    for (int k = 0; k < 300; ++k) {
      kernel.prepare(k % 7 == 0 ? 0.01 : 0.01 + 0.004 * unit(rng));
      for (std::size_t i = 0; i < signals; ++i) {
        bank.in()[i] = unit(rng);
        kernel.take(alone[i], bank.in()[i]);
      }
      kernel.take(bank);
      for (std::size_t i = 0; i < signals; ++i) {
        ASSERT_EQ(bank.out()[i], kernel.value(alone[i])) << signals << " signals, sample " << k;
      }
    }
    bank.clear();
    kernel.take(bank);
    EXPECT_EQ(bank.out()[signals - 1], 0.0);
  }
}

TEST_P(Bank, FadesToNothingAndOnlyTraces) {
  FilterKernel kernel = this->kernel();
  kernel.prepare(0.01);
  KernelBank bank(3);
  std::vector<KernelState> alone(3);
  const auto take = [&](double q) {
    for (std::size_t i = 0; i < 3; ++i) {
      bank.in()[i] = q * static_cast<double>(i + 1);
      kernel.take(alone[i], bank.in()[i]);
    }
    kernel.take(bank);
  };
  take(1.0);
  for (std::size_t k = 1; k <= 20000; ++k) {
    take(0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_NEAR(bank.out()[i], kernel.value(alone[i]), 1e-230) << k;
    }
    if (k % kFade == 0) {
      bank.fade();
      for (const double* z = bank.z1(); z != bank.fast() + 3; ++z) {
        ASSERT_TRUE(*z == 0.0 || std::abs(*z) >= kTrace) << k;
      }
    }
  }
  EXPECT_EQ(std::fpclassify(alone[0].z1), FP_SUBNORMAL) << "nothing to fade";
  EXPECT_EQ(bank.z1()[0], 0.0);
  EXPECT_EQ(bank.out()[2], 0.0);
}

INSTANTIATE_TEST_SUITE_P(Kernels, Bank,
                         testing::Values(std::tuple(1, MotionKind::speed, 0.01), std::tuple(2, MotionKind::speed, 0.01),
                                         std::tuple(2, MotionKind::angle, 0.01), std::tuple(2, MotionKind::angle, 0.0),
                                         std::tuple(2, MotionKind::mean_speed, 0.01)));

TEST(Majorant, Fades) {
  SlopeMajorant majorant;
  majorant.advance(std::exp(-0.1), 0.1, 1.0);
  for (std::size_t k = 1; k <= 20 * kFade; ++k) {
    majorant.advance(std::exp(-0.5), 0.5, 0.0);
    if (k % kFade == 0) {
      majorant.fade();
    }
  }
  EXPECT_EQ(majorant.value(), 0.0);
}

}  // namespace
}  // namespace wheelwright::filter::kernel_test
