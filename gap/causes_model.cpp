// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/causes_model.hpp>

#include <algorithm>
#include <cmath>

namespace wheelwright {
namespace {

constexpr double kStep = 1e-3;  // of differences, share of a shape

// Rows of all spaces one after the other, in units of their floors.
Eigen::VectorXd stacked(const GapRows& rows, const std::vector<Eigen::VectorXd>& parts) {
  Eigen::Index size = 0;
  for (const RowSpace& space : rows.spaces) {
    size += space.t.size();
  }
  Eigen::VectorXd all = Eigen::VectorXd::Zero(size);
  Eigen::Index at = 0;
  for (std::size_t s = 0; s < rows.spaces.size(); ++s) {
    const Eigen::Index n = rows.spaces[s].t.size();
    if (parts[s].size() > 0) {
      all.segment(at, n) = parts[s] / rows.spaces[s].floor;
    }
    at += n;
  }
  return all;
}

}  // namespace

std::vector<Eigen::VectorXd> column_parts(const GapRows& rows, std::size_t column) {
  std::vector<Eigen::VectorXd> parts;
  for (const RowSpace& space : rows.spaces) {
    parts.push_back(space.columns[column]);
  }
  return parts;
}

CausesModel::CausesModel(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set, BaseModel base)
    : prepared_(prepared), problem_(problem) {
  for (const std::size_t c : set.members) {
    members_.push_back(problem.table.candidates[c]);
  }
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? problem.table.base : problem.table.unknown;
  for (const std::size_t column : theta) {
    theta_.push_back(stacked(problem.rows, column_parts(problem.rows, column)));
  }
  std::vector<Eigen::VectorXd> response;
  for (const RowSpace& space : problem.rows.spaces) {
    response.push_back(space.response);
  }
  response_ = stacked(problem.rows, response);
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const Effect& effect = prepared.catalogue[members_[k].effect];
    for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
      if (!effect.shapes[s].discrete) {
        const Interval bounds = shape_bounds(effect.shapes[s], prepared.drive);
        const double sign = effect.shapes[s].both_signs && members_[k].shape[s] < 0.0 ? -1.0 : 1.0;
        free_.push_back({k, s, std::min(sign * bounds.lower, sign * bounds.upper),
                         std::max(sign * bounds.lower, sign * bounds.upper), effect.shapes[s].logarithmic});
      }
    }
  }
  for (const Candidate& member : members_) {
    linear_ += member.unit_coefficient ? 0 : static_cast<Eigen::Index>(member.columns.size());
  }
}

Eigen::VectorXd CausesModel::start() const {
  Eigen::VectorXd shape(shapes());
  for (std::size_t k = 0; k < free_.size(); ++k) {
    shape[static_cast<Eigen::Index>(k)] =
        std::clamp(members_[free_[k].member].shape[free_[k].shape], free_[k].lower, free_[k].upper);
  }
  return shape;
}

std::vector<double> CausesModel::shape_of(std::size_t k, const Eigen::VectorXd& shape) const {
  std::vector<double> own = members_[k].shape;
  for (std::size_t f = 0; f < free_.size(); ++f) {
    if (free_[f].member == k) {
      own[free_[f].shape] = shape[static_cast<Eigen::Index>(f)];
    }
  }
  return own;
}

std::vector<std::vector<Eigen::VectorXd>> CausesModel::parts_of(std::size_t k, const std::vector<double>& shape) const {
  std::vector<std::vector<Eigen::VectorXd>> parts;
  for (const Column& column : prepared_.catalogue[members_[k].effect].columns(prepared_.drive, shape)) {
    parts.push_back(rows_of(prepared_.drive, problem_.rows, column, prepared_.row_options));
  }
  return parts;
}

bool CausesModel::evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const {
  fill(shape, at.offset, at.columns);
  at.offset_by.clear();
  at.columns_by.clear();
  for (Eigen::Index f = 0; derivatives && f < shapes(); ++f) {
    const double step = kStep * std::max(std::abs(shape[f]), 1e-9);
    Eigen::VectorXd above = shape, below = shape;
    above[f] += step;
    below[f] -= step;
    Eigen::VectorXd offset_above, offset_below;
    Eigen::MatrixXd columns_above, columns_below;
    fill(above, offset_above, columns_above);
    fill(below, offset_below, columns_below);
    at.offset_by.emplace_back((offset_above - offset_below) / (2.0 * step));
    at.columns_by.emplace_back((columns_above - columns_below) / (2.0 * step));
  }
  return true;
}

void CausesModel::fill(const Eigen::VectorXd& shape, Eigen::VectorXd& offset, Eigen::MatrixXd& columns) const {
  offset = Eigen::VectorXd::Zero(response_.size());
  columns.resize(response_.size(), this->columns());
  Eigen::Index at = 0;
  for (const Eigen::VectorXd& column : theta_) {
    columns.col(at++) = column;
  }
  for (std::size_t k = 0; k < members_.size(); ++k) {
    for (const std::vector<Eigen::VectorXd>& part : parts_of(k, shape_of(k, shape))) {
      if (members_[k].unit_coefficient) {
        offset += stacked(problem_.rows, part);
      } else {
        columns.col(at++) = stacked(problem_.rows, part);
      }
    }
  }
}

}  // namespace wheelwright
