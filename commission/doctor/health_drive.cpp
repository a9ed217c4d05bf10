// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "commission/doctor/log_health.hpp"
#include "core/interleaved.hpp"
#include "core/words.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kDriveWindow = 1.0;      // s
constexpr double kDriveRows = 40.0;       // rows of a window at least, four times what a smooth speed takes in
constexpr std::size_t kDriveFewest = 20;  // windows
constexpr double kLatest = 0.5;           // s that a gyro or pose may lag or lead: no matter of this check
constexpr double kShift = 0.05;           // s
constexpr double kOutliers = 0.05;        // of the windows, that a pose which jumps may spoil
constexpr double kTurnsAtAll = 0.05;      // rad in a window, root mean square
constexpr double kOverCounts = 3.0;       // turning against that of a count of one wheel
constexpr double kTurnedByWheels = 0.6;   // of the turning: a lag of a tenth of a period and slip of a half leave more
constexpr double kNoiseAlone = -0.2;      // correlation of neighbouring windows: that of noise at their ends is -0.5
constexpr double kSideways = 0.1;         // of the squared displacement
constexpr double kAnotherWay = 0.02;      // of the squared displacement, that the wheels' motion does not explain
constexpr double kLeastInertia = 0.1;     // of m (D/2)²: bodies between their wheels have 0.5 to 3
constexpr double kClearMass = 10.0;       // standard errors
constexpr double kAboveNoise = 3.0;       // change over a window against that over a smooth speed's rows

// Rows [first, last] of one segment, about `length` s apart.
struct DriveWindow {
  std::size_t first = 0, last = 0, segment_first = 0, segment_last = 0;
};

std::vector<DriveWindow> drive_windows(const HealthView& view, double length) {
  const std::vector<double>& t = view.log->t;
  std::vector<DriveWindow> out;
  for (const auto& [first, last] : view.segments) {
    std::size_t a = first;
    for (std::size_t b = first; b < last; ++b) {
      if (t[b] - t[a] >= length) {
        out.push_back({a, b, first, last - 1});
        a = b;
      }
    }
  }
  return out;
}

// ∫ of a rate from the first row on, over gaps too.
std::vector<double> summed(const std::vector<double>& t, const std::vector<double>& rate) {
  std::vector<double> out(t.size(), 0.0);
  for (std::size_t k = 1; k < t.size(); ++k) {
    const double h = t[k] - t[k - 1];
    out[k] = out[k - 1] + (h > 0.0 && h < kDriveWindow ? 0.5 * (rate[k] + rate[k - 1]) * h : 0.0);
  }
  return out;
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) {
    sum += v * v;
  }
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

void centre(std::vector<double>& values) {
  double mean = 0.0;
  for (const double v : values) {
    mean += v / static_cast<double>(values.size());
  }
  for (double& v : values) {
    v -= mean;
  }
}

// Of neighbours; 0 where there is nothing to correlate.
double neighbours_correlation(const std::vector<double>& values) {
  double own = 0.0, next = 0.0;
  for (std::size_t k = 1; k < values.size(); ++k) {
    own += 0.5 * (values[k] * values[k] + values[k - 1] * values[k - 1]);
    next += values[k] * values[k - 1];
  }
  return own > 0.0 ? next / own : 0.0;
}

// Least squares with what it leaves; the share `spared` of the rows that it leaves most of is left out once.
struct DriveFit {
  Eigen::VectorXd coefficients, errors;  // and standard errors
  std::vector<double> rest;              // of the rows that stay
  double explained = 0.0;                // of their variation
};

std::optional<DriveFit> fit_rows(Eigen::MatrixXd A, Eigen::VectorXd b, double spared) {
  DriveFit fit;
  for (const bool once : {true, false}) {
    if (A.rows() < A.cols() + 3) {
      return std::nullopt;
    }
    const Eigen::MatrixXd gram = A.transpose() * A;
    const Eigen::MatrixXd inverse =
        (gram + 1e-9 * gram.trace() * Eigen::MatrixXd::Identity(A.cols(), A.cols())).inverse();
    fit.coefficients = inverse * (A.transpose() * b);
    const Eigen::VectorXd rest = b - A * fit.coefficients;
    if (once && spared > 0.0) {
      std::vector<double> sizes(static_cast<std::size_t>(rest.size()));
      Eigen::VectorXd::Map(sizes.data(), rest.size()) = rest.cwiseAbs();
      const std::size_t keep = sizes.size() - static_cast<std::size_t>(spared * static_cast<double>(sizes.size()));
      std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(keep) - 1);
      const double most = sizes[keep - 1];
      Eigen::Index kept = 0;
      for (Eigen::Index i = 0; i < rest.size(); ++i) {
        if (std::abs(rest[i]) <= most) {
          A.row(kept) = Eigen::RowVectorXd(A.row(i));
          b[kept++] = b[i];
        }
      }
      A.conservativeResize(kept, Eigen::NoChange);
      b.conservativeResize(kept);
      continue;
    }
    const double variance = rest.squaredNorm() / static_cast<double>(A.rows() - A.cols());
    fit.errors = (variance * inverse.diagonal().array().max(0.0)).sqrt();
    fit.rest.assign(rest.data(), rest.data() + rest.size());
    const double varies = (b.array() - b.mean()).square().sum();
    fit.explained = varies > 0.0 ? 1.0 - rest.squaredNorm() / varies : 0.0;
    break;
  }
  return fit;
}

// Angles that the wheels have turned by, from the log's first row on.
struct WheelTurns {
  std::vector<double> right, left;
};

WheelTurns wheel_turns(const HealthView& view) {
  const auto of = [&](const JointView& j) { return j.angle != nullptr ? *j.angle : summed(view.log->t, *j.speed); };
  return {of(view.joints[0]), of(view.joints[1])};
}

// A count of the wheels' encoders, rad: the smallest step of their angles.
double count_of(const HealthView& view) {
  double count = 0.0;
  for (const JointView& j : view.joints) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 1; k < view.log->rows(); ++k) {
      const double step = std::abs(j.angle != nullptr ? (*j.angle)[k] - (*j.angle)[k - 1] : (*j.speed)[k] * view.step);
      least = step > 1e-9 ? std::min(least, step) : least;
    }
    count = std::max(count, std::isfinite(least) ? least : 0.0);
  }
  return count;
}

double value_at(const std::vector<double>& t, const std::vector<double>& values, const DriveWindow& w, double time) {
  const auto begin = t.begin() + static_cast<std::ptrdiff_t>(w.segment_first),
             end = t.begin() + static_cast<std::ptrdiff_t>(w.segment_last) + 1;
  auto next = std::lower_bound(begin, end, time);
  next = next == end ? end - 1 : next;
  const auto k = static_cast<std::size_t>(next - t.begin());
  if (k == w.segment_first || t[k] <= time) {
    return values[k];
  }
  const double share = (time - t[k - 1]) / (t[k] - t[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}

// The share of the turning in `heading` (rad, as a sum) that the wheels explain at the best lag; nothing where the log
// does not turn, or its heading is noise.
std::optional<double> turned_by_wheels(const HealthView& view, const WheelTurns& wheels,
                                       const std::vector<double>& heading) {
  const std::vector<double>& t = view.log->t;
  const std::vector<DriveWindow> windows = drive_windows(view, kDriveWindow);
  std::optional<double> best;
  std::vector<double> here;
  for (const DriveWindow& w : windows) {
    here.push_back(heading[w.last] - heading[w.first]);
  }
  if (windows.size() < kDriveFewest) {
    return std::nullopt;
  }
  centre(here);
  const double counted = kOverCounts * count_of(view) * view.robot.wheel_radius / view.robot.track_width;
  if (rms(here) < std::max(kTurnsAtAll, counted) || neighbours_correlation(here) < kNoiseAlone) {
    return std::nullopt;
  }
  for (double shift = -kLatest; shift < kLatest + 0.5 * kShift; shift += kShift) {
    const auto n = static_cast<Eigen::Index>(windows.size());
    Eigen::MatrixXd A(n, 3);
    Eigen::VectorXd b(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const DriveWindow& w = windows[static_cast<std::size_t>(i)];
      A(i, 0) = wheels.right[w.last] - wheels.right[w.first];
      A(i, 1) = wheels.left[w.last] - wheels.left[w.first];
      A(i, 2) = t[w.last] - t[w.first];
      b[i] = value_at(t, heading, w, t[w.last] + shift) - value_at(t, heading, w, t[w.first] + shift);
    }
    if (const auto fit = fit_rows(A, b, kOutliers); fit && (!best || fit->explained > *best)) {
      best = fit->explained;
    }
  }
  return best;
}

void tell_turning(const HealthView& view, const WheelTurns& wheels, std::vector<std::string>& evidence) {
  const std::vector<double>*theta = view.column("theta"), *gyro = view.column("gyro_z");
  std::string worst;
  double share = 1.0;
  bool fits = false;
  const auto look = [&](const char* name, const std::vector<double>& heading) {
    const std::optional<double> explained = turned_by_wheels(view, wheels, heading);
    if (explained) {
      fits = fits || *explained > kTurnedByWheels;
      if (*explained < share) {
        share = *explained;
        worst = name;
      }
    }
  };
  if (theta != nullptr) {
    look("theta", *theta);
  }
  if (gyro != nullptr) {
    look("gyro_z", summed(view.log->t, *gyro));
  }
  if (!fits && !worst.empty() && share < kTurnedByWheels) {
    evidence.push_back(
        fmt::format("the body does not turn as (omega_r - omega_l) r/D says: the wheels explain {:.0f} % of the "
                    "turning in {} at the "
                    "best lag up to {} s (or {} is of another axis or body)",
                    100.0 * std::max(share, 0.0), worst, kLatest, worst));
  }
}

// Displacements across the heading that neither a constant angle of the pose's body nor its place explains.
void tell_sideways(const HealthView& view, const WheelTurns& wheels, std::vector<std::string>& evidence) {
  const std::vector<double>*x = view.column("x"), *y = view.column("y"), *theta = view.column("theta");
  const std::vector<DriveWindow> windows = drive_windows(view, kDriveWindow);
  if (x == nullptr || y == nullptr || theta == nullptr || windows.size() < kDriveFewest) {
    return;
  }
  std::vector<std::complex<double>> moved;
  std::complex<double> axis = 0.0;
  double both = 0.0, of_pose = 0.0, of_wheels = 0.0;
  for (const DriveWindow& w : windows) {
    std::complex<double> way = 0.0;
    for (std::size_t k = w.first + 1; k <= w.last; ++k) {
      const double heading = 0.5 * ((*theta)[k] + (*theta)[k - 1]);
      way += std::complex<double>((*x)[k] - (*x)[k - 1], (*y)[k] - (*y)[k - 1]) * std::polar(1.0, -heading);
    }
    const double rolled =
        0.5 * std::abs(wheels.right[w.last] - wheels.right[w.first] + wheels.left[w.last] - wheels.left[w.first]);
    moved.push_back(way);
    axis += way * way;
    both += std::abs(way) * rolled;
    of_pose += std::norm(way);
    of_wheels += rolled * rolled;
  }
  const auto n = static_cast<Eigen::Index>(windows.size());
  Eigen::MatrixXd A(n, 1);
  Eigen::VectorXd b(n);
  const std::complex<double> ahead = std::polar(1.0, -0.5 * std::arg(axis));
  for (Eigen::Index i = 0; i < n; ++i) {
    const DriveWindow& w = windows[static_cast<std::size_t>(i)];
    A(i, 0) = (*theta)[w.last] - (*theta)[w.first];
    b[i] = (moved[static_cast<std::size_t>(i)] * ahead).imag();
  }
  const std::optional<DriveFit> fit = fit_rows(A, b, kOutliers);
  if (!fit || !(of_pose > 0.0) || !(of_wheels > 0.0)) {
    return;
  }
  const double across = std::pow(rms(fit->rest), 2) * static_cast<double>(n) / of_pose;
  const double unlike = 1.0 - both * both / of_pose / of_wheels;
  if (across > kSideways && unlike > kAnotherWay && neighbours_correlation(fit->rest) > kNoiseAlone) {
    evidence.push_back(fmt::format(
        "the body moves sideways: {:.0f} % of its way (root mean square over seconds, {:.3g} m of {:.3g} m) is across "
        "its heading, in excess of what the wheels roll",
        100.0 * std::sqrt(across), rms(fit->rest), std::sqrt(of_pose / static_cast<double>(n))));
  }
}

// Turning that no difference of efforts makes: the body is steered.
void tell_effortless_turns(const HealthView& view, std::vector<std::string>& evidence) {
  const JointView &right = view.joints[0], &left = view.joints[1];
  if (!view.has_effort() || view.robot.effort_unsigned || view.robot.effort == model::EffortKind::voltage ||
      *right.effort == *left.effort || right.smooth.empty() || left.smooth.empty()) {
    return;
  }
  const std::vector<double>& t = view.log->t;
  const double length = std::max(kDriveWindow, kDriveRows * view.step);
  const std::vector<DriveWindow> windows = drive_windows(view, length);
  if (windows.size() < kDriveFewest) {
    return;
  }
  const auto n = static_cast<Eigen::Index>(windows.size());
  Eigen::MatrixXd A(n, 3);
  Eigen::VectorXd b(n);
  std::vector<double> turn, difference, short_turn;
  for (Eigen::Index i = 0; i < n; ++i) {
    const DriveWindow& w = windows[static_cast<std::size_t>(i)];
    double sum = 0.0, apart = 0.0, way = 0.0, sign = 0.0;
    for (std::size_t k = w.first + 1; k <= w.last; ++k) {
      const double h = t[k] - t[k - 1];
      sum += 0.5 * h * ((*right.effort)[k] + (*right.effort)[k - 1] + (*left.effort)[k] + (*left.effort)[k - 1]);
      apart += 0.5 * h * ((*right.effort)[k] + (*right.effort)[k - 1] - (*left.effort)[k] - (*left.effort)[k - 1]);
      const double speed = 0.5 * (right.smooth[k] + left.smooth[k]);
      way += h * speed;
      sign += h * (speed > 0.0 ? 1.0 : speed < 0.0 ? -1.0 : 0.0);
    }
    const auto mean = [&](std::size_t k) { return 0.5 * (right.smooth[k] + left.smooth[k]); };
    const auto half = [&](std::size_t k) { return 0.5 * (right.smooth[k] - left.smooth[k]); };
    A.row(i) << mean(w.last) - mean(w.first), way, sign;
    b[i] = sum;
    turn.push_back(half(w.last) - half(w.first));
    difference.push_back(apart);
    if (w.last - w.first > 10) {
      short_turn.push_back(half(w.first + 10) - half(w.first));
    }
  }
  const std::optional<DriveFit> fit = fit_rows(A, b, 0.0);
  if (!fit || !(fit->coefficients[0] > kClearMass * fit->errors[0]) || fit->explained < 0.5) {
    return;
  }
  centre(difference);
  const double needed = kLeastInertia * fit->coefficients[0] * rms(turn), made = rms(difference);
  if (made < needed && rms(turn) > kAboveNoise * rms(short_turn)) {
    const char* const unit = view.robot.effort == model::EffortKind::torque ? "N·m" : "A";
    evidence.push_back(fmt::format(
        "the body turns without a difference of the wheels' efforts: {} - {} varies by {:.2g} {} (root mean square "
        "over "
        "{:.2g} s), where its turning takes at least {:.2g} {}, for a tenth of the inertia that mass at the wheels has",
        right.effort_name, left.effort_name, made / length, unit, length, needed / length, unit));
  }
}

}  // namespace

void check_sources(const HealthView& view, std::vector<LogFinding>& findings) {
  std::vector<const std::vector<double>*> columns;
  std::vector<std::string> names;
  for (const JointView& j : view.joints) {
    for (const auto& [column, name] :
         {std::pair(j.angle, &j.angle_name), {j.speed, &j.speed_name}, {j.effort, &j.effort_name}}) {
      columns.push_back(column);
      names.push_back(*name);
    }
  }
  const core::InterleavedRows other = core::interleaved_rows(columns);
  if (other.rows.empty()) {
    return;
  }
  const std::vector<double>& example = *columns[other.column];
  const std::size_t first = other.rows.front();
  const double share = static_cast<double>(other.rows.size()) / static_cast<double>(view.log->rows());
  const std::string& name = names[other.column];
  LogFinding f{.id = "signals.two_sources", .topic = FindingTopic::signals, .severity = FindingSeverity::fatal};
  f.sentence =
      other.constant
          ? fmt::format(
                "{} rows ({:.2g} %) hold the same numbers ({} = {:.4g}) between rows that move: they come from "
                "a second source.",
                other.rows.size(), 100.0 * share, name, example[first])
          : fmt::format(
                "{} rows ({:.2g} %) go to other numbers and back ({} from {:.4g} to {:.4g}): rows of two "
                "sources alternate.",
                other.rows.size(), 100.0 * share, name, example[first > 0 ? first - 1 : first + 1], example[first]);
  f.next =
      "Two publishers on one topic? `ros2 topic info -v TOPIC` names them: record one of them, or take the rows of "
      "the other out of the log.";
  f.columns = {name};
  f.value = share;
  f.unit = "1";
  f.refuses = true;
  std::vector<bool> flagged(view.log->rows(), false);
  for (const std::size_t row : other.rows) {
    flagged[row] = true;
  }
  set_stretches(f, view, flagged, 0.0);
  findings.push_back(std::move(f));
}

void check_drive(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings) {
  if (!model::on_two_wheels(view.robot)) {
    return;
  }
  std::vector<std::string> evidence = reader.contradictions;
  if (view.joints.size() == 2 && view.has_motion()) {
    const WheelTurns wheels = wheel_turns(view);
    tell_turning(view, wheels, evidence);
    tell_sideways(view, wheels, evidence);
    tell_effortless_turns(view, evidence);
  }
  if (evidence.empty()) {
    return;
  }
  LogFinding f{
      .id = "motion.not_differential_drive", .topic = FindingTopic::motion, .severity = FindingSeverity::fatal};
  f.sentence = fmt::format("The robot does not drive as a differential drive: {}.", core::listed(evidence, "; "));
  f.next =
      "Its model does not hold for cars, mecanum and omnidirectional wheels, or wheels that steer. Where these are "
      "other joints or sensors than the drive's, --map NAME=COLUMN takes the right ones.";
  f.value = static_cast<double>(evidence.size());
  f.unit = "1";
  f.refuses = true;
  findings.push_back(std::move(f));
}

}  // namespace wheelwright::doctor
