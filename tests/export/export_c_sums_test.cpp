// SPDX-License-Identifier: Apache-2.0
// The exported detector at a stated risk against ScaleDetector: every look to the last bit.
#include <cmath>
#include <cstring>

#include <Eigen/LU>

#include "detector/export/export_c.hpp"
#include "detector/online_model.hpp"
#include "model/differential_drive.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/single_axis.hpp"
#include "tests/support/c_detector.hpp"
#include "tests/support/random.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::exporter::export_c_sums_test {

using model::EffortChanges;

namespace {

using ::testing::HasSubstr;
using testing_support::Random;

/// A robot, how it is measured, and what is assumed of its efforts' errors.
struct Case {
  Model model;
  MotionKind motion = MotionKind::angle;
  Hold hold = Hold::first_order;
  EffortChanges changes = EffortChanges::between;
  double deviation = core::kInfinity, correlation = 0.0;
  detector::ScaleDetectorOptions options{};
  double jitter = 0.2;  // share of the step
  bool bounded = true;  // what happens between samples is
};

Model drive(bool functions) {
  return DifferentialDrive{
      .wheel_radius = 0.1, .track_width = 0.4, .anisotropic_friction = functions, .coulomb = functions}
      .model();
}

Eigen::VectorXd truth(const Model& model) {
  return Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(model.p()), 0.4, 0.8);
}

OnlineModel online_model(const Case& c) {
  OnlineModel m;
  m.model = c.model;
  m.filter = {.order = 2, .alpha = 9.0, .beta = 7.0};
  m.measurement.motion = c.motion;
  m.measurement.hold = c.hold;
  m.measurement.changes = c.changes;
  m.measurement.nominal_step = 0.01;
  for (const model::Joint& joint : c.model.joints) {
    m.measurement.motion_columns.push_back(c.motion == MotionKind::angle ? joint.angle : joint.speed);
    m.measurement.effort_columns.push_back(joint.torque);
  }
  const Eigen::VectorXd theta = truth(c.model);
  m.estimate = 1.01 * theta;
  Random random(5);
  for (const double x : theta) {
    m.box.sides.push_back({0.8 * x, 1.2 * x});
  }
  for (Eigen::Index k = 0; k < 3 * theta.size(); ++k) {
    const Eigen::VectorXd a = random.matrix(theta.size(), 1);
    m.facets.push_back({a, a.dot(theta) + 0.02 + 0.03 * random.unit(), {}});
  }
  m.errors = filter::propagate(c.model, m.filter, m.measurement,
                               {.motion = c.motion == MotionKind::speed ? 0.002 : 2e-5, .effort = 0.01});
  m.errors.between_samples = c.bounded;
  if (c.bounded) {
    const Eigen::VectorXd effort = m.errors.motion.effort;
    m.errors.motion = filter::motion_bound(c.model, m.box.sides);
    m.errors.motion.effort = effort;
  }
  detector::RiskModel risk;
  risk.facets = m.facets;
  risk.box = m.box;
  risk.errors.motion = {.bound = 2e-5, .bias = 2e-5};
  risk.errors.effort = {.bound = 0.01, .bias = 1e-4, .correlation = c.correlation, .deviation = c.deviation};
  risk.errors.shortest_step = 0.007;
  risk.scales = {0.1, 0.5, 2.0, 9.0};
  risk.delay = 0.4;
  risk.usual = Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(detector::sum_weights(c.model).size()), 4, 1e-6);
  risk.usual(0, 1) = 0.0;
  m.at_risk = risk;
  return m;
}

/// Both detectors, side by side.
class Pair {
 public:
  Pair(const std::filesystem::path& folder, const OnlineModel& model, const detector::ScaleDetectorOptions& options)
      : nominal_(model.measurement.nominal_step), ours_(scale_detector_for_c(model, options)) {
    put(folder / "robot.h", c_header(make_detector(model, {.set = options.set}), ours_, {.name = "robot"}));
    put(folder / "robot.c", R"(#include "robot.h"
static robot_sums s;
void sums_init(void) { robot_sums_init(&s); }
int sums_step(double t, const double *sample, double *out) {
  int k;
  *out++ = robot_sums_step(&s, t, sample);
  *out++ = s.alarm;
  for (k = 0; k < s.looks; ++k) {
    *out++ = s.look[k].sum;
    *out++ = s.look[k].scale;
    *out++ = s.look[k].value;
    *out++ = s.look[k].threshold;
    *out++ = s.look[k].excess;
    *out++ = s.look[k].c0;
    *out++ = s.look[k].c1;
  }
  return s.looks;
}
)");
    const std::string command =
        fmt::format("cc {} -O2 -shared -fPIC -o '{}' '{}' -lm 2> '{}'", testing_support::kStrictC,
                    (folder / "robot.so").string(), (folder / "robot.c").string(), (folder / "words").string());
    if (std::system(command.c_str()) != 0) {
      std::ifstream words(folder / "words");
      ADD_FAILURE() << command << '\n' << std::string(std::istreambuf_iterator<char>(words), {});
      return;
    }
    library_ = dlopen((folder / "robot.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) {
      ADD_FAILURE() << dlerror();
      return;
    }
    std::bit_cast<void (*)()>(dlsym(library_, "sums_init"))();
    step_ = std::bit_cast<int (*)(double, const double*, double*)>(dlsym(library_, "sums_step"));
    out_.resize(2 + 7 * ours_.weights().size() * ours_.scales().size());
  }
  ~Pair() {
    if (library_ != nullptr) {
      dlclose(library_);
    }
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  /// Steps both, and counts.
  void step(double t, const std::vector<double>& sample) {
    if (step_ == nullptr) {
      return;
    }
    if (!(t > last_) || t - last_ > 5.0 * nominal_) {
      ours_.restart();
      ++restarts;
    }
    last_ = t;
    const bool looked = ours_.step(t, sample);
    const auto count = static_cast<std::size_t>(step_(t, sample.data(), out_.data()));
    bool equal =
        count == ours_.looks().size() && out_[0] == (looked ? 1.0 : 0.0) && out_[1] == (ours_.alarm() ? 1.0 : 0.0);
    for (std::size_t k = 0; equal && k < count; ++k) {
      const detector::SumState& a = ours_.looks()[k];
      const double mine[7] = {double(a.weight), double(a.scale), a.value, a.threshold, a.excess, a.c0, a.c1};
      equal = std::memcmp(mine, out_.data() + 2 + 7 * k, sizeof mine) == 0;
      finite += std::isfinite(a.threshold) ? 1 : 0;
      outside += a.excess > 0.0 ? 1 : 0;
    }
    ++rows;
    looks += count;
    alarms += ours_.alarm() ? 1 : 0;
    different += equal ? 0 : 1;
  }
  [[nodiscard]] const detector::ScaleDetector& ours() const { return ours_; }

  std::size_t rows = 0, looks = 0, finite = 0, outside = 0, alarms = 0, different = 0, restarts = 0;

 private:
  static void put(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }

  double nominal_, last_ = -core::kInfinity;
  detector::ScaleDetector ours_;
  void* library_ = nullptr;
  int (*step_)(double, const double*, double*) = nullptr;
  std::vector<double> out_;
};

class ExportCSums : public testing::ScratchTest {
 protected:
  void SetUp() override { (void)testing_support::skip_unless(testing_support::has_c_compiler(), "there is no cc"); }

  /// 60 s with reversals and rests, uneven steps, a lost row, a gap, a time that stands still; a share of the effort is
  /// lost in the last third.
  void drive_both(Pair& both, const Case& c) {
    Random random(17);
    const std::size_t joints = c.model.joints.size(), coordinates = c.model.coordinates.size();
    const Eigen::VectorXd theta = truth(c.model);
    std::vector<double> angle(joints, 0.1), joint(joints), speed(coordinates), acceleration(coordinates);
    const std::vector<double> none(std::max(joints, coordinates), 0.0);
    double now = 3.0, heading = 0.0;
    for (std::size_t row = 0; row < 6000; ++row) {
      const double h = row == 2500   ? 0.4
                       : row == 2700 ? 0.0
                       : row == 2900 ? 0.02
                                     : 0.01 * (1.0 + c.jitter * random.symmetric());
      now += h;
      Eigen::VectorXd w(static_cast<Eigen::Index>(joints)), dw(w.size());
      const bool resting = row % 1500 >= 1400;
      for (Eigen::Index j = 0; j < w.size(); ++j) {
        const double a = 1.3 + 0.4 * double(j);
        w[j] = resting ? 0.0 : 4.0 * std::sin(a * now) + std::sin(3.0 * now);
        dw[j] = resting ? 0.0 : 4.0 * a * std::cos(a * now) + 3.0 * std::cos(3.0 * now);
        joint[static_cast<std::size_t>(j)] = w[j];
      }
      const Eigen::VectorXd v = c.model.motion * w, dv = c.model.motion * dw;
      speed.assign(v.begin(), v.end());
      acceleration.assign(dv.begin(), dv.end());
      if (c.model.heading_coordinate >= 0) {
        heading += h * v[c.model.heading_coordinate];
      }
      const model::MotionState state{speed, {none.data(), coordinates}, joint, {none.data(), joints}, heading, 0.0};
      const Eigen::VectorXd outputs = model::regressor(c.model, state, acceleration) * theta;
      const Eigen::VectorXd effort = c.model.input.fullPivLu().solve(outputs);
      std::vector<double> sample;
      for (std::size_t j = 0; j < joints; ++j) {
        angle[j] += h * joint[j];
        sample.push_back(c.motion == MotionKind::angle ? angle[j] : joint[j]);
      }
      for (const double e : effort) {
        sample.push_back((row >= 4000 ? 1.6 : 1.0) * e + 0.01 * random.symmetric());
      }
      both.step(now, sample);
    }
  }

  void expect_same(const Case& c, const std::string& what) {
    SCOPED_TRACE(what);
    static int count = 0;
    Pair both(directory_ / std::to_string(count++), online_model(c), c.options);
    drive_both(both, c);
    EXPECT_EQ(both.rows, 6000u);
    EXPECT_EQ(both.different, 0u);
    EXPECT_EQ(both.restarts, 3u);
    // Sums of both kinds, or nothing was compared.
    EXPECT_GT(both.finite, 4000u);
    EXPECT_GT(both.outside, 20u);
    EXPECT_GT(both.alarms, 5u);
    EXPECT_LT(both.outside, both.looks - 500);
  }
};

TEST_F(ExportCSums, SayAsTheLibraryOfAngles) {
  expect_same({.model = drive(false)}, "linear efforts that may change");
  expect_same({.model = drive(false), .hold = Hold::zero_order}, "held, any effort of a step");
  expect_same({.model = drive(true), .changes = EffortChanges::at_samples}, "functions of the motion");
  expect_same({.model = model::SingleAxis{.coulomb = true, .offset = true}.model(),
               .hold = Hold::zero_order,
               .changes = EffortChanges::at_samples,
               .deviation = 0.003,
               .correlation = 0.03},
              "a deviation, errors that are alike for a while");
  expect_same({.model = drive(false), .bounded = false}, "nothing is known between samples");
}

TEST_F(ExportCSums, SayAsTheLibraryOfSpeeds) {
  for (const MotionKind motion : {MotionKind::speed, MotionKind::mean_speed}) {
    const double jitter = motion == MotionKind::speed ? 0.2 : 0.0;
    expect_same({.model = drive(true), .motion = motion, .jitter = jitter}, "linear, functions of the motion");
    expect_same({.model = drive(false),
                 .motion = motion,
                 .hold = Hold::zero_order,
                 .changes = EffortChanges::at_samples,
                 .deviation = 0.003,
                 .jitter = jitter},
                "held, a deviation");
    expect_same({.model = model::SingleAxis{}.model(), .motion = motion, .hold = Hold::zero_order, .jitter = jitter},
                "held, any effort of a step");
  }
}

TEST_F(ExportCSums, SayAsTheLibraryWithEveryRule) {
  Case c{.model = drive(false)};
  c.options.exact_thresholds = true;
  expect_same(c, "thresholds by the set");
  c.options = {.false_alarms = 1e-3, .checks = 3.0, .set = detector::ParameterSetKind::box};
  expect_same(c, "the box");
}

// Sums that only fade would end as denormal numbers, for ever, and take many times as long.
TEST_F(ExportCSums, OfARobotAtRestNothingIsLeft) {
  const Case c{.model = drive(false), .hold = Hold::zero_order, .bounded = false};
  Pair both(directory_, online_model(c), c.options);
  std::vector<double> sample(4, 0.0);
  for (std::size_t k = 0; k < 50000; ++k) {
    const double t = 0.01 * static_cast<double>(k), moving = t < 5.0 ? 1.0 : 0.0;
    sample[0] += moving * 0.01 * std::sin(t);
    sample[1] += moving * 0.01 * std::sin(2.0 * t);
    sample[2] = moving * std::cos(t);
    sample[3] = moving * std::cos(2.0 * t);
    both.step(t, sample);
    for (const detector::SumState& look : both.ours().looks()) {
      const bool last = k > 45000 && look.scale < 2;
      ASSERT_TRUE(!last || (look.value == 0.0 && std::fpclassify(look.c0) != FP_SUBNORMAL)) << k << ' ' << look.value;
    }
  }
  EXPECT_EQ(both.different, 0u);
  EXPECT_GT(both.looks, 1000u);
}

// A set that is too rich for a table: its box stands for it, and the header says so.
TEST_F(ExportCSums, HaveTheBoxWhereTheSetHasTooManyVertices) {
  const Case c{.model = drive(true)};
  OnlineModel model = online_model(c);
  Random random(3);
  const Eigen::VectorXd theta = truth(c.model);
  for (int k = 0; k < 400; ++k) {
    const Eigen::VectorXd a = random.matrix(theta.size(), 1);
    model.at_risk->facets.push_back({a, a.dot(theta) + 0.03 * a.norm(), {}});
  }
  const TorqueDetector torque = make_detector(model, {.set = detector::ParameterSetKind::box});
  EXPECT_THAT(testing::input_error([&] { static_cast<void>(c_header(torque, detector::ScaleDetector(model))); }),
              HasSubstr("too many vertices"));
  const detector::ScaleDetector sums = scale_detector_for_c(model);
  EXPECT_EQ(sums.rule().kind(), detector::ParameterSetKind::box);
  EXPECT_THAT(c_header(torque, sums), HasSubstr("in the box of the set at a risk"));
}

}  // namespace
}  // namespace wheelwright::exporter::export_c_sums_test
