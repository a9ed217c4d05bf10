// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/odometry_faults.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <Eigen/LU>

#include "core/check.hpp"
#include "detector/detector.hpp"

namespace wheelwright::detector {
namespace {

// Mean of the unit vector while the heading goes from one value to the next at a constant rate.
Eigen::Vector2d mean_direction(double from, double to) {
  const double half = 0.5 * (to - from), middle = 0.5 * (from + to);
  const double length = std::abs(half) < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
  return length * Eigen::Vector2d(std::cos(middle), std::sin(middle));
}

}  // namespace

OdometryReference read_odometry(LogSource& log, filter::OdometryFilter filter, const Model& model) {
  const filter::OdometryMeasurement& measurement = filter.measurement();
  const std::size_t n = measurement.outputs().size(), p = measurement.parameters().size();
  const std::size_t heading_at = measurement.position ? 4 : 2;
  OdometryReference reference;
  ReferenceMotion& motion = reference.motion;
  std::vector<double> angle, regressor, regressor_error, y, dy;
  const auto append = [](std::vector<double>& to, const auto& from) {
    to.insert(to.end(), from.data(), from.data() + from.size());
  };
  std::array<double, 2> way{}, speed{};
  std::array<double, 3> pose{};
  double turns = 0.0, before = 0.0;
  bool begins = true;
  core::for_each_sample(log, measurement.columns(), [&](const core::LogSample& sample) {
    const std::span<const double> now = sample.values;
    if (sample.starts) {
      filter.restart();
      begins = true;
    }
    if (!is_whole(sample.t, now)) {
      return;
    }
    const bool settled = filter.step(sample.t, now);
    for (std::size_t w = 0; w < 2; ++w) {
      if (measurement.motion == MotionKind::angle) {
        way[w] = now[w];
      } else {
        way[w] = begins ? 0.0 : way[w] + 0.5 * (sample.t - before) * (speed[w] + now[w]);
      }
      speed[w] = now[w];
    }
    before = sample.t;
    std::array<double, 3> next{};
    std::copy(now.begin() + 2, now.begin() + static_cast<std::ptrdiff_t>(measurement.heading ? heading_at + 1 : 2),
              next.begin());
    if (measurement.held_pose && !begins && next == pose) {
      return;
    }
    pose = next;
    double heading = measurement.heading ? now[heading_at] : 0.0;
    if (begins) {
      motion.segment_starts.push_back(motion.t.size());
      turns = 0.0;
    } else if (measurement.heading) {
      heading += 2.0 * std::numbers::pi * turns;
      const double jumps = std::round((heading - motion.heading.back()) / (2.0 * std::numbers::pi));
      turns -= jumps;
      heading -= 2.0 * std::numbers::pi * jumps;
    } else {  // a gyro alone: wheels' own heading
      const double* last = angle.data() + angle.size() - 2;
      heading =
          motion.heading.back() + model.motion(1, 0) * (way[0] - last[0]) + model.motion(1, 1) * (way[1] - last[1]);
    }
    begins = false;
    motion.sample.push_back(sample.row);
    motion.t.push_back(sample.t);
    motion.heading.push_back(heading);
    motion.settled.push_back(settled);
    append(angle, way);
    append(regressor, filter.row().Y);
    append(regressor_error, filter.row().dY);
    append(y, filter.row().y);
    append(dy, filter.row().dy);
    const auto start =
        settled ? std::lower_bound(motion.t.begin() + static_cast<std::ptrdiff_t>(motion.segment_starts.back()),
                                   motion.t.end(), filter.window_start())
                : motion.t.end() - 1;
    reference.window.push_back(static_cast<std::size_t>(start - motion.t.begin()));
  });
  motion.instant = motion.t;
  const auto count = static_cast<Eigen::Index>(motion.t.size()), columns = static_cast<Eigen::Index>(p);
  motion.joint_angle = Eigen::Map<const Eigen::MatrixXd>(angle.data(), 2, count);
  motion.joint_speed = Eigen::MatrixXd::Zero(2, count);
  for (Eigen::Index k = 1; k < count; ++k) {
    const double h = motion.t[static_cast<std::size_t>(k)] - motion.t[static_cast<std::size_t>(k - 1)];
    const bool first =
        std::binary_search(motion.segment_starts.begin(), motion.segment_starts.end(), static_cast<std::size_t>(k));
    if (!first) {
      motion.joint_speed.col(k) = (motion.joint_angle.col(k) - motion.joint_angle.col(k - 1)) / h;
    }
  }
  motion.speed = model.motion * motion.joint_speed;
  motion.measured = true;
  motion.rows.outputs = n;
  motion.rows.parameters = p;
  motion.rows.sample = motion.sample;
  motion.rows.t = motion.t;
  const Eigen::Index rows = count * static_cast<Eigen::Index>(n);
  motion.rows.Y = Eigen::Map<const core::RowMatrix>(regressor.data(), rows, columns);
  motion.rows.dY = Eigen::Map<const core::RowMatrix>(regressor_error.data(), rows, columns);
  motion.rows.y = Eigen::Map<const Eigen::VectorXd>(y.data(), rows);
  motion.rows.dy = Eigen::Map<const Eigen::VectorXd>(dy.data(), rows);
  return reference;
}

OdometrySignature odometry_signature(const FaultType& fault, const Model& model) {
  validate(fault, model);
  check::that(model.coordinates.size() == 2 && model.joints.size() == 2, "model", "a differential drive");
  const Eigen::Matrix2d to_body = model.motion, to_joint = to_body.inverse();
  OdometrySignature signature;
  if (fault.motion.size() > 0) {
    signature.rolled = to_joint * fault.motion * to_body;
  }
  if (fault.seen.size() > 0) {
    signature.shown = to_joint * fault.seen * to_body;
  }
  if (fault.slip.size() > 0) {
    signature.along = fault.slip[0];
    signature.turning = fault.slip[1];
  }
  return signature;
}

double OdometrySignature::read_share() const {
  const auto share = [](const Eigen::Matrix2d& joint) { return joint.cwiseAbs().rowwise().sum().maxCoeff(); };
  return share(rolled) + share(shown);
}

OdometryFaultRows::OdometryFaultRows(const FaultType& fault, const Model& model,
                                     const filter::OdometryMeasurement& measurement, const OdometryReference& reference,
                                     const Box& hull)
    : fault_(fault),
      reference_(&reference),
      measurement_(measurement),
      signature_(odometry_signature(fault, model)),
      n_(measurement.outputs().size()),
      p_(measurement.parameters().size()) {
  check::that(hull.dimension() == p_, "hull", "one side for each parameter");
  most_kappa_ = std::max(std::abs(fault_.kappa(fault_.range.lower)), std::abs(fault_.kappa(fault_.range.upper)));
  const std::size_t gains = measurement_.position ? 2 : 0;
  for (std::size_t w = 0; w < 2; ++w) {
    radius_[w] = measurement_.position ? core::magnitude(hull.sides[w]) : 0.0;
    yaw_gain_[w] = hull.sides[gains + w];
  }
  const auto n = static_cast<Eigen::Index>(n_), p = static_cast<Eigen::Index>(p_);
  rows_ = {core::RowMatrix::Zero(n, p), core::RowMatrix::Zero(n, p), core::RowMatrix::Zero(n, p),
           Eigen::VectorXd::Zero(n)};
  doubt_ = Eigen::VectorXd::Zero(n);
  range_ = rows_.g1;
}

void OdometryFaultRows::begin(std::size_t onset) {
  const ReferenceMotion& motion = reference_->motion;
  check::that(onset < motion.instants(), "onset", "an instant of the motion");
  const auto next = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), onset);
  end_ = next == motion.segment_starts.end() ? motion.instants() : *next;
  onset_ = k_ = onset;
  sums_.assign(1, Sums{});
}

bool OdometryFaultRows::next() {
  if (k_ + 1 >= end_) {
    return false;
  }
  const ReferenceMotion& motion = reference_->motion;
  const auto a = static_cast<Eigen::Index>(k_), joint = static_cast<Eigen::Index>(fault_.profile.joint);
  const double h = motion.t[k_ + 1] - motion.t[k_];
  const auto profile = [&](std::size_t k) {
    const auto at = static_cast<Eigen::Index>(k);
    return fault_.profile.at(
        motion.t[k] - motion.t[onset_],
        motion.joint_angle(joint, at) - motion.joint_angle(joint, static_cast<Eigen::Index>(onset_)),
        motion.joint_speed(joint, at));
  };
  const double s = 0.5 * (profile(k_) + profile(k_ + 1));
  const Eigen::Vector2d way = motion.joint_angle.col(a + 1) - motion.joint_angle.col(a);
  const Eigen::Vector2d rolled = s * signature_.rolled * way, shown = s * signature_.shown * way;
  const Eigen::Vector2d e = mean_direction(motion.heading[k_], motion.heading[k_ + 1]), left(-e[1], e[0]);
  Sums sums = sums_.back();
  Interval turn{s * signature_.turning * h, s * signature_.turning * h};
  for (std::size_t w = 0; w < 2; ++w) {
    const auto j = static_cast<Eigen::Index>(w);
    sums.rolled[w] += rolled[j] * e;
    sums.shown[w] += shown[j] * e;
    sums.turned[j] += rolled[j];
    sums.turn_shown[j] += shown[j];
    const double sign = w == 0 ? 1.0 : -1.0;
    const double x = sign * rolled[j] * yaw_gain_[w].lower, y = sign * rolled[j] * yaw_gain_[w].upper;
    turn.lower += std::min(x, y);
    turn.upper += std::max(x, y);
    sums.way += 0.5 * std::abs(way[j]) * radius_[w];
    sums.moved += 0.5 * std::abs(rolled[j]) * radius_[w];
  }
  sums.slipped += s * h * (signature_.along * e + fault_.lateral * left);
  sums.slipped_turn += s * h * signature_.turning;
  sums.turn_size += core::magnitude(turn);
  sums.moved += s * h * std::hypot(signature_.along, fault_.lateral);
  sums_.push_back(sums);
  ++k_;
  write();
  return true;
}

void OdometryFaultRows::write() {
  const ReferenceMotion& motion = reference_->motion;
  const std::size_t from = reference_->window[k_];
  const Sums& end = sums_.back();
  const Sums& begin = from <= onset_ ? sums_.front() : sums_[from - onset_];
  Eigen::Index i = 0;
  if (measurement_.position) {
    const double c = std::cos(motion.heading[from]), s = std::sin(motion.heading[from]);
    const Eigen::Matrix2d turn_back = (Eigen::Matrix2d() << c, s, -s, c).finished();
    for (Eigen::Index w = 0; w < 2; ++w) {
      const auto wheel = static_cast<std::size_t>(w);
      const Eigen::Vector2d rolled = 0.5 * turn_back * (end.rolled[wheel] - begin.rolled[wheel]);
      const Eigen::Vector2d shown = 0.5 * turn_back * (end.shown[wheel] - begin.shown[wheel]);
      rows_.g1(0, w) = rolled[0];
      rows_.g1(1, w) = rolled[1];
      rows_.s(0, w) = shown[0];
      rows_.s(1, w) = shown[1];
    }
    rows_.c.head<2>() = turn_back * (end.slipped - begin.slipped);
    // The way of the whole window turns with the robot, that before the onset does not.
    const double turned = end.turn_size - begin.turn_size;
    doubt_.head<2>().setConstant(turned * (end.way - begin.way + most_kappa_ * (end.moved - begin.moved)));
    i = 2;
  }
  const Eigen::Index column = measurement_.position ? 2 : 0;
  for (; i < static_cast<Eigen::Index>(n_); ++i) {
    rows_.g1(i, column) = end.turned[0] - begin.turned[0];
    rows_.g1(i, column + 1) = -(end.turned[1] - begin.turned[1]);
    rows_.s(i, column) = end.turn_shown[0] - begin.turn_shown[0];
    rows_.s(i, column + 1) = -(end.turn_shown[1] - begin.turn_shown[1]);
    rows_.c[i] = end.slipped_turn - begin.slipped_turn;
  }
  if (motion.measured) {
    const auto n = static_cast<Eigen::Index>(n_);
    const auto dY = motion.rows.dY.middleRows(static_cast<Eigen::Index>(k_) * n, n);
    range_ = (signature_.read_share() * dY.rowwise().maxCoeff()).replicate(1, dY.cols());
  }
}

FaultRow OdometryFaultRows::row(std::size_t i) const {
  const RegressionBlock& rows = reference_->motion.rows;
  const auto at = static_cast<Eigen::Index>(k_ * n_ + i), r = static_cast<Eigen::Index>(i);
  FaultRow row{.y = {rows.Y.row(at).data(), p_},
               .g1 = {rows_.g1.row(r).data(), p_},
               .g2 = {rows_.g2.row(r).data(), p_},
               .s = {rows_.s.row(r).data(), p_},
               .dY = {rows.dY.row(at).data(), p_},
               .c = rows_.c[r],
               .dy = rows.dy[at],
               .doubt = 2.0 * doubt_[r],
               .range = {range_.row(r).data(), p_}};
  if (reference_->motion.measured) {
    row.read = row.dY;
  }
  return row;
}

}  // namespace wheelwright::detector
