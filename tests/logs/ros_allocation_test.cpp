// SPDX-License-Identifier: Apache-2.0
#include "tests/support/allocations.hpp"

#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/logs/ros_messages.hpp"
#include "tests/logs/ros_cdr.hpp"

namespace wheelwright::logs::ros_allocation_test {
namespace {

#ifdef WHEELWRIGHT_COUNTS_ALLOCATIONS

TEST(RosExtractorAllocation, ReadingAMessageHasNone) {
  testing::HandCdr cdr(true);
  cdr.put(std::int32_t{1}).put(std::uint32_t{2}).put("a frame whose name is longer than a small string");
  cdr.list(std::vector<std::string>{"the left wheel's joint, at length", "the right wheel's joint, at length"});
  cdr.list(std::vector<double>{1.0, 2.0}).list(std::vector<double>{3.0, 4.0}).list(std::vector<double>{});
  RosExtractor extractor(bundled_ros_definition("sensor_msgs/msg/JointState").value(),
                         {"velocity[the right wheel's joint, at length]", "position[0]"});
  std::array<double, 2> values{};
  const std::size_t before = testing_support::allocations;
  bool read = true;
  for (int k = 0; k < 1000; ++k) {
    read = read && extractor.read(cdr.str(), values);
  }
  EXPECT_EQ(testing_support::allocations, before);
  EXPECT_TRUE(read);
  EXPECT_EQ(values[0], 4.0);
  const std::vector<double> counted(100, values[1]);
  EXPECT_GT(testing_support::allocations, before);
  EXPECT_EQ(counted.back(), 1.0);
}

#endif

}  // namespace
}  // namespace wheelwright::logs::ros_allocation_test
