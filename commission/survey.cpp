// SPDX-License-Identifier: Apache-2.0
#include "commission/survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/statistics.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kMostLost = 6.5;  // nominal steps: five rows

// The last two windows of one joint.
class JointWatch {
 public:
  void restart() {
    filled_ = 0;
    steps_ = 0;
    changes_ = 0;
  }

  // Standard deviation of the changes of the speed by noise alone: third differences of white noise σ have 20 σ², first
  // ones 2 σ².
  [[nodiscard]] double change_noise() {
    constexpr double kMedianOfNormal = 0.6744897501960817;
    return thirds_.empty() ? 0.0 : core::median(std::move(thirds_)) / kMedianOfNormal / std::sqrt(10.0);
  }

  void add(double t, double value, bool is_angle, double& top_speed, double& top_acceleration, double& sharpest,
           double& reversals) {
    const std::size_t n = times_.size();
    look_at_step(t, value, is_angle, sharpest);
    times_[filled_ % n] = t;
    values_[filled_ % n] = value;
    ++filled_;
    const auto back = [&](std::size_t k) { return (filled_ - 1 - k) % n; };
    if (filled_ <= kSurveyWindow) {
      top_speed = is_angle ? top_speed : std::max(top_speed, std::abs(value));
      return;
    }
    const double window = t - times_[back(kSurveyWindow)];
    const double change = (value - values_[back(kSurveyWindow)]) / window;
    const double speed = is_angle ? change : value;
    top_speed = std::max(top_speed, std::abs(speed));
    if (speed * direction_ < 0.0) {
      reversals += 1.0;
    }
    direction_ = speed != 0.0 ? speed : direction_;
    if (!is_angle) {
      top_acceleration = std::max(top_acceleration, std::abs(change));
    } else if (filled_ > 2 * kSurveyWindow) {
      const double before = (values_[back(kSurveyWindow)] - values_[back(2 * kSurveyWindow)]) /
                            (times_[back(kSurveyWindow)] - times_[back(2 * kSurveyWindow)]);
      top_acceleration = std::max(top_acceleration, std::abs(change - before) / window);
    }
  }

 private:
  // Change of the speed from one step to the next.
  void look_at_step(double t, double value, bool is_angle, double& sharpest) {
    const double h = t - last_t_;
    if (!is_angle) {
      sharpest = steps_ > 0 ? std::max(sharpest, std::abs(value - last_) / h) : sharpest;
      if (steps_ > 0) {
        add_change(value - last_);
      }
    } else if (steps_ > 0) {
      const double slope = (value - last_) / h;
      if (steps_ > 1) {
        sharpest = std::max(sharpest, std::abs(slope - last_slope_) / (0.5 * (h + last_step_)));
        add_change(slope - last_slope_);
      }
      last_slope_ = slope;
    }
    last_step_ = h;
    last_t_ = t;
    last_ = value;
    ++steps_;
  }

  void add_change(double change) {
    constexpr std::size_t kMost = 65536;
    if (changes_ >= 2 && thirds_.size() < kMost) {
      thirds_.push_back(std::abs(change - 2.0 * before_ + before_that_));
    }
    before_that_ = before_;
    before_ = change;
    ++changes_;
  }

  std::vector<double> thirds_;
  std::size_t changes_ = 0;
  double before_ = 0.0, before_that_ = 0.0;
  std::size_t steps_ = 0;
  double last_t_ = 0.0, last_ = 0.0, last_step_ = 0.0, last_slope_ = 0.0;
  std::array<double, 2 * kSurveyWindow + 1> times_{}, values_{};
  std::size_t filled_ = 0;
  double direction_ = 0.0;
};

// Rows between two losses: how often they come, and how their number scatters.
class LossWatch {
 public:
  explicit LossWatch(double median_step) : median_step_(median_step) {}

  void restart() { rows_ = 0.0; }

  void add(double step) {
    rows_ += 1.0;
    if (step > 1.5 * median_step_ && step < kMostLost * median_step_) {
      losses_ += 1.0;
      sum_ += rows_;
      squares_ += rows_ * rows_;
      rows_ = 0.0;
    }
  }

  void tell(Survey& s) const {
    s.losses = static_cast<std::size_t>(losses_);
    const double mean = sum_ / std::max(losses_, 1.0);
    s.losses_scatter = mean > 0.0 ? std::sqrt(std::max(squares_ / losses_ - mean * mean, 0.0)) / mean : 0.0;
  }

 private:
  double median_step_;
  double rows_ = 0.0, losses_ = 0.0, sum_ = 0.0, squares_ = 0.0;
};

}  // namespace

Survey survey(LogSource& log, const Measurement& measurement) {
  Survey s;
  s.median_step = log.median_step();
  const std::size_t joints = measurement.motion_columns.size();
  s.largest_speed.assign(joints, 0.0);
  s.largest_acceleration.assign(joints, 0.0);
  s.sharpest_change.assign(joints, 0.0);
  s.reversals.assign(joints, 0.0);
  const std::vector<std::size_t> pick = core::positions_of(log, measurement.motion_columns);
  std::vector<JointWatch> watch(joints);
  const bool is_angle = measurement.motion == MotionKind::angle;
  LossWatch losses(s.median_step);
  double segment_start = 0.0;
  double before = 0.0;
  const auto close_segment = [&] {
    const double length = before - segment_start;
    s.seconds += length;
    s.longest_segment = std::max(s.longest_segment, length);
  };
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    ++s.rows;
    const double t = block.t[k];
    if (starts) {
      if (s.segments > 0) {
        close_segment();
      }
      ++s.segments;
      segment_start = t;
      losses.restart();
      for (JointWatch& w : watch) {
        w.restart();
      }
    } else {
      s.largest_step = std::max(s.largest_step, t - before);
      losses.add(t - before);
    }
    before = t;
    for (std::size_t j = 0; j < joints; ++j) {
      watch[j].add(t, block.columns[pick[j]][k], is_angle, s.largest_speed[j], s.largest_acceleration[j],
                   s.sharpest_change[j], s.reversals[j]);
    }
  });
  if (s.segments > 0) {
    close_segment();
  }
  losses.tell(s);
  log.rewind();
  for (JointWatch& w : watch) {
    s.change_noise.push_back(w.change_noise());
  }
  return s;
}

bool loses_often(const Survey& survey) {
  constexpr double kOften = 2.0;     // 1/s
  constexpr double kAtRandom = 0.5;  // of Survey::losses_scatter
  return static_cast<double>(survey.losses) > kOften * survey.seconds && survey.losses_scatter > kAtRandom;
}

double acceleration_by_noise(const Survey& survey, std::size_t j, MotionKind motion, double motion_error,
                             double shortest_step) {
  const double h = survey.median_step;
  const double shortest = std::clamp(shortest_step > 0.0 ? shortest_step : h, 0.5 * h, h);
  const double bound = motion == MotionKind::speed ? 2.0 * motion_error / h : 4.0 * motion_error / (h * h);
  const double deviation = j < survey.change_noise.size() ? survey.change_noise[j] : 0.0;
  // The largest of n normal errors is below sqrt(2 ln 2n) standard deviations in half of the cases.
  const double largest =
      std::sqrt(2.0 * std::log(2.0 * static_cast<double>(std::max<std::size_t>(survey.rows, 1)))) + 1.0;
  return std::max(bound, largest * deviation / shortest);
}

std::vector<double> acceleration_limit(const Robot& robot, const Survey& survey, MotionKind motion,
                                       double motion_error) {
  std::vector<double> limit(survey.largest_acceleration.size());
  const auto declared = robot.limits.find("acceleration");
  // Two samples of a speed, the four of two steps of an angle.
  const double h = survey.median_step;
  const double noise = motion == MotionKind::speed ? 2.0 * motion_error / h : 4.0 * motion_error / (h * h);
  for (std::size_t j = 0; j < limit.size(); ++j) {
    const double sharp = j < survey.sharpest_change.size() ? survey.sharpest_change[j] - noise : 0.0;
    limit[j] = declared != robot.limits.end() ? declared->second
                                              : kBeyondSamples * std::max(survey.largest_acceleration[j], sharp);
  }
  return limit;
}

}  // namespace wheelwright::commission
