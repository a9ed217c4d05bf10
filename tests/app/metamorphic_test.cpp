// SPDX-License-Identifier: Apache-2.0
// What must not matter to commission, identify and detect, or matters as the mathematics says, on drives that
// RapidCheck draws and makes smaller where a property fails. One drive each; others and more are drawn with
// RC_PARAMS="seed=42 max_success=100".
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>

#include <rapidcheck.h>

#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "tests/app/program.hpp"

namespace wheelwright::app::metamorphic_test {
namespace {

using testing::Outcome;

/// A log and what stands in its robot file.
struct Drive {
  LogTable healthy, faulty;
  std::string robot;
  std::string ending = ".csv";
};

/// What the three commands say of a drive.
struct Answers {
  Json model, identification, detection;
};

/// Where `b` is not `a`, by more than `tolerance` of the larger number, nor `later` than it (sentences may then say
/// so); nothing where it is nowhere. What names files is left out, and what a format has to be interpolated.
std::string difference(const Json& a, const Json& b, double tolerance, double later = 0.0,
                       const std::string& where = "") {
  if (a.is_number() && b.is_number()) {
    const double x = a.get<double>(), y = b.get<double>();
    return y == x + later || std::abs(x - y) <= tolerance * std::max(std::abs(x), std::abs(y))
               ? ""
               : fmt::format("{}: {:.17g}, {:.17g}", where, x, y);
  }
  if (a.type() != b.type() || a.size() != b.size()) {
    return fmt::format("{}: {}, {}", where, a.dump(), b.dump());
  }
  if (!a.is_structured()) {
    return a == b || (a.is_string() && later != 0.0) ? "" : fmt::format("{}: {}, {}", where, a.dump(), b.dump());
  }
  for (auto it = a.begin(), other = b.begin(); it != a.end(); ++it, ++other) {
    const std::string key = a.is_object() ? it.key() : std::to_string(it - a.begin());
    if (a.is_object() && key != other.key()) {
      return fmt::format("{}/{}: {}", where, key, other.key());
    }
    if (key == "files" || key == "log" || key == "model" || key == "repairs") {
      continue;
    }
    if (std::string found = difference(*it, *other, tolerance, later, where + "/" + key); !found.empty()) {
      return found;
    }
  }
  return "";
}
std::string difference(const Answers& a, const Answers& b, double tolerance, double later = 0.0) {
  for (const auto& [name, one, two] :
       {std::tuple("commission", &a.model, &b.model), std::tuple("identify", &a.identification, &b.identification),
        std::tuple("detect", &a.detection, &b.detection)}) {
    if (std::string found = difference(*one, *two, tolerance, later, name); !found.empty()) {
      return found;
    }
  }
  return "";
}

class Metamorphic : public testing::ProgramTest {
 protected:
  static void SetUpTestSuite() { ::setenv("RC_PARAMS", "seed=1 max_success=1", 0); }

  /// A drive of 16 s with a clock that is exact in binary and in ns, and the same drive with weak motors.
  Drive drawn() const {
    const int seed = *rc::gen::inRange(1, 1000);
    const double speed = 0.1 * *rc::gen::inRange(5, 10), yaw = 0.1 * *rc::gen::inRange(10, 20);
    const double mass = *rc::gen::inRange(12, 40);
    put("drive.yaml",
        fmt::format(
            "robot: robot.yaml\nparameters: {{mass: {}, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}}\n"
            "trajectory: {{kind: commissioning, speed: {}, yaw_rate: {}, period: 8}}\nduration: 16\nseed: {}\n"
            "sensors: {{noise: uniform, wheel_speed: 0.02, effort: 0.02, position: 0.002, heading: 0.003,\n"
            "  encoder_counts_per_turn: 4096, log: [angles, speeds, pose]}}\nrate: 128\n",
            mass, speed, yaw, seed));
    std::filesystem::remove(path("drawn.csv"));
    RC_ASSERT(run("simulate drive.yaml --out drawn.csv --quiet --force").err == "");
    Drive drive;
    drive.healthy = core::read_all(*logs::open_log({path("drawn.csv")}));
    drive.faulty = drive.healthy;
    for (const char* effort : {"tau_r", "tau_l"}) {
      for (std::size_t k = drive.faulty.rows() / 2; k < drive.faulty.rows(); ++k) {
        drive.faulty.column(effort)[k] *= 1.5;
      }
    }
    drive.robot = bytes(path("robot.yaml"));
    return drive;
  }

  /// Applies `change` to both logs.
  template <typename Change>
  static Drive changed(Drive drive, const Change& change) {
    change(drive.healthy);
    change(drive.faulty);
    return drive;
  }

  void write(const std::string& name, const LogTable& table) const {
    const auto log = logs::create_log(path(name), table.names);
    LogBlock all;
    all.t = table.t;
    all.columns = table.columns;
    log->write(all);
    log->commit();
  }

  Answers answers(const Drive& drive) const {
    put("this.yaml", drive.robot);
    write("healthy" + drive.ending, drive.healthy);
    write("faulty" + drive.ending, drive.faulty);
    std::filesystem::remove_all(path("result"));
    Answers all;
    all.model = said("commission healthy" + drive.ending + " --robot this.yaml --out result");
    all.identification = said("identify healthy" + drive.ending + " --robot this.yaml --no-shapes");
    all.detection = said("detect faulty" + drive.ending + " --model result/model.json");
    RC_ASSERT_FALSE(all.detection.at("events").empty());
    return all;
  }

  Json said(const std::string& command) const {
    const Outcome outcome = run(command + " --json --threads 1");
    if (outcome.code != 0 && outcome.code != 1) {
      RC_FAIL(command + ": " + outcome.err);
    }
    return Json::parse(outcome.out);
  }
};

/// What was learnt is the same to the last bit.
void expect_same_model(const Json& one, const Json& two) {
  for (const char* key : {"physical", "feasible_set", "detector", "validation"}) {
    RC_ASSERT(difference(one.at(key), two.at(key), 0.0, 0.0, key) == "");
  }
}

/// When each event was raised, and of which output.
std::vector<std::pair<double, std::string>> alarms_of(const Answers& answers) {
  std::vector<std::pair<double, std::string>> all;
  for (const Json& event : answers.detection.at("events")) {
    all.emplace_back(event.at("alarm").get<double>(), event.at("output").get<std::string>());
  }
  return all;
}

TEST_F(Metamorphic, ARobotByAnotherNameIsTheSame) {
  const bool holds = rc::check("renamed", [this] {
    Drive drive = drawn();
    const Answers before = answers(drive);
    const std::string name = *rc::gen::nonEmpty(
        rc::gen::container<std::string>(rc::gen::elementOf(std::string("abcXYZ 019-_.:,#'{}[]&*!|>%@?"))));
    std::string quoted = name;
    for (std::size_t at = 0; (at = quoted.find('\'', at)) != std::string::npos; at += 2) {
      quoted.insert(at, 1, '\'');
    }
    drive.robot.replace(drive.robot.find("name: example"), 13, "name: '" + quoted + "'");
    Answers after = answers(drive);
    RC_ASSERT(after.model.at("robot").at("name") == name);
    for (Json* each : {&after.model, &after.identification, &after.detection}) {
      if (each->contains("robot") && (*each)["robot"].is_object()) {
        (*each)["robot"]["name"] = "example";
      }
    }
    RC_ASSERT(difference(before, after, 0.0) == "");
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, TheOrderOfColumnsDoesNotMatter) {
  const bool holds = rc::check("columns permuted", [this] {
    const Drive drive = drawn();
    std::vector<std::size_t> order(drive.healthy.names.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t k = order.size() - 1; k > 0; --k) {
      std::swap(order[k], order[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(k) + 1))]);
    }
    const Drive other = changed(drive, [&](LogTable& table) {
      const LogTable old = table;
      for (std::size_t k = 0; k < order.size(); ++k) {
        table.names[k] = old.names[order[k]];
        table.columns[k] = old.columns[order[k]];
      }
    });
    RC_ASSERT(difference(answers(drive), answers(other), 0.0) == "");
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, TheFormatOfALogDoesNotMatter) {
  const bool holds = rc::check("CSV, HDF5, MCAP, db3", [this] {
    Drive drive = drawn();
    // A heading goes through a quaternion in a bag, and an angle through no such thing.
    const bool bag = *rc::gen::arbitrary<bool>();
    const Answers before = answers(drive);
    drive.ending = bag ? *rc::gen::element<std::string>(".mcap", ".db3") : ".h5";
    RC_ASSERT(difference(before, answers(drive), bag ? 1e-9 : 0.0) == "");
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, WhenTheClockBeganDoesNotMatter) {
  const bool holds = rc::check("time shifted", [this] {
    Drive drive = drawn();
    const Answers before = answers(drive);
    const double by = *rc::gen::element(-1000.0, 0.5, 86400.0, 1.75e9, 4.0e9);
    RC_LOG() << "by " << by << " s\n";
    const Drive late = changed(drive, [&](LogTable& table) {
      for (double& t : table.t) {
        t += by;
      }
    });
    RC_ASSERT(difference(before, answers(late), 0.0, by) == "");
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, RowsOfABagAreTakenByTheirStamps) {
  const bool holds = rc::check("rows permuted within a second", [this] {
    Drive drive = drawn();
    drive.ending = *rc::gen::element<std::string>(".mcap", ".db3");
    const Answers before = answers(drive);
    const auto stretch = static_cast<std::size_t>(*rc::gen::inRange(2, 120));
    const Drive mixed = changed(drive, [&](LogTable& table) {
      const auto reversed = [&](std::vector<double>& values) {
        for (std::size_t k = 0; k < values.size(); k += stretch) {
          std::reverse(values.begin() + static_cast<std::ptrdiff_t>(k),
                       values.begin() + static_cast<std::ptrdiff_t>(std::min(k + stretch, values.size())));
        }
      };
      reversed(table.t);
      std::ranges::for_each(table.columns, reversed);
    });
    RC_ASSERT(difference(before, answers(mixed), 0.0) == "");
  });
  EXPECT_TRUE(holds);
}

// Several files are the segments of one log: what stands in two is what one says that has a gap between them.
TEST_F(Metamorphic, ALogMayStandInSeveralFiles) {
  const bool holds = rc::check("split", [this] {
    const Drive drive = drawn();
    const auto rows = static_cast<int>(drive.healthy.rows());
    const auto at = static_cast<std::size_t>(*rc::gen::inRange(rows / 3, 2 * rows / 3));
    const Drive torn = changed(drive, [&](LogTable& table) {
      for (std::size_t k = at; k < table.rows(); ++k) {
        table.t[k] += 1.0;
      }
    });
    put("this.yaml", drive.robot);
    write("one.csv", torn.healthy);
    const auto part = [&](const std::string& name, std::size_t first, std::size_t last) {
      LogTable some = torn.healthy;
      const auto cut = [&](std::vector<double>& values) {
        values = {values.begin() + static_cast<std::ptrdiff_t>(first),
                  values.begin() + static_cast<std::ptrdiff_t>(last)};
      };
      cut(some.t);
      std::ranges::for_each(some.columns, cut);
      write(name, some);
    };
    part("first.csv", 0, at);
    part("second.csv", at, torn.healthy.rows());
    const Json one = said("commission one.csv --robot this.yaml"),
               two = said("commission first.csv second.csv --robot this.yaml");
    expect_same_model(one, two);
  });
  EXPECT_TRUE(holds);
}

// Units of columns are the user's: a log in halves of a radian, and the factor told, is the log in radians to the last
// bit.
TEST_F(Metamorphic, UnitsOfColumnsMayBeTold) {
  const bool holds = rc::check("columns in other units, with --map", [this] {
    const Drive drive = drawn();
    const double unit = *rc::gen::element(0.5, 0.125, 4.0);
    put("this.yaml", drive.robot);
    write("plain.csv", drive.healthy);
    LogTable other = drive.healthy;
    std::string mapped;
    for (const std::string name : {"omega_r", "omega_l", "phi_r", "phi_l", "tau_r", "tau_l"}) {
      std::ranges::for_each(other.column(name), [&](double& value) { value /= unit; });
      std::ranges::replace(other.names, name, "raw_" + name);
      mapped += fmt::format(" --map {0}=raw_{0}*{1}", name, unit);
    }
    write("other.csv", other);
    const Json before = said("commission plain.csv --robot this.yaml"),
               after = said("commission other.csv --robot this.yaml" + mapped);
    expect_same_model(before, after);
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, ARobotOfAFleetIsJudgedByItsLogsAlone) {
  const bool holds = rc::check("robots renamed and listed in another order", [this] {
    const Drive drive = drawn();
    put("this.yaml", drive.robot);
    write("healthy.csv", drive.healthy);
    write("sound.csv", drive.healthy);
    write("faulty.csv", drive.faulty);
    // What is said of the fleet, with the robot that has the fault called x and the other y.
    const auto fleet = [&](const std::string& faulty, const std::string& sound, bool first) {
      const std::string one = fmt::format("{0},healthy.csv,commission\n{0},faulty.csv,check\n", faulty),
                        two = fmt::format("{0},healthy.csv,commission\n{0},sound.csv,check\n", sound);
      put("list.csv", "robot,log,role\n" + (first ? one + two : two + one));
      Json said_of = said("fleet list.csv --robot this.yaml");
      const std::function<void(Json&)> rename = [&](Json& value) {
        if (value.is_structured()) {
          std::ranges::for_each(value, rename);
        } else if (value == Json(faulty) || value == Json(sound)) {
          value = value == Json(faulty) ? "x" : "y";
        }
      };
      rename(said_of);
      return said_of;
    };
    const Json before = fleet("a", "b", true), after = fleet("z 9", "b-1", false);
    RC_ASSERT(before.at("alarms").size() == 1);
    for (const char* key : {"robots", "alarms", "population", "drift", "outside", "failed"}) {
      RC_ASSERT(difference(before.at(key), after.at(key), 1e-12, 0.0, key) == "");
    }
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, AMirroredTwinHasTheSameParametersAndAlarms) {
  const bool holds = rc::check("left and right swapped", [this] {
    const Drive drive = drawn();
    const Answers before = answers(drive);
    const Answers after = answers(changed(drive, [](LogTable& table) {
      for (const char* name : {"phi_", "omega_", "tau_"}) {
        table.column(std::string(name) + "r").swap(table.column(std::string(name) + "l"));
      }
      for (const char* name : {"y", "theta"}) {
        for (double& value : table.column(name)) {
          value = -value;
        }
      }
    }));
    RC_ASSERT(difference(before.model.at("physical"), after.model.at("physical"), 1e-9) == "");
    RC_ASSERT(alarms_of(before) == alarms_of(after));
  });
  EXPECT_TRUE(holds);
}

TEST_F(Metamorphic, ADeclaredUnitOfEffortsDoesNotMatter) {
  const bool holds = rc::check("currents and the motor's constant instead of torques", [this] {
    const Drive drive = drawn();
    const Answers before = answers(drive);
    const double scale = *rc::gen::element(0.05, 0.25, 3.0, 1000.0);
    RC_LOG() << scale << " A for a N·m\n";
    Drive other = changed(drive, [&](LogTable& table) {
      for (const char* side : {"r", "l"}) {
        std::ranges::for_each(table.column(fmt::format("tau_{}", side)), [&](double& value) { value *= scale; });
        std::ranges::replace(table.names, fmt::format("tau_{}", side), fmt::format("current_{}", side));
      }
    });
    other.robot.replace(other.robot.find("kind: torque"), 12, "kind: current");
    const std::string bound = "effort: {bound: 0.02, bias: 0.0001}";
    other.robot.replace(other.robot.find(bound), bound.size(),
                        fmt::format("effort: {{bound: {}, bias: {}}}", 0.02 * scale, 0.0001 * scale));
    other.robot += fmt::format("motor: {{torque_constant: {}}}\n", 1.0 / scale);
    const Answers after = answers(other);
    for (const auto& [name, physical] : before.model.at("physical").items()) {
      for (const char* key : {"unit", "estimate", "lower", "upper", "standard_error"}) {
        RC_ASSERT(difference(physical.at(key), after.model.at("physical").at(name).at(key), 1e-9, 0.0, name) == "");
      }
    }
    RC_ASSERT(alarms_of(before) == alarms_of(after));
  });
  EXPECT_TRUE(holds);
}

}  // namespace
}  // namespace wheelwright::app::metamorphic_test
