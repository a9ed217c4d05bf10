// SPDX-License-Identifier: Apache-2.0
// Recordings as other programs make them, each of which was once read with wrong values or fewer rows and without a
// word.
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/bag_log.hpp"
#include "formats/logs/bag_write.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/ros_messages.hpp"
#include "formats/logs/row_log.hpp"
#include "tests/logs/ros_cdr.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::recordings_of_others_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

constexpr std::int64_t ms = 1'000'000;
constexpr double turn = 2.0 * std::numbers::pi;

double wrapped(double angle) { return angle - turn * std::floor(angle / turn); }

class RecordingsOfOthers : public testing::ScratchTest {
 protected:
  LogTable read(const std::string& name, const LogOptions& options = {}) {
    const auto log = open_log({path(name)}, options);
    report = log->report();
    return read_all(*log);
  }
  std::vector<std::string> notes() { return report.files.at(0).notes; }

  static std::size_t add(BagWriter& bag, const std::string& topic, const char* type) {
    return bag.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
  }
  // Joints every `step` ms, as `fill` has them at a time in s.
  void joints(BagWriter& bag, std::size_t topic, std::int64_t step, int count,
              const std::function<void(double, RosJointState&)>& fill) {
    RosJointState joint;
    for (int k = 0; k < count; ++k) {
      joint.header.stamp = (k + 1) * step * ms;
      fill(1e-9 * static_cast<double>(joint.header.stamp), joint);
      bag.write(topic, joint.header.stamp, encoder.encode(joint));
    }
  }
  // a.mcap: joints every 10 ms, stamped `stamp` ms; the speeds of the left wheel.
  std::vector<double> send(int count, const std::function<int(int)>& stamp) {
    BagWriter bag(path("a.mcap"));
    const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
    RosJointState joint;
    joint.name = {"left_wheel", "right_wheel"};
    std::vector<double> sent;
    for (int k = 0; k < count; ++k) {
      joint.header.stamp = stamp(k) * ms;
      joint.velocity = {1.0 + k, -1.0};
      sent.push_back(joint.velocity[0]);
      bag.write(topic, (10 * k + 1) * ms, encoder.encode(joint));
    }
    bag.commit();
    return sent;
  }

  RosEncoder encoder;
  LogReport report;
};

TEST_F(RecordingsOfOthers, AnglesOfFourWheelsAreUnwrappedBeforeTheirMean) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  joints(bag, topic, 10, 500, [](double t, RosJointState& joint) {
    joint.name = {"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"};
    joint.position = {wrapped(6.0 * t), wrapped(5.0 * t), wrapped(6.0 * t + 1.0), wrapped(5.0 * t + 4.0)};
  });
  bag.commit();
  const LogTable table = read("a.mcap");
  for (std::size_t k = 0; k < table.rows(); ++k) {
    ASSERT_NEAR(table.column("phi_l")[k], 6.0 * table.t[k] + 0.5, 1e-9) << k;
    ASSERT_NEAR(table.column("phi_r")[k], 5.0 * table.t[k] + 2.0, 1e-9) << k;
  }
  EXPECT_THAT(sentences(report), Contains(HasSubstr("of a wheel angle by a whole turn undone")));
}

TEST_F(RecordingsOfOthers, AnglesAreUnwrappedBeforeTheyAreInterpolated) {
  BagWriter bag(path("a.mcap"));
  const std::size_t angles = add(bag, "/joint_states", RosJointState::type),
                    efforts = add(bag, "/motors", RosJointState::type);
  joints(bag, angles, 10, 500, [](double t, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel"};
    joint.position = {wrapped(6.0 * t), wrapped(-7.0 * t)};
  });
  joints(bag, efforts, 7, 700, [](double, RosJointState& joint) {
    joint.name = {"left_motor", "right_motor"};
    joint.effort = {1.0, 2.0};
  });
  bag.commit();
  const LogTable table = read("a.mcap");
  ASSERT_THAT(table.names, UnorderedElementsAre("phi_l", "phi_r", "tau_l", "tau_r"));
  const auto turns = [](double x) { return std::abs(std::remainder(x, turn)); };
  EXPECT_LT(turns(table.column("phi_l").front() - 6.0 * table.t.front()), 1e-9);
  for (std::size_t k = 1; k < table.rows(); ++k) {
    const double dt = table.t[k] - table.t[k - 1];
    ASSERT_NEAR(table.column("phi_l")[k] - table.column("phi_l")[k - 1], 6.0 * dt, 1e-9) << k;
    ASSERT_NEAR(table.column("phi_r")[k] - table.column("phi_r")[k - 1], -7.0 * dt, 1e-9) << k;
  }
}

// 20 rad/s at 50 Hz: three lost messages are a step of 1.6 rad; 20 rad/s at 10 Hz is 2 rad a step.
TEST_F(RecordingsOfOthers, LostMessagesAndLongStepsDoNotEndUnwrapping) {
  for (const auto& [step, lost] : {std::pair{20, 3}, {100, 0}}) {
    WheelAngle angle;
    for (int k = 0; k < 2000; ++k) {
      const double t = 1e-3 * step * (k + (k < 700 ? 0 : lost));
      const double raw = wrapped(20.0 * t);
      ASSERT_NEAR(k == 0 ? angle.begin(t, raw) : angle.follow(t, raw), 20.0 * t, 1e-9) << step << " ms, row " << k;
    }
  }
}

// The first jump of a counter at 2^16 counts says nothing of the steps behind it, which are as large as those before.
TEST_F(RecordingsOfOthers, TheFirstJumpOfACounterIsNoStepOfTheWheel) {
  for (const double counts : {1024.0, 8192.0, 32768.0}) {
    const double range = 65536.0 / counts * turn, rate = 5.0;
    WheelAngle angle;
    double before = 0.0;
    int broken = 0;
    const int rows = static_cast<int>(3.5 * range / rate / 0.01);
    for (int k = 0; k < rows; ++k) {
      const double t = 0.01 * k, counted = std::floor(rate * t * counts / turn) * turn / counts;
      const double raw = std::fmod(counted + 0.3 * range, range) - 0.5 * range;
      const double value = k == 0 ? angle.begin(t, raw) : angle.follow(t, raw);
      broken += angle.broken() ? 1 : 0;
      if (k > 0 && !angle.broken()) {
        ASSERT_NEAR(value - before, rate * 0.01, 1.01 * turn / counts) << counts << " counts, row " << k;
      }
      before = value;
    }
    EXPECT_EQ(broken, 1) << counts << " counts";
  }
}

TEST_F(RecordingsOfOthers, AHeadingOfAnOwnTypeGoesTheShortWayRound) {
  BagWriter bag(path("a.mcap"));
  const std::size_t wheels = add(bag, "/joint_states", RosJointState::type),
                    place = bag.add_topic("/loc", "my_msgs/msg/Loc", "int32 n\nfloat64 theta\n");
  joints(bag, wheels, 10, 500, [](double, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel"};
    joint.velocity = {1.0, 2.0};
  });
  for (int k = 0; k < 100; ++k) {
    const double t = 0.05 * (k + 1);
    testing::HandCdr cdr(true);
    cdr.put(std::int32_t{k}).put(std::remainder(2.0 * t, turn));
    bag.write(place, (k + 1) * 50 * ms, cdr.str());
  }
  bag.commit();
  const LogTable table = read("a.mcap");
  ASSERT_GT(table.rows(), 300U);
  for (std::size_t k = 1; k < table.rows(); ++k) {
    ASSERT_LT(std::abs(table.column("theta")[k] - table.column("theta")[k - 1]), 0.1) << k;
  }
}

// Found by the second reader while this was written: a message before which others were let go had their numbers.
TEST_F(RecordingsOfOthers, AClockThatIsSetBackChangesNoValue) {
  const std::vector<double> sent = send(60, [](int k) { return k < 30 ? 100'000 + 10 * k : 10 * k; });
  EXPECT_EQ(read("a.mcap").column("omega_l"), sent);
}

// By half a second, as NTP does it: the two half seconds were woven into one.
TEST_F(RecordingsOfOthers, AClockThatIsSetBackByLittleBeginsASegment) {
  for (const int at : {40, 300}) {
    const std::vector<double> sent = send(600, [&](int k) { return 1000 + 10 * k - (k < at ? 0 : 305); });
    const LogTable table = read("a.mcap");
    EXPECT_EQ(table.column("omega_l"), sent) << at;
    EXPECT_THAT(table.segment_starts, ElementsAre(0U, static_cast<std::size_t>(at)));
    EXPECT_EQ(report.resets.count, 1U);
    EXPECT_THAT(notes(), Not(Contains(HasSubstr("recorded after later ones"))));
  }
}

// A slow publisher whose clock is ahead, and a fast one: their messages are in the order of their stamps, in one
// segment but for what the first run of late ones looks like.
TEST_F(RecordingsOfOthers, TwoClocksOfATopicAreNoClockThatIsSetBackAgainAndAgain) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  RosJointState joint;
  joint.name = {"left_wheel", "right_wheel"};
  for (int k = 0; k < 1000; ++k) {
    for (const int ahead : {0, 75}) {
      if (ahead == 0 || k % 10 == 0) {
        joint.header.stamp = (1000 + 10 * k + ahead) * ms;
        joint.velocity = {1e-9 * static_cast<double>(joint.header.stamp), 1.0};
        bag.write(topic, (1001 + 10 * k) * ms, encoder.encode(joint));
      }
    }
  }
  bag.commit();
  const LogTable table = read("a.mcap");
  EXPECT_LE(table.segment_starts.size(), 3U);  // time goes back once, and before that has a gap
  EXPECT_GE(table.rows(), 1090U);
  for (std::size_t k = 100; k < table.rows(); ++k) {
    ASSERT_NEAR(table.column("omega_l")[k], table.column("omega_l")[0] + table.t[k] - table.t[0], 1e-6);
  }
}

// Every row was lost for want of the odometry, and nothing said that its encoding is why.
TEST_F(RecordingsOfOthers, ATopicThatCannotBeReadIsLeftOutAndSaid) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  const std::size_t odometry = add(bag, "/odom", "nav_msgs/msg/Odometry");
  joints(bag, topic, 10, 100, [](double t, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel"};
    joint.velocity = {1.0 + t, 2.0};
  });
  for (int k = 0; k < 100; ++k) {
    bag.write(odometry, 10 * (k + 1) * ms, std::string("\0\7\0\0", 4) + std::string(720, '\1'));  // XCDR2
  }
  bag.commit();
  EXPECT_EQ(read("a.mcap").rows(), 100U);
  EXPECT_THAT(notes(),
              Contains(AllOf(HasSubstr("/odom (nav_msgs/msg/Odometry) was not taken: its first messages cannot be "
                                       "read ("),
                             HasSubstr("--map NAME=/odom.FIELD takes it"))));
}

TEST_F(RecordingsOfOthers, OtherMessagesOfATopicThatIsReadAreSaid) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  const std::size_t other = bag.add_topic("/joint_states", "my_msgs/msg/State", "float64 a\n");
  joints(bag, topic, 10, 50, [](double, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel"};
    joint.velocity = {1.0, 2.0};
  });
  testing::HandCdr cdr(true);
  cdr.put(1.0);
  bag.write(other, 600 * ms, cdr.str());
  bag.commit();
  EXPECT_EQ(read("a.mcap").rows(), 50U);
  EXPECT_THAT(notes(), Contains(HasSubstr("1 messages of /joint_states are of another type")));
}

// Both were read with the definition of the first: right and left changed places.
TEST_F(RecordingsOfOthers, TwoDefinitionsOfATypeAreTwoTopics) {
  std::filesystem::create_directories(path("bag"));
  int part = 0;
  for (const std::string fields : {"float64 omega_r\nfloat64 omega_l\n", "float64 omega_l\nfloat64 omega_r\n"}) {
    BagWriter bag(path("bag/a_" + std::to_string(part) + ".mcap"));
    const std::size_t topic = bag.add_topic("/wheels", "my_msgs/msg/Wheels", fields);
    for (int k = 0; k < 30; ++k) {
      testing::HandCdr cdr(true);
      cdr.put(1.0).put(2.0);
      bag.write(topic, (30 * part + k + 1) * 10 * ms, cdr.str());
    }
    bag.commit();
    ++part;
  }
  EXPECT_THAT(input_error([&] { read("bag"); }), HasSubstr("omega_r was left out since several topics have it"));
}

TEST_F(RecordingsOfOthers, EffortsThatBeginLateAreSaid) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  joints(bag, topic, 1, 21'000, [](double t, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel"};
    joint.velocity = {1.0, 2.0};
    joint.effort = t > 20.5 ? std::vector<double>{0.5, 0.5} : std::vector<double>{};
  });
  bag.commit();
  EXPECT_THAT(read("a.mcap").names, UnorderedElementsAre("omega_l", "omega_r"));
  EXPECT_THAT(notes(),
              Contains(AllOf(HasSubstr("effort has numbers from about message 20600 on"), HasSubstr("--map"))));
}

TEST_F(RecordingsOfOthers, WheelsWithoutEffortsBesideAnArmWithSomeKeepTheirRows) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
  joints(bag, topic, 10, 50, [](double, RosJointState& joint) {
    joint.name = {"left_wheel", "right_wheel", "elbow"};
    joint.velocity = {1.0, 2.0, 3.0};
    joint.effort = {std::nan(""), std::nan(""), 1.0};
  });
  bag.commit();
  EXPECT_EQ(read("a.mcap").rows(), 50U);
  EXPECT_THAT(notes(), Contains(HasSubstr("no number for effort[right_wheel]")));
}

TEST_F(RecordingsOfOthers, APoseThatNobodyTurnedHasNoHeading) {
  BagWriter bag(path("a.mcap"));
  const std::size_t topic = add(bag, "/pose", RosPoseStamped::type);
  RosPoseStamped pose;
  pose.pose.orientation = {0.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < 50; ++k) {
    pose.header.stamp = (k + 1) * 10 * ms;
    bag.write(topic, pose.header.stamp, encoder.encode(pose));
  }
  bag.commit();
  EXPECT_THAT(read("a.mcap").names, UnorderedElementsAre("x", "y"));
  EXPECT_THAT(notes(), Contains(HasSubstr("/pose has no orientation")));
}

TEST_F(RecordingsOfOthers, FilesThatMetadataDoNotNameAreSaid) {
  std::filesystem::create_directories(path("bag"));
  for (const std::string name : {"a_0", "a_1"}) {
    BagWriter bag(path("bag/" + name + ".mcap"));
    const std::size_t topic = add(bag, "/joint_states", RosJointState::type);
    joints(bag, topic, 10, 50, [](double, RosJointState& joint) {
      joint.name = {"left_wheel", "right_wheel"};
      joint.velocity = {1.0, 2.0};
    });
    bag.commit();
  }
  put("bag/metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [a_0.mcap]\n");
  EXPECT_EQ(read("bag").rows(), 50U);
  EXPECT_THAT(notes(), Contains(HasSubstr("does not name a_1.mcap, which was not read")));
}

// Bounds at a stated risk became narrower, since errors that were read twice counted as new.
TEST_F(RecordingsOfOthers, ALogIsGivenOnce) {
  std::string text = "t,omega_r\n";
  for (int k = 0; k < 30; ++k) {
    text += std::to_string(0.01 * k) + ",1\n";
  }
  put("a.csv", text);
  put("b.csv", text);
  EXPECT_THAT(input_error([&] {
                static_cast<void>(open_log({path("a.csv"), path("b.csv")}));
              }),
              AllOf(HasSubstr("b.csv"), HasSubstr("has the bytes of"), HasSubstr("a.csv")));
}

}  // namespace
}  // namespace wheelwright::logs::recordings_of_others_test
