// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether intervals of Sobol' indices hold what they promise: how many of them, over seeds, contain the exact index.
///
/// Over independent seeds the number that do is binomial. A test fails below (or, for narrow confidence, beside) that
/// distribution's quantiles at 10⁻⁴, that is, under correct intervals, for one index in 10,000.
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <boost/math/distributions/binomial.hpp>

#include "study/global_sensitivity.hpp"
#include "tests/study/test_functions.hpp"

namespace wheelwright::study::sobol_coverage_test {
namespace {

namespace example = sensitivity_example;

// How often, over seeds 1 … seeds, each index's interval holds the exact value: the first-order ones, then the total
// ones.
std::vector<int> hits(const example::TestFunction& f, SobolOptions options, int seeds) {
  std::vector<int> out(2 * f.first.size(), 0);
  for (int seed = 1; seed <= seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const auto found = sobol_indices(example::evaluate(f, sobol_design(f.inputs, options)), f.inputs, options).at(0);
    for (std::size_t i = 0; i < f.first.size(); ++i) {
      const auto holds = [](const SobolIndex& index, double exact) {
        return index.lower <= exact && exact <= index.upper ? 1 : 0;
      };
      out[i] += holds(found.first[i], f.first[i]);
      out[f.first.size() + i] += holds(found.total[i], f.total[i]);
    }
  }
  return out;
}

double quantile(int seeds, double confidence, double probability) {
  return boost::math::quantile(boost::math::binomial(seeds, confidence), probability);
}

class SobolCoverage : public ::testing::TestWithParam<std::tuple<Eigen::Index, Eigen::Index>> {};

TEST_P(SobolCoverage, IsWhatIsPromised) {
  const auto [points, replicates] = GetParam();
  constexpr int seeds = 60;
  for (const auto& f : {example::ishigami(), example::g_function({0.0, 1.0, 4.5, 9.0}),
                        example::additive(Eigen::Vector3d(3.0, 2.0, 1.0))}) {
    const std::vector<int> found = hits(f, {.points = points, .replicates = replicates}, seeds);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_GE(found[i], quantile(seeds, 0.95, 1e-4)) << f.name << ", index " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, SobolCoverage,
                         ::testing::Values(std::tuple{8, 8}, std::tuple{16, 8}, std::tuple{16, 16}, std::tuple{64, 8},
                                           std::tuple{32, 16}),
                         [](const auto& sizes) {
                           return std::to_string(std::get<0>(sizes.param)) + "_points_" +
                                  std::to_string(std::get<1>(sizes.param)) + "_replicates";
                         });

// Intervals that are too wide would pass above. Of narrow ones as many have to miss as to hold.
TEST(SobolIntervals, AreNotTooWide) {
  constexpr int seeds = 200;
  for (const auto& f : {example::ishigami(), example::g_function({0.0, 1.0, 4.5, 9.0})}) {
    const std::vector<int> found = hits(f, {.points = 32, .replicates = 8, .confidence = 0.5}, seeds);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_GE(found[i], quantile(seeds, 0.5, 1e-4)) << f.name << ", index " << i;
      EXPECT_LE(found[i], quantile(seeds, 0.5, 1.0 - 1e-4)) << f.name << ", index " << i;
    }
  }
}

}  // namespace
}  // namespace wheelwright::study::sobol_coverage_test
