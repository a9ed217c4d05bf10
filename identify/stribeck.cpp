// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/stribeck.hpp>

#include <cmath>
#include <string>

#include <ceres/jet.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/filter/exact.hpp>

namespace wheelwright {
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
    : design_(filter.design()), input_(filter.model().input) {
  const Measurement& measurement = filter.measurement();
  std::vector<std::size_t> pick;
  for (const std::string& name : measurement.columns()) {
    const auto at = log.find(name);
    check::that(at.has_value(), "log", "a column '" + name + "'");
    pick.push_back(*at);
  }
  const auto joints = filter.model().joints.size();
  const bool angles = measurement.motion == MotionKind::angle;
  std::vector<double> sample(pick.size()), motion(joints), before(joints), speeds, Y, y;
  double last = 0.0;
  bool second = false;  // the sample before started a segment
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const bool starts = segment < block.segment_starts.size() && block.segment_starts[segment] == k;
      if (starts) {
        filter.restart();
        ++segment;
      }
      for (std::size_t c = 0; c < pick.size(); ++c) {
        sample[c] = block.columns[pick[c]][k];
      }
      before.swap(motion);
      for (std::size_t j = 0; j < joints; ++j) {
        const double q = measurement.count;
        motion[j] = q > 0.0 ? std::round(sample[j] / q) * q : sample[j];
      }
      const bool gives_row = filter.step(block.t[k], sample);
      // An angle makes an instant together with the one before it, half-way between them.
      if (!angles) {
        instants_.push_back({block.t[k], starts, gives_row});
        speeds.insert(speeds.end(), motion.begin(), motion.end());
      } else if (!starts) {
        instants_.push_back({0.5 * (last + block.t[k]), second, gives_row});
        for (std::size_t j = 0; j < joints; ++j) {
          speeds.push_back((motion[j] - before[j]) / (block.t[k] - last));
        }
      }
      second = starts;
      last = block.t[k];
      if (gives_row) {
        const FilteredRow& row = filter.row();
        Y.insert(Y.end(), row.Y.data(), row.Y.data() + row.Y.size());
        y.insert(y.end(), row.y.data(), row.y.data() + row.y.size());
      }
    }
  }
  check::that(!y.empty(), "log", "at least one filtered row");
  response_ = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
  Y_ = Eigen::Map<const RowMatrix>(Y.data(), response_.size(), static_cast<Eigen::Index>(filter.model().p()));
  speed_ = Eigen::Map<const Eigen::MatrixXd>(speeds.data(), static_cast<Eigen::Index>(joints),
                                             static_cast<Eigen::Index>(instants_.size()));
}

bool StribeckRows::evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const {
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
  std::vector<Cascade> value(joints), slope(joints);
  std::vector<Jet> before(joints);
  Eigen::VectorXd filtered(speed_.rows()), filtered_slope(speed_.rows());
  const auto output = [&](const Cascade& c) {
    return design_.order == 1 ? design_.alpha * c.z1 : design_.alpha * design_.alpha * c.z2;
  };
  StepWeights weights;
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < instants_.size(); ++k) {
    const Instant& instant = instants_[k];
    const double h = instant.begins ? 0.0 : instant.t - instants_[k - 1].t;
    if (!instant.begins && h != weights.step()) {
      weights = StepWeights(design_.beta, h);
    }
    for (std::size_t j = 0; j < joints; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const Jet now = stribeck(speed_(i, static_cast<Eigen::Index>(k)), omega_s);
      if (instant.begins) {
        value[j] = slope[j] = {};
      } else {
        value[j].linear(weights, before[j].a, now.a);
        slope[j].linear(weights, before[j].v[0], now.v[0]);
      }
      before[j] = now;
      filtered[i] = output(value[j]);
      filtered_slope[i] = output(slope[j]);
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

}  // namespace wheelwright
