// SPDX-License-Identifier: Apache-2.0
// Tables that are not what they look like: other units, clocks and headers. What is not read is said.
#include "formats/logs/csv.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::logs::csv_strange_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::IsEmpty;
using ::testing::Not;

class CsvStrange : public testing::ScratchTest {
 protected:
  LogTable read(const std::string& text, const CsvOptions& options = {}) {
    CsvLog log({put("log.csv", text)}, options);
    said = sentences(log.report());
    return read_all(log);
  }
  std::vector<std::string> said;
};

/// `header` and 40 lines, each made of its number.
std::string table(const std::string& header, const std::function<std::string(int)>& line) {
  std::string text = header + "\n";
  for (int k = 0; k < 40; ++k) {
    text += line(k) + "\n";
  }
  return text;
}

std::string rest_of(int k, const std::string& rest) { return fmt::format("{:.2f}{}", 0.01 * k, rest); }

TEST_F(CsvStrange, SaysWhichColumnsWereConvertedOrNotTakenForTheirUnit) {
  const auto line = [](int k) { return rest_of(k, ",60,1000,2,90"); };
  const LogTable some = read(table("t,omega_r [rpm],current_r (mA),tau_r,theta_deg", line));
  EXPECT_THAT(some.names, ElementsAre("omega_r", "current_r", "tau_r", "theta"));
  EXPECT_NEAR(some.column("omega_r")[0], 6.2832, 1e-4);
  EXPECT_THAT(said, Contains(HasSubstr("omega_r is omega_r [rpm] times 0.10472")));
  EXPECT_THAT(said, Contains(HasSubstr("current_r is current_r (mA) times 0.001")));
  EXPECT_THAT(said, Contains(HasSubstr("theta is theta_deg times 0.0174533")));

  for (const char* name : {"omega_r / rpm", "omega_r/rpm", "omega_r {rpm}", "omega_r<RPM>", "omega_r_rpm"}) {
    EXPECT_NEAR(read(table(fmt::format("t,{},x,tau_r,y", name), line)).column("omega_r")[0], 6.2832, 1e-4);
    EXPECT_THAT(said, ElementsAre(HasSubstr(fmt::format("omega_r is {} times 0.10472", name))));
    CsvOptions options;
    options.map = {{"omega_r", fmt::format("{}*0.10472", name)}};
    EXPECT_NEAR(read(table(fmt::format("t,{},x,tau_r,y", name), line), options).column("omega_r")[0], 6.2832, 1e-4);
    EXPECT_THAT(said, Each(Not(HasSubstr("was not taken")))) << "the way out is one";
  }
  read(table("t,tau_r [lbft],x,y,theta", line));
  EXPECT_THAT(said, ElementsAre(HasSubstr("--map tau_r=\"tau_r [lbft]*FACTOR\"")));
}

TEST_F(CsvStrange, UnitsOfTheContractAreTakenInEveryKindOfBrackets) {
  const auto line = [](int k) { return rest_of(k, ",1,2,3,4"); };
  EXPECT_THAT(read(table("t / s,omega_r / rad/s,omega_l {rad/s},tau_r <Nm>,tau_l/Nm", line)).names,
              ElementsAre("omega_r", "omega_l", "tau_r", "tau_l"));
  EXPECT_THAT(said, IsEmpty());
  EXPECT_THAT(read(table("t,omega_r,omega_r [rpm],velocity[1],x/map", line)).names, ElementsAre("omega_r"));
  EXPECT_THAT(said, IsEmpty()) << "nothing is missing, an index is no unit, and map is none";
}

TEST_F(CsvStrange, ATimeInAnUnknownUnitIsToldWhereNoOtherIsThere) {
  EXPECT_THAT(input_error([&] { read("Time [fortnights],omega_r\n0,1\n"); }),
              AllOf(HasSubstr("no column for t"), HasSubstr("--map t=\"Time [fortnights]*FACTOR\"")));
}

TEST_F(CsvStrange, ATableOfWhichNothingButTheTimeIsKnownIsRefused) {
  const std::string text = table("t,omga_r,tau_q [rpm],tau_l [lbft]", [](int k) { return rest_of(k, ",1,2,3"); });
  EXPECT_THAT(input_error([&] { read(text); }),
              AllOf(HasSubstr("log.csv: no column but the time is known: the file has t, omga_r"),
                    HasSubstr("expected one of omega_r"), HasSubstr("did you mean omega_r? Then add --map omega_r="),
                    HasSubstr("--map tau_l=\"tau_l [lbft]*FACTOR\"")));
  CsvOptions extra;
  extra.extra = {"omga_r"};
  EXPECT_THAT(read(text, extra).names, ElementsAre("omga_r"));
  CsvOptions wanted;
  wanted.only = {"omega_r"};
  EXPECT_THAT(read(text, wanted).names, IsEmpty()) << "who wants columns says which are missing";
  EXPECT_EQ(read(table("t", [](int k) { return rest_of(k, ""); })).rows(), 40U);
}

TEST_F(CsvStrange, AnIndexThatTheHeaderDoesNotNameIsRefusedWhereTheLastColumnIsEmpty) {
  for (const char* quote : {"", "\""}) {
    const auto indexed = [&](int k) { return fmt::format("{0}{1}{0},{2:.2f},{3},2,", quote, k, 0.01 * k, k % 3); };
    EXPECT_THAT(input_error([&] { read(table("t,omega_r,tau_r,note", indexed)); }),
                AllOf(HasSubstr("log.csv:2: 5 fields: expected 4"), HasSubstr("index")));
  }
  const auto indexed = [](int k) { return fmt::format("{},{},{:.2f},2,", k, k % 3, 0.01 * k); };
  EXPECT_THAT(input_error([&] { read(table("omega_r,t,tau_r,note", indexed)); }), HasSubstr("index"));
}

TEST_F(CsvStrange, SeparatorsAtTheEndOfRowsAreNoIndex) {
  const auto seconds = [](int k) { return fmt::format("{},{},2,", k, k % 3); };
  EXPECT_EQ(read(table("t,omega_r,tau_r", seconds)).t[3], 3.0);
  EXPECT_EQ(read(table("t,omega_r,tau_r,", seconds)).t[3], 3.0);
  const auto numbered = [](int k) { return fmt::format("{},{:.2f},{},", k, 0.01 * k, k); };
  EXPECT_EQ(read(table("seq,t,x", numbered)).column("x")[3], 3.0) << "the time rises as it is";
  const auto rising = [](int k) { return fmt::format("{:.2f},{},2,", 0.01 * k, k); };
  EXPECT_EQ(read(table("t,phi_r,tau_r", rising)).t[3], 0.03);
}

TEST_F(CsvStrange, TimesSinceBootInOtherUnitsAreNoted) {
  const auto said_of = [&](const char* text) {
    const double step = std::stod(std::string(text));
    read(table("timestamp,omega_r", [&](int k) { return fmt::format("{:.0f},1", 5.0 * step + k * step); }));
    return said;
  };
  EXPECT_THAT(said_of("4000"),
              ElementsAre(AllOf(HasSubstr("log.csv: the median step is 4000 s: the times look like µs"),
                                HasSubstr("--map t=\"timestamp*1e-06\""))));
  EXPECT_THAT(said_of("10"), ElementsAre(AllOf(HasSubstr("look like ms"), HasSubstr("timestamp*0.001"))));
  EXPECT_THAT(said_of("1e7"), ElementsAre(AllOf(HasSubstr("look like ns"), HasSubstr("timestamp*1e-09"))));
  EXPECT_THAT(said_of("300"), ElementsAre(AllOf(HasSubstr("median step is 300 s"), HasSubstr("timestamp*FACTOR"))))
      << "ms and µs are as likely";
  EXPECT_THAT(said_of("1"), IsEmpty());

  CsvOptions options;
  options.map = {{"t", "timestamp*2"}};
  read(table("timestamp,omega_r", [](int k) { return fmt::format("{},1", k * 2000); }), options);
  EXPECT_THAT(said, Contains(HasSubstr("--map t=\"timestamp*2e-06\""))) << "a factor that is there is kept";
}

TEST_F(CsvStrange, DaysOfASpreadsheetAndTicksOfWindowsAreNoted) {
  read(table("time,omega_r", [](int k) { return fmt::format("{:.10f},1", 45678.5 + k * 0.01 / 86400.0); }));
  EXPECT_THAT(said, Contains(AllOf(HasSubstr("look like days"), HasSubstr("--map t=\"time*86400\""))));
  read(table("time,omega_r", [](int k) { return fmt::format("{},1", 133'500'000'000'000'000 + k * 100'000); }));
  EXPECT_THAT(said, Contains(AllOf(HasSubstr("ticks of 100 ns"), HasSubstr("--map t=\"time*1e-07\""))));
}

TEST_F(CsvStrange, TheStepsTellCountsSinceBootFromThoseSince1970) {
  const auto counts = [](std::int64_t first, std::int64_t step) {
    return table("timestamp,omega_r", [=](int k) { return fmt::format("{},1", first + k * step); });
  };
  const LogTable boot = read(counts(1'200'000'000'000, 10'000'000));  // 20 minutes in ns, or a day of 2008 in ms
  EXPECT_NEAR(boot.t[39] - boot.t[0], 0.39, 1e-9);
  EXPECT_THAT(said, ElementsAre(HasSubstr("1200 s of its own clock"), HasSubstr("counts of ns")));
  const LogTable day = read(counts(1'200'000'000'000, 10));
  EXPECT_NEAR(day.t[39] - day.t[0], 0.39, 1e-9);
  EXPECT_THAT(said, Contains(HasSubstr("counts of ms")));
}

TEST_F(CsvStrange, SinceBootColumnsThatWereSampledApartHaveStepsInTheSameUnit) {
  CsvOptions options;
  options.min_rows = 10;
  const std::string text = table("timestamp,tau_r,x", [](int k) {
    return fmt::format("{},{}", 1'200'000'000'000 + k * 10'000'000LL, k % 2 == 0 ? "1," : fmt::format(",{}", k));
  });
  const LogTable apart = read(text, options);
  EXPECT_EQ(apart.rows(), 19U);
  EXPECT_NEAR(apart.t[1] - apart.t[0], 0.02, 1e-9);
  EXPECT_EQ(apart.column("x")[0], 2.0);
}

TEST_F(CsvStrange, AHeadingThatIsUnwrappedIsSaidAndDegreesAreNoted) {
  const auto turning = [](double turn, double least) {
    return table("t,theta",
                 [=](int k) { return rest_of(k, fmt::format(",{:.4f}", least + std::fmod(k * 0.1 * turn, turn))); });
  };
  for (const double least : {0.0, -180.0}) {
    read(turning(360.0, least));
    EXPECT_THAT(said,
                Contains(AllOf(HasSubstr("theta looks like degrees"), HasSubstr("--map theta=\"theta*0.0174533\""))));
  }
  const double turn = 2.0 * std::acos(-1.0);
  const LogTable radians = read(turning(turn, 0.0));
  EXPECT_NEAR(radians.column("theta")[39], 3.9 * turn, 1e-3);
  EXPECT_THAT(said, ElementsAre(AllOf(HasSubstr("3 jumps of theta by more than π undone"), HasSubstr("log.csv:12"))));
}

TEST_F(CsvStrange, AColumnThatAnotherFileLacksIsSaidToBeLeftOut) {
  const auto line = [](int k) { return rest_of(k, ",1,2,3"); };
  const CsvLog log({put("a.csv", table("t,omega_r,tau_r,x", line)), put("b.csv", table("t,omega_r,yy,xx", line))});
  EXPECT_THAT(sentences(log.report()),
              ElementsAre(AllOf(HasSubstr("a.csv: tau_r, x are left out"), HasSubstr("given together"))));
}

}  // namespace
}  // namespace wheelwright::logs::csv_strange_test
