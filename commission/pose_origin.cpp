// SPDX-License-Identifier: Apache-2.0
#include "commission/pose_origin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "core/linear_algebra.hpp"
#include "identify/least_squares.hpp"
#include "model/filter/encoder.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::size_t kFewestPoseWindows = 8;
constexpr double kExactHeading = 1e-6;  // rad
constexpr double kExactWay = 1e-5;      // m
constexpr double kLeastChange = 1e-2;   // rad or m, rms in a window: less says nothing
constexpr double kOfTheCounts = 1.0 / 3.0;
constexpr double kOfTheRounding = 1.2;
constexpr std::size_t kMostKept = 200000;  // rows that are looked at for poses of other stamps
constexpr std::size_t kFewestDrives = 4;   // between two rests
constexpr double kRest = 0.2;              // s to both sides that are a rest
constexpr double kStraight = 1e-9;         // rad: second differences below are those of a straight line
constexpr double kOfInterpolation = 1.25;  // second differences of samples are not the largest second derivative
constexpr double kLongestPoseStep = 0.25;  // s
constexpr double kBendSpan = 0.05;         // s
constexpr double kClose = 1e-5;            // rad: no sensor of its own would be as close to wheels on a floor
constexpr double kOwnBends = 0.005;        // share of the rows
constexpr double kWholeTurn = 2.0 * std::numbers::pi;

// The coarsest decimal unit of which all values are multiples, as they are or wrapped into a turn; 0 where there is
// none.
class Decimals {
 public:
  void add(double value) {
    for (std::size_t k = 0; k < plain_.size(); ++k) {
      plain_[k] = plain_[k] && whole(value, k);
      wrapped_[k] = wrapped_[k] && whole(std::remainder(value, kWholeTurn), k);
    }
  }
  [[nodiscard]] double quantum() const {
    for (std::size_t k = 0; k < plain_.size(); ++k) {
      if (plain_[k] || wrapped_[k]) {
        return std::pow(10.0, -static_cast<double>(k));
      }
    }
    return 0.0;
  }

 private:
  static bool whole(double value, std::size_t decimals) {
    const double scaled = value * std::pow(10.0, static_cast<double>(decimals));
    return std::abs(scaled - std::round(scaled)) < 1e-6;
  }
  std::array<bool, 8> plain_ = filled(), wrapped_ = filled();
  static std::array<bool, 8> filled() {
    std::array<bool, 8> all{};
    all.fill(true);
    return all;
  }
};

// What a combination of two columns leaves of a third, rms; nothing where that hardly varies. Where the columns differ
// by no more than three times their `noise` (rms), as on a circle, their difference takes no part.
class Combination {
 public:
  explicit Combination(double noise = 0.0) : noise_(noise) {}
  void add(double right, double left, double value) {
    const Eigen::Vector2d x(right, left);
    gram_ += x * x.transpose();
    moment_ += value * x;
    square_ += value * value;
    rows_.push_back({right, left, value});
  }
  [[nodiscard]] std::optional<double> rest(std::size_t fewest = kFewestPoseWindows) const {
    if (!tells(fewest)) {
      return std::nullopt;
    }
    double sum = 0.0;
    for (const double e : rests()) {
      sum += e * e;
    }
    return std::sqrt(sum / static_cast<double>(rows_.size()));
  }
  [[nodiscard]] bool tells(std::size_t fewest = kFewestPoseWindows) const {
    return rows_.size() >= fewest && std::sqrt(square_ / static_cast<double>(rows_.size())) >= kLeastChange;
  }
  [[nodiscard]] Eigen::Vector2d weights() const {
    const core::SingularValues svd = core::singular_values(gram_);
    const double most = identify::signal_over_noise * noise_;
    if (svd.values[0] > 0.0 && svd.values[1] < most * most * static_cast<double>(rows_.size())) {
      const Eigen::Vector2d main = svd.V.col(0);
      return main * (main.dot(moment_) / svd.values[0]);
    }
    return core::minimum_norm_solution(gram_, moment_);
  }
  /// What is left of each value.
  [[nodiscard]] std::vector<double> rests() const {
    const Eigen::Vector2d c = weights();
    std::vector<double> out;
    for (const auto& [right, left, value] : rows_) {
      out.push_back(value - c[0] * right - c[1] * left);
    }
    return out;
  }

 private:
  struct Row {
    double right, left, value;
  };
  Eigen::Matrix2d gram_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moment_ = Eigen::Vector2d::Zero();
  double square_ = 0.0, noise_ = 0.0;
  std::vector<Row> rows_;
};

// The rows of one segment: wheel angles (speeds integrated by the trapezium) and the unwrapped heading.
struct Kept {
  std::vector<double> t, heading;
  std::array<std::vector<double>, 2> wheel;

  [[nodiscard]] std::size_t rows() const { return t.size(); }
  // Second difference of a signal about row k, by rows `span` away: counts of an encoder weigh less by its square.
  static double signed_bend(const std::vector<double>& of, std::size_t k, std::size_t span) {
    return (of[k + span] - 2.0 * of[k] + of[k - span]) / static_cast<double>(span * span);
  }
  static double bend(const std::vector<double>& of, std::size_t k, std::size_t span = 1) {
    return std::abs(signed_bend(of, k, span));
  }
};

// Change between rows a and b of a segment.
void add_change(const Kept& log, std::size_t a, std::size_t b, Combination& out) {
  out.add(log.wheel[0][b] - log.wheel[0][a], log.wheel[1][b] - log.wheel[1][a], log.heading[b] - log.heading[a]);
}

// The rows in the middle of rests: both wheels stand still for kRest to both sides.
std::vector<std::size_t> rests_of(const Kept& log) {
  std::vector<std::size_t> out;
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= log.rows(); ++k) {
    if (k < log.rows() && log.wheel[0][k] == log.wheel[0][begin] && log.wheel[1][k] == log.wheel[1][begin]) {
      continue;
    }
    if (log.t[k - 1] - log.t[begin] >= 2.0 * kRest) {
      out.push_back(begin + (k - begin) / 2);
    }
    begin = k;
  }
  return out;
}

// What the wheels leave of the heading from rest to rest: there no stamp, hold or lag matters.
std::optional<double> between_rests(const std::vector<Kept>& segments) {
  Combination drives;
  for (const Kept& log : segments) {
    const std::vector<std::size_t> rests = rests_of(log);
    for (std::size_t i = 1; i < rests.size(); ++i) {
      add_change(log, rests[i - 1], rests[i], drives);
    }
  }
  return drives.rest(kFewestDrives);
}

// Whether second differences of the heading are more than what the wheels' counts and its own `quantum` would make of
// it: it has noise of its own, which nothing that is computed of these counts has.
bool rougher_than_counts(const std::vector<Kept>& segments, const Eigen::Vector2d& weights, double quantum) {
  double heading = 0.0, wheels = 0.0;
  for (const Kept& log : segments) {
    for (std::size_t k = 1; k + 1 < log.rows(); ++k) {
      heading += std::pow(Kept::signed_bend(log.heading, k, 1), 2);
      wheels += 0.5 * quantum * quantum + std::pow(weights[0] * Kept::signed_bend(log.wheel[0], k, 1) +
                                                       weights[1] * Kept::signed_bend(log.wheel[1], k, 1),
                                                   2);
    }
  }
  return heading > kOfTheRounding * wheels;
}

// Whether the heading bends more than lines between samples of what the wheels do near by, `between` rows apart, can:
// with their `counts` (rad) where they turn, as rounded to `quantum` where they stand.
bool bends_by_itself(const std::vector<Kept>& segments, const Eigen::Vector2d& weights, double between, double counts,
                     double quantum) {
  const auto around = static_cast<std::size_t>(std::ceil(between)) + 1;
  std::size_t rows = 0, own = 0;
  for (const Kept& log : segments) {
    for (std::size_t k = around + 1; k + around + 1 < log.rows(); ++k) {
      double most = 0.0;
      bool turns = false;
      for (std::size_t i = k - around; i <= k + around; ++i) {
        double bend = 0.0;
        for (std::size_t j = 0; j < 2; ++j) {
          bend += std::abs(weights[static_cast<Eigen::Index>(j)]) * Kept::bend(log.wheel[j], i);
          turns = turns || log.wheel[j][i + 1] != log.wheel[j][i - 1];
        }
        most = std::max(most, bend);
      }
      own += Kept::bend(log.heading, k) > (between + 1.0) * most + (turns ? counts : 0.0) + 2.0 * quantum ? 1 : 0;
      ++rows;
    }
  }
  return own > kFewestPoseWindows && static_cast<double>(own) > kOwnBends * static_cast<double>(rows);
}

// Of a heading that is within what lines between samples, and counts of the wheels, leave of wheel odometry.
struct WithinLines {
  double rest = 0.0;     // rad, rms
  bool decided = false;  // closer than any sensor of its own would be
};

// What the wheels leave of a heading that is linear between stamps of its own, where that is no more than the
// interpolation h²/8·|d²/dt²| at both ends of each window and a count of each wheel there, and the heading no rougher
// than counts make it; nothing otherwise. h is that of the kinks: a sample bends the line at two rows at most.
std::optional<WithinLines> within_interpolation(const std::vector<Kept>& segments, double window, double step,
                                                double count, double quantum) {
  Combination windows(count / std::sqrt(6.0));
  std::size_t bent = 0, moving = 0;
  std::vector<std::pair<const Kept*, std::array<std::size_t, 2>>> places;
  for (const Kept& log : segments) {
    std::size_t a = 0;
    for (std::size_t k = 1; k + 1 < log.rows(); ++k) {
      if (Kept::bend(log.wheel[0], k) + Kept::bend(log.wheel[1], k) > kStraight) {
        ++moving;
        bent += Kept::bend(log.heading, k) > kStraight ? 1U : 0U;
      }
      if (log.t[k] - log.t[a] >= window) {
        add_change(log, a, k, windows);
        places.push_back({&log, {a, k}});
        a = k;
      }
    }
  }
  if (!windows.tells() || bent == 0) {
    return std::nullopt;
  }
  const double between = 2.0 * static_cast<double>(moving) / static_cast<double>(bent);  // rows
  if (between * step > kLongestPoseStep) {
    return std::nullopt;
  }
  const auto around = static_cast<std::size_t>(std::ceil(between)) + 1;
  const auto span = static_cast<std::size_t>(std::max(1.0, std::round(kBendSpan / step)));
  const Eigen::Vector2d c = windows.weights();
  const double by_counts = 2.0 * count * c.cwiseAbs().sum();
  const std::vector<double> left = windows.rests();
  double squares = 0.0, expected = 0.0;
  std::size_t close = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [log, ends] = places[i];
    double by_lines = kExactHeading;
    for (const std::size_t end : ends) {
      double bend = 0.0;
      const std::size_t last = std::min(end + around, log->rows() - 1 - span);
      for (std::size_t k = std::max(end, around + span) - around; k <= last; ++k) {
        bend = std::max(bend, std::abs(c[0]) * Kept::bend(log->wheel[0], k, span) +
                                  std::abs(c[1]) * Kept::bend(log->wheel[1], k, span));
      }
      by_lines += kOfInterpolation * between * between / 8.0 * bend;
    }
    if (std::abs(left[i]) > by_lines + by_counts) {
      return std::nullopt;
    }
    close += by_lines + by_counts <= kClose ? 1U : 0U;
    squares += left[i] * left[i];
    // Rounding: 1/12 of a count² at the row, two thirds of that between two samples, at both ends.
    expected += 0.5 * by_lines * by_lines + 5.0 / 18.0 * count * count * c.squaredNorm();
  }
  if (squares > kOfTheRounding * expected || (by_counts > 0.0 && rougher_than_counts(segments, c, quantum)) ||
      bends_by_itself(segments, c, between, by_counts, quantum)) {
    return std::nullopt;
  }
  return WithinLines{windows.rest().value_or(0.0), close >= kFewestDrives};
}

// The count of the encoder that steps of an angle are made of, rad; 0 where they are not.
double rounding_of(const std::vector<double>& steps) {
  const auto encoder = filter::find_encoder_of_angles(steps);
  return encoder ? encoder->speed_step : 0.0;
}

// Wheel angles since the window began, by three rules of integration (angles: all alike).
using Turned = std::array<std::array<double, 2>, 3>;

}  // namespace

PoseOrigin pose_origin(LogSource& log, const filter::OdometryMeasurement& m, double window, const model::Robot& robot) {
  PoseOrigin origin;
  if (!m.heading) {
    return origin;
  }
  const std::array<std::size_t, 2> wheel = {*log.find(m.motion_columns[0]), *log.find(m.motion_columns[1])};
  const std::size_t theta = *log.find("theta");
  const std::size_t x = m.position ? *log.find("x") : theta, y = m.position ? *log.find("y") : theta;
  std::array<Combination, 3> headings, ways;
  Decimals decimals;
  Turned turned{};
  std::vector<Kept> kept;
  std::vector<double> wheel_steps;
  std::size_t kept_rows = 0;
  double heading = 0.0, way = 0.0, begin = 0.0, before = 0.0;
  std::array<double, 2> motion{};
  double theta_before = 0.0, x_before = 0.0, y_before = 0.0;
  const auto restart = [&](double t) {
    begin = t;
    heading = way = 0.0;
    turned = {};
  };
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    const double t = block.t[k];
    const std::array<double, 2> now = {block.columns[wheel[0]][k], block.columns[wheel[1]][k]};
    const double theta_now = block.columns[theta][k], x_now = block.columns[x][k], y_now = block.columns[y][k];
    decimals.add(theta_now);
    if (kept_rows++ < kMostKept) {
      if (starts) {
        kept.emplace_back();
      }
      Kept& segment = kept.back();
      const bool first = starts || segment.t.empty();
      for (std::size_t j = 0; j < 2; ++j) {
        const bool angle = m.motion == MotionKind::angle;
        segment.wheel[j].push_back(angle   ? now[j]
                                   : first ? 0.0
                                           : segment.wheel[j].back() + 0.5 * (t - before) * (now[j] + motion[j]));
      }
      if (!first && m.motion == MotionKind::angle) {
        wheel_steps.push_back(now[0] - motion[0]);
      }
      segment.heading.push_back(first ? theta_now
                                      : segment.heading.back() + std::remainder(theta_now - theta_before, kWholeTurn));
      segment.t.push_back(t);
    }
    if (starts) {
      restart(t);
    } else {
      const double h = t - before;
      double along = 0.0;
      for (std::size_t j = 0; j < 2; ++j) {
        const bool angle = m.motion == MotionKind::angle;
        const std::array<double, 3> steps = {angle ? now[j] - motion[j] : h * 0.5 * (now[j] + motion[j]),
                                             angle ? now[j] - motion[j] : h * motion[j],
                                             angle ? now[j] - motion[j] : h * now[j]};
        for (std::size_t rule = 0; rule < 3; ++rule) {
          turned[rule][j] += steps[rule];
        }
        along += steps[0];
      }
      heading += std::remainder(theta_now - theta_before, kWholeTurn);
      way += std::copysign(std::hypot(x_now - x_before, y_now - y_before), along);
      if (t - begin >= window) {
        for (std::size_t rule = 0; rule < 3; ++rule) {
          headings[rule].add(turned[rule][0], turned[rule][1], heading);
          ways[rule].add(turned[rule][0], turned[rule][1], way);
        }
        restart(t);
      }
    }
    before = t;
    motion = now;
    theta_before = theta_now;
    x_before = x_now;
    y_before = y_now;
  });
  const auto least = [](const std::array<Combination, 3>& fits) {
    std::optional<double> best;
    for (const Combination& fit : fits) {
      if (const auto rest = fit.rest(); rest && (!best || *rest < *best)) {
        best = rest;
      }
    }
    return best;
  };
  if (const auto rest = m.held_pose ? std::nullopt : least(headings)) {
    origin.heading_rest = *rest;
    const double count = m.count > 0.0                   ? m.count * m.nominal_step
                         : robot.encoder_counts_per_turn ? kWholeTurn / *robot.encoder_counts_per_turn
                                                         : 0.0;
    // Half a count at both ends of a window and both wheels, times a gain that is about a third: an independent
    // heading.
    const double by_counts = count / (3.0 * std::sqrt(3.0));
    const double rounding = decimals.quantum() / std::sqrt(6.0);
    origin.heading_repeats =
        *rest < kExactHeading || (*rest <= kOfTheRounding * rounding && *rest < kOfTheCounts * by_counts);
  }
  std::string by_stamps;
  if (!origin.heading_repeats) {
    if (const auto rest = between_rests(kept); rest && *rest < kExactHeading) {
      origin.heading_rest = *rest;
      by_stamps = "from one rest to the next";
    } else if (const auto linear =
                   within_interpolation(kept, window, m.nominal_step, rounding_of(wheel_steps), decimals.quantum());
               linear && !m.held_pose && (linear->decided || robot.pose_source != model::PoseSource::independent)) {
      origin.heading_rest = linear->rest;
      origin.undecided = !linear->decided;
      by_stamps = fmt::format("over {:.3g} s, no more than lines between the samples of a pose that repeats the wheels",
                              window);
    }
    origin.heading_repeats = !by_stamps.empty();
  }
  if (const auto rest = m.position && !m.held_pose ? least(ways) : std::nullopt) {
    origin.position_rest = *rest;
    origin.position_repeats = *rest < kExactWay;
  }
  origin.position_repeats = origin.position_repeats || (m.position && origin.heading_repeats);
  if (origin.undecided) {
    origin.sentence = fmt::format(
        "{} cannot be told from wheel odometry, and is not taken for a measurement of its own: a combination of the "
        "wheel angles leaves {:.2g} rad of the heading over {:.3g} s, no more than lines between the samples of a pose "
        "that repeats the wheels; if it is measured (camera, lidar, motion capture), write pose_source: independent in "
        "the robot file",
        m.position ? "the pose" : "the heading", origin.heading_rest, window);
  } else if (!by_stamps.empty()) {
    origin.sentence = fmt::format(
        "{} wheel odometry over again, not measured independently: a combination of the wheel angles leaves {:.2g} rad "
        "of the heading {}",
        m.position ? "the pose is" : "the heading is", origin.heading_rest, by_stamps);
  } else if (origin.heading_repeats) {
    origin.sentence = fmt::format(
        "{} wheel odometry over again, not measured independently: a combination of the wheel angles leaves {:.2g} rad "
        "of "
        "the heading over {:.3g} s, less than any sensor of its own would",
        m.position ? "the pose is" : "the heading is", origin.heading_rest, window);
  } else if (origin.position_repeats) {
    origin.sentence = fmt::format(
        "x and y are wheel odometry over again, not measured independently: the wheel angles leave {:.2g} m of the way "
        "over {:.3g} s, less than any sensor of its own would",
        origin.position_rest, window);
  }
  return origin;
}

}  // namespace wheelwright::commission
