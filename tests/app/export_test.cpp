// SPDX-License-Identifier: Apache-2.0
// wheelwright export: the header of a commissioned model decides as `wheelwright detect` does, and bad wishes are told.
#include "detector/online_model.hpp"
#include "formats/logs/csv.hpp"
#include "results/model_file.hpp"
#include "tests/app/program.hpp"
#include "tests/support/c_detector.hpp"

namespace wheelwright::app::export_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;
using testing_support::CDetector;
using testing_support::Seen;

class Export : public testing::ProgramTest {
 protected:
  /// The exported header in `folder` and the library's detector along the log of the fault that ships as a scenario.
  Seen seen(const std::string& header, const std::string& name, detector::DetectorOptions options) const {
    const OnlineModel model = read_model(path("model/model.json"));
    const auto columns = model.measurement.columns();
    Detector ours = make_detector(model, options);
    CDetector theirs(directory_, header, name, columns.size(), model.model.n());
    if (!theirs.loaded()) {
      return {};
    }
    CsvLog log({path("fault.csv")}, {});
    std::vector<double> t, samples;
    LogBlock block;
    while (log.next(block)) {
      for (std::size_t k = 0; k < block.rows(); ++k) {
        t.push_back(block.t[k]);
        for (const std::string& column : columns) {
          samples.push_back(block.columns[log.find(column).value()][k]);
        }
      }
    }
    return testing_support::compare(ours, theirs, t, samples);
  }
};

TEST_F(Export, DecidesAsDetectDoes) {
  if (testing_support::skip_unless(testing_support::has_c_compiler(), "there is no cc")) {
    return;
  }
  commission_shipped();
  simulate("fault.yaml", "fault.csv");
  const Outcome polytope = run("export model/model.json --language c --out firmware");
  ASSERT_EQ(polytope.code, 0) << polytope.err;
  EXPECT_THAT(polytope.out, HasSubstr("wrote firmware/wheelwright.h"));
  const Seen first = seen(bytes(path("firmware/wheelwright.h")), "wheelwright", {});
  EXPECT_EQ(first.different, 0u);
  EXPECT_GT(first.valid, 1000u);
  EXPECT_GT(first.alarms, 10u);

  const Outcome box =
      run("export model/model.json --language c --set box --test symmetric --persistence 2/3 --name left");
  ASSERT_EQ(box.code, 0) << box.err;
  EXPECT_THAT(box.out, HasSubstr("left_step(&state, t, sample, &decision);"));
  detector::DetectorOptions options;
  options.set = detector::ParameterSetKind::box;
  options.test = detector::Test::symmetric;
  options.persistence = detector::Persistence{.k = 2, .n = 3};
  const Seen second = seen(box.out, "left", options);
  EXPECT_EQ(second.different, 0u);
  EXPECT_GT(second.alarms, 10u);
}

TEST_F(Export, SaysAsJsonWhatItWrote) {
  commission_shipped();
  const Outcome text = run("export model/model.json --language c --json");
  ASSERT_EQ(text.code, 0) << text.err;
  const Json inside = Json::parse(text.out);
  EXPECT_EQ(inside["schema"], "wheelwright/export/1");
  EXPECT_EQ(inside["outputs"].size(), 2u);
  EXPECT_GT(inside["vertices"].get<int>(), 4);
  const Outcome file = run("export model/model.json --language c --json --out firmware --name robot");
  ASSERT_EQ(file.code, 0) << file.err;
  const Json beside = Json::parse(file.out);
  EXPECT_EQ(beside["bytes"].get<std::size_t>(), bytes(path("firmware/robot.h")).size());
  EXPECT_FALSE(beside.contains("text"));
}

TEST_F(Export, SaysWhatIsWrong) {
  put("no.json", "{\"schema\": \"something else\"}");
  const auto expect_refused = [&](const std::string& words, const std::string& why) {
    const Outcome outcome = run("export " + words);
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.out, IsEmpty()) << words;
    EXPECT_THAT(outcome.err, HasSubstr(why)) << words;
  };
  expect_refused("", "MODEL");
  expect_refused("no.json", "--language");
  expect_refused("no.json --language fortran", "fortran");
  expect_refused("nowhere.json --language c", "nowhere.json");
  expect_refused("no.json --language c", "no.json");
  commission_shipped();
  expect_refused("model/model.json --language c --name 2fast", "name '2fast': expected a prefix of C names");
  expect_refused("model/model.json --language c --set ball", "ball");
  expect_refused("model/model.json --language c --out robot.yaml", "robot.yaml");
  EXPECT_THAT(names_in("."), ::testing::Not(::testing::Contains("wheelwright.h")));
}

TEST_F(Export, HelpNamesItsOptions) {
  const std::string help = run("export --help").out;
  for (const std::string option : {"MODEL", "--language", "--name", "--set", "--test", "--persistence", "--out",
                                   "--json", "--quiet", "Examples:\n"}) {
    EXPECT_THAT(help, HasSubstr(option));
  }
}

}  // namespace
}  // namespace wheelwright::app::export_test
