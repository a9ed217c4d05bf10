// SPDX-License-Identifier: Apache-2.0
// Joint states of ordinary robots: which joints are read, which messages, and what is refused; over rates, orders of
// joints, and what stands beside the wheels.
#include <cmath>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/joint_states.hpp"
#include "formats/logs/log_file.hpp"
#include "tests/logs/bag_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::joint_states_test {
namespace {

using ::testing::AllOf;
using testing::BagItem;
using ::testing::Contains;
using testing::HandCdr;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

// A joint: its angle, speed and effort at a time; NaN leaves the number out of its array.
struct Joint {
  std::string name;
  std::function<double(double)> angle, speed, effort;
};

double right_angle(double t) { return 4.0 * t + 3.0 * std::sin(0.7 * t); }
double right_speed(double t) { return 4.0 + 2.1 * std::cos(0.7 * t); }
double left_angle(double t) { return 4.0 * t - 2.0 * std::sin(0.9 * t); }
double left_speed(double t) { return 4.0 - 1.8 * std::cos(0.9 * t); }
double right_effort(double t) { return 0.5 - std::sin(0.7 * t) + 0.01 * std::sin(91.0 * t); }
double left_effort(double t) { return 0.6 + 1.1 * std::sin(0.9 * t) + 0.01 * std::cos(83.0 * t); }
double none(double) { return 0.0; }

Joint right_wheel(const std::string& name = "right_wheel_joint") {
  return {name, right_angle, right_speed, right_effort};
}
Joint left_wheel(const std::string& name = "left_wheel_joint") { return {name, left_angle, left_speed, left_effort}; }

std::string message(double t, const std::string& frame, const std::vector<Joint>& joints,
                    std::array<bool, 3> filled = {true, true, true}) {
  const auto ns = static_cast<std::int64_t>(std::llround(t * 1e9)) + 1'700'000'000'000'000'000;
  HandCdr cdr(true);
  cdr.put(static_cast<std::int32_t>(ns / 1'000'000'000)).put(static_cast<std::uint32_t>(ns % 1'000'000'000)).put(frame);
  std::vector<std::string> names;
  std::vector<double> lists[3];
  for (const Joint& joint : joints) {
    names.push_back(joint.name);
    for (std::size_t a = 0; a < 3; ++a) {
      const double value = (a == 0 ? joint.angle : a == 1 ? joint.speed : joint.effort)(t);
      if (filled[a] && !std::isnan(value)) {
        lists[a].push_back(value);
      }
    }
  }
  return cdr.list(names).list(lists[0]).list(lists[1]).list(lists[2]).str();
}

class JointStates : public testing::ScratchTest {
 protected:
  struct Log {
    LogTable table;
    LogReport report;
  };

  double rate = 100.0;
  std::vector<BagItem> items;

  void publish(const std::vector<Joint>& joints, double seconds = 30.0, const std::string& frame = "") {
    for (std::size_t k = 0; static_cast<double>(k) < seconds * rate; ++k) {
      add(static_cast<double>(k) / rate, message(static_cast<double>(k) / rate, frame, joints));
    }
  }
  void add(double t, std::string data) {
    items.push_back({"/joint_states", 1'700'000'000'000'000'000 + std::llround(t * 1e9), std::move(data)});
  }
  // Another publisher's messages, `every` of the rows' apart, a bit behind them.
  void beside(const std::vector<Joint>& joints, std::size_t every, const std::string& frame = "",
              std::array<bool, 3> filled = {true, true, true}) {
    std::vector<BagItem> all;
    for (std::size_t k = 0; k < items.size(); ++k) {
      all.push_back(items[k]);
      if (k % every == 0) {
        const double t = (static_cast<double>(k) + 0.3) / rate;
        all.push_back({"/joint_states", items[k].time + std::llround(0.3e9 / rate), message(t, frame, joints, filled)});
      }
    }
    items = std::move(all);
  }
  Log read(const LogOptions& options = {}) {
    const std::filesystem::path file = path("bag_" + std::to_string(files_++) + ".db3");
    testing::write_humble(file, items);
    const auto log = open_log({file}, options);
    LogTable table = read_all(*log);
    return {std::move(table), log->report()};
  }
  std::string refusal(const LogOptions& options = {}) {
    try {
      read(options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  // The columns are those of the wheels' own laws, at every row.
  static void expect_wheels(const LogTable& log, double share = 1.0, double seconds = 30.0, double rate = 100.0) {
    EXPECT_GE(static_cast<double>(log.rows()), share * seconds * rate);
    ASSERT_NE(log.find("tau_r"), nullptr);
    ASSERT_NE(log.find("tau_l"), nullptr);
    for (std::size_t k = 0; k < log.rows(); ++k) {
      const double t = log.t[k];
      for (const auto& [name, law] : {std::pair("tau_r", &right_effort),
                                      {"tau_l", &left_effort},
                                      {"omega_r", &right_speed},
                                      {"omega_l", &left_speed}}) {
        if (log.find(name) != nullptr) {
          ASSERT_NEAR(log.column(name)[k], law(t), 1e-6) << name << " at " << t;
        }
      }
    }
  }

 private:
  int files_ = 0;
};

TEST_F(JointStates, WheelsAreReadAmongCastersSteeringThatStandsArmsAndFingersInAnyOrder) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    rate = std::vector{10.0, 50.0, 200.0}[seed % 3];
    items.clear();
    std::vector<Joint> joints = {
        right_wheel(),
        left_wheel(),
        {"left_caster_swivel_joint", [](double t) { return std::sin(t); }, [](double t) { return std::cos(t); }, none},
        {"right_castor_wheel_joint", [](double t) { return 7.0 * t; }, [](double) { return 7.0; }, none},
        {"front_steering_joint", [](double) { return 0.01; }, none, none},
        {"arm_left_elbow", [](double t) { return std::sin(0.3 * t); }, [](double t) { return 0.3 * std::cos(0.3 * t); },
         [](double t) { return 3.0 + t; }},
        {"right_finger", [](double t) { return 0.02 * std::sin(t); }, none, [](double) { return 1.0; }}};
    std::ranges::shuffle(joints, random);
    publish(joints);
    const Log log = read();
    expect_wheels(log.table, 0.98, 30.0, rate);
    EXPECT_THAT(log.report.files[0].contradictions, IsEmpty());
  }
}

TEST_F(JointStates, OfSeveralWheelsASideThoseThatAreDrivenAreRead) {
  publish({right_wheel("rear_right_wheel"),
           left_wheel("rear_left_wheel"),
           {"front_right_wheel", [](double t) { return 1.1 * right_angle(t); },
            [](double t) { return 1.1 * right_speed(t); }, none},
           {"front_left_wheel", [](double t) { return 1.1 * left_angle(t); },
            [](double t) { return 1.1 * left_speed(t); }, none}});
  const Log log = read();
  expect_wheels(log.table, 0.98);
  EXPECT_THAT(log.report.files[0].notes,
              Contains(AllOf(HasSubstr("front_left_wheel was left out"), HasSubstr("tau_l=effort[front_left_wheel]"))));
  items.clear();  // two motors a side under one command, or one motor that is told twice
  publish({right_wheel("front_right_wheel"), left_wheel("front_left_wheel"), right_wheel("rear_right_wheel"),
           left_wheel("rear_left_wheel")});
  EXPECT_THAT(read().report.files[0].notes,
              Contains(AllOf(HasSubstr("to the last digit"), HasSubstr("efforts are added"),
                             HasSubstr("tau_r=effort[front_right_wheel]"))));
}

TEST_F(JointStates, TheMapNamesJointsWithoutATopic) {
  publish({right_wheel("a"), left_wheel("b"), {"right_wheel", none, none, none}, {"left_wheel", none, none, none}});
  LogOptions options;
  options.map = {{"omega_r", "velocity[a]"}, {"omega_l", "velocity[b]"}, {"tau_r", "effort[a]"},
                 {"tau_l", "effort[b]"},     {"phi_r", "position[a]"},   {"phi_l", "position[b]"}};
  expect_wheels(read(options).table, 0.98);
  options.map = {{"omega_r", "velocity[nowhere]"}};
  EXPECT_THAT(read(options).report.files[0].notes, Contains(HasSubstr("no JointState names nowhere")));
}

TEST_F(JointStates, ASecondPublisherOfZerosIsLeftOutHoweverOftenItSpeaks) {
  const std::vector<Joint> still = {{"right_wheel_joint", none, none, none}, {"left_wheel_joint", none, none, none}};
  const std::vector<Joint> turned = {still[1], still[0]};
  for (const double hertz : {20.0, 100.0, 400.0}) {
    for (const std::size_t every : {1U, 2U, 3U, 10U}) {
      for (const int kind : {0, 1, 2, 3}) {
        rate = hertz;
        items.clear();
        publish({right_wheel(), left_wheel()});
        beside(kind == 1 ? turned : still, every, kind == 2 ? "base_link" : "", {true, kind != 3, kind != 3});
        const Log log = read();
        expect_wheels(log.table, 0.98, 30.0, rate);
        EXPECT_THAT(log.report.files[0].notes, Contains(HasSubstr("two publishers")))
            << hertz << " Hz, every " << every << ", kind " << kind;
      }
    }
  }
}

TEST_F(JointStates, ASecondRobotOnTheTopicIsRefusedOrNamed) {
  const auto other = [](const std::string& right, const std::string& left) {
    return std::vector<Joint>{{right, [](double t) { return 900.0 + 2.0 * t; },
                               [](double t) { return -2.0 - std::sin(t); }, [](double t) { return 3.0 + std::sin(t); }},
                              {left, [](double t) { return 500.0 - t; }, [](double t) { return -3.0 - std::cos(t); },
                               [](double t) { return -3.0 + std::cos(0.4 * t); }}};
  };
  for (const std::size_t every : {1U, 4U, 10U}) {
    items.clear();
    publish({right_wheel(), left_wheel()});
    beside(other("right_wheel_joint", "left_wheel_joint"), every);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("two publishers"), HasSubstr("ros2 topic info"))) << every;
    items.clear();
    publish({right_wheel(), left_wheel()});
    beside({other("right_wheel_joint", "left_wheel_joint")[1], other("right_wheel_joint", "left_wheel_joint")[0]},
           every);
    EXPECT_THAT(refusal(), HasSubstr("two publishers")) << every;
    items.clear();
    publish({right_wheel(), left_wheel()});
    beside(other("b/right_wheel_joint", "b/left_wheel_joint"), every);
    EXPECT_THAT(refusal(), AllOf(HasSubstr("wheels of 2 robots"), HasSubstr("tau_l=effort[left_wheel_joint]")));
    LogOptions options;
    options.map = {{"omega_r", "velocity[right_wheel_joint]"}, {"omega_l", "velocity[left_wheel_joint]"},
                   {"tau_r", "effort[right_wheel_joint]"},     {"tau_l", "effort[left_wheel_joint]"},
                   {"phi_r", "position[right_wheel_joint]"},   {"phi_l", "position[left_wheel_joint]"}};
    expect_wheels(read(options).table, 0.98);
  }
}

TEST_F(JointStates, EffortsWithoutNamesOfTheirOwnAreNeverGivenToAWheel) {
  const double nan = std::nan("");
  const auto arm = [&](const std::string& name) {
    return Joint{name, [](double t) { return 0.1 * std::sin(t); }, none, [nan](double) { return nan; }};
  };
  publish({arm("arm_1"), left_wheel(), right_wheel(), arm("arm_2")});
  EXPECT_THAT(refusal(), AllOf(HasSubstr("message 1 has 2 numbers in effort for 4 names"),
                               HasSubstr("those of left_wheel_joint, right_wheel_joint in this order, --map "
                                         "tau_l=/joint_states.effort[0] --map tau_r=/joint_states.effort[1]")));
  LogOptions options;
  options.map = {{"tau_l", "/joint_states.effort[0]"}, {"tau_r", "/joint_states.effort[1]"}};
  expect_wheels(read(options).table, 0.98);
  options.map = {{"tau_l", "/joint_states.effort[left_wheel_joint]"},
                 {"tau_r", "/joint_states.effort[right_wheel_joint]"}};
  EXPECT_THAT(refusal(options), HasSubstr("for 4 names"));
  items.clear();  // once in a while
  publish({left_wheel(), right_wheel()});
  for (std::size_t k = 50; k < items.size(); k += 100) {
    items[k].data = message(static_cast<double>(k) / rate, "", {arm("left_wheel_joint"), right_wheel()});
  }
  const Log log = read();
  expect_wheels(log.table, 0.97);
  EXPECT_THAT(log.report.files[0].notes, Contains(HasSubstr("effort has 1 number for 2 names")));
}

TEST_F(JointStates, NamesThatAreMissingOrStandTwiceAreTold) {
  publish({right_wheel("wheel_left"), right_wheel("wheel_right"), left_wheel("wheel_left")});
  EXPECT_THAT(refusal(), HasSubstr("'wheel_left' 2 times"));
  items.clear();
  for (int k = 0; k < 200; ++k) {
    HandCdr cdr(true);
    const double t = 0.01 * k;
    cdr.put(std::int32_t{1}).put(static_cast<std::uint32_t>(k * 10'000'000)).put("").list(std::vector<std::string>{});
    cdr.list(std::vector<double>{left_angle(t), right_angle(t)}).list(std::vector<double>{1.0, 2.0});
    add(t, cdr.list(std::vector<double>{}).str());
  }
  EXPECT_THAT(refusal(), AllOf(HasSubstr("name no joint"), HasSubstr("--map omega_r=/joint_states.velocity[1]")));
}

TEST_F(JointStates, NamesInOtherLanguagesTellTheSides) {
  for (const auto& [right, left] : {std::pair("rueda_derecha_joint", "rueda_izquierda_joint"),
                                    {"roue_droite", "roue_gauche"},
                                    {"rechtes_rad", "linkes_rad"},
                                    {"ruota_destra", "ruota_sinistra"},
                                    {"prawe_kolo", "lewe_kolo"},
                                    {"右车轮", "左车轮"},
                                    {"rwheel", "lwheel"},
                                    {"fr_wheel", "fl_wheel"},
                                    {"robot_r/right_wheel", "robot_r/left_wheel"}}) {
    SCOPED_TRACE(right);
    items.clear();
    publish({left_wheel(left), right_wheel(right)});
    expect_wheels(read().table);
  }
}

TEST_F(JointStates, NamesWithoutASideAreToldWithTheMapThatReadsThem) {
  publish({right_wheel("motor_1"), left_wheel("motor_2")});
  LogOptions options;
  options.only = std::vector<std::string>{"omega_r", "omega_l", "tau_r", "tau_l"};
  EXPECT_THAT(refusal(options), HasSubstr("--map \"omega_r=velocity[motor_1]\""));
  options.map = {{"omega_r", "velocity[motor_1]"},
                 {"tau_r", "effort[motor_1]"},
                 {"omega_l", "velocity[motor_2]"},
                 {"tau_l", "effort[motor_2]"}};
  expect_wheels(read(options).table);
}

TEST_F(JointStates, JointsInAnyOrderOfOnePublisherAreReadByTheirNames) {
  for (std::size_t k = 0; k < 3000; ++k) {
    const double t = static_cast<double>(k) / rate;
    add(t, message(t, "",
                   k % 3 == 1 ? std::vector{right_wheel(), left_wheel()} : std::vector{left_wheel(), right_wheel()}));
  }
  const Log log = read();
  expect_wheels(log.table);
  EXPECT_THAT(log.report.files[0].notes, Contains(HasSubstr("in different orders")));
}

TEST_F(JointStates, WheelsInMessagesOfTheirOwnAreRefusedForThat) {
  publish({right_wheel()});
  beside({left_wheel()}, 1);
  EXPECT_THAT(refusal(), HasSubstr("no message of /joint_states has all joints"));
}

TEST_F(JointStates, AFactorAloneMultipliesWhatIsFound) {
  publish({left_wheel(), right_wheel()});
  LogOptions options;
  options.map = {{"tau_r", "*0.5"}, {"tau_l", "*-1"}};
  const LogTable log = read(options).table;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    ASSERT_NEAR(log.column("tau_r")[k], 0.5 * right_effort(log.t[k]), 1e-6);
    ASSERT_NEAR(log.column("tau_l")[k], -left_effort(log.t[k]), 1e-6);
    ASSERT_NEAR(log.column("omega_r")[k], right_speed(log.t[k]), 1e-6);
  }
}

TEST_F(JointStates, MotionThatStandsStillBesideMotionIsNotRead) {
  publish({{"right_wheel", none, right_speed, right_effort}, {"left_wheel", none, left_speed, left_effort}});
  Log log = read();
  EXPECT_EQ(log.table.find("phi_r"), nullptr);
  expect_wheels(log.table, 0.98);
  EXPECT_THAT(log.report.files[0].notes,
              Contains(AllOf(HasSubstr("position[right_wheel] stands still"), HasSubstr("speeds are read"))));
  items.clear();
  publish({{"right_wheel", right_angle, none, right_effort}, {"left_wheel", left_angle, none, left_effort}});
  log = read();
  EXPECT_EQ(log.table.find("omega_l"), nullptr);
  ASSERT_NE(log.table.find("phi_l"), nullptr);
}

TEST_F(JointStates, CarsAndMecanumContradictADifferentialDriveAndSlipDoesNot) {
  const auto wheel = [](const std::string& name, double share, double sideways) {
    const auto speed = [=](double t) { return share * right_speed(t) + sideways * std::sin(1.3 * t); };
    const auto angle = [=](double t) { return share * right_angle(t) - sideways / 1.3 * std::cos(1.3 * t); };
    return Joint{name, angle, speed, right_effort};
  };
  const auto drive = [&](double slip, double sideways) {
    items.clear();
    publish({wheel("front_right_wheel", 1.0, sideways), wheel("rear_right_wheel", 1.0 - slip, -sideways),
             wheel("front_left_wheel", 1.0, -sideways), wheel("rear_left_wheel", 1.0 - slip, sideways)});
    return read().report.files[0].contradictions;
  };
  EXPECT_THAT(drive(0.0, 0.0), IsEmpty());
  EXPECT_THAT(drive(0.1, 0.0), IsEmpty());
  EXPECT_THAT(drive(0.0, 2.0), Contains(HasSubstr("wheels of the right side do not turn together")));
  items.clear();
  publish({right_wheel(),
           left_wheel(),
           {"left_steering_hinge_joint", [](double t) { return 0.3 * std::sin(t); }, none, none}});
  EXPECT_THAT(read().report.files[0].contradictions, Contains(HasSubstr("left_steering_hinge_joint by 0.6 rad")));
}

TEST(JointPlace, IsAnArrayAndJoints) {
  EXPECT_EQ(joint_place("velocity[a,b c]"),
            (std::pair<std::string, std::vector<std::string>>("velocity", {"a", "b c"})));
  for (const char* other : {"velocity", "velocity[]", "/joints.velocity[a]", "speed[a]", "velocity[a,]"}) {
    EXPECT_FALSE(joint_place(other)) << other;
  }
}

}  // namespace
}  // namespace wheelwright::logs::joint_states_test
