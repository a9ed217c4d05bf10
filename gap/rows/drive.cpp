// SPDX-License-Identifier: Apache-2.0
#include "gap/rows/drive.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>

#include <Eigen/Core>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "model/filter/encoder.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kUneven = 0.01;        // share of the median step
constexpr double kRestSpeed = 0.01;     // of the root mean square of the speed
constexpr double kCoarse = 0.2;         // likewise: a count a step that is no slower than this is no rest
constexpr double kCountedRest = 0.05;   // likewise, of an encoder of which a count in the shortest rest is faster
constexpr std::size_t kFewestRows = 3;  // of a segment

using Series = std::vector<double>;

// The columns that are used, each as one signal; empty where the log has none.
struct Columns {
  std::vector<Series> motion, effort;
  Series heading, x, y, gyro;

  template <typename Function>
  void for_each(const Function& function) {
    for (auto* group : {&motion, &effort}) {
      for (Series& signal : *group) {
        function(signal);
      }
    }
    for (Series* signal : {&heading, &x, &y, &gyro}) {
      if (!signal->empty()) {
        function(*signal);
      }
    }
  }
};

Series optional_column(const LogTable& log, std::string_view name) {
  const std::vector<double>* const found = log.find(name);
  return found == nullptr ? Series{} : *found;
}

Columns take(const LogTable& log, const Measurement& measurement) {
  Columns columns;
  for (const std::string& name : measurement.motion_columns) {
    columns.motion.push_back(log.column(name));
  }
  for (const std::string& name : measurement.effort_columns) {
    columns.effort.push_back(log.column(name));
  }
  columns.heading = optional_column(log, "theta");
  columns.x = optional_column(log, "x");
  columns.y = optional_column(log, "y");
  columns.gyro = optional_column(log, "gyro_z");
  if (columns.x.empty() || columns.y.empty()) {
    columns.x.clear();
    columns.y.clear();
  }
  return columns;
}

Series part(const Series& signal, std::size_t first, std::size_t last) {
  return signal.empty() ? Series{}
                        : Series(signal.begin() + static_cast<std::ptrdiff_t>(first),
                                 signal.begin() + static_cast<std::ptrdiff_t>(last));
}

Columns part(const Columns& all, std::size_t first, std::size_t last) {
  Columns columns;
  for (const Series& signal : all.motion) columns.motion.push_back(part(signal, first, last));
  for (const Series& signal : all.effort) columns.effort.push_back(part(signal, first, last));
  columns.heading = part(all.heading, first, last);
  columns.x = part(all.x, first, last);
  columns.y = part(all.y, first, last);
  columns.gyro = part(all.gyro, first, last);
  return columns;
}

void unwrap(Series& angle) {
  double turns = 0.0;
  double before = angle.empty() ? 0.0 : angle.front();
  for (double& value : angle) {
    const double now = value;
    turns -= std::round((now - before) / (2.0 * std::numbers::pi));
    value = now + 2.0 * std::numbers::pi * turns;
    before = now;
  }
}

// Angles at the samples become mean speeds between them; everything else its mean between them.
void to_middles(Series& t, Columns& columns, std::vector<Series>& angle, bool held) {
  const std::size_t n = t.size() - 1;
  for (std::size_t j = 0; j < columns.motion.size(); ++j) {
    Series& motion = columns.motion[j];
    angle.push_back(Series(n));
    for (std::size_t k = 0; k < n; ++k) {
      angle[j][k] = 0.5 * (motion[k] + motion[k + 1]);
      motion[k] = (motion[k + 1] - motion[k]) / (t[k + 1] - t[k]);
    }
    motion.pop_back();
  }
  const auto mean = [n](Series& signal) {
    for (std::size_t k = 0; k < n; ++k) {
      signal[k] = 0.5 * (signal[k] + signal[k + 1]);
    }
    signal.pop_back();
  };
  for (Series& effort : columns.effort) {
    if (held) {
      effort.pop_back();
    } else {
      mean(effort);
    }
  }
  for (Series* signal : {&columns.heading, &columns.x, &columns.y, &columns.gyro}) {
    if (!signal->empty()) {
      mean(*signal);
    }
  }
  mean(t);
}

void resample(Series& t, Columns& columns, std::vector<Series>& angle, double step, bool hold_effort) {
  const auto n = static_cast<std::size_t>(std::floor((t.back() - t.front()) / step + 1e-9)) + 1;
  std::vector<std::size_t> before(n);
  Series share(n);
  Series even(n);
  for (std::size_t k = 0, i = 0; k < n; ++k) {
    even[k] = t.front() + static_cast<double>(k) * step;
    while (i + 2 < t.size() && t[i + 1] <= even[k]) {
      ++i;
    }
    before[k] = i;
    share[k] = std::clamp((even[k] - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0);
  }
  const auto linear = [&](Series& signal) {
    Series result(n);
    for (std::size_t k = 0; k < n; ++k) {
      result[k] = signal[before[k]] + share[k] * (signal[before[k] + 1] - signal[before[k]]);
    }
    signal = std::move(result);
  };
  const auto held = [&](Series& signal) {
    Series result(n);
    for (std::size_t k = 0; k < n; ++k) {
      result[k] = signal[before[k] + (share[k] >= 1.0 ? 1 : 0)];
    }
    signal = std::move(result);
  };
  if (hold_effort) {
    std::vector<Series> efforts = std::exchange(columns.effort, {});
    columns.for_each(linear);
    std::ranges::for_each(efforts, held);
    columns.effort = std::move(efforts);
  } else {
    columns.for_each(linear);
  }
  std::ranges::for_each(angle, linear);
  t = std::move(even);
}

void append(Eigen::VectorXd& to, const Series& signal) {
  const Eigen::Index before = to.size();
  to.conservativeResize(before + static_cast<Eigen::Index>(signal.size()));
  to.tail(static_cast<Eigen::Index>(signal.size())) =
      Eigen::Map<const Eigen::VectorXd>(signal.data(), static_cast<Eigen::Index>(signal.size()));
}

Series integral(const Series& speed, double step) {
  Series sum(speed.size(), 0.0);
  for (std::size_t k = 1; k < speed.size(); ++k) {
    sum[k] = sum[k - 1] + 0.5 * step * (speed[k - 1] + speed[k]);
  }
  return sum;
}

Series means_of_neighbours(const Series& held) {
  Series mean = held;
  for (std::size_t k = 1; k < held.size(); ++k) {
    mean[k] = 0.5 * (held[k - 1] + held[k]);
  }
  return mean;
}

std::span<const double> view(const Eigen::VectorXd& x, Eigen::Index first, Eigen::Index last) {
  return {x.data() + first, static_cast<std::size_t>(last - first)};
}
std::span<double> view(Eigen::VectorXd& x, Eigen::Index first, Eigen::Index last) {
  return {x.data() + first, static_cast<std::size_t>(last - first)};
}

// Standard deviation of white noise on a smooth signal: of its third differences (variance 20 σ²), by their median.
double noise_by_differences(const Eigen::VectorXd& x) {
  if (x.size() < 8) {
    return 0.0;
  }
  Series magnitude;
  for (Eigen::Index k = 3; k < x.size(); ++k) {
    magnitude.push_back(std::abs(x[k] - 3.0 * x[k - 1] + 3.0 * x[k - 2] - x[k - 3]));
  }
  return core::median(std::move(magnitude)) / (0.6744897501960817 * std::sqrt(20.0));
}

// An encoder that stands still shows the two sides of a count at most: a joint rests where its angle stays within
// `count` (rad) for `shortest` s, or longer where a count in that time would be fast for it.
Mask find_counted_rest(const Drive& drive, const JointSignals& joint, double count, double shortest, double rms) {
  const double longest = rms > 0.0 ? count / (kCountedRest * rms) : shortest;
  const auto fewest = static_cast<Eigen::Index>(std::ceil(std::max(shortest, longest) / drive.step - 1e-9));
  constexpr double slack = 1.0 + 1e-6;
  Mask rest = Mask::Constant(joint.speed.size(), false);
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    std::deque<std::pair<Eigen::Index, double>> low, high;  // of the window [from, k]: falling and rising bounds
    double angle = 0.0;
    Eigen::Index from = first, marked = first;
    for (Eigen::Index k = first; k < last; ++k) {
      angle += joint.speed[k] * drive.step;
      while (!low.empty() && low.back().second >= angle) low.pop_back();
      while (!high.empty() && high.back().second <= angle) high.pop_back();
      low.emplace_back(k, angle);
      high.emplace_back(k, angle);
      while (high.front().second - low.front().second > count * slack) {
        ++from;
        if (low.front().first < from) low.pop_front();
        if (high.front().first < from) high.pop_front();
      }
      if (k + 1 - from >= fewest) {
        const Eigen::Index begin = std::max(from, marked);
        rest.segment(begin, k + 1 - begin).setConstant(true);
        marked = k + 1;
      }
    }
  }
  return rest;
}

// One count of the angles in `columns[joint]`, rad; 0 where they are not made of counts.
double count_of_angles(const std::vector<double>& angle, const std::vector<std::size_t>& starts) {
  std::vector<double> steps;
  for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
    for (std::size_t k = starts[s] + 1; k < starts[s + 1]; ++k) {
      steps.push_back(angle[k] - angle[k - 1]);
    }
  }
  const auto encoder = filter::find_encoder_of_angles(steps);
  return encoder ? encoder->speed_step : 0.0;
}

// `count` is that of the joint's encoder, rad; 0 where none is known.
Mask find_rest(const Drive& drive, const JointSignals& joint, double shortest, double count) {
  const Eigen::Index n = joint.speed.size();
  const double rms = std::sqrt(joint.smooth_speed.squaredNorm() / static_cast<double>(n));
  if (count > kCoarse * rms * drive.step) {
    return find_counted_rest(drive, joint, count, shortest, rms);
  }
  // The value of the quadratic at the middle of w samples has the variance 9/(4w) σ².
  const double noise = noise_by_differences(joint.speed) * std::sqrt(2.25 / static_cast<double>(drive.window));
  const double limit = std::max({drive.count, 4.0 * noise, kRestSpeed * rms});
  const auto fewest = static_cast<Eigen::Index>(std::ceil(shortest / drive.step));
  Mask rest = joint.smooth_speed.array().abs() <= limit;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first; k < last;) {
      Eigen::Index end = k;
      while (end < last && rest[end]) {
        ++end;
      }
      if (end - k < fewest) {
        rest.segment(k, end - k).setConstant(false);
      }
      k = std::max(end, k + 1);
    }
  }
  return rest;
}

Eigen::VectorXd combined(const Eigen::MatrixXd& matrix, Eigen::Index row, const std::vector<JointSignals>& joints,
                         Eigen::VectorXd JointSignals::*signal) {
  Eigen::VectorXd sum = matrix(row, 0) * (joints[0].*signal);
  for (std::size_t j = 1; j < joints.size(); ++j) {
    sum += matrix(row, static_cast<Eigen::Index>(j)) * (joints[j].*signal);
  }
  return sum;
}

void smooth_signal(const Drive& drive, const Eigen::VectorXd& signal, Eigen::VectorXd& value, Eigen::VectorXd& slope) {
  value.resize(signal.size());
  slope.resize(signal.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    smooth_quadratic(view(signal, first, last), drive.window, view(value, first, last), view(slope, first, last));
  }
}

void smooth_joint(const Drive& drive, JointSignals& joint) {
  smooth_signal(drive, joint.speed, joint.smooth_speed, joint.smooth_acceleration);
  joint.smooth_acceleration /= drive.step;
  Eigen::VectorXd unused;
  smooth_signal(drive, joint.effort, joint.smooth_effort, unused);
}

void append_segment(Drive& drive, Series t, Columns columns, const Measurement& measurement) {
  const bool angles = measurement.motion == MotionKind::angle;
  const bool held = measurement.hold == Hold::zero_order;
  const std::size_t rows = t.size();
  if (measurement.effort_unsigned) {
    for (std::size_t j = 0; j < columns.effort.size(); ++j) {
      const Series& motion = columns.motion[j];
      for (std::size_t k = 0; k < rows; ++k) {
        const double direction = angles ? (k > 0 ? motion[k] - motion[k - 1] : 0.0) : motion[k];
        columns.effort[j][k] = std::abs(columns.effort[j][k]) * core::sign(direction);
      }
    }
  }
  if (measurement.count > 0.0) {
    for (Series& motion : columns.motion) {
      for (double& value : motion) {
        value = std::round(value / measurement.count) * measurement.count;
      }
    }
  }
  unwrap(columns.heading);
  std::vector<Series> angle;
  if (angles) {
    to_middles(t, columns, angle, held);
  }
  bool uneven = false;
  for (std::size_t k = 1; k < t.size(); ++k) {
    uneven = uneven || std::abs(t[k] - t[k - 1] - drive.step) > kUneven * drive.step;
  }
  if (uneven) {
    resample(t, columns, angle, drive.step, held && !angles);
    drive.resampled += rows;
  }
  drive.segment_starts.push_back(static_cast<std::size_t>(drive.rows()));
  if (drive.rows() > 0 && t.front() <= drive.t[drive.rows() - 1]) {
    const double shift = drive.t[drive.rows() - 1] + drive.step - t.front();
    std::ranges::for_each(t, [shift](double& value) { value += shift; });
    ++drive.moved_segments;
  }
  append(drive.t, t);
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    JointSignals& joint = drive.joints[j];
    append(joint.speed, columns.motion[j]);
    append(joint.angle, angles ? angle[j] : integral(columns.motion[j], drive.step));
    if (held && !angles) {
      append(joint.held_effort, columns.effort[j]);
      append(joint.effort, means_of_neighbours(columns.effort[j]));
    } else {
      append(joint.effort, columns.effort[j]);
    }
  }
  append(drive.heading, columns.heading);
  append(drive.x, columns.x);
  append(drive.y, columns.y);
  append(drive.gyro, columns.gyro);
}

double base_term(const Drive& drive, const Term& term, Eigen::Index k, double heading, std::vector<double>& speed,
                 std::vector<double>& joint, const std::vector<double>& zeros) {
  const CoordinateSignals& coordinate = drive.coordinates[term.coordinate];
  switch (term.kind) {
    case Term::Kind::acceleration: return coordinate.smooth_acceleration[k];
    case Term::Kind::speed: return coordinate.smooth_speed[k];
    case Term::Kind::function: break;
  }
  for (std::size_t c = 0; c < speed.size(); ++c) speed[c] = drive.coordinates[c].smooth_speed[k];
  for (std::size_t j = 0; j < joint.size(); ++j) joint[j] = drive.joints[j].smooth_speed[k];
  return term
      .function(
          {speed, std::span(zeros).first(speed.size()), joint, std::span(zeros).first(joint.size()), heading, 0.0})
      .value;
}

}  // namespace

std::pair<Eigen::Index, Eigen::Index> Drive::segment(std::size_t k) const {
  const auto last = k + 1 < segment_starts.size() ? static_cast<Eigen::Index>(segment_starts[k + 1]) : rows();
  return {static_cast<Eigen::Index>(segment_starts[k]), last};
}

double Drive::physical(std::string_view name) const {
  for (std::size_t j = 0; j < model.parameters.size() && theta.size() > 0; ++j) {
    if (model.parameters[j].physical == name) {
      return theta[static_cast<Eigen::Index>(j)] / model.parameters[j].per_physical;
    }
  }
  return 0.0;
}

Eigen::VectorXd heading_or_odometry(const Drive& drive) {
  if (drive.has_heading()) {
    return drive.heading;
  }
  Eigen::VectorXd heading = Eigen::VectorXd::Zero(drive.rows());
  if (drive.model.heading_coordinate < 0) {
    return heading;
  }
  const Eigen::VectorXd& rate = drive.coordinates[static_cast<std::size_t>(drive.model.heading_coordinate)].speed;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 1; k < last; ++k) {
      heading[k] = heading[k - 1] + 0.5 * drive.step * (rate[k - 1] + rate[k]);
    }
  }
  return heading;
}

void smooth_quadratic(std::span<const double> signal, std::size_t window, std::span<double> value,
                      std::span<double> slope) {
  check::that(window % 2 == 1, "smooth_quadratic window", "an odd number of samples");
  const std::size_t n = signal.size();
  check::that(value.size() == n && slope.size() == n, "smooth_quadratic", "signals of equal length");
  const std::size_t width = std::min(window, n % 2 == 1 ? n : n - (n > 0 ? 1 : 0));
  if (width < 3) {
    std::ranges::copy(signal, value.begin());
    std::ranges::fill(slope, 0.0);
    return;
  }
  // On −m … m the quadratic's coefficients are moments over S2 = Σ i², S4 = Σ i⁴.
  const auto m = static_cast<std::ptrdiff_t>(width / 2);
  double s2 = 0.0, s4 = 0.0;
  for (std::ptrdiff_t i = -m; i <= m; ++i) {
    const auto square = static_cast<double>(i * i);
    s2 += square;
    s4 += square * square;
  }
  const auto w = static_cast<double>(width);
  const double determinant = w * s4 - s2 * s2;
  for (std::size_t k = 0; k < n; ++k) {
    const auto middle = std::clamp(static_cast<std::ptrdiff_t>(k), m, static_cast<std::ptrdiff_t>(n) - 1 - m);
    double a0 = 0.0, a1 = 0.0, a2 = 0.0;
    for (std::ptrdiff_t i = -m; i <= m; ++i) {
      const double u = signal[static_cast<std::size_t>(middle + i)];
      const auto d = static_cast<double>(i);
      a0 += u;
      a1 += d * u;
      a2 += d * d * u;
    }
    const double constant = (s4 * a0 - s2 * a2) / determinant;
    const double linear = a1 / s2;
    const double square = (w * a2 - s2 * a0) / determinant;
    const auto at = static_cast<double>(static_cast<std::ptrdiff_t>(k) - middle);
    value[k] = constant + at * (linear + at * square);
    slope[k] = linear + 2.0 * at * square;
  }
}

Drive make_drive(const LogTable& log, const Robot& robot, const Measurement& measurement, const DriveOptions& options) {
  Drive drive;
  drive.model = model::make_model(robot);
  check::that(measurement.motion_columns.size() == drive.model.joints.size() &&
                  measurement.effort_columns.size() == drive.model.joints.size(),
              "measurement", "one motion and one effort column for each joint");
  drive.step = check::positive(core::median_step(log.t), "the log's median step");
  drive.count = measurement.count;
  drive.efforts_unsigned = measurement.effort_unsigned;
  drive.efforts_flowed = robot.effort == model::EffortKind::current;
  drive.angles_measured = measurement.motion == MotionKind::angle;
  const double half = 0.5 * check::positive(options.smoothing_window, "smoothing_window") / drive.step;
  drive.window = 2 * std::max<std::size_t>(2, static_cast<std::size_t>(std::lround(half))) + 1;
  if (robot.wheel_radius > 0.0 && robot.track_width > 0.0) {
    drive.wheel_radius = robot.wheel_radius;
    drive.track_width = robot.track_width;
    drive.lever_arm = robot.lever_arm_is_track ? robot.track_width : 0.5 * robot.track_width;
  }
  drive.joints.resize(drive.model.joints.size());
  const Columns columns = take(log, measurement);
  std::vector<std::size_t> starts = log.segment_starts.empty() ? std::vector<std::size_t>{0} : log.segment_starts;
  starts.push_back(log.rows());
  for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
    if (starts[s + 1] - starts[s] < kFewestRows) {
      drive.dropped += starts[s + 1] - starts[s];
      continue;
    }
    append_segment(drive, part(log.t, starts[s], starts[s + 1]), part(columns, starts[s], starts[s + 1]), measurement);
  }
  check::that(drive.rows() > 0, "the log", "a segment of at least three samples");
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    JointSignals& joint = drive.joints[j];
    smooth_joint(drive, joint);
    const double count = measurement.motion == MotionKind::angle
                             ? count_of_angles(log.column(measurement.motion_columns[j]), starts)
                             : drive.count * drive.step;
    joint.resting = find_rest(drive, joint, options.shortest_rest, count);
  }
  for (Eigen::Index c = 0; c < drive.model.motion.rows(); ++c) {
    const Eigen::MatrixXd& motion = drive.model.motion;
    drive.coordinates.push_back({combined(motion, c, drive.joints, &JointSignals::speed),
                                 combined(motion, c, drive.joints, &JointSignals::smooth_speed),
                                 combined(motion, c, drive.joints, &JointSignals::smooth_acceleration)});
  }
  return drive;
}

Drive with_effort_noise(const Drive& drive) {
  Drive noisy = drive;
  for (JointSignals& joint : noisy.joints) {
    if (joint.effort_noise.size() == 0) {
      continue;
    }
    Eigen::VectorXd at_instants = joint.effort_noise;
    if (joint.held_effort.size() > 0) {
      joint.held_effort += joint.effort_noise;
      for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
        const auto [first, last] = drive.segment(s);
        const Eigen::Index n = last - first;
        at_instants.segment(first + 1, n - 1) =
            0.5 * (joint.effort_noise.segment(first, n - 1) + joint.effort_noise.segment(first + 1, n - 1));
      }
    }
    joint.effort += at_instants;
    Eigen::VectorXd unused;
    smooth_signal(noisy, joint.effort, joint.smooth_effort, unused);
  }
  return noisy;
}

void predict_efforts(Drive& drive, const Eigen::VectorXd& theta) {
  const Model& model = drive.model;
  check::that(theta.size() == static_cast<Eigen::Index>(model.p()) && theta.allFinite(), "predict_efforts theta",
              "p finite numbers");
  check::that(model.input.rows() == model.input.cols(), "Model::input", "a square matrix");
  const core::RankRevealingLu input(model.input);
  check::that(input.invertible(), "Model::input", "a regular matrix");
  Eigen::MatrixXd output = Eigen::MatrixXd::Zero(drive.rows(), static_cast<Eigen::Index>(model.n()));
  std::vector<double> speed(drive.coordinates.size()), joint(drive.joints.size());
  const std::vector<double> zeros(std::max(speed.size(), joint.size()), 0.0);
  const Eigen::VectorXd heading = heading_or_odometry(drive);
  for (const Term& term : model.terms) {
    const double factor = theta[static_cast<Eigen::Index>(term.parameter)] * term.scale;
    for (Eigen::Index k = 0; k < drive.rows(); ++k) {
      output(k, static_cast<Eigen::Index>(term.output)) +=
          factor * base_term(drive, term, k, heading[k], speed, joint, zeros);
    }
  }
  const Eigen::MatrixXd inverse = input.inverse();
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    drive.joints[j].predicted_effort = output * inverse.row(static_cast<Eigen::Index>(j)).transpose();
    drive.joints[j].expected_effort = drive.joints[j].predicted_effort;
  }
  drive.theta = theta;
}

}  // namespace wheelwright::gap
