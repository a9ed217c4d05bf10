// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/row_cleaner.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/log_columns.hpp>

namespace wheelwright {

RowCleaner::RowCleaner(const std::vector<std::string>& names, LogReport* report) : names_{"t"}, report_(report) {
  names_.insert(names_.end(), names.begin(), names.end());
  for (const std::string& name : names_) {
    const LogColumn* column = find_log_column(name);
    limits_.push_back(column != nullptr ? column->limit : std::numeric_limits<double>::max());
    if (name == "theta") {
      theta_ = limits_.size() - 1;
    } else if (name == "phi_r" || name == "phi_l") {
      wheels_.push_back({.index = limits_.size() - 1});
    }
  }
}

void RowCleaner::begin_file(std::string place) {
  place_ = std::move(place);
  fresh_ = true;
  for (WheelAngle& wheel : wheels_) {
    wheel = {.index = wheel.index};
  }
}

RowOutcome RowCleaner::place(std::span<double> row, std::size_t number) {
  const double t = row[0];
  bool starts = fresh_;
  if (!fresh_) {
    const double step = t - t_;
    if (step == 0.0) {
      count(&LogReport::duplicates, number);
      return RowOutcome::dropped;
    }
    if (step < 0.0) {
      count(&LogReport::resets, number);
      starts = true;
    } else if (step > longest_step_) {
      count(&LogReport::gaps, number);
      starts = true;
    }
  }
  t_ = t;
  fresh_ = false;
  if (report_ != nullptr) {
    ++report_->rows_read;
    ++report_->rows;
  }
  if (theta_ != 0) {
    unwrap(row[theta_], starts, number);
  }
  for (WheelAngle& wheel : wheels_) {
    unwrap(wheel, row[wheel.index], starts, number);
  }
  return starts ? RowOutcome::new_segment : RowOutcome::row;
}

RowOutcome RowCleaner::clean(std::span<double> row, std::size_t number) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!std::isfinite(row[k])) {
      count(&LogReport::not_finite, number, names_[k]);
      return RowOutcome::dropped;
    }
  }
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!(std::abs(row[k]) <= limits_[k])) {
      throw InputError(fmt::format("{}: column {}: '{}': {}", at(number), names_[k], row[k], expectation(k)));
    }
  }
  return place(row, number);
}

void RowCleaner::unwrap(double& theta, bool new_segment, std::size_t number) {
  if (new_segment) {
    turns_ = 0.0;
  } else if (std::abs(theta - theta_before_) > std::numbers::pi) {
    turns_ -= std::round((theta - theta_before_) / (2.0 * std::numbers::pi));
    if (report_ != nullptr && report_->wraps.count++ == 0) {
      report_->wraps.first = at(number);
    }
  }
  theta_before_ = theta;
  theta += turns_ * 2.0 * std::numbers::pi;
}

void RowCleaner::unwrap(WheelAngle& wheel, double& angle, bool new_segment, std::size_t number) {
  constexpr double turn = 2.0 * std::numbers::pi, small = 0.5 * std::numbers::pi, slack = 1e-3;
  constexpr std::size_t few = 3;
  const double step = angle - wheel.before;
  wheel.least = std::min(wheel.least, angle);
  wheel.most = std::max(wheel.most, angle);
  if (new_segment) {
    wheel.turns = 0.0;
  } else if (std::abs(step) > std::numbers::pi && std::abs(std::abs(step) - turn) < small && wheel.steps >= few &&
             wheel.largest_step < small && wheel.most - wheel.least <= turn + slack) {
    wheel.turns -= std::copysign(1.0, step);
    if (report_ != nullptr && report_->angle_wraps.count++ == 0) {
      report_->angle_wraps.first = at(number) + ", column " + names_[wheel.index];
    }
  } else {
    wheel.largest_step = std::max(wheel.largest_step, std::abs(step));
    ++wheel.steps;
  }
  wheel.before = angle;
  angle += wheel.turns * turn;
}

void RowCleaner::count(Occurrences LogReport::*what, std::size_t number, std::string_view detail) {
  if (report_ == nullptr) {
    return;
  }
  Occurrences& met = report_->*what;
  if (met.count++ == 0) {
    met.first = at(number) + (detail.empty() ? "" : fmt::format(", column {}", detail));
  }
  const bool row_lost = what != &LogReport::resets && what != &LogReport::gaps;
  report_->rows_read += row_lost ? 1 : 0;
}

std::string RowCleaner::at(std::size_t number) const { return fmt::format("{}{}", place_, number); }

std::string RowCleaner::expectation(std::size_t index) const {
  const LogColumn* column = find_log_column(names_[index]);
  return column == nullptr ? "expected a finite number"
                           : fmt::format("expected {} in {}, of magnitude at most {:g}", column->meaning, column->unit,
                                         column->limit);
}

}  // namespace wheelwright
