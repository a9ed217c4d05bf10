// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/reference_motion.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/limits.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kBeyondEfforts = 3.0;  // efforts of a broken robot, in units of those that the rows can be due to
constexpr double kFirst = 1.0 / 256.0;  // of most_effort

std::size_t effort_reach(const Measurement& m, const filter::SignalErrors& errors) {
  if (!errors.between_samples) {
    return 0;
  }
  const std::size_t about = (m.motion == MotionKind::mean_speed ? 1 : 0) + (m.smoothing.upper > 0.0 ? 1 : 0);
  if (m.delay.lower != 0.0 || m.delay.upper != 0.0) {
    return about + 2 + static_cast<std::size_t>(std::ceil(m.delay.width() / m.nominal_step));
  }
  return m.changes == model::EffortChanges::at_samples && m.smoothing.upper == 0.0
             ? 0
             : about + (m.hold == Hold::zero_order ? 1 : 3);
}

ReferenceMotion walk(LogSource& log, RegressorFilter filter) {
  const std::size_t n = filter.model().n(), p = filter.model().p();
  const auto coordinates = static_cast<Eigen::Index>(filter.model().coordinates.size());
  const auto joints = static_cast<Eigen::Index>(filter.model().joints.size());
  ReferenceMotion motion;
  motion.rows.outputs = n;
  motion.rows.parameters = p;
  std::vector<double> speed, joint_speed, joint_angle, y, dy, regressor, regressor_error;
  Eigen::VectorXd angle = Eigen::VectorXd::Zero(joints), before = angle;
  const auto append = [](std::vector<double>& to, const auto& from) {
    to.insert(to.end(), from.data(), from.data() + from.size());
  };
  const bool nodes = filter.measurement().motion != MotionKind::speed;
  motion.kind = filter.measurement().motion;
  motion.nominal_step = filter.measurement().nominal_step;
  motion.effort_reach = effort_reach(filter.measurement(), filter.errors());
  motion.errors = filter.errors();
  motion.measured = true;
  std::size_t seen = 0;
  bool whole = true;
  core::for_each_sample(log, filter.measurement().columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      filter.restart();
      seen = 0;
    }
    const bool settled = filter.step(sample.t, sample.values);
    if (filter.instants() == 0 || filter.instants() == seen) {
      seen = filter.instants();
      return;
    }
    const double length = !nodes && filter.instants() == 1 ? 0.0 : filter.step_length();
    if (filter.instants() == 1) {
      motion.segment_starts.push_back(motion.t.size());
      angle.setZero();
    } else {
      const double earlier = nodes ? motion.step.back() : length;
      angle += 0.5 * (earlier * before + length * filter.joint_speed());
    }
    seen = filter.instants();
    before = filter.joint_speed();
    motion.sample.push_back(sample.row);
    motion.t.push_back(sample.t);
    motion.instant.push_back(filter.instant());
    motion.step.push_back(length);
    const bool first = filter.instants() == 1;
    motion.weights.push_back(first ? 1.0 : filter.share());
    motion.cuts.push_back(!first && filter.cut());
    whole = whole && motion.weights.back() == 1.0;
    motion.heading.push_back(filter.heading());
    motion.settled.push_back(settled && !filter.rests_on_standstill());
    append(speed, filter.speed());
    append(joint_speed, before);
    append(joint_angle, angle);
    append(regressor, filter.row().Y);
    append(regressor_error, filter.row().dY);
    append(y, filter.row().y);
    append(dy, filter.row().dy);
  });
  if (whole) {
    motion.weights.clear();
    motion.cuts.clear();
  }
  const auto k = static_cast<Eigen::Index>(motion.t.size());
  motion.speed = Eigen::Map<const Eigen::MatrixXd>(speed.data(), coordinates, k);
  motion.joint_speed = Eigen::Map<const Eigen::MatrixXd>(joint_speed.data(), joints, k);
  motion.joint_angle = Eigen::Map<const Eigen::MatrixXd>(joint_angle.data(), joints, k);
  motion.rows.sample = motion.sample;
  motion.rows.t = motion.t;
  const Eigen::Index rows = k * static_cast<Eigen::Index>(n), columns = static_cast<Eigen::Index>(p);
  motion.rows.Y = Eigen::Map<const core::RowMatrix>(regressor.data(), rows, columns);
  motion.rows.dY = Eigen::Map<const core::RowMatrix>(regressor_error.data(), rows, columns);
  motion.rows.y = Eigen::Map<const Eigen::VectorXd>(y.data(), rows);
  motion.rows.dy = Eigen::Map<const Eigen::VectorXd>(dy.data(), rows);
  return motion;
}

}  // namespace

ReferenceMotion read_reference(LogSource& log, const RegressorFilter& filter) {
  ReferenceMotion motion = walk(log, filter);
  const filter::SignalErrors& errors = filter.errors();
  const Model& model = filter.model();
  const RegressionBlock& rows = motion.rows;
  motion.largest = errors.motion.largest;
  motion.any_dY = rows.dY;
  motion.any_dy = rows.dy;
  motion.between_dY = motion.effort_dY = motion.effort_doubt = core::RowMatrix::Zero(rows.dY.rows(), rows.dY.cols());
  motion.between_dy = Eigen::VectorXd::Zero(rows.dy.size());
  if (!errors.between_samples || rows.y.size() == 0) {
    return motion;
  }
  const auto walk_with = [&](const filter::SignalErrors& wider) {
    return walk(log, RegressorFilter(model, filter.design(), filter.measurement(), wider)).rows;
  };
  // Readings of one motion are two bounds apart: of a size and of half a range of efforts, of speeds.
  filter::SignalErrors apart = errors;
  apart.speed_sample *= 2.0;
  apart.joint_sample *= 2.0;
  apart.heading *= 2.0;
  apart.motion.effort *= 5.0;
  apart.output *= motion.effort_reach > 0 ? 3.0 : 1.0;
  const RegressionBlock any = walk_with(apart);
  const auto known = [&](const RegressionBlock& block) { return block.dY.rows() == rows.dY.rows(); };
  if (!known(any)) {
    // A step that is too long for efforts like these has no rows: nothing is known of it.
    motion.any_dY.setConstant(core::kInfinity);
    return motion;
  }
  motion.any_dY = any.dY + (any.Y - rows.Y).cwiseAbs();
  motion.any_dy = any.dy;
  motion.between_dY = motion.any_dY;
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      continue;
    }
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    const double sensor =
        std::abs(term.scale) * (term.kind == Term::Kind::speed ? errors.speed[c] : errors.acceleration[c]);
    for (auto k = static_cast<Eigen::Index>(term.output); k < rows.dY.rows();
         k += static_cast<Eigen::Index>(model.n())) {
      double& between = motion.between_dY(k, static_cast<Eigen::Index>(term.parameter));
      between = std::max(0.0, between - sensor);
    }
  }
  motion.between_dy = (any.dy - errors.output.replicate(static_cast<Eigen::Index>(motion.instants()), 1)).cwiseMax(0.0);
  if (errors.motion.mobility.size() == 0) {
    return motion;
  }
  const double most = rows.y.cwiseAbs().maxCoeff() + any.dy.maxCoeff() +
                      ((rows.Y.cwiseAbs() + motion.any_dY) * motion.largest).maxCoeff();
  motion.most_effort = kBeyondEfforts * most / filter.design().static_gain();
  filter::SignalErrors more = apart;
  more.motion.effort.array() += motion.most_effort;
  const RegressionBlock wider = walk_with(more);
  if (!(motion.most_effort > 0.0) || !known(wider)) {
    motion.effort_dY.setConstant(motion.most_effort > 0.0 ? core::kInfinity : 0.0);
    return motion;
  }
  const core::RowMatrix growth = (wider.dY - any.dY).cwiseMax(0.0);
  const core::RowMatrix doubt = growth + (wider.Y - any.Y).cwiseAbs();
  // What samples tell of the motion whatever the efforts are is a ceiling: it grows most at first.
  more.motion.effort = apart.motion.effort.array() + kFirst * motion.most_effort;
  const RegressionBlock first = walk_with(more);
  motion.effort_dY = growth / motion.most_effort;
  if (known(first)) {
    motion.effort_dY = motion.effort_dY.cwiseMax((first.dY - any.dY) / (kFirst * motion.most_effort));
  }
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      for (auto k = static_cast<Eigen::Index>(term.output); k < doubt.rows();
           k += static_cast<Eigen::Index>(model.n())) {
        const auto j = static_cast<Eigen::Index>(term.parameter);
        motion.effort_doubt(k, j) = doubt(k, j);
        motion.effort_dY(k, j) = 0.0;
      }
    }
  }
  return motion;
}

}  // namespace wheelwright::detector
