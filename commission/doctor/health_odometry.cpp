// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "commission/doctor/log_health.hpp"
#include "commission/pose_origin.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "core/words.hpp"
#include "identify/inference/kinematic_calibration.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kWindow = 1.0;        // s
constexpr std::size_t kFewest = 8;     // windows
constexpr double kNeeded = 0.05;       // of a mean square, that the other one alone leaves
constexpr double kClear = 4.0;         // standard errors
constexpr double kFastest = 10.0;      // rad in a window
constexpr double kAligned = 0.8;       // of displacements with the heading, for a forward direction
constexpr double kOddRadius = 0.01;    // of a wheel's radius, from which on another is said
constexpr double kRadiusErrors = 5.0;  // standard errors, likewise
constexpr double kFits = 0.5;          // least share of the variation that wheels must explain of a pose

// What happened within a window.
struct Window {
  double right = 0.0, left = 0.0;  // turned by the wheels, rad
  double heading = 0.0;            // change of theta, as logged
  double gyro = 0.0;               // ∫ gyro_z dt
  double x = 0.0, y = 0.0;         // displacement
  double middle = 0.0;             // mean of theta at both ends, as logged
  [[nodiscard]] double along() const { return 0.5 * (right + left); }
  [[nodiscard]] double turn() const { return 0.5 * (right - left); }
};

double integral(const std::vector<double>& t, const std::vector<double>& v, std::size_t a, std::size_t b) {
  double sum = 0.0;
  for (std::size_t k = a + 1; k <= b; ++k) {
    sum += 0.5 * (v[k] + v[k - 1]) * (t[k] - t[k - 1]);
  }
  return sum;
}

template <typename Visit>
void each_window(const HealthView& view, Visit visit) {
  const std::vector<double>& t = view.log->t;
  for (const auto& [first, last] : view.segments) {
    std::size_t a = first;
    for (std::size_t b = first; b < last; ++b) {
      if (t[b] - t[a] >= kWindow) {
        visit(a, b);
        a = b;
      }
    }
  }
}

std::vector<Window> windows_of(const HealthView& view) {
  const std::vector<double>*x = view.column("x"), *y = view.column("y"), *theta = view.column("theta"),
        *gyro = view.column("gyro_z");
  const std::vector<double>& t = view.log->t;
  const auto turned = [&](const JointView& j, std::size_t a, std::size_t b) {
    return j.angle != nullptr ? (*j.angle)[b] - (*j.angle)[a] : integral(t, *j.speed, a, b);
  };
  std::vector<Window> windows;
  each_window(view, [&](std::size_t a, std::size_t b) {
    Window w;
    w.right = turned(view.joints[0], a, b);
    w.left = turned(view.joints[1], a, b);
    if (theta != nullptr) {
      w.heading = (*theta)[b] - (*theta)[a];
      w.middle = 0.5 * ((*theta)[b] + (*theta)[a]);
    }
    if (x != nullptr && y != nullptr) {
      w.x = (*x)[b] - (*x)[a];
      w.y = (*y)[b] - (*y)[a];
    }
    if (gyro != nullptr) {
      w.gyro = integral(t, *gyro, a, b);
    }
    windows.push_back(w);
  });
  return windows;
}

// value = along·S + turn·T over windows, S and T the wheels' mean and half difference.
struct WheelFit {
  double along = 0.0, turn = 0.0;
  bool along_clear = false, turn_clear = false;  // told from zero, and needed beside the other
  double explained = 0.0;                        // share of the variation
};

std::optional<WheelFit> fit_wheels(const std::vector<Window>& windows, const std::vector<double>& value) {
  const auto n = static_cast<Eigen::Index>(windows.size());
  if (windows.size() < kFewest) {
    return std::nullopt;
  }
  Eigen::MatrixXd A(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    A(i, 0) = windows[static_cast<std::size_t>(i)].along();
    A(i, 1) = windows[static_cast<std::size_t>(i)].turn();
  }
  const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXd>(value.data(), n);
  const Eigen::Matrix2d gram = A.transpose() * A;
  const double scale = gram.trace();
  if (!(scale > 0.0) || !(b.squaredNorm() > 0.0)) {
    return std::nullopt;
  }
  const Eigen::Matrix2d inverse = (gram + 1e-6 * scale * Eigen::Matrix2d::Identity()).inverse();
  const Eigen::Vector2d c = inverse * (A.transpose() * b);
  const double rest = (b - A * c).squaredNorm();
  const double variance = rest / static_cast<double>(n - 2);
  WheelFit fit{.along = c[0], .turn = c[1]};
  // On a circle either one tells everything.
  const auto needed = [&](Eigen::Index other) {
    const double beside = gram(other, other) > 0.0 ? std::pow(A.col(other).dot(b), 2) / gram(other, other) : 0.0;
    return b.squaredNorm() - beside > kNeeded * b.squaredNorm();
  };
  fit.along_clear =
      std::abs(c[0]) > kClear * std::sqrt(variance * inverse(0, 0)) && gram(0, 0) > 1e-3 * scale && needed(1);
  fit.turn_clear =
      std::abs(c[1]) > kClear * std::sqrt(variance * inverse(1, 1)) && gram(1, 1) > 1e-3 * scale && needed(0);
  fit.explained = 1.0 - rest / b.squaredNorm();
  return fit;
}

LogFinding about_units(const char* id, FindingSeverity severity, std::string sentence, std::string next,
                       std::vector<std::string> columns, double value) {
  return {.id = id,
          .topic = FindingTopic::units,
          .severity = severity,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .columns = std::move(columns),
          .value = value,
          .unit = "1"};
}

// How well displacements lie along scale·theta + offset: 1 exactly, 0 not at all; and the offset, modulo half a turn.
struct Alignment {
  double quality = 0.0, offset = 0.0;
};

Alignment alignment(const std::vector<Window>& windows, double scale) {
  std::complex<double> sum = 0.0;
  double weight = 0.0;
  for (const Window& w : windows) {
    const double squared = w.x * w.x + w.y * w.y;
    sum += squared * std::polar(1.0, 2.0 * (std::atan2(w.y, w.x) - scale * w.middle));
    weight += squared;
  }
  return {weight > 0.0 ? std::abs(sum) / weight : 0.0, 0.5 * std::arg(sum)};
}

// Angle from the logged heading (scale·theta) to the direction in which the wheels drive, counterclockwise, with its
// standard error: displacements, step by step in the frame of the heading, add up to a complex multiple of what the
// wheels rolled, and a point off the axle adds one of what the heading turned. Nothing where the wheels hardly roll.
struct DrivingDirection {
  double offset = 0.0, error = 0.0;
};

std::optional<DrivingDirection> driving_direction(const HealthView& view, const std::vector<Window>& windows,
                                                  double scale) {
  const auto n = static_cast<Eigen::Index>(windows.size());
  if (windows.size() < kFewest) {
    return std::nullopt;
  }
  Eigen::MatrixX2cd rolled(n, 2);
  Eigen::VectorXcd moved(n);
  const std::vector<double>&x = *view.column("x"), &y = *view.column("y"), &theta = *view.column("theta");
  Eigen::Index i = 0;
  each_window(view, [&](std::size_t a, std::size_t b) {
    const Window& w = windows[static_cast<std::size_t>(i)];
    rolled(i, 0) = w.along();
    rolled(i, 1) = std::complex<double>(0.0, scale * w.heading);
    moved[i] = 0.0;
    for (std::size_t k = a + 1; k <= b; ++k) {
      moved[i] += std::polar(1.0, -0.5 * scale * (theta[k] + theta[k - 1])) *
                  std::complex<double>(x[k] - x[k - 1], y[k] - y[k - 1]);
    }
    ++i;
  });
  const Eigen::Matrix2cd gram = rolled.adjoint() * rolled;
  const double along = gram(0, 0).real(), turn = gram(1, 1).real();
  if (!(along > 0.01 * turn) || !(along > 0.0)) {
    return std::nullopt;
  }
  const Eigen::Matrix2cd inverse = (gram + 1e-9 * (along + turn) * Eigen::Matrix2cd::Identity()).inverse();
  const Eigen::Vector2cd found = inverse * (rolled.adjoint() * moved);
  const double rest = (moved - rolled * found).squaredNorm() / static_cast<double>(2 * n - 4);
  const double radius = std::abs(found[0]);
  if (!(radius > 0.0)) {
    return std::nullopt;
  }
  return DrivingDirection{std::arg(found[0]), std::sqrt(rest * inverse(0, 0).real()) / radius};
}

// Scale that makes rad with the usual sign of the logged heading: 1, −1, or a degree. Degrees are believed only where
// the heading changes faster than any wheeled robot turns.
double heading_scale(const std::vector<Window>& windows) {
  double best = 1.0, quality = alignment(windows, 1.0).quality;
  const bool fast = std::ranges::any_of(windows, [](const Window& w) { return std::abs(w.heading) > kFastest; });
  for (const double scale : {kDegree, -1.0, -kDegree}) {
    const double other = alignment(windows, scale).quality;
    if (quality < 0.9 && other > quality + 0.1 && other > 0.9 && (fast || scale == -1.0)) {
      best = scale;
      quality = other;
    }
  }
  return best;
}

// How far the position moves per rad of the wheels in nearly straight windows; nothing where there are few.
std::optional<double> straight_ratio(const std::vector<Window>& windows) {
  std::vector<double> ratios;
  double longest = 0.0;
  for (const Window& w : windows) {
    longest = std::max(longest, std::abs(w.along()));
  }
  for (const Window& w : windows) {
    if (std::abs(w.along()) > 0.2 * longest && std::abs(w.turn()) < 0.1 * std::abs(w.along())) {
      ratios.push_back(std::hypot(w.x, w.y) / std::abs(w.along()));
    }
  }
  if (ratios.size() < kFewest) {
    return std::nullopt;
  }
  return core::median(std::move(ratios));
}

// Way along the heading in each window, step by step: position noise cancels but for the ends.
std::vector<double> forward_of(const HealthView& view, const std::vector<Window>& windows, double scale) {
  const double offset = alignment(windows, scale).offset;
  const std::vector<double>&x = *view.column("x"), &y = *view.column("y"), &theta = *view.column("theta");
  std::vector<double> out;
  each_window(view, [&](std::size_t a, std::size_t b) {
    double way = 0.0;
    for (std::size_t k = a + 1; k <= b; ++k) {
      const double direction = 0.5 * scale * (theta[k] + theta[k - 1]) + offset;
      way += (x[k] - x[k - 1]) * std::cos(direction) + (y[k] - y[k - 1]) * std::sin(direction);
    }
    out.push_back(way);
  });
  return out;
}

// Columns of one wheel whose sign is wrong: its motion, and its effort where that drives the wheel as logged.
std::vector<std::string> mirrored_columns(const HealthView& view, std::size_t side) {
  const JointView& j = view.joints[side];
  std::vector<std::string> names = {j.angle_name, j.speed_name};
  if (j.effort == nullptr) {
    return names;
  }
  double power = 0.0;
  for (std::size_t k = 0; k < view.log->rows(); ++k) {
    power += (*j.effort)[k] * j.smooth[k];
  }
  if (power > 0.0) {
    names.push_back(j.effort_name);
  }
  return names;
}

std::vector<std::string> both_mirrored(const HealthView& view) {
  std::vector<std::string> names = mirrored_columns(view, 0), left = mirrored_columns(view, 1);
  names.insert(names.end(), left.begin(), left.end());
  return names;
}

std::string swapped_words(const HealthView& view) {
  std::vector<std::string> maps;
  const JointView &right = view.joints[0], &left = view.joints[1];
  for (const auto& [one, other] : {std::pair(&right.angle_name, &left.angle_name),
                                   {&right.speed_name, &left.speed_name},
                                   {&right.effort_name, &left.effort_name}}) {
    if (view.column(*one) != nullptr && view.column(*other) != nullptr) {
      maps.push_back(fmt::format("--map {0}={1} --map {1}={0}", *one, *other));
    }
  }
  return fmt::format("`{}`", fmt::join(maps, " "));
}

// Signs and sides. `yaw` is that of `column`; nothing where that is not to be had, likewise `forward`.
void check_sides(const HealthView& view, const std::optional<WheelFit>& yaw, const std::optional<WheelFit>& forward,
                 const std::string& column, std::vector<LogFinding>& out) {
  if (!yaw || !(yaw->explained > kFits)) {
    return;
  }
  const double along = yaw->along_clear ? yaw->along : 0.0, turn = yaw->turn_clear ? yaw->turn : 0.0;
  if (std::abs(along) > 2.0 * std::abs(turn)) {
    const char* side = along > 0.0 ? "left" : "right";
    const char* suffix = along > 0.0 ? "l" : "r";
    out.push_back(about_units("units.wheel_sign", FindingSeverity::fatal,
                              fmt::format("{} follows the sum of the wheels, not their difference: the {} wheel counts "
                                          "backwards.",
                                          column, side),
                              fmt::format("Turn the sign of the {} wheel: {} does so.", side,
                                          scaling_arguments(view, mirrored_columns(view, along > 0.0 ? 1 : 0), -1.0)),
                              {fmt::format("omega_{}", suffix), fmt::format("phi_{}", suffix)}, along));
    return;
  }
  if (turn < 0.0 && std::abs(turn) > 2.0 * std::abs(along)) {
    const bool back = forward && forward->along_clear && forward->along < 0.0;
    out.push_back(about_units(
        "units.sides", FindingSeverity::fatal,
        back ? fmt::format("Both wheels count backwards: {} and position go the other way.", column)
             : fmt::format("{} turns the other way than the wheels say.", column),
        back
            ? fmt::format("Turn the signs of both wheels: {} does so.",
                          scaling_arguments(view, both_mirrored(view), -1.0))
            : fmt::format("Right and left wheel are swapped, or {} counts clockwise: it has to grow in a left turn. {} "
                          "turns its sign; in a table with these names {} changes the sides.",
                          column, scaling_arguments(view, {column}, -1.0), swapped_words(view)),
        {column}, turn));
  }
}

// What makes rad/s of a unit of unit_for_ratio().
double unit_factor(std::string_view unit) {
  return unit == "deg/s" ? kDegree : unit == "rpm" ? std::numbers::pi / 30.0 : 2.0 * std::numbers::pi;
}

// Scales against the robot file's radius r and track D: `lin` and `yaw` are what was found over what they should be.
void check_scales(const HealthView& view, std::optional<double> lin, std::optional<double> yaw,
                  std::vector<LogFinding>& out) {
  const std::vector<std::string> wheels = {view.joints[0].motion_name(), view.joints[1].motion_name()};
  const double main = lin ? *lin : yaw ? *yaw : 1.0;
  const bool together = !lin || !yaw || std::abs(std::log(*lin / *yaw)) < 1.2;
  const bool angles = view.joints[0].angle != nullptr;
  const std::string unit = unit_for_ratio(1.0 / main, true);
  const double gear = view.robot.motor ? view.robot.motor->gear_ratio : 1.0;
  const std::string measured = view.column("theta") != nullptr ? "the pose says" : "the gyro says";
  if (together && std::abs(std::log(main)) > 1.2) {
    // Wheels against the gyro alone: one of them is in another unit, and a known one tells which.
    const std::string of_gyro =
        lin || view.column("theta") != nullptr || !unit.empty() ? "" : unit_for_ratio(main, true);
    if (!of_gyro.empty()) {
      out.push_back(
          about_units("units.gyro", FindingSeverity::fatal,
                      fmt::format("The gyro turns {:.3g} times as far as the wheels say with the robot file's "
                                  "radius and track: it looks like {}.",
                                  main, of_gyro),
                      fmt::format("Convert gyro_z to rad/s: {} does so.",
                                  scaling_arguments(view, {"gyro_z"}, unit_factor(of_gyro))),
                      {"gyro_z"}, main));
      return;
    }
    const bool shaft = gear > 3.0 && std::abs(1.0 / main / gear - 1.0) < 0.1;
    const bool rim = !shaft && unit.empty() && std::abs(main * view.robot.wheel_radius - 1.0) < 0.1;
    const double factor = shaft          ? 1.0 / gear
                          : rim          ? 1.0 / view.robot.wheel_radius
                          : unit.empty() ? main
                                         : unit_factor(unit);
    const std::string looks = shaft          ? " Those of the motor's shaft, before the gear?"
                              : rim          ? fmt::format(" They look like {} at the rim.", angles ? "m" : "m/s")
                              : unit.empty() ? ""
                              : angles       ? fmt::format(" Their unit looks like that of {}.", unit)
                                             : fmt::format(" They look like {}.", unit);
    out.push_back(about_units(
        "units.wheel_speed", FindingSeverity::fatal,
        fmt::format("{} are {:.3g} times what {} with the robot file's radius{}.{}", fmt::join(wheels, " and "),
                    1.0 / main, measured, yaw ? " and track" : "", looks),
        fmt::format("Convert the wheels' motion to rad and rad/s at the wheel ({} does so{}), or correct wheel_radius.",
                    scaling_arguments(view, motion_columns(view), factor),
                    shaft || rim || !unit.empty() ? "" : fmt::format(", by what {}", measured)),
        wheels, 1.0 / main));
    return;
  }
  if (lin && std::abs(std::log(*lin)) > 1.2) {
    const std::string of = unit_for_ratio(*lin, false);
    const char* looks = of == "thousandths" ? " They look like mm." : of == "hundredths" ? " They look like cm." : "";
    out.push_back(about_units(
        "units.position", FindingSeverity::fatal,
        fmt::format("x and y move {:.4g} times as far as the wheels roll.{}", *lin, looks),
        fmt::format("Convert x and y to m: {} does so.", scaling_arguments(view, {"x", "y"},
                                                                           of == "thousandths"  ? 1e-3
                                                                           : of == "hundredths" ? 1e-2
                                                                                                : 1.0 / *lin)),
        {"x", "y"}, *lin));
  } else if (lin && std::abs(*lin - 1.0) > 0.05) {
    out.push_back(about_units(
        "units.wheel_radius", std::abs(*lin - 1.0) > 0.15 ? FindingSeverity::warning : FindingSeverity::notice,
        fmt::format("The robot drives as if its wheels had a radius of {:.4g} m; the robot file says "
                    "{:.4g} m.",
                    *lin * view.robot.wheel_radius, view.robot.wheel_radius),
        std::abs(*lin - 0.5) < 0.05 ? "Correct wheel_radius: it looks like a diameter."
                                    : "Correct wheel_radius; `identify` measures it.",
        {"x", "y"}, *lin));
  }
  if (yaw && *yaw > 10.0) {
    out.push_back(about_units(
        "units.heading", FindingSeverity::fatal,
        fmt::format("The heading turns {:.3g} times as far as the wheels say: it looks like degrees.", *yaw),
        fmt::format("Convert it to rad (rad/s): {} does so.",
                    scaling_arguments(view, {view.column("theta") != nullptr ? "theta" : "gyro_z"}, kDegree)),
        {"theta"}, *yaw));
  } else if (yaw && std::abs(*yaw - 1.0) > 0.1) {
    out.push_back(
        about_units("units.track_width", FindingSeverity::warning,
                    fmt::format("The robot turns like one with a track of {:.3g} m; the robot file says {:.3g} m.",
                                view.robot.track_width / *yaw * lin.value_or(1.0), view.robot.track_width),
                    "Wheels that scrub turn a robot less than they roll: take the effective track, which "
                    "`identify` measures, or correct track_width.",
                    {"theta"}, *yaw));
  }
}

// Counts a turn of an angle that changes by `ratio` times the integral of the speed; 0 where it is none.
double counts_of(double ratio) {
  constexpr double kFewestCounts = 100.0;
  const double counts = std::round(2.0 * std::numbers::pi * ratio);
  return counts >= kFewestCounts && unit_for_ratio(ratio, false).empty() ? counts : 0.0;
}

std::string convert_one(const HealthView& view, const JointView& joint, double ratio, const std::string& unit) {
  const double counts = counts_of(ratio);
  if (counts > 0.0) {
    return fmt::format("{} makes rad of them; write the true number of counts a turn there.",
                       scaling_arguments(view, {joint.angle_name}, 2.0 * std::numbers::pi / counts));
  }
  return unit.empty() ? fmt::format(
                            "One of them has another unit, sign or gear ratio: {} makes the angle fit, {} the "
                            "speed.",
                            scaling_arguments(view, {joint.angle_name}, 1.0 / ratio),
                            scaling_arguments(view, {joint.speed_name}, ratio))
                      : fmt::format("Convert the speed: {} does so.",
                                    scaling_arguments(view, {joint.speed_name}, unit_factor(unit)));
}

// Wheel angles against the speeds beside them.
void check_angles(const HealthView& view, std::vector<LogFinding>& out) {
  const std::vector<double>& t = view.log->t;
  for (const JointView& j : view.joints) {
    if (j.angle == nullptr || j.speed == nullptr) {
      continue;
    }
    double ss = 0.0, sa = 0.0, aa = 0.0;
    each_window(view, [&](std::size_t a, std::size_t b) {
      const double by_speed = integral(t, *j.speed, a, b), by_angle = (*j.angle)[b] - (*j.angle)[a];
      ss += by_speed * by_speed;
      sa += by_speed * by_angle;
      aa += by_angle * by_angle;
    });
    if (!(ss > 0.0) || !(aa > 0.0)) {
      continue;
    }
    const double ratio = sa / ss, fits = sa / std::sqrt(ss * aa);
    if (fits > 0.99 && std::abs(ratio - 1.0) < 0.02) {
      continue;
    }
    const std::string unit = ratio > 0.0 ? unit_for_ratio(1.0 / ratio, true) : "";
    // Angles come 60 times as fast by a clock in min; in degrees they come 57 times as fast.
    const bool minutes = std::abs(ratio / 60.0 - 1.0) < 0.02;
    const bool unlike = std::abs(fits) < 0.9;
    const bool wrong = unlike || std::abs(ratio - 1.0) > 0.1;
    out.push_back(about_units(
        "units.angle_and_speed", wrong ? FindingSeverity::fatal : FindingSeverity::warning,
        unlike ? fmt::format("{} and the integral of {} have a correlation of only {:.2f}.", j.angle_name, j.speed_name,
                             fits)
               : fmt::format("{} changes by {:.4g} times the integral of {}.{}", j.angle_name, ratio, j.speed_name,
                             minutes ? " The times look like min."
                             : counts_of(ratio) > 0.0
                                 ? fmt::format(" The angle looks like counts, {:.0f} a turn.", counts_of(ratio))
                             : unit.empty() ? ""
                                            : fmt::format(" The speed looks like {}.", unit)),
        unlike    ? "Columns of different wheels, or of different clocks: check their names (--map)."
        : minutes ? "Convert the column t to seconds: --map t=\"*60\" does so."
                  : convert_one(view, j, ratio, unit),
        {j.angle_name, j.speed_name}, ratio));
  }
}

// Of a log longer than kLongEnough as many stretches of a minute, spread over it; else nothing.
std::optional<LogTable> stretches_of(const HealthView& view) {
  constexpr double kStretch = 60.0, kLongEnough = 1200.0;  // s
  const LogTable& log = *view.log;
  const auto rows_of = [&](double seconds) { return static_cast<std::size_t>(seconds / view.step); };
  if (!(view.step > 0.0) || log.rows() <= rows_of(kLongEnough)) {
    return std::nullopt;
  }
  LogTable spread;
  spread.names = log.names;
  spread.columns.resize(log.columns.size());
  constexpr auto kStretches = static_cast<std::size_t>(kLongEnough / kStretch);
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t first = k * log.rows() / kStretches;
    const LogTable stretch = core::slice(log, first, std::min(first + rows_of(kStretch), log.rows()));
    const std::size_t before = spread.rows();
    spread.segment_starts.push_back(before);
    for (const std::size_t start : stretch.segment_starts) {
      if (start > 0) {
        spread.segment_starts.push_back(before + start);
      }
    }
    spread.t.insert(spread.t.end(), stretch.t.begin(), stretch.t.end());
    for (std::size_t c = 0; c < spread.columns.size(); ++c) {
      spread.columns[c].insert(spread.columns[c].end(), stretch.columns[c].begin(), stretch.columns[c].end());
    }
  }
  return spread;
}

// The log with speeds made of the angles where it has none.
LogTable with_speeds(const HealthView& view, const LogTable& log) {
  LogTable out = log;
  for (const JointView& j : view.joints) {
    if (log.find(j.speed_name) == nullptr) {
      out.names.push_back(j.speed_name);
      out.columns.push_back(j.smooth);
    }
  }
  return out;
}

// Wheels that roll another way a turn than the robot file's radius says, as the pose shows: mass and inertia are wrong
// by about twice as much.
void tell_radii(const HealthView& view, const inference::KinematicCalibration& found, std::vector<LogFinding>& out) {
  const double r = view.robot.wheel_radius;
  if (std::ranges::find(out, std::string("units.wheel_radius"), &LogFinding::id) != out.end()) {
    return;
  }
  std::vector<std::string> wheels;
  double worst = 0.0;
  for (const auto& [side, radius] : {std::pair("right", &found.radius_right), {"left", &found.radius_left}}) {
    if (radius->state != inference::KinematicState::identified) {
      return;
    }
    const double off = radius->estimate / r - 1.0;
    if (std::abs(off) > std::max(kOddRadius, kRadiusErrors * radius->standard_error / r)) {
      wheels.push_back(fmt::format("the {} wheel by {:+.2g} % ({:.4g} ± {:.1g} m)", side, 100.0 * off, radius->estimate,
                                   2.0 * radius->standard_error));
      worst = std::abs(off) > std::abs(worst) ? off : worst;
    }
  }
  if (wheels.empty()) {
    return;
  }
  const bool both =
      wheels.size() == 2 && std::abs(found.radius_right.estimate / found.radius_left.estimate - 1.0) < kOddRadius;
  out.push_back(about_units(
      "units.wheel_radius", FindingSeverity::warning,
      fmt::format(
          "By the pose the wheels do not roll as wheel_radius: {:.4g} says: {}. Mass and inertia come out wrong by "
          "about twice that.",
          r, core::listed(wheels)),
      both ? fmt::format("Correct it: `wheel_radius: {:.4g}` in the robot file, where the pose is in m.",
                         0.5 * (found.radius_right.estimate + found.radius_left.estimate))
           : "A tyre is worn or soft, or of another size: make both wheels alike; `gap` weighs other causes, and "
             "`identify` has the radii with their intervals.",
      {"x", "y"}, 1.0 + worst));
}

void check_pose_delay(const HealthView& view, std::vector<LogFinding>& out) {
  if (!view.robot_given || !view.has_motion()) {
    return;
  }
  inference::KinematicOptions options;
  options.wheel_radius = view.robot.wheel_radius;
  options.track_width = view.robot.track_width;
  options.radius = options.axle_offset = view.column("x") != nullptr && view.column("y") != nullptr;
  options.largest_delay = 0.3;
  const bool speeds = view.joints[0].speed != nullptr && view.joints[1].speed != nullptr;
  const std::optional<LogTable> spread = speeds ? stretches_of(view) : std::nullopt;
  try {
    const inference::KinematicCalibration found =
        inference::calibrate_kinematics(spread   ? *spread
                                        : speeds ? *view.log
                                                 : with_speeds(view, *view.log),
                                        options);
    if (options.radius) {
      tell_radii(view, found, out);
    }
    if (!speeds) {
      return;
    }
    const inference::KinematicQuantity& delay = found.delay;
    if (delay.state == inference::KinematicState::identified) {
      const bool late = delay.estimate > 3.0 * delay.standard_error && delay.estimate > 1.5 * view.step;
      out.push_back(
          {.id = "time.pose_delay",
           .topic = FindingTopic::time,
           .severity = late ? FindingSeverity::warning : FindingSeverity::fine,
           .sentence = fmt::format("The pose lags behind the wheels by {:.3g} s (95 %: {:.3g} to {:.3g}).",
                                   delay.estimate, delay.lower, delay.upper),
           .next = late ? "Stamp the pose when the picture or scan is taken, not when it has been worked out." : "",
           .columns = {"theta"},
           .value = delay.estimate,
           .unit = "s"});
    }
  } catch (const InvalidArgument&) {
    // Too few windows: nothing is claimed.
  }
}

// A pose that the wheels explain to the last digit.
void check_pose_origin(const HealthView& view, std::vector<LogFinding>& out) {
  if (view.column("theta") == nullptr) {
    return;
  }
  filter::OdometryMeasurement m;
  m.heading = true;
  m.position = view.column("x") != nullptr && view.column("y") != nullptr;
  m.nominal_step = view.step;
  const bool angles = view.joints[0].angle != nullptr && view.joints[1].angle != nullptr;
  m.motion = angles ? MotionKind::angle : MotionKind::speed;
  for (const JointView& j : view.joints) {
    m.motion_columns.push_back(angles ? j.angle_name : j.speed_name);
  }
  TableSource log(*view.log);
  const commission::PoseOrigin origin = commission::pose_origin(log, m, kWindow, view.robot);
  if (origin.sentence.empty()) {
    return;
  }
  std::string sentence = origin.sentence + ".";
  sentence[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence[0])));
  out.push_back(about_units("signals.pose_repeats_wheels", FindingSeverity::warning, std::move(sentence),
                            origin.undecided ? "It is not used."
                                             : "It is not used: log a pose that does not come from the wheels "
                                               "(camera, lidar, motion capture), or a gyro.",
                            origin.heading_repeats && m.position ? std::vector<std::string>{"x", "y", "theta"}
                            : origin.heading_repeats             ? std::vector<std::string>{"theta"}
                                                                 : std::vector<std::string>{"x", "y"},
                            origin.heading_repeats ? origin.heading_rest : origin.position_rest));
  out.back().topic = FindingTopic::signals;
  out.back().unit = origin.heading_repeats ? "rad" : "m";
}

}  // namespace

void check_odometry(const HealthView& view, std::vector<LogFinding>& findings) {
  check_angles(view, findings);
  const bool theta = view.column("theta") != nullptr, gyro = view.column("gyro_z") != nullptr;
  if (view.joints.size() != 2 || !view.has_motion() || (!theta && !gyro)) {
    return;
  }
  check_pose_origin(view, findings);
  const std::vector<Window> windows = windows_of(view);
  const bool position = theta && view.column("x") != nullptr && view.column("y") != nullptr;
  const double scale = position ? heading_scale(windows) : 1.0;
  std::vector<double> turned, by_gyro;
  for (const Window& w : windows) {
    turned.push_back(theta ? w.heading * std::abs(scale) : w.gyro);
    by_gyro.push_back(w.gyro);
  }
  const double aligned = position ? alignment(windows, scale).quality : 1.0;
  const auto forward =
      position && aligned > kAligned ? fit_wheels(windows, forward_of(view, windows, scale)) : std::nullopt;
  const auto yaw = fit_wheels(windows, turned);
  const std::size_t before = findings.size();
  if (std::abs(scale) < 1.0) {
    findings.push_back(about_units(
        "units.heading", FindingSeverity::fatal, "theta fits the direction of travel only when it is read as degrees.",
        fmt::format("Convert theta to rad: {} does so.", scaling_arguments(view, {"theta"}, kDegree)), {"theta"},
        1.0 / kDegree));
  }
  if (scale < 0.0) {
    // Wheels that turn as theta does leave y, and not theta, for what counts the wrong way.
    const bool as_wheels = yaw && yaw->explained > kFits && yaw->turn_clear && yaw->turn > 0.0;
    findings.push_back(
        as_wheels
            ? about_units(
                  "units.position_mirrored", FindingSeverity::fatal,
                  "theta turns as the wheels do, but fits the direction of travel only with its sign turned: "
                  "x, y are mirrored.",
                  fmt::format("y has to grow to the left of x: {} does so.", scaling_arguments(view, {"y"}, -1.0)),
                  {"x", "y"}, -1.0)
            : about_units("units.heading_sign", FindingSeverity::fatal,
                          "theta fits the direction of travel only with its sign turned.",
                          fmt::format("theta has to grow counterclockwise from x to y: {} does so.",
                                      scaling_arguments(view, {"theta"}, -1.0)),
                          {"theta"}, -1.0));
  }
  if (aligned < kAligned) {
    findings.push_back(about_units(
        "units.pose_frame", FindingSeverity::notice,
        fmt::format("The position does not move along theta (agreement {:.2f} of 1): it slides, "
                    "or theta and x, y are of different frames.",
                    aligned),
        "Give x, y and theta in one fixed frame; the sign of driving was not checked.", {"x", "y", "theta"}, aligned));
  }
  if (scale > 0.0) {
    check_sides(view, yaw, forward, theta ? "theta" : "gyro_z", findings);
  }
  if (theta && gyro) {
    check_sides(view, fit_wheels(windows, by_gyro), std::nullopt, "gyro_z", findings);
    double tt = 0.0, tg = 0.0, gg = 0.0;
    for (std::size_t k = 0; k < windows.size(); ++k) {
      tt += turned[k] * turned[k];
      tg += turned[k] * by_gyro[k];
      gg += by_gyro[k] * by_gyro[k];
    }
    const double ratio = tt > 0.0 ? tg / tt : 1.0;
    if (gg > 0.0 && tg / std::sqrt(tt * gg) > 0.9 && std::abs(ratio - 1.0) > 0.1) {
      const std::string unit = unit_for_ratio(ratio, true);
      findings.push_back(
          about_units("units.gyro", ratio > 10.0 ? FindingSeverity::fatal : FindingSeverity::warning,
                      fmt::format("The gyro turns {:.3g} times as far as theta{}.", ratio,
                                  unit.empty() ? "" : fmt::format(": it looks like {}", unit)),
                      fmt::format("Convert gyro_z to rad/s ({} does so), or calibrate it.",
                                  scaling_arguments(view, {"gyro_z"}, unit.empty() ? 1.0 / ratio : unit_factor(unit))),
                      {"gyro_z"}, ratio));
    }
  }
  const auto size = [](const std::optional<WheelFit>& fit, bool of_turn, double expected) -> std::optional<double> {
    if (!fit || !(fit->explained > kFits)) {
      return std::nullopt;
    }
    const double main = of_turn ? fit->turn : fit->along, cross = of_turn ? fit->along : fit->turn;
    const bool clear = of_turn ? fit->turn_clear : fit->along_clear;
    return clear && std::abs(main) > std::abs(cross) ? std::optional(std::abs(main) / expected) : std::nullopt;
  };
  if (view.robot_given) {
    const double r = view.robot.wheel_radius, c = r / view.robot.track_width;
    std::optional<double> lin = size(forward, false, r);
    if (const auto straight = position ? straight_ratio(windows) : std::nullopt; straight && !lin) {
      lin = *straight / r;
    }
    check_scales(view, lin, size(yaw, true, 2.0 * c), findings);
  }
  if (yaw && yaw->turn_clear && yaw->explained < 0.8) {
    findings.push_back(about_units("units.odometry", FindingSeverity::warning,
                                   fmt::format("Wheels explain only {:.0f} % of the turning.", 100.0 * yaw->explained),
                                   "Slip, a late or wrong column, or a frame that jumps: compare both by eye.",
                                   {theta ? "theta" : "gyro_z"}, yaw->explained));
  }
  const bool sound = std::ranges::none_of(findings.begin() + static_cast<std::ptrdiff_t>(before), findings.end(),
                                          [](const LogFinding& f) { return f.severity == FindingSeverity::fatal; });
  if (theta && sound) {
    check_pose_delay(view, findings);
  }
  if (sound && yaw && yaw->turn_clear) {
    findings.push_back(
        about_units("units.pose_fits", FindingSeverity::fine,
                    fmt::format("Wheels explain {:.4g} % of the turning, with the signs that they should "
                                "have.",
                                100.0 * yaw->explained),
                    "", {}, yaw->explained));
  }
}

namespace {

constexpr double kTurnedHeading = 0.03;  // rad, from which on an offset is said and taken off
constexpr double kTurnedErrors = 5.0;    // standard errors

}  // namespace

std::optional<double> check_heading(const HealthView& view, std::vector<LogFinding>& out) {
  if (view.joints.size() != 2 || !view.has_motion() || view.column("theta") == nullptr || view.column("x") == nullptr ||
      view.column("y") == nullptr) {
    return std::nullopt;
  }
  const std::vector<Window> windows = windows_of(view);
  const double scale = heading_scale(windows);
  std::vector<double> turned(windows.size());
  std::ranges::transform(windows, turned.begin(), [&](const Window& w) { return scale * w.heading; });
  if (const auto yaw = fit_wheels(windows, turned); yaw && yaw->turn_clear && yaw->turn < 0.0) {
    return std::nullopt;  // it is the wheels that count the other way
  }
  const auto found = driving_direction(view, windows, scale);
  if (!found || std::abs(scale) != 1.0 || alignment(windows, scale).quality < kAligned ||
      std::abs(found->offset) < kTurnedHeading + kTurnedErrors * found->error) {
    return std::nullopt;
  }
  LogFinding f = about_units(
      "units.heading_offset", FindingSeverity::notice,
      fmt::format("The robot drives {:.4g} ± {:.1g}° to the {} of theta: the heading is that of a body that is turned "
                  "against the wheels.",
                  std::abs(found->offset) / kDegree, 2.0 * found->error / kDegree,
                  found->offset > 0.0 ? "left" : "right"),
      fmt::format("Commands turn theta by it; `heading_offset: {:.4f}` in the robot file settles it.", found->offset),
      {"theta"}, found->offset);
  f.unit = "rad";
  const double margin = kTurnedErrors * found->error;
  f.taken = Interval{found->offset - margin, found->offset + margin};
  out.push_back(f);
  return found->offset;
}

}  // namespace wheelwright::doctor
