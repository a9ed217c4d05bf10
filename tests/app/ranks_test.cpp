// SPDX-License-Identifier: Apache-2.0
// Several processes of the program under mpirun.
#include "tests/app/program.hpp"

namespace wheelwright::app::ranks_test {
namespace {

using ::testing::HasSubstr;
using testing::Outcome;

class Ranks : public testing::ProgramTest {
 protected:
  /// As root, too, and with more ranks than processors.
  static constexpr const char* kMpi =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 "
      "OMPI_MCA_hwloc_base_binding_policy=none LSAN_OPTIONS=detect_leaks=0 mpirun";

  static bool starts() { return std::system(fmt::format("{} -n 2 true > /dev/null 2>&1", kMpi).c_str()) == 0; }

  /// A fleet on two ranks, whose calls are recorded (files/recorded_calls.cpp).
  Outcome fleet(const std::string& options) const {
    std::filesystem::remove(path("calls"));
    return run("fleet fleet --robot robot.yaml --threads 1 --fresh --out out", "/dev/null",
               fmt::format("{} {} -n 2 env ASAN_OPTIONS=\"$ASAN_OPTIONS:verify_asan_link_order=0\" RECORDED_CALLS='{}' "
                           "LD_PRELOAD='{}'",
                           kMpi, options, path("calls").string(), WHEELWRIGHT_RECORDED_CALLS));
  }
};

// They listened on every address, and Open MPI asks nobody who connects who he is.
TEST_F(Ranks, OnOneMachineListenOnNoAddress) {
  if (testing_support::skip_unless(starts(), "mpirun does not start two processes")) {
    return;
  }
  std::filesystem::create_directory(path("fleet"));
  for (const char* const robot : {"amy", "bob", "cleo"}) {
    std::filesystem::copy_file(examples() / "healthy.csv.gz", path("fleet") / (std::string(robot) + ".csv.gz"));
  }
  const Outcome alone = fleet("");
  EXPECT_LE(alone.code, 1) << alone.err;
  EXPECT_THAT(bytes(path("calls")), ::testing::Not(HasSubstr("listen")));
  EXPECT_THAT(bytes(path("calls")), HasSubstr("fleet.json")) << "nothing was recorded";
  EXPECT_LE(fleet("--mca btl self,tcp").code, 1);
  EXPECT_THAT(bytes(path("calls")), HasSubstr("listen")) << "who asks for the network has it";
}

// Processes look at the files one after another: a log that was being written when they began ended the run.
TEST_F(Ranks, ALogThatIsWrittenToIsItsRobotsFinding) {
  if (testing_support::skip_unless(starts(), "mpirun does not start two processes")) {
    return;
  }
  std::filesystem::create_directory(path("fleet"));
  for (const char* const robot : {"amy", "bob", "cleo"}) {
    std::filesystem::copy_file(examples() / "healthy.csv.gz", path("fleet") / (std::string(robot) + ".csv.gz"));
  }
  const std::string words = "fleet fleet --robot robot.yaml --threads 1 --json --out out";
  const std::string ranks = fmt::format("{} -n 2", kMpi);
  const Outcome told = run(words, "/dev/null",
                           "sh -c '(while :; do touch fleet/bob.csv.gz; done) & \"$@\"; code=$?; kill $!; exit $code' "
                           "sh env " +
                               ranks);
  ASSERT_EQ(told.code, 1) << told.err;
  const Json json = Json::parse(told.out);
  EXPECT_EQ(json["robots"]["status"]["commissioned"], 2);
  ASSERT_EQ(json["failed"].size(), 1U);
  EXPECT_THAT(json["failed"][0]["reason"].get<std::string>(), HasSubstr("bob.csv.gz: written to while"));
  const Outcome again = run(words, "/dev/null", ranks);
  EXPECT_LE(again.code, 1) << again.err;
  EXPECT_EQ(Json::parse(again.out)["robots"]["status"]["commissioned"], 3);
}

}  // namespace
}  // namespace wheelwright::app::ranks_test
