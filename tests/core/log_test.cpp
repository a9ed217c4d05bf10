// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/log.hpp"

namespace wheelwright::core::log_test {
namespace {

using ::testing::ElementsAre;

// Two columns; time restarts where a segment starts.
LogTable table(std::size_t rows, std::vector<std::size_t> starts = {}) {
  LogTable log;
  log.names = {"a", "b"};
  log.columns.resize(2);
  log.segment_starts = std::move(starts);
  for (std::size_t k = 0; k < rows; ++k) {
    log.t.push_back(0.5 * static_cast<double>(k));
    log.columns[0].push_back(static_cast<double>(k));
    log.columns[1].push_back(-static_cast<double>(k));
  }
  return log;
}

void expect_same(const LogTable& a, const LogTable& b) {
  EXPECT_EQ(a.names, b.names);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.columns, b.columns);
  EXPECT_EQ(a.segment_starts, b.segment_starts);
}

TEST(TableSource, GivesTheTableWhateverTheBlocks) {
  const LogTable log = table(50, {0, 7, 8, 49});
  for (const std::size_t rows : {1, 7, 8, 50, 51}) {
    TableSource source(log, rows);
    expect_same(read_all(source), log);
    LogBlock block;
    source.rewind();
    std::size_t next = 0;
    while (source.next(block)) {
      EXPECT_EQ(block.first_row, next);
      EXPECT_LE(block.rows(), rows);
      for (const std::size_t start : block.segment_starts) {
        EXPECT_LT(start, block.rows());
      }
      next += block.rows();
    }
    EXPECT_EQ(next, 50u);
    EXPECT_EQ(block.rows(), 0u);
    expect_same(read_all(source), log);
  }
}

TEST(TableSource, TheFirstRowStartsASegment) {
  const LogTable log = table(5);
  TableSource source(log);
  EXPECT_THAT(read_all(source).segment_starts, ElementsAre(0));
  EXPECT_EQ(source.find("b"), 1u);
  EXPECT_FALSE(source.find("c").has_value());
  EXPECT_EQ(source.median_step(), 0.5);
}

TEST(TableSource, AnotherWalkBeginsAtTheFirstRow) {
  LogTable table;
  table.names = {"a"};
  table.t = {0.0, 1.0, 2.0, 3.0, 4.0};
  table.columns = {{5.0, 6.0, 7.0, 8.0, 9.0}};
  TableSource source(table, 2);
  LogBlock block;
  ASSERT_TRUE(source.next(block));
  const std::unique_ptr<LogSource> other = source.another_walk();
  EXPECT_EQ(read_all(*other).columns, table.columns);
  ASSERT_TRUE(source.next(block));
  EXPECT_EQ(block.first_row, 2U);
}

TEST(TableSource, MisuseIsRefused) {
  const auto refused = [](auto&& spoil) {
    LogTable log = table(5);
    spoil(log);
    EXPECT_THROW(TableSource{log}, InvalidArgument);
  };
  refused([](LogTable& log) { log.columns[1].pop_back(); });
  refused([](LogTable& log) { log.columns[0][2] = std::nan(""); });
  refused([](LogTable& log) { log.t[2] = std::numeric_limits<double>::infinity(); });
  refused([](LogTable& log) { log.t[2] = log.t[1]; });
  for (const std::vector<std::size_t>& starts : {std::vector<std::size_t>{0, 2, 2}, {3, 1}, {0, 5}, {7}}) {
    refused([&](LogTable& log) { log.segment_starts = starts; });
  }
  LogTable reset = table(5, {0, 2});
  reset.t[2] = reset.t[3] = -1.0;
  EXPECT_THROW(TableSource{reset}, InvalidArgument);
  reset.t[3] = -0.5;
  EXPECT_NO_THROW(TableSource{reset});  // time may start anew where a segment does
}

TEST(MedianStep, IsTheMiddleOne) {
  EXPECT_EQ(median_step(std::vector<double>{}), 0.0);
  EXPECT_EQ(median_step({3.0}), 0.0);
  EXPECT_EQ(median_step({0.0, 1.0, 3.0, 103.0}), 2.0);
}

TEST(Slice, StartsAnewWhereASegmentIsCut) {
  const LogTable log = table(10, {0, 4, 8});
  const LogTable middle = slice(log, 2, 9);
  EXPECT_THAT(middle.columns[0], ElementsAre(2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(middle.segment_starts, ElementsAre(0, 2, 6));
  EXPECT_EQ(slice(log, 4, 4).rows(), 0u);
  expect_same(slice(log, 0, 10), log);
  EXPECT_THROW(static_cast<void>(slice(log, 5, 4)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(slice(log, 0, 11)), InvalidArgument);
}

TEST(LogTable, KnowsItsColumns) {
  LogTable log = table(3);
  log.column("b")[1] = 9.0;
  EXPECT_THAT(std::as_const(log).column("b"), ElementsAre(0.0, 9.0, -2.0));
  EXPECT_THROW(static_cast<void>(log.column("c")), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::core::log_test
