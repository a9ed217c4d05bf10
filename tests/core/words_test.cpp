// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "core/words.hpp"

namespace wheelwright::core {
namespace {

TEST(Words, AreListed) {
  EXPECT_EQ(listed({}), "");
  EXPECT_EQ(listed({"a", "b", "c"}), "a, b, c");
  EXPECT_EQ(listed({"a", "b"}, " | "), "a | b");
  EXPECT_EQ(enumerated({"a"}), "a");
  EXPECT_EQ(enumerated({"a", "b", "c"}), "a, b and c");
}

TEST(NaturalOrder, CountsAsPeopleDo) {
  EXPECT_TRUE(natural_less("log_2", "log_10"));
  EXPECT_FALSE(natural_less("log_10", "log_2"));
  EXPECT_TRUE(natural_less("a", "b"));
  EXPECT_TRUE(natural_less("a", "a1"));
  EXPECT_FALSE(natural_less("a", "a"));
  EXPECT_NE(natural_less("a01", "a1"), natural_less("a1", "a01")) << "a strict order";
}

}  // namespace
}  // namespace wheelwright::core
