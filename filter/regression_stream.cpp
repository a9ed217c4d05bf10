// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regression_stream.hpp>

#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

RegressionStream::RegressionStream(LogSource& log, RegressorFilter filter) : log_(&log), filter_(std::move(filter)) {
  for (const auto& name : filter_.measurement().columns()) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    pick_.push_back(*column);
  }
  sample_.resize(pick_.size());
  rewind();
}

void RegressionStream::rewind() {
  log_->rewind();
  filter_.restart();
}

bool RegressionStream::next(RegressionBlock& block) {
  if (!log_->next(scratch_)) {
    block.resize(0, outputs(), parameters());
    return false;
  }
  const auto n = static_cast<Eigen::Index>(outputs());
  block.resize(scratch_.rows(), outputs(), parameters());
  std::size_t kept = 0;
  std::size_t segment = 0;
  for (std::size_t k = 0; k < scratch_.rows(); ++k) {
    if (segment < scratch_.segment_starts.size() && scratch_.segment_starts[segment] == k) {
      filter_.restart();
      ++segment;
    }
    for (std::size_t c = 0; c < pick_.size(); ++c) {
      sample_[c] = scratch_.columns[pick_[c]][k];
    }
    if (!filter_.step(scratch_.t[k], sample_)) {
      continue;
    }
    const FilteredRow& row = filter_.row();
    const auto at = static_cast<Eigen::Index>(kept) * n;
    block.sample[kept] = scratch_.first_row + k;
    block.t[kept] = scratch_.t[k];
    block.Y.middleRows(at, n) = row.Y;
    block.dY.middleRows(at, n) = row.dY;
    block.y.segment(at, n) = row.y;
    block.dy.segment(at, n) = row.dy;
    ++kept;
  }
  block.sample.resize(kept);
  block.t.resize(kept);
  const auto rows = block.rows();
  block.Y.conservativeResize(rows, Eigen::NoChange);
  block.dY.conservativeResize(rows, Eigen::NoChange);
  block.y.conservativeResize(rows);
  block.dy.conservativeResize(rows);
  return true;
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
  if (robot.model != "differential_drive" || model.joints.size() != 2) {
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
  if (log.find(model.joints[0].angle) && log.find(model.joints[1].angle)) {
    m.motion = MotionKind::angle;
    m.motion_columns = {model.joints[0].angle, model.joints[1].angle};
    m.count = 0.0;
  }
  m.held_pose = m.heading && is_held(log, m);
  return m;
}

OdometryStream::OdometryStream(LogSource& log, OdometryFilter filter)
    : log_(&log),
      filter_(std::move(filter)),
      n_(filter_.measurement().outputs().size()),
      p_(filter_.measurement().parameters().size()) {
  for (const auto& name : filter_.measurement().columns()) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    pick_.push_back(*column);
  }
  sample_.resize(pick_.size());
  rewind();
}

void OdometryStream::rewind() {
  log_->rewind();
  filter_.restart();
}

bool OdometryStream::next(RegressionBlock& block) {
  if (!log_->next(scratch_)) {
    block.resize(0, n_, p_);
    starts_.clear();
    return false;
  }
  const auto n = static_cast<Eigen::Index>(n_);
  block.resize(scratch_.rows(), n_, p_);
  starts_.clear();
  std::size_t kept = 0;
  std::size_t segment = 0;
  for (std::size_t k = 0; k < scratch_.rows(); ++k) {
    if (segment < scratch_.segment_starts.size() && scratch_.segment_starts[segment] == k) {
      filter_.restart();
      ++segment;
    }
    for (std::size_t c = 0; c < pick_.size(); ++c) {
      sample_[c] = scratch_.columns[pick_[c]][k];
    }
    if (!filter_.step(scratch_.t[k], sample_)) {
      continue;
    }
    const FilteredRow& row = filter_.row();
    const auto at = static_cast<Eigen::Index>(kept) * n;
    block.sample[kept] = scratch_.first_row + k;
    block.t[kept] = scratch_.t[k];
    block.Y.middleRows(at, n) = row.Y;
    block.dY.middleRows(at, n) = row.dY;
    block.y.segment(at, n) = row.y;
    block.dy.segment(at, n) = row.dy;
    starts_.push_back(filter_.window_start());
    ++kept;
  }
  block.sample.resize(kept);
  block.t.resize(kept);
  const auto rows = block.rows();
  block.Y.conservativeResize(rows, Eigen::NoChange);
  block.dY.conservativeResize(rows, Eigen::NoChange);
  block.y.conservativeResize(rows);
  block.dy.conservativeResize(rows);
  return true;
}

}  // namespace wheelwright
