// SPDX-License-Identifier: Apache-2.0
/// \file
/// Laws that every RegressionSource fulfils, as a suite over types.
///
/// A type joins with a struct that has `std::unique_ptr<RegressionSource> make(std::size_t block_rows)`: the same rows
/// whatever the size of the blocks in which what lies beneath is read; the struct owns what the source refers to.
#pragma once

#include <cstddef>
#include <memory>

#include <gtest/gtest.h>

#include "core/regression.hpp"

namespace wheelwright::testing_support {

inline void expect_same_rows(const RegressionBlock& a, const RegressionBlock& b) {
  ASSERT_EQ(a.outputs, b.outputs);
  ASSERT_EQ(a.parameters, b.parameters);
  EXPECT_EQ(a.sample, b.sample);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.Y, b.Y);
  EXPECT_EQ(a.dY, b.dY);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.dy, b.dy);
}

template <typename Maker>
class RegressionSourceLaws : public ::testing::Test {
 protected:
  Maker maker;
};

TYPED_TEST_SUITE_P(RegressionSourceLaws);

TYPED_TEST_P(RegressionSourceLaws, BlocksHaveTheAnnouncedShape) {
  const auto source = this->maker.make(64);
  RegressionBlock block;
  std::size_t instants = 0;
  source->rewind();
  while (source->next(block)) {
    ASSERT_EQ(block.outputs, source->outputs());
    ASSERT_EQ(block.parameters, source->parameters());
    const auto rows = static_cast<Eigen::Index>(block.instants() * block.outputs);
    const auto columns = static_cast<Eigen::Index>(block.parameters);
    ASSERT_EQ(block.rows(), rows);
    ASSERT_EQ(block.sample.size(), block.instants());
    ASSERT_EQ(block.Y.rows(), rows);
    ASSERT_EQ(block.Y.cols(), columns);
    ASSERT_EQ(block.dY.rows(), rows);
    ASSERT_EQ(block.dY.cols(), columns);
    ASSERT_EQ(block.y.size(), rows);
    ASSERT_EQ(block.dy.size(), rows);
    EXPECT_TRUE(block.Y.allFinite() && block.y.allFinite());
    EXPECT_TRUE((block.dY.array() >= 0.0).all() && (block.dy.array() >= 0.0).all());
    instants += block.instants();
  }
  EXPECT_GT(instants, 0u);
  EXPECT_FALSE(source->next(block)) << "the end stays the end";
}

TYPED_TEST_P(RegressionSourceLaws, RewoundGivesTheSame) {
  const auto source = this->maker.make(64);
  const RegressionBlock first = read_all(*source);
  expect_same_rows(read_all(*source), first);
  // From the middle of a walk, too.
  RegressionBlock block;
  source->rewind();
  ASSERT_TRUE(source->next(block));
  expect_same_rows(read_all(*source), first);
}

TYPED_TEST_P(RegressionSourceLaws, BlockSizesDoNotMatter) {
  const RegressionBlock expected = read_all(*this->maker.make(4096));
  for (const std::size_t rows : {1, 2, 7, 100}) {
    expect_same_rows(read_all(*this->maker.make(rows)), expected);
  }
}

TYPED_TEST_P(RegressionSourceLaws, AUsedBlockIsAsGoodAsAFreshOne) {
  const auto source = this->maker.make(64);
  const RegressionBlock expected = read_all(*source);
  RegressionBlock used;
  used.resize(1000, 3, 9);
  source->rewind();
  std::size_t at = 0;
  while (source->next(used)) {
    for (std::size_t k = 0; k < used.instants(); ++k, ++at) {
      ASSERT_LT(at, expected.instants());
      ASSERT_EQ(used.sample[k], expected.sample[at]);
      const auto n = static_cast<Eigen::Index>(expected.outputs);
      const auto here = static_cast<Eigen::Index>(k) * n, there = static_cast<Eigen::Index>(at) * n;
      ASSERT_EQ(core::RowMatrix(used.Y.middleRows(here, n)), core::RowMatrix(expected.Y.middleRows(there, n)));
      ASSERT_EQ(Eigen::VectorXd(used.y.segment(here, n)), Eigen::VectorXd(expected.y.segment(there, n)));
    }
  }
  EXPECT_EQ(at, expected.instants());
}

TYPED_TEST_P(RegressionSourceLaws, SamplesAscend) {
  const RegressionBlock all = read_all(*this->maker.make(64));
  for (std::size_t k = 1; k < all.instants(); ++k) {
    ASSERT_LT(all.sample[k - 1], all.sample[k]);
  }
}

REGISTER_TYPED_TEST_SUITE_P(RegressionSourceLaws, BlocksHaveTheAnnouncedShape, RewoundGivesTheSame,
                            BlockSizesDoNotMatter, AUsedBlockIsAsGoodAsAFreshOne, SamplesAscend);

}  // namespace wheelwright::testing_support
