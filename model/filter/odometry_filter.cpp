// SPDX-License-Identifier: Apache-2.0
#include "model/filter/odometry_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::filter {
namespace {

constexpr double kMostSteps = 1e5;     // of a window: at 500 Hz 200 s
constexpr double kSpareSamples = 2.0;  // the ring holds this many times the samples that a window should have
// Of a few operations on numbers that are themselves rounded, as a multiple of their size.
constexpr double kRounding = 16.0 * std::numeric_limits<double>::epsilon();

std::size_t ring_size(double window, double step) {
  check::positive(window, "window");
  check::positive(step, "nominal step");
  check::that(window >= 2.0 * step, "window", "at least two sampling steps");
  check::that(window <= kMostSteps * step, "window", "at most 100,000 sampling steps; are the times of the log in s?");
  return static_cast<std::size_t>(std::ceil(kSpareSamples * window / step)) + 2;
}

// 1 − x²/6 + …: the chord of an arc over the arc, for a half turning angle of x.
double chord_over_arc(double x) { return std::abs(x) < 1e-4 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

}  // namespace

std::array<double, 2> mean_direction(double from, double to) {
  const double turn = to - from, middle = from + 0.5 * turn, length = chord_over_arc(0.5 * turn);
  return {length * std::cos(middle), length * std::sin(middle)};
}

double motion_within_step(double h, double size, double turn, const OdometryErrors& errors) {
  const double a = errors.acceleration, yaw = 2.0 * errors.yaw_gain * a;
  return h * h * ((size + 0.5 * a * h * h) * yaw / 12.0 + (std::abs(turn) + 2.0 * errors.heading) * a / 8.0);
}

std::vector<std::string> OdometryMeasurement::columns() const {
  std::vector<std::string> all = motion_columns;
  if (position) {
    all.insert(all.end(), {"x", "y"});
  }
  if (heading) {
    all.emplace_back("theta");
  }
  if (gyro) {
    all.emplace_back("gyro_z");
  }
  return all;
}

std::vector<std::string> OdometryMeasurement::outputs() const {
  std::vector<std::string> all;
  if (position) {
    all.insert(all.end(), {"longitudinal", "lateral"});
  }
  if (heading) {
    all.emplace_back("yaw");
  }
  if (gyro) {
    all.emplace_back("gyro_yaw");
  }
  return all;
}

std::vector<std::string> OdometryMeasurement::output_units() const {
  std::vector<std::string> all(position ? 2 : 0, "m");
  all.insert(all.end(), (heading ? 1U : 0U) + (gyro ? 1U : 0U), "rad");
  return all;
}

std::vector<std::string> OdometryMeasurement::parameters() const {
  std::vector<std::string> all;
  if (position) {
    all.insert(all.end(), {"radius_right", "radius_left"});
  }
  all.insert(all.end(), {"yaw_gain_right", "yaw_gain_left"});
  if (gyro) {
    all.emplace_back("gyro_bias");
  }
  return all;
}

std::vector<std::string> OdometryMeasurement::parameter_units() const {
  std::vector<std::string> all(position ? 2 : 0, "m");
  all.insert(all.end(), 2, "1");
  if (gyro) {
    all.emplace_back("rad/s");
  }
  return all;
}

void OdometryFilter::Sum::add(double x) {
  const double sum = value + x;
  const double part = sum - value;
  rest += (value - (sum - part)) + (x - part);
  value = sum;
}

OdometryFilter::OdometryFilter(OdometryMeasurement measurement, double window, OdometryErrors errors)
    : measurement_(std::move(measurement)),
      window_(window),
      errors_(std::move(errors)),
      ring_(ring_size(window, measurement_.nominal_step)) {
  check::that(measurement_.motion_columns.size() == 2, "motion_columns", "right and left wheel");
  check::that(measurement_.heading || measurement_.gyro, "measurement", "a heading or a gyro");
  check::that(measurement_.heading || !measurement_.position, "measurement", "a heading where there is a position");
  check::non_negative(errors_.motion, "motion error");
  check::non_negative(errors_.position, "position error");
  check::non_negative(errors_.heading, "heading error");
  check::non_negative(errors_.gyro, "gyro error");
  check::non_negative(errors_.acceleration, "acceleration");
  check::non_negative(errors_.yaw_gain, "yaw gain");
  const auto n = static_cast<Eigen::Index>(measurement_.outputs().size());
  const auto p = static_cast<Eigen::Index>(measurement_.parameters().size());
  check::that(errors_.estimated.size() == 0 || errors_.estimated.size() == n, "estimated errors",
              "one for each output, or none");
  check::that(errors_.estimated.size() == 0 || (errors_.estimated.array() >= 0.0).all(), "estimated errors",
              "values >= 0");
  row_ = {core::RowMatrix::Zero(n, p), core::RowMatrix::Zero(n, p), Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
}

void OdometryFilter::restart() {
  started_ = false;
  first_ = size_ = tail_ = 0;
}

double OdometryFilter::turned(const Wheel& now, const Wheel& before) const {
  return measurement_.motion == MotionKind::angle ? now.measured - before.measured : now.angle.since(before.angle);
}

double OdometryFilter::rounding(const Wheel& now, const Wheel& before) const {
  return kRounding * (std::abs(now.measured) + std::abs(before.measured) + std::abs(turned(now, before)));
}

// Takes a sample into now_; returns whether its pose counts.
bool OdometryFilter::read(double t, std::span<const double> sample) {
  const double h = t - sample_time_;
  std::size_t next = 2;
  for (std::size_t w = 0; w < 2; ++w) {
    const double motion = uncut(sample[w], measurement_.cut);
    if (measurement_.motion == MotionKind::angle) {
      now_.wheels[w].measured = motion;
    } else if (started_) {
      now_.wheels[w].angle.add(0.5 * h * (speed_[w] + motion));
    }
    speed_[w] = motion;
  }
  const double x = measurement_.position ? sample[next++] : 0.0;
  const double y = measurement_.position ? sample[next++] : 0.0;
  const double heading = measurement_.heading ? sample[next++] : 0.0;
  if (measurement_.gyro) {
    if (started_) {
      now_.gyro.add(0.5 * h * (gyro_ + sample[next]));
      now_.squared_steps.add(h * h);
    }
    gyro_ = sample[next];
  }
  sample_time_ = now_.t = t;
  const bool same = x == now_.x && y == now_.y && heading == wrapped_heading_;
  if (started_ && measurement_.held_pose && same) {
    return false;
  }
  turns_ -= started_ ? std::round((heading - wrapped_heading_) / (2.0 * std::numbers::pi)) : 0.0;
  wrapped_heading_ = heading;
  now_.x = x;
  now_.y = y;
  now_.heading = heading + 2.0 * std::numbers::pi * turns_;
  return true;
}

// The step from the pose before to that of now_.
void OdometryFilter::follow_pose(const Sample& before) {
  const double h = now_.t - before.t;
  const double turn = now_.heading - before.heading;
  now_.mean = mean_direction(before.heading, now_.heading);
  const bool any = before.steps > 0;
  now_.variation.add(any ? std::hypot(now_.mean[0] - before.mean[0], now_.mean[1] - before.mean[1]) : 0.0);
  now_.steps = before.steps + 1;
  const double slack = measurement_.motion == MotionKind::speed ? h * errors_.motion : 2.0 * errors_.motion;
  for (std::size_t w = 0; w < 2; ++w) {
    Wheel& wheel = now_.wheels[w];
    const double by = turned(wheel, before.wheels[w]), size = std::abs(by);
    wheel.along[0].add(now_.mean[0] * by);
    wheel.along[1].add(now_.mean[1] * by);
    wheel.size.add(size + slack);
    wheel.within.add(motion_within_step(h, size + slack, turn, errors_));
  }
}

void OdometryFilter::push() {
  if (size_ == ring_.size()) {
    first_ = (first_ + 1) % ring_.size();
    --size_;
    tail_ -= tail_ > 0 ? 1 : 0;
  }
  ring_[(first_ + size_) % ring_.size()] = now_;
  ++size_;
}

bool OdometryFilter::step(double t, std::span<const double> sample) {
  if (!started_) {
    now_ = Sample{};
    turns_ = 0.0;
  }
  const bool counts = read(t, sample);
  started_ = true;
  if (!counts) {
    return false;
  }
  if (measurement_.position) {
    now_.cosine = std::cos(now_.heading);
    now_.sine = std::sin(now_.heading);
    if (size_ > 0) {
      follow_pose(at(size_ - 1));
    }
  }
  const bool overflows = size_ == ring_.size();
  push();
  const auto off = [&](std::size_t k) { return std::abs(t - at(k).t - window_); };
  while (tail_ + 2 < size_ && off(tail_ + 1) <= off(tail_)) {
    ++tail_;
  }
  const bool full = overflows || tail_ > 0 || t - at(0).t >= window_ - 0.5 * measurement_.nominal_step;
  if (!full || size_ < 2) {
    return false;
  }
  write_row();
  return true;
}

void OdometryFilter::write_row() {
  const Sample &begin = at(tail_), &end = at(size_ - 1);
  if (measurement_.position) {
    write_position(begin, end);
  }
  write_turn(begin, end);
  for (Eigen::Index i = 0; i < errors_.estimated.size(); ++i) {
    if (errors_.estimated[i] > 0.0) {
      row_.dy[i] = errors_.estimated[i];
      row_.dY.row(i).setZero();
    }
  }
}

void OdometryFilter::write_position(const Sample& begin, const Sample& end) {
  const double c = begin.cosine, s = begin.sine;
  const auto turn_back = [&](double x, double y) { return std::array{c * x + s * y, c * y - s * x}; };
  const double dx = end.x - begin.x, dy = end.y - begin.y;
  const auto displacement = turn_back(dx, dy);
  const double seen = 2.0 * errors_.position * (std::abs(c) + std::abs(s)) +
                      kRounding * (std::abs(begin.x) + std::abs(begin.y) + std::abs(end.x) + std::abs(end.y));
  const Sample& second = at(tail_ + 1);
  const auto first_mean = turn_back(second.mean[0], second.mean[1]), last_mean = turn_back(end.mean[0], end.mean[1]);
  const double variation = end.variation.since(second.variation);
  const double length = end.t - begin.t;
  const double angular = kRounding * (1.0 + std::abs(begin.heading) + std::abs(end.heading));
  for (Eigen::Index i = 0; i < 2; ++i) {
    const auto component = static_cast<std::size_t>(i);
    row_.y[i] = displacement[component];
    row_.dy[i] = seen;
    const double ends = std::abs(first_mean[component]) + std::abs(last_mean[component]);
    for (Eigen::Index j = 0; j < 2; ++j) {
      const Wheel &now = end.wheels[static_cast<std::size_t>(j)], &then = begin.wheels[static_cast<std::size_t>(j)];
      const auto along = turn_back(now.along[0].since(then.along[0]), now.along[1].since(then.along[1]));
      const double size = now.size.since(then.size);
      const double rolled = measurement_.motion == MotionKind::speed
                                ? errors_.motion * length
                                : (errors_.motion + rounding(now, then)) * (ends + variation);
      row_.Y(i, j) = 0.5 * along[component];
      row_.dY(i, j) = 0.5 * (rolled + errors_.heading * size + now.within.since(then.within) + angular * size);
    }
  }
}

void OdometryFilter::write_turn(const Sample& begin, const Sample& end) {
  const double length = end.t - begin.t;
  const Wheel &now_right = end.wheels[0], &now_left = end.wheels[1];
  const Wheel &then_right = begin.wheels[0], &then_left = begin.wheels[1];
  const double right = turned(now_right, then_right), left = turned(now_left, then_left);
  const double rolled = measurement_.motion == MotionKind::speed ? errors_.motion * length : 2.0 * errors_.motion;
  Eigen::Index i = measurement_.position ? 2 : 0;
  const Eigen::Index column = measurement_.position ? 2 : 0;
  const auto write = [&](double value, double error) {
    row_.Y(i, column) = right;
    row_.Y(i, column + 1) = -left;
    row_.dY(i, column) = rolled + rounding(now_right, then_right);
    row_.dY(i, column + 1) = rolled + rounding(now_left, then_left);
    row_.y[i] = value;
    row_.dy[i] = error + kRounding * (std::abs(begin.heading) + std::abs(end.heading) + std::abs(value));
    ++i;
  };
  if (measurement_.heading) {
    write(end.heading - begin.heading, 2.0 * errors_.heading);
  }
  if (measurement_.gyro) {
    row_.Y(i, column + 2) = length;
    // The trapezoidal rule of a rate that changes by at most K a second is wrong by at most K h²/4 in each step.
    const double change = 2.0 * errors_.yaw_gain * errors_.acceleration;
    write(end.gyro.since(begin.gyro),
          errors_.gyro * length + 0.25 * change * end.squared_steps.since(begin.squared_steps));
  }
}

namespace {

constexpr double kHeldShare = 0.2;  // of the steps in which a wheel moves

// Whether the pose is a slower sensor's, repeated from row to row.
bool is_held(LogSource& log, const OdometryMeasurement& m) {
  std::vector<std::size_t> pose, motion;
  for (const char* name : {"x", "y", "theta"}) {
    if (const auto column = log.find(name); column && (m.position || std::string_view(name) == "theta")) {
      pose.push_back(*column);
    }
  }
  for (const auto& name : m.motion_columns) {
    motion.push_back(*log.find(name));
  }
  std::size_t moving = 0, held = 0;
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    for (std::size_t k = 1; k < block.rows(); ++k) {
      const auto same = [&](std::size_t c) { return block.columns[c][k] == block.columns[c][k - 1]; };
      const auto still = [&](std::size_t c) {
        return m.motion == MotionKind::angle ? same(c) : block.columns[c][k] == 0.0 && block.columns[c][k - 1] == 0.0;
      };
      if (!(still(motion[0]) && still(motion[1]))) {
        ++moving;
        bool all = true;
        for (const std::size_t c : pose) {
          all = all && same(c);
        }
        held += all ? 1 : 0;
      }
    }
  }
  log.rewind();
  return moving > 0 && static_cast<double>(held) >= kHeldShare * static_cast<double>(moving);
}

}  // namespace

std::optional<OdometryMeasurement> find_odometry(LogSource& log, const Robot& robot, const Model& model,
                                                 const Measurement& torque) {
  if (!model::on_two_wheels(robot) || model.joints.size() != 2) {
    return std::nullopt;
  }
  OdometryMeasurement m;
  m.heading = log.find("theta").has_value();
  m.position = m.heading && log.find("x") && log.find("y");
  m.gyro = log.find("gyro_z").has_value();
  m.nominal_step = log.median_step();
  if (!(m.heading || m.gyro) || !(m.nominal_step > 0.0)) {
    return std::nullopt;
  }
  m.motion = torque.motion;
  m.motion_columns = torque.motion_columns;
  m.count = torque.count;
  m.cut = torque.cut;
  if (log.find(model.joints[0].angle) && log.find(model.joints[1].angle)) {
    m.motion = MotionKind::angle;
    m.motion_columns = {model.joints[0].angle, model.joints[1].angle};
    m.count = 0.0;
    m.cut.reset();
  }
  m.held_pose = m.heading && is_held(log, m);
  return m;
}

}  // namespace wheelwright::filter
