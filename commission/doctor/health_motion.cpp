// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "commission/contradiction_search.hpp"
#include "commission/contradictions.hpp"
#include "commission/doctor/health_efforts.hpp"
#include "commission/doctor/log_health.hpp"
#include "commission/fit.hpp"
#include "commission/physical.hpp"
#include "commission/setting.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "core/words.hpp"
#include "identify/inference/identifiability.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kSome = 0.02;              // share of the rows that makes a manoeuvre count
constexpr double kTractionSpan = 0.1;       // s to both sides, for an acceleration
constexpr double kMostTraction = 25.0;      // m/s²: two and a half times that of gravity
constexpr double kChangedPlaces = 0.15;     // sum of |log| of two ratios to nominal values
constexpr double kOddTimesNominal = 3.0;    // either way: worth a word
constexpr double kMostTimesNominal = 8.0;   // robots that carry goods carry up to seven times their own mass
constexpr double kLeastTimesNominal = 0.2;  // and lose less
constexpr double kOneFactor = 1.25;         // between ratios of mass, inertia and friction that are one factor
constexpr double kSameFactor = 1.1;         // likewise, where the factor itself is below kOddTimesNominal
constexpr double kNamedFactor = 1.35;       // least factor of those
constexpr double kDensest = 1.2e5;          // kg/m³ of the radius of gyration, cubed: a cube of steel
constexpr double kFollowsMotion = 0.3;      // correlation of an effort, less its mean, with what drives it
constexpr double kUnusedRisk = 1e-3;        // for fit_log; not used further

LogFinding about_motion(const char* id, FindingSeverity severity, std::string sentence, std::string next, double value,
                        std::string unit) {
  return {.id = id,
          .topic = FindingTopic::motion,
          .severity = severity,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .value = value,
          .unit = std::move(unit)};
}

double share_of(const std::vector<double>& values, auto&& test) {
  return static_cast<double>(std::ranges::count_if(values, test)) / static_cast<double>(values.size());
}

void one_way(const char* id, const char* what, const char* plus, const char* minus, double p, double m,
             FindingSeverity severity, std::vector<LogFinding>& out) {
  if (p > kSome && m > kSome) {
    out.push_back(about_motion(
        id, FindingSeverity::fine,
        fmt::format("{}: {} in {:.0f} %, {} in {:.0f} % of the rows.", what, plus, 100.0 * p, minus, 100.0 * m), "",
        std::min(p, m), "1"));
  } else if (p > kSome || m > kSome) {
    const bool lacks_plus = p <= kSome;
    out.push_back(about_motion(
        id, severity,
        fmt::format("{}: {} in {:.0f} % of the rows, but hardly ever {}.", what, lacks_plus ? minus : plus,
                    100.0 * std::max(p, m), lacks_plus ? plus : minus),
        fmt::format("Drive {} too: what differs with the direction is not seen.", lacks_plus ? plus : minus),
        std::min(p, m), "1"));
  }
}

void check_speeds(const std::vector<double>& speeds, double top, const char* unit, std::vector<LogFinding>& out) {
  std::vector<double> fast;
  for (const double v : speeds) {
    if (std::abs(v) > 0.1 * top) {
      fast.push_back(std::abs(v));
    }
  }
  if (fast.size() < 20) {
    return;
  }
  const double low = core::quantile(fast, 0.1), high = core::quantile(fast, 0.9);
  const bool narrow = high < 1.3 * low;
  out.push_back(about_motion(
      "motion.speeds", narrow ? FindingSeverity::notice : FindingSeverity::fine,
      fmt::format("In motion, four fifths of the speeds are between {:.3g} and {:.3g} {}.", low, high, unit),
      narrow ? "Drive slowly and fast: one speed cannot tell dry from viscous friction." : "",
      low > 0.0 ? high / low : 0.0, "1"));
}

void check_directions(const HealthView& view, std::vector<LogFinding>& out) {
  if (view.joints.size() == 1) {
    const JointView& j = view.joints[0];
    const auto test = [&](double sign) { return share_of(j.smooth, [&](double v) { return sign * v > 0.1 * j.top; }); };
    one_way("motion.direction", "Direction", "forwards", "backwards", test(1.0), test(-1.0), FindingSeverity::notice,
            out);
    check_speeds(j.smooth, j.top, "(unit of the column)", out);
    return;
  }
  if (view.joints.size() != 2) {
    return;
  }
  const double top = std::max(view.joints[0].top, view.joints[1].top);
  std::vector<double> forward(view.log->rows()), turn(view.log->rows());
  for (std::size_t k = 0; k < forward.size(); ++k) {
    forward[k] = 0.5 * (view.joints[0].smooth[k] + view.joints[1].smooth[k]);
    turn[k] = 0.5 * (view.joints[0].smooth[k] - view.joints[1].smooth[k]);
  }
  const auto test = [&](const std::vector<double>& values, double sign) {
    return share_of(values, [&](double v) { return sign * v > 0.05 * top; });
  };
  const double left = test(turn, 1.0), right = test(turn, -1.0);
  if (left <= kSome && right <= kSome) {
    out.push_back(about_motion("motion.turning", FindingSeverity::warning, "The robot hardly turns.",
                               "Drive curves to both sides, with changing yaw rate.", std::max(left, right), "1"));
  }
  one_way("motion.turning", "Turning", "to the left", "to the right", left, right, FindingSeverity::warning, out);
  const double ahead = test(forward, 1.0), back = test(forward, -1.0);
  if (ahead <= kSome && back <= kSome) {
    out.push_back(about_motion("motion.direction", FindingSeverity::warning, "The robot hardly drives along.",
                               "Drive straight, with changing speed.", std::max(ahead, back), "1"));
  }
  one_way("motion.direction", "Driving", "forwards", "backwards", ahead, back, FindingSeverity::notice, out);
  check_speeds(forward, top, "rad/s of the wheels", out);
}

// Whether another wheel is much faster than `joint`, which may be dragged through a curve then: against its effort.
bool is_inner(const HealthView& view, const JointView& joint, std::size_t k) {
  constexpr double kMuchSlower = 0.8;
  return std::ranges::any_of(view.joints, [&](const JointView& other) {
    return std::abs(joint.smooth[k]) < kMuchSlower * std::abs(other.smooth[k]);
  });
}

// The value about which an effort that is never negative follows the motion, as a command does whose zero is in the
// middle of its range; nothing where only its size was logged.
std::optional<double> middle_of_effort(const HealthView& view, const JointView& joint) {
  constexpr std::size_t kSpan = 5;
  const std::vector<double>& t = view.log->t;
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double ee = 0.0, e1 = 0.0, n = 0.0;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + kSpan; k + kSpan < last; ++k) {
      const double e = (*joint.effort)[k],
                   a = (joint.smooth[k + kSpan] - joint.smooth[k - kSpan]) / (t[k + kSpan] - t[k - kSpan]);
      const Eigen::Vector3d row(1.0, joint.smooth[k], a);
      gram += row * row.transpose();
      moment += e * row;
      ee += e * e;
      e1 += e;
      n += 1.0;
    }
  }
  const double varies = n > 0.0 ? ee - e1 * e1 / n : 0.0;
  if (!(varies > 0.0) || !(gram.determinant() > 0.0)) {
    return std::nullopt;
  }
  const Eigen::Vector3d c = gram.inverse() * moment;
  const double explained = (c.dot(moment) - e1 * e1 / n) / varies;
  const double spread = std::sqrt(varies / n);
  return explained > kFollowsMotion && c[0] > 2.0 * spread ? std::optional(c[0]) : std::nullopt;
}

// Whether every joint has, in motion, efforts of both signs or speeds of one.
void check_effort_sense(const HealthView& view, std::vector<LogFinding>& out) {
  for (const JointView& j : view.joints) {
    double te = 0.0, ee = 0.0, ww = 0.0, ta = 0.0, aa = 0.0, driven = 0.0;
    const std::vector<double>& t = view.log->t;
    for (const auto& [first, last] : view.segments) {
      for (std::size_t k = first + 5; k + 5 < last; ++k) {
        const double e = (*j.effort)[k], w = j.smooth[k];
        const double a = (j.smooth[k + 5] - j.smooth[k - 5]) / (t[k + 5] - t[k - 5]);
        if (!is_inner(view, j, k)) {
          te += e * w;
          ww += w * w;
          driven += e * e;
        }
        ta += e * a;
        ee += e * e;
        aa += a * a;
      }
    }
    if (!(ee > 0.0)) {
      continue;
    }
    if (const auto middle =
            view.one_sided(j) && !view.robot.effort_unsigned ? middle_of_effort(view, j) : std::nullopt) {
      out.push_back({.id = "units.effort_offset",
                     .topic = FindingTopic::units,
                     .severity = FindingSeverity::fatal,
                     .sentence = fmt::format(
                         "{0} is never negative although its wheel turns both ways, and follows the motion about "
                         "{1:.4g}: its zero is there, as that of a command of 8 bits is.",
                         j.effort_name, *middle),
                     .next = fmt::format(
                         "Take its zero off, e.g. by `wheelwright convert LOG a.csv`, then `awk -F, -v OFS=, "
                         "'NR==1{{for(i=1;i<=NF;i++)c[$i]=i}} NR>1{{$c[\"{0}\"]-={1:.4g}}} 1' a.csv > b.csv` (and the "
                         "same of the other wheel), and use b.csv.",
                         j.effort_name, *middle),
                     .columns = {j.effort_name},
                     .value = *middle});
      continue;
    }
    if (view.one_sided(j) && (!view.robot.effort_unsigned || !view.robot_given)) {
      out.push_back(
          {.id = "units.effort_unsigned",
           .topic = FindingTopic::units,
           .severity = view.robot_given ? FindingSeverity::fatal : FindingSeverity::notice,
           .sentence = fmt::format("{} is never negative although its wheel turns both ways: only its size was "
                                   "logged.",
                                   j.effort_name),
           .next = "Write `effort: {…, unsigned: true}` into the robot file, or log the sign.",
           .columns = {j.effort_name}});
      continue;
    }
    const double power = driven * ww > 0.0 ? te / std::sqrt(driven * ww) : 0.0;
    const double inertia = aa > 0.0 ? ta / std::sqrt(ee * aa) : 0.0;
    if (!view.robot.effort_unsigned && ((power < -0.05 && inertia < 0.1) || (inertia < -0.3 && power < 0.05))) {
      out.push_back({.id = "units.effort_sign",
                     .topic = FindingTopic::units,
                     .severity = FindingSeverity::fatal,
                     .sentence = fmt::format("{} and {} have opposite signs: the effort would brake the wheel that it "
                                             "drives (correlation with speed {:.2f}, with acceleration {:.2f}).",
                                             j.effort_name, j.motion_name(), power, inertia),
                     .next = fmt::format("Turn the sign of one of them, for both count positive when the wheel drives "
                                         "forwards: of the effort {}.",
                                         scaling_arguments(view, {j.effort_name}, -1.0)),
                     .columns = {j.effort_name, j.motion_name()},
                     .value = power,
                     .unit = "1"});
    }
  }
}

struct TorqueUnit {
  double ratio;
  const char* unit;
};
constexpr TorqueUnit kTorqueUnits[] = {{1000.0, "mN·m"},   {141.6, "ozf·in"}, {100.0, "N·cm"},
                                       {10.197, "kgf·cm"}, {8.851, "lbf·in"}, {0.10197, "kgf·m"}};

// By how much masses come out too small where wheel speeds are in another unit.
constexpr TorqueUnit kSpeedUnits[] = {{std::numbers::pi / 180.0, "deg/s"}, {std::numbers::pi / 30.0, "rpm"}};

// Accelerations that no tyre holds: the motion is in another unit than rad.
void check_traction(const HealthView& view, std::vector<LogFinding>& out) {
  if (!view.robot_given || !model::on_two_wheels(view.robot) || !(view.step > 0.0)) {
    return;
  }
  const auto span = static_cast<std::size_t>(std::max(5.0, std::round(kTractionSpan / view.step)));
  const std::vector<double>& t = view.log->t;
  for (const JointView& j : view.joints) {
    std::vector<double> rim;
    for (const auto& [first, last] : view.segments) {
      for (std::size_t k = first + span; k + span < last; ++k) {
        rim.push_back(view.robot.wheel_radius *
                      std::abs((j.smooth[k + span] - j.smooth[k - span]) / (t[k + span] - t[k - span])));
      }
    }
    const double high = core::quantile(std::move(rim), 0.99);
    if (high > kMostTraction) {
      out.push_back(
          {.id = "units.wheel_speed",
           .topic = FindingTopic::units,
           .severity = FindingSeverity::fatal,
           .sentence = fmt::format("By {} and the robot file's radius the rim accelerates at {:.3g} m/s², which "
                                   "no tyre holds (at {:.3g} m/s): degrees or rpm?",
                                   j.motion_name(), high, view.robot.wheel_radius * j.top),
           .next = fmt::format("Convert the wheels' motion to rad and rad/s at the wheel, or correct wheel_radius: of "
                               "degrees {} does so, of rpm {}.",
                               scaling_arguments(view, motion_columns(view), std::numbers::pi / 180.0),
                               scaling_arguments(view, motion_columns(view), std::numbers::pi / 30.0)),
           .columns = {j.motion_name()},
           .value = high,
           .unit = "m/s²"});
      return;
    }
  }
}

// Without a gyro or a pose nothing tells whether one wheel counts backwards, efforts and all: driving and turning then
// change places. A drive that is mostly turning is told; with nominal values that fit only if they change back, it is
// wrong.
void check_mirrored(const HealthView& view, const commission::Setting& s, const commission::Fit& fit,
                    std::vector<LogFinding>& out) {
  if (view.joints.size() != 2 || view.column("gyro_z") != nullptr || view.column("theta") != nullptr) {
    return;
  }
  double along = 0.0, turn = 0.0;
  for (std::size_t k = 0; k < view.log->rows(); ++k) {
    const double right = view.joints[0].smooth[k], left = view.joints[1].smooth[k];
    along += (right + left) * (right + left);
    turn += (right - left) * (right - left);
  }
  const bool turns = turn > along;
  const auto scales = commission::physical_scales(s.robot, s.model);
  const auto found = [&](const char* name) -> std::optional<double> {
    for (std::size_t j = 0; scales && j < s.model.p(); ++j) {
      if (s.model.parameters[j].physical == name && fit.excitation[j].state == identify::Excitation::identified) {
        const double value = (*scales)[j].scale * fit.estimate[static_cast<Eigen::Index>(j)] - (*scales)[j].offset;
        return value > 0.0 ? std::optional(value) : std::nullopt;
      }
    }
    return std::nullopt;
  };
  const auto mass = found("mass"), inertia = found("yaw_inertia");
  const auto& nominal = s.robot.nominal;
  bool changed_places = false;
  if (view.robot_given && mass && inertia && nominal.contains("mass") && nominal.contains("yaw_inertia")) {
    const double square = 0.25 * s.robot.track_width * s.robot.track_width;
    const auto off = [&](double m, double i) {
      return std::abs(std::log(m / nominal.at("mass"))) + std::abs(std::log(i / nominal.at("yaw_inertia")));
    };
    changed_places = off(*mass, *inertia) > kChangedPlaces + 2.0 * off(*inertia / square, *mass * square);
  }
  if (!turns && !changed_places) {
    return;
  }
  out.push_back({.id = "units.wheel_mirrored",
                 .topic = FindingTopic::units,
                 .severity = changed_places ? FindingSeverity::fatal : FindingSeverity::warning,
                 .sentence = fmt::format("As its wheels count, the robot turns on the spot {} than it drives ({:.2g} "
                                         "times as fast){}, and the log has neither gyro nor pose to tell.",
                                         turns ? "more" : "less", std::sqrt(turn / along),
                                         changed_places ? "; mass and yaw inertia fit the robot file if one wheel, its "
                                                          "effort included, counts backwards"
                                                        : ""),
                 .next = "Look whether both wheels count up when it drives ahead; log a gyro to have it checked.",
                 .columns = {view.joints[0].motion_name(), view.joints[1].motion_name()},
                 .value = std::sqrt(turn / along),
                 .unit = "1"});
}

// A quantity of a first fit beside the robot file's.
struct NominalRatio {
  std::string name;
  double value = 0.0, nominal = 0.0;
  bool is_mass = false, is_friction = false;
  [[nodiscard]] double ratio() const { return value / nominal; }
};

std::vector<NominalRatio> nominal_ratios(const commission::Setting& s, const commission::Fit& fit) {
  std::vector<NominalRatio> ratios;
  const auto scales = commission::physical_scales(s.robot, s.model);
  for (std::size_t j = 0; scales && j < s.model.p(); ++j) {
    const model::Parameter& p = s.model.parameters[j];
    const auto nominal = s.robot.nominal.find(p.physical);
    if (nominal != s.robot.nominal.end() && nominal->second > 0.0 &&
        fit.excitation[j].state == identify::Excitation::identified) {
      const double value = (*scales)[j].scale * fit.estimate[static_cast<Eigen::Index>(j)] - (*scales)[j].offset;
      ratios.push_back({p.physical, value, nominal->second, p.moved_mass, p.physical.starts_with("viscous")});
    }
  }
  return ratios;
}

// Whether mass, inertia and friction are off by one and the same factor, as a load does not change them.
bool by_one_factor(const std::vector<NominalRatio>& ratios, double factor, double spread) {
  std::size_t frictions = 0;
  for (const NominalRatio& r : ratios) {
    if (!(r.ratio() > factor / spread && r.ratio() < factor * spread)) {
      return false;
    }
    frictions += r.is_friction ? 1 : 0;
  }
  return frictions > 0 && ratios.size() >= 3;
}

// What efforts that are `ratio` times too large (at most `top`) may be in, and what one of them is then in the unit
// that is expected, 0 where that is not known.
struct EffortUnit {
  std::string words;
  double factor = 0.0;
};

EffortUnit unit_of_efforts(const Robot& robot, double ratio, double top) {
  const auto near = [&](double known, double share) { return std::abs(ratio / known - 1.0) < share; };
  const auto limit = robot.limits.find("effort");
  const double declared = limit != robot.limits.end() ? limit->second : 0.0;
  if (declared > 0.0 && top <= 101.0 && near(100.0 / declared, 0.3)) {
    return {"in per cent of limits.effort", 0.01 * declared};
  }
  if (declared > 0.0 && near(1000.0 / declared, 0.3)) {
    return {"in thousandths of limits.effort", 0.001 * declared};
  }
  if (robot.motor && robot.motor->gear_ratio > 1.0 && near(1.0 / robot.motor->gear_ratio, 0.3)) {
    return {"those of the motor's shaft, before the gear", robot.motor->gear_ratio};
  }
  if (robot.effort != model::EffortKind::torque) {
    return near(1000.0, 0.3) ? EffortUnit{robot.effort == model::EffortKind::current ? "in mA" : "in mV", 0.001}
                             : EffortUnit{};
  }
  for (const TorqueUnit& known : kTorqueUnits) {
    if (near(known.ratio, known.ratio < 50.0 ? 0.1 : known.ratio < 500.0 ? 0.15 : 0.3)) {
      return {fmt::format("in {}", known.unit), 1.0 / known.ratio};
    }
  }
  if (ratio > 1.0 && top <= 101.0) {
    return {fmt::format("in per cent of {:.2g} N·m", 100.0 / ratio), 0.0};
  }
  if (ratio > 1.0 && top <= 3000.0) {
    return {fmt::format("in thousandths of {:.2g} N·m", 1000.0 / ratio), 0.0};
  }
  if (ratio < 1.0 && top <= 1.01) {
    return {fmt::format("shares (0 to 1) of {:.2g} N·m", 1.0 / ratio), 0.0};
  }
  return ratio < 1.0 ? EffortUnit{fmt::format("those of a motor's shaft, before a gear of about {:.2g}", 1.0 / ratio)}
                     : EffortUnit{};
}

std::string convert_efforts(const HealthView& view, double ratio, const EffortUnit& unit) {
  const bool known = unit.factor > 0.0;
  const double factor = known ? unit.factor : 1.0 / ratio;
  std::vector<std::string> efforts;
  for (const JointView& j : view.joints) {
    efforts.push_back(j.effort_name);
  }
  return fmt::format(
      "Say what one unit of the efforts is{}: {} (or the same under `columns:` in the robot file){}. Or correct "
      "effort.kind, wheel_radius or nominal in the robot file.",
      view.robot.effort == model::EffortKind::torque ? " in N·m at the wheel" : "",
      scaling_arguments(view, efforts, factor),
      known ? ""
            : fmt::format("; {:.4g} is what makes the mass the nominal one: take the drive's data sheet (rated torque, "
                          "gear, torque constant) for the true factor",
                          factor));
}

void check_effort_scale(const HealthView& view, const commission::Setting& s, const commission::Fit& fit,
                        std::vector<LogFinding>& out) {
  if (!view.robot_given) {
    return;
  }
  const std::vector<NominalRatio> ratios = nominal_ratios(s, fit);
  for (const NominalRatio& mass : ratios) {
    const double ratio = mass.ratio();
    if (!mass.is_mass || !(ratio > 0.0)) {
      continue;
    }
    const bool odd = ratio >= kOddTimesNominal || ratio <= 1.0 / kOddTimesNominal;
    const bool one_factor = by_one_factor(ratios, ratio, odd ? kOneFactor : kSameFactor);
    if (!odd && !(one_factor && std::abs(std::log(ratio)) > std::log(kNamedFactor))) {
      continue;
    }
    double top = 0.0;
    for (const JointView& j : view.joints) {
      for (const double e : *j.effort) {
        top = std::max(top, std::abs(e));
      }
    }
    EffortUnit unit = odd ? unit_of_efforts(view.robot, ratio, top) : EffortUnit{};
    const bool measured = view.column("gyro_z") != nullptr || view.column("theta") != nullptr;
    double of_speeds = 0.0;  // factor that makes rad/s of the wheels' motion, where that explains the ratio
    for (const TorqueUnit& known : kSpeedUnits) {
      if (std::abs(ratio / known.ratio - 1.0) < 0.3) {
        of_speeds = known.ratio;
        unit.words = fmt::format("the wheels' motion were in {}", known.unit);
      }
    }
    if (const double r = view.robot.wheel_radius;
        odd && !measured && model::on_two_wheels(view.robot) && std::abs(ratio * r - 1.0) < 0.05) {
      of_speeds = 1.0 / r;
      unit.words = "the wheels' motion were that of the rim, in m and m/s";
    }
    const bool far = (odd && one_factor) || ratio > kMostTimesNominal || ratio < kLeastTimesNominal;
    out.push_back(
        {.id = "units.effort",
         .topic = FindingTopic::units,
         .severity = far ? FindingSeverity::fatal : FindingSeverity::warning,
         .sentence = fmt::format("Efforts and motion give a {} of {:.3g} where the robot file has {:.3g}: {:.3g} "
                                 "times as much{}{}.",
                                 mass.name, mass.value, mass.nominal, ratio,
                                 one_factor ? ", and the frictions likewise, which no load does" : "",
                                 unit.words.empty() ? ""
                                 : of_speeds > 0.0  ? ", as if " + unit.words
                                                    : ", as if efforts were " + unit.words),
         .next =
             of_speeds > 0.0
                 ? fmt::format("Convert the wheels' motion to rad and rad/s at the wheel ({} does so), or check the "
                               "unit of the efforts (N·m at the wheel, A, V), effort.kind, and the wheel radius.",
                               scaling_arguments(view, motion_columns(view), of_speeds))
                 : convert_efforts(view, ratio, unit),
         .columns = s.measurement.effort_columns,
         .value = ratio,
         .unit = "1"});
  }
}

// Mass and yaw inertia of a body that is denser than steel: efforts of another unit, where no nominal mass tells.
void check_density(const HealthView& view, const commission::Setting& s, const commission::Fit& fit,
                   std::vector<LogFinding>& out) {
  if (!view.robot_given || view.robot.effort != model::EffortKind::torque || !model::on_two_wheels(view.robot) ||
      s.robot.nominal.contains("mass")) {
    return;
  }
  double mass = 0.0, inertia = 0.0;
  const auto scales = commission::physical_scales(s.robot, s.model);
  for (std::size_t j = 0; scales && j < s.model.p(); ++j) {
    const std::string& name = s.model.parameters[j].physical;
    if (fit.excitation[j].state != identify::Excitation::identified) {
      continue;
    }
    const double value = (*scales)[j].scale * fit.estimate[static_cast<Eigen::Index>(j)] - (*scales)[j].offset;
    mass = name == "mass" ? value : mass;
    inertia = name == "yaw_inertia" ? value : inertia;
  }
  if (!(mass > 0.0 && inertia > 0.0)) {
    return;
  }
  const double gyration = std::sqrt(inertia / mass), density = mass / (gyration * gyration * gyration);
  if (density < kDensest) {
    return;
  }
  std::vector<std::string> efforts;
  for (const JointView& j : view.joints) {
    efforts.push_back(j.effort_name);
  }
  out.push_back(
      {.id = "units.effort",
       .topic = FindingTopic::units,
       .severity = FindingSeverity::fatal,
       .sentence =
           fmt::format("Efforts read as N·m give a mass of {:.3g} kg with a radius of gyration of {:.2g} m: a lump "
                       "of steel of that weight is larger.",
                       mass, gyration),
       .next = fmt::format("Say what one unit of the efforts is in N·m at the wheel: of mN·m {}, of N·cm {}. For per "
                           "cent, PWM or A give the robot file a rough `nominal: {{mass: …}}` (kg): then the factor is "
                           "named that fits it.",
                           scaling_arguments(view, efforts, 1e-3), scaling_arguments(view, efforts, 1e-2)),
       .columns = s.measurement.effort_columns,
       .value = density,
       .unit = "kg/m³"});
}

// Turning against the efforts. Friction of turning comes out negative on sound logs that hardly turn, too: it is a
// cause only of a log that no parameters explain.
void check_sides(const commission::Setting& s, const commission::Fit& fit, std::vector<LogFinding>& out) {
  const bool unexplained = s.noise_complete && std::ranges::find(out, "motion.refused", &LogFinding::id) != out.end();
  const auto of_yaw = [&](std::size_t j) {
    return s.model.parameters[j].physical == "yaw_inertia" || s.model.parameters[j].physical == "viscous_yaw";
  };
  bool others = true;  // are negative too
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    others = others && (!of_yaw(j) || fit.estimate[static_cast<Eigen::Index>(j)] < 0.0);
  }
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const bool inertia = s.model.parameters[j].physical == "yaw_inertia";
    if (of_yaw(j) && (inertia || (others && unexplained)) &&
        fit.excitation[j].state == identify::Excitation::identified &&
        fit.estimate[at] < -5.0 * fit.residuals.standard_error[at]) {
      out.push_back({.id = "units.effort_sides",
                     .topic = FindingTopic::units,
                     .severity = FindingSeverity::fatal,
                     .sentence = fmt::format("The efforts turn the robot the other way than it turns: {} comes out "
                                             "negative.",
                                             inertia ? "the yaw inertia" : "the friction of turning"),
                     .next = "Right and left seem to be swapped, of the efforts or of the motion: check the columns.",
                     .columns = s.measurement.effort_columns,
                     .value = fit.estimate[at],
                     .unit = commission::parameter_unit(s.robot, s.model.parameters[j])});
      return;
    }
  }
}

// What the filtered regressor says of each parameter. Returns whether any is excited.
bool check_excitation(const HealthView& view, LogSource& log, const commission::Setting& s, const commission::Fit& fit,
                      std::vector<LogFinding>& out) {
  const bool one_clock = std::ranges::is_sorted(view.log->t);
  std::vector<inference::ParameterWords> words;
  for (const model::Parameter& p : s.model.parameters) {
    words.push_back({p.physical, p.physical_unit, p.excite, inference::kind_of(p.physical)});
  }
  std::size_t excited = 0;
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const identify::ExcitationFinding& found = fit.excitation[j];
    excited += found.state != identify::Excitation::not_excited ? 1 : 0;
    if (found.state == identify::Excitation::identified) {
      continue;
    }
    const bool missing = found.state == identify::Excitation::not_excited;
    const auto manoeuvres = inference::missing_manoeuvres({static_cast<Eigen::Index>(j)}, words);
    out.push_back(
        about_motion("motion.excitation", missing ? FindingSeverity::warning : FindingSeverity::notice,
                     fmt::format("{}: {}.", words[j].name, found.reason),
                     manoeuvres.empty() ? "" : fmt::format("What would show it: {}.", fmt::join(manoeuvres, "; ")),
                     found.signal_rms, ""));
  }
  if (excited == 0) {
    out.push_back(about_motion("motion.nothing", FindingSeverity::fatal, "The log says nothing about any parameter.",
                               "Speed up and brake, drive curves to both sides, slow and fast.", 0.0, ""));
    return false;
  }
  const double condition = fit.squares.condition;
  const FindingSeverity severity = excited < s.model.p() ? FindingSeverity::fine
                                   : condition > 100.0   ? FindingSeverity::warning
                                   : condition > 30.0    ? FindingSeverity::notice
                                                         : FindingSeverity::fine;
  out.push_back(about_motion("motion.condition", severity,
                             fmt::format("{} of {} parameters are excited; condition number of the filtered regressor "
                                         "{:.3g}.",
                                         excited, s.model.p(), condition),
                             severity == FindingSeverity::fine
                                 ? ""
                                 : "Parameters can hardly be told apart: change speed and yaw rate more, and "
                                   "independently of each other.",
                             condition, "1"));
  inference::InformationOptions options;
  options.weights = fit.weights;
  const inference::InformationOverTime over_time =
      inference::information_over_time(commission::log_moments(log, s, commission::Part::everything), options);
  for (std::size_t j = 0; one_clock && j < s.model.p(); ++j) {
    const inference::ParameterInformation& info = over_time.parameters[j];
    const double share = s.survey.seconds > 0.0 ? info.seconds / s.survey.seconds : 1.0;
    if (fit.excitation[j].state == identify::Excitation::not_excited || !(info.information > 0.0) || share > 0.1) {
      continue;
    }
    LogFinding f =
        about_motion("motion.information", FindingSeverity::notice,
                     fmt::format("{}: four fifths of what the log says stand in {:.3g} s of {:.4g} s.", words[j].name,
                                 info.seconds, s.survey.seconds),
                     fmt::format("Repeat that manoeuvre, spread over the drive ({}).", words[j].excite), share, "1");
    for (const auto& [from, to] : info.spans) {
      if (++f.stretches <= kMostStretches) {
        f.when.push_back({from, to});
      }
    }
    out.push_back(f);
  }
  return true;
}

// What commissioning holds against the effort of one joint; with declared noise it weighs that, and may drop it.
void check_single_efforts(LogSource& log, const commission::Setting& s, std::vector<LogFinding>& out) {
  for (const commission::LogContradiction& c : commission::contradictions_of_efforts(log, s)) {
    if (!c.withdraws) {
      continue;
    }
    const bool unrelated = c.kind == commission::LogContradiction::Kind::effort_unrelated;
    LogFinding f{.id = unrelated ? "signals.effort_unrelated" : "signals.wheels_disagree",
                 .topic = FindingTopic::signals,
                 .severity = s.noise_complete ? FindingSeverity::warning : FindingSeverity::fatal};
    f.refuses = unrelated;
    f.sentence = (unrelated ? c.sentence : core::capital(c.sentence)) + ".";  // a column keeps its spelling
    f.next = core::capital(c.next) + ".";
    f.columns = unrelated ? std::vector{c.subject} : s.measurement.effort_columns;
    f.value = c.value;
    f.unit = std::string("1");
    out.push_back(f);
  }
}

// Even samples behind scattered stamps, of which no clock was found to read them by: commissioning refuses them.
void check_stamps(LogSource& log, const commission::Setting& s, std::vector<LogFinding>& out) {
  std::vector<commission::LogContradiction> raw;
  commission::find_raw_contradictions(log, s, raw);
  for (const commission::LogContradiction& c : raw) {
    if (c.kind == commission::LogContradiction::Kind::stamps_scatter) {
      out.push_back({.id = "time.stamps_scatter",
                     .topic = FindingTopic::time,
                     .severity = FindingSeverity::fatal,
                     .sentence = core::capital(c.sentence) + ".",
                     .next = core::capital(c.next) + ".",
                     .columns = s.measurement.motion_columns,
                     .value = 1.0 / c.value,
                     .unit = "1"});
    }
  }
}

void check_remainder(const commission::Setting& s, const commission::Fit& fit, std::vector<LogFinding>& out) {
  for (std::size_t i = 0; i < s.model.n(); ++i) {
    const identify::OutputResidual& o = fit.residuals.outputs[i];
    const double share = o.torque_rms > 0.0 ? o.rms / o.torque_rms : 0.0;
    if (share > 0.2) {
      out.push_back(about_motion(
          "motion.unexplained", FindingSeverity::notice,
          fmt::format("A first fit leaves {:.0f} % of the effort ({}) unexplained.", 100.0 * share, s.model.outputs[i]),
          "Thresholds will be as wide as that; `wheelwright gap` says what it may come from.", share, "1"));
    }
  }
}

}  // namespace

bool check_motion(const HealthView& view, std::vector<LogFinding>& findings) {
  if (!view.has_motion()) {
    return false;
  }
  check_directions(view, findings);
  check_traction(view, findings);
  if (!view.has_effort()) {
    return false;
  }
  check_effort_sense(view, findings);
  check_copied_efforts(view, findings);
  const std::optional<LogTable> sound = check_frozen_efforts(view, findings);
  try {
    TableSource log(sound ? *sound : *view.log);
    Robot robot = view.robot;
    const commission::Setting s = commission::settle(log, robot);
    const commission::Fit fit = commission::fit_log(log, s, commission::Part::everything, kUnusedRisk);
    const bool excited = check_excitation(view, log, s, fit, findings);
    if (excited) {
      check_effort_scale(view, s, fit, findings);
      check_density(view, s, fit, findings);
      check_mirrored(view, s, fit, findings);
      check_remainder(s, fit, findings);
      check_delay(view, log, s, fit, findings);
      check_sides(s, fit, findings);
      check_single_efforts(log, s, findings);
      check_stamps(log, s, findings);
    }
    return excited;
  } catch (const Error& error) {
    findings.push_back(about_motion("motion.refused", FindingSeverity::fatal,
                                    fmt::format("Commissioning refuses the log: {}.", error.what()), "", std::nan(""),
                                    ""));
    return false;
  }
}

}  // namespace wheelwright::doctor
