// SPDX-License-Identifier: Apache-2.0
// The supremum over bounded errors, against the response to every sample by itself.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/log.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::filter::error_influence_test {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Shown;

class Influence : public ::testing::TestWithParam<Shown> {};

RegressionBlock rows_of(const LogTable& table, const RegressorFilter& filter) {
  TableSource log(table);
  TorqueRows stream(log, filter);
  RegressionBlock all, block;
  stream.rewind();
  while (stream.next(block)) {
    if (block.instants() > 0) {
      all = block;  // the log is shorter than a block
    }
  }
  return all;
}

// Rows are linear in the samples, so the supremum is the sum of the sizes of the responses to each.
TEST_P(Influence, IsTheSumOfTheResponsesToAllSamples) {
  Scenario s = exact_drive(GetParam(), Hold::zero_order);
  s.duration = 9.0;
  const RegressorFilter filter = filter_of(s);
  Simulation simulated(s);
  LogTable table = read_all(simulated);
  // It begins in motion: of a segment that begins at rest, an error could hide that.
  constexpr std::ptrdiff_t kFirst = 200;
  table.t.erase(table.t.begin(), table.t.begin() + kFirst);
  for (std::vector<double>& column : table.columns) {
    column.erase(column.begin(), column.begin() + kFirst);
  }
  const Eigen::VectorXd theta = sim::true_parameters(s, model::make_model(s.robot));
  const RegressionBlock healthy = rows_of(table, filter);
  ASSERT_GT(healthy.instants(), 200U);
  constexpr Eigen::Index kSums = 2;
  core::RowMatrix g(healthy.rows(), kSums);
  for (Eigen::Index r = 0; r < g.rows(); ++r) {
    const double t = healthy.t[static_cast<std::size_t>(r) / healthy.outputs];
    g(r, 0) = std::sin(3.0 * t);
    g(r, 1) = (r % 2 == 0 ? 1.0 : -0.5) * std::cos(1.3 * t);
  }
  const auto sums = [&](const RegressionBlock& rows) -> Eigen::VectorXd {
    return g.transpose() * (rows.y - rows.Y * theta);
  };
  const Eigen::VectorXd none = sums(healthy);
  const SensorErrors sensors{.motion = 1e-3, .effort = 0.02};
  Eigen::VectorXd exact = Eigen::VectorXd::Zero(kSums);
  for (const std::string& name : filter.measurement().columns()) {
    const bool effort = name.starts_with("tau");
    std::vector<double>& column = table.column(name);
    for (double& value : column) {
      const double kept = value;
      value += effort ? sensors.effort : sensors.motion;
      exact += (sums(rows_of(table, filter)) - none).cwiseAbs();
      value = kept;
    }
  }
  ErrorInfluence influence(filter.model(), filter.design(), filter.measurement(), sensors, theta, kSums);
  influence.add(healthy, g);
  for (Eigen::Index m = 0; m < kSums; ++m) {
    // The adjoint is that of continuous time, with βh = 0.08.
    EXPECT_GE(influence.value()[m], 0.97 * exact[m]) << "sum " << m;
    EXPECT_LE(influence.value()[m], 1.10 * exact[m]) << "sum " << m;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Influence, ::testing::Values(Shown::angles, Shown::speeds));

}  // namespace
}  // namespace wheelwright::filter::error_influence_test
