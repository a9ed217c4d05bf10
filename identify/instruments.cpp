// SPDX-License-Identifier: Apache-2.0
#include "identify/instruments.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::identify {
namespace {

constexpr double kSingularCross = 1e-9;  // reciprocal condition
constexpr int kSubsteps = 2;

Eigen::MatrixXd inertia(const Model& model, const Eigen::VectorXd& theta) {
  Eigen::MatrixXd m =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.n()), static_cast<Eigen::Index>(model.coordinates.size()));
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::acceleration) {
      m(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.coordinate)) +=
          term.scale * theta[static_cast<Eigen::Index>(term.parameter)];
    }
  }
  return m;
}

bool invertible(const Eigen::MatrixXd& m) {
  if (m.rows() != m.cols() || !m.allFinite()) {
    return false;
  }
  const core::RankRevealingLu lu(m);
  return lu.invertible() && lu.reciprocal_condition() > kSingularCross;
}

Measurement of_instruments(const Measurement& rows, const std::vector<std::string>& motion) {
  Measurement m = rows;
  m.motion = MotionKind::speed;
  m.count = 0.0;
  m.motion_columns = motion;
  m.heading_column.clear();
  return m;
}

}  // namespace

std::optional<InstrumentMotion> commanded_motion(const LogSource& log, const Model& model) {
  InstrumentMotion motion;
  for (const model::Joint& joint : model.joints) {
    if (joint.command.empty() || !log.find(joint.command)) {
      return std::nullopt;
    }
    motion.columns.push_back(joint.command);
  }
  return motion;
}

bool MotionSimulation::possible(const Model& model, const Eigen::VectorXd& theta) {
  return static_cast<std::size_t>(theta.size()) == model.p() && theta.allFinite() &&
         model.coordinates.size() == model.n() && invertible(inertia(model, theta)) && invertible(model.motion);
}

MotionSimulation::MotionSimulation(Model model, Eigen::VectorXd theta, Hold hold)
    : model_(std::move(model)), theta_(std::move(theta)), hold_(hold) {
  check::that(possible(model_, theta_), "motion simulation", "a model whose inertia can be inverted");
  inverse_inertia_ = core::inverse(inertia(model_, theta_));
  joints_from_coordinates_ = core::inverse(model_.motion);
}

void MotionSimulation::restart(double t, const Eigen::VectorXd& speed, const Eigen::VectorXd& effort) {
  t_ = t;
  heading_ = 0.0;
  joint_ = speed;
  speed_ = model_.motion * speed;
  effort_ = effort;
}

Eigen::VectorXd MotionSimulation::acceleration(const Eigen::VectorXd& speed, const Eigen::VectorXd& effort,
                                               double heading) const {
  const Eigen::VectorXd joints = joints_from_coordinates_ * speed;
  const Eigen::VectorXd exact = Eigen::VectorXd::Zero(joints.size());
  const auto span = [](const Eigen::VectorXd& v) {
    return std::span<const double>(v.data(), static_cast<std::size_t>(v.size()));
  };
  const model::MotionState state{span(speed), span(exact), span(joints), span(exact), heading, 0.0};
  Eigen::VectorXd force = model_.input * effort;
  for (const Term& term : model_.terms) {
    if (term.kind == Term::Kind::acceleration) {
      continue;
    }
    const double value =
        term.kind == Term::Kind::speed ? speed[static_cast<Eigen::Index>(term.coordinate)] : term.function(state).value;
    force[static_cast<Eigen::Index>(term.output)] -=
        term.scale * value * theta_[static_cast<Eigen::Index>(term.parameter)];
  }
  return inverse_inertia_ * force;
}

const Eigen::VectorXd& MotionSimulation::step(double t, const Eigen::VectorXd& effort) {
  const double whole = t - t_;
  const double h = whole / kSubsteps;
  const auto effort_at = [&](double share) -> Eigen::VectorXd {
    return hold_ == Hold::zero_order ? effort_ : Eigen::VectorXd(effort_ + share * (effort - effort_));
  };
  for (int k = 0; k < kSubsteps; ++k) {
    const double begin = static_cast<double>(k) / kSubsteps;
    const Eigen::VectorXd e0 = effort_at(begin), e1 = effort_at(begin + 0.5 / kSubsteps),
                          e2 = effort_at(begin + 1.0 / kSubsteps);
    const Eigen::VectorXd k1 = acceleration(speed_, e0, heading_);
    const Eigen::VectorXd k2 = acceleration(speed_ + 0.5 * h * k1, e1, heading_);
    const Eigen::VectorXd k3 = acceleration(speed_ + 0.5 * h * k2, e1, heading_);
    const Eigen::VectorXd k4 = acceleration(speed_ + h * k3, e2, heading_);
    const Eigen::VectorXd before = speed_;
    speed_ += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    if (model_.heading_coordinate >= 0) {
      heading_ += 0.5 * h * (before[model_.heading_coordinate] + speed_[model_.heading_coordinate]);
    }
  }
  t_ = t;
  effort_ = effort;
  joint_ = joints_from_coordinates_ * speed_;
  return joint_;
}

InstrumentStream::InstrumentStream(LogSource& log, RegressorFilter rows, const InstrumentMotion& motion)
    : log_(&log),
      rows_(std::move(rows)),
      instruments_(rows_.model(), rows_.design(),
                   of_instruments(rows_.measurement(), motion.kind == InstrumentMotion::Kind::commanded
                                                           ? motion.columns
                                                           : rows_.measurement().motion_columns)) {
  const auto find = [&](const std::string& name) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    return *column;
  };
  for (const auto& name : rows_.measurement().columns()) {
    pick_.push_back(find(name));
  }
  if (motion.kind == InstrumentMotion::Kind::commanded) {
    for (const auto& name : motion.columns) {
      commands_.push_back(find(name));
    }
  } else {
    check::that(!rows_.measurement().effort_unsigned, "motion simulation", "efforts with their signs");
    simulation_.emplace(rows_.model(), motion.theta, rows_.measurement().hold);
  }
  sample_.resize(pick_.size());
  instrument_sample_.resize(2 * rows_.model().joints.size());
  rewind();
}

void InstrumentStream::begin_segment() {
  rows_.restart();
  instruments_.restart();
  fresh_ = true;
}

void InstrumentStream::rewind() {
  log_->rewind();
  measured_squares_ = made_squares_ = 0.0;
  begin_segment();
}

double InstrumentStream::speed_ratio() const {
  return measured_squares_ > 0.0 ? std::sqrt(made_squares_ / measured_squares_) : 0.0;
}

void InstrumentStream::make_motion(double t, std::size_t k) {
  const std::size_t joints = rows_.model().joints.size();
  for (std::size_t j = 0; j < joints; ++j) {
    instrument_sample_[joints + j] = sample_[joints + j];
  }
  if (simulation_) {
    const auto size = static_cast<Eigen::Index>(joints);
    const Eigen::Map<const Eigen::VectorXd> effort(sample_.data() + joints, size);
    if (fresh_) {
      const bool angles = rows_.measurement().motion == MotionKind::angle;
      const Eigen::Map<const Eigen::VectorXd> speed(sample_.data(), size);
      const Eigen::VectorXd start = angles ? Eigen::VectorXd(Eigen::VectorXd::Zero(size)) : Eigen::VectorXd(speed);
      simulation_->restart(t, start, effort);
      Eigen::Map<Eigen::VectorXd>(instrument_sample_.data(), size) = start;
    } else {
      Eigen::Map<Eigen::VectorXd>(instrument_sample_.data(), size) = simulation_->step(t, effort);
    }
  } else {
    for (std::size_t j = 0; j < joints; ++j) {
      instrument_sample_[j] = scratch_.columns[commands_[j]][k];
    }
  }
  fresh_ = false;
  if (rows_.measurement().motion != MotionKind::angle) {
    for (std::size_t j = 0; j < joints; ++j) {
      measured_squares_ += sample_[j] * sample_[j];
      made_squares_ += instrument_sample_[j] * instrument_sample_[j];
    }
  }
}

bool InstrumentStream::next(RegressionBlock& block) {
  if (!log_->next(scratch_)) {
    block.resize(0, outputs(), parameters());
    return false;
  }
  const auto n = static_cast<Eigen::Index>(outputs());
  const auto p = static_cast<Eigen::Index>(rows_.model().p());
  block.resize(scratch_.rows(), outputs(), parameters());
  std::size_t kept = 0;
  std::size_t segment = 0;
  for (std::size_t k = 0; k < scratch_.rows(); ++k) {
    if (segment < scratch_.segment_starts.size() && scratch_.segment_starts[segment] == k) {
      begin_segment();
      ++segment;
    }
    for (std::size_t c = 0; c < pick_.size(); ++c) {
      sample_[c] = scratch_.columns[pick_[c]][k];
    }
    const double t = scratch_.t[k];
    make_motion(t, k);
    const bool has_row = rows_.step(t, sample_);
    const bool has_instrument = instruments_.step(t, instrument_sample_);
    if (!has_row || !has_instrument) {
      continue;
    }
    const auto at = static_cast<Eigen::Index>(kept) * n;
    block.sample[kept] = scratch_.first_row + k;
    block.t[kept] = t;
    block.Y.block(at, 0, n, p) = rows_.row().Y;
    block.Y.block(at, p, n, p) = instruments_.row().Y;
    block.dY.block(at, 0, n, p) = rows_.row().dY;
    block.dY.block(at, p, n, p).setZero();
    block.y.segment(at, n) = rows_.row().y;
    block.dy.segment(at, n) = rows_.row().dy;
    ++kept;
  }
  block.shorten(kept);
  return true;
}

}  // namespace wheelwright::identify
