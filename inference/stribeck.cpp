// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/stribeck.hpp>

#include <cmath>
#include <string>

#include <ceres/jet.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright::inference {
namespace {

using Jet = ceres::Jet<double, 1>;

// exp(−(|ω|/ω_s)²) sgn ω
Jet stribeck(double omega, const Jet& omega_s) {
  if (omega == 0.0) {
    return Jet(0.0);
  }
  const Jet ratio = omega / omega_s;
  return (omega > 0.0 ? 1.0 : -1.0) * exp(-ratio * ratio);
}

}  // namespace

StribeckRows::StribeckRows(LogSource& log, RegressorFilter filter)
    : kernel_(filter.design(), filter.measurement().motion, filter.measurement().nominal_step),
      input_(filter.model().input) {
  const Measurement& measurement = filter.measurement();
  const std::vector<std::size_t> pick = core::positions_of(log, measurement.columns());
  const auto joints = filter.model().joints.size();
  std::vector<double> sample(pick.size()), speeds, Y, y;
  std::size_t seen = 0;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    if (starts) {
      filter.restart();
      seen = 0;
    }
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = block.columns[pick[c]][k];
    }
    const bool gives_row = filter.step(block.t[k], sample);
    if (filter.instants() != 0 && filter.instants() != seen) {
      instants_.push_back({filter.step_length(), filter.instants() == 1, gives_row});
      const Eigen::VectorXd& speed = filter.joint_speed();
      speeds.insert(speeds.end(), speed.data(), speed.data() + speed.size());
    }
    seen = filter.instants();
    if (gives_row) {
      const filter::FilteredRow& row = filter.row();
      Y.insert(Y.end(), row.Y.data(), row.Y.data() + row.Y.size());
      y.insert(y.end(), row.y.data(), row.y.data() + row.y.size());
    }
  });
  check::that(!y.empty(), "log", "at least one filtered row");
  response_ = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
  Y_ = Eigen::Map<const core::RowMatrix>(Y.data(), response_.size(), static_cast<Eigen::Index>(filter.model().p()));
  speed_ = Eigen::Map<const Eigen::MatrixXd>(speeds.data(), static_cast<Eigen::Index>(joints),
                                             static_cast<Eigen::Index>(instants_.size()));
}

bool StribeckRows::evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const {
  if (!(shape[0] > 0.0)) {
    return false;
  }
  const Jet omega_s(shape[0], 0);
  const Eigen::Index p = Y_.cols();
  const auto n = input_.rows();
  at.offset.resize(0);
  at.offset_by.clear();
  at.columns.resize(response_.size(), p + 1);
  at.columns.leftCols(p) = Y_;
  at.columns_by.assign(derivatives ? 1 : 0, Eigen::MatrixXd::Zero(response_.size(), p + 1));
  const auto joints = static_cast<std::size_t>(speed_.rows());
  std::vector<filter::KernelState> value(joints), slope(joints);
  std::vector<Jet> before(joints);
  Eigen::VectorXd filtered(speed_.rows()), filtered_slope(speed_.rows());
  filter::FilterKernel kernel = kernel_;
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < instants_.size(); ++k) {
    const Instant& instant = instants_[k];
    double share_before = 0.0;
    const double share = 0.5 * instant.length;
    if (!instant.begins) {
      kernel.prepare(instant.length);
      share_before = kernel.nodes() ? 0.5 * instants_[k - 1].length : share;
    }
    for (std::size_t j = 0; j < joints; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const Jet now = stribeck(speed_(i, static_cast<Eigen::Index>(k)), omega_s);
      if (instant.begins) {
        value[j] = slope[j] = {};
      } else {
        kernel.take(value[j], share_before * before[j].a + share * now.a);
        kernel.take(slope[j], share_before * before[j].v[0] + share * now.v[0]);
      }
      before[j] = now;
      filtered[i] = kernel.value(value[j]);
      filtered_slope[i] = kernel.value(slope[j]);
    }
    if (instant.gives_row) {
      at.columns.col(p).segment(next, n) = input_ * filtered;
      if (derivatives) {
        at.columns_by[0].col(p).segment(next, n) = input_ * filtered_slope;
      }
      next += n;
    }
  }
  return true;
}

}  // namespace wheelwright::inference
