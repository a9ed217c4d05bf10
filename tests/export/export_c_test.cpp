// SPDX-License-Identifier: Apache-2.0
// The exported C detector against the library: every decision, residual and threshold to the last bit.
#include <algorithm>
#include <cmath>
#include <sstream>

#include <Eigen/LU>

#include "bounds/slab_rows.hpp"
#include "detector/export/export_c.hpp"
#include "model/differential_drive.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/robot.hpp"
#include "model/single_axis.hpp"
#include "tests/support/c_detector.hpp"
#include "tests/support/random.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::exporter::export_c_test {

using model::EffortChanges;

namespace {

using ::testing::HasSubstr;
using testing_support::CDetector;
using testing_support::Random;
using testing_support::Seen;

/// What a detector knows of the motion between samples.
enum class Between {
  nothing,       ///< not asked for
  interpolated,  ///< no bound on the motion: only what efforts may do
  mobility,      ///< by the model
  limit,         ///< a limit on the accelerations
  both,
};

/// One detector and the world that it watches.
struct Case {
  Model model;
  FilterDesign design{.order = 2, .alpha = 9.0, .beta = 7.0};
  MotionKind motion = MotionKind::angle;
  Hold hold = Hold::first_order;
  EffortChanges changes = EffortChanges::between;
  bool effort_unsigned = false;
  bool heading = false;  // measured
  bool noisy = true;     // bounds on the errors of the rows
  Between between = Between::interpolated;
  double nominal = 0.01;  // s
  double jitter = 0.0;    // share of the step
  bool lost = false;      // single rows are missing, and steps of 1.6 steps
  bool bridges = true;    // whether segments go on there
  double gap = 0.3;       // s
  bool storms = false;    // some samples are no numbers, alone and in spells
  Interval delay{0.0, 0.0};
  detector::DetectorOptions options{};
  Eigen::Index half_spaces = 4;  // for each parameter
};

Model drive(bool anisotropic, bool coulomb) {
  return DifferentialDrive{
      .wheel_radius = 0.1, .track_width = 0.4, .anisotropic_friction = anisotropic, .coulomb = coulomb}
      .model();
}

/// Both axes coupled through inertia and friction, as with a centre of mass beside the middle.
Model coupled() {
  Model m = drive(false, true);
  m.parameters.push_back(m.parameters.front());
  m.parameters.back().name = m.parameters.back().physical = "beside";
  const std::size_t j = m.p() - 1;
  m.terms.push_back({.output = 0, .parameter = j, .kind = Term::Kind::acceleration, .coordinate = 1, .scale = -0.05});
  m.terms.push_back({.output = 1, .parameter = j, .kind = Term::Kind::acceleration, .coordinate = 0, .scale = -0.05});
  m.terms.push_back({.output = 0, .parameter = j, .kind = Term::Kind::speed, .coordinate = 1, .scale = 0.03});
  m.terms.push_back({.output = 1, .parameter = j, .kind = Term::Kind::speed, .coordinate = 0, .scale = -0.3});
  return m;
}

/// A drive with an effect of the robot file.
Model with_effect(const model::RobotEffect& effect) {
  model::Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  robot.effects = {effect};
  return make_model(robot);
}

/// Three axes, each for itself.
Model three_axes() {
  Model m = model::SingleAxis{}.model();
  m.joints.resize(3, m.joints.front());
  m.motion = Eigen::Vector3d(1.0, 0.5, -2.0).asDiagonal();
  m.input = Eigen::Vector3d(1.0, 3.0, 0.7).asDiagonal();
  m.terms.clear();
  m.outputs = {"one", "two", "three"};
  m.output_units.resize(3, m.output_units.front());
  m.coordinates = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) {
    m.terms.push_back({.output = i, .parameter = 0, .kind = Term::Kind::acceleration, .coordinate = i});
    m.terms.push_back({.output = i, .parameter = 1, .coordinate = i, .scale = 0.2 + double(i)});
  }
  return m;
}

/// What the world has: around 0.4; an offset may have either sign.
Eigen::VectorXd truth(const Case& c) {
  Eigen::VectorXd theta(static_cast<Eigen::Index>(c.model.p()));
  for (Eigen::Index j = 0; j < theta.size(); ++j) {
    theta[j] = c.model.parameters[static_cast<std::size_t>(j)].physical == "offset" ? 0.01 : 0.4 + 0.1 * double(j);
  }
  return theta;
}

/// A set around the truth in which all parameters bound each other.
Polytope set_of(const Case& c) {
  const Eigen::VectorXd theta = truth(c);
  Random random(5);
  Box box;
  for (const double x : theta) {
    box.sides.push_back({x < 0.1 ? -0.2 : 0.7 * x, x < 0.1 ? 0.2 : 1.4 * x});
  }
  std::vector<bounds::HalfSpace> rows;
  for (Eigen::Index k = 0; k < c.half_spaces * theta.size(); ++k) {
    const Eigen::VectorXd a = random.matrix(theta.size(), 1);
    rows.push_back({a, a.dot(theta) + 0.02 + 0.03 * random.unit(), {}});
  }
  return Polytope(rows, box);
}

TorqueDetector detector_of(const Case& c) {
  Measurement m;
  m.motion = c.motion;
  m.hold = c.hold;
  m.changes = c.changes;
  m.effort_unsigned = c.effort_unsigned;
  m.nominal_step = c.nominal;
  m.delay = c.delay;
  m.count = c.motion == MotionKind::mean_speed ? 2.0 * 3.141592653589793 / (4096.0 * 0.01) : 0.0;
  m.heading_column = c.heading ? "theta" : "";
  for (const model::Joint& joint : c.model.joints) {
    m.motion_columns.push_back(c.motion == MotionKind::angle ? joint.angle : joint.speed);
    m.effort_columns.push_back(joint.torque);
  }
  filter::SignalErrors errors;
  if (c.noisy) {
    const filter::SensorErrors sensors{
        .motion = c.motion == MotionKind::speed ? 0.01 : 2e-4, .effort = 0.01, .heading = 0.01};
    errors = filter::propagate(c.model, c.design, m, sensors);
  }
  const Polytope set = set_of(c);
  errors.between_samples = c.between != Between::nothing;
  errors.bridges = c.bridges;
  if (c.between == Between::mobility || c.between == Between::both) {
    const Eigen::VectorXd effort = errors.motion.effort;
    errors.motion = filter::motion_bound(c.model, set.hull().sides);
    EXPECT_GT(errors.motion.mobility.size(), 0);
    errors.motion.effort = effort;
  }
  if (c.between == Between::limit || c.between == Between::both) {
    errors.motion.limit = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(c.model.coordinates.size()), 0.6, 3.0);
  }
  const Eigen::VectorXd estimate = truth(c) * 1.02;
  return Detector(RegressorFilter(c.model, c.design, m, errors), detector::ThresholdRule(set, estimate, c.options.set),
                  c.options);
}

/// Motion with reversals and rests, efforts that fit it, a fault of half of every thousand rows, uneven steps, lost
/// rows, gaps, and a time that stands still.
struct World {
  explicit World(const Case& c) : case_(c), random_(17), theta_(truth(c)) { angle_.assign(c.model.joints.size(), 0.1); }

  void rows(std::size_t count, std::vector<double>& t, std::vector<double>& samples) {
    const std::size_t joints = case_.model.joints.size(), coordinates = case_.model.coordinates.size();
    const bool uneven = case_.lost && case_.motion != MotionKind::mean_speed;
    t.clear();
    samples.clear();
    std::vector<double> speed(coordinates), acceleration(coordinates), joint(joints),
        none(std::max(joints, coordinates));
    for (std::size_t k = 0; k < count; ++k, ++row_) {
      const double h = row_ % 700 == 699                 ? case_.gap
                       : row_ % 911 == 910               ? 0.0
                       : case_.lost && row_ % 331 == 330 ? 0.02
                       : uneven && row_ % 43 == 42       ? 0.016
                                                         : 0.01 * (1.0 + case_.jitter * random_.symmetric());
      now_ += h;
      Eigen::VectorXd w(static_cast<Eigen::Index>(joints)), dw(w.size());
      const bool resting = row_ % 600 >= 500;
      for (Eigen::Index j = 0; j < w.size(); ++j) {
        const double a = 1.3 + 0.4 * double(j);
        w[j] = resting ? 0.0 : 4.0 * std::sin(a * now_) + std::sin(3.0 * now_);
        dw[j] = resting ? 0.0 : 4.0 * a * std::cos(a * now_) + 3.0 * std::cos(3.0 * now_);
        joint[static_cast<std::size_t>(j)] = w[j];
      }
      const Eigen::VectorXd v = case_.model.motion * w, dv = case_.model.motion * dw;
      speed.assign(v.begin(), v.end());
      acceleration.assign(dv.begin(), dv.end());
      if (case_.model.heading_coordinate >= 0) {
        heading_ += h * v[case_.model.heading_coordinate];
      }
      const model::MotionState state{speed, {none.data(), coordinates}, joint, {none.data(), joints}, heading_, 0.0};
      const Eigen::VectorXd outputs = model::regressor(case_.model, state, acceleration) * theta_;
      const Eigen::VectorXd effort = case_.model.input.fullPivLu().solve(outputs);
      const double fault = row_ % 1000 >= 500 ? 1.4 : 1.0;
      for (std::size_t j = 0; j < joints; ++j) {
        const double before = angle_[j];
        angle_[j] += h * joint[j];
        const double mean = h > 0.0 ? (angle_[j] - before) / h : joint[j];
        samples.push_back(case_.motion == MotionKind::angle        ? angle_[j]
                          : case_.motion == MotionKind::mean_speed ? mean
                                                                   : joint[j]);
      }
      for (const double e : effort) {
        const double value = fault * e + 0.002 * random_.symmetric();
        samples.push_back(case_.effort_unsigned ? std::abs(value) : value);
      }
      if (case_.heading) {
        samples.push_back(heading_ + 0.001 * random_.symmetric());
      }
      t.push_back(now_);
      if (case_.storms && (row_ % 457 == 456 || row_ % 1300 >= 1270)) {
        samples[samples.size() - 1 - row_ % (2 * joints)] = row_ % 2 == 0 ? std::nan("") : INFINITY;
      }
      if (case_.storms && row_ % 1111 == 1110) {
        t.back() = std::nan("");
      }
    }
  }

 private:
  Case case_;
  Random random_;
  Eigen::VectorXd theta_;
  std::size_t row_ = 0;
  double now_ = 3.0, heading_ = 0.2;
  std::vector<double> angle_;
};

class ExportC : public testing::ScratchTest {
 protected:
  void SetUp() override { (void)testing_support::skip_unless(testing_support::has_c_compiler(), "there is no cc"); }

  /// Runs both over `blocks` blocks of `rows` rows, with a restart between blocks.
  Seen same(const Case& c, std::size_t blocks, std::size_t rows, const std::string& flags = "-O2") {
    Detector ours = detector_of(c);
    CDetector theirs(directory_, c_header(ours, {.name = "robot"}), "robot",
                     ours.filter().measurement().columns().size(), c.model.n(), flags);
    Seen seen;
    if (!theirs.loaded()) {
      return seen;
    }
    World world(c);
    std::vector<double> t, samples;
    for (std::size_t b = 0; b < blocks; ++b) {
      world.rows(rows, t, samples);
      const Seen more = testing_support::compare(ours, theirs, t, samples);
      seen.rows += more.rows;
      seen.valid += more.valid;
      seen.outside += more.outside;
      seen.alarms += more.alarms;
      seen.different += more.different;
      ours.restart();
      theirs.restart();
    }
    return seen;
  }

  void expect_same(const Case& c, const std::string& what, const std::string& flags = "-O2") {
    SCOPED_TRACE(what);
    const Seen seen = same(c, 3, 2500, flags);
    EXPECT_EQ(seen.rows, 7500u);
    EXPECT_EQ(seen.different, 0u);
    // Decisions of both kinds, or nothing was compared.
    EXPECT_GT(seen.valid, seen.rows / 4);
    EXPECT_GT(seen.outside, 50u);
    EXPECT_LT(seen.outside, seen.valid * c.model.n() - 50);
  }
};

detector::DetectorOptions of_set(detector::ParameterSetKind set, detector::Test test = detector::Test::two_sided) {
  detector::DetectorOptions options;
  options.set = set;
  options.test = test;
  return options;
}

constexpr auto kBox = detector::ParameterSetKind::box;

TEST_F(ExportC, DecidesAsTheLibraryWithEveryKindOfMotion) {
  for (const detector::ParameterSetKind set : {kBox, detector::ParameterSetKind::polytope}) {
    const detector::DetectorOptions options = of_set(set);
    expect_same({.model = drive(false, false), .options = options}, "angles");
    expect_same({.model = drive(false, false), .hold = Hold::zero_order, .jitter = 0.2, .options = options},
                "angles, jitter, commanded efforts");
    expect_same(
        {.model = drive(false, false), .motion = MotionKind::mean_speed, .hold = Hold::zero_order, .options = options},
        "mean speeds");
    expect_same({.model = drive(false, false),
                 .design = {.order = 1, .alpha = 20.0, .beta = 11.0},
                 .motion = MotionKind::speed,
                 .jitter = 0.1,
                 .options = options},
                "first order");
  }
}

TEST_F(ExportC, DecidesAsTheLibraryWithEveryFunctionTerm) {
  expect_same({.model = drive(true, true), .jitter = 0.05}, "five parameters and dry friction, odometry");
  expect_same({.model = drive(true, true), .motion = MotionKind::mean_speed, .heading = true, .options = of_set(kBox)},
              "measured heading");
  expect_same({.model = drive(true, false), .heading = true}, "angles with a measured heading");
  expect_same({.model = with_effect({"torque_bias", {{"b_R", {-1.0, 1.0}}}})}, "an offset at one wheel");
  expect_same({.model = model::SingleAxis{.coulomb = true, .offset = true}.model(), .hold = Hold::zero_order},
              "single axis");
  expect_same(
      {.model = model::SingleAxis{}.model(), .design = {.order = 1}, .motion = MotionKind::speed, .noisy = false},
      "plain axis");
}

constexpr FilterDesign kFirstOrder{.order = 1, .alpha = 20.0, .beta = 11.0};

TEST_F(ExportC, DecidesAsTheLibraryAboutWhatHappensBetweenAngles) {
  expect_same({.model = drive(false, false), .between = Between::mobility, .jitter = 0.3, .lost = true},
              "linear efforts that may change, uneven steps, lost rows");
  expect_same({.model = drive(false, true), .hold = Hold::zero_order, .between = Between::mobility, .lost = true},
              "any effort of a step, dry friction through reversals");
  expect_same({.model = drive(true, true),
               .hold = Hold::zero_order,
               .changes = EffortChanges::at_samples,
               .between = Between::both,
               .jitter = 0.2},
              "held efforts, functions of heading and joints, a limit as well");
  expect_same({.model = drive(true, true),
               .changes = EffortChanges::at_samples,
               .heading = true,
               .between = Between::mobility,
               .lost = true},
              "linear efforts, measured heading");
  expect_same({.model = coupled(), .between = Between::mobility, .lost = true, .options = of_set(kBox)},
              "coupled coordinates");
  expect_same({.model = three_axes(), .between = Between::mobility, .jitter = 0.2}, "three coordinates");
  expect_same({.model = drive(false, true), .between = Between::limit}, "a limit");
  expect_same({.model = drive(false, true), .between = Between::nothing, .lost = true}, "no bounds, lost rows");
  expect_same({.model = drive(false, false), .noisy = false, .nominal = 0.0, .jitter = 0.2}, "no known step");
}

TEST_F(ExportC, DecidesAsTheLibraryAboutWhatHappensBetweenMeanSpeeds) {
  constexpr auto kMean = MotionKind::mean_speed;
  constexpr auto kHeld = Hold::zero_order;
  constexpr auto kStamps = EffortChanges::at_samples;
  expect_same({.model = drive(true, true), .motion = kMean, .between = Between::mobility, .lost = true}, "linear");
  expect_same({.model = drive(false, true), .motion = kMean, .changes = kStamps, .between = Between::mobility},
              "linear, at samples");
  expect_same({.model = drive(false, true),
               .motion = kMean,
               .hold = kHeld,
               .effort_unsigned = true,
               .between = Between::mobility},
              "held, any effort of a step");
  expect_same({.model = drive(false, false),
               .motion = kMean,
               .hold = kHeld,
               .changes = kStamps,
               .between = Between::both,
               .lost = true,
               .options = of_set(kBox)},
              "held, at samples");
  expect_same({.model = drive(false, false), .motion = kMean, .between = Between::nothing}, "no bounds");
}

TEST_F(ExportC, DecidesAsTheLibraryAboutWhatHappensBetweenSpeeds) {
  constexpr auto kSpeed = MotionKind::speed;
  for (const FilterDesign& design : {kFirstOrder, FilterDesign{.order = 2, .alpha = 9.0, .beta = 7.0}}) {
    SCOPED_TRACE(design.order);
    expect_same({.model = drive(true, true),
                 .design = design,
                 .motion = kSpeed,
                 .between = Between::mobility,
                 .jitter = 0.1,
                 .lost = true},
                "linear, odometry");
    expect_same({.model = model::SingleAxis{.coulomb = true, .offset = true}.model(),
                 .design = design,
                 .motion = kSpeed,
                 .hold = Hold::zero_order,
                 .between = Between::mobility,
                 .lost = true},
                "held, any effort of a step, dry friction through reversals");
    expect_same({.model = coupled(),
                 .design = design,
                 .motion = kSpeed,
                 .hold = Hold::zero_order,
                 .changes = EffortChanges::at_samples,
                 .between = Between::mobility,
                 .options = of_set(kBox)},
                "held, at samples, coupled coordinates");
    expect_same({.model = three_axes(), .design = design, .motion = kSpeed, .between = Between::limit}, "a limit");
  }
}

// Nothing bounds the motion in a step that is longer than the robot's friction needs to stop it.
TEST_F(ExportC, StartsAnewAfterAStepThatIsTooLong) {
  Case c{.model = drive(false, true),
         .design = kFirstOrder,
         .motion = MotionKind::speed,
         .between = Between::mobility,
         .nominal = 0.0,
         .gap = 1.5};
  const auto lost = [&](Case longer, const std::string& what) {
    expect_same(longer, what);
    const std::size_t valid = same(longer, 1, 2500).valid;
    longer.gap = 0.3;
    return same(longer, 1, 2500).valid - valid;
  };
  EXPECT_GT(lost(c, "speeds"), 0u);
  // The mean speed between two angles bounds what friction makes of it in a step of any length.
  c.model = model::SingleAxis{}.model();
  c.motion = MotionKind::angle;
  c.design = {};
  c.noisy = false;
  EXPECT_EQ(lost(c, "angles"), 0u);
}

TEST_F(ExportC, TakesWhatIsNoNumberForLost) {
  for (const MotionKind motion : {MotionKind::angle, MotionKind::speed}) {
    const Case c{.model = drive(false, true), .motion = motion, .storms = true};
    expect_same(c, motion == MotionKind::angle ? "angles" : "speeds");
  }
}

// What only fades would end as denormal numbers, for ever: a parked robot's detector would take many times as long.
TEST_F(ExportC, OfARobotAtRestNothingIsLeft) {
  for (const MotionKind motion : {MotionKind::angle, MotionKind::mean_speed, MotionKind::speed}) {
    SCOPED_TRACE(static_cast<int>(motion));
    const Case c{.model = drive(false, false), .motion = motion, .hold = Hold::zero_order, .noisy = false};
    Detector ours = detector_of(c);
    CDetector theirs(directory_, c_header(ours, {.name = "robot"}), "robot", 4, 2);
    ASSERT_TRUE(theirs.loaded());
    std::vector<double> t, samples;
    World(c).rows(400, t, samples);
    for (std::size_t k = 0; k < 20000; ++k) {
      t.push_back(t.back() + 0.01);
      const std::size_t last = samples.size() - 4;
      const bool angle = motion == MotionKind::angle;
      samples.insert(samples.end(), {angle ? samples[last] : 0.0, angle ? samples[last + 1] : 0.0, 0.0, 0.0});
    }
    EXPECT_EQ(testing_support::compare(ours, theirs, t, samples).different, 0u);
    EXPECT_TRUE(ours.filter().row().Y.isZero(0.0)) << ours.filter().row().Y;
    EXPECT_TRUE(ours.filter().row().y.isZero(0.0));
  }
}

TEST_F(ExportC, DecidesAsTheLibraryWithEveryRule) {
  Case c{.model = drive(false, true)};
  c.options.persistence = detector::Persistence{.k = 3, .n = 5};
  expect_same(c, "3 of 5");
  c.options.test = detector::Test::symmetric;
  expect_same(c, "symmetric");
  c.effort_unsigned = true;
  c.options.persistence = detector::Persistence{.k = 40, .n = 64};
  expect_same(c, "unsigned efforts, 40 of 64");
  c.options.mu = Eigen::Vector2d(0.03, 0.01);
  expect_same(c, "constant thresholds");
}

TEST_F(ExportC, DoesNotDependOnOptimisation) {
  expect_same({.model = drive(true, true)}, "-O0", "-O0");
  expect_same({.model = drive(false, false), .jitter = 0.2}, "-O3", "-O3");
}

TEST_F(ExportC, IsAlsoCxx) {
  for (const bool coulomb : {false, true}) {
    const std::filesystem::path header =
        put("detector.h", c_header(detector_of({.model = drive(coulomb, coulomb), .heading = coulomb})));
    const std::filesystem::path source =
        put("twice.cpp",
            "#include \"detector.h\"\n#include \"detector.h\"\n"
            "int main() { static wheelwright_state s; wheelwright_init(&s); return 0; }\n");
    const std::string command =
        "c++ -std=c++17 -Wall -Wextra -Wpedantic -Werror -fsyntax-only '" + source.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
  }
}

// Neither heap nor mutable static data: the object file has no data section and calls nothing but libm and memset.
TEST_F(ExportC, CallsNothingButWhatItStates) {
  put("robot.h", c_header(detector_of({.model = drive(true, true)}), {.name = "robot"}));
  const std::filesystem::path source = put("one.c",
                                           "#include \"robot.h\"\n"
                                           "void f(robot_state *s, double t, const double *x, robot_decision *d)\n"
                                           "{ if (t < 0) robot_init(s); robot_step(s, t, x, d); }\n");
  const std::string object = path("one.o").string();
  ASSERT_EQ(
      std::system(("cc -std=c99 -O2 -c -fno-stack-protector -o '" + object + "' '" + source.string() + "'").c_str()),
      0);
  if (testing_support::skip_unless(std::system("nm --version > /dev/null 2>&1") == 0, "there is no nm")) {
    return;
  }
  ASSERT_EQ(std::system(("nm '" + object + "' > '" + path("names").string() + "'").c_str()), 0);
  std::istringstream names(bytes(path("names")));
  std::string word, undefined;
  for (std::string line; std::getline(names, line);) {
    std::istringstream words(line);
    std::vector<std::string> parts;
    while (words >> word) {
      parts.push_back(word);
    }
    ASSERT_GE(parts.size(), 2u) << line;
    const std::string& kind = parts[parts.size() - 2];
    EXPECT_THAT("dDbBgGsSC", ::testing::Not(HasSubstr(kind))) << line;
    if (kind == "U") {
      undefined += parts.back() + " ";
    }
  }
  std::istringstream called(undefined);
  while (called >> word) {
    EXPECT_THAT(
        (std::vector<std::string>{"exp", "cos", "sin", "sincos", "round", "memset", "memcpy", "_GLOBAL_OFFSET_TABLE_"}),
        ::testing::Contains(word));
  }
}

TEST_F(ExportC, SaysWhatItCannotWrite) {
  const Detector detector = detector_of({.model = drive(false, false)});
  for (const std::string name : {"", "1robot", "my robot", "_robot", "double", "röbot", "a-b", "*/"}) {
    EXPECT_THAT(testing::input_error([&] { static_cast<void>(c_header(detector, {.name = name})); }),
                HasSubstr("export: name '" + name + "': expected a prefix"));
  }
  Case late{.model = drive(false, false)};
  late.delay = {0.0, 0.01};
  EXPECT_THAT(testing::input_error([&] { static_cast<void>(c_header(detector_of(late))); }),
              HasSubstr("late by 0 to 0.01 s, which has no C form"));
  Case own{.model = model::SingleAxis{.offset = true}.model()};
  own.model.terms.back().function = [](const model::MotionState& state) {
    return model::TermValue{state.speed[0], 0.0};
  };
  const Detector other = detector_of(own);
  EXPECT_THAT(testing::input_error([&] { static_cast<void>(c_header(other)); }), HasSubstr("offset"));
  const Detector drag = detector_of({.model = with_effect({"quadratic_drag", {{"c", {-1.0, 1.0}}}})});
  EXPECT_THAT(
      testing::input_error([&] { static_cast<void>(c_header(drag)); }),
      HasSubstr("the term of parameter quadratic_drag_c of the model differential_drive is a function of its own"));
  // Too many vertices for a table: the box still goes.
  Case many{.model = drive(true, true), .half_spaces = 80};
  EXPECT_THAT(testing::input_error([&] { static_cast<void>(c_header(detector_of(many))); }), HasSubstr("--set box"));
  many.options.set = kBox;
  EXPECT_THAT(c_header(detector_of(many)), HasSubstr("threshold from the box of parameters"));
}

TEST_F(ExportC, KeepsItsCommentClosed) {
  const std::string header =
      c_header(detector_of({.model = drive(false, false)}), {.robot = "*/ int x; /* é", .source = "a\nb"});
  EXPECT_THAT(header, HasSubstr("Robot: * / int x; / * ??"));
  EXPECT_TRUE(
      std::all_of(header.begin(), header.end(), [](char ch) { return ch == '\n' || (ch >= ' ' && ch <= '~'); }));
}

class SlowExportC : public ExportC {};

TEST_F(SlowExportC, EveryCombinationHasTheSameBits) {
  const std::vector<Model> models = {drive(false, false), drive(true, true),
                                     model::SingleAxis{.coulomb = true, .offset = true}.model(), coupled()};
  struct Kind {
    MotionKind motion;
    FilterDesign design;
  };
  const FilterDesign second{.order = 2, .alpha = 9.0, .beta = 7.0};
  std::size_t number = 0, outside = 0;
  for (const Model& model : models) {
    for (const Kind& kind : {Kind{MotionKind::angle, second}, Kind{MotionKind::mean_speed, second},
                             Kind{MotionKind::speed, second}, Kind{MotionKind::speed, kFirstOrder}}) {
      for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
        for (const EffortChanges changes : {EffortChanges::at_samples, EffortChanges::between}) {
          for (const Between between :
               {Between::nothing, Between::interpolated, Between::mobility, Between::limit, Between::both}) {
            const std::size_t k = number++;
            Case c{.model = model, .design = kind.design, .motion = kind.motion, .hold = hold, .changes = changes};
            c.between = between;
            c.noisy = k % 7 != 3;
            c.effort_unsigned = k % 5 == 4;
            c.heading = model.heading_used && k % 3 == 1;
            c.jitter = kind.motion == MotionKind::mean_speed ? 0.0 : 0.3 * double(k % 2);
            c.lost = k % 11 < 6;
            c.bridges = k % 17 < 12;
            c.options = of_set(kBox);
            if (k % 13 == 0) {
              c.options.mu = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(model.n()), 0.02);
            }
            SCOPED_TRACE(k);
            const Seen seen = same(c, 2, 1500, "-O1");
            EXPECT_EQ(seen.different, 0u);
            EXPECT_GT(seen.valid, seen.rows / 4);
            outside += seen.outside;
          }
        }
      }
    }
  }
  EXPECT_EQ(number, 320u);
  EXPECT_GT(outside, 10000u);
}

TEST_F(SlowExportC, AMillionSamplesHaveTheSameBits) {
  const Seen polytope =
      same({.model = drive(true, true), .jitter = 0.02, .options = {.persistence = detector::Persistence{2, 3}}}, 10,
           100000);
  EXPECT_EQ(polytope.rows, 1000000u);
  EXPECT_EQ(polytope.different, 0u);
  EXPECT_GT(polytope.valid, 500000u);
  EXPECT_GT(polytope.alarms, 10000u);
  const Seen box = same({.model = drive(false, false), .options = of_set(kBox)}, 10, 100000);
  EXPECT_EQ(box.rows, 1000000u);
  EXPECT_EQ(box.different, 0u);
  EXPECT_GT(box.alarms, 10000u);
}

}  // namespace
}  // namespace wheelwright::exporter::export_c_test
