// SPDX-License-Identifier: Apache-2.0
// What convert, export, design, robot and simulate write fits its schema, and the schemas refuse what is not there.
#include "tests/app/program.hpp"
#include "tests/robots/robot_samples.hpp"

namespace wheelwright::app::schemas_test {
namespace {

using testing::Outcome;

class Schemas : public testing::ProgramTest {
 protected:
  void SetUp() override { (void)testing_support::skip_unless(has_validator(), "python3-jsonschema is not installed"); }

  static std::string shipped() { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }

  /// The JSON that `arguments` print, which has to fit `schema`.
  Json fitting(const std::string& schema, const std::string& arguments) const {
    const Outcome done = run(arguments);
    EXPECT_EQ(done.code, 0) << arguments << "\n" << done.err;
    put("said.json", done.out);
    EXPECT_EQ(misfit(schema, "said.json"), "") << arguments;
    return Json::parse(done.out, nullptr, false);
  }

  /// Whether `schema` refuses `good` with `value` at `pointer`; a null takes the key away.
  bool refused(const std::string& schema, Json good, const std::string& pointer, const Json& value) const {
    const Json::json_pointer at(pointer);
    if (value.is_null()) {
      good.at(at.parent_pointer()).erase(at.back());
    } else {
      good[at] = value;
    }
    files::write_json(path("changed.json"), good);
    return misfit(schema, "changed.json") != "";
  }
};

TEST_F(Schemas, Convert) {
  const Json said = fitting("convert.schema.json", "convert " + shipped() + " drive.mcap --json");
  EXPECT_TRUE(refused("convert.schema.json", said, "/schema", "wheelwright/convert/2"));
  EXPECT_TRUE(refused("convert.schema.json", said, "/rows", -1));
  EXPECT_TRUE(refused("convert.schema.json", said, "/unheard_of", 1));
  EXPECT_TRUE(refused("convert.schema.json", said, "/notes", nullptr));
}

TEST_F(Schemas, Export) {
  commission_shipped();
  const Json inside = fitting("export.schema.json", "export model/model.json --language c --json");
  (void)fitting("export.schema.json", "export model/model.json --language c --json --out firmware");
  (void)fitting("export.schema.json",
                "export model/model.json --language c --json --set box --test symmetric --persistence 2/3");
  EXPECT_TRUE(refused("export.schema.json", inside, "/text", nullptr)) << "neither a text nor a file";
  EXPECT_TRUE(refused("export.schema.json", inside, "/file", "wheelwright.h")) << "both";
  EXPECT_TRUE(refused("export.schema.json", inside, "/language", "fortran"));
  EXPECT_TRUE(refused("export.schema.json", inside, "/persistence/n", 65));
}

TEST_F(Schemas, Design) {
  commission_shipped();
  const std::string drive = " --duration 4 --stages 1 --speed 8 --acceleration 20 --quiet --json";
  const Json bounds =
      fitting("design.schema.json", "design --robot robot.yaml --for bounds --rate 50 --radius 1" + drive);
  (void)fitting("design.schema.json", "design --model model/model.json --for bounds --box -1 3 -1 1" + drive);
  const Json detection = fitting("design.schema.json",
                                 "design --model model/model.json --for detection --fault wheel_radius=0.03" + drive);
  const Json apart = fitting("design.schema.json",
                             "design --robot robot.yaml --for discrimination --rate 50 --effort 6 --between coulomb "
                             "--between caster_drag" +
                                 drive);
  EXPECT_TRUE(refused("design.schema.json", bounds, "/for", "detection")) << "no faults";
  EXPECT_TRUE(refused("design.schema.json", bounds, "/faults", detection.at("faults"))) << "another aim's";
  EXPECT_TRUE(refused("design.schema.json", bounds, "/use/speed", 1.5));
  EXPECT_TRUE(refused("design.schema.json", bounds, "/parameters/0/promised/lower", "low"));
  EXPECT_TRUE(refused("design.schema.json", detection, "/faults/0/side", "left"));
  EXPECT_TRUE(refused("design.schema.json", apart, "/pairs/0/promised/probability", 1.5));
  EXPECT_TRUE(refused("design.schema.json", apart, "/sentences", nullptr));
}

TEST_F(Schemas, Check) {
  commission_shipped();
  const Json said = fitting("check.schema.json", "check model/model.json " + shipped() + " --json");
  EXPECT_TRUE(refused("check.schema.json", said, "/at_risk/spent", "all"));
  EXPECT_TRUE(refused("check.schema.json", said, "/at_risk/sums/proved", -1));
  EXPECT_TRUE(refused("check.schema.json", said, "/at_risk/bounds/0/side", "left"));
  const Json model = files::read_json(path("model/model.json"));
  EXPECT_EQ(misfit("model.schema.json", "model/model.json"), "");
  EXPECT_TRUE(refused("model.schema.json", model, "/at_risk/sums", nullptr));
  EXPECT_TRUE(refused("model.schema.json", model, "/at_risk/feasible_set/origin/0", Json::object())) << "names nothing";
  EXPECT_TRUE(refused("model.schema.json", model, "/at_risk/binding/0/lower/0/multiplier", nullptr));
  EXPECT_TRUE(refused("model.schema.json", model, "/at_risk/ellipsoids/0/risk", 2.0));
}

TEST_F(Schemas, Robot) {
  const testing::SampleRobot sample;
  put("robot.urdf", sample_urdf(sample, usual_frames(sample)));
  const Json said = fitting("robot-file.schema.json", "robot --urdf robot.urdf --json");
  EXPECT_TRUE(refused("robot-file.schema.json", said, "/robot/wheel_radius", -1));
  EXPECT_TRUE(refused("robot-file.schema.json", said, "/origins/wheel_radius", ""));
  EXPECT_TRUE(refused("robot-file.schema.json", said, "/unheard_of", 1));
}

TEST_F(Schemas, Simulate) {
  const std::string scenario = (examples() / "scenarios/healthy.yaml").string();
  const Json said =
      fitting("simulation.schema.json", fmt::format("simulate '{}' --out drive.csv --seed 7 --json", scenario));
  EXPECT_EQ(said.at("seed"), 7);
  EXPECT_TRUE(refused("simulation.schema.json", said, "/schema", "wheelwright/simulation/2"));
  EXPECT_TRUE(refused("simulation.schema.json", said, "/rows", -1));
  EXPECT_TRUE(refused("simulation.schema.json", said, "/log", nullptr));
  EXPECT_TRUE(refused("simulation.schema.json", said, "/unheard_of", 1));
}

}  // namespace
}  // namespace wheelwright::app::schemas_test
