// SPDX-License-Identifier: Apache-2.0
#include "tests/support/regression_source_laws.hpp"

#include <cmath>

#include "commission/validation.hpp"
#include "core/error.hpp"
#include "model/filter/row_stream.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::core::regression_test {
namespace {

using testing_support::block_of;
using testing_support::filter_of;
using testing_support::noisy_drive;
using testing_support::Random;

struct Table {
  std::unique_ptr<RegressionSource> make(std::size_t) const {
    Random random(1);
    return std::make_unique<RegressionTable>(block_of(random.matrix(300, 3), random.matrix(300, 1), 2));
  }
};

// A log with a gap, so that the filter restarts in the middle.
struct Stream {
  LogTable table = [] {
    Scenario s = noisy_drive(1, 10.0);
    s.gaps = {{4.0, 5.0}};
    return sim::simulate(s);
  }();
  std::unique_ptr<TableSource> log;

  std::unique_ptr<RegressionSource> make(std::size_t block_rows) {
    log = std::make_unique<TableSource>(table, block_rows);
    return std::make_unique<TorqueRows>(*log, filter_of(noisy_drive(1, 10.0)));
  }
};

template <commission::Part part>
struct Folded {
  Stream stream;
  std::unique_ptr<RegressionSource> rows;

  std::unique_ptr<RegressionSource> make(std::size_t block_rows) {
    rows = stream.make(block_rows);
    return std::make_unique<commission::FoldedSource>(*rows, part, stream.table.rows(), commission::FoldOptions{});
  }
};

using Sources = ::testing::Types<Table, Stream, Folded<commission::Part::everything>,
                                 Folded<commission::Part::training>, Folded<commission::Part::held_out>>;

}  // namespace
}  // namespace wheelwright::core::regression_test

namespace wheelwright::testing_support {
INSTANTIATE_TYPED_TEST_SUITE_P(AllSources, RegressionSourceLaws, core::regression_test::Sources);
}  // namespace wheelwright::testing_support

namespace wheelwright::core::regression_test {
namespace {

TEST(RegressionTable, RefusesWhatIsNoRegression) {
  const RegressionBlock good = block_of(Eigen::MatrixXd::Ones(4, 2), Eigen::VectorXd::Ones(4), 2);
  EXPECT_NO_THROW(RegressionTable{good});
  const auto refused = [&](auto&& spoil) {
    RegressionBlock block = good;
    spoil(block);
    EXPECT_THROW(RegressionTable{block}, InvalidArgument);
  };
  refused([](RegressionBlock& b) { b.Y(0, 0) = std::nan(""); });
  refused([](RegressionBlock& b) { b.y[1] = INFINITY; });
  refused([](RegressionBlock& b) { b.dY(0, 1) = -1e-9; });
  refused([](RegressionBlock& b) { b.dy[0] = std::nan(""); });
  refused([](RegressionBlock& b) { b.t.pop_back(); });
  refused([](RegressionBlock& b) { b.outputs = 3; });
  refused([](RegressionBlock& b) { b.parameters = 1; });
}

// Blocks of a third are held out; what a part drops at a block's beginning is the purge.
TEST(Folds, PartsAreDisjointContiguousAndPurged) {
  Random random(2);
  constexpr std::size_t instants = 1000;
  RegressionTable table(block_of(random.matrix(instants, 2), random.matrix(instants, 1), 1));
  const commission::FoldOptions options{.blocks = 10, .hold_out_every = 3, .purge = 0.25};
  commission::FoldedSource training(table, commission::Part::training, instants, options),
      held(table, commission::Part::held_out, instants, options);
  const std::vector<std::size_t> learnt = read_all(training).sample, unseen = read_all(held).sample;
  std::vector<std::size_t> expected_learnt, expected_unseen;
  for (std::size_t k = 0; k < instants; ++k) {
    const std::size_t block = k / 100;
    if (block > 0 && k % 100 < 25) {  // 0.25 s at 100 Hz
      continue;
    }
    (block % 3 == 2 ? expected_unseen : expected_learnt).push_back(k);
  }
  EXPECT_EQ(learnt, expected_learnt);
  EXPECT_EQ(unseen, expected_unseen);
}

TEST(Folds, MisuseIsRefused) {
  RegressionTable table(block_of(Eigen::MatrixXd::Ones(10, 1), Eigen::VectorXd::Ones(10), 1));
  for (const commission::FoldOptions& bad :
       {commission::FoldOptions{.blocks = 1}, commission::FoldOptions{.hold_out_every = 1},
        commission::FoldOptions{.blocks = 3, .hold_out_every = 4}, commission::FoldOptions{.purge = -1.0}}) {
    EXPECT_THROW(commission::FoldedSource(table, commission::Part::training, 10, bad), InvalidArgument);
  }
}

}  // namespace
}  // namespace wheelwright::core::regression_test
