// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/survey.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace wheelwright {
namespace {

// The last two windows of one joint.
class JointWatch {
 public:
  void restart() { filled_ = 0; }

  void add(double t, double value, bool is_angle, double& top_speed, double& top_acceleration, double& reversals) {
    const std::size_t n = times_.size();
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
  std::array<double, 2 * kSurveyWindow + 1> times_{}, values_{};
  std::size_t filled_ = 0;
  double direction_ = 0.0;
};

}  // namespace

Survey survey(LogSource& log, const Measurement& measurement) {
  Survey s;
  s.median_step = log.median_step();
  const std::size_t joints = measurement.motion_columns.size();
  s.largest_speed.assign(joints, 0.0);
  s.largest_acceleration.assign(joints, 0.0);
  s.reversals.assign(joints, 0.0);
  std::vector<std::size_t> pick;
  for (const auto& name : measurement.motion_columns) {
    pick.push_back(*log.find(name));
  }
  std::vector<JointWatch> watch(joints);
  const bool is_angle = measurement.motion == MotionKind::angle;
  double segment_start = 0.0;
  double before = 0.0;
  const auto close_segment = [&] {
    const double length = before - segment_start;
    s.seconds += length;
    s.longest_segment = std::max(s.longest_segment, length);
  };
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const double t = block.t[k];
      if (segment < block.segment_starts.size() && block.segment_starts[segment] == k) {
        if (s.segments > 0) {
          close_segment();
        }
        ++segment;
        ++s.segments;
        segment_start = t;
        for (JointWatch& w : watch) {
          w.restart();
        }
      } else {
        s.largest_step = std::max(s.largest_step, t - before);
      }
      before = t;
      for (std::size_t j = 0; j < joints; ++j) {
        watch[j].add(t, block.columns[pick[j]][k], is_angle, s.largest_speed[j], s.largest_acceleration[j],
                     s.reversals[j]);
      }
    }
    s.rows += block.rows();
  }
  if (s.segments > 0) {
    close_segment();
  }
  log.rewind();
  return s;
}

double interpolation_error(const Survey& survey, MotionKind motion) {
  double acceleration = 0.0;
  for (const double a : survey.largest_acceleration) {
    acceleration = std::max(acceleration, a);
  }
  const double h = survey.largest_step;
  if (motion == MotionKind::speed) {
    return acceleration * h / 8.0 / static_cast<double>(kSurveyWindow);
  }
  return acceleration * h * h / 8.0;
}

}  // namespace wheelwright
