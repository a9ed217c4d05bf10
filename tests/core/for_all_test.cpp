// SPDX-License-Identifier: Apache-2.0
#include "core/for_all.hpp"

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace wheelwright::core::for_all_test {
namespace {

TEST(Both, OneAfterTheOtherOnOneThread) {
  std::vector<int> order;
  const std::thread::id here = std::this_thread::get_id();
  both(
      1,
      [&] {
        order.push_back(1);
        EXPECT_EQ(std::this_thread::get_id(), here);
      },
      [&] {
        order.push_back(2);
        EXPECT_EQ(std::this_thread::get_id(), here);
      });
  EXPECT_EQ(order, (std::vector<int>{1, 2}));
}

// Each waits until the other has begun.
TEST(Both, SideBySideOnTwo) {
  std::atomic<int> begun = 0;
  const auto meet = [&] {
    ++begun;
    while (begun < 2) {
      std::this_thread::yield();
    }
  };
  const std::thread::id here = std::this_thread::get_id();
  both(
      2,
      [&] {
        meet();
        EXPECT_EQ(std::this_thread::get_id(), here);
      },
      meet);
  EXPECT_EQ(begun, 2);
}

std::string thrown_by(std::size_t threads, bool first, bool second, int& ended) {
  ended = 0;
  const auto task = [&ended](bool throws, const char* name) {
    if (throws) {
      throw std::runtime_error(name);
    }
    ++ended;
  };
  try {
    both(
        threads, [&] { task(first, "first"); }, [&] { task(second, "second"); });
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Both, WhatTheFirstThrowsIsTold) {
  int ended = 0;
  for (const std::size_t threads : {1, 2}) {
    EXPECT_EQ(thrown_by(threads, true, true, ended), "first");
    EXPECT_EQ(thrown_by(threads, false, true, ended), "second");
    EXPECT_EQ(ended, 1);
    EXPECT_EQ(thrown_by(threads, false, false, ended), "nothing");
    EXPECT_EQ(ended, 2);
  }
  EXPECT_EQ(thrown_by(2, true, false, ended), "first");
  EXPECT_EQ(ended, 1) << "the second ends all the same";
}

}  // namespace
}  // namespace wheelwright::core::for_all_test
